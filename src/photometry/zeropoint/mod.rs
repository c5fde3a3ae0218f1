//! Zeropoint, extinction and colour term from catalogue stars: V = V_inst − ZP − k X − C (B−V).
//!
//! V_inst = −2.5 log10(electrons per second); magnitudes throughout. Fitted centred on the mean airmass and colour by
//! orthogonal factors, reported at airmass 0 and colour 0 with the full covariance. Left out: second-order extinction,
//! drifts in time; cuts on stars are the caller's.

mod file;
mod jackknife;
mod robust;
mod rows;
mod solve;

use crate::config;
use crate::error::{Error, Result};
use crate::photometry::stats;
use rows::{Rows, Term};

/// One catalogue star measured in one pointing. An error that is NaN or not positive is unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarMeasurement {
    /// Instrumental magnitude, −2.5 log10(e⁻/s) \[mag\].
    pub inst_mag: f64,
    /// Its random error \[mag\].
    pub inst_err_mag: f64,
    /// Catalogue V \[mag\].
    pub v_mag: f64,
    /// Its error \[mag\].
    pub v_err_mag: f64,
    /// Catalogue B−V \[mag\]; may be NaN only where the colour term is pinned to 0.
    pub b_v_mag: f64,
    /// Its error \[mag\].
    pub b_v_err_mag: f64,
    /// Airmass X of the star or of its pointing.
    pub airmass: f64,
    /// Which pointing; stars of one pointing may share an error (a cloud).
    pub pointing: usize,
}

/// A zeropoint with all that is needed to use and to judge it.
#[derive(Debug, Clone, PartialEq)]
pub struct Zeropoint {
    /// ZP \[mag\], for V_inst of electrons per second, outside the atmosphere, at B−V = 0.
    pub zp_mag: f64,
    /// Extinction k \[mag/airmass\].
    pub k_mag_airmass: f64,
    /// Colour term C \[mag/mag\].
    pub c_mag_mag: f64,
    /// Covariance of (ZP, k, C).
    pub cov: [[f64; 3]; 3],
    /// `robust` or `ols`.
    pub estimator: String,
    /// Measurements with weight.
    pub n_used: usize,
    /// Measurements the robust fit gave no weight.
    pub n_rejected: usize,
    /// Pointings with a used measurement.
    pub n_pointings: usize,
    /// Root mean square residual of the used measurements \[mag\].
    pub rms_mag: f64,
    /// 1.4826 MAD of all residuals, the rejected ones included \[mag\].
    pub robust_sigma_mag: f64,
    /// Scatter beyond the stated errors that makes them agree with the residuals \[mag\].
    pub intrinsic_mag: f64,
    /// χ² per degree of freedom of the used measurements with their stated errors alone; `None` without degrees of
    /// freedom or stated errors.
    pub chi2_dof: Option<f64>,
    /// Probability of a χ² at least as large.
    pub p_value: Option<f64>,
    /// Condition number of the centred matrix with columns of equal length.
    pub condition: f64,
    /// Mean airmass of the used measurements.
    pub airmass_mean: f64,
    /// Mean B−V of the used measurements \[mag\].
    pub b_v_mean_mag: f64,
    /// Smallest and largest airmass used.
    pub airmass_range: [f64; 2],
    /// Smallest and largest B−V used \[mag\].
    pub b_v_range_mag: [f64; 2],
    /// How k came about: `fitted`, `pinned 0.12`, `refused: all stars within 0.02 airmass`.
    pub k_note: String,
    /// How C came about.
    pub c_note: String,
    /// Where the covariance is from.
    pub cov_note: String,
    /// What the observer should know.
    pub warnings: Vec<String>,
    /// Robust weight of each input row, 0 to 1; 0 = rejected or unusable.
    pub weights: Vec<f64>,
    /// Residual V_inst − V − ZP − k X − C (B−V) of each input row \[mag\]; NaN for an unusable row.
    pub residuals_mag: Vec<f64>,
}

impl Zeropoint {
    /// V = V_inst − ZP − k X − C (B−V) \[mag\].
    #[must_use]
    pub fn v_mag(&self, inst_mag: f64, airmass: f64, b_v_mag: f64) -> f64 {
        inst_mag - self.zp_mag - self.k_mag_airmass * airmass - self.c_mag_mag * b_v_mag
    }

    /// Error of the calibration at an airmass and a colour \[mag\].
    ///
    /// σ² = gᵀ Cov g + (C σ_BV)², g = (1, X, B−V). The error of V_inst itself is not in it.
    #[must_use]
    pub fn err_mag(&self, airmass: f64, b_v_mag: f64, b_v_err_mag: f64) -> f64 {
        let g = [1.0, airmass, b_v_mag];
        let mut var = (self.c_mag_mag * b_v_err_mag).powi(2);
        for (i, row) in self.cov.iter().enumerate() {
            for (j, c) in row.iter().enumerate() {
                var += g[i] * c * g[j];
            }
        }
        var.max(0.0).sqrt()
    }

    /// The error as the paper adds it up, √(σ_ZP² + σ_k² + σ_C²) \[mag\]: no airmass, no colour, no correlation.
    #[must_use]
    pub fn err_as_published_mag(&self) -> f64 {
        (self.cov[0][0] + self.cov[1][1] + self.cov[2][2]).max(0.0).sqrt()
    }

    /// Standard errors of (ZP, k, C).
    #[must_use]
    pub fn errs(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.cov[i][i].max(0.0).sqrt())
    }
}

/// Condition number above which the observer is warned.
const CONDITION_WARN: f64 = 30.0;

/// Fits ZP, k and C.
///
/// `robust`: L1 or least-median start, Tukey's biweight to convergence, effective variance σ_inst² + σ_cat² + (C σ_BV)² + τ²
/// with τ from the residuals; covariance of the M-estimator or of the delete-one-pointing jackknife, whichever is larger.
/// `ols`: equal weights, s² (AᵀA)⁻¹. The result does not depend on the order of the rows, to the bit.
///
/// # Errors
/// [`Error::Zeropoint`] with counts: too few stars, no usable row, too large a share rejected.
pub fn fit(measurements: &[StarMeasurement], config: &config::Zeropoint) -> Result<Zeropoint> {
    let terms = [Term::of(config.pin_k), Term::of(config.pin_c)];
    let mut rows = Rows::select(measurements, terms, config)?;
    rows.refuse_what_cannot_be_told_apart()?;
    let start = match config.estimator {
        config::Estimator::Ols => robust::ols(&rows)?,
        config::Estimator::Robust => robust::tukey(&rows)?,
    };
    let rejected = start.weights.iter().filter(|w| **w == 0.0).count();
    if rejected as f64 > config.max_rejected_frac * rows.len() as f64 {
        return Err(Error::Zeropoint {
            problem: format!(
                "{rejected} of {} stars rejected, more than zeropoint.max_rejected_frac = {}; no majority agrees: \
                 check the match, clouds and saturation",
                rows.len(),
                config.max_rejected_frac
            ),
        });
    }
    rows.enough(rows.len() - rejected, config.min_stars, &format!("{rejected} rejected as outliers"))?;
    let clustered = jackknife::by_pointing(&rows, &start, config.estimator);
    Ok(report(&rows, &start, &clustered, config, measurements.len()))
}

/// Puts a converged fit into the form the rest of the night uses.
fn report(
    rows: &Rows,
    fit: &robust::Fit,
    clustered: &jackknife::Jackknife,
    config: &config::Zeropoint,
    n_input: usize,
) -> Zeropoint {
    let robust = config.estimator == config::Estimator::Robust;
    let mut warnings = rows.warnings.clone();
    let (mut cov, mut cov_note) = if robust {
        (fit.cov, "M-estimator".to_owned())
    } else {
        (fit.cov, "least squares, s² (AᵀA)⁻¹".to_owned())
    };
    if robust && let Some(jack) = clustered.cov {
        if jackknife::larger(&jack, &fit.cov) {
            cov = jack;
            cov_note =
                format!("delete-one-pointing jackknife ({} pointings), larger than that of single stars", clustered.n);
        } else {
            cov_note = format!("M-estimator, larger than the jackknife of {} pointings", clustered.n);
        }
    }
    if robust && clustered.n > 0 && clustered.n < jackknife::FEWEST {
        warnings.push(format!(
            "{} pointings: too few for a jackknife, so a scatter between pointings is not in the errors",
            clustered.n
        ));
    }
    warnings.extend(clustered.warnings.iter().cloned());

    let used: Vec<usize> = (0..rows.len()).filter(|i| fit.weights[*i] > 0.0).collect();
    let residuals: Vec<f64> = (0..rows.len()).map(|i| rows.residual(i, &fit.theta)).collect();
    let condition = rows.condition(&fit.weights);
    if condition > CONDITION_WARN {
        warnings.push(format!(
            "condition number {condition:.0}: airmass and colour hardly vary apart; pin a term or spread the pointings"
        ));
    }
    if robust && used.len() * 5 < rows.len() * 4 {
        warnings.push(format!("{} of {} measurements rejected as outliers", rows.len() - used.len(), rows.len()));
    }
    let (zp_mag, cov) = rows.uncentred(&fit.theta, &cov);
    let range = |f: &dyn Fn(usize) -> f64| {
        let values = used.iter().map(|i| f(*i)).filter(|v| v.is_finite());
        let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        if range[0] <= range[1] { range } else { [f64::NAN; 2] }
    };
    let b_v_range_mag = range(&|i| rows.star(i).b_v_mag);
    let (chi2_dof, p_value) = rows.chi2(&used, &fit.theta);
    let mut out = Zeropoint {
        zp_mag,
        k_mag_airmass: rows.terms[0].held().unwrap_or(fit.theta[1]),
        c_mag_mag: rows.terms[1].held().unwrap_or(fit.theta[2]),
        cov,
        estimator: if robust { "robust" } else { "ols" }.to_owned(),
        n_used: used.len(),
        n_rejected: rows.len() - used.len(),
        n_pointings: rows.n_pointings(&used),
        rms_mag: (used.iter().map(|i| residuals[*i].powi(2)).sum::<f64>() / used.len() as f64).sqrt(),
        robust_sigma_mag: stats::mad_sigma(&mut residuals.clone()).unwrap_or(0.0),
        intrinsic_mag: fit.intrinsic_mag,
        chi2_dof,
        p_value,
        condition,
        airmass_mean: rows.mean[0],
        b_v_mean_mag: if b_v_range_mag[0].is_nan() { f64::NAN } else { rows.mean[1] },
        airmass_range: range(&|i| rows.star(i).airmass),
        b_v_range_mag,
        k_note: rows.terms[0].note(),
        c_note: rows.terms[1].note(),
        cov_note,
        warnings,
        weights: vec![0.0; n_input],
        residuals_mag: vec![f64::NAN; n_input],
    };
    for (i, r) in residuals.iter().enumerate() {
        out.weights[rows.input(i)] = fit.weights[i];
        out.residuals_mag[rows.input(i)] = *r;
    }
    out
}

/// The median of values, which are reordered; 0 if there are none.
fn median(values: &mut [f64]) -> f64 {
    stats::median(values).unwrap_or(0.0)
}
