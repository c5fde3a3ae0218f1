//! A function of D on 0 to 2 as polynomials on intervals that widen with D: a square root, a look-up, five products.
//!
//! Relative error below 1e-9, checked when it is built; a function that is not that smooth gets no table.

use crate::brightness::polynomial::{TERMS, fit};

/// Intervals per doubling of D.
const PER_OCTAVE_BITS: u32 = 5;
/// Largest relative error accepted.
const TOLERANCE: f64 = 1e-9;
const MANTISSA_BITS: u32 = 52;

/// Polynomials in D, one per interval.
#[derive(Debug, Clone)]
pub(super) struct Table {
    /// Intervals are equal from 0 to this and double from there on.
    start: f64,
    first: u64,
    coefficients: Vec<[f64; TERMS]>,
}

impl Table {
    /// The table of `f`, whose finest structure is of size `width`; `None` if it is not good to 1e-9.
    pub fn new(f: impl Fn(f64) -> f64, width: f64) -> Option<Self> {
        // a power of two, so that interval ends are exact
        let start = 2.0_f64.powi(width.clamp(1e-7, 0.5).log2().floor() as i32 - 1);
        let index = |x: f64| x.to_bits() >> (MANTISSA_BITS - PER_OCTAVE_BITS);
        let (first, last) = (index(start), index(2.0 + 2.0 * start));
        let end = |i: u64| f64::from_bits(i << (MANTISSA_BITS - PER_OCTAVE_BITS));
        let coefficients = (first..=last).map(|i| fit(&f, end(i) - start, end(i + 1) - start)).collect();
        let table = Self { start, first, coefficients };
        let good = (first..=last).all(|i| {
            let (from, to) = (end(i) - start, end(i + 1) - start);
            [0.03, 0.4, 0.95].into_iter().all(|t| {
                let d = (from + t * (to - from)).min(2.0);
                let exact = f(d);
                (table.value(d) - exact).abs() <= TOLERANCE * exact
            })
        });
        good.then_some(table)
    }

    /// The function at the roots of the first `nodes` squares, 0 ≤ D² ≤ 4.
    #[inline(always)]
    pub fn fill<const N: usize>(&self, x2: &[f64; N], f: &mut [f64; N], nodes: usize) {
        let (mut interval, mut y) = ([0u64; N], [0.0; N]);
        for j in 0..N {
            let bits = (x2[j].sqrt() + self.start).to_bits();
            interval[j] = bits >> (MANTISSA_BITS - PER_OCTAVE_BITS);
            // the place within the interval, −1 to 1, from the remaining bits
            let within = (bits << PER_OCTAVE_BITS) & ((1 << MANTISSA_BITS) - 1);
            y[j] = 2.0 * f64::from_bits(within | 1.0_f64.to_bits()) - 3.0;
        }
        for j in 0..nodes.min(N) {
            let (y, at) = (y[j], interval[j].wrapping_sub(self.first) as usize);
            let Some([c0, c1, c2, c3, c4, c5]) = self.coefficients.get(at) else { continue };
            let y2 = y * y;
            f[j] = (c0 + c1 * y) + y2 * ((c2 + c3 * y) + y2 * (c4 + c5 * y));
        }
    }

    /// The function at 0 ≤ D ≤ 2.
    fn value(&self, d: f64) -> f64 {
        let mut f = [0.0];
        self.fill(&[d * d], &mut f, 1);
        f[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_the_function_everywhere_to_1e_9() {
        let f = |d: f64| (-226.0 * d).exp() + 1.0 / (1.0 + 3.0e4 * d * d);
        let table = Table::new(f, 3e-3).unwrap();
        for step in 0..100_000 {
            let d = 2.0 * (f64::from(step) / 1e5).powi(3);
            assert!((table.value(d) / f(d) - 1.0).abs() < 1e-9, "{d}");
        }
        assert!((table.value(2.0) / f(2.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_function_with_a_step_gets_no_table() {
        assert!(Table::new(|d| if d < 0.3 { 1.0 } else { 0.5 }, 0.1).is_none());
    }
}
