//! Weighted least squares with three columns: Givens rotations to a triangle, then its singular values.
//!
//! One row at a time, no matrix kept: a million rows need no memory. Works on whitened rows; a column of zeros is a term
//! that is not fitted and gets the value 0 and no variance.

use nalgebra::{Matrix3, Vector3};

/// Singular values below this share of the largest are taken as zero.
const RANK_TOLERANCE: f64 = 1e-10;

/// The triangle R and Qᵀy of the rows so far.
#[derive(Debug, Clone, Default)]
pub struct Triangle {
    r: [[f64; 3]; 3],
    qty: [f64; 3],
}

/// The solution of a least-squares problem.
#[derive(Debug, Clone, Copy)]
pub struct Solution {
    /// Parameters.
    pub theta: [f64; 3],
    /// (AᵀA)⁻¹.
    pub inverse: [[f64; 3]; 3],
    /// Ratio of the extreme singular values of A with columns of equal length.
    pub condition: f64,
    /// Terms that can be told apart.
    pub rank: usize,
}

impl Triangle {
    /// Adds the row a·θ = y, already divided by its standard deviation.
    pub fn add(&mut self, mut a: [f64; 3], mut y: f64) {
        for i in 0..3 {
            if a[i] == 0.0 {
                continue;
            }
            // rotate row i of R and the new row so that a[i] becomes 0
            let h = self.r[i][i].hypot(a[i]);
            let (c, s) = (self.r[i][i] / h, a[i] / h);
            for (r, n) in self.r[i][i..].iter_mut().zip(&mut a[i..]) {
                (*r, *n) = (c * *r + s * *n, c * *n - s * *r);
            }
            let (q, n) = (self.qty[i], y);
            self.qty[i] = c * q + s * n;
            y = c * n - s * q;
        }
    }

    /// θ = V S⁻¹ Uᵀ y with columns scaled to equal length; directions without information get nothing.
    pub fn solve(&self) -> Solution {
        let length = [0, 1, 2].map(|j| (0..3).map(|i| self.r[i][j].powi(2)).sum::<f64>().sqrt());
        let scale = length.map(|l| if l > 0.0 && l.is_finite() { 1.0 / l } else { 0.0 });
        let r = Matrix3::from_fn(|i, j| self.r[i][j] * scale[j]);
        let mut out = Solution { theta: [0.0; 3], inverse: [[0.0; 3]; 3], condition: f64::INFINITY, rank: 0 };
        let columns = scale.iter().filter(|s| **s > 0.0).count();
        if columns == 0 || r.iter().any(|v| !v.is_finite()) {
            return out;
        }
        let Some(svd) = nalgebra::SVD::try_new(r, true, true, f64::EPSILON, 1_000) else { return out };
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return out };
        let largest = svd.singular_values.max();
        let qty = Vector3::from(self.qty);
        let mut smallest = largest;
        for n in 0..3 {
            let s = svd.singular_values[n];
            if s <= RANK_TOLERANCE * largest {
                continue;
            }
            out.rank += 1;
            smallest = smallest.min(s);
            let along = u.column(n).dot(&qty) / s;
            for i in 0..3 {
                out.theta[i] += scale[i] * v_t[(n, i)] * along;
                for j in 0..3 {
                    out.inverse[i][j] += scale[i] * v_t[(n, i)] * v_t[(n, j)] * scale[j] / (s * s);
                }
            }
        }
        if out.rank == columns {
            out.condition = largest / smallest;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_exact_points_is_found_and_an_empty_column_stays_zero() {
        let mut t = Triangle::default();
        for x in [0.0, 1.0, 2.0, 5.0] {
            t.add([1.0, x, 0.0], 3.0 - 2.0 * x);
        }
        let s = t.solve();
        assert!((s.theta[0] - 3.0).abs() < 1e-13 && (s.theta[1] + 2.0).abs() < 1e-13);
        assert_eq!((s.theta[2], s.inverse[2][2], s.rank), (0.0, 0.0, 2));
        // (AᵀA)⁻¹ of [[4, 8], [8, 30]] = [[30, −8], [−8, 4]] / 56
        assert!((s.inverse[0][0] - 30.0 / 56.0).abs() < 1e-13 && (s.inverse[0][1] + 8.0 / 56.0).abs() < 1e-13);
    }

    #[test]
    fn proportional_columns_lower_the_rank_instead_of_giving_numbers() {
        let mut t = Triangle::default();
        for x in [0.1, 0.7, 1.3, 2.9] {
            t.add([1.0, x, 3.0 * x], x);
        }
        let s = t.solve();
        assert_eq!(s.rank, 2);
        assert!(s.condition.is_infinite());
    }
}
