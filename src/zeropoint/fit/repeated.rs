//! The reweighted fit where stars are measured repeatedly: an offset per star crossed with an offset per pointing.
//!
//! Magnitudes. The catalogue's error of a star is the same in all its visits: fifteen stars in twenty pointings are fifteen
//! stars, not three hundred. Weights are per measurement (a hit, a cloud in one frame) and per star (a variable, a wrong
//! magnitude); a star without weight still shows how its visits differ among themselves.

use super::crossed::Sums;
use super::marginal::{Marginal, Prior, Problem, Stars};
use super::noise::Noise;
use super::rows::Rows;
use super::solve::Vector;
use super::weights::CONVERGED_MAG;
use super::weights::Fit;
use super::weights::SCALE_ROUNDS;
use super::weights::efficiency;
use super::weights::limit_precision;
use super::weights::weight;
use crate::config::{self, Estimator};

/// Deviations of a star in its scatter at which its weight begins to fall, and at which it is 0 (Hampel).
const STAR_WEIGHT: [f64; 2] = [2.5, 4.7];
/// Weight below which a star is rejected.
const NO_WEIGHT: f64 = 1e-4;

/// Weight of a star that deviates by `u` of its scatter.
fn star_weight(estimator: Estimator, u: f64) -> f64 {
    let [from, to] = STAR_WEIGHT;
    match estimator {
        Estimator::Robust if u.abs() <= from => 1.0,
        Estimator::Robust => (from / u.abs() * (to - u.abs()) / (to - from)).max(0.0),
        other => weight(other, u),
    }
}

/// Mean offsets of the pointings about the terms and their errors from stars alone, typical values \[mag\].
pub fn typical_offsets(sums: &Sums, theta: &Vector, stars: &[f64], g: usize) -> [f64; 2] {
    let mut deviations: Vec<f64> = Vec::new();
    let mut errs: Vec<f64> = Vec::new();
    for p in 0..g {
        let (d, w) = sums.pointing_residual(p, theta, stars);
        if w > 0.0 {
            deviations.push(d * d);
            errs.push(w.sqrt().recip());
        }
    }
    let n = deviations.len().max(1) as f64;
    [(deviations.iter().sum::<f64>() / n).sqrt(), super::median(&mut errs)]
}

/// The iteration from a start and the scatter about it.
pub fn converge(rows: &Rows, estimator: Estimator, theta: Vector, mut noise: Noise, config: &config::Zeropoint) -> Fit {
    let (n, g, m) = (rows.len(), rows.pointings.len(), rows.n_stars);
    let mut fit = Fit::start(theta, n, g);
    let prior = Prior::of(rows, config);
    let ones = vec![1.0; g];
    let mut stars = Stars { stated: vec![0.0; m], weight: vec![1.0; m], ..Stars::default() };
    let mut own = begin(rows, &fit.theta);
    state(rows, &fit.theta, &mut stars, &own);
    let (mut tau, mut kappa) = (config.pointing_scatter_prior_mag, first_kappa(&own, &stars));
    weigh(estimator, &own, &vec![f64::INFINITY; m], &mut stars, kappa);
    let (mut gain, mut fitted) = (1.0, rows.n_free() as f64);
    let mut follow = true;
    for round in 0..rows.max_rounds {
        let residuals: Vec<f64> =
            (0..n).map(|i| rows.residual(i, &fit.theta) - fit.offsets[rows.group[i]] - own[rows.star_of[i]]).collect();
        if follow {
            noise.improve(rows, &fit.theta, &residuals, fitted, if round == 0 { 40 } else { 3 });
        }
        let pull = |i: usize| residuals[i] / noise.sigma[i];
        fit.weights.iter_mut().enumerate().for_each(|(i, w)| *w = weight(estimator, pull(i)));
        if follow {
            (gain, fit.slope) = efficiency(estimator, &fit.weights, pull, fitted);
        }
        for i in 0..n {
            fit.omega[i] = gain * fit.weights[i] / noise.sigma[i].powi(2);
        }
        limit_precision(rows, &mut fit, fitted);
        // pseudo-values: ψ answers a shift by its slope only
        let pseudo = |i: usize| rows.y(i) - residuals[i] * (1.0 - 1.0 / fit.slope);
        let sums = Sums::of(rows, &fit.omega, pseudo);
        state(rows, &fit.theta, &mut stars, &own);
        let problem = |stars, tau_mag: f64, kappa: f64| Problem {
            sums: &sums,
            prior,
            offsets_mag: typical_offsets(&sums, &fit.theta, &own, g),
            stars,
            pointing_weight: &ones,
            kappa,
            tau_mag,
        };
        if follow && (round < 4 || round % 6 == 0) {
            let Marginal { tau_mag, kappa: k, .. } = problem(&stars, tau, kappa).integrate(true);
            let settled = (tau_mag - tau).abs() <= 0.01 * tau && (k / kappa).ln().abs() <= 0.02;
            (tau, kappa) = (tau_mag, k);
            follow = round < SCALE_ROUNDS && !(settled && round > 4);
        }
        let solved = problem(&stars, tau, kappa).at(tau, kappa);
        let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        let moved = change(&solved.theta, &fit.theta)
            .max(change(&solved.pointings, &fit.offsets))
            .max(change(&solved.stars, &own));
        let (deviations, precisions): (Vec<f64>, Vec<f64>) =
            (0..m).map(|q| sums.star_residual(q, &solved.theta, &solved.pointings)).unzip();
        if follow || round < SCALE_ROUNDS {
            weigh(estimator, &deviations, &precisions, &mut stars, kappa);
        }
        let shrink = |variance: f64, w: f64| variance * w / (1.0 + variance * w);
        let of_pointings: f64 = (0..g).map(|p| shrink(tau * tau, sums.weight_of_pointing(p))).sum();
        let of_stars: f64 =
            (0..m).map(|q| shrink(stars.var(kappa, q) / stars.weight[q].max(NO_WEIGHT), precisions[q])).sum();
        fitted = (rows.n_free() as f64 + of_pointings + of_stars).min(n as f64 - 1.0);
        fit.theta = solved.theta;
        fit.offsets = solved.pointings;
        own = solved.stars;
        if !follow && round > SCALE_ROUNDS && moved < CONVERGED_MAG {
            break;
        }
    }
    fit.tau2 = tau * tau;
    fit.kappa = kappa;
    fit.fitted = fitted;
    fit.star_offset = (0..n).map(|i| own[rows.star_of[i]]).collect();
    for (w, q) in fit.weights.iter_mut().zip(&rows.star_of) {
        *w *= if stars.weight[*q] > NO_WEIGHT { stars.weight[*q] } else { 0.0 };
    }
    fit.sigma = noise.sigma;
    fit.intrinsic_mag = noise.intrinsic_mag;
    let rejected = stars.weight.iter().filter(|w| **w <= NO_WEIGHT).count() as f64 / m as f64;
    fit.outlier_share = noise.outlier_share.max(rejected);
    fit.stars = stars;
    fit
}

/// Median residual of each star about the terms: where the offsets begin.
fn begin(rows: &Rows, theta: &Vector) -> Vec<f64> {
    let mut of: Vec<Vec<f64>> = vec![Vec::new(); rows.n_stars];
    (0..rows.len()).for_each(|i| of[rows.star_of[i]].push(rows.residual(i, theta)));
    of.iter_mut().map(|r| super::median(r)).collect()
}

/// Stated variances of the stars at the colour term of `theta`.
fn state(rows: &Rows, theta: &Vector, stars: &mut Stars, own: &[f64]) {
    let mut count = vec![0.0; rows.n_stars];
    stars.stated.iter_mut().for_each(|v| *v = 0.0);
    for i in 0..rows.len() {
        stars.stated[rows.star_of[i]] += rows.star_var(i, theta);
        count[rows.star_of[i]] += 1.0;
    }
    stars.stated.iter_mut().zip(&count).for_each(|(v, n)| *v /= n);
    let total: f64 = stars.stated.iter().sum();
    stars.known = rows.weighted && total > 0.0;
    if !stars.known {
        // nothing is stated: in units of what the stars scatter by
        if stars.mean == 0.0 {
            let scatter = crate::base::stats::mad_sigma(&mut own.to_vec()).unwrap_or(0.0);
            stars.mean = scatter.powi(2).max(1e-12);
        }
        stars.stated.iter_mut().for_each(|v| *v = stars.mean);
    } else {
        stars.mean = total / rows.n_stars as f64;
    }
}

/// κ of the median deviation of the stars.
fn first_kappa(own: &[f64], stars: &Stars) -> f64 {
    let scatter = crate::base::stats::mad_sigma(&mut own.to_vec()).unwrap_or(0.0);
    (scatter * scatter / stars.mean).clamp(0.05, 1e6)
}

fn weigh(estimator: Estimator, deviations: &[f64], precisions: &[f64], stars: &mut Stars, kappa: f64) {
    for q in 0..deviations.len() {
        let variance = stars.var(kappa, q) + 1.0 / precisions[q].max(f64::MIN_POSITIVE);
        stars.weight[q] = star_weight(estimator, deviations[q] / variance.sqrt());
    }
}
