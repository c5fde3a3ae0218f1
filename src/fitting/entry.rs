//! The result of a fit as an entry of a file of satellites, with what it rests on.
//!
//! Degrees, km, magnitudes.

use super::observations::Observation;
use super::parameters::{Free, surfaces_at};
use super::problem::Problem;
use crate::base::error::Result;
use crate::base::time::{from_mjd_utc, iso_utc};
use crate::brightness::Entry;
use crate::brightness::catalogue::Fitted;
use crate::brightness::predictive::{PHASE_POWER, SUN_ALT_POWER};
use crate::config::Empirical;

/// What the fit rests on.
fn fitted(problem: &Problem, observations: &[Observation], table: &str) -> Fitted {
    let bounds = |of: &dyn Fn(&Observation) -> Option<f64>| {
        let values = observations.iter().filter_map(of);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let mjd = bounds(&|o| o.mjd_d);
    let date = |mjd_d: f64| if mjd_d.is_finite() { iso_utc(from_mjd_utc(mjd_d), 0) } else { String::new() };
    Fitted {
        table: table.to_owned(),
        n: problem.fit.n,
        n_limits: problem.fit.n_limits,
        n_passes: problem.fit.n_passes,
        dates_utc: [date(mjd[0]), date(mjd[1])],
        phase_deg: bounds(&|o| Some(o.phase_deg)),
        range_km: bounds(&|o| Some(o.range_km)),
        within_mag: problem.fit.within_mag,
        between_mag: problem.fit.between_mag,
        parameters: problem.names.clone(),
        values: problem.fit.theta.clone(),
        covariance: problem.fit.cov.clone(),
    }
}

fn noted(mut entry: Entry, problem: &Problem, observations: &[Observation], fitted: Fitted) -> Entry {
    let limits = if fitted.n_limits > 0 { format!(" and {} limits", fitted.n_limits) } else { String::new() };
    let source = format!(
        "satphot fit of {} magnitudes{limits} in {} passes of {}",
        fitted.n - fitted.n_limits,
        fitted.n_passes,
        fitted.table
    );
    entry.scatter_mag = Some((1e3 * problem.scatter_mag(observations)).round() / 1e3);
    entry.sources.insert(
        "scatter".into(),
        format!(
            "68 % of the same{} lie within it; within passes {:.3}, between passes {:.3} mag",
            if problem.left_out_mag.is_empty() { "" } else { ", left out of fits in fifths," },
            fitted.within_mag,
            fitted.between_mag
        ),
    );
    entry.sources.insert("fit".into(), source);
    entry.fit = Some(fitted);
    entry
}

/// The entry of a law of the phase angle, valid between the phase angles of the magnitudes.
#[must_use]
pub fn fitted_phase_law(name: &str, problem: &Problem, observations: &[Observation], table: &str) -> Entry {
    let fitted = fitted(problem, observations, table);
    let coefficients = |of: &str| {
        let named = problem.names.iter().zip(&problem.fit.theta);
        named.filter(|(name, _)| name.starts_with(of)).map(|(_, c)| *c).collect::<Vec<f64>>()
    };
    let per_sun_alt_sat = coefficients(SUN_ALT_POWER);
    let alt_deg = observations.iter().filter_map(|o| o.sun_alt_sat_deg);
    let sun_alt_sat_deg = match per_sun_alt_sat.is_empty() {
        true => [-90.0, 90.0],
        false => alt_deg.fold([90.0, -90.0], |[low, high]: [f64; 2], deg| [low.min(deg), high.max(deg)]),
    };
    let empirical = Empirical::Polynomial {
        mag_1000km: coefficients(PHASE_POWER),
        per_sun_alt_sat,
        phase_deg: fitted.phase_deg,
        sun_alt_sat_deg,
    };
    let entry = Entry {
        title: format!("fitted to {table}"),
        caveat: "an empirical law: no surfaces, no flares, nothing outside the angles of its data".into(),
        empirical: Some(empirical),
        ..Entry::named(name)
    };
    noted(entry, problem, observations, fitted)
}

/// The entry of surfaces with the parameters found.
///
/// # Errors
/// [`crate::Error::Model`] for values that make no law.
pub fn fitted_surfaces(
    name: &str,
    of: &Entry,
    free: &[Free],
    problem: &Problem,
    observations: &[Observation],
    table: &str,
) -> Result<Entry> {
    let what: Vec<&str> = problem.names.iter().take(free.len()).map(String::as_str).collect();
    let mut entry = Entry {
        title: format!("{}, fitted to {table}", of.name),
        surfaces: surfaces_at(&of.surfaces, free, &problem.fit.theta)?,
        orbits: of.orbits.clone(),
        sources: of.sources.clone(),
        caveat: "areas are effective: magnitudes tell area times reflectance alone".into(),
        ..Entry::named(name)
    };
    entry.sources.insert("areas".into(), format!("those of {}, but {} of the fit", of.name, what.join(", ")));
    Ok(noted(entry, problem, observations, fitted(problem, observations, table)))
}
