//! Surface brightness of a resolved target: the mean over its aperture and the brightest seeing disc inside.
//!
//! Instrumental magnitudes per square arcsecond, of electrons per second; the zeropoint turns them into V. It does not
//! cover the light between the target and the edge of its aperture, which makes the mean fainter than the target's own.

use ndarray::Array2;

use crate::photometry::aperture::{Bounds, Shape, for_each_pixel};

/// A disc fainter than this is noise: the brightest of many always is \[σ\].
const MIN_SIGMA: f64 = 5.0;

/// −2.5 log₁₀ of electrons per second and square arcsecond.
///
/// `μ = −2.5 log₁₀(F / (t A p²))`: F the electrons in t seconds on A pixels of p arcseconds. Neither t nor p changes it
/// for the same sky. `None` where the light is not positive.
#[must_use]
pub fn inst_mu(flux_e: f64, exptime_s: f64, area_px: f64, scale_arcsec: f64) -> Option<f64> {
    let per_arcsec2 = flux_e / (exptime_s * area_px * scale_arcsec * scale_arcsec);
    (per_arcsec2 > 0.0 && per_arcsec2.is_finite()).then(|| -2.5 * per_arcsec2.log10())
}

/// Electrons per pixel in the brightest disc of one FWHM across that lies wholly inside the aperture at (`x`, `y`).
///
/// Looked for in squares on every `step`-th pixel of `net` (light above sky and trails), then exactly every half pixel
/// around the best.
/// `None` if no disc fits or the brightest is below 5 σ; `rms_e` is the scatter of a sky pixel.
pub(crate) fn brightest_disc(
    net: &Array2<f32>,
    (x, y): (f64, f64),
    aperture: &Shape,
    fwhm_px: f64,
    step: usize,
    rms_e: f64,
) -> Option<f64> {
    let (ny, nx) = net.dim();
    let bounds = Bounds { x0: 0, x1: nx, y0: 0, y1: ny };
    let disc = Shape::Circle { r_px: 0.5 * fwhm_px };
    let inside = aperture.grown(-0.5 * fwhm_px);
    let sum_at = |cx: f64, cy: f64| -> Option<f64> {
        if !inside.contains(cx - x, cy - y) && (cx, cy) != (x, y) {
            return None;
        }
        let mut sum = 0.0;
        for_each_pixel(&disc, cx, cy, bounds, |i, j, f| sum += f * f64::from(net[[j, i]]));
        sum.is_finite().then_some(sum)
    };
    let mut best: Option<(f64, f64, f64)> = None;
    let consider = |cx: f64, cy: f64, best: &mut Option<(f64, f64, f64)>| {
        if let Some(sum) = sum_at(cx, cy)
            && best.is_none_or(|b| sum > b.0)
        {
            *best = Some((sum, cx, cy));
        }
    };
    // whole pixels first: the exact disc only around the best of them
    let r = (0.5 * fwhm_px).floor() as usize;
    let mut brightest = (f64::NEG_INFINITY, x, y);
    for j in (r..ny.saturating_sub(r)).step_by(step.max(1)) {
        for i in (r..nx.saturating_sub(r)).step_by(step.max(1)) {
            if inside.contains(i as f64 - x, j as f64 - y) {
                let square = net.slice(ndarray::s![j - r..=j + r, i - r..=i + r]);
                let sum = f64::from(square.sum());
                if sum > brightest.0 {
                    brightest = (sum, i as f64, j as f64);
                }
            }
        }
    }
    consider(brightest.1, brightest.2, &mut best);
    consider(x, y, &mut best);
    let (_, cx, cy) = best?;
    let reach = 2 * step as i32;
    for dj in -reach..=reach {
        for di in -reach..=reach {
            consider(cx + 0.5 * f64::from(di), cy + 0.5 * f64::from(dj), &mut best);
        }
    }
    let area = disc.area_px();
    let (sum, ..) = best?;
    (sum > MIN_SIGMA * (area * rms_e * rms_e + sum.max(0.0)).sqrt()).then_some(sum / area)
}
