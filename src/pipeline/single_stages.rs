//! Single stages on files, with the code of the whole night: zeropoint, measure, compare.

use std::path::Path;

use super::options::Options;
use super::products::inputs::data_mode;
use super::survey::read::survey_until;
use crate::bands::Band;
use crate::bands::CalibratedBand;
use crate::bands::ColourIndex;
use crate::bands::Light;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::file::save;
use crate::base::progress::Progress;
use crate::brightness::columns::{fill_geometry, fill_model, fill_normalised};
use crate::brightness::scene::scene;
use crate::config::Config;
use crate::export::DataMode;
use crate::frames::Role;
use crate::photometry::Flags;
use crate::pipeline::compare::band_of_model;
use crate::pipeline::compare::comparable;
use crate::pipeline::compare::epoch_of;
use crate::pipeline::compare::residual_rows;
use crate::pipeline::hot_pixels::with_hot_pixels;
use crate::pipeline::prepared::{Calibrated, Prepared, Seeing};
use crate::pipeline::products::meta::set_band;
use crate::pipeline::products::meta::table_meta;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::products::summary::{Counts, zeropoint_text};
use crate::pipeline::shards::products::FrameCache;
use crate::pipeline::shards::whole::judge_whole_night;
use crate::pipeline::stages::{master_flat, target_stage};
use crate::pipeline::stars::stage::star_stage;
use crate::pipeline::stars::zeropoint::of_band;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::preflight::preflight_of;
use crate::pipeline::survey::scale::check_stars;
use crate::pipeline::target::pilots::TargetFrames;
use crate::pipeline::target::row::{failed_file_row, set_aside_row};
use crate::report::summary::pass_table;
use crate::tables::meta::NO_BAND;
use crate::tables::words::Status;
use crate::tables::{Meta, MetaValue, PhotometryRow, ResidualRow, StarRow, read_photometry, read_stars};
use crate::tables::{write_photometry, write_residuals, write_stars};
use crate::zeropoint::fit::Zeropoint;
use crate::zeropoint::previous::{conditions, read_previous};
use crate::zeropoint::stars::{fit_rows, in_index};

/// The result of `satphot zeropoint`.
#[derive(Debug)]
pub struct FittedStars {
    /// The star rows with their weights and residuals.
    pub rows: Vec<StarRow>,
    /// The fit, or why there is none.
    pub zeropoint: std::result::Result<Zeropoint, String>,
    /// The chosen band, if frames were measured.
    pub calibrated: Option<CalibratedBand>,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

/// Measures the star pointings of a night (or of `options.files`) and fits the zeropoint.
///
/// # Errors
/// Anything that is missing before the work begins; a fit that fails is reported in [`FittedStars::zeropoint`].
pub fn fit_stars(config: &Config, options: &Options, progress: &dyn Progress) -> Result<FittedStars> {
    if config.stars.is_none() {
        return Err(Error::Config { key: "stars".into(), problem: "is needed to fit a zeropoint".into() });
    }
    let (prepared, survey, mut notes) = named_night(config, options, Role::Stars)?;
    notes.extend(options.memory().check(&survey, &prepared)?);
    let products = FrameCache::default();
    notes.extend(check_stars(&survey, &prepared, &products, options.jobs)?);
    let flattened = master_flat(&survey, prepared, (&products, None), options, progress, &mut notes)?;
    let prepared = with_hot_pixels(flattened, &survey.pointings, &products, options, &mut notes)?;
    let stars = star_stage(&survey, &prepared, &products, options, progress, &mut notes)?;
    notes.extend(stars.details.iter().cloned());
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
        return Ok(FittedStars { rows, zeropoint: Err(problem), calibrated: prepared.band.clone(), notes });
    }
    fitted(rows, config, prepared.catalogue.as_ref().and_then(|c| c.colour), notes)
        .map(|fitted| fitted.of_band(&prepared))
}

/// The night, or the `files` of it that have a role, once every check before the first pixel is passed.
fn named_night(config: &Config, options: &Options, role: Role) -> Result<(Prepared, Survey, Vec<String>)> {
    let (prepared, errors) = Prepared::gather(config)?;
    let mut notes = Vec::new();
    let survey = survey_named(config, options, role, &prepared.target_names(), &mut notes);
    if let Err(stopped @ Error::Interrupted { .. }) = survey {
        return Err(stopped);
    }
    let (prepared, survey, found) = preflight_of(prepared, errors, survey, role == Role::Stars).ready()?;
    notes.extend(found);
    notes.extend(survey.set_aside.iter().map(|s| format!("{}: set aside: {}", file_name(&s.path), s.reason)));
    Ok((prepared, survey, notes))
}

/// The files of the night; or the `files` named by the user, which have `role` whatever their headers say, with the
/// flats and (for target frames) the star pointings of the night, so that the numbers are those of the whole night.
fn survey_named(
    config: &Config,
    options: &Options,
    role: Role,
    target_names: &[String],
    notes: &mut Vec<String>,
) -> Result<Survey> {
    let (files, stop) = (&options.files, &options.stop);
    if files.is_empty() {
        return survey_until(config, &[], target_names, stop);
    }
    let mut own = config.clone();
    let patterns = if role == Role::Stars { &mut own.frames.stars } else { &mut own.frames.target };
    patterns.push("*".into());
    let named = survey_until(&own, files, target_names, stop)?;
    match survey_until(config, &[], target_names, stop) {
        Err(stopped @ Error::Interrupted { .. }) => Err(stopped),
        Ok(night) if role == Role::Stars => Ok(Survey { flats: night.flats, others: night.others, ..named }),
        Ok(night) => Ok(Survey { flats: night.flats, pointings: night.pointings, others: night.others, ..named }),
        Err(error) => {
            notes.push(format!("{error}: the named files are reduced without the night's flats and stars"));
            Ok(named)
        }
    }
}

/// Fits the zeropoint again to the rows of a stars.ecsv.
///
/// # Errors
/// [`Error::Table`] when the table cannot be read.
pub fn zeropoint_from_table(config: &Config, table: &Path) -> Result<FittedStars> {
    let (rows, meta) = read_stars(table)?;
    let colour = match meta.get("colour_index") {
        Some(MetaValue::Text(name)) => ColourIndex::named(name),
        _ => None,
    };
    let mut fitted = fitted(rows, config, colour, Vec::new())?;
    let (band, light) = band_of_table(&meta);
    if let (Some(declared), Some(band)) = (config.photometry.band, band)
        && declared != band
    {
        let problem = format!("\"{declared}\" is declared, but the magnitudes of {} are {band}", table.display());
        return Err(Error::Config { key: "photometry.band".into(), problem });
    }
    if let Ok(zeropoint) = &mut fitted.zeropoint {
        (zeropoint.band, zeropoint.light) = (band.or(config.photometry.band), light);
        zeropoint.colour = colour;
        zeropoint.target_b_v_mag = config.zeropoint.target_colour(colour);
    }
    Ok(fitted)
}

/// Band and filter of a table, from its meta block.
fn band_of_table(meta: &Meta) -> (Option<Band>, Option<Light>) {
    let text = |key: &str| match meta.get(key) {
        Some(MetaValue::Text(text)) => Some(text.as_str()),
        _ => None,
    };
    (text("band").and_then(Band::named), text("filter").map(Light::named))
}

fn fitted(
    mut rows: Vec<StarRow>,
    config: &Config,
    colour: Option<ColourIndex>,
    mut notes: Vec<String>,
) -> Result<FittedStars> {
    let zeropoint = match fit_rows(&mut rows, &in_index(config, colour)) {
        Ok(zeropoint) => {
            notes.extend(zeropoint.warnings.iter().cloned());
            Ok(zeropoint)
        }
        Err(error @ Error::Zeropoint { .. }) => Err(error.to_string()),
        Err(error) => return Err(error),
    };
    Ok(FittedStars { rows, zeropoint, calibrated: None, notes })
}

impl FittedStars {
    /// The fit with the chosen band.
    fn of_band(self, prepared: &Prepared) -> Self {
        let zeropoint = self.zeropoint.map(|zeropoint| of_band(zeropoint, prepared));
        Self { zeropoint, calibrated: prepared.band.clone(), ..self }
    }

    /// Writes zeropoint.toml (if there is a fit) and the star table.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, config: &Config, zeropoint: &Path, stars: Option<&Path>) -> Result<()> {
        let provenance = Provenance::of(config, None, None)?;
        if let Ok(fit) = &self.zeropoint {
            let flattened = !self.rows.iter().any(|r| Flags(r.flags).has(Flags::NO_FLAT));
            save(zeropoint, &(fit.to_toml(&[conditions(config, flattened)]) + &provenance.toml_comment()))?;
        }
        match stars {
            Some(path) => {
                let mut meta = table_meta(config, self.zeropoint.as_ref().ok(), &provenance);
                if self.zeropoint.is_err() {
                    set_band(&mut meta, self.calibrated.as_ref());
                }
                write_stars(path, &self.rows, &meta)
            }
            None => Ok(()),
        }
    }

    /// The fit in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        zeropoint_text(self.zeropoint.as_ref().ok(), &format!("{} star measurements", self.rows.len()))
    }
}

/// The result of `satphot measure`.
#[derive(Debug)]
pub struct Measured {
    /// One row per target frame.
    pub rows: Vec<PhotometryRow>,
    /// The zeropoint used.
    pub zeropoint: Option<Zeropoint>,
    /// Notes for the observer.
    pub notes: Vec<String>,
    /// Why the result is not good enough for exit code 0.
    pub poor: Option<Error>,
    /// Whether the frames are real.
    pub data_mode: DataMode,
}

/// Measures the target frames of a night (or `options.files`) with a zeropoint made before.
///
/// # Errors
/// Anything that is missing before the work begins.
pub fn measure_targets(config: &Config, options: &Options, progress: &dyn Progress) -> Result<Measured> {
    let mut config = config.clone();
    // the stars only give the FWHM here: the night goes on without their catalogue
    config.stars = config.stars.filter(|s| config.photometry.fwhm_px.is_none() && s.catalogue.exists());
    let (mut prepared, survey, mut notes) = named_night(&config, options, Role::Target)?;
    notes.extend(options.memory().check(&survey, &prepared)?);
    let products = FrameCache::default();
    notes.extend(check_stars(&survey, &prepared, &products, options.jobs)?);
    prepared.model = None; // `compare` adds it
    let flattened = master_flat(&survey, prepared, (&products, None), options, progress, &mut notes)?;
    let flattened = with_hot_pixels(flattened, &survey.pointings, &products, options, &mut notes)?;
    let mut zeropoint = None;
    if let Some(path) = &config.zeropoint.previous {
        let (read, warnings) = read_previous(path, &config, flattened.flat.is_some())?;
        notes.extend(warnings);
        zeropoint = Some(of_band(read, &flattened));
    }
    let seeing = if config.stars.is_some() && survey.n_star_frames() > 0 {
        star_stage(&survey, &flattened, &products, options, progress, &mut notes)?.seeing
    } else {
        Seeing::default()
    };
    let night = Calibrated { flattened, seeing, zeropoint };
    let (mut frames, _) =
        target_stage(&TargetFrames::all(&survey.targets), &night, &products, options, progress, &mut notes)?;
    judge_whole_night(&mut frames, &config, &mut notes);
    let mut rows: Vec<PhotometryRow> = frames.into_iter().map(|f| f.row).collect();
    rows.extend(survey.unreadable.iter().map(|u| failed_file_row(&u.path, &u.error)));
    rows.extend(survey.set_aside.iter().map(|s| set_aside_row(&s.path, &s.reason)));
    let counts = Counts::of(&survey, &rows, &[]);
    let failed_frac = counts.failed as f64 / rows.len().max(1) as f64;
    let poor = (failed_frac > config.night.max_failed_frac)
        .then(|| Error::PoorNight { problem: format!("{} of {} frames failed", counts.failed, rows.len()) });
    Ok(Measured { rows, zeropoint: night.zeropoint, notes, poor, data_mode: data_mode(&survey) })
}

impl Measured {
    /// Writes the photometry table.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, config: &Config, path: &Path) -> Result<()> {
        let mut meta = table_meta(config, self.zeropoint.as_ref(), &Provenance::of(config, None, None)?);
        meta.push("data_mode", self.data_mode.name());
        write_photometry(path, &self.rows, &meta)
    }

    /// The passes in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        let n = |status: Status| self.rows.iter().filter(|r| r.status == status).count();
        let counts = format!(
            "{} ok, {} nondetection, {} rejected, {} failed\n",
            n(Status::Ok),
            n(Status::Nondetection),
            n(Status::Rejected),
            n(Status::Failed)
        );
        counts + &pass_table(&self.rows, Band::or_v(self.zeropoint.as_ref().and_then(|z| z.band)).name())
    }
}

/// The result of `satphot compare`.
#[derive(Debug)]
pub struct Compared {
    /// The photometry with its model columns.
    pub rows: Vec<PhotometryRow>,
    /// The rows with a residual.
    pub residuals: Vec<ResidualRow>,
    /// The zeropoint of the magnitudes, as the photometry table names it.
    pub zeropoint: Option<MetaValue>,
    /// Whether its frames are real, as it says.
    pub data_mode: Option<MetaValue>,
    /// Its band, magnitude system and filter, as it says.
    pub of_band: Vec<(String, MetaValue)>,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

/// Predicts every row of a photometry table from its time, the elements and the satellite of the configuration.
///
/// # Errors
/// [`Error::Config`] without `[orbit]` or `[model]`; [`Error::Table`].
pub fn compare_table(config: &Config, table: &Path) -> Result<Compared> {
    let mut config = config.clone();
    config.stars = None;
    let prepared = Prepared::prepare(&config)?;
    let needed = |key: &str| Error::Config { key: key.into(), problem: "is needed to compare with the model".into() };
    let tracker = prepared.tracker.as_ref().ok_or_else(|| needed("orbit"))?;
    let model = prepared.model.as_ref().ok_or_else(|| needed("model"))?;
    let (mut rows, meta) = read_photometry(table)?;
    let (zeropoint, data_mode) = (meta.get("zeropoint").cloned(), meta.get("data_mode").cloned());
    let mut notes: Vec<String> = config.model.as_ref().map(comparable).transpose()?.flatten().into_iter().collect();
    let band = Band::or_v(band_of_table(&meta).0);
    notes.extend(band_of_model(&config, band)?);
    notes.extend(prepared.model_note());
    let same_band = config.model.as_ref().is_some_and(|m| m.band == band.name());
    let of_band: Vec<(String, MetaValue)> = meta
        .entries
        .iter()
        .filter(|(key, _)| matches!(key.as_str(), "band" | "mag_system" | "filter" | "calibration"))
        .cloned()
        .collect();
    for row in &mut rows {
        let Some(epoch) = epoch_of(row) else { continue };
        let modelled = tracker.at(&epoch).and_then(|geometry| {
            fill_geometry(row, &geometry);
            fill_model(row, &model.brightness(&scene(&geometry))?, same_band);
            fill_normalised(row);
            Ok(())
        });
        if let Err(error) = modelled {
            notes.push(format!("{}: {error}", row.frame));
        }
    }
    let residuals = residual_rows(&rows);
    Ok(Compared { rows, residuals, zeropoint, data_mode, of_band, notes })
}

impl Compared {
    /// Writes the residuals, and the photometry table if a path is given.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, config: &Config, residuals: &Path, photometry: Option<&Path>) -> Result<()> {
        let mut meta = table_meta(config, None, &Provenance::of(config, None, None)?);
        for (key, value) in &self.of_band {
            meta.set(key, value.clone());
        }
        if let Some(zeropoint) = &self.zeropoint {
            meta.push("zeropoint", zeropoint.clone());
        }
        if let Some(data_mode) = &self.data_mode {
            meta.push("data_mode", data_mode.clone());
        }
        write_residuals(residuals, &self.residuals, &meta)?;
        match photometry {
            Some(path) => write_photometry(path, &self.rows, &meta),
            None => Ok(()),
        }
    }

    /// The passes in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        let band = self.of_band.iter().find(|(key, _)| key == "band").map(|(_, value)| value);
        match band {
            Some(MetaValue::Text(band)) if band != NO_BAND => pass_table(&self.rows, band),
            _ => pass_table(&self.rows, Band::or_v(None).name()),
        }
    }
}
