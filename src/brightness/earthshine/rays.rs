//! Along a ray: tanh-sinh rules of rising level, and where a function changes its sign.
//!
//! Dimensionless. Nothing here knows what is integrated.

use std::f64::consts::{FRAC_PI_2, PI};

/// Coarsest and finest level: steps of 2^−level in u.
const LEVELS: (usize, usize) = (2, 6);
/// |u| up to which the nodes differ from the ends.
const REACH: f64 = 3.15;
/// Places at which a ray is looked at for changes of sign.
const LOOKS: usize = 48;

/// Nodes and weights on \[0, 1\] of the rule `x = tanh(π/2 sinh u)`, by level: those that the levels before do not have.
pub(super) struct DoubleExponential {
    levels: Vec<Vec<Node>>,
}

/// Distance from the nearer end, and weight for a step of 1 in u; which end.
struct Node {
    from_end: f64,
    weight: f64,
    at_start: bool,
}

impl DoubleExponential {
    pub fn new() -> Self {
        let levels = (LEVELS.0..=LEVELS.1).map(|level| {
            let step = 0.5_f64.powi(level as i32);
            let count = (REACH / step).floor() as i64;
            let new = |j: &i64| level == LEVELS.0 || j % 2 != 0;
            (-count..=count).filter(new).map(|j| Node::new(step * j as f64)).collect()
        });
        Self { levels: levels.collect() }
    }

    /// ∫ f over a range, level by level until two agree to `tolerance` of the integral or of `scale`; its error and nodes.
    pub fn integrate(
        &self,
        f: impl Fn(f64) -> f64,
        (from, to): (f64, f64),
        tolerance: f64,
        scale: f64,
    ) -> (f64, f64, usize) {
        let length = to - from;
        let (mut sum, mut nodes) = (0.0, 0);
        let (mut before, mut value, mut err) = (0.0, 0.0, f64::INFINITY);
        for (number, level) in self.levels.iter().enumerate() {
            for node in level {
                let off = length * node.from_end;
                let at = if node.at_start { from + off } else { to - off };
                sum += node.weight * f(at);
            }
            nodes += level.len();
            value = length * sum * 0.5_f64.powi((LEVELS.0 + number) as i32);
            if number > 0 {
                // a level has at least half as many digits again as the one before
                let apart = (value - before).abs();
                err = apart * (10.0 * apart / value.abs().max(1e-300)).sqrt().min(1.0) + 4e-16 * value.abs();
                if err <= tolerance * value.abs().max(scale) {
                    break;
                }
            }
            before = value;
        }
        (value, err, nodes)
    }
}

impl Node {
    fn new(u: f64) -> Self {
        // (1 − tanh v)/2 = 1/(1 + e^{2v}), v = π/2 sinh |u|
        let v = FRAC_PI_2 * u.abs().sinh();
        let from_end = 1.0 / (1.0 + (2.0 * v).exp());
        let weight = 0.5 * FRAC_PI_2 * u.cosh() / v.cosh().powi(2);
        Self { from_end, weight, at_start: u < 0.0 }
    }
}

/// Adds the places between two ends at which a function changes its sign, from values at places that crowd at the ends; a dip
/// between two of them is searched.
pub(super) fn sign_changes(f: impl Fn(f64) -> f64, (low, high): (f64, f64), found: &mut Vec<f64>) {
    let at = |j: usize| low + (high - low) * 0.5 * (1.0 - (PI * j as f64 / LOOKS as f64).cos());
    let values: Vec<f64> = (0..=LOOKS).map(|j| f(at(j))).collect();
    let mut root = |mut a: f64, mut b: f64, rises: bool| {
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            if (f(middle) > 0.0) == rises { b = middle } else { a = middle }
        }
        found.push(b);
    };
    for j in 0..LOOKS {
        let (here, next) = (values[j] > 0.0, values[j + 1] > 0.0);
        if here != next {
            root(at(j), at(j + 1), next);
            continue;
        }
        let dips = j > 0
            && (values[j - 1] > 0.0) == here
            && values[j].abs() <= values[j - 1].abs()
            && values[j].abs() <= values[j + 1].abs();
        if !dips {
            continue;
        }
        let (mut a, mut b) = (at(j - 1), at(j + 1));
        for _ in 0..48 {
            let (one, two) = (a + 0.45 * (b - a), a + 0.55 * (b - a));
            let toward = if here { f(one) < f(two) } else { f(one) > f(two) };
            if toward { b = two } else { a = one }
        }
        let lowest = 0.5 * (a + b);
        if (f(lowest) > 0.0) != here {
            root(at(j - 1), lowest, !here);
            root(lowest, at(j + 1), here);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_and_powers_at_the_ends_are_integrated_to_ten_digits() {
        let rule = DoubleExponential::new();
        let cases: [(fn(f64) -> f64, f64); 4] = [
            (|x| x.sqrt(), 2.0 / 3.0),
            (|x| (1.0 - x).max(0.0).powf(0.05), 1.0 / 1.05),
            (|x| x.exp(), 1f64.exp() - 1.0),
            (|x| 1.0 / (1e-4 + x * x), 100.0 * 100f64.atan()),
        ];
        for (f, expected) in cases {
            let (value, err, _) = rule.integrate(f, (0.0, 1.0), 1e-12, 0.0);
            assert!((value - expected).abs() < (1e-10 * expected).max(err), "{value} {expected} {err}");
        }
    }

    #[test]
    fn changes_of_sign_are_found_also_where_two_are_close_together() {
        let find = |f: fn(f64) -> f64| {
            let mut found = Vec::new();
            sign_changes(f, (0.0, 1.0), &mut found);
            found.sort_by(f64::total_cmp);
            found
        };
        let one = find(|x| x - 1e-7);
        assert!(one.len() == 1 && (one[0] - 1e-7).abs() < 1e-15, "{one:?}");
        let two = find(|x| (x - 0.4).powi(2) - 1e-8);
        assert!(two.len() == 2 && (two[0] - 0.3999).abs() < 1e-9 && (two[1] - 0.4001).abs() < 1e-9, "{two:?}");
        assert!(find(|x| (x - 0.4).powi(2) + 1e-8).is_empty());
    }
}
