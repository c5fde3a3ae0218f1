//! A curve over wavelength: straight between its points, zero beyond them.
//!
//! Wavelengths in nm; the unit of the values is the caller's. Integrals are exact for such curves' products only as far
//! as the trapezoid on the union of all their points is.

use std::path::Path;

use super::table;
use crate::base::error::Result;

/// Values at rising wavelengths, straight lines between them, zero outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    nm: Vec<f64>,
    value: Vec<f64>,
}

impl Curve {
    /// From a file of two columns: wavelength \[nm\] and value; see the errors.
    ///
    /// # Errors
    /// [`crate::Error::Io`] when it cannot be read; [`crate::Error::Table`] with its line for a row that is not two
    /// finite numbers or a wavelength that does not rise.
    pub fn from_file(path: &Path) -> Result<Self> {
        Ok(Self::from_rows(&table::read(path, 2)?, 1))
    }

    /// From rows that were checked when they were read.
    pub(crate) fn from_rows(rows: &[Vec<f64>], column: usize) -> Self {
        Self { nm: rows.iter().map(|r| r[0]).collect(), value: rows.iter().map(|r| r[column]).collect() }
    }

    /// The wavelengths \[nm\].
    #[must_use]
    pub fn nm(&self) -> &[f64] {
        &self.nm
    }

    /// The values at [`Curve::nm`].
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.value
    }

    /// First and last wavelength \[nm\].
    #[must_use]
    pub fn range_nm(&self) -> (f64, f64) {
        (self.nm[0], self.nm[self.nm.len() - 1])
    }

    /// The value at a wavelength \[nm\]; 0 outside.
    #[must_use]
    pub fn at(&self, nm: f64) -> f64 {
        let above = self.nm.partition_point(|x| *x < nm);
        if above == self.nm.len() || (above == 0 && nm < self.nm[0]) {
            return 0.0;
        }
        if self.nm[above] == nm {
            return self.value[above];
        }
        let (x0, x1) = (self.nm[above - 1], self.nm[above]);
        let share = (nm - x0) / (x1 - x0);
        self.value[above - 1] * (1.0 - share) + self.value[above] * share
    }

    /// This curve times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { nm: self.nm.clone(), value: self.value.iter().map(|v| v * factor).collect() }
    }

    /// The product with another, on the points of both inside the range of both; `None` when they do not overlap.
    #[must_use]
    pub fn times(&self, other: &Self) -> Option<Self> {
        let nm = union_nm(&[self, other]);
        let value = nm.iter().map(|x| self.at(*x) * other.at(*x)).collect();
        (nm.len() > 1).then_some(Self { nm, value })
    }

    /// ∫ c dλ from `from_nm` to `to_nm`, by the trapezoid on the curve's points: exact for it.
    #[must_use]
    pub fn integral(&self, from_nm: f64, to_nm: f64) -> f64 {
        let inside = self.nm.iter().copied().filter(|x| from_nm < *x && *x < to_nm);
        let (first, last) = self.range_nm();
        let ends = [from_nm.max(first), to_nm.min(last)];
        if ends[1] <= ends[0] {
            return 0.0;
        }
        trapezoid(&std::iter::once(ends[0]).chain(inside).chain([ends[1]]).collect::<Vec<_>>(), |x| self.at(x))
    }
}

/// The points of all curves that lie in the range of all, rising, none twice.
pub(crate) fn union_nm(curves: &[&Curve]) -> Vec<f64> {
    let from = curves.iter().map(|c| c.range_nm().0).fold(0.0, f64::max);
    let to = curves.iter().map(|c| c.range_nm().1).fold(f64::INFINITY, f64::min);
    let mut nm: Vec<f64> = curves.iter().flat_map(|c| c.nm()).copied().filter(|x| (from..=to).contains(x)).collect();
    nm.sort_by(f64::total_cmp);
    nm.dedup();
    nm
}

/// ∫ f dλ by the trapezoid on these points.
pub(crate) fn trapezoid(nm: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    nm.windows(2).map(|w| (w[1] - w[0]) * 0.5 * (f(w[0]) + f(w[1]))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Curve {
        Curve::from_rows(&points.iter().map(|(x, y)| vec![*x, *y]).collect::<Vec<_>>(), 1)
    }

    #[test]
    fn a_curve_is_straight_between_its_points_and_zero_beyond() {
        let c = curve(&[(400.0, 0.0), (500.0, 2.0), (700.0, 1.0)]);
        for (x, y) in [(399.0, 0.0), (400.0, 0.0), (450.0, 1.0), (500.0, 2.0), (600.0, 1.5), (700.0, 1.0), (700.1, 0.0)]
        {
            assert_eq!(c.at(x), y, "{x}");
        }
    }

    #[test]
    fn integrals_add_up_wherever_the_range_is_cut() {
        let c = curve(&[(400.0, 0.0), (500.0, 2.0), (700.0, 1.0)]);
        assert_eq!(c.integral(0.0, 1e4), 400.0);
        for cut in [410.0, 500.0, 633.3] {
            assert!((c.integral(0.0, cut) + c.integral(cut, 1e4) - 400.0).abs() < 1e-10);
        }
        assert_eq!(c.integral(800.0, 900.0), 0.0);
    }

    #[test]
    fn a_product_lives_where_both_do() {
        let a = curve(&[(400.0, 2.0), (600.0, 2.0)]);
        let b = curve(&[(500.0, 0.0), (550.0, 1.0), (700.0, 1.0)]);
        let p = a.times(&b).unwrap();
        assert_eq!(p.nm(), [500.0, 550.0, 600.0]);
        assert_eq!(p.values(), [0.0, 2.0, 2.0]);
        assert!(a.times(&curve(&[(700.0, 1.0), (800.0, 1.0)])).is_none());
    }
}
