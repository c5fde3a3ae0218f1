//! Quantiles and probabilities of magnitudes.

use statrs::function::erf::erfc;

/// What is fainter counts as dark: moonlight and the red rim of the shadow would be most of a mean.
pub const LIT_TO_V_MAG: f64 = 15.0;
/// Share of what is lit that the margin leaves out.
pub const BRIGHTEST_FRAC: f64 = 0.05;

/// Probability that a normal variable of mean 0 and this σ is below a value: `½ erfc(−x/(σ√2))`.
pub fn below(value: f64, sigma: f64) -> f64 {
    if sigma > 0.0 { 0.5 * erfc(-value / (sigma * std::f64::consts::SQRT_2)) } else { f64::from(u8::from(value > 0.0)) }
}

/// The value of sorted magnitudes than which a share is brighter.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    sorted.get(((share * sorted.len() as f64).ceil() as usize).max(1) - 1).copied()
}
