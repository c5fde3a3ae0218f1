//! A night as one call of the library: its rows, its zeropoint and what should be known about it.
//!
//! All of the work is in [`super::run`]; the tables it writes are read back, so that rows are those of the files.

use std::path::PathBuf;

use super::options::Options;
use super::run::run;
use crate::base::error::Result;
use crate::base::progress::Silent;
use crate::config::Config;
use crate::tables::{PhotometryRow, read_photometry};
use crate::zeropoint::fit::Zeropoint;

/// A reduced night.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ReducedNight {
    /// The photometry: a row for every target frame, and for every other frame that failed or was set aside, with its
    /// status, verdict and reason.
    pub rows: Vec<PhotometryRow>,
    /// The zeropoint of the night; `None` if magnitudes stay instrumental.
    pub zeropoint: Option<Zeropoint>,
    /// Notes for the observer, a sentence each.
    pub notes: Vec<String>,
    /// Why the night is not good enough to be called a success; empty if it is.
    pub problems: Vec<String>,
    /// The folder of the results, `<output>/<name>` of the configuration.
    pub folder: PathBuf,
    /// The closing summary, as the program prints it.
    pub summary: String,
}

/// Reduces a night: master flat, zeropoint from its star frames, photometry of its target frames, comparison with the model.
///
/// Writes the tables to `<output>/<name>/` of the configuration, as `satphot run` does, but draws no figures. Uses all cores.
/// Frames measured by an earlier run into the same folder are not measured again unless something they depend on changed.
///
/// # Errors
/// Anything that is missing before the work begins: configuration, headers, flats, catalogue, elements. A
/// frame that fails is a row with its reason, never an error; a poor night has [`ReducedNight::problems`].
///
/// ```
/// # let folder = tempfile::tempdir().unwrap();
/// let mut config = satphot::Config::load("fixtures/night/pipeline.toml".as_ref(), &[])?;
/// config.night.output = folder.path().into();
/// let night = satphot::reduce_night(&config)?;
///
/// let magnitudes: Vec<f64> = night.rows.iter().filter_map(|row| row.v_mag).collect();
/// assert!(magnitudes.len() >= 20);
/// let zeropoint = night.zeropoint.expect("the night has stars");
/// assert!((zeropoint.zp_mag - -23.37).abs() < 0.05); // of the simulation
/// # satphot::Result::Ok(())
/// ```
pub fn reduce_night(config: &Config) -> Result<ReducedNight> {
    let summary = run(config, &Options { no_figures: true, ..Options::default() }, &Silent)?;
    let (rows, _) = read_photometry(&summary.folder.join("photometry.ecsv"))?;
    Ok(ReducedNight {
        rows,
        summary: summary.text(),
        zeropoint: summary.zeropoint,
        notes: summary.notes,
        problems: summary.poor,
        folder: summary.folder,
    })
}
