//! Robust least squares with an offset per pass: what is fitted, how far the data say it, and the scatter that is left.
//!
//! Magnitudes. y_ij = μ_ij(θ) + b_j + e_ij; b_j Gaussian of variance τ², e_ij of a Student t of ν degrees of freedom and the scale
//! √(err² + s²). Weights of the t distribution, Gauss-Newton steps, offsets by partly demeaned rows (Fuller & Battese 1974, J.
//! Econometrics 2, 67), τ² from the means of the passes (Paule & Mandel 1982, J. Res. NBS 87, 377), lower limits of magnitude by
//! their expectation (Tobin 1958, Econometrica 26, 24). It does not cover which function is fitted.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use crate::base::search::{Until, bisect};

/// ν: tails as of magnitudes within passes, whose kurtosis is of tens.
const NU: f64 = 4.0;
/// Rounds after which the fit has not converged.
const MAX_ROUNDS: usize = 200;
/// A step that moves no parameter by more of its error ends the fit.
const CONVERGED: f64 = 1e-4;
/// Scatter below this is none \[mag\].
const FLOOR_MAG: f64 = 1e-4;
/// Condition number of the scaled design above which a combination of parameters is not told by the data.
const MOST_CONDITION: f64 = 1e5;
/// Largest step of one round, in units of each parameter's scale.
const LARGEST_STEP: f64 = 1.0;

/// One magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The magnitude, or the limit that it is fainter than.
    pub mag: f64,
    /// Its error \[mag\].
    pub err_mag: f64,
    /// Whether it is a limit.
    pub is_limit: bool,
    /// Number of its pass, from 0 without gaps.
    pub pass: usize,
}

/// What a fit is asked.
#[derive(Debug)]
pub struct MixedFit<'a, F> {
    /// The magnitudes.
    pub rows: &'a [Row],
    /// Names of the parameters.
    pub names: &'a [String],
    /// Where it begins.
    pub start: Vec<f64>,
    /// μ of a row and its derivatives by the parameters; `None` where the model has no light.
    pub model: F,
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub theta: Vec<f64>,
    /// Their covariance.
    pub cov: Vec<Vec<f64>>,
    /// s, scale of the scatter within passes beyond the errors of the rows \[mag\].
    pub within_mag: f64,
    /// τ, scatter of the passes \[mag\].
    pub between_mag: f64,
    /// Offset of each pass, shrunk \[mag\].
    pub offsets_mag: Vec<f64>,
    /// Rows used.
    pub n: usize,
    /// Of those, limits.
    pub n_limits: usize,
    /// Passes with rows.
    pub n_passes: usize,
    /// Rounds taken.
    pub rounds: usize,
}

impl Fit {
    /// Standard deviation of one new magnitude of a new pass about the model, its own error excluded \[mag\]: √(τ² + s² ν/(ν − 2)).
    #[must_use]
    pub fn scatter_mag(&self) -> f64 {
        self.between_mag.hypot(self.within_mag * (NU / (NU - 2.0)).sqrt())
    }

    /// Errors of the parameters.
    #[must_use]
    pub fn errs(&self) -> Vec<f64> {
        (0..self.theta.len()).map(|k| self.cov[k][k].max(0.0).sqrt()).collect()
    }
}

/// The state of one round.
struct Round {
    mu: Vec<f64>,
    gradient: DMatrix<f64>,
}

/// Fits the parameters.
///
/// # Errors
/// Why there is no fit: too few rows or passes, a combination of parameters that the data do not tell (named), or no convergence.
pub fn fit<F>(problem: &MixedFit<F>) -> Result<Fit, String>
where
    F: Fn(&[f64], usize) -> Option<(f64, Vec<f64>)>,
{
    let (rows, p) = (problem.rows, problem.names.len());
    let n_passes = rows.iter().map(|r| r.pass + 1).max().unwrap_or(0);
    let detections = rows.iter().filter(|r| !r.is_limit).count();
    if detections < p + 2 {
        return Err(format!("{detections} magnitudes are too few for {p} parameters; at least {} are needed", p + 2));
    }
    let mut theta = problem.start.clone();
    let (mut within2, mut between2) = (0.1f64.powi(2), 0.0);
    let mut offsets = vec![0.0; n_passes];
    let single = rows.len() <= n_passes;
    let mut calm = 0;
    for rounds in 1..=MAX_ROUNDS {
        let round = evaluated(problem, &theta)?;
        let sigma2: Vec<f64> = rows.iter().map(|r| variance(r, within2)).collect();
        // a limit stands for what is expected beyond it
        let (y, told): (Vec<f64>, Vec<f64>) = rows
            .iter()
            .enumerate()
            .map(|(i, r)| match r.is_limit {
                false => (r.mag, 1.0),
                true => beyond(r.mag, round.mu[i] + offsets[r.pass], sigma2[i].sqrt()),
            })
            .unzip();
        let residual: Vec<f64> = (0..rows.len()).map(|i| y[i] - round.mu[i] - offsets[rows[i].pass]).collect();
        let weight = |i: usize| {
            let z2 = residual[i] * residual[i] / sigma2[i];
            if rows[i].is_limit { 1.0 } else { (NU + 1.0) / (NU + z2) }
        };
        let omega: Vec<f64> = (0..rows.len()).map(|i| weight(i) / sigma2[i]).collect();
        let raw: Vec<f64> = (0..rows.len()).map(|i| y[i] - round.mu[i]).collect();
        let (step, _) = solved(rows, &round.gradient, &raw, &omega, between2, problem.names)?;
        let largest = step.iter().map(|s| s.abs()).fold(0.0, f64::max);
        let damping = if largest > LARGEST_STEP { LARGEST_STEP / largest } else { 1.0 };
        theta.iter_mut().zip(step.iter()).for_each(|(t, s)| *t += damping * s);

        // scatter: after the step, with the weights of before
        let round = evaluated(problem, &theta)?;
        let raw: Vec<f64> = (0..rows.len()).map(|i| y[i] - round.mu[i]).collect();
        let means = pass_means(rows, &omega, &raw, n_passes);
        offsets = means.iter().map(|(w, m)| shrunk(*w, between2) * m).collect();
        let left: Vec<f64> = (0..rows.len()).map(|i| raw[i] - offsets[rows[i].pass]).collect();
        let told_n: f64 = told.iter().sum();
        let fitted_offsets: f64 = means.iter().map(|(w, _)| shrunk(*w, between2)).sum();
        let within = told_n - if between2 > 0.0 { fitted_offsets } else { 0.0 } - p as f64;
        let new_within2 = scale2(rows, &left, &told, within.max(1.0));
        let new_between2 = if single { 0.0 } else { between(&means, (n_passes as f64 - p as f64).max(1.0)) };
        let moved = (new_within2.sqrt() - within2.sqrt()).abs() + (new_between2.sqrt() - between2.sqrt()).abs();
        (within2, between2) = (new_within2, new_between2);

        let cov = covariance(rows, &round.gradient, &told, (within2, between2), problem.names)?;
        let small = (0..p).all(|k| (damping * step[k]).abs() <= CONVERGED * cov[(k, k)].max(0.0).sqrt().max(1e-12));
        calm = if small && moved < CONVERGED * 0.1 { calm + 1 } else { 0 };
        if calm >= 2 {
            return Ok(Fit {
                theta,
                cov: (0..p).map(|a| (0..p).map(|b| cov[(a, b)]).collect()).collect(),
                within_mag: within2.sqrt(),
                between_mag: between2.sqrt(),
                offsets_mag: offsets,
                n: rows.len(),
                n_limits: rows.len() - detections,
                n_passes,
                rounds,
            });
        }
    }
    Err(format!("the fit did not converge in {MAX_ROUNDS} rounds"))
}

/// err² + s², which is never 0.
fn variance(row: &Row, within2: f64) -> f64 {
    (row.err_mag * row.err_mag + within2).max(FLOOR_MAG * FLOOR_MAG)
}

fn evaluated<F>(problem: &MixedFit<F>, theta: &[f64]) -> Result<Round, String>
where
    F: Fn(&[f64], usize) -> Option<(f64, Vec<f64>)>,
{
    let n = problem.rows.len();
    let mut round = Round { mu: Vec::with_capacity(n), gradient: DMatrix::zeros(n, theta.len()) };
    for i in 0..n {
        let (mu, gradient) = (problem.model)(theta, i)
            .filter(|(mu, gradient)| mu.is_finite() && gradient.iter().all(|g| g.is_finite()))
            .ok_or("the model has no light in a row that is fitted")?;
        round.mu.push(mu);
        gradient.iter().enumerate().for_each(|(k, g)| round.gradient[(i, k)] = *g);
    }
    Ok(round)
}

/// E[y | y > limit] of a Gaussian, and the share of a row that it tells: 1 − Var[y | y > limit]/σ².
fn beyond(limit: f64, mu: f64, sigma: f64) -> (f64, f64) {
    let normal = Normal::standard();
    let alpha = (limit - mu) / sigma;
    let tail = normal.sf(alpha);
    // far beyond the limit the expectation is the limit plus σ/α
    let hazard = if tail > 1e-12 { normal.pdf(alpha) / tail } else { alpha + 1.0 / alpha.max(1.0) };
    let told = (hazard * (hazard - alpha)).clamp(0.0, 1.0);
    (mu + sigma * hazard, told)
}

/// Share of its mean residual that a pass of weight W takes: τ² W / (1 + τ² W).
fn shrunk(weight: f64, between2: f64) -> f64 {
    between2 * weight / (1.0 + between2 * weight)
}

/// Σ ω and the weighted mean of the residuals of each pass.
fn pass_means(rows: &[Row], omega: &[f64], residual: &[f64], n_passes: usize) -> Vec<(f64, f64)> {
    let mut sums = vec![(0.0, 0.0); n_passes];
    for (i, row) in rows.iter().enumerate() {
        sums[row.pass].0 += omega[i];
        sums[row.pass].1 += omega[i] * residual[i];
    }
    sums.into_iter().map(|(w, s)| (w, if w > 0.0 { s / w } else { 0.0 })).collect()
}

/// The rows √ω (a − λ ā), (1 − λ)² = 1/(1 + τ² W), and the same of the residuals.
fn whitened(
    rows: &[Row],
    gradient: &DMatrix<f64>,
    residual: &[f64],
    omega: &[f64],
    between2: f64,
) -> (DMatrix<f64>, DVector<f64>) {
    let (n, p) = gradient.shape();
    let n_passes = rows.iter().map(|r| r.pass + 1).max().unwrap_or(0);
    let means = pass_means(rows, omega, residual, n_passes);
    let mut columns: DMatrix<f64> = DMatrix::zeros(n_passes, p);
    for (i, row) in rows.iter().enumerate().filter(|(_, r)| means[r.pass].0 > 0.0) {
        (0..p).for_each(|k| columns[(row.pass, k)] += omega[i] * gradient[(i, k)] / means[row.pass].0);
    }
    let (mut a, mut b) = (DMatrix::zeros(n, p), DVector::zeros(n));
    for (i, row) in rows.iter().enumerate() {
        let lambda = 1.0 - (1.0 - shrunk(means[row.pass].0, between2)).sqrt();
        let sqrt = omega[i].sqrt();
        (0..p).for_each(|k| a[(i, k)] = sqrt * (gradient[(i, k)] - lambda * columns[(row.pass, k)]));
        b[i] = sqrt * (residual[i] - lambda * means[row.pass].1);
    }
    (a, b)
}

/// The step that takes the residuals away, and (AᵀA)⁻¹.
fn solved(
    rows: &[Row],
    gradient: &DMatrix<f64>,
    residual: &[f64],
    omega: &[f64],
    between2: f64,
    names: &[String],
) -> Result<(DVector<f64>, DMatrix<f64>), String> {
    let (mut a, b) = whitened(rows, gradient, residual, omega, between2);
    let p = a.ncols();
    let norms: Vec<f64> = (0..p).map(|k| a.column(k).norm()).collect();
    if let Some(k) = norms.iter().position(|norm| !norm.is_normal()) {
        return Err(format!("the data say nothing of {}; hold it", names[k]));
    }
    (0..p).for_each(|k| a.column_mut(k).scale_mut(1.0 / norms[k]));
    let svd = a.svd(true, true);
    let (Some(u), Some(vt)) = (&svd.u, &svd.v_t) else { return Err("the design has no singular values".into()) };
    let s = &svd.singular_values;
    let (smallest, largest) = (s.imin(), s.max());
    if s[smallest] * MOST_CONDITION < largest {
        let told: Vec<&str> = (0..p).filter(|k| vt[(smallest, *k)].abs() > 0.2).map(|k| names[k].as_str()).collect();
        return Err(format!(
            "the data do not tell {} apart; hold one of them, or add rows in which they differ",
            told.join(", ")
        ));
    }
    let along = DVector::from_iterator(p, u.tr_mul(&b).iter().zip(s.iter()).map(|(c, s)| c / s));
    let mut step = vt.tr_mul(&along);
    let mut inverse = DMatrix::zeros(p, p);
    for x in 0..p {
        for y in 0..p {
            let sum: f64 = (0..p).map(|k| vt[(k, x)] * vt[(k, y)] / (s[k] * s[k])).sum();
            inverse[(x, y)] = sum / (norms[x] * norms[y]);
        }
        step[x] /= norms[x];
    }
    Ok((step, inverse))
}

/// The covariance by the expected information: (ν + 1)/(ν + 3) of each magnitude's, of limits what they tell.
fn covariance(
    rows: &[Row],
    gradient: &DMatrix<f64>,
    told: &[f64],
    (within2, between2): (f64, f64),
    names: &[String],
) -> Result<DMatrix<f64>, String> {
    let of = |(i, r): (usize, &Row)| {
        let share = if r.is_limit { 1.0 } else { (NU + 1.0) / (NU + 3.0) };
        told[i] * share / variance(r, within2)
    };
    let omega: Vec<f64> = rows.iter().enumerate().map(of).collect();
    solved(rows, gradient, &vec![0.0; rows.len()], &omega, between2, names).map(|(_, inverse)| inverse)
}

/// s² with Σ (ν + 1) z²/(ν + z²) = dof, z² = r²/(err² + s²): the scale of a t distribution; 0 where the errors explain the residuals.
fn scale2(rows: &[Row], residual: &[f64], told: &[f64], dof: f64) -> f64 {
    let q = |s2: f64| -> f64 {
        let of = |(i, r): (usize, &Row)| {
            let z2 = residual[i] * residual[i] / variance(r, s2);
            if r.is_limit { told[i] * z2.min(1.0) } else { (NU + 1.0) * z2 / (NU + z2) }
        };
        rows.iter().enumerate().map(of).sum()
    };
    if q(0.0) <= dof {
        return 0.0;
    }
    let most = 4.0 * residual.iter().map(|r| r * r).sum::<f64>() / dof + 1.0;
    let Ok([low, high]) = bisect(0.0, most, Until::Steps(60), |s2| Ok::<bool, std::convert::Infallible>(q(s2) > dof));
    0.5 * (low + high)
}

/// τ² with Σ m²/(τ² + 1/W) = dof, m the mean residual of each pass; 0 where the scatter within passes explains them.
fn between(means: &[(f64, f64)], dof: f64) -> f64 {
    let q = |tau2: f64| -> f64 { means.iter().filter(|(w, _)| *w > 0.0).map(|(w, m)| m * m / (tau2 + 1.0 / w)).sum() };
    if q(0.0) <= dof {
        return 0.0;
    }
    let most = means.iter().map(|(_, m)| m * m).sum::<f64>() / dof + 1.0;
    let Ok([low, high]) =
        bisect(0.0, most, Until::Steps(60), |tau2| Ok::<bool, std::convert::Infallible>(q(tau2) > dof));
    let tau2 = 0.5 * (low + high);
    if tau2 > FLOOR_MAG * FLOOR_MAG { tau2 } else { 0.0 }
}
