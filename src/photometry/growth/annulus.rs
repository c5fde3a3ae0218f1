//! The bias of the clipped median of an annulus by the wings of the star in it.
//!
//! Shares of the star's light per px². It does not cover the clip, which only matters where wings are 3 σ above the sky.

use crate::base::search::{Until, bisect};
use std::convert::Infallible;
use std::f64::consts::SQRT_2;

use statrs::function::erf::erf;

use super::radial::Radial;

/// Rings of equal area the annulus is cut into.
const RINGS: usize = 16;
/// Noise, in units of the brightest wings, that hides them: the median is their mean to better than 1 %.
const HIDDEN: f64 = 10.0;
/// Spread of the wings within a ring, as a share of their mean: without it the median would jump from ring to ring.
const WITHIN_RING: f64 = 0.1;

/// The sky level an annulus finds over a star of light 1, for noise of `rms` per pixel in units of that light.
///
/// The median m of wings and noise: Σ over rings of Φ((wᵢ − m)/σ) = ½. For σ → 0 their median, for σ → ∞ their mean.
pub(super) fn level_of_wings(profile: &Radial, (inner_px, outer_px): (f64, f64), rms: f64) -> f64 {
    if !(outer_px > inner_px && inner_px >= 0.0) {
        return 0.0;
    }
    let mean = profile.mean_between(inner_px, outer_px);
    let area2 = outer_px * outer_px - inner_px * inner_px;
    let at = |k: usize| profile.density((inner_px * inner_px + area2 * (k as f64 + 0.5) / RINGS as f64).sqrt());
    let mut wings: [f64; RINGS] = std::array::from_fn(at);
    // rings miss a little of the steep inner edge
    let scale = mean * RINGS as f64 / wings.iter().sum::<f64>();
    wings.iter_mut().for_each(|w| *w *= scale);
    let (low, high) = (wings[RINGS - 1], wings[0]);
    if !(rms > 0.0 && rms < HIDDEN * high) {
        return mean;
    }
    let rms = rms.hypot(WITHIN_RING * mean);
    // the sum falls with m
    let sum = |m: f64| wings.iter().map(|w| erf((w - m) / (SQRT_2 * rms))).sum::<f64>();
    let Ok([low, high]) = bisect(low, high, Until::Steps(40), |m| Ok::<bool, Infallible>(sum(m) > 0.0));
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wings_count_by_their_mean_under_noise_and_by_their_median_above_it() {
        let profile = Radial::new(0.4, 4.0);
        let ring = (12.0, 20.0);
        let mean = profile.mean_between(ring.0, ring.1);
        let median = profile.density((0.5 * (ring.0 * ring.0 + ring.1 * ring.1)).sqrt());
        assert!(median < 0.8 * mean);
        let at = |rms: f64| level_of_wings(&profile, ring, rms);
        assert!((at(1e3 * mean) / mean - 1.0).abs() < 1e-12);
        // the first departure from the mean falls as 1/σ²
        assert!((at(20.0 * mean) / mean - 1.0).abs() < 0.01, "{}", at(20.0 * mean) / mean);
        assert!((at(1e-3 * mean) / median - 1.0).abs() < 0.03, "{}", at(1e-3 * mean) / median);
        assert_eq!(level_of_wings(&profile, (5.0, 5.0), 1.0), 0.0);
        assert!((at(f64::NAN) - mean).abs() < 1e-18);
    }
}
