//! One faint trail through the target where the direction of the trails is known beforehand.
//!
//! Cells. All trails of a tracked frame run along the target's motion among the stars, so only the offset of a line is
//! free: a line of some 3.5 σ is significant, whereas without the direction it takes 4.9. It does not cover trails next
//! to the target, which do it no harm.

use crate::base::search::{Until, bisect};
use ndarray::Array2;
use std::convert::Infallible;

use super::exclusion::ExclusionMask;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::clip::CLIP_SIGMA;
use crate::photometry::target::placed::Placed;
use crate::photometry::trails::direction::Turned;
use crate::photometry::trails::search::{SMEARED_FWHM, along, coarse};

/// Direction of the star trails of a frame, known from elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownDirection {
    /// From +x towards +y \[rad\]; half a turn more is the same.
    pub theta_rad: f64,
    /// Standard error \[rad\].
    pub err_rad: f64,
}

/// Share of frames without a trail in which a line may be accepted.
const FALSE_SHARE: f64 = 0.05;
/// Directions looked at to each side \[standard errors\].
const SEARCHED_ERR: f64 = 2.0;

/// The direction of the best line through an object among the known directions, and its v; `None` if it may be noise.
///
/// The line is a Gaussian across, even along, over the whole cutout without the cells in `hidden`; `noise` is the scatter
/// of a cell.
pub(crate) fn line_through(
    net: &Array2<f32>,
    hidden: &Array2<bool>,
    object: &Placed,
    (noise, fwhm): (f64, f64),
    known: KnownDirection,
) -> Option<(f64, f64)> {
    let points = coarse(net, hidden, noise, ((0.4 * fwhm).round() as usize).max(1));
    if points.len() < 100 {
        return None;
    }
    let dim = net.dim();
    let half = 0.5 * dim.0.min(dim.1) as f64;
    let sigma = SMEARED_FWHM * fwhm / FWHM_PER_SIGMA;
    let bin = 0.125 * fwhm;
    let reach = (3.0 * sigma / bin).ceil() as i32;
    let taps: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (f64::from(k) * bin / sigma).powi(2)).exp()).collect();
    let span = SEARCHED_ERR * known.err_rad.max(0.0);
    let n = (span * half / sigma).ceil() as i32;
    let (mut best, mut across) = ((f64::NEG_INFINITY, 0.0, known.theta_rad), 0.0);
    for k in -n..=n {
        let theta = known.theta_rad + span * f64::from(k) / f64::from(n.max(1));
        let turned = Turned::new(dim, theta);
        let exclusion = ExclusionMask::of(&turned, (object.x, object.y), object.shape);
        across = exclusion.across();
        let first = exclusion.v - across - f64::from(reach) * bin;
        let mut sums = vec![[0f64; 2]; (2.0 * across / bin) as usize + taps.len()];
        for p in &points {
            let at = (turned.uv(p.x, p.y).1 - first) / bin;
            if let Some(sum) = sums.get_mut(at as usize).filter(|_| at >= 0.0) {
                sum[0] += p.value;
                sum[1] += 1.0;
            }
        }
        for (q, window) in sums.windows(taps.len()).enumerate() {
            let (sum, n) = window.iter().zip(&taps).fold((0.0, 0.0), |(s, n), (w, t)| (s + t * w[0], n + t * t * w[1]));
            let snr = sum / f64::max(n, 1.0).sqrt();
            if snr > best.0 {
                best = (snr, first + (q as f64 + f64::from(reach) + 0.5) * bin, theta);
            }
        }
    }
    let (snr, v, theta) = best;
    let turned = Turned::new(dim, theta);
    let own = turned.uv(object.x, object.y).0;
    let (before, behind) =
        (along(&points, turned, v, sigma, |u| u < own), along(&points, turned, v, sigma, |u| u >= own));
    let equal = before.1 < 8.0
        || behind.1 < 8.0
        || (before.0 / before.1 - behind.0 / behind.1).abs() < CLIP_SIGMA * (1.0 / before.1 + 1.0 / behind.1).sqrt();
    (equal && snr > threshold(2.0 * across / sigma, 2.0 * span * half / sigma)).then_some((theta, v))
}

/// The significance that the best of all lines of noise exceeds in [`FALSE_SHARE`] of the frames.
///
/// Of a Gaussian field over `offsets` × `turns` (in units of the profile's σ, across and at the ends of the lines) the
/// expected number of maxima above t is (Worsley 1996) Q + (a + b) e^(−t²/2)/2π + a b t e^(−t²/2)/(2π)^1.5, a and b the
/// ranges over the correlation lengths: √2 for an offset, √6 for a turn.
fn threshold(offsets: f64, turns: f64) -> f64 {
    let (a, b) = (offsets / 2f64.sqrt(), turns / 6f64.sqrt());
    let tau = 2.0 * std::f64::consts::PI;
    let expected = |t: f64| {
        let tail = 0.5 * statrs::function::erf::erfc(t / 2f64.sqrt());
        tail + (-0.5 * t * t).exp() * ((a + b) / tau + a * b * t / tau.powf(1.5))
    };
    let too_often = |t: f64| Ok::<bool, Infallible>(expected(t) > FALSE_SHARE);
    let Ok([_, high]) = bisect(1.0, 8.0, Until::Steps(40), too_often);
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    #[test]
    fn noise_is_taken_for_a_line_as_seldom_as_it_is_said() {
        let mut rng = rand_chacha::ChaCha12Rng::seed_from_u64(7);
        let shape = crate::photometry::aperture::Shape::Circle { r_px: 20.0 };
        let known = KnownDirection { theta_rad: 0.7, err_rad: 0.01 };
        let found = (0..200)
            .filter(|_| {
                let net = Array2::from_shape_simple_fn((150, 150), || rand_distr::StandardNormal.sample(&mut rng));
                let hidden =
                    Array2::from_shape_fn((150, 150), |(j, i)| (i as f64 - 75.0).hypot(j as f64 - 75.0) < 20.0);
                line_through(&net, &hidden, &Placed { x: 75.0, y: 75.0, shape }, (1.0, 4.0), known).is_some()
            })
            .count();
        // 10 ± 3 of 200 at most: the clip and the check of both sides cost some
        assert!((1..=19).contains(&found), "{found}");
    }
}
