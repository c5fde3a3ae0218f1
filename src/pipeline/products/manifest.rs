//! manifest.json: what went in, with which program and configuration, how long each stage took, what was skipped.

use super::inputs::InputRole;
use super::inputs::inputs_sha256;
use super::record::Output;
use super::record::StageRecord;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::inputs::TOOL;
use super::inputs::named_files;
use crate::base::error::{Error, Result};
use crate::base::file::save;
use crate::base::foreign::shown;
use crate::base::hash::sha256_16;
use crate::base::path_text::path_text;
use crate::config::Config;
use crate::frames::Exposure;
use crate::pipeline::products::effective::relative_to;
use crate::pipeline::products::log::write_log;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::products::summary::Summary;
use crate::pipeline::shards::products::FrameCache;
use crate::pipeline::survey::files::Survey;
use crate::tables::PhotometryRow;

/// Its name in the folder of the night.
pub const NAME: &str = "manifest.json";

/// Earth-reflected integrals really evaluated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Quadratures {
    /// Scenes modelled.
    pub scenes: usize,
    /// Integrals of sunlight by way of the Earth.
    pub sun: usize,
    /// Integrals of moonlight by way of the Earth.
    pub moon: usize,
}

/// One input file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Input {
    /// Path as found.
    #[serde(with = "crate::base::path_text")]
    pub path: PathBuf,
    /// Size \[bytes\].
    pub bytes: u64,
    /// First 16 hex digits of the SHA-256.
    pub sha256: String,
    /// Its role.
    pub role: String,
    /// Why.
    pub reason: String,
}

/// The inputs of a night, in the order of their roles.
#[must_use]
pub fn manifest_inputs(survey: &Survey, products: &FrameCache) -> Vec<Input> {
    let input = |path: &Path, role: &str, reason: &str, sha256: String| Input {
        path: path.to_path_buf(),
        bytes: std::fs::metadata(path).map_or(0, |m| m.len()),
        sha256,
        role: role.into(),
        reason: reason.into(),
    };
    let of = |e: &Exposure| {
        // most frames were read for their rows
        let sha256 = products.sha256(&e.path).unwrap_or_default();
        input(&e.path, &format!("{:?}", e.role).to_lowercase(), &e.role_reason, sha256)
    };
    let refused =
        |path: &Path, role: InputRole, reason: &str| input(path, role.name(), reason, products.sha256_of_refused(path));
    let exposures = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
    let mut inputs: Vec<Input> = exposures.chain(&survey.others).map(of).collect();
    inputs.extend(survey.unreadable.iter().map(|u| refused(&u.path, InputRole::Unreadable, &u.error.to_string())));
    inputs.extend(survey.set_aside.iter().map(|s| refused(&s.path, InputRole::SetAside, &s.reason)));
    inputs
}

/// Largest resident memory of this process so far \[MB\], where the system reports it.
#[must_use]
pub fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kb: f64 = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()?;
    Some(kb / 1024.0)
}

/// Bytes this process has read so far, from wherever, where the system reports it.
#[must_use]
pub fn bytes_read() -> Option<u64> {
    let counters = std::fs::read_to_string("/proc/self/io").ok()?;
    counters.lines().find_map(|l| l.strip_prefix("rchar:"))?.trim().parse().ok()
}

/// Adds a file that was written after the manifest to its list of outputs.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] if the manifest cannot be read.
pub fn record(folder: &Path, path: &Path) -> Result<()> {
    let file = folder.join(NAME);
    let bad = |e: serde_json::Error| Error::Table { path: file.clone(), line: Some(e.line()), problem: e.to_string() };
    let text = std::fs::read_to_string(&file).map_err(|e| Error::io(&file, e))?;
    let mut manifest: serde_json::Value = serde_json::from_str(&text).map_err(bad)?;
    let output = serde_json::to_value(Output::of(folder, path)?).map_err(bad)?;
    if let Some(outputs) = manifest.get_mut("outputs").and_then(|o| o.as_array_mut()) {
        outputs.retain(|o| o.get("path") != output.get("path"));
        outputs.push(output);
    }
    save(&file, &(serde_json::to_string_pretty(&manifest).map_err(bad)? + "\n"))
}

/// An input as a manifest in `folder` records it: its path as found, and its path from that folder, which stays right
/// when a night is moved as a whole.
pub(crate) fn input_json(folder: &Path, i: &Input) -> serde_json::Value {
    json!({
        "path": path_text(&i.path), "from_here": path_text(&relative_to(folder, &i.path)), "bytes": i.bytes, "sha256": i.sha256,
        "role": i.role, "reason": i.reason,
    })
}

/// A file that the configuration names, with both paths as in [`input_json`].
pub(crate) fn file_json(folder: &Path, key: &str, path: &Path, sha256: &str) -> serde_json::Value {
    json!({ "key": key, "path": path_text(path), "from_here": path_text(&relative_to(folder, path)), "sha256": sha256 })
}

/// The provenance that every product states, as JSON.
pub(crate) fn provenance_json(provenance: &Provenance) -> serde_json::Map<String, serde_json::Value> {
    provenance.0.iter().map(|(key, value)| ((*key).to_string(), json!(value))).collect()
}

/// The provenance of one run.
#[derive(Debug)]
pub struct Manifest<'a> {
    /// The configuration in force.
    pub config: &'a Config,
    /// The provenance that every product states.
    pub provenance: &'a Provenance,
    /// Hash of the configuration in force.
    pub config_sha256: String,
    /// The files that went in.
    pub inputs: Vec<Input>,
    /// The flats of the master: file, level \[ADU\], whether used, and why not.
    pub flats: Vec<(PathBuf, f64, bool, String)>,
    /// Share of the master flat's pixels that are masked.
    pub flat_masked_frac: Option<f64>,
    /// The stages with their times.
    pub stages: Vec<StageRecord>,
    /// Earth-reflected integrals.
    pub quadratures: Quadratures,
    /// The rows of the night.
    pub rows: &'a [PhotometryRow],
    /// The night in numbers.
    pub summary: &'a Summary,
}

impl Manifest<'_> {
    /// Writes `manifest.json`, `satphot.log` and `satphot.log.jsonl` into `folder`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, folder: &Path) -> Result<PathBuf> {
        let s = self.summary;
        let outputs: Vec<Output> = s.files.iter().map(|path| Output::of(folder, path)).collect::<Result<_>>()?;
        let files = named_files(self.config)
            .into_iter()
            .map(|(key, path)| file_json(folder, key, &path, &sha256_16(&path).unwrap_or_default()));
        let value = json!({
            "schema": "satphot.manifest/2",
            "tool": TOOL,
            "night": s.night,
            "config_sha256": self.config_sha256,
            "provenance": provenance_json(self.provenance),
            "files": files.collect::<Vec<_>>(),
            "inputs": self.inputs.iter().map(|i| input_json(folder, i)).collect::<Vec<_>>(),
            "input_manifest_sha256": inputs_sha256(self.inputs.iter().map(|i| (i.path.as_path(), i.sha256.as_str()))),
            "flats": self.flats.iter().map(|(path, level_adu, used, reason)| json!({
                "path": path_text(path), "level_adu": level_adu, "used": used, "reason": reason,
            })).collect::<Vec<_>>(),
            "flat_masked_frac": self.flat_masked_frac,
            "stages": self.stages,
            "elapsed_s": s.elapsed_s,
            "peak_memory_mb": peak_memory_mb(),
            "system": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            "bytes": s.bytes,
            "counts": s.counts,
            "earth_quadratures": self.quadratures,
            "zeropoint_source": s.zeropoint_source,
            "left_out": s.empty_columns,
            "left_out_measured": s.explained,
            "kept": { "frames": s.kept.0, "of": s.kept.1 },
            "notes": s.notes,
            "details": s.details,
            "poor": s.poor,
            "outputs": &outputs,
        });
        let text = serde_json::to_string_pretty(&value).map_err(|e| Error::Table {
            path: folder.join(NAME),
            line: None,
            problem: e.to_string(),
        })?;
        let path = folder.join(NAME);
        save(&path, &(text + "\n"))?;
        let mut log = s.text();
        for note in s.all_notes() {
            log.push_str(&format!("note: {note}\n"));
        }
        for (frame, status, reason) in &s.failures {
            log.push_str(&format!("{status}: {frame}: {reason}\n"));
        }
        save(&folder.join("satphot.log"), &shown(&log))?;
        write_log(folder, &self.stages, self.rows, &outputs, s)?;
        Ok(path)
    }
}
