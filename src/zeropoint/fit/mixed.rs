//! Least squares with an offset per pointing: stars of one pointing share a cloud, the pointings share a scatter.
//!
//! Magnitudes. y_ij = a_ij·θ + u_j + e_ij, u_j of variance τ_p², e_ij of variance 1/ω_ij. Solved by partly demeaned rows
//! (Fuller & Battese 1974, J. Econometrics 2, 67), so that no matrix of the pointings is kept. τ_p² from the scatter of the
//! pointing means (Paule & Mandel 1982, J. Res. NBS 87, 377). It does not cover clouds that move within a pointing.

use super::noise::FLOOR_MAG;
use super::rows::Rows;
use super::solve::{Matrix, N, Triangle, Vector, dot, quadratic};
use crate::base::search::{Until, bisect};
use std::convert::Infallible;

/// Weighted means of each pointing; zero weight where all its stars are rejected.
#[derive(Debug, Clone)]
pub struct Means {
    /// W_j = Σ ω \[1/mag²\].
    pub weight: Vec<f64>,
    /// Mean columns.
    pub columns: Vec<Vector>,
    /// Mean y \[mag\].
    pub y: Vec<f64>,
}

impl Means {
    /// The means of rows with precisions `omega` \[1/mag²\].
    pub fn of(rows: &Rows, omega: &[f64]) -> Means {
        let g = rows.pointings.len();
        let mut out = Means { weight: vec![0.0; g], columns: vec![[0.0; N]; g], y: vec![0.0; g] };
        for (i, w) in omega.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let j = rows.group[i];
            let a = rows.columns(i);
            out.weight[j] += w;
            out.y[j] += w * rows.y(i);
            (0..N).for_each(|c| out.columns[j][c] += w * a[c]);
        }
        for j in (0..g).filter(|j| out.weight[*j] > 0.0) {
            out.y[j] /= out.weight[j];
            out.columns[j].iter_mut().for_each(|c| *c /= out.weight[j]);
        }
        out
    }

    /// The same means with all weights multiplied.
    pub fn scaled(&self, factor: f64) -> Means {
        Means { weight: self.weight.iter().map(|w| w * factor).collect(), ..self.clone() }
    }

    /// Mean residual of pointing `j` \[mag\].
    pub fn residual(&self, j: usize, theta: &Vector) -> f64 {
        self.y[j] - dot(&self.columns[j], theta)
    }

    /// The pointings that have weight.
    pub fn with_weight(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.weight.len()).filter(|j| self.weight[*j] > 0.0)
    }

    /// Share of its mean residual that is attributed to the pointing: b = τ_p² W / (1 + τ_p² W).
    pub fn shrink(&self, j: usize, tau2: f64) -> f64 {
        let t = tau2 * self.weight[j];
        t / (1.0 + t)
    }

    /// Offsets of the pointings, û_j = b_j (ȳ_j − ā_j·θ) \[mag\].
    pub fn offsets(&self, theta: &Vector, tau2: f64) -> Vec<f64> {
        (0..self.weight.len()).map(|j| self.shrink(j, tau2) * self.residual(j, theta)).collect()
    }
}

/// The triangle of the rows √ω (a − λ_j ā_j), (1 − λ_j)² = 1/(1 + τ_p² W_j), of one pointing or of all with the priors.
pub fn triangle(rows: &Rows, omega: &[f64], means: &Means, tau2: f64) -> Triangle {
    let mut out = Triangle::default();
    for i in (0..rows.len()).filter(|i| omega[*i] > 0.0) {
        let (a, y) = whitened(rows, i, omega[i], means, tau2);
        out.add(a, y);
    }
    rows.add_priors(&mut out);
    out
}

/// Row `i` as it enters the triangle.
pub fn whitened(rows: &Rows, i: usize, omega: f64, means: &Means, tau2: f64) -> (Vector, f64) {
    let j = rows.group[i];
    let sqrt = omega.sqrt();
    let a = rows.columns(i);
    if tau2 == 0.0 {
        return (a.map(|v| v * sqrt), rows.y(i) * sqrt);
    }
    let lambda = 1.0 - (1.0 - means.shrink(j, tau2)).sqrt();
    let b = &means.columns[j];
    (std::array::from_fn(|c| sqrt * (a[c] - lambda * b[c])), sqrt * (rows.y(i) - lambda * means.y[j]))
}

/// Degrees of freedom of the scatter between pointings: g − tr(Cov Σ ā ā′/(τ_p² + v_j)).
pub fn dof(means: &Means, cov: &Matrix, tau2: f64) -> f64 {
    let used = |j: usize| quadratic(cov, &means.columns[j]) / (tau2 + 1.0 / means.weight[j]);
    means.with_weight().count() as f64 - means.with_weight().map(used).sum::<f64>()
}

/// τ_p² with Σ d_j²/(τ_p² + 1/W_j) = dof, d_j the deviation of each pointing \[mag\]; 0 where the stars' own errors explain them.
pub fn scatter_between(means: &Means, deviations: &[f64], dof: f64) -> f64 {
    if dof < 0.5 {
        return 0.0;
    }
    let d: Vec<(f64, f64)> = means.with_weight().map(|j| (deviations[j].powi(2), 1.0 / means.weight[j])).collect();
    let q = |tau2: f64| d.iter().map(|(d2, v)| d2 / (tau2 + v)).sum::<f64>();
    if q(0.0) <= dof {
        return 0.0;
    }
    let most = d.iter().map(|(d2, _)| d2).sum::<f64>() / dof;
    let Ok([lo, hi]) = bisect(0.0, most, Until::Steps(50), |tau2| Ok::<bool, Infallible>(q(tau2) > dof));
    let tau2 = 0.5 * (lo + hi);
    if tau2 > FLOOR_MAG * FLOOR_MAG { tau2 } else { 0.0 }
}
