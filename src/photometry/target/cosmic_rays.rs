//! Cosmic rays and hot pixels: pixels that stand out more sharply than any image of the sky can.
//!
//! Electrons. The search does without them, the flux keeps them and is flagged: under a resolved target the true value is
//! not known to better than the flux's error. Leaves out: hits as wide as a star.

use ndarray::Array2;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::target::sky::Surface;

/// Excess of a hit over what its neighbours allow \[σ\]; of 30 000 pixels of noise none reaches it in a thousand frames.
const HIT_SIGMA: f64 = 6.0;
/// A moment of good seeing may make a star this much smaller than the night's FWHM.
const SHARPEST: f64 = 0.75;

/// Columns and rows of the hits in a cutout; NaN pixels are bad.
///
/// Any image is the sum of point sources seen through the point-spread function, so the mean of the eight neighbours of a
/// pixel is at least m times the pixel, m = (e^(−1/2s²) + e^(−1/s²))/2 being that of a star centred on it,
/// s² = (0.75 FWHM/2.355)² + 1/12. A hit exceeds `neighbours/m` by 6 σ, σ² being the variance its neighbours expect.
pub(crate) fn hits(pixels: &Array2<f32>, sky: &Surface, fwhm_px: f64) -> Vec<(usize, usize)> {
    let (ny, nx) = pixels.dim();
    let mut found = Vec::new();
    if ny < 3 || nx < 3 {
        return found;
    }
    let s2 = (SHARPEST * fwhm_px / FWHM_PER_SIGMA).powi(2) + 1.0 / 12.0;
    let m = 0.5 * ((-0.5 / s2).exp() + (-1.0 / s2).exp());
    let mut level = vec![0f32; nx];
    for j in 1..ny - 1 {
        sky.row(j, &mut level);
        let rms = sky.rms(0.5 * nx as f64, j as f64);
        let least = (0.8 * HIT_SIGMA * rms) as f32;
        let [below, own, above] = [j - 1, j, j + 1].map(|row| pixels.row(row));
        for i in 1..nx - 1 {
            // most pixels are no hits: they are not worth a second look
            if !(own[i] - level[i] > least) {
                continue;
            }
            let around =
                [below[i - 1], below[i], below[i + 1], own[i - 1], own[i + 1], above[i - 1], above[i], above[i + 1]];
            let good = around.iter().filter(|v| v.is_finite()).count();
            if good < 5 {
                continue;
            }
            let sum: f64 = around.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).sum();
            let expected = (sum / good as f64 - f64::from(level[i])).max(0.0) / m;
            let variance = (sky.rms(i as f64, j as f64).powi(2) + expected) * (1.0 + 1.0 / (good as f64 * m * m));
            if f64::from(own[i] - level[i]) - expected > HIT_SIGMA * variance.sqrt() {
                found.push((i, j));
            }
        }
    }
    found
}
