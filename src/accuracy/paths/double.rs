//! Extended precision for a few sums: two f64 that together hold 106 bits.
//!
//! Dekker 1971, Numer. Math. 18, 224. Sums and products only.

/// A sum of two f64: the rounding of every addition is kept.
#[derive(Clone, Copy, Default)]
pub(super) struct Double(pub f64, pub f64);

impl Double {
    /// Adds a number, keeping what the sum rounds off.
    pub fn add(self, b: f64) -> Self {
        let s = self.0 + b;
        let t = s - self.0;
        let rounding = (self.0 - (s - t)) + (b - t);
        let low = self.1 + rounding;
        let high = s + low;
        Double(high, low - (high - s))
    }

    /// The product exactly, by a fused multiplication.
    pub fn add_product(self, a: f64, b: f64) -> Self {
        let p = a * b;
        self.add(p).add(a.mul_add(b, -p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_numbers_hold_what_one_forgets() {
        let mut sum = Double::default().add(1e16).add(1.0).add(-1e16);
        assert_eq!(sum.0 + sum.1, 1.0);
        sum = Double::default().add_product(1.0 + f64::EPSILON, 1.0 + f64::EPSILON).add(-1.0);
        assert_eq!(sum.0 + sum.1, 2.0 * f64::EPSILON + f64::EPSILON * f64::EPSILON);
    }
}
