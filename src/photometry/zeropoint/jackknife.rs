//! The fit again without each pointing: the errors that stars of one pointing share, and pointings that decide alone.
//!
//! Stars of one pointing share clouds and flat-field errors; a star-wise covariance then quotes a third of the true error.

use super::StarMeasurement;
use super::robust::{Fit, step, weighted};
use super::rows::{Rows, Term};
use crate::config::Estimator;

/// Fewest pointings for a covariance.
pub const FEWEST: usize = 5;

/// Which stars a fit leaves out.
#[derive(Debug, Clone, Copy)]
pub enum Skip {
    /// None of them.
    None,
    /// Those of one pointing.
    Pointing(usize),
}

impl Skip {
    /// Whether a star is left out.
    pub fn covers(self, star: &StarMeasurement) -> bool {
        matches!(self, Skip::Pointing(p) if star.pointing == p)
    }
}

/// What the fits without one pointing say.
#[derive(Debug, Clone, Default)]
pub struct Jackknife {
    /// Covariance of the centred parameters, from at least [`FEWEST`] pointings.
    pub cov: Option<[[f64; 3]; 3]>,
    /// Number of pointings.
    pub n: usize,
    /// Pointings without which k would be another one.
    pub warnings: Vec<String>,
}

/// Leaves out each pointing in turn. Cov = (g−1)/g Σ (θ₍ⱼ₎ − θ̄)(θ₍ⱼ₎ − θ̄)ᵀ.
pub fn by_pointing(rows: &Rows, fit: &Fit, estimator: Estimator) -> Jackknife {
    let mut labels: Vec<usize> =
        (0..rows.len()).filter(|i| fit.weights[*i] > 0.0).map(|i| rows.star(i).pointing).collect();
    labels.sort_unstable();
    labels.dedup();
    let g = labels.len();
    let mut out = Jackknife { n: g, ..Jackknife::default() };
    if g < 2 {
        return out;
    }
    let mut thetas = Vec::with_capacity(g);
    let mut complete = true;
    for p in labels {
        let skip = Skip::Pointing(p);
        let once = weighted(rows, &fit.sigma, &fit.weights, skip);
        if once.rank < 1 + rows.terms.iter().filter(|t| t.held().is_none()).count() {
            out.warnings.push(format!("pointing {p} alone decides a term: without it k or C cannot be told"));
            complete = false;
            continue;
        }
        let mut theta = fit.theta;
        for _ in 0..if estimator == Estimator::Ols { 0 } else { 30 } {
            let next = step(rows, &fit.sigma, &theta, skip);
            let moved = (0..3).map(|j| (next[j] - theta[j]).abs()).fold(0.0, f64::max);
            theta = next;
            if moved < 1e-7 {
                break;
            }
        }
        if estimator == Estimator::Ols {
            theta = once.theta;
        }
        out.warnings.extend(leverage(rows, fit, &theta, p));
        thetas.push(theta);
    }
    if g >= FEWEST && complete {
        out.cov = Some(spread(&thetas));
    }
    out
}

/// A warning if leaving out one pointing moves k by more than three of its errors, or turns its sign.
fn leverage(rows: &Rows, fit: &Fit, without: &[f64; 3], pointing: usize) -> Option<String> {
    if !matches!(rows.terms[0], Term::Free) {
        return None;
    }
    let (k, err, other) = (fit.theta[1], fit.cov[1][1].max(0.0).sqrt(), without[1]);
    let turned = k * other < 0.0 && (k - other).abs() > 0.01;
    let moved = (k - other).abs() > (3.0 * err).max(0.01);
    (turned || moved).then(|| format!("k rests on pointing {pointing}: {k:.3} with it, {other:.3} without it"))
}

fn spread(thetas: &[[f64; 3]]) -> [[f64; 3]; 3] {
    let g = thetas.len() as f64;
    let mean = [0, 1, 2].map(|j| thetas.iter().map(|t| t[j]).sum::<f64>() / g);
    let mut cov = [[0.0; 3]; 3];
    for t in thetas {
        for (i, row) in cov.iter_mut().enumerate() {
            for (j, c) in row.iter_mut().enumerate() {
                *c += (g - 1.0) / g * (t[i] - mean[i]) * (t[j] - mean[j]);
            }
        }
    }
    cov
}

/// Whether covariance `a` is larger than `b`: the mean ratio of the variances of the fitted terms exceeds 1.
pub fn larger(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> bool {
    let ratios: Vec<f64> = (0..3).filter(|i| b[*i][*i] > 0.0).map(|i| a[i][i] / b[i][i]).collect();
    !ratios.is_empty() && ratios.iter().sum::<f64>() / ratios.len() as f64 > 1.0
}
