//! What is fitted: a polynomial of the phase angle, or the strength of each surface.
//!
//! Magnitudes. Phase angles enter as φ/100°, strengths as their logarithms, so that steps of 1 are large for all.

use super::mixed::{Fit, MixedFit, Row, fit};
use super::observations::Observation;
use crate::base::constants::MAG_PER_LN;
use crate::base::error::{Error, Result};
use crate::base::stats::{gauss_within, median, quantile};
use crate::brightness::predictive::LN_SCALE;

/// Unit of the phase angle in the fit \[deg\].
const PHASE_UNIT_DEG: f64 = 100.0;

/// A fit and what it is of.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Names of the parameters, as they stand in an entry.
    pub names: Vec<String>,
    /// The fit, its parameters in the units of the names.
    pub fit: Fit,
    /// Observed less modelled magnitude of each observation, offsets of passes included; of limits as if observed there.
    pub residuals_mag: Vec<f64>,
}

impl Problem {
    /// Half the width of the interval that holds 68.27 % of new magnitudes of new passes about the model, their own errors and those
    /// of the parameters excluded \[mag\]: of the magnitudes that were fitted, for the parameters that were free times √(n/(n − p)), n
    /// passes.
    ///
    /// A standard deviation would be too wide: magnitudes of satellites have flares. With limits it is the standard deviation of the fit
    /// all the same, since the faint half of the residuals is not known.
    #[must_use]
    pub fn scatter_mag(&self, observations: &[Observation]) -> f64 {
        if self.fit.n_limits > 0 {
            return self.fit.scatter_mag();
        }
        let mut absolute: Vec<f64> = self.residuals_mag.iter().map(|r| r.abs()).filter(|r| r.is_finite()).collect();
        let mut errors: Vec<f64> = observations.iter().map(|o| o.err_mag).collect();
        let (Some(half_mag), Some(err_mag)) = (quantile(&mut absolute, gauss_within(1.0)), median(&mut errors)) else {
            return self.fit.scatter_mag();
        };
        let (n, p) = (self.fit.n_passes as f64, self.names.len() as f64);
        // fewer passes than parameters: rows are all there is
        let free = if n > p { n / (n - p) } else { self.fit.n as f64 / (self.fit.n as f64 - p).max(1.0) };
        (half_mag * half_mag * free - err_mag * err_mag).max(0.0).sqrt().max(self.fit.within_mag)
    }
}

fn rows_of(observations: &[Observation], mag: impl Fn(&Observation) -> f64) -> Vec<Row> {
    let row = |o: &Observation| Row { mag: mag(o), err_mag: o.err_mag, is_limit: o.is_limit, pass: o.pass };
    observations.iter().map(row).collect()
}

fn refused(problem: String) -> Error {
    Error::Model { problem: format!("it cannot be fitted: {problem}") }
}

/// m(φ) = Σ c_k φ^k at 1000 km, φ in degrees: `degree` + 1 coefficients.
///
/// # Errors
/// [`Error::Model`]: too few rows, phase angles that do not tell the coefficients apart, or no convergence.
pub fn phase_law(observations: &[Observation], degree: usize) -> Result<Problem> {
    let names: Vec<String> = (0..=degree).map(|k| format!("mag_1000km[{k}]")).collect();
    let rows = rows_of(observations, |o| o.mag_1000km);
    let powers = |i: usize| {
        let x = observations[i].phase_deg / PHASE_UNIT_DEG;
        (0..=degree).map(|k| x.powi(k as i32)).collect::<Vec<f64>>()
    };
    let model = |theta: &[f64], i: usize| {
        let powers = powers(i);
        Some((theta.iter().zip(&powers).map(|(c, x)| c * x).sum::<f64>(), powers))
    };
    // a start within a few magnitudes, so that steps are not cut for ever
    let mut start = vec![0.0; degree + 1];
    start[0] = median(&mut rows.iter().map(|r| r.mag).collect::<Vec<_>>()).unwrap_or(0.0);
    let mut fit = fit(&MixedFit { rows: &rows, names: &names, start, model }).map_err(refused)?;
    let residuals_mag =
        (0..rows.len()).map(|i| rows[i].mag - model(&fit.theta, i).map_or(f64::NAN, |(mu, _)| mu)).collect();
    let unit = |k: usize| PHASE_UNIT_DEG.powi(-(k as i32));
    fit.theta.iter_mut().enumerate().for_each(|(k, c)| *c *= unit(k));
    for (a, row) in fit.cov.iter_mut().enumerate() {
        row.iter_mut().enumerate().for_each(|(b, c)| *c *= unit(a) * unit(b));
    }
    Ok(Problem { names, fit, residuals_mag })
}

/// How many times stronger each surface scatters than its entry says: V = −2.5 lg Σ a_s F_s, a_s > 0.
///
/// `flux[i][s]` is what surface `s` sends in observation `i`, relative to a star of magnitude 0; the last are the free ones' names.
///
/// # Errors
/// As [`phase_law`]; also where a surface sends no light in any row.
pub fn surface_scales(
    observations: &[Observation],
    flux: &[Vec<f64>],
    free: &[bool],
    names: &[String],
) -> Result<Problem> {
    let named: Vec<String> =
        names.iter().zip(free).filter(|(_, free)| **free).map(|(name, _)| format!("{LN_SCALE}{name}")).collect();
    let rows = rows_of(observations, |o| o.v_mag);
    let model = |theta: &[f64], i: usize| {
        let mut next = theta.iter();
        let scale: Vec<f64> =
            free.iter().map(|free| if *free { next.next().map_or(1.0, |t| t.exp()) } else { 1.0 }).collect();
        let sent: Vec<f64> = flux[i].iter().zip(&scale).map(|(f, a)| f * a).collect();
        let total: f64 = sent.iter().sum();
        if total <= 0.0 {
            return None;
        }
        let gradient = sent.iter().zip(free).filter(|(_, free)| **free).map(|(s, _)| -MAG_PER_LN * s / total);
        Some((-2.5 * total.log10(), gradient.collect()))
    };
    let start = vec![0.0; named.len()];
    let fit = fit(&MixedFit { rows: &rows, names: &named, start, model }).map_err(refused)?;
    let residuals_mag =
        (0..rows.len()).map(|i| rows[i].mag - model(&fit.theta, i).map_or(f64::NAN, |(mu, _)| mu)).collect();
    if let Some(k) = (0..named.len()).find(|k| fit.errs()[*k] > 1.0) {
        return Err(refused(format!(
            "the data do not tell {}: its error is a factor of {:.1}; hold it",
            named[k],
            fit.errs()[k].exp()
        )));
    }
    Ok(Problem { names: named, fit, residuals_mag })
}
