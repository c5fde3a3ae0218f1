//! Single stages on files, with the code of the whole night: zeropoint, measure, compare.

use std::path::Path;

use crate::config::Config;
use crate::error::{Error, Result};
use crate::night::bench::Bench;
use crate::night::compare::{add_model, epoch_of, residual_rows};
use crate::night::meta::table_meta;
use crate::night::pipeline::{Options, master_flat, save, star_stage, target_stage};
use crate::night::progress::Progress;
use crate::night::summary::{Counts, zeropoint_text};
use crate::night::survey::survey;
use crate::night::target::{failed_row, fill_geometry};
use crate::night::zeropoint::fit_rows;
use crate::photometry::zeropoint::Zeropoint;
use crate::report::summary::pass_table;
use crate::report::{PhotometryRow, ResidualRow, StarRow, read_photometry, read_stars};
use crate::report::{write_photometry, write_residuals, write_stars};

/// What `satphot zeropoint` found.
#[derive(Debug)]
pub struct FittedStars {
    /// The star rows with their weights and residuals.
    pub rows: Vec<StarRow>,
    /// The fit, or why there is none.
    pub zeropoint: std::result::Result<Zeropoint, String>,
    /// What should be known.
    pub notes: Vec<String>,
}

/// Measures the star pointings of a night (or of `options.files`) and fits the zeropoint.
///
/// # Errors
/// What must be there before work begins; a fit that fails is told in [`FittedStars::zeropoint`].
pub fn fit_stars(config: &Config, options: &Options, progress: &dyn Progress) -> Result<FittedStars> {
    let mut config = config.clone();
    if config.stars.is_none() {
        return Err(Error::Config { key: "stars".into(), problem: "is needed to fit a zeropoint".into() });
    }
    // files named by the user are star frames, whatever their headers say
    if !options.files.is_empty() {
        config.frames.stars.push("*".into());
    }
    let mut bench = Bench::prepare(&config)?;
    let mut notes = Vec::new();
    let survey = survey(&config, &options.files, &bench.target_names())?;
    bench.flat = master_flat(&survey, &bench, options, progress, &mut notes)?;
    let stars = star_stage(&survey, &bench, options, progress, &mut notes)?;
    notes.extend(stars.failed.iter().map(|r| format!("{}: {}", r.frame, r.reason)));
    notes.extend(survey.unreadable.iter().map(|u| u.error.to_string()));
    if survey.n_star_frames() == 0 {
        return Err(Error::NoInput {
            path: config.night.input.first().cloned().unwrap_or_default(),
            problem: "holds no star pointings (light frames whose OBJECT is not the target; or [frames] stars)".into(),
        });
    }
    let rows = stars.rows;
    if rows.is_empty() {
        let first = stars.failed.first().map(|r| r.reason.clone()).unwrap_or_default();
        let problem = format!("no star matched in {} star frames; the first: {first}", survey.n_star_frames());
        return Ok(FittedStars { rows, zeropoint: Err(problem), notes });
    }
    fitted(rows, &config, notes)
}

/// Fits the zeropoint again to the rows of a stars.ecsv.
///
/// # Errors
/// [`Error::Table`] when the table cannot be read.
pub fn zeropoint_from_table(config: &Config, table: &Path) -> Result<FittedStars> {
    let (rows, _) = read_stars(table)?;
    fitted(rows, config, Vec::new())
}

fn fitted(mut rows: Vec<StarRow>, config: &Config, mut notes: Vec<String>) -> Result<FittedStars> {
    let zeropoint = match fit_rows(&mut rows, config) {
        Ok(zeropoint) => {
            notes.extend(zeropoint.warnings.iter().cloned());
            Ok(zeropoint)
        }
        Err(error @ Error::Zeropoint { .. }) => Err(error.to_string()),
        Err(error) => return Err(error),
    };
    Ok(FittedStars { rows, zeropoint, notes })
}

impl FittedStars {
    /// Writes zeropoint.toml (if there is a fit) and the star table.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, config: &Config, zeropoint: &Path, stars: Option<&Path>) -> Result<()> {
        if let Ok(fit) = &self.zeropoint {
            save(zeropoint, &fit.to_toml(&self.notes))?;
        }
        match stars {
            Some(path) => write_stars(path, &self.rows, &table_meta(config, self.zeropoint.as_ref().ok())?),
            None => Ok(()),
        }
    }

    /// The fit in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        zeropoint_text(self.zeropoint.as_ref().ok(), &format!("{} star measurements", self.rows.len()))
    }
}

/// What `satphot measure` found.
#[derive(Debug)]
pub struct Measured {
    /// One row per target frame.
    pub rows: Vec<PhotometryRow>,
    /// The zeropoint used.
    pub zeropoint: Option<Zeropoint>,
    /// What should be known.
    pub notes: Vec<String>,
    /// Why the result is not good enough for exit code 0.
    pub poor: Option<Error>,
}

/// Measures the target frames of a night (or `options.files`) with a zeropoint made before.
///
/// # Errors
/// What must be there before work begins.
pub fn measure_targets(config: &Config, options: &Options, progress: &dyn Progress) -> Result<Measured> {
    let mut config = config.clone();
    config.stars = None; // the catalogue is not needed here
    let mut bench = Bench::prepare(&config)?;
    if let Some(path) = &config.zeropoint.previous {
        bench.zeropoint = Some(Zeropoint::read(path)?);
    }
    let mut notes = Vec::new();
    let survey = survey(&config, &options.files, &bench.target_names())?;
    bench.flat = master_flat(&survey, &bench, options, progress, &mut notes)?;
    let frames = target_stage(&survey, &bench, options, progress, &mut notes)?;
    let mut rows: Vec<PhotometryRow> = frames.into_iter().map(|f| f.0).collect();
    rows.extend(survey.unreadable.iter().map(|u| failed_row(&crate::night::pipeline::file_name(&u.path), &u.error)));
    let counts = Counts::of(&survey, &rows, &[]);
    let failed_frac = counts.failed as f64 / rows.len().max(1) as f64;
    let poor = (failed_frac > config.night.max_failed_frac)
        .then(|| Error::PoorNight { problem: format!("{} of {} frames failed", counts.failed, rows.len()) });
    Ok(Measured { rows, zeropoint: bench.zeropoint, notes, poor })
}

impl Measured {
    /// Writes the photometry table.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, config: &Config, path: &Path) -> Result<()> {
        write_photometry(path, &self.rows, &table_meta(config, self.zeropoint.as_ref())?)
    }

    /// The passes in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        let n = |status: &str| self.rows.iter().filter(|r| r.status == status).count();
        let counts = format!(
            "{} ok, {} nondetection, {} rejected, {} failed\n",
            n("ok"),
            n("nondetection"),
            n("rejected"),
            n("failed")
        );
        counts + &pass_table(&self.rows)
    }
}

/// What `satphot compare` found.
#[derive(Debug)]
pub struct Compared {
    /// The photometry with its model columns.
    pub rows: Vec<PhotometryRow>,
    /// The rows with a residual.
    pub residuals: Vec<ResidualRow>,
    /// What should be known.
    pub notes: Vec<String>,
}

/// Predicts every row of a photometry table from its time, the elements and the satellite of the configuration.
///
/// # Errors
/// [`Error::Config`] without `[orbit]` or `[model]`; [`Error::Table`].
pub fn compare_table(config: &Config, table: &Path) -> Result<Compared> {
    let mut config = config.clone();
    config.stars = None;
    let bench = Bench::prepare(&config)?;
    let needed = |key: &str| Error::Config { key: key.into(), problem: "is needed to compare with the model".into() };
    let tracker = bench.tracker.as_ref().ok_or_else(|| needed("orbit"))?;
    let satellite = bench.satellite.as_ref().ok_or_else(|| needed("model"))?;
    let (mut rows, _) = read_photometry(table)?;
    let mut notes = Vec::new();
    for row in &mut rows {
        let Some(epoch) = epoch_of(row) else { continue };
        let modelled = tracker.at(&epoch).and_then(|geometry| {
            fill_geometry(row, &geometry);
            add_model(row, &geometry, satellite, &bench.model_settings())
        });
        if let Err(error) = modelled {
            notes.push(format!("{}: {error}", row.frame));
        }
    }
    let residuals = residual_rows(&rows);
    Ok(Compared { rows, residuals, notes })
}

impl Compared {
    /// Writes the residuals, and the photometry table if a path is given.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, config: &Config, residuals: &Path, photometry: Option<&Path>) -> Result<()> {
        let meta = table_meta(config, None)?;
        write_residuals(residuals, &self.residuals, &meta)?;
        match photometry {
            Some(path) => write_photometry(path, &self.rows, &meta),
            None => Ok(()),
        }
    }

    /// The passes in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        pass_table(&self.rows)
    }
}
