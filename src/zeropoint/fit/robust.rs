//! The estimators: Tukey's biweight, a 3 σ clip or Huber's weights about an offset per pointing, and ordinary least squares.
//!
//! Magnitudes. Iteratively reweighted: the scatter of stars and pointings follows the fit for the first rounds, then stands
//! still so that the fit converges.

use super::crossed::Sums;
use super::marginal::{Prior, Problem, Stars};
use super::mixed::{Means, dof, scatter_between, triangle};
use super::noise::{FLOOR_MAG, Noise};
use super::repeated;
use super::rows::Rows;
use super::rows::has_pointings;
use super::solve::{N, Solution, Vector};
use super::start;
use super::weights::CONVERGED_MAG;
use super::weights::Fit;
use super::weights::SCALE_ROUNDS;
use super::weights::efficiency;
use super::weights::limit_precision;
use super::weights::weight;
use crate::base::error::{Error, Result};
use crate::config::{self, Estimator};

/// Relative change below which the scatter has settled.
const SETTLED: f64 = 1e-3;
/// Intrinsic scatter in units of the stated errors above which the fit is tried again from them.
const SUSPICIOUS: f64 = 2.0;

/// Least squares of all rows with one precision, no scatter between pointings.
pub fn plain(rows: &Rows, omega: &[f64]) -> Solution {
    triangle(rows, omega, &Means::of(rows, omega), 0.0).solve()
}

/// Ordinary least squares: equal weights, scatter s.
///
/// With a pulled term the scatter s enters the balance and is iterated. Without degrees of freedom s comes from the stated
/// errors.
pub fn ols(rows: &Rows) -> Result<Fit> {
    let n = rows.len();
    let mut y: Vec<f64> = (0..n).map(|i| rows.y(i)).collect();
    let mut s = crate::base::stats::mad_sigma(&mut y).unwrap_or(0.0).max(FLOOR_MAG);
    let mut theta = [0.0; N];
    for _ in 0..if rows.has_prior() { 100 } else { 1 } {
        theta = plain(rows, &vec![1.0 / (s * s); n]).theta;
        let next = scatter(rows, &theta)?.max(FLOOR_MAG);
        let done = (next - s).abs() < 1e-12 * s;
        s = next;
        if done {
            break;
        }
    }
    let fitted = rows.n_free() as f64;
    let start = Fit::start(theta, n, rows.pointings.len());
    Ok(Fit { sigma: vec![s; n], omega: vec![1.0 / (s * s); n], fitted, ..start })
}

/// Standard deviation of a row about the fit; from the stated errors where no degree of freedom is left.
fn scatter(rows: &Rows, theta: &Vector) -> Result<f64> {
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
            "{n} stars for {} free terms and no stated errors: the quality of the fit is unknown; take more stars or pin k and C",
            rows.n_free()
        ),
    })
}

/// As many stars as terms: they are met exactly and the stated errors are all that is known.
fn exact(rows: &Rows) -> Result<Fit> {
    let n = rows.len();
    let free = plain(rows, &vec![1.0; n]).theta;
    let spread = scatter(rows, &free)?;
    let sigma: Vec<f64> =
        (0..n).map(|i| if rows.weighted { rows.stated_var(i, &free).sqrt().max(FLOOR_MAG) } else { spread }).collect();
    let omega: Vec<f64> = sigma.iter().map(|s| 1.0 / (s * s)).collect();
    let theta = plain(rows, &omega).theta;
    let fitted = rows.n_free() as f64;
    Ok(Fit { sigma, omega, fitted, ..Fit::start(theta, n, rows.pointings.len()) })
}

/// Tukey's biweight, the clip or Huber's weights to convergence.
///
/// A scatter far beyond the stated errors may be that of outliers in the majority. Then the fit is tried again from the
/// stated errors alone, and the more likely of the two descriptions is taken.
pub fn reweighted(rows: &Rows, estimator: Estimator, config: &config::Zeropoint) -> Result<Fit> {
    if rows.len() == rows.n_free() {
        return exact(rows);
    }
    let (theta, spread) = if estimator == Estimator::Clip { start::median(rows) } else { start::robust(rows) };
    let of = |theta, noise| {
        let one = if rows.repeated { repeated::converge } else { converge };
        one(rows, estimator, theta, noise, config)
    };
    let fit = of(theta, Noise::guess(rows, &theta, spread));
    let mut stated: Vec<f64> = (0..rows.len()).map(|i| rows.stated_var(i, &fit.theta).sqrt()).collect();
    let stated = super::median(&mut stated);
    if rows.len() < start::FEW || !rows.weighted || fit.intrinsic_mag < SUSPICIOUS * stated {
        return Ok(fit);
    }
    let theta = start::robust(rows).0;
    let narrow = of(theta, Noise::stated(rows, &theta));
    let mut residuals: Vec<f64> = (0..rows.len()).map(|i| rows.residual(i, &fit.theta)).collect();
    residuals.sort_unstable_by(f64::total_cmp);
    let range = residuals[rows.len() * 99 / 100] - residuals[rows.len() / 100];
    Ok(if narrow.log_likelihood(rows, range) > fit.log_likelihood(rows, range) { narrow } else { fit })
}

/// The iteration from a start and the scatter about it.
fn converge(rows: &Rows, estimator: Estimator, theta: Vector, mut noise: Noise, config: &config::Zeropoint) -> Fit {
    let n = rows.len();
    let g = rows.pointings.len();
    let prior = Prior::of(rows, config);
    let ones = vec![1.0; g];
    let mut fit = Fit::start(theta, n, g);
    let between = has_pointings(rows);
    let (mut gain, mut fitted) = (1.0, rows.n_free() as f64);
    let (mut follow, mut before) = (true, [0.0; 4]);
    for round in 0..rows.max_rounds {
        let residuals: Vec<f64> = (0..n).map(|i| rows.residual(i, &fit.theta) - fit.offsets[rows.group[i]]).collect();
        if follow {
            noise.improve(rows, &fit.theta, &residuals, fitted, if round == 0 { 40 } else { 3 });
        }
        let pull = |i: usize| residuals[i] / noise.sigma[i];
        for (i, w) in fit.weights.iter_mut().enumerate() {
            *w = weight(estimator, pull(i));
        }
        if follow {
            (gain, fit.slope) = efficiency(estimator, &fit.weights, pull, fitted);
        }
        for i in 0..n {
            fit.omega[i] = gain * fit.weights[i] / noise.sigma[i].powi(2);
        }
        limit_precision(rows, &mut fit, fitted);
        // ψ answers a shift by its slope only: with 1/slope more weight the offsets are shrunk by what they are worth
        let omega: Vec<f64> = fit.omega.iter().map(|w| w / fit.slope).collect();
        let means = Means::of(rows, &omega);
        let solution = triangle(rows, &omega, &means, fit.tau2).solve();
        if solution.rank == 0 {
            break;
        }
        let offsets = means.offsets(&solution.theta, fit.tau2);
        let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        let moved = change(&solution.theta, &fit.theta).max(change(&offsets, &fit.offsets));
        let own: f64 = means.with_weight().map(|j| means.shrink(j, fit.tau2)).sum();
        fitted = rows.n_free() as f64 + own * (1.0 - 2.0 / rows.pointings.len().max(2) as f64);
        fit.theta = solution.theta;
        fit.offsets = offsets;
        if !follow && moved < CONVERGED_MAG {
            break;
        }
        if let (true, Prior::Site(_)) = (follow && between, prior) {
            // few pointings: their scatter with what is known of the site's
            let pseudo = |i: usize| rows.y(i) - residuals[i] * (1.0 - 1.0 / fit.slope);
            let sums = Sums::of(rows, &fit.omega, pseudo);
            let problem = Problem {
                sums: &sums,
                prior,
                offsets_mag: repeated::typical_offsets(&sums, &fit.theta, &[], g),
                stars: &Stars::default(),
                pointing_weight: &ones,
                kappa: 1.0,
                tau_mag: fit.tau2.sqrt(),
            };
            fit.tau2 = problem.integrate(true).tau_mag.powi(2);
        } else if follow && between {
            let dof = dof(&means, &solution.inverse, fit.tau2);
            fit.tau2 = scatter_between(&means.scaled(fit.slope), &fit.deviations(&means), dof);
        }
        let now = [noise.sigma[0], noise.sigma[n - 1], gain, fit.tau2];
        let settled = now.iter().zip(before).all(|(a, b)| (a - b).abs() <= SETTLED * a);
        follow = follow && round < SCALE_ROUNDS && !settled;
        before = now;
    }
    fit.sigma = noise.sigma;
    fit.fitted = fitted;
    fit.intrinsic_mag = noise.intrinsic_mag;
    fit.outlier_share = noise.outlier_share;
    fit
}
