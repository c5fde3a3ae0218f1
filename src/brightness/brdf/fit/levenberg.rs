//! Levenberg-Marquardt with bounds by projection: least squares of residuals that are any smooth function.
//!
//! Dimensionless. Derivatives are central differences; a parameter pressed against its bound rests until it is not.

use nalgebra::{DMatrix, DVector};

/// Step of the differences, relative to max(1, |u|).
const STEP: f64 = 1e-5;
/// Singular values below this share of the largest count as 0: the differences are no better.
pub(super) const RANK_TOLERANCE: f64 = 1e-9;
const ITERATIONS: usize = 400;

/// Where it ended.
pub(super) struct Minimum {
    pub u: Vec<f64>,
    /// Sum of squared residuals.
    pub squares: f64,
    /// Whether the last step was too small to matter, rather than the iterations used up.
    pub converged: bool,
}

/// A least-squares problem in `low` to `high`.
pub(super) struct Problem<'a> {
    pub residuals: &'a dyn Fn(&[f64]) -> DVector<f64>,
    pub low: &'a [f64],
    pub high: &'a [f64],
}

impl Problem<'_> {
    /// The columns ∂r/∂u_k; one-sided at a bound.
    pub(super) fn jacobian(&self, u: &[f64], columns: &[usize], rows: usize) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(rows, columns.len());
        let mut moved = u.to_vec();
        for (j, k) in columns.iter().enumerate() {
            let step = STEP * u[*k].abs().max(1.0);
            let (below, above) = ((u[*k] - step).max(self.low[*k]), (u[*k] + step).min(self.high[*k]));
            moved[*k] = above;
            let upper = (self.residuals)(&moved);
            moved[*k] = below;
            let lower = (self.residuals)(&moved);
            moved[*k] = u[*k];
            if above > below {
                jacobian.set_column(j, &((upper - lower) / (above - below)));
            }
        }
        jacobian
    }

    /// Goes downhill from `start`.
    pub(super) fn minimum(&self, start: &[f64]) -> Minimum {
        let clamp = |u: &[f64]| -> Vec<f64> {
            u.iter().zip(self.low).zip(self.high).map(|((u, low), high)| u.clamp(*low, *high)).collect()
        };
        let all: Vec<usize> = (0..start.len()).collect();
        let mut u = clamp(start);
        let mut r = (self.residuals)(&u);
        let mut squares = r.norm_squared();
        let mut lambda = 1e-3;
        for _ in 0..ITERATIONS {
            let full = self.jacobian(&u, &all, r.len());
            let gradient = full.tr_mul(&r);
            let free: Vec<usize> = all
                .iter()
                .copied()
                .filter(|k| {
                    !(u[*k] <= self.low[*k] && gradient[*k] > 0.0 || u[*k] >= self.high[*k] && gradient[*k] < 0.0)
                })
                .collect();
            if free.is_empty() {
                return Minimum { u, squares, converged: true };
            }
            let Some(solver) = Damped::new(&full.select_columns(&free), &r) else { break };
            let mut improved = None;
            while lambda < 1e14 {
                let step = solver.step(lambda);
                let mut trial = u.clone();
                for (k, s) in free.iter().zip(step.iter()) {
                    trial[*k] += s;
                }
                let trial = clamp(&trial);
                let trial_r = (self.residuals)(&trial);
                let trial_squares = trial_r.norm_squared();
                if trial_squares <= squares {
                    improved = Some((trial, trial_r, trial_squares));
                    break;
                }
                lambda *= 8.0;
            }
            let Some((trial, trial_r, trial_squares)) = improved else {
                return Minimum { u, squares, converged: true };
            };
            let largest = u.iter().zip(&trial).map(|(a, b)| (a - b).abs() / a.abs().max(1e-3)).fold(0.0, f64::max);
            let gained = squares - trial_squares;
            (u, r, squares) = (trial, trial_r, trial_squares);
            lambda = (lambda * 0.1).max(1e-12);
            if largest < 1e-9 || gained <= 1e-13 * squares || squares < 1e-26 * r.len() as f64 {
                return Minimum { u, squares, converged: true };
            }
        }
        Minimum { u, squares, converged: false }
    }
}

/// The damped normal equations through the singular values of the column-scaled Jacobian.
struct Damped {
    scale: Vec<f64>,
    right: DMatrix<f64>,
    singular: DVector<f64>,
    /// −Uᵀr.
    target: DVector<f64>,
}

impl Damped {
    fn new(jacobian: &DMatrix<f64>, r: &DVector<f64>) -> Option<Self> {
        if jacobian.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let scale = column_norms(jacobian);
        let qr = scaled(jacobian, &scale).qr();
        let rotated = qr.q().tr_mul(r);
        let svd = qr.r().svd(true, true);
        let (left, right) = (svd.u?, svd.v_t?);
        Some(Self { scale, right, singular: svd.singular_values, target: -left.tr_mul(&rotated) })
    }

    fn step(&self, lambda: f64) -> DVector<f64> {
        let floor = (RANK_TOLERANCE * self.singular.max()).powi(2);
        let damped = DVector::from_fn(self.singular.len(), |k, _| {
            let s = self.singular[k];
            self.target[k] * s / (s * s + lambda.max(floor))
        });
        let step = self.right.tr_mul(&damped);
        DVector::from_fn(step.len(), |k, _| step[k] / self.scale[k])
    }
}

/// Lengths of the columns; 1 for a column of zeros.
pub(super) fn column_norms(m: &DMatrix<f64>) -> Vec<f64> {
    m.column_iter().map(|c| Some(c.norm()).filter(|n| *n > 0.0 && n.is_finite()).unwrap_or(1.0)).collect()
}

/// The matrix with every column divided by its scale.
pub(super) fn scaled(m: &DMatrix<f64>, scale: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] / scale[j])
}
