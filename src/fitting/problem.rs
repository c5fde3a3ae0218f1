//! A fitted problem: parameters, residuals, the scatter of magnitudes left out; and polynomials of the phase angle and the Sun's altitude
//! at the satellite. All tables but the first have an offset.
//!
//! Magnitudes. Phase angles enter as φ/100°, altitudes as h/20°, so that steps of 1 are large. Surfaces are in [`super::surfaces`].

use std::collections::HashMap;

use super::mixed::{Fit, MixedFit, Row, fit};
use super::observations::Observation;
use crate::base::error::{Error, Result};
use crate::base::stats::{gauss_within, median, quantile};
use crate::brightness::predictive::{PHASE_POWER, SUN_ALT_POWER};

/// Unit of the phase angle in the fit \[deg\].
const PHASE_UNIT_DEG: f64 = 100.0;
/// Unit of the altitude of the Sun at the satellite in the fit \[deg\].
const SUN_ALT_UNIT_DEG: f64 = 20.0;

/// A fit and what it is of.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Names of the parameters, as they stand in an entry.
    pub names: Vec<String>,
    /// The fit, its parameters in the units of the names.
    pub fit: Fit,
    /// Observed less modelled magnitude of each observation, offsets of passes included; of limits as if observed there.
    pub residuals_mag: Vec<f64>,
    /// The same of fits to four fifths of the satellites (of the passes, where satellites are fewer than five) that it was not in;
    /// empty where those do not tell the parameters.
    pub left_out_mag: Vec<f64>,
}

/// Parts that are left out in turn.
const FOLDS: usize = 5;

impl Problem {
    /// Half the width of the interval that holds 68.27 % of new magnitudes of new satellites about the model, their own errors excluded
    /// \[mag\]: of magnitudes that were left out of the fit, or else of those that were fitted, for the parameters that were free times
    /// √(n/(n − p)), n passes.
    ///
    /// A standard deviation would be too wide: magnitudes of satellites have flares. With limits it is the standard deviation of the fit
    /// all the same, since the faint half of the residuals is not known.
    #[must_use]
    pub fn scatter_mag(&self, observations: &[Observation]) -> f64 {
        if self.fit.n_limits > 0 {
            return self.fit.scatter_mag();
        }
        let is_left_out = !self.left_out_mag.is_empty();
        let residuals = if is_left_out { &self.left_out_mag } else { &self.residuals_mag };
        let mut absolute: Vec<f64> = residuals.iter().map(|r| r.abs()).filter(|r| r.is_finite()).collect();
        let mut errors: Vec<f64> = observations.iter().map(|o| o.err_mag).collect();
        let (Some(half_mag), Some(err_mag)) = (quantile(&mut absolute, gauss_within(1.0)), median(&mut errors)) else {
            return self.fit.scatter_mag();
        };
        let (n, p) = (self.fit.n_passes as f64, self.names.len() as f64);
        let free = match is_left_out {
            true => 1.0,
            false if n > p => n / (n - p),
            // fewer passes than parameters: rows are all there is
            false => self.fit.n as f64 / (self.fit.n as f64 - p).max(1.0),
        };
        (half_mag * half_mag * free - err_mag * err_mag).max(0.0).sqrt().max(self.fit.within_mag)
    }
}

/// Which part each observation is in: the satellites of each table in contiguous fifths, or its passes where its satellites are few;
/// `None` where a table has fewer passes.
fn folds(observations: &[Observation]) -> Option<Vec<usize>> {
    let groups: [fn(&Observation) -> usize; 2] = [|o| o.satellite, |o| o.pass];
    let mut folds = vec![0; observations.len()];
    for table in 0..observations.iter().map(|o| o.table + 1).max()? {
        let of_table = || observations.iter().filter(|o| o.table == table);
        // numbers of a table have no gaps
        let range = |of: fn(&Observation) -> usize| Some((of_table().map(of).min()?, of_table().map(of).max()?));
        let (group, first, n) = groups.into_iter().find_map(|of| {
            let (first, last) = range(of)?;
            (last - first + 1 >= FOLDS).then_some((of, first, last - first + 1))
        })?;
        for (fold, o) in folds.iter_mut().zip(observations).filter(|(_, o)| o.table == table) {
            *fold = (group(o) - first) * FOLDS / n;
        }
    }
    Some(folds)
}

/// The residuals of each row by the fit to the other parts, which begins at the fit to all; empty where one of those fails.
pub(super) fn left_out<F>(observations: &[Observation], problem: &MixedFit<F>, theta: &[f64]) -> Vec<f64>
where
    F: Fn(&[f64], usize) -> Option<(f64, Vec<f64>)>,
{
    let Some(folds) = folds(observations) else { return Vec::new() };
    let mut residuals = vec![f64::NAN; problem.rows.len()];
    for fold in 0..FOLDS {
        let kept: Vec<usize> = (0..folds.len()).filter(|i| folds[*i] != fold).collect();
        let mut numbers = HashMap::new();
        let mut rows = Vec::with_capacity(kept.len());
        for i in &kept {
            let next = numbers.len();
            rows.push(Row { pass: *numbers.entry(problem.rows[*i].pass).or_insert(next), ..problem.rows[*i] });
        }
        let model = |theta: &[f64], k: usize| (problem.model)(theta, kept[k]);
        let part = MixedFit { rows: &rows, names: problem.names, start: theta.to_vec(), model };
        let Ok(fit) = fit(&part) else { return Vec::new() };
        for i in (0..folds.len()).filter(|i| folds[*i] == fold) {
            residuals[i] = problem.rows[i].mag - (problem.model)(&fit.theta, i).map_or(f64::NAN, |(mu, _)| mu);
        }
    }
    residuals
}

pub(super) fn rows_of(observations: &[Observation], mag: impl Fn(&Observation) -> f64) -> Vec<Row> {
    let row = |o: &Observation| Row { mag: mag(o), err_mag: o.err_mag, is_limit: o.is_limit, pass: o.pass };
    observations.iter().map(row).collect()
}

pub(super) fn refused(problem: String) -> Error {
    Error::Model { problem: format!("it cannot be fitted: {problem}") }
}

/// Names of the offsets of all tables but the first.
pub(super) fn offsets(tables: &[String]) -> Vec<String> {
    tables.iter().skip(1).map(|table| format!("offset of {table}")).collect()
}

/// The derivatives of a magnitude by them.
pub(super) fn of_offsets<'a>(observation: &'a Observation, tables: &[String]) -> impl Iterator<Item = f64> + use<'a> {
    (1..tables.len()).map(|t| f64::from(u8::from(observation.table == t)))
}

/// m(φ, h) = Σ c_k φ^k + Σ d_k h^k at 1000 km, φ and h in degrees: `degree` + 1 coefficients of the phase angle, `sun_degree` of the
/// altitude of the Sun at the satellite, and an offset of the magnitudes of each of `tables` but the first.
///
/// # Errors
/// [`Error::Model`]: too few rows, rows without the altitude of the Sun at the satellite where it is asked for, angles that do not tell
/// the coefficients apart, or no convergence.
pub fn phase_law(observations: &[Observation], [degree, sun_degree]: [usize; 2], tables: &[String]) -> Result<Problem> {
    let without = observations.iter().filter(|o| o.sun_alt_sat_deg.is_none()).count();
    if sun_degree > 0 && without > 0 {
        return Err(refused(format!(
            "{without} rows do not tell the altitude of the Sun at the satellite: give elements, or columns of time, site, direction and \
             range, or a column sun_alt_sat_deg"
        )));
    }
    let mut names: Vec<String> = (0..=degree).map(|k| format!("{PHASE_POWER}[{k}]")).collect();
    names.extend((1..=sun_degree).map(|k| format!("{SUN_ALT_POWER}[{k}]")));
    let mut unit: Vec<f64> = (0..=degree).map(|k| PHASE_UNIT_DEG.powi(-(k as i32))).collect();
    unit.extend((1..=sun_degree).map(|k| SUN_ALT_UNIT_DEG.powi(-(k as i32))));
    unit.extend(tables.iter().skip(1).map(|_| 1.0));
    names.extend(offsets(tables));
    let rows = rows_of(observations, |o| o.mag_1000km);
    let powers = |i: usize| {
        let o = &observations[i];
        let (x, h) = (o.phase_deg / PHASE_UNIT_DEG, o.sun_alt_sat_deg.unwrap_or(0.0) / SUN_ALT_UNIT_DEG);
        let phase = (0..=degree).map(move |k| x.powi(k as i32));
        let sun_alt = (1..=sun_degree).map(move |k| h.powi(k as i32));
        phase.chain(sun_alt).chain(of_offsets(o, tables)).collect::<Vec<f64>>()
    };
    let model = |theta: &[f64], i: usize| {
        let powers = powers(i);
        Some((theta.iter().zip(&powers).map(|(c, x)| c * x).sum::<f64>(), powers))
    };
    // a start within a few magnitudes, so that steps are not cut for ever
    let mut start = vec![0.0; names.len()];
    start[0] = median(&mut rows.iter().map(|r| r.mag).collect::<Vec<_>>()).unwrap_or(0.0);
    let problem = MixedFit { rows: &rows, names: &names, start, model };
    let mut fit = fit(&problem).map_err(refused)?;
    let left_out_mag = left_out(observations, &problem, &fit.theta);
    let residuals_mag =
        (0..rows.len()).map(|i| rows[i].mag - model(&fit.theta, i).map_or(f64::NAN, |(mu, _)| mu)).collect();
    fit.theta.iter_mut().zip(&unit).for_each(|(c, unit)| *c *= unit);
    for (row, a) in fit.cov.iter_mut().zip(&unit) {
        row.iter_mut().zip(&unit).for_each(|(c, b)| *c *= a * b);
    }
    Ok(Problem { names, fit, residuals_mag, left_out_mag })
}
