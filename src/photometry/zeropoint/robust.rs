//! The two estimators: ordinary least squares, and Tukey's biweight from a start that half the stars cannot spoil.
//!
//! Magnitudes. Deterministic: the trial subsets of the start come from a fixed sequence. Left out: Huber weights and hard
//! clipping (biased by one-sided outliers such as blends and saturation).

use super::jackknife::Skip;
use super::rows::Rows;
use super::solve::Triangle;
use crate::constants::SIGMA_PER_MAD;
use crate::error::{Error, Result};

/// Tukey's constant: 95 % efficiency for Gaussian errors.
const TUKEY_C: f64 = 4.685;
/// Smallest standard deviation of a row \[mag\]; keeps perfect data from dividing by zero.
const FLOOR_MAG: f64 = 1e-9;
/// Stated errors are believed to be too large by a factor of ten at most.
const SMALLEST_SHARE: f64 = 0.1;
/// With fewer degrees of freedom than this the stated errors bound the covariance from below.
const FEW_DOF: f64 = 10.0;
/// Rows that score a trial start.
const TRIAL_ROWS: usize = 1_000;
/// Rows that set the scale; more do not make it better.
const SCALE_ROWS: usize = 4_000;
/// Trial subsets of four stars: 99.8 % sure of a clean one among half outliers.
const TRIALS: usize = 100;
/// Fewer rows than this hold subsets that agree by chance: then L1 alone starts, and all rows set the scale.
const FEW: usize = 30;
/// A trial replaces the L1 start only if its median residual is this much smaller; chance gives 0.85 for Gaussian errors.
const CLEARLY_BETTER: f64 = 0.7;

/// A converged fit in the centred system.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Offset, k, C.
    pub theta: [f64; 3],
    /// Their covariance.
    pub cov: [[f64; 3]; 3],
    /// Robust weight per row, 0 to 1.
    pub weights: Vec<f64>,
    /// Standard deviation each residual is measured by \[mag\].
    pub sigma: Vec<f64>,
    /// Scatter beyond the stated errors \[mag\].
    pub intrinsic_mag: f64,
}

/// Least squares of the rows with standard deviations and weights, leaving out `skip`.
pub fn weighted(rows: &Rows, sigma: &[f64], weights: &[f64], skip: Skip) -> super::solve::Solution {
    let mut triangle = Triangle::default();
    for i in (0..rows.len()).filter(|i| weights[*i] > 0.0 && !skip.covers(rows.star(*i))) {
        let scale = weights[i].sqrt() / sigma[i];
        triangle.add(rows.columns(i).map(|a| a * scale), rows.y(i) * scale);
    }
    rows.add_priors(&mut triangle);
    triangle.solve()
}

/// Ordinary least squares: equal weights, covariance s² (AᵀA)⁻¹.
///
/// With a pulled term the scatter s enters the balance and is iterated. Without degrees of freedom s comes from the stated
/// errors.
pub fn ols(rows: &Rows) -> Result<Fit> {
    let n = rows.len();
    let ones = vec![1.0; n];
    let mut y: Vec<f64> = (0..n).map(|i| rows.y(i)).collect();
    let mut s = crate::photometry::stats::mad_sigma(&mut y).unwrap_or(0.0).max(FLOOR_MAG);
    let mut theta = [0.0; 3];
    for _ in 0..if rows.has_prior() { 100 } else { 1 } {
        let solution = weighted(rows, &vec![s; n], &ones, Skip::None);
        theta = solution.theta;
        let next = scatter(rows, &theta)?.max(FLOOR_MAG);
        let done = (next - s).abs() < 1e-12 * s;
        s = next;
        if done {
            break;
        }
    }
    let cov = weighted(rows, &vec![s; n], &ones, Skip::None).inverse;
    Ok(Fit { theta, cov, weights: ones, sigma: vec![s; n], intrinsic_mag: 0.0 })
}

/// Standard deviation of a row about the fit; from the stated errors where no degree of freedom is left.
fn scatter(rows: &Rows, theta: &[f64; 3]) -> Result<f64> {
    let n = rows.len();
    let dof = n.saturating_sub(rows.n_free());
    if dof > 0 {
        return Ok(((0..n).map(|i| rows.residual(i, theta).powi(2)).sum::<f64>() / dof as f64).sqrt());
    }
    let stated = (0..n).map(|i| rows.stated_var(i, theta)).sum::<f64>() / n as f64;
    if stated > 0.0 {
        return Ok(stated.sqrt());
    }
    Err(Error::Zeropoint {
        problem: format!(
            "{n} stars for {} free terms and no stated errors: nothing tells how good the fit is; take more stars or pin k and C",
            rows.n_free()
        ),
    })
}

/// Tukey's biweight to convergence.
pub fn tukey(rows: &Rows) -> Result<Fit> {
    let n = rows.len();
    if n == rows.n_free() {
        return exact(rows);
    }
    let mut theta = start(rows);
    let mut scale = Scale { sigma: vec![1.0; n], intrinsic_mag: 0.0, mad: f64::INFINITY };
    // the scale follows the fit for the first rounds, then stands still so that the fit converges
    for round in 0..300 {
        if round < 20 {
            scale = Scale::of(rows, &theta, scale.mad);
        }
        let next = step(rows, &scale.sigma, &theta, Skip::None);
        let moved = (0..3).map(|j| (next[j] - theta[j]).abs()).fold(0.0, f64::max);
        theta = next;
        if moved < 1e-13 && round >= 20 {
            break;
        }
    }
    let mut stated: Vec<f64> = (0..n).map(|i| rows.stated_var(i, &theta).sqrt()).collect();
    check_majority(rows, &scale, super::median(&mut stated))?;
    let weights = biweights(rows, &scale.sigma, &theta);
    let cov = m_covariance(rows, &scale.sigma, &weights, &theta);
    Ok(Fit { theta, cov, weights, sigma: scale.sigma, intrinsic_mag: scale.intrinsic_mag })
}

/// One step of iteratively reweighted least squares.
pub fn step(rows: &Rows, sigma: &[f64], theta: &[f64; 3], skip: Skip) -> [f64; 3] {
    let weights = biweights(rows, sigma, theta);
    let solution = weighted(rows, sigma, &weights, skip);
    if solution.rank == 0 { *theta } else { solution.theta }
}

/// w = (1 − (u/c)²)², u = r/σ; 0 beyond c.
fn biweights(rows: &Rows, sigma: &[f64], theta: &[f64; 3]) -> Vec<f64> {
    let weight = |i: usize| {
        let t = (rows.residual(i, theta) / (TUKEY_C * sigma[i])).powi(2);
        if t < 1.0 { (1.0 - t).powi(2) } else { 0.0 }
    };
    (0..rows.len()).map(weight).collect()
}

/// As many stars as terms: they are met exactly and the stated errors are all that is known.
fn exact(rows: &Rows) -> Result<Fit> {
    let ones = vec![1.0; rows.len()];
    let free = weighted(rows, &ones, &ones, Skip::None).theta;
    let spread = scatter(rows, &free)?;
    let sigma: Vec<f64> = (0..rows.len())
        .map(|i| if rows.weighted { rows.stated_var(i, &free).sqrt().max(FLOOR_MAG) } else { spread })
        .collect();
    let solution = weighted(rows, &sigma, &ones, Skip::None);
    Ok(Fit { theta: solution.theta, cov: solution.inverse, weights: ones, sigma, intrinsic_mag: 0.0 })
}

/// What residuals are measured by.
struct Scale {
    sigma: Vec<f64>,
    intrinsic_mag: f64,
    /// Robust scale of the raw residuals \[mag\].
    mad: f64,
}

impl Scale {
    /// σ_i² = s² (stated_i² + τ²): τ where the residuals exceed the stated errors, s < 1 where they stay below them.
    ///
    /// Judged by the MAD of the rows the last round did not reject, so that outliers do not widen their own limit.
    fn of(rows: &Rows, theta: &[f64; 3], last: f64) -> Scale {
        let n = rows.len();
        let last = if n < FEW { f64::INFINITY } else { last };
        let judges: Vec<usize> = (0..n).step_by(n.div_ceil(SCALE_ROWS)).collect();
        let residuals: Vec<f64> = judges.iter().map(|i| rows.residual(*i, theta)).collect();
        let stated_var = |i: usize| if rows.weighted { rows.stated_var(i, theta) } else { 0.0 };
        let stated: Vec<f64> = judges.iter().map(|i| stated_var(*i)).collect();
        // a fit of p terms meets up to p stars exactly: their residuals say nothing
        let met = rows.n_free();
        let typical = |mut u: Vec<f64>| {
            u.sort_unstable_by(f64::total_cmp);
            let from = met.min(u.len().saturating_sub(1));
            SIGMA_PER_MAD * super::median(&mut u[from..])
        };
        let inside = |i: usize, tau: f64| {
            residuals[i].abs() <= TUKEY_C * (stated[i] + tau * tau).sqrt().max(last.max(FLOOR_MAG))
        };
        let spread = |tau: f64| {
            let scaled = |i: usize| residuals[i].abs() / (stated[i] + tau * tau).sqrt().max(FLOOR_MAG);
            typical((0..judges.len()).filter(|i| inside(*i, tau)).map(scaled).collect())
        };
        let mad = typical((0..judges.len()).filter(|i| inside(*i, 0.0)).map(|i| residuals[i].abs()).collect());
        let (mut tau, mut s) = (0.0, 1.0);
        let at_zero = spread(0.0);
        if at_zero > 1.0 {
            let (mut lo, mut hi) = (0.0, 2.0 * mad.max(FLOOR_MAG));
            for _ in 0..40 {
                tau = 0.5 * (lo + hi);
                if spread(tau) > 1.0 { lo = tau } else { hi = tau }
            }
        } else {
            s = at_zero.max(SMALLEST_SHARE);
        }
        let sigma = (0..n).map(|i| (s * (stated_var(i) + tau * tau).sqrt()).max(FLOOR_MAG)).collect();
        Scale { sigma, intrinsic_mag: if tau > FLOOR_MAG { tau } else { 0.0 }, mad }
    }
}

/// Covariance of the M-estimator (Huber 1981, eq. 7.6.8):
/// K² · [Σψ² / (n − p)] / [mean ψ′]² · (AᵀA)⁻¹ with ψ(u) = u (1 − (u/c)²)², K = 1 + (p/n) var ψ′ / (mean ψ′)².
fn m_covariance(rows: &Rows, sigma: &[f64], weights: &[f64], theta: &[f64; 3]) -> [[f64; 3]; 3] {
    let n = rows.len() as f64;
    let p = rows.n_free() as f64;
    let (mut psi2, mut slope, mut slope2) = (0.0, 0.0, 0.0);
    for (i, w) in weights.iter().enumerate() {
        let u = rows.residual(i, theta) / sigma[i];
        let t = (u / TUKEY_C).powi(2);
        psi2 += (w * u).powi(2);
        let d = if t < 1.0 { (1.0 - t) * (1.0 - 5.0 * t) } else { 0.0 };
        slope += d / n;
        slope2 += d * d / n;
    }
    let slope_safe = slope.max(0.1);
    let k = 1.0 + p / n * (slope2 - slope * slope).max(0.0) / (slope_safe * slope_safe);
    let factor = k * k * psi2 / (n - p).max(1.0) / (slope_safe * slope_safe);
    // sigma is scaled, not the result, so that the rows of pulled terms keep their own weight in the balance
    let wide: Vec<f64> = sigma
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let found = s * factor.sqrt().max(1e-6);
            if rows.weighted && n - p < FEW_DOF { found.max(rows.stated_var(i, theta).sqrt()) } else { found }
        })
        .collect();
    weighted(rows, &wide, &vec![1.0; rows.len()], Skip::None).inverse
}

/// A start that up to half the stars cannot spoil: the L1 fit, or the plane that half the stars are closest to where that
/// is clearly closer.
fn start(rows: &Rows) -> [f64; 3] {
    let n = rows.len();
    let ones = vec![1.0; n];
    // L1: weights 1/|r|
    let mut theta = weighted(rows, &ones, &ones, Skip::None).theta;
    for _ in 0..20 {
        let w: Vec<f64> = (0..n).map(|i| 1.0 / rows.residual(i, &theta).abs().max(1e-6)).collect();
        theta = weighted(rows, &ones, &w, Skip::None).theta;
    }
    if n < FEW {
        return theta;
    }
    let (score, trial) = closest(rows, &ones, 0.5, TRIALS);
    if score < CLEARLY_BETTER * quantile_distance(rows, &ones, &theta, 0.5) { trial } else { theta }
}

/// Fails where a third of the stars agree ten times better than the fit's scale says: then fewer than half are good, and
/// the scale is that of the bad ones.
fn check_majority(rows: &Rows, scale: &Scale, stated_mag: f64) -> Result<()> {
    let n = rows.len();
    if n < FEW || scale.mad < 1e-6 || (rows.weighted && scale.intrinsic_mag < 3.0 * stated_mag) {
        return Ok(());
    }
    let (score, _) = closest(rows, &scale.sigma, 0.33, 4 * TRIALS);
    // 33 % of a Gaussian lie within 0.43 σ
    if score > 0.1 * 0.43 {
        return Ok(());
    }
    Err(Error::Zeropoint {
        problem: format!(
            "a third of {n} stars agree within {:.3} mag, the others scatter by {:.3} mag: no majority agrees, more than \
             zeropoint.max_rejected_frac would be rejected; check the match, clouds and saturation",
            score * scale.mad,
            scale.mad
        ),
    })
}

/// Distance |r|/σ within which a share of the stars lies.
fn quantile_distance(rows: &Rows, sigma: &[f64], theta: &[f64; 3], share: f64) -> f64 {
    let n = rows.len();
    let judges = (0..n).step_by(n.div_ceil(TRIAL_ROWS));
    let mut u: Vec<f64> = judges.map(|i| rows.residual(i, theta).abs() / sigma[i]).collect();
    let at = (share * (u.len() - 1) as f64).round() as usize;
    *u.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Of many planes through four stars, each improved on the share of stars nearest to it, the one nearest to its share;
/// with that distance (Rousseeuw 1984, least quantile of residuals).
fn closest(rows: &Rows, sigma: &[f64], share: f64, trials: usize) -> (f64, [f64; 3]) {
    let n = rows.len();
    let mut best = (f64::INFINITY, [0.0; 3]);
    let mut state = 0x5EED_u64;
    for _ in 0..trials {
        let mut weights = vec![0.0; n];
        for _ in 0..4 {
            weights[(split_mix(&mut state) % n as u64) as usize] = 1.0;
        }
        let mut trial = weighted(rows, sigma, &weights, Skip::None).theta;
        for _ in 0..2 {
            let limit = quantile_distance(rows, sigma, &trial, share);
            weights.fill(0.0);
            for i in (0..n).step_by(n.div_ceil(TRIAL_ROWS)) {
                weights[i] = f64::from(u8::from(rows.residual(i, &trial).abs() <= limit * sigma[i]));
            }
            trial = weighted(rows, sigma, &weights, Skip::None).theta;
        }
        let score = quantile_distance(rows, sigma, &trial, share);
        if score < best.0 {
            best = (score, trial);
        }
    }
    best
}

/// SplitMix64 (Steele, Lea & Flood 2014): a fixed sequence, so that the start is always the same.
fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
