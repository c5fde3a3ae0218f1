//! Robust statistics of slices: median, MAD, sigma clip, and the location of a sky of Poisson counts.
//!
//! Units are those of the values. Values that are not finite are excluded everywhere. No weights, no images.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::base::constants::SIGMA_PER_MAD;

/// Moves the finite values to the front and returns how many there are.
fn finite_first(values: &mut [f64]) -> usize {
    let mut n = 0;
    for i in 0..values.len() {
        if values[i].is_finite() {
            values.swap(i, n);
            n += 1;
        }
    }
    n
}

/// Median; the mean of the two middle values for an even number. `None` if no value is finite. Reorders the slice.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let n = finite_first(values);
    median_of_finite(&mut values[..n])
}

fn median_of_finite(values: &mut [f64]) -> Option<f64> {
    let n = values.len();
    if n == 0 {
        return None;
    }
    let (below, &mut upper, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        return Some(upper);
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some(0.5 * (lower + upper))
}

/// The value below which the share `q` (0 to 1) of the values lies, linear between order statistics.
/// `None` if no value is finite. Reorders the slice.
pub fn quantile(values: &mut [f64], q: f64) -> Option<f64> {
    let n = finite_first(values);
    if n == 0 || !q.is_finite() {
        return None;
    }
    let position = q.clamp(0.0, 1.0) * (n - 1) as f64;
    let (k, rest) = (position.floor() as usize, position.fract());
    let (_, &mut low, above) = values[..n].select_nth_unstable_by(k, f64::total_cmp);
    let high = above.iter().copied().fold(f64::INFINITY, f64::min);
    Some(if rest > 0.0 && high.is_finite() { low + rest * (high - low) } else { low })
}

/// Standard deviation from the median absolute deviation, σ = 1.4826 · median|x − median|.
/// `None` if no value is finite. Reorders the slice and leaves the values as they are.
pub fn mad_sigma(values: &mut [f64]) -> Option<f64> {
    let n = finite_first(values);
    let centre = median_of_finite(&mut values[..n])?;
    sigma_about(&values[..n], centre)
}

/// [`mad_sigma`] of finite values whose median is known.
fn sigma_about(values: &[f64], centre: f64) -> Option<f64> {
    let mut deviations: Vec<f64> = values.iter().map(|v| (v - centre).abs()).collect();
    median_of_finite(&mut deviations).map(|mad| SIGMA_PER_MAD * mad)
}

/// What a sigma clip leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipped {
    /// Mean of the kept values.
    pub mean: f64,
    /// Median of the kept values.
    pub median: f64,
    /// Standard deviation of the unclipped Gaussian: that of the kept values, corrected for the cut tails.
    pub sigma: f64,
    /// Values kept.
    pub n: usize,
    /// Finite values rejected.
    pub n_rejected: usize,
}

/// Keeps what lies within `k` σ of the median, until nothing changes (at most 50 times).
///
/// Starts from the MAD (from the standard deviation where more than half the values are equal). The standard
/// deviation s of what a cut at ±k leaves is too small by √(1 − 2kφ(k)/(2Φ(k)−1)) for Gaussian noise; `sigma` is
/// corrected for that, so it is unbiased whatever `k` is. The kept values are the first `n` of the slice afterwards.
/// `None` if no value is finite or `k` is not positive.
pub fn sigma_clip(values: &mut [f64], k: f64) -> Option<Clipped> {
    let total = finite_first(values);
    if total == 0 || k.is_nan() || k <= 0.0 {
        return None;
    }
    let shrink = truncation_shrink(k);
    let mut centre = median_of_finite(&mut values[..total])?;
    let mut sigma = sigma_about(&values[..total], centre)?;
    if sigma <= 0.0 {
        sigma = mean_and_sd(&values[..total]).1;
    }
    let mut n = total;
    for _ in 0..50 {
        let limit = k * sigma;
        let mut kept = 0;
        for i in 0..total {
            if (values[i] - centre).abs() <= limit {
                values.swap(i, kept);
                kept += 1;
            }
        }
        if kept == 0 {
            break;
        }
        let unchanged = kept == n;
        n = kept;
        centre = median_of_finite(&mut values[..n])?;
        sigma = mean_and_sd(&values[..n]).1 / shrink;
        if unchanged {
            break;
        }
    }
    let (mean, _) = mean_and_sd(&values[..n]);
    Some(Clipped { mean, median: centre, sigma, n, n_rejected: total - n })
}

/// Standard deviation of a unit Gaussian cut at ±k: √(1 − 2kφ(k)/(2Φ(k)−1)).
pub(crate) fn truncation_shrink(k: f64) -> f64 {
    let inside = gauss_within(k);
    if inside <= 0.0 {
        return 1.0;
    }
    (1.0 - 2.0 * k * gauss_density(k) / inside).max(1e-6).sqrt()
}

/// Mean and standard deviation (n − 1) of finite values; (NaN, 0) of none.
pub fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, if values.len() > 1 { (square / (n - 1.0)).sqrt() } else { 0.0 })
}

/// Density of the unit Gaussian.
#[must_use]
pub fn gauss_density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / (2.0 * PI).sqrt()
}

/// Share of a Gaussian within ±k σ.
#[must_use]
pub fn gauss_within(k: f64) -> f64 {
    statrs::function::erf::erf(k / std::f64::consts::SQRT_2)
}

/// The significance that `peaks` maxima of noise exceed on average: of a smooth Gaussian field that was filtered by a Gaussian of
/// the variance σ², λ T e^(−T²/2) A/(2π)^{3/2} maxima exceed T in an area A, λ = 1/2σ² being the curvature of its correlation
/// (Adler 1981, The Geometry of Random Fields, section 6.9). `area` is A \[σ²\]. It is never below what a single place exceeds with
/// the chance `peaks`.
#[must_use]
pub fn peak_significance(area: f64, peaks: f64) -> f64 {
    let per_t = 0.5 * area * std::f64::consts::TAU.powf(-1.5);
    let mut t = 5.0f64;
    // an error of t falls by t² each time
    for _ in 0..8 {
        t = (2.0 * (per_t * t / peaks).ln()).max(0.0).sqrt();
    }
    t.max(std::f64::consts::SQRT_2 * statrs::function::erf::erfc_inv(2.0 * peaks))
}

/// n · Var(median of n unit Gaussians): by how much a median is less certain than a mean.
///
/// n ≤ 20: the order-statistics integrals, computed to 1e-7 by quadrature (odd n one-fold, even n two-fold).
/// Above, (π/2) · n/(n + c), with c = 0.4292 + 0.262/n for odd n and 1.4292 − 0.83/n for even n, within 1e-4.
#[must_use]
pub fn median_variance_factor(n: usize) -> f64 {
    if let Some(&factor) = MEDIAN_FACTOR.get(n) {
        return factor;
    }
    let m = n as f64;
    FRAC_PI_2 * m / (m + if n % 2 == 1 { 0.4292 + 0.262 / m } else { 1.4292 - 0.83 / m })
}

/// [`median_variance_factor`] of 0 (no meaning) to 20.
const MEDIAN_FACTOR: [f64; 21] = [
    1.0,
    1.0,
    1.0,
    1.346_013_3,
    1.192_798_5,
    1.434_168_3,
    1.288_456_0,
    1.473_128_0,
    1.345_446_8,
    1.494_911_5,
    1.383_264_4,
    1.508_786_8,
    1.410_194_3,
    1.518_386_9,
    1.430_349_7,
    1.525_419_8,
    1.446_003_4,
    1.530_791_9,
    1.458_513_2,
    1.535_028_5,
    1.468_740_6,
];

/// Half-width of the smoothing of [`smoothed_median`] \[σ\].
pub(crate) const SMOOTHING_SIGMA: f64 = 0.5;

/// The median of values on a lattice: μ with Σ clamp((x − μ)/h, −1, 1) = 0, h = σ/2.
///
/// A plain median of digitised counts is always one of the levels, wrong by up to half a step however many pixels
/// there are. This one is the median of the values, each spread evenly over ±h (Huber's location with a small corner):
/// as robust, smooth in the counts, right for steps up to σ, and a little less noisy
/// ([`smoothed_median_variance_factor`]). `start` is any value near the median. `None` if there are no values.
#[must_use]
pub fn smoothed_median(values: &[f64], start: f64, sigma: f64) -> Option<f64> {
    if values.is_empty() || !start.is_finite() {
        return None;
    }
    let h = SMOOTHING_SIGMA * sigma;
    if h.is_nan() || h <= 0.0 {
        return Some(start);
    }
    let mut mu = start;
    for _ in 0..30 {
        let (mut sum, mut inside) = (0.0, 0usize);
        for v in values {
            let d = (v - mu) / h;
            sum += d.clamp(-1.0, 1.0);
            inside += usize::from(d.abs() < 1.0);
        }
        // Newton's step; never more than h, never divided by an empty middle
        let step = (h * sum / (inside.max(values.len() / 8).max(1)) as f64).clamp(-h, h);
        mu += step;
        if step.abs() < 1e-9 * sigma {
            break;
        }
    }
    Some(mu)
}

/// n · Var([`smoothed_median`])/σ² of Gaussian noise: (β − 2cφ(c) + 2c²(1−Φ(c)))/β², β = 2Φ(c) − 1 (Huber 1964).
#[must_use]
pub fn smoothed_median_variance_factor() -> f64 {
    let c = SMOOTHING_SIGMA;
    let beta = gauss_within(c);
    (beta - 2.0 * c * gauss_density(c) + c * c * (1.0 - beta)) / (beta * beta)
}

/// By how much [`smoothed_median`] after a clip at ±`clip` σ lies below the mean, in units of σ · skewness.
///
/// With the Edgeworth density φ(x)(1 + γ/6 · He₃(x)) the location m solves E\[ψ(x − m)\] = 0 on the kept range:
/// m = −(γ/6) · 2c(φ(c) + (k²−1)φ(k)) / (β − 2cφ(k)); for c → 0 and k → ∞ this is the −γ/6 of a plain median.
#[must_use]
pub fn smoothed_median_skew_shift(clip: f64) -> f64 {
    let (c, k) = (SMOOTHING_SIGMA, clip);
    let tail = gauss_density(k);
    2.0 * c * (gauss_density(c) + (k * k - 1.0) * tail) / (gauss_within(c) - 2.0 * c * tail) / 6.0
}

/// Median and robust scatter, `(med x, 1.4826 · med |x − med x|)`, of the finite values; `None` without any.
///
/// The scatter equals σ for a Gaussian and is 0 for a single value.
#[must_use]
pub fn robust(values: &[f64]) -> Option<(f64, f64)> {
    let mut kept: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let centre = median(&mut kept)?;
    let mut deviations: Vec<f64> = kept.iter().map(|v| (v - centre).abs()).collect();
    Some((centre, SIGMA_PER_MAD * median(&mut deviations)?))
}

/// Robust scatter of the finite values; `None` of fewer than two: one value does not tell how much values scatter.
#[must_use]
pub fn scatter(values: &[f64]) -> Option<f64> {
    let finite = values.iter().filter(|v| v.is_finite()).count();
    robust(values).map(|(_, sigma)| sigma).filter(|_| finite > 1)
}
