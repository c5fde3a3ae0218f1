//! A smooth function on an interval as a polynomial.
//!
//! Interpolation at the Chebyshev points; the error is that of the first neglected coefficient.

/// Coefficients of a polynomial.
pub(super) const TERMS: usize = 6;

/// `f` between two arguments, as coefficients of powers of −1 ≤ y ≤ 1; `f` is not evaluated below 0.
pub(super) fn fit(f: &impl Fn(f64) -> f64, from: f64, to: f64) -> [f64; TERMS] {
    let n = TERMS as f64;
    let angle = |j: usize| std::f64::consts::PI * (j as f64 + 0.5) / n;
    let values: [f64; TERMS] =
        std::array::from_fn(|j| f((0.5 * (from + to) + 0.5 * (to - from) * angle(j).cos()).max(0.0)));
    let mut powers = [0.0; TERMS];
    // T_k as powers of y, by its recurrence
    let (mut before, mut chebyshev) = ([0.0; TERMS], [0.0; TERMS]);
    chebyshev[0] = 1.0;
    for k in 0..TERMS {
        let sum: f64 = (0..TERMS).map(|j| values[j] * (k as f64 * angle(j)).cos()).sum();
        let c = sum * if k == 0 { 1.0 } else { 2.0 } / n;
        for (power, t) in powers.iter_mut().zip(chebyshev) {
            *power += c * t;
        }
        let factor = if k == 0 { 1.0 } else { 2.0 };
        let mut next = [0.0; TERMS];
        for i in 0..TERMS {
            next[i] = factor * if i > 0 { chebyshev[i - 1] } else { 0.0 } - before[i];
        }
        if k == 0 {
            // T_1 = y, and T_−1 is not to be subtracted
            next = [0.0; TERMS];
            next[1] = 1.0;
        }
        (before, chebyshev) = (chebyshev, next);
    }
    powers
}
