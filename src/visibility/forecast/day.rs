//! A day of a type of satellite: the median over the sky, moment by moment, light by light, next to observed passes.
//!
//! Magnitudes, UTC, rad inside. Sun and Moon once per moment; the result is the same for any number of threads.
//! Excluded: where satellites really are, weather, twilight glow.

use super::larger;
use hifitime::Epoch;
use rayon::prelude::*;

use super::dome::{Dome, Overhead};
use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::time::{from_mjd_utc, iso_utc, mjd_utc, shifted};
use crate::brightness::sky_points::{SkyPoints, Spread};
use crate::brightness::too_faint_text;
use crate::orbit::earth::Site;
use crate::tables::row_passes::passes;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::{DayRow, ObservedRow, PhotometryRow};

/// Share of the directions a light must have for its median to be reported: of fewer it jumps from moment to moment.
const LIGHT_FROM: f64 = 0.02;
/// Most moments of one day's table.
const MAX_MOMENTS: f64 = 1e5;

/// What the sky shows at one moment, in every direction that was computed.
#[derive(Debug, Clone, Default)]
pub struct SkyLight {
    /// V of the lit directions \[mag\].
    pub v_mag: Vec<f64>,
    /// Their mean surface brightness \[mag/arcsec²\].
    pub mu_mag_arcsec2: Vec<f64>,
    /// V of each light where there is any \[mag\]: Sun, earthshine, Moon, lunar earthshine.
    pub lights_v_mag: [Vec<f64>; 4],
    /// In how many directions each light is there and was not computed, because it cannot change the sum by more than the tolerance.
    pub too_faint: [usize; 4],
    /// In how many directions each light is the largest.
    pub largest: [usize; 4],
    /// Largest numerical error \[mag\].
    pub err_mag: f64,
    /// Largest error as a prediction \[mag\].
    pub pred_err_mag: Option<f64>,
    /// Directions that were computed.
    pub n_points: usize,
    /// What was excluded for the whole sky, and why.
    pub skipped: Vec<String>,
}

/// Share of directions (and moments) in which a satellite has any light, of those that were computed; NaN if none was.
/// This is `lit_frac` of the tables and `lit %` of the summaries.
#[must_use]
pub fn lit_frac(lit: usize, n_directions: usize) -> f64 {
    lit as f64 / n_directions as f64
}

/// Asks a dome in every direction at one moment.
///
/// # Errors
/// As [`crate::brightness::Model::brightness`].
pub fn sky_light(dome: &Dome, points: &SkyPoints, overhead: &Overhead) -> Result<SkyLight> {
    let moment = dome.under(overhead)?;
    let mut sky = SkyLight { n_points: points.directions.len(), ..SkyLight::default() };
    for (alt_rad, az_rad) in &points.directions {
        let Some(seen) = moment.toward(*alt_rad, *az_rad)? else { break };
        let Some(v_mag) = seen.total_v_mag else { continue };
        sky.v_mag.push(v_mag);
        sky.mu_mag_arcsec2.extend(seen.mu_mean_mag_arcsec2);
        sky.err_mag = sky.err_mag.max(seen.err_mag);
        sky.pred_err_mag = larger(sky.pred_err_mag, seen.v_pred_err_mag);
        let fluxes = seen.lights().map(|light| light.flux_ratio);
        for (mags, light) in sky.lights_v_mag.iter_mut().zip(seen.lights()) {
            mags.extend(light.v_mag);
        }
        for (count, too_faint) in sky.too_faint.iter_mut().zip(seen.too_faint()) {
            *count += usize::from(too_faint);
        }
        let largest = (0..4).max_by(|a, b| fluxes[*a].total_cmp(&fluxes[*b])).unwrap_or(0);
        sky.largest[largest] += 1;
    }
    sky.skipped = moment.skipped;
    Ok(sky)
}

/// Every whole step from `start` over `hours`, both ends included.
///
/// # Errors
/// [`Error::Config`] for a step or a length that is none, or too many moments.
pub fn day_moments(start: Epoch, hours: f64, step_min: f64) -> Result<Vec<Epoch>> {
    let bad = |name: &str, problem: String| Err(Error::Argument { name: name.into(), problem });
    if !(step_min > 0.0 && step_min <= 1440.0) {
        return bad("step_min", format!("{step_min} min; accepted is above 0, to 1440"));
    }
    if !(hours > 0.0 && hours <= 9000.0) {
        return bad("hours", format!("{hours} h; accepted is above 0, to 9000"));
    }
    // 24 h hold 144 steps of 10 min however they round
    let steps = (hours * 60.0 / step_min + 1e-9).floor();
    if steps > MAX_MOMENTS {
        return bad("step_min", format!("{step_min} min gives {steps} moments; accepted are {MAX_MOMENTS}"));
    }
    Ok((0..=steps as i64).map(|k| shifted(start, k as f64 * step_min * 60.0)).collect())
}

/// One row per moment.
///
/// # Errors
/// As [`sky_light`].
pub fn predict_day(
    site: &Site,
    dome: &Dome,
    points: &SkyPoints,
    epochs: &[Epoch],
    progress: &dyn Progress,
) -> Result<Vec<DayRow>> {
    progress.stage("day", epochs.len());
    let rows = epochs
        .par_iter()
        .with_max_len(1)
        .map(|epoch| {
            let overhead = Overhead::at(site, epoch)?;
            let sky = sky_light(dome, points, &overhead)?;
            progress.tick();
            Ok(row(&overhead, sky))
        })
        .collect();
    progress.done();
    rows
}

fn row(overhead: &Overhead, mut sky: SkyLight) -> DayRow {
    let spread = Spread::of(&mut sky.v_mag);
    let mu = Spread::of(&mut sky.mu_mag_arcsec2);
    let of_all = |count: usize| count as f64 / sky.n_points as f64;
    let [sun_frac, earthshine_frac, moon_frac, lunar_earthshine_frac] = sky.largest.map(of_all);
    let enough = (LIGHT_FROM * sky.n_points as f64).ceil() as usize;
    // what is left of a light where it was not computed everywhere has no median
    for (mags, too_faint) in sky.lights_v_mag.iter_mut().zip(sky.too_faint) {
        mags.truncate(if too_faint > 0 { 0 } else { mags.len() });
    }
    let [sun, earthshine, moon, lunar_earthshine] =
        sky.lights_v_mag.each_mut().map(|light| Spread::of(light).filter(|_| light.len() >= enough).map(|s| s.median));
    DayRow {
        date_mid: iso_utc(overhead.epoch, 0),
        mjd_mid_d: mjd_utc(overhead.epoch),
        sun_alt_deg: overhead.sun.alt_rad.to_degrees(),
        sun_az_deg: overhead.sun.az_rad.to_degrees(),
        moon_alt_deg: overhead.moon.alt_rad.to_degrees(),
        moon_az_deg: overhead.moon.az_rad.to_degrees(),
        moon_phase_deg: overhead.moon_phase_rad.to_degrees(),
        moon_illum_pct: 50.0 * (1.0 + overhead.moon_phase_rad.cos()),
        n_points: sky.n_points as i64,
        lit_frac: lit_frac(sky.v_mag.len(), sky.n_points),
        model_v_mag: spread.map(|s| s.median),
        model_v_p16_mag: spread.map(|s| s.p16),
        model_v_p84_mag: spread.map(|s| s.p84),
        brightest_v_mag: sky.v_mag.first().copied(),
        sun_v_mag: sun,
        earthshine_v_mag: earthshine,
        moon_v_mag: moon,
        lunar_earthshine_v_mag: lunar_earthshine,
        sun_frac,
        earthshine_frac,
        moon_frac,
        lunar_earthshine_frac,
        mu_mean_mag_arcsec2: mu.map(|s| s.median),
        mu_p16_mag_arcsec2: mu.map(|s| s.p16),
        mu_p84_mag_arcsec2: mu.map(|s| s.p84),
        model_err_mag: spread.map(|_| sky.err_mag),
        v_pred_err_mag: spread.and(sky.pred_err_mag),
        skipped: sky.skipped.join("; "),
        too_faint: too_faint_text(&sky.too_faint.map(|directions| directions > 0)),
    }
}

/// One pass as it was observed: its magnitudes and when.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedPass {
    /// Its row of the table.
    pub row: ObservedRow,
    /// Usable magnitudes \[mag\], brightest first.
    pub v_mag: Vec<f64>,
    /// MJD (UTC) of its median frame, moved by whole days into the predicted ones \[d\].
    pub mjd_d: f64,
    /// Days it was moved by.
    pub moved_d: f64,
}

/// The passes of a photometry table that have usable magnitudes, each next to the day's rows at its time of day.
///
/// Frames that were rejected or only give a lower limit on the brightness do not count.
#[must_use]
pub fn observed_passes(rows: &[PhotometryRow], day: &[DayRow]) -> Vec<ObservedPass> {
    let usable = |r: &&&PhotometryRow| is_used(&r.status, &r.verdict) && !is_lower_limit(r.flags);
    let from_mjd_d = day.first().map_or(0.0, |r| r.mjd_mid_d);
    let mut found = Vec::new();
    for pass in passes(rows) {
        let measured: Vec<(f64, f64)> =
            pass.iter().filter(usable).filter_map(|r| Some((r.mjd_mid_d?, r.v_mag?))).collect();
        let mut v_mag: Vec<f64> = measured.iter().map(|m| m.1).collect();
        let (Some(spread), Some((mjd_d, _))) = (Spread::of(&mut v_mag), measured.get(measured.len() / 2)) else {
            continue;
        };
        let moved_d = -((mjd_d - from_mjd_d).floor());
        let at_mjd_d = mjd_d + moved_d;
        let model = |of: fn(&DayRow) -> Option<f64>| between(day, at_mjd_d, of);
        let (p16, p84) = (model(|r| r.model_v_p16_mag), model(|r| r.model_v_p84_mag));
        let within = match (p16, p84) {
            (Some(p16), Some(p84)) if (p16..=p84).contains(&spread.median) => "yes",
            (Some(_), Some(_)) => "no",
            _ => "",
        };
        let row = ObservedRow {
            object_name: pass.first().map(|r| r.object_name.clone()).unwrap_or_default(),
            date_mid: iso_utc(from_mjd_utc(*mjd_d), 0),
            n: v_mag.len() as i64,
            v_mag: spread.median,
            v_p16_mag: spread.p16,
            v_p84_mag: spread.p84,
            model_v_mag: model(|r| r.model_v_mag),
            model_v_p16_mag: p16,
            model_v_p84_mag: p84,
            within: within.into(),
        };
        found.push(ObservedPass { row, v_mag, mjd_d: at_mjd_d, moved_d });
    }
    found
}

/// A magnitude of the day between its rows; `None` next to a moment without light.
fn between(day: &[DayRow], mjd_d: f64, of: fn(&DayRow) -> Option<f64>) -> Option<f64> {
    let after = day.partition_point(|r| r.mjd_mid_d < mjd_d);
    let (b, a) = (day.get(after)?, day.get(after.saturating_sub(1))?);
    let share = if b.mjd_mid_d > a.mjd_mid_d { (mjd_d - a.mjd_mid_d) / (b.mjd_mid_d - a.mjd_mid_d) } else { 0.0 };
    Some((1.0 - share) * of(a)? + share * of(b)?)
}
