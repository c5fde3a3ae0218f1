//! Observed against modelled: fills the model columns of photometry rows, makes residual rows and passes.

use hifitime::Epoch;

use crate::brightness::{Brightness, ModelSettings, Satellite, Scene, brightness};
use crate::constants::SIGMA_PER_MAD;
use crate::error::Result;
use crate::orbit::Geometry;
use crate::photometry::Flags;
use crate::report::{PhotometryRow, ResidualRow};

/// A new pass begins where the frames leave a gap longer than this \[s\] (a LEO pass lasts at most 15 minutes).
const PASS_GAP_S: f64 = 1_800.0;

/// The scene of the brightness engine at one instant.
#[must_use]
pub fn scene(g: &Geometry) -> Scene {
    Scene {
        satellite_km: g.satellite_itrs_km,
        velocity_km_s: g.satellite_velocity_itrs_km_s,
        observer_km: g.observer_itrs_km,
        sun_km: g.sun_itrs_km,
        moon_km: g.moon_itrs_km,
    }
}

/// Puts the model's magnitudes into a row, and the residual, observed minus modelled.
///
/// # Errors
/// [`crate::Error::Model`] for an impossible scene.
pub fn add_model(
    row: &mut PhotometryRow,
    geometry: &Geometry,
    satellite: &Satellite,
    settings: &ModelSettings,
) -> Result<Brightness> {
    let model = brightness(&scene(geometry), satellite, settings)?;
    row.model_v_mag = model.total_v_mag;
    row.sun_v_mag = model.sun.v_mag;
    row.earthshine_v_mag = model.earthshine.v_mag;
    row.moon_v_mag = model.moon.v_mag;
    row.lunar_earthshine_v_mag = model.lunar_earthshine.v_mag;
    row.model_err_mag = model.total_v_mag.map(|_| model.err_mag);
    row.illum = model.illum.to_string();
    row.skipped = model.skipped.join("; ");
    row.residual_mag = match (row.v_mag, row.model_v_mag) {
        (Some(observed), Some(modelled)) => Some(observed - modelled),
        _ => None,
    };
    if model.extrapolated {
        row.flags |= Flags::MODEL_EXTRAPOLATED.0;
    }
    Ok(model)
}

/// Number of the pass of each row (1-based), by gaps in time; rows without time belong to pass 0.
#[must_use]
pub fn pass_numbers(rows: &[PhotometryRow]) -> Vec<i64> {
    let mut order: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].mjd_mid_d.is_some()).collect();
    let time = |i: usize| rows[i].mjd_mid_d.unwrap_or(f64::NAN);
    order.sort_by(|&a, &b| time(a).total_cmp(&time(b)));
    let mut numbers = vec![0; rows.len()];
    let mut last: Option<(f64, &str)> = None;
    let mut pass = 0;
    for &i in &order {
        let object = rows[i].object_name.as_str();
        if last.is_none_or(|(t, o)| (time(i) - t) * 86_400.0 > PASS_GAP_S || o != object) {
            pass += 1;
        }
        last = Some((time(i), object));
        numbers[i] = pass;
    }
    numbers
}

/// The rows that have both an observed and a modelled magnitude.
#[must_use]
pub fn residual_rows(rows: &[PhotometryRow]) -> Vec<ResidualRow> {
    let passes = pass_numbers(rows);
    rows.iter()
        .zip(passes)
        .filter(|(r, _)| r.residual_mag.is_some())
        .map(|(r, pass)| ResidualRow {
            frame: r.frame.clone(),
            norad_cat_id: r.norad_cat_id,
            object_name: r.object_name.clone(),
            pass: Some(pass),
            date_mid: r.date_mid.clone(),
            mjd_mid_d: r.mjd_mid_d,
            alt_deg: r.alt_deg,
            az_deg: r.az_deg,
            range_km: r.range_km,
            phase_angle_deg: r.phase_angle_deg,
            moon_sep_deg: r.moon_sep_deg,
            illum: r.illum.clone(),
            v_mag: r.v_mag,
            v_mag_err: r.v_mag_err,
            v_mag_err_sys: r.v_mag_err_sys,
            model_v_mag: r.model_v_mag,
            model_err_mag: r.model_err_mag,
            residual_mag: r.residual_mag,
            verdict: r.verdict.clone(),
            flags: r.flags,
        })
        .collect()
}

/// One pass in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct PassSummary {
    /// Number, 1-based.
    pub pass: i64,
    /// First mid-exposure, UTC.
    pub start_utc: String,
    /// Name of the satellite.
    pub object_name: String,
    /// Target frames of the pass.
    pub n_frames: usize,
    /// Frames with a magnitude.
    pub n_measured: usize,
    /// Median V \[mag\].
    pub median_v_mag: Option<f64>,
    /// Brightest V \[mag\].
    pub brightest_v_mag: Option<f64>,
    /// Highest altitude of a frame \[deg\].
    pub max_alt_deg: Option<f64>,
    /// The largest lights in the order they came, e.g. `sun>penumbra>moon`.
    pub illum: String,
    /// Frames with a residual.
    pub n_residuals: usize,
    /// Median residual, observed minus modelled \[mag\].
    pub residual_median_mag: Option<f64>,
    /// 1.4826 MAD of the residuals \[mag\].
    pub residual_sigma_mag: Option<f64>,
    /// Median random error \[mag\].
    pub v_mag_err: Option<f64>,
    /// Median systematic error \[mag\].
    pub v_mag_err_sys: Option<f64>,
}

/// Each pass in numbers; frames with verdict `reject` are counted but not used.
#[must_use]
pub fn pass_summaries(rows: &[PhotometryRow]) -> Vec<PassSummary> {
    let numbers = pass_numbers(rows);
    let last = numbers.iter().copied().max().unwrap_or(0);
    (1..=last)
        .map(|pass| {
            let mut frames: Vec<&PhotometryRow> =
                rows.iter().zip(&numbers).filter(|(_, n)| **n == pass).map(|(r, _)| r).collect();
            frames.sort_by(|a, b| a.mjd_mid_d.unwrap_or(0.0).total_cmp(&b.mjd_mid_d.unwrap_or(0.0)));
            let used: Vec<&PhotometryRow> =
                frames.iter().copied().filter(|r| r.status == "ok" && r.verdict != "reject").collect();
            let values = |f: fn(&PhotometryRow) -> Option<f64>| used.iter().filter_map(|r| f(r)).collect::<Vec<f64>>();
            let v = values(|r| r.v_mag);
            let residuals = values(|r| r.residual_mag);
            let mut illum: Vec<&str> = Vec::new();
            for r in frames.iter().filter(|r| !r.illum.is_empty()) {
                if illum.last() != Some(&r.illum.as_str()) {
                    illum.push(&r.illum);
                }
            }
            let (residual_median_mag, residual_sigma_mag) = median_and_sigma(&residuals);
            PassSummary {
                pass,
                start_utc: frames.first().map(|r| r.date_mid.clone()).unwrap_or_default(),
                object_name: frames.first().map(|r| r.object_name.clone()).unwrap_or_default(),
                n_frames: frames.len(),
                n_measured: v.len(),
                median_v_mag: median_and_sigma(&v).0,
                brightest_v_mag: v.iter().copied().min_by(f64::total_cmp),
                max_alt_deg: frames.iter().filter_map(|r| r.alt_deg).max_by(f64::total_cmp),
                illum: illum.join(">"),
                n_residuals: residuals.len(),
                residual_median_mag,
                residual_sigma_mag,
                v_mag_err: median_and_sigma(&values(|r| r.v_mag_err)).0,
                v_mag_err_sys: median_and_sigma(&values(|r| r.v_mag_err_sys)).0,
            }
        })
        .collect()
}

/// Median and 1.4826 MAD; `None` without values, no sigma for one value.
#[must_use]
pub fn median_and_sigma(values: &[f64]) -> (Option<f64>, Option<f64>) {
    let middle = |mut v: Vec<f64>| -> Option<f64> {
        v.sort_by(f64::total_cmp);
        match v.len() {
            0 => None,
            n if n % 2 == 1 => Some(v[n / 2]),
            n => Some(0.5 * (v[n / 2 - 1] + v[n / 2])),
        }
    };
    let Some(median) = middle(values.to_vec()) else { return (None, None) };
    let mad = middle(values.iter().map(|v| (v - median).abs()).collect());
    (Some(median), mad.filter(|_| values.len() > 1).map(|m| SIGMA_PER_MAD * m))
}

/// The epoch of a row, from its MJD.
#[must_use]
pub fn epoch_of(row: &PhotometryRow) -> Option<Epoch> {
    row.mjd_mid_d.map(crate::night::clock::from_mjd_utc)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(mjd_mid_d: f64, v: f64, model: f64) -> PhotometryRow {
        PhotometryRow {
            mjd_mid_d: Some(mjd_mid_d),
            v_mag: Some(v),
            model_v_mag: Some(model),
            residual_mag: Some(v - model),
            status: "ok".into(),
            verdict: "use".into(),
            illum: if v < 5.0 { "sun".into() } else { "moon".into() },
            ..PhotometryRow::default()
        }
    }

    #[test]
    fn passes_are_told_apart_by_gaps_and_lights_listed_in_order() {
        let rows = [
            row(60_000.0, 12.0, 11.5),
            row(60_000.001, 2.0, 2.5),
            row(60_000.5, 12.5, 12.0),
            row(60_000.0005, 3.0, 2.0),
        ];
        assert_eq!(pass_numbers(&rows), [1, 1, 2, 1]);
        let passes = pass_summaries(&rows);
        assert_eq!(passes.len(), 2);
        assert_eq!(passes[0].illum, "moon>sun");
        assert_eq!(passes[0].median_v_mag, Some(3.0));
        assert_eq!(passes[0].residual_median_mag, Some(0.5));
        assert!(passes[1].residual_sigma_mag.is_none());
    }
}
