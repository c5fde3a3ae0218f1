//! Where a star is: a centroid under a Gaussian window that follows it, and the width of that window.
//!
//! Full-frame pixels; the width is the FWHM of the star before the pixels, which add 1/12 px² to its variance.
//! Bad and clipped pixels count as sky. It does not cover profile fitting or elliptical windows.

use crate::frames::{Electrons, Frame, mask};
use crate::photometry::aperture::{Bounds, cells};
use crate::photometry::background::Background;

/// FWHM of a Gaussian in units of its σ, √(8 ln 2).
pub const FWHM_PER_SIGMA: f64 = 2.354_820_045_030_949;
/// The window is summed out to this many σ.
const WINDOW_SIGMA: f64 = 4.0;

/// Moments of the sky-subtracted pixels under a Gaussian window.
struct Windowed {
    sum: f64,
    dx: f64,
    dy: f64,
    /// Mean of (dx² + dy²)/2 \[px²\].
    variance: f64,
}

fn windowed(frame: &Frame<Electrons>, background: &Background, x: f64, y: f64, sigma: f64) -> Windowed {
    let bounds = Bounds::of(frame);
    let reach = WINDOW_SIGMA * sigma;
    let sky = background.level(x, y);
    let weight = |d: f64| (-0.5 * d * d / (sigma * sigma)).exp();
    let columns: Vec<(usize, f64, f64)> = cells(x - reach, x + reach, bounds.x0, bounds.x1)
        .map(|i| (i - bounds.x0, i as f64 - x, weight(i as f64 - x)))
        .collect();
    let (mut sum, mut sx, mut sy, mut sq) = (0.0, 0.0, 0.0, 0.0);
    for j in cells(y - reach, y + reach, bounds.y0, bounds.y1) {
        let (pixels, bits) = (frame.pixels.row(j - bounds.y0), frame.mask.row(j - bounds.y0));
        let dy = j as f64 - y;
        // the window is the product of two: an exponential per row and column, not per pixel
        let of_row = weight(dy);
        for &(i, dx, of_column) in &columns {
            let value = f64::from(pixels[i]);
            let r2 = dx * dx + dy * dy;
            if bits[i] & (mask::BAD | mask::CLIPPED) != 0 || !value.is_finite() || r2 > reach * reach {
                continue;
            }
            let w = of_row * of_column * (value - sky);
            sum += w;
            sx += w * dx;
            sy += w * dy;
            sq += w * r2;
        }
    }
    Windowed { sum, dx: sx / sum, dy: sy / sum, variance: 0.5 * sq / sum }
}

/// Centroid under a Gaussian window of the star's own width, iterated from (`x_px`, `y_px`).
///
/// x ← x + 2 Σ w p (xᵢ − x) / Σ w p, w Gaussian with σ = FWHM/2.35 (as SExtractor's XWIN): close to the precision of a
/// profile fit. `None` if it moves by more than one FWHM, meets no light, or does not settle within 1e-4 px in 50 steps.
#[must_use]
pub fn centroid(
    frame: &Frame<Electrons>,
    background: &Background,
    x_px: f64,
    y_px: f64,
    fwhm_px: f64,
) -> Option<(f64, f64)> {
    let sigma = fwhm_px / FWHM_PER_SIGMA;
    if !(sigma > 0.0 && sigma.is_finite() && x_px.is_finite() && y_px.is_finite()) {
        return None;
    }
    let (mut x, mut y) = (x_px, y_px);
    for _ in 0..50 {
        let w = windowed(frame, background, x, y, sigma);
        if !(w.sum > 0.0 && w.dx.is_finite() && w.dy.is_finite()) {
            return None;
        }
        x += 2.0 * w.dx;
        y += 2.0 * w.dy;
        if (x - x_px).hypot(y - y_px) > fwhm_px {
            return None;
        }
        if w.dx.abs().max(w.dy.abs()) < 5e-5 {
            return Some((x, y));
        }
    }
    None
}

/// FWHM \[px\] of the star at (`x_px`, `y_px`), and its centroid: the Gaussian window whose width reproduces itself.
///
/// Under a window σ_w a Gaussian star of width σ has the variance 1/(1/σ² + 1/σ_w²): half of σ² where both agree.
/// The 1/12 px² of the pixel is subtracted. `None` where it does not settle between 0.7 and 4 times the first guess.
pub(crate) fn adaptive_fwhm(
    frame: &Frame<Electrons>,
    background: &Background,
    x_px: f64,
    y_px: f64,
    guess_px: f64,
) -> Option<f64> {
    let first = (guess_px / FWHM_PER_SIGMA).max(0.5);
    let (mut x, mut y, mut sigma) = (x_px, y_px, first);
    for _ in 0..100 {
        let w = windowed(frame, background, x, y, sigma);
        if !(w.sum > 0.0 && w.variance > 0.0 && w.variance.is_finite()) {
            return None;
        }
        x += 2.0 * w.dx;
        y += 2.0 * w.dy;
        // σ² = 1/(1/v − 1/σ_w²), damped: v ≥ σ_w² would be a star without end
        let inverse = (1.0 / w.variance - 1.0 / (sigma * sigma)).max(0.25 / (sigma * sigma));
        let next = (1.0 / inverse).sqrt();
        let change = (next - sigma).abs();
        sigma = 0.5 * (sigma + next);
        if (x - x_px).hypot(y - y_px) > 2.0 * FWHM_PER_SIGMA * first || !(0.3..=4.0 * first + 2.0).contains(&sigma) {
            return None;
        }
        if change < 1e-4 * sigma {
            let star = sigma * sigma - 1.0 / 12.0;
            return (star > 0.0).then(|| FWHM_PER_SIGMA * star.sqrt());
        }
    }
    None
}
