//! The binomial law of Greynolds: a polynomial and logarithms in D and V, exponentiated.
//!
//! D and V dimensionless, f in 1/sr. Fits to laboratory data reach coefficients of ±1000 that cancel: everything is
//! summed as a logarithm first.

use std::f64::consts::LN_10;

/// Largest lg f returned: wild coefficients stay finite, and such a law fails every energy test.
const LG_MAX: f64 = 300.0;

/// Coefficients of the Greynolds binomial law.
///
/// `D = |o_t + i_t|`, `V = −o_t·i_t` with the tangential parts of o and i. With one row f depends on D alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Binomial {
    /// B_ki: a row for each power k of V.
    pub b: Vec<Vec<f64>>,
    /// C_ki.
    pub c: Vec<Vec<f64>>,
    /// d.
    pub d: f64,
    /// First power of d.
    pub l1: i32,
}

impl Binomial {
    /// f at D and V \[1/sr\], at most 1e300.
    #[must_use]
    pub fn value(&self, d: f64, v: f64) -> f64 {
        let mut lg_f = 0.0;
        let mut v_power = 1.0;
        for k in 0..self.rows() {
            lg_f += v_power * self.row(k, d);
            v_power *= v;
        }
        power_of_ten(lg_f)
    }

    /// Number of rows, the highest power of V plus 1.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.b.len().max(self.c.len())
    }

    /// The factor of Vᵏ in lg f: `Σ_i B_ki Dⁱ + ½ Σ_i C_ki lg(1 + d^(i+l1) D²)`.
    #[must_use]
    pub fn row(&self, k: usize, d: f64) -> f64 {
        let polynomial = self.b.get(k).map_or(0.0, |b| b.iter().rev().fold(0.0, |sum, b| sum * d + b));
        let mut scaled = self.d.powi(self.l1) * d * d;
        let mut logarithms = 0.0;
        for c in self.c.get(k).into_iter().flatten() {
            logarithms += c * (1.0 + scaled).ln();
            scaled *= self.d;
        }
        polynomial + 0.5 * logarithms / LN_10
    }

    /// The smallest D over which f changes by a factor that matters, at most 1.
    pub(super) fn finest(&self) -> f64 {
        let mut finest = 1.0_f64;
        for row in &self.b {
            for (i, b) in row.iter().enumerate().skip(1) {
                // |B| Dⁱ ln 10 = 1
                finest = finest.min((b.abs() * LN_10).powf(-1.0 / i as f64));
            }
        }
        for row in &self.c {
            for i in 0..row.len() {
                // d^(i+l1) D² = 1
                finest = finest.min(self.d.powf(-0.5 * (i as f64 + f64::from(self.l1))));
            }
        }
        finest.max(1e-15)
    }
}

/// 10^lg, at most 10^[`LG_MAX`].
pub(super) fn power_of_ten(lg: f64) -> f64 {
    (lg.min(LG_MAX) * LN_10).exp()
}
