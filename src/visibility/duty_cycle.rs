//! How much of a window the Sun leaves for a way of observing: its altitude against thresholds, crossings by root finding.
//!
//! Seconds and rad; altitudes of the Sun's centre, without refraction but in the threshold of sunset. A Sun that never crosses gives all or nothing. Left
//! out: weather, the sky's brightness in twilight.

use crate::base::search::{Until, bisect, golden_section};
use std::f64::consts::PI;

use hifitime::{Epoch, TimeScale, Unit};
use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::orbit::{EarthOrientation, Site, bodies, sun_altaz};

/// Sun's altitudes: its centre in the horizon; sunset (upper limb, 34′ of refraction), where day ends; the ends of civil,
/// nautical and astronomical twilight, where night begins \[deg\].
pub const THRESHOLDS_DEG: [f64; 5] = [0.0, -50.0 / 60.0, -6.0, -12.0, -18.0];
/// Between samples of the altitude \[s\]: it has one maximum and one minimum a day.
const STEP_S: f64 = 1200.0;
/// Crossings are found to this \[s\].
const TIME_TOLERANCE_S: f64 = 0.01;
/// Longest window \[d\].
const LONGEST_D: f64 = 3660.0;

/// Time the Sun spends above thresholds in a window.
#[derive(Debug, Clone, PartialEq)]
pub struct SunTime {
    /// Length of the window \[s\].
    pub window_s: f64,
    /// Time above each of [`THRESHOLDS_DEG`] \[s\].
    pub above_s: [f64; 5],
}

impl SunTime {
    /// Time between two of the thresholds, by their places in [`THRESHOLDS_DEG`] \[s\]; `None` above the first = day.
    #[must_use]
    pub fn between_s(&self, upper: Option<usize>, lower: usize) -> f64 {
        let at = |i: usize| self.above_s.get(i).copied().unwrap_or(0.0);
        at(lower) - upper.map_or(0.0, at)
    }

    /// Time with the Sun below the last threshold \[s\].
    #[must_use]
    pub fn night_s(&self) -> f64 {
        self.window_s - self.above_s[4]
    }
}

/// Time the Sun spends above each of [`THRESHOLDS_DEG`] at a site, from `start` over `days`.
///
/// # Errors
/// [`Error::Config`] for a window that is none or longer than ten years; [`Error::Orbit`] outside 1900-2100.
pub fn sun_time(site: &Site, start: &Epoch, days: f64) -> Result<SunTime> {
    let eop = EarthOrientation::default();
    let altitude = |t_s: f64| -> Result<f64> { Ok(sun_altaz(site, &bodies(&at(start, t_s), &eop)?).0) };
    let (times, samples) = sampled(&altitude, days)?;
    let mut above_s = [0.0; 5];
    for (sum, threshold) in above_s.iter_mut().zip(THRESHOLDS_DEG) {
        *sum = time_above(&altitude, &times, &samples, threshold.to_radians())?;
    }
    Ok(SunTime { window_s: days * 86_400.0, above_s })
}

/// Time a smooth function of time spends above a level \[s\], from its samples.
///
/// # Errors
/// Those of the function.
pub fn time_above(
    f: &(dyn Fn(f64) -> Result<f64> + Sync),
    times_s: &[f64],
    samples: &[f64],
    level: f64,
) -> Result<f64> {
    Ok(spans(f, times_s, samples, level, true)?.iter().map(|[from, to]| to - from).sum())
}

/// The spans of time in which a smooth function is above a level, or not above it \[s\], from its samples: crossings between
/// them by bisection, and a touch between samples found from its extremum.
///
/// # Errors
/// Those of the function.
fn spans(
    f: &(dyn Fn(f64) -> Result<f64> + Sync),
    times_s: &[f64],
    samples: &[f64],
    level: f64,
    above: bool,
) -> Result<Vec<[f64; 2]>> {
    let crossings: Vec<Vec<f64>> = (0..samples.len().saturating_sub(1))
        .into_par_iter()
        .map(|i| {
            let (a, b) = (times_s[i], times_s[i + 1]);
            let up = |v: f64| v > level;
            if up(samples[i]) != up(samples[i + 1]) {
                return Ok(vec![crossing(f, a, b, up(samples[i]), level)?]);
            }
            // a turn between samples may cross and come back: only where the neighbours say that it turns this way
            let before = i.checked_sub(1).map_or(samples[i], |k| samples[k]);
            let after = samples.get(i + 2).copied().unwrap_or(samples[i + 1]);
            let bend = (samples[i + 1] - samples[i])
                .abs()
                .max((samples[i] - before).abs())
                .max((after - samples[i + 1]).abs());
            if (samples[i] - level).abs().min((samples[i + 1] - level).abs()) > bend {
                return Ok(Vec::new());
            }
            let sign = if up(samples[i]) { -1.0 } else { 1.0 };
            let top = highest(f, a, b, sign)?;
            if up(f(top)?) == up(samples[i]) {
                return Ok(Vec::new());
            }
            Ok(vec![crossing(f, a, top, up(samples[i]), level)?, crossing(f, top, b, !up(samples[i]), level)?])
        })
        .collect::<Result<_>>()?;
    let (Some(first), Some(last)) = (times_s.first(), times_s.last()) else { return Ok(Vec::new()) };
    let mut wanted = samples.first().is_some_and(|v| (*v > level) == above);
    let (mut found, mut since) = (Vec::new(), *first);
    for at in crossings.into_iter().flatten().chain([*last]) {
        if wanted {
            found.push([since, at]);
        }
        (wanted, since) = (!wanted, at);
    }
    Ok(found)
}

/// When the Sun is not above an altitude at a site, from `start` over `days`: the dark spans, in order.
///
/// # Errors
/// As [`sun_time`].
pub fn dark_spans(
    site: &Site,
    eop: &EarthOrientation,
    start: &Epoch,
    days: f64,
    sun_alt_rad: f64,
) -> Result<Vec<[Epoch; 2]>> {
    let altitude = |t_s: f64| -> Result<f64> { Ok(sun_altaz(site, &bodies(&at(start, t_s), eop)?).0) };
    let (times, samples) = sampled(&altitude, days)?;
    let spans = spans(&altitude, &times, &samples, sun_alt_rad, false)?;
    Ok(spans.into_iter().map(|span| span.map(|t_s| at(start, t_s))).collect())
}

/// The moment some seconds after another.
fn at(start: &Epoch, t_s: f64) -> Epoch {
    (*start + t_s * Unit::Second).to_time_scale(TimeScale::UTC)
}

/// Samples of the Sun's altitude over a window: times \[s\] and values.
fn sampled(altitude: &(dyn Fn(f64) -> Result<f64> + Sync), days: f64) -> Result<(Vec<f64>, Vec<f64>)> {
    if !(days > 0.0 && days <= LONGEST_D) {
        let problem = format!("{days} d; accepted is above 0, to {LONGEST_D}");
        return Err(Error::Argument { name: "days".into(), problem });
    }
    let window_s = days * 86_400.0;
    let n = (window_s / STEP_S).ceil().max(2.0) as usize;
    let times: Vec<f64> = (0..=n).map(|i| window_s * i as f64 / n as f64).collect();
    let samples = times.par_iter().map(|t| altitude(*t)).collect::<Result<_>>()?;
    Ok((times, samples))
}

/// Where f crosses a level between a and b, `up` at a.
fn crossing(f: &dyn Fn(f64) -> Result<f64>, a: f64, b: f64, up: bool, level: f64) -> Result<f64> {
    let as_at_a = |t_s: f64| Ok::<bool, Error>((f(t_s)? > level) == up);
    let [a, b] = bisect(a, b, Until::Length(TIME_TOLERANCE_S), as_at_a)?;
    Ok(0.5 * (a + b))
}

/// Where `sign`·f is largest between a and b.
fn highest(f: &dyn Fn(f64) -> Result<f64>, a: f64, b: f64, sign: f64) -> Result<f64> {
    Ok(golden_section(a, b, Until::Length(TIME_TOLERANCE_S), |t_s| Ok::<f64, Error>(sign * f(t_s)?))?.0)
}

/// V at which a satellite of an area overhead has a mean surface brightness μ \[mag\]: `m = μ − 2.5 lg(A/h²)`, A/h² in
/// arcsec².
#[must_use]
pub fn v_mag_of_mu(mu_mag_arcsec2: f64, area_m2: f64, height_km: f64) -> f64 {
    let omega_arcsec2 = area_m2 / (height_km * 1e3).powi(2) * (180.0 * 3600.0 / PI).powi(2);
    mu_mag_arcsec2 - 2.5 * omega_arcsec2.log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Epoch {
        Epoch::from_gregorian_str(&format!("{text} UTC")).unwrap()
    }

    fn time(lat_deg: f64, start: &str, days: f64) -> SunTime {
        let site = Site::new(lat_deg, 151.1113, 70.0).unwrap();
        sun_time(&site, &at(start), days).unwrap()
    }

    #[test]
    fn twilight_and_daylight_at_macquarie_in_june_are_the_published_shares() {
        let t = time(-33.7703, "2025-06-11T00:00:00", 1.0);
        let share = |s: f64| 100.0 * s / t.window_s;
        // Caddy et al.: ~12.5 % and ~54 %; by skyfield 2 x 89.1 min from sunset on and 12.92 h
        assert!((share(t.between_s(Some(1), 4)) - 12.4).abs() < 0.1, "{}", share(t.between_s(Some(1), 4)));
        assert!((share(t.above_s[4]) - 53.8).abs() < 0.1, "{}", share(t.above_s[4]));
        assert!((t.between_s(Some(1), 4) / 60.0 - 178.2).abs() < 1.0);
    }

    #[test]
    fn polar_day_and_polar_night_are_all_or_nothing() {
        let day = time(78.0, "2025-06-21T00:00:00", 1.0);
        assert_eq!(day.above_s, [86_400.0; 5]);
        let night = time(89.9, "2025-12-21T00:00:00", 1.0);
        assert_eq!((night.above_s, night.night_s()), ([0.0; 5], 86_400.0));
        // at 69.65 N the Sun of December stays down but twilight comes
        let dusk = time(69.65, "2025-12-21T00:00:00", 1.0);
        assert!(dusk.above_s[1] == 0.0 && dusk.above_s[2] > 3600.0, "{dusk:?}");
    }

    #[test]
    fn a_touch_shorter_than_a_step_is_found_on_either_side() {
        // 200 s above, then 200 s below the level, between samples 1200 s apart
        let times: Vec<f64> = (0..=10).map(|i| 1200.0 * f64::from(i)).collect();
        for sign in [1.0, -1.0] {
            let f = move |t: f64| Ok(sign * (1e4 - (t - 6600.0) * (t - 6600.0)));
            let samples: Vec<f64> = times.iter().map(|t| f(*t).unwrap()).collect();
            let above = time_above(&f, &times, &samples, 0.0).unwrap();
            let expected = if sign > 0.0 { 200.0 } else { 12_000.0 - 200.0 };
            assert!((above - expected).abs() < 0.1, "{sign}: {above}");
        }
    }

    #[test]
    fn a_year_is_the_sum_of_its_days() {
        let year = time(51.5, "2025-01-01T00:00:00", 8.0);
        let days: Vec<SunTime> = (1..=8).map(|d| time(51.5, &format!("2025-01-{d:02}T00:00:00"), 1.0)).collect();
        for i in 0..5 {
            let sum: f64 = days.iter().map(|d| d.above_s[i]).sum();
            assert!((year.above_s[i] - sum).abs() < 1.0, "{i}: {} {sum}", year.above_s[i]);
        }
        let site = Site::new(0.0, 0.0, 0.0).unwrap();
        assert!(sun_time(&site, &at("2025-01-01T00:00:00"), 0.0).is_err());
    }

    #[test]
    fn a_surface_brightness_overhead_is_a_magnitude() {
        // mu 19.65 of 4250.25 m2 at 400 km is 12.02: Caddy et al.
        assert!((v_mag_of_mu(19.652_861_899, 4250.25, 400.0) - 12.02).abs() < 1e-6);
    }
}
