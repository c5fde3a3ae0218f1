//! Gauss-Legendre rules on \[0, 1\] and the two changes of variable that tame the ends of a panel.
//!
//! Dimensionless. Rules are computed once and shared; nothing here knows what is integrated.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// Largest order kept.
pub(super) const ORDER_MAX: usize = 80;

/// Nodes and weights of one rule.
type Rule = (Vec<f64>, Vec<f64>);

/// Nodes and weights of the Gauss-Legendre rule of `order` points (1 to [`ORDER_MAX`], clamped) on \[0, 1\].
pub(super) fn gauss(order: usize) -> (&'static [f64], &'static [f64]) {
    static RULES: OnceLock<Vec<Rule>> = OnceLock::new();
    let rules = RULES.get_or_init(|| (1..=ORDER_MAX).map(legendre).collect());
    let (nodes, weights) = &rules[order.clamp(1, ORDER_MAX) - 1];
    (nodes, weights)
}

/// x = (1 − cos πt)/2 and dx/dt: quadratic at both ends, so that sqrt(x) becomes smooth.
pub(super) fn half_cosine(t: f64) -> (f64, f64) {
    let half = (PI * t / 2.0).sin();
    (half * half, PI / 2.0 * (PI * t).sin())
}

/// x = t⁴(35 − 84t + 70t² − 20t³) and dx/dt: fourth order at both ends, for powers as small as x^0.2.
pub(super) fn end_clustered(t: f64) -> (f64, f64) {
    let t3 = t * t * t;
    let u = 1.0 - t;
    (t3 * t * (35.0 - 84.0 * t + 70.0 * t * t - 20.0 * t3), 140.0 * t3 * u * u * u)
}

/// Newton's method on P_n from the Chebyshev-like first guess.
fn legendre(n: usize) -> Rule {
    let mut rule: Vec<(f64, f64)> = (0..n)
        .map(|k| {
            let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (p, dp) = polynomial(n, x);
                slope = dp;
                let step = p / dp;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            ((1.0 - x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect();
    rule.sort_by(|a, b| a.0.total_cmp(&b.0));
    rule.into_iter().unzip()
}

/// P_n(x) and its derivative.
fn polynomial(n: usize, x: f64) -> (f64, f64) {
    let (mut p0, mut p1) = (1.0, x);
    for k in 2..=n {
        // k P_k = (2k−1) x P_{k−1} − (k−1) P_{k−2}
        (p0, p1) = (p1, ((2 * k - 1) as f64 * x * p1 - (k - 1) as f64 * p0) / k as f64);
    }
    (p1, n as f64 * (x * p1 - p0) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_of_n_points_is_exact_to_degree_2n_minus_1() {
        for order in [1, 2, 5, 8, 27, 80] {
            let (nodes, weights) = gauss(order);
            let degree = 2 * order as i32 - 1;
            let sum: f64 = nodes.iter().zip(weights).map(|(x, w)| w * x.powi(degree)).sum();
            assert!((sum * f64::from(degree + 1) - 1.0).abs() < 1e-12, "{order}");
        }
    }

    #[test]
    fn both_maps_cover_the_panel_and_carry_their_own_derivative() {
        for map in [half_cosine, end_clustered] {
            assert!(map(0.0).0.abs() < 1e-15 && (map(1.0).0 - 1.0).abs() < 1e-15);
            let (step, t) = (1e-6, 0.3);
            let slope = (map(t + step).0 - map(t - step).0) / (2.0 * step);
            assert!((slope - map(t).1).abs() < 1e-8);
        }
    }
}
