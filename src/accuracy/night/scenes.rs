//! A simulated night on disk, reduced with one setting and compared with its truth.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::accuracy::effort::Stopwatch;
use crate::base::error::{Error, Result};
use crate::base::progress::Silent;
use crate::config::Config;
use crate::pipeline::options::Options;
use crate::pipeline::run::run;
use crate::simulate::{Scenario, simulate};
use crate::tables::selection::is_used;
use crate::tables::{PhotometryRow, read_photometry};

/// One setting: its text, the keys it sets, and how many of the flats it is given.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setting {
    pub text: &'static str,
    pub sets: &'static [&'static str],
    pub flats: Option<usize>,
}

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Of {
    /// V of the satellite in each frame.
    Target,
    /// V of a source of the Sun's colour at three airmasses.
    Zeropoint,
}

impl Of {
    pub(super) fn name(self) -> &'static str {
        match self {
            Of::Target => "night",
            Of::Zeropoint => "night-zeropoint",
        }
    }
}

/// Airmasses and B−V at which zeropoints are compared.
const AIRMASSES: [f64; 3] = [1.1, 1.5, 2.0];
const B_V_MAG: f64 = 0.65;
/// Flats of a night.
const FLATS: usize = 9;

/// What a reduction gave: error and stated 1-sigma error of each magnitude \[mag\], and the CPU time \[s\].
#[derive(Debug, Clone)]
pub(super) struct Measured {
    pub errors: Vec<(f64, f64)>,
    pub cpu_s: f64,
}

/// A night in a folder that goes with it.
pub(super) struct Night {
    folder: tempfile::TempDir,
    of: Of,
    scenario: Scenario,
    frames: Vec<PathBuf>,
    pipeline_toml: PathBuf,
    /// Simulated V by the name of the frame.
    truth: HashMap<String, f64>,
}

/// What is read of truth/target.csv.
#[derive(Deserialize)]
struct TruthRow {
    frame: String,
    v_mag: Option<f64>,
}

impl Night {
    /// Draws a night, in moonlight and crowded with star trails, or with few of them.
    pub(super) fn simulated(seed: u64, crowded: bool, of: Of) -> Result<Self> {
        let (targets, pointings) = if of == Of::Target { (12, 5) } else { (0, 6) };
        // the scenario's seed is a number of TOML, which is signed
        let sets = [
            format!("seed={}", seed & i64::MAX as u64),
            format!("flats.n={FLATS}"),
            "flats.level_drift_frac=-0.03".into(),
            format!("target.n={targets}"),
            format!("pointings.n={pointings}"),
            "pointings.frames=2".into(),
            "photometric.pointing_scatter_mag=0.02".into(),
            "photometry.mesh_px=64".into(),
        ];
        let scenario = if crowded { Scenario::crowded_night(&sets)? } else { Scenario::demo_night(&sets)? };
        let folder = tempfile::tempdir().map_err(|e| Error::io(std::env::temp_dir(), e))?;
        let simulated = simulate(&scenario, &folder.path().join("raw"), &Silent)?;
        let truth = truth_of(&simulated.truth.join("target.csv"))?;
        let pipeline_toml = simulated.pipeline_toml;
        Ok(Self { folder, of, scenario, frames: simulated.frames, pipeline_toml, truth })
    }

    /// Frames the time of a reduction is divided by.
    pub(super) fn frames(&self) -> usize {
        match self.of {
            Of::Target => self.truth.len(),
            Of::Zeropoint => self.scenario.pointings.n * self.scenario.pointings.frames,
        }
        .max(1)
    }

    /// Reduces the night with one setting and compares it with its truth.
    ///
    /// # Errors
    /// As [`run`].
    pub(super) fn reduced(&self, setting: &Setting, stopwatch: &Stopwatch) -> Result<Measured> {
        let sets: Vec<String> = setting.sets.iter().map(|s| (*s).to_string()).collect();
        let mut config = Config::load(&self.pipeline_toml, &sets)?;
        config.night.output = self.folder.path().join("reduced");
        let is_flat =
            |path: &&PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("flat_"));
        let files = match setting.flats {
            None => Vec::new(),
            Some(n) => {
                let (flats, others): (Vec<&PathBuf>, Vec<&PathBuf>) = self.frames.iter().partition(is_flat);
                flats.into_iter().take(n).chain(others).cloned().collect()
            }
        };
        let options = Options { jobs: 1, no_figures: true, redo: true, files, ..Options::default() };
        let start = (stopwatch.cpu_s)();
        let summary = run(&config, &options, &Silent)?;
        let cpu_s = (stopwatch.cpu_s)() - start;
        let errors = match self.of {
            Of::Target => self.of_targets(&summary.folder)?,
            Of::Zeropoint => {
                let p = &self.scenario.photometric;
                let line = |x: f64| p.zp_mag + p.k_mag_airmass * x + p.c_mag_mag * B_V_MAG;
                let errors = summary
                    .zeropoint
                    .iter()
                    .flat_map(|z| AIRMASSES.map(|x| (-z.v_mag(0.0, x, B_V_MAG) - line(x), z.err_mag(x, B_V_MAG, 0.0))));
                errors.collect()
            }
        };
        Ok(Measured { errors, cpu_s })
    }

    fn of_targets(&self, reduced: &Path) -> Result<Vec<(f64, f64)>> {
        let (rows, _) = read_photometry(&reduced.join("photometry.ecsv"))?;
        let one = |row: &PhotometryRow| {
            let truth = self.truth.get(&row.frame)?;
            let error = row.v_mag? - truth;
            Some((error, row.v_mag_err?.hypot(row.v_mag_err_sys.unwrap_or(0.0))))
        };
        Ok(rows.iter().filter(|r| is_used(&r.status, &r.verdict)).filter_map(one).collect())
    }
}

fn truth_of(path: &Path) -> Result<HashMap<String, f64>> {
    let bad = |e: csv::Error| Error::Table { path: path.into(), line: None, problem: e.to_string() };
    let mut truth = HashMap::new();
    for row in csv::Reader::from_path(path).map_err(bad)?.deserialize() {
        let row: TruthRow = row.map_err(bad)?;
        truth.extend(row.v_mag.map(|v_mag| (row.frame, v_mag)));
    }
    Ok(truth)
}

#[cfg(test)]
mod tests {
    use super::super::{DEFAULT, Tally, set};
    use super::*;
    use crate::accuracy::Effort;

    #[test]
    fn a_night_gives_the_magnitudes_that_were_put_in_and_a_wrong_setting_shows() {
        let now = std::cell::Cell::new(0.0);
        let cpu_s = || {
            now.set(now.get() + 1.0);
            now.get()
        };
        let stopwatch = Stopwatch { cpu_s: &cpu_s, effort: Effort::Quick, seed: 0, progress: &Silent };
        let night = Night::simulated(77, false, Of::Target).unwrap();
        let usual = night.reduced(&DEFAULT, &stopwatch).unwrap();
        let mut sizes: Vec<f64> = usual.errors.iter().map(|(error, _)| error.abs()).collect();
        assert!(sizes.len() >= 8 && crate::base::stats::median(&mut sizes).unwrap() < 0.05, "{:?}", usual.errors);
        assert_eq!(usual.cpu_s, 1.0);
        // an extinction held at a wrong value
        let wrong = night.reduced(&set("", &["zeropoint.pin_k={value=1.12}"]), &stopwatch).unwrap();
        let mean = |m: &Measured| m.errors.iter().map(|e| e.0).sum::<f64>() / m.errors.len() as f64;
        assert!((mean(&wrong) - mean(&usual)).abs() > 0.05, "{} {}", mean(&wrong), mean(&usual));
        let mut tally = Tally::default();
        tally.add(&Measured { cpu_s: 3.0, ..usual }, 2.0);
        assert_eq!(tally.point("x", (10.0, true)).map(|p| p.cpu_us.median_us), Some(15.0));
    }
}
