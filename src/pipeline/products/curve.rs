//! The model of a night's passes, moment by moment, as the curve that figures draw behind the frames.
//!
//! Magnitudes at evenly spaced moments from a little before the first to a little after the last frame of a pass. It does
//! not replace the model at the frames themselves, which residuals are taken from.

use hifitime::Epoch;

use crate::base::error::Result;
use crate::base::progress::Silent;
use crate::base::time::from_mjd_utc;
use crate::brightness::{Model, ModelSettings, Satellite};
use crate::config;
use crate::orbit::Tracker;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::{mjd, passes};
use crate::visibility::forecast::predict;

/// Moments of a pass, enough for the few seconds in which a satellite enters the Earth's shadow.
const MOMENTS: usize = 160;
/// Half of the time drawn, as a share of what lies between the first and the last frame, and the least \[s\]: as far as
/// the axis of a light curve reaches.
const HALF: (f64, f64) = (0.56, 10.0);
/// Relative tolerance of the Earth-reflected lights: a line is thicker than their error.
const TOLERANCE: f64 = 1e-3;

/// The model along every pass whose frames are compared with it, above the horizon; rows of geometry and lights alone.
///
/// # Errors
/// As [`predict`].
pub fn model_curve(rows: &[PhotometryRow], tracker: &Tracker, model: &config::Model) -> Result<Vec<PhotometryRow>> {
    let satellite = Satellite::from_config(model)?;
    let settings = ModelSettings::try_from(model)?;
    let engine = Model::new(&satellite, &ModelSettings { tolerance: settings.tolerance.max(TOLERANCE), ..settings })?;
    let mut curve = Vec::new();
    for pass in passes(rows) {
        let (Some(first), Some(last)) = (pass.first(), pass.last()) else { continue };
        if pass.iter().all(|r| r.model_v_mag.is_none()) {
            continue;
        }
        let rows = predict(tracker, &engine, &moments(mjd(first), mjd(last)), &Silent)?;
        let up = rows.into_iter().filter(|r| r.alt_deg.is_some_and(|alt_deg| alt_deg > 0.0));
        // the target is called what the frames call it
        curve.extend(up.map(|r| PhotometryRow {
            norad_cat_id: first.norad_cat_id,
            object_name: first.object_name.clone(),
            ..r
        }));
    }
    Ok(curve)
}

/// Evenly spaced moments about those of the first and the last frame (MJD, UTC).
fn moments(first_d: f64, last_d: f64) -> Vec<Epoch> {
    let (middle_d, half_d) = (0.5 * (first_d + last_d), (HALF.0 * (last_d - first_d)).max(HALF.1 / 86_400.0));
    let at = |k: usize| middle_d + half_d * (2.0 * k as f64 / (MOMENTS - 1) as f64 - 1.0);
    (0..MOMENTS).map(|k| from_mjd_utc(at(k))).collect()
}
