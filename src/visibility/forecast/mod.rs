//! What the model expects: a pass moment by moment here, a whole sky in `sky`. No frame is needed.
//!
//! Times in UTC, steps in s, altitudes in rad; the rows have the columns of every other table. No weather, no detector.

pub mod constellation;
pub mod day;
pub mod dome;
pub mod month;
mod sky;
pub mod tally;
pub mod walker;

use hifitime::Epoch;
use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::time::{iso_utc, mjd_utc, seconds_between, shifted};
use crate::brightness::Model;
use crate::brightness::catalogue::Standing;
use crate::brightness::columns::effects_meta;
use crate::brightness::columns::fill_geometry;
use crate::brightness::columns::fill_model;
use crate::brightness::scene::scene;
use crate::config;
use crate::orbit::{Pass, PassEvent, Site, Tracker, passes};
use crate::photometry::Flags;
use crate::tables::{Meta, MetaValue, PhotometryRow};

pub use sky::{flux_per_e0, map_sky, sky_rows};

/// Most rows of one prediction: ten days of a satellite that never sets, every second.
const MAX_ROWS: f64 = 1e6;

/// Which moments are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Window {
    /// First moment.
    pub start: Epoch,
    /// Last moment.
    pub end: Epoch,
    /// Between rows \[s\].
    pub step_s: f64,
    /// Rows are made above this altitude \[rad\].
    pub min_alt_rad: f64,
}

/// The stays above the smallest altitude, in order of time.
///
/// # Errors
/// [`Error::Orbit`] for an empty window or elements that cannot be used.
pub fn visible(tracker: &Tracker, window: &Window) -> Result<Vec<Pass>> {
    passes(tracker, &window.start, &window.end, window.min_alt_rad)
}

/// The highest point of the satellite in a window, above the horizon or not.
///
/// # Errors
/// As [`visible`].
pub fn highest(tracker: &Tracker, window: &Window) -> Result<Option<PassEvent>> {
    let everywhere = passes(tracker, &window.start, &window.end, -std::f64::consts::FRAC_PI_2)?;
    let tops = everywhere.into_iter().map(|p| p.culmination);
    Ok(tops.max_by(|a, b| a.alt_rad.total_cmp(&b.alt_rad)))
}

/// The moments of the rows: whole steps from the start of the window that fall into a pass; a pass between two of them
/// is represented by its culmination.
///
/// # Errors
/// [`Error::Config`] for more than a million.
pub fn moments(window: &Window, passes: &[Pass]) -> Result<Vec<Epoch>> {
    let mut epochs = Vec::new();
    for pass in passes {
        let first = (seconds_between(window.start, pass.rise.epoch) / window.step_s).ceil().max(0.0);
        let last = (seconds_between(window.start, pass.set.epoch) / window.step_s).floor();
        if (last - first + 1.0).max(0.0) + epochs.len() as f64 > MAX_ROWS {
            return Err(Error::Argument {
                name: "step_s".into(),
                problem: format!(
                    "{} s gives more than a million rows; take a longer step or fewer hours",
                    window.step_s
                ),
            });
        }
        if last < first {
            epochs.push(pass.culmination.epoch);
        }
        epochs.extend((first as i64..=last as i64).map(|k| shifted(window.start, k as f64 * window.step_s)));
    }
    Ok(epochs)
}

/// One row per moment: geometry, the four lights, their sum. The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::Orbit`] where the elements cannot be used, [`Error::Model`] for a satellite or settings that make no sense.
pub fn predict(
    tracker: &Tracker,
    model: &Model,
    epochs: &[Epoch],
    progress: &dyn Progress,
) -> Result<Vec<PhotometryRow>> {
    progress.stage("pass", epochs.len());
    let rows = epochs
        .par_iter()
        .map(|epoch| {
            let row = predicted(tracker, tracker.site(), model, epoch);
            progress.tick();
            row
        })
        .collect();
    progress.done();
    rows
}

/// One moment of a satellite seen from a site: a row of a prediction.
///
/// # Errors
/// As [`predict`].
pub(super) fn predicted(tracker: &Tracker, site: &Site, model: &Model, epoch: &Epoch) -> Result<PhotometryRow> {
    let elements = tracker.elements_at(epoch)?;
    let geometry = tracker.at_from(site, epoch)?;
    let mut row = PhotometryRow {
        norad_cat_id: i64::try_from(elements.norad_cat_id()).ok(),
        object_id: elements.object_id().to_string(),
        object_name: elements.name().to_string(),
        date_mid: iso_utc(*epoch, 3),
        mjd_mid_d: Some(mjd_utc(*epoch)),
        ..PhotometryRow::default()
    };
    fill_geometry(&mut row, &geometry);
    let modelled = model.brightness(&scene(&geometry))?;
    fill_model(&mut row, &modelled, true);
    row.mu_mean_mag_arcsec2 = modelled.mu_mean_mag_arcsec2;
    Ok(row)
}

/// What the table of a prediction says about itself.
#[must_use]
pub fn prediction_meta(schema: &str, model: &config::Model, site: Option<&config::Site>) -> Meta {
    let mut meta = Meta::default();
    let number = MetaValue::Number;
    let text = |t: &str| MetaValue::Text(t.into());
    meta.push("schema", text(schema));
    meta.push("tool", text(concat!("satphot ", env!("CARGO_PKG_VERSION"))));
    meta.push("time_scale", text("UTC"));
    if let Some(site) = site {
        let fields = [("lat_deg", site.lat_deg), ("lon_deg", site.lon_deg), ("alt_m", site.alt_m)];
        meta.push("site", MetaValue::Map(fields.map(|(key, value)| (key.to_string(), number(value))).to_vec()));
    }
    // the bands known by name but V, files, and whatever passes a throughput are AB
    let vega = model.band == "V" && model.throughput.is_none();
    meta.push("mag_system", text(if vega { "Vega" } else { "AB" }));
    meta.push("band", text(&model.band));
    if let Some(throughput) = &model.throughput {
        meta.push("throughput", text(&throughput.display().to_string()));
    }
    meta.push("satellite", text(&model.satellite));
    if let Ok(standing) = Standing::of(model) {
        standing.push_to(&mut meta);
    }
    meta.push("mode", text(&name_of(&model.mode)));
    meta.push("tolerance", number(model.tolerance));
    meta.push("effects", effects_meta(model));
    let flags = Flags::NAMES.iter().map(|(flag, name)| ((*name).to_string(), number(f64::from(flag.0)))).collect();
    meta.push("flags", MetaValue::Map(flags));
    meta
}

/// How a file spells a mode.
fn name_of(mode: &config::Mode) -> String {
    toml::Value::try_from(mode).ok().and_then(|v| v.as_str().map(str::to_string)).unwrap_or_default()
}

/// The larger of two errors, where there is one.
fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.into_iter().chain(b).reduce(f64::max)
}
