//! One flux: exact aperture sum minus sky, its error from electrons, and what taints it.
//!
//! Electrons and full-frame pixels. The sky is a clipped, smoothed median of an annulus, put right for the skewness of
//! Poisson counts. Leaves out: the flat's own noise; a flattened frame's electrons are taken as if they had been
//! counted, which is right to the flat's departure from 1.

use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::aperture::{Bounds, Shape, cells, for_each_pixel};
use crate::photometry::background::Background;
use crate::photometry::stats;

/// Fewest annulus pixels of a sky; below, the background mesh is used.
const MIN_SKY_PX: usize = 16;
/// Share of clipped annulus pixels beyond what noise explains, from which the annulus is called crowded.
const CROWDED_FRAC: f64 = 0.02;

/// A measured flux with everything that went into it.
#[derive(Debug, Clone, PartialEq)]
pub struct Flux {
    /// Net flux \[e⁻\]; NaN only if no pixel of the aperture could be used.
    pub flux_e: f64,
    /// Its error \[e⁻\]; NaN with the flux.
    pub flux_err_e: f64,
    /// Sky level \[e⁻/px\].
    pub sky_e_px: f64,
    /// Error of the sky level \[e⁻/px\].
    pub sky_err_e_px: f64,
    /// Scatter of the sky pixels \[e⁻\].
    pub sky_rms_e: f64,
    /// Area of the aperture on the frame \[px²\].
    pub area_px: f64,
    /// Annulus pixels used, after clipping; 0 = the background mesh was used.
    pub n_sky: usize,
    /// Flux over its error.
    pub snr: f64,
    /// Highest pixel of the aperture above the sky \[e⁻\]; NaN with the flux.
    pub peak_e: f64,
    /// The aperture.
    pub shape: Shape,
    /// Inner radius of the annulus \[px\].
    pub sky_in_px: f64,
    /// Outer radius of the annulus \[px\].
    pub sky_out_px: f64,
    /// What taints it.
    pub flags: Flags,
}

/// Measures the flux in `shape` at (`x_px`, `y_px`) over the sky in the annulus `sky_in_px` to `sky_out_px`.
///
/// `F = Σ fᵢ pᵢ − A·S`, fᵢ the exact share of pixel i, A = Σ fᵢ the area on the frame, S the sky per pixel.
///
/// `σ_F² = max(F, 0) + A (S + RN²) + A² σ_S²`, all in e⁻. S + RN² is replaced by the measured scatter² of the annulus
/// where that is larger by more than its own sampling error (3 √(2/N)): unresolved stars and flat residuals are noise
/// too. `σ_S² = 1.26 σ²/N`, the variance of the sky estimate (π/2 would be a plain median's).
///
/// Masked pixels: a saturated one is summed as it is and flagged; a bad or clipped one is filled with the mean of the
/// good ones (flag `MASKED`). Outside the frame nothing is filled (flag `EDGE`). With fewer than 16 good annulus
/// pixels the mesh gives the sky (flag `NO_ANNULUS`). Negative fluxes are kept (flag `NEGATIVE`). If nothing can be
/// measured (position not finite or off the frame, all pixels bad) flux, error, S/N and peak are NaN and flags say why.
#[allow(clippy::too_many_arguments)] // one position, one shape, one annulus: a struct would only rename them
#[must_use]
pub fn measure(
    frame: &Frame<Electrons>,
    background: &Background,
    x_px: f64,
    y_px: f64,
    shape: Shape,
    sky_in_px: f64,
    sky_out_px: f64,
    clip_sigma: f64,
) -> Flux {
    let sky = annulus_sky(frame, background, (x_px, y_px), (sky_in_px, sky_out_px), clip_sigma, |_, _| false);
    flux_over_sky(frame, (x_px, y_px), shape, (sky_in_px, sky_out_px), &sky, |_, _| 0.0)
}

/// The sky of one annulus.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sky {
    pub level_e: f64,
    pub err_e: f64,
    pub rms_e: f64,
    /// Pixels kept.
    pub n: usize,
    pub flags: Flags,
}

/// The sky from the unmasked annulus pixels for which `exclude(i, j)` is false.
pub(crate) fn annulus_sky(
    frame: &Frame<Electrons>,
    background: &Background,
    (x, y): (f64, f64),
    (inner, outer): (f64, f64),
    clip_sigma: f64,
    exclude: impl Fn(usize, usize) -> bool,
) -> Sky {
    let mut flags = Flags::default();
    let mut values = Vec::new();
    let mut excluded = 0usize;
    let bounds = Bounds::of(frame);
    let (inner2, outer2) = (inner.max(0.0).powi(2), outer.max(0.0).powi(2));
    for j in cells(y - outer, y + outer, bounds.y0, bounds.y1) {
        let dy2 = (j as f64 - y).powi(2);
        let reach = (outer2 - dy2).max(0.0).sqrt();
        let row = frame.pixels.row(j - bounds.y0);
        let bits = frame.mask.row(j - bounds.y0);
        for i in cells(x - reach, x + reach, bounds.x0, bounds.x1) {
            let r2 = (i as f64 - x).powi(2) + dy2;
            if r2 < inner2 || r2 > outer2 {
                continue;
            }
            let (v, m) = (f64::from(row[i - bounds.x0]), bits[i - bounds.x0]);
            if m & mask::CLIPPED != 0 {
                flags.set(Flags::CLIP_EDGE);
            }
            if m != 0 || !v.is_finite() {
                continue;
            }
            if exclude(i, j) {
                excluded += 1;
            } else {
                values.push(v);
            }
        }
    }
    let sampled = values.len() + excluded;
    let estimate = if values.len() >= MIN_SKY_PX { clipped_sky(&mut values, 0.0, clip_sigma) } else { None };
    let Some((level_e, err_e, clipped)) = estimate else {
        flags.set(Flags::NO_ANNULUS);
        let rms_e = background.rms(x, y);
        return Sky { level_e: background.level(x, y), err_e: background.level_err(x, y), rms_e, n: 0, flags };
    };
    let by_noise = 1.0 - stats::gauss_within(clip_sigma);
    let tolerated = sampled as f64 * (by_noise + CROWDED_FRAC) + 5.0 * (sampled as f64 * by_noise).sqrt();
    if (clipped.n_rejected + excluded) as f64 > tolerated {
        flags.set(Flags::CROWDED_ANNULUS);
    }
    Sky { level_e, err_e, rms_e: clipped.sigma, n: clipped.n, flags }
}

/// Level and error of the sky from its pixels less `zero_e`, unbiased for Poisson counts with Gaussian read noise.
///
/// The median of skewed noise lies below its mean: median = μ − c σγ, γ = λ/σ³ with λ = S the Poisson share of the
/// variance. For a plain median c = 1/6: a sixth of an electron per pixel, 50 e⁻ in an aperture of 300 px.
pub(crate) fn clipped_sky(values: &mut [f64], zero_e: f64, clip_sigma: f64) -> Option<(f64, f64, stats::Clipped)> {
    let clipped = stats::sigma_clip(values, clip_sigma)?;
    let location = stats::smoothed_median(&values[..clipped.n], clipped.median, clipped.sigma)?;
    let variance = clipped.sigma * clipped.sigma;
    let poisson_share = if variance > 0.0 { ((location + zero_e).max(0.0) / variance).min(1.0) } else { 0.0 };
    let level = location + stats::smoothed_median_skew_shift(clip_sigma) * poisson_share;
    let err = (stats::smoothed_median_variance_factor() * variance / clipped.n as f64).sqrt();
    Some((level, err, clipped))
}

/// The aperture sum over a given sky; `extra_variance(i, j)` \[e⁻²\] is added for every covered pixel.
pub(crate) fn flux_over_sky(
    frame: &Frame<Electrons>,
    (x, y): (f64, f64),
    shape: Shape,
    (sky_in_px, sky_out_px): (f64, f64),
    sky: &Sky,
    extra_variance: impl Fn(usize, usize) -> f64,
) -> Flux {
    let bounds = Bounds::of(frame);
    let mut flags = sky.flags;
    let (mut area, mut good_area, mut sum, mut extra, mut peak) = (0.0, 0.0, 0.0, 0.0, f64::NAN);
    for_each_pixel(&shape, x, y, bounds, |i, j, fraction| {
        let at = [j - bounds.y0, i - bounds.x0];
        let (v, m) = (f64::from(frame.pixels[at]), frame.mask[at]);
        area += fraction;
        if m & mask::SATURATED != 0 {
            flags.set(Flags::SATURATED);
        }
        if m & mask::CLIPPED != 0 {
            flags.set(Flags::CLIP_EDGE);
        }
        if m & (mask::BAD | mask::CLIPPED) != 0 || !v.is_finite() {
            flags.set(Flags::MASKED);
            return;
        }
        good_area += fraction;
        // the sky is taken off pixel by pixel: a bright sky costs no digits
        sum += fraction * (v - sky.level_e);
        extra += fraction * fraction * extra_variance(i, j);
        peak = peak.max(v - sky.level_e);
    });
    let whole = area >= shape.area_px() * (1.0 - 1e-9);
    if !whole {
        flags.set(Flags::EDGE);
    }
    let fill = area / good_area;
    let flux_e = if good_area > 0.0 { sum * fill } else { f64::NAN };
    if flux_e <= 0.0 {
        flags.set(Flags::NEGATIVE);
    }
    let variance = flux_e.max(0.0) * fill
        + area * fill * pixel_variance(frame, sky)
        + extra * fill * fill
        + (area * sky.err_e).powi(2);
    let flux_err_e = if flux_e.is_finite() { variance.sqrt() } else { f64::NAN };
    Flux {
        flux_e,
        flux_err_e,
        sky_e_px: sky.level_e,
        sky_err_e_px: sky.err_e,
        sky_rms_e: sky.rms_e,
        area_px: area,
        n_sky: sky.n,
        snr: flux_e / flux_err_e,
        peak_e: peak,
        shape,
        sky_in_px,
        sky_out_px,
        flags,
    }
}

/// Variance of a sky pixel \[e⁻²\]: S + RN², or the measured scatter² where that is larger beyond its sampling error.
fn pixel_variance(frame: &Frame<Electrons>, sky: &Sky) -> f64 {
    let model = sky.level_e.max(0.0) + frame.gain.read_noise_e.powi(2);
    let measured = sky.rms_e * sky.rms_e;
    let sampling = if sky.n > 0 { 3.0 * (2.0 / sky.n as f64).sqrt() } else { 0.0 };
    if measured > model * (1.0 + sampling) { measured } else { model }
}
