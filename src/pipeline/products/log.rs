//! satphot.log.jsonl: what happened in a run, one JSON object a line, for programs that watch many nights.
//!
//! Seconds since the start. `stage` lines carry time, bytes and memory; `frame` lines the status and reason of every
//! frame; then `note`, `output` and `end`. It holds times, so it is not a data product. It does not cover the moment of
//! each single frame.

use std::path::Path;

use serde_json::{Value, json};

use super::record::Output;
use super::record::StageRecord;
use crate::base::error::Result;
use crate::base::file::write_atomic;
use crate::pipeline::products::summary::Summary;
use crate::tables::PhotometryRow;

/// Its name in the folder of the night.
pub const NAME: &str = "satphot.log.jsonl";

/// Writes the log of a finished run into `folder`.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_log(
    folder: &Path,
    stages: &[StageRecord],
    rows: &[PhotometryRow],
    outputs: &[Output],
    summary: &Summary,
) -> Result<()> {
    let mut lines: Vec<Value> = stages.iter().map(stage_line).collect();
    let end_of = |name: &str| stages.iter().find(|s| s.name == name).map_or(summary.elapsed_s, |s| s.end_s);
    for row in rows {
        let stage = if row.object_name == "flat" { "flat" } else { "target" };
        lines.push(json!({
            "t_s": end_of(stage), "event": "frame", "stage": stage, "frame": row.frame, "status": row.status,
            "verdict": row.verdict, "reason": row.reason,
        }));
    }
    let end_s = summary.elapsed_s;
    lines.extend(summary.all_notes().map(|text| json!({ "t_s": end_s, "event": "note", "text": text })));
    lines.extend(
        outputs
            .iter()
            .map(|o| json!({ "t_s": end_s, "event": "output", "path": o.path, "bytes": o.bytes, "sha256": o.sha256 })),
    );
    lines.push(json!({ "t_s": end_s, "event": "end", "counts": summary.counts, "poor": summary.poor }));
    let text: Vec<String> = lines.iter().map(|line| format!("{line}\n")).collect();
    write_atomic(&folder.join(NAME), text.concat().as_bytes())
}

fn stage_line(stage: &StageRecord) -> Value {
    json!({
        "t_s": stage.end_s, "event": "stage", "stage": stage.name, "wall_s": stage.wall_s, "cpu_s": stage.cpu_s,
        "bytes_read": stage.bytes_read, "peak_memory_mb": stage.peak_memory_mb,
    })
}
