//! manifest.json: what went in, with which program and configuration, how long each stage took, what was left out.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use crate::error::{Error, Result};
use crate::frames::Exposure;
use crate::night::bench::sha256_16;
use crate::night::outputs::save;
use crate::night::summary::Summary;
use crate::night::survey::Survey;
use crate::report::PhotometryRow;

/// One stage and its time.
#[derive(Debug, Clone, Serialize)]
pub struct Stage {
    /// Name.
    pub name: String,
    /// Wall time \[s\].
    pub wall_s: f64,
    /// Time of all cores together \[s\], where the system tells.
    pub cpu_s: Option<f64>,
}

/// Earth-reflected integrals really evaluated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Quadratures {
    /// Scenes modelled.
    pub scenes: usize,
    /// Integrals of sunlight by way of the Earth.
    pub sun: usize,
    /// Integrals of moonlight by way of the Earth.
    pub moon: usize,
}

/// One input file.
#[derive(Debug, Clone, Serialize)]
pub struct Input {
    /// Path as found.
    pub path: PathBuf,
    /// Size \[bytes\].
    pub bytes: u64,
    /// First 16 hex digits of the SHA-256.
    pub sha256: String,
    /// What it was taken for.
    pub role: String,
    /// Why.
    pub reason: String,
}

/// The inputs of a night, in the order of their roles.
#[must_use]
pub fn manifest_inputs(survey: &Survey, rows: &[PhotometryRow]) -> Vec<Input> {
    // a target frame was read for its row; two folders may hold files of one name
    let known = |path: &Path| {
        let name = crate::night::outputs::file_name(path);
        let mut same = survey.targets.iter().filter(|e| e.name == name);
        let alone = same.next().is_some_and(|e| e.path == path) && same.next().is_none();
        rows.iter().find(|r| alone && r.frame == name && !r.frame_sha256.is_empty())
    };
    let input = |path: &Path, role: &str, reason: &str| Input {
        path: path.to_path_buf(),
        bytes: std::fs::metadata(path).map_or(0, |m| m.len()),
        sha256: known(path).map(|r| r.frame_sha256.clone()).or_else(|| sha256_16(path).ok()).unwrap_or_default(),
        role: role.into(),
        reason: reason.into(),
    };
    let of = |e: &Exposure| input(&e.path, &format!("{:?}", e.role).to_lowercase(), &e.role_reason);
    let exposures = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
    let mut inputs: Vec<Input> = exposures.chain(&survey.others).map(of).collect();
    inputs.extend(survey.unreadable.iter().map(|u| input(&u.path, "unreadable", &u.error.to_string())));
    inputs
}

/// Hash over the names and hashes of all inputs, in their order.
#[must_use]
pub fn inputs_sha256(inputs: &[Input]) -> String {
    let lines: Vec<String> =
        inputs.iter().map(|i| format!("{} {}", crate::night::outputs::file_name(&i.path), i.sha256)).collect();
    crate::night::bench::sha256_16_text(&lines.join("\n"))
}

/// Largest resident memory of this process so far \[MB\], where the system tells.
#[must_use]
pub fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kb: f64 = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()?;
    Some(kb / 1024.0)
}

/// The provenance of one run.
#[derive(Debug)]
pub struct Manifest<'a> {
    /// Hash of the configuration in force.
    pub config_sha256: String,
    /// The files that went in.
    pub inputs: Vec<Input>,
    /// The flats of the master: file, level \[ADU\], whether used, and why not.
    pub flats: Vec<(PathBuf, f64, bool, String)>,
    /// Share of the master flat's pixels that are masked.
    pub flat_masked_frac: Option<f64>,
    /// The stages with their times.
    pub stages: Vec<Stage>,
    /// Earth-reflected integrals.
    pub quadratures: Quadratures,
    /// The night in numbers.
    pub summary: &'a Summary,
}

impl Manifest<'_> {
    /// Writes `manifest.json` and `satphot.log` into `folder`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, folder: &Path) -> Result<PathBuf> {
        let s = self.summary;
        let value = json!({
            "tool": concat!("satphot ", env!("CARGO_PKG_VERSION")),
            "night": s.night,
            "config_sha256": self.config_sha256,
            "inputs": self.inputs,
            "input_manifest_sha256": inputs_sha256(&self.inputs),
            "flats": self.flats.iter().map(|(path, level_adu, used, reason)| json!({
                "path": path, "level_adu": level_adu, "used": used, "reason": reason,
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
            "notes": s.notes,
            "poor": s.poor,
            "outputs": s.files,
        });
        let text = serde_json::to_string_pretty(&value).map_err(|e| Error::Table {
            path: folder.join("manifest.json"),
            line: None,
            problem: e.to_string(),
        })?;
        let path = folder.join("manifest.json");
        save(&path, &(text + "\n"))?;
        let mut log = s.text();
        for note in &s.notes {
            log.push_str(&format!("note: {note}\n"));
        }
        for (frame, status, reason) in &s.failures {
            log.push_str(&format!("{status}: {frame}: {reason}\n"));
        }
        save(&folder.join("satphot.log"), &log)?;
        Ok(path)
    }
}
