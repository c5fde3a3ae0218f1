//! Is a satellite fainter than a limit: how much of sky and time it is not, by how much, where it is worst, and what would mend it.
//!
//! V magnitudes as seen from the ground, outside the atmosphere; directions of equal solid angle above a smallest altitude, moments in the
//! dark. No rule fixes a statistic: shares, mean, the brightest 5 % and the brightest stand side by side. Not included: how many
//! satellites there are (`forecast::constellation`), flares shorter than the sampling, orbit raising.

mod limits;
mod observed;
mod sensitivity;
mod statistics;

use hifitime::Epoch;
use rayon::prelude::*;

use crate::base::error::Result;
use crate::base::progress::Progress;
use crate::base::stats::median;
use crate::brightness::sky_points::SkyPoints;
use crate::brightness::{Illum, ModelSettings, Satellite};
use crate::orbit::earth::Site;
use crate::tables::ComplianceRow;
use crate::visibility::forecast::dome::{Dome, Overhead};

pub use limits::{BrightnessLimit, satcon1_v_mag, survey_v_mag};
pub use observed::{Magnitude, observed_row};
pub use sensitivity::variants;
pub use statistics::LIT_TO_V_MAG;

use statistics::{BRIGHTEST_FRAC, below, quantile};

/// What is looked at.
#[derive(Debug)]
pub struct Survey<'a> {
    /// Observers, each with the moments of its nights.
    pub nights: Vec<(Site, Vec<Epoch>)>,
    /// Directions of equal solid angle.
    pub points: &'a SkyPoints,
    /// Smallest altitude \[rad\].
    pub min_alt_rad: f64,
    /// Height of the orbits \[km\].
    pub height_km: f64,
    /// Inclination of the orbits \[rad\]: where none of them passes over is not counted; `None` = everywhere.
    pub inclination_rad: Option<f64>,
}

/// A direction at a moment in which the satellite has light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lit {
    /// Which of the nights.
    pub night: usize,
    /// The moment.
    pub epoch: Epoch,
    /// Direction \[rad\].
    pub alt_rad: f64,
    /// Azimuth \[rad\].
    pub az_rad: f64,
    /// Magnitude.
    pub v_mag: f64,
    /// Its error as a prediction.
    pub pred_err_mag: Option<f64>,
    /// Largest light.
    pub illum: Illum,
    /// The Sun \[rad\].
    pub sun_alt_rad: f64,
    /// Its azimuth \[rad\].
    pub sun_az_rad: f64,
}

/// What is seen.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// Directions and moments of each night, lit or not.
    pub n_of_night: Vec<usize>,
    /// Those with light, however little.
    pub lit: Vec<Lit>,
}

impl Sample {
    /// Magnitudes of what counts as lit, the brightest first.
    #[must_use]
    pub fn lit_v_mag(&self) -> Vec<f64> {
        let mut v_mag: Vec<f64> = self.lit.iter().map(|l| l.v_mag).filter(|v| *v < LIT_TO_V_MAG).collect();
        v_mag.sort_unstable_by(f64::total_cmp);
        v_mag
    }

    /// Directions and moments in all.
    #[must_use]
    pub fn n(&self) -> usize {
        self.n_of_night.iter().sum()
    }
}

/// Latitude under a satellite of a height in a direction of a site's sky \[rad\], on a sphere:
/// `ψ = arccos(R cos a/(R + h)) − a`, `sin φ' = sin φ cos ψ + cos φ sin ψ cos A`.
fn latitude_under(site: &Site, height_km: f64, (alt_rad, az_rad): (f64, f64)) -> f64 {
    let radius_km = site.position().norm();
    let psi = (radius_km * alt_rad.cos() / (radius_km + height_km)).acos() - alt_rad;
    let (sin_lat, cos_lat) = site.lat_rad().sin_cos();
    (sin_lat * psi.cos() + cos_lat * psi.sin() * az_rad.cos()).clamp(-1.0, 1.0).asin()
}

/// Asks the model in every direction at every moment. The result does not depend on the number of threads.
///
/// # Errors
/// As [`Dome::new`] and [`crate::Model::brightness`].
pub fn sample(
    satellite: &Satellite,
    settings: &ModelSettings,
    survey: &Survey,
    progress: &dyn Progress,
) -> Result<Sample> {
    let mut all = Sample::default();
    progress.stage(&satellite.name, survey.nights.iter().map(|(_, moments)| moments.len()).sum());
    for (night, (site, moments)) in survey.nights.iter().enumerate() {
        // the track over the site, eastward: sin ψ = cos i / cos φ
        let sin_track = survey.inclination_rad.map_or(1.0, |i| (i.cos() / site.lat_rad().cos()).clamp(-1.0, 1.0));
        let dome = Dome::new(site, satellite, settings, survey.height_km, sin_track.asin())?;
        let reached = |direction: &&(f64, f64)| {
            let latitude = latitude_under(site, survey.height_km, **direction).abs();
            direction.0 >= survey.min_alt_rad
                && survey.inclination_rad.is_none_or(|i| latitude <= i.sin().asin().abs() + 1e-12)
        };
        let directions: Vec<(f64, f64)> = survey.points.directions.iter().filter(reached).copied().collect();
        let of_moment = |epoch: &Epoch| -> Result<Vec<Lit>> {
            let overhead = Overhead::at(site, epoch)?;
            let moment = dome.under(&overhead)?;
            let mut lit = Vec::new();
            for (alt_rad, az_rad) in &directions {
                let Some(seen) = moment.toward(*alt_rad, *az_rad)? else { break };
                let Some(v_mag) = seen.total_v_mag else { continue };
                lit.push(Lit {
                    night,
                    epoch: *epoch,
                    alt_rad: *alt_rad,
                    az_rad: *az_rad,
                    v_mag,
                    pred_err_mag: seen.v_pred_err_mag,
                    illum: seen.illum,
                    sun_alt_rad: overhead.sun.alt_rad,
                    sun_az_rad: overhead.sun.az_rad,
                });
            }
            progress.tick();
            Ok(lit)
        };
        let lit = moments.par_iter().map(of_moment).collect::<Result<Vec<_>>>()?;
        all.lit.extend(lit.into_iter().flatten());
        all.n_of_night.push(directions.len() * moments.len());
    }
    progress.done();
    Ok(all)
}

/// The row of a limit.
#[must_use]
pub fn judged(sample: &Sample, limit: &BrightnessLimit, variant: &str) -> ComplianceRow {
    let lit = || sample.lit.iter().filter(|l| l.v_mag < LIT_TO_V_MAG);
    let (n, n_lit) = (sample.n(), lit().count());
    let share_of = |brighter: f64, of: usize| (of > 0).then(|| brighter / of as f64);
    let brighter = |shift: &dyn Fn(&Lit) -> f64| sample.lit.iter().filter(|l| l.v_mag + shift(l) < limit.v_mag).count();
    let plain = brighter(&|_| 0.0) as f64;
    // a prediction is known to its error: every magnitude off by it the same way, or each by itself
    let known = n_lit > 0 && sample.lit.iter().all(|l| l.pred_err_mag.is_some());
    let err = |l: &Lit| l.pred_err_mag.unwrap_or(0.0);
    let by_all = |sign: f64| known.then(|| share_of(brighter(&|l| sign * err(l)) as f64, n)).flatten();
    let expected: f64 = sample.lit.iter().map(|l| below(limit.v_mag - l.v_mag, err(l))).sum();
    let v_mag = sample.lit_v_mag();
    let mean_v_mag = share_of(v_mag.iter().sum(), n_lit);
    let v_p05_mag = quantile(&v_mag, BRIGHTEST_FRAC);
    let mut errors: Vec<f64> = lit().filter_map(|l| l.pred_err_mag).collect();
    ComplianceRow {
        of: "model".into(),
        variant: variant.into(),
        rule: limit.name.clone(),
        limit_v_mag: limit.v_mag,
        n: n as i64,
        n_lit: n_lit as i64,
        n_passes: None,
        brighter_frac: share_of(plain, n),
        brighter_p16_frac: by_all(1.0),
        brighter_p84_frac: by_all(-1.0),
        expected_frac: known.then(|| share_of(expected, n)).flatten(),
        lit_brighter_frac: share_of(lit().filter(|l| l.v_mag < limit.v_mag).count() as f64, n_lit),
        mean_v_mag,
        v_p05_mag,
        brightest_v_mag: v_mag.first().copied(),
        margin_mag: v_p05_mag.map(|v| v - limit.v_mag),
        v_pred_err_mag: median(&mut errors).filter(|_| known),
        note: if n_lit == 0 { "nothing is lit".into() } else { String::new() },
    }
}
