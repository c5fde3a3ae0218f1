//! Where the robust fit starts: the plane that a good third of the stars is closest to, which the others cannot spoil.
//!
//! Magnitudes. Deterministic: trial subsets come from a fixed sequence. Few stars hold subsets that agree by chance, so
//! they start from the least sum of absolute residuals instead.

use super::mixed::{Means, triangle};
use super::rows::Rows;
use super::solve::{N, Triangle, Vector};
use crate::base::constants::SIGMA_PER_MAD;

/// Fewer rows than this start from L1.
pub const FEW: usize = 30;
/// Rows that score a trial start.
const TRIAL_ROWS: usize = 1_000;
/// Trial planes through as many stars as terms: with 60 % outliers and three terms all 300 fail with 2e-9.
const TRIALS: usize = 300;
/// The best of them are improved on the share of stars nearest to them.
const IMPROVED: usize = 12;

/// A start and the scatter about it \[mag\].
pub fn robust(rows: &Rows) -> (Vector, f64) {
    if rows.len() < FEW {
        let theta = least_absolute(rows);
        return (theta, typical(rows, &theta));
    }
    closest(rows)
}

/// Median of y, all terms at 0 or held; and the scatter about it.
pub fn median(rows: &Rows) -> (Vector, f64) {
    let mut y: Vec<f64> = (0..rows.len()).map(|i| rows.y(i)).collect();
    let theta = [super::median(&mut y), 0.0, 0.0, 0.0];
    (theta, typical(rows, &theta))
}

/// 1.4826 median |r| \[mag\]. A fit of p terms meets up to p stars exactly: their residuals hold no information.
fn typical(rows: &Rows, theta: &Vector) -> f64 {
    let mut r: Vec<f64> = (0..rows.len()).map(|i| rows.residual(i, theta).abs()).collect();
    r.sort_unstable_by(f64::total_cmp);
    let from = rows.n_free().min(r.len().saturating_sub(1));
    SIGMA_PER_MAD * super::median(&mut r[from..])
}

/// Weights 1/|r|, twenty times.
fn least_absolute(rows: &Rows) -> Vector {
    let mut omega = vec![1.0; rows.len()];
    let mut theta = plane(rows, &omega);
    for _ in 0..20 {
        omega.iter_mut().enumerate().for_each(|(i, w)| *w = 1.0 / rows.residual(i, &theta).abs().max(1e-6));
        theta = plane(rows, &omega);
    }
    theta
}

fn plane(rows: &Rows, omega: &[f64]) -> Vector {
    let means = Means { weight: Vec::new(), columns: Vec::new(), y: Vec::new() };
    triangle(rows, omega, &means, 0.0).solve().theta
}

/// Least quantile of residuals (Rousseeuw 1984, JASA 79, 871), each of the best planes improved on its nearest stars.
/// With it half the σ of a Gaussian that has this share within that distance: narrow, because the scatter is then found from
/// the inside and outliers do not join.
fn closest(rows: &Rows) -> (Vector, f64) {
    let n = rows.len();
    // a third, but enough stars that chance does not rule
    let share = (25.0 / n as f64).clamp(0.35, 0.5);
    let judges: Vec<usize> = (0..n).step_by(n.div_ceil(TRIAL_ROWS)).collect();
    let data: Vec<(Vector, f64)> = judges.iter().map(|i| (rows.columns(*i), rows.y(*i))).collect();
    let at = (share * (data.len() - 1) as f64).round() as usize;
    let mut distance = vec![0.0; data.len()];
    let mut reach = |theta: &Vector| {
        distance.iter_mut().zip(&data).for_each(|(d, (a, y))| *d = (y - super::solve::dot(a, theta)).abs());
        *distance.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let mut state = 0x5EED_u64;
    let mut best: Vec<(f64, Vector)> = Vec::new();
    for _ in 0..TRIALS {
        let mut triangle = Triangle::default();
        for _ in 0..rows.n_fitted() {
            let (a, y) = data[(split_mix(&mut state) % data.len() as u64) as usize];
            triangle.add(a, y);
        }
        rows.add_priors(&mut triangle);
        let theta = triangle.back_substitute();
        if theta.iter().all(|t| t.is_finite()) {
            best.push((reach(&theta), theta));
        }
    }
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    best.truncate(IMPROVED);
    for (score, theta) in &mut best {
        for _ in 0..3 {
            let limit = *score;
            let mut triangle = Triangle::default();
            let near = |(a, y): &&(Vector, f64)| (y - super::solve::dot(a, theta)).abs() <= limit;
            data.iter().filter(near).for_each(|(a, y)| triangle.add(*a, *y));
            rows.add_priors(&mut triangle);
            let next = triangle.solve().theta;
            let reached = reach(&next);
            if reached >= *score {
                break;
            }
            (*score, *theta) = (reached, next);
        }
    }
    let (distance, theta) = best.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, [0.0; N]));
    // Φ⁻¹((1 + share)/2) is 0.45 for 0.35 and 0.67 for 0.5
    (theta, 0.5 * distance / (1.47 * share - 0.06))
}

/// SplitMix64 (Steele, Lea & Flood 2014): a fixed sequence, so that the start is always the same.
fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
