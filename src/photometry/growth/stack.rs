//! Growth curves of stars, and their stack: how the light of a star is spread over rings about it.
//!
//! Radii in units of the FWHM; rings as shares of the light within 1.5 FWHM. One stack serves the stars of a frame and
//! the frames of a night. It does not cover the profile behind it.

use serde::{Deserialize, Serialize};

use crate::base::stats;
use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::annulus::annulus_sky;
use crate::photometry::aperture::{Bounds, Shape, for_each_pixel};
use crate::photometry::background::Background;
use crate::photometry::centroid::centroid;
use crate::photometry::detect::Source;

/// Number of rings.
pub(super) const N: usize = 12;
/// Outer radii of the rings \[FWHM\].
pub(super) const EDGES_FWHM: [f64; N] = [0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0];
/// Rings within the radius that normalises, 1.5 FWHM.
pub(super) const CORE: usize = 6;
/// The sky of a growth curve \[FWHM\].
pub(super) const SKY_FWHM: (f64, f64) = (6.0, 8.0);
/// Fewest σ of a star.
const MIN_SNR: f64 = 50.0;
/// Most stars per frame, the brightest.
const MOST_STARS: usize = 60;
/// A neighbour with more than this share of the star's light rules it out as far as the sky annulus reaches.
const BRIGHT_NEIGHBOUR_FRAC: f64 = 0.05;
/// One with more than this share rules it out near the star, and is masked further out.
const NEIGHBOUR_FRAC: f64 = 0.002;
/// How near that is \[FWHM\], and how far from a masked neighbour pixels are excluded \[FWHM\].
const NEAR_FWHM: f64 = 4.0;
const MASK_FWHM: f64 = 2.0;
/// Stars differ by this share of each ring for reasons other than noise: place on the pixels, field.
const RING_SCATTER_FRAC: f64 = 0.01;
/// No ring is known better than this share of itself: the pixel series and the field.
const RING_FLOOR_FRAC: f64 = 0.003;
/// A value further than this from the median is excluded \[σ\].
const CLIP_SIGMA: f64 = 4.0;

/// The light in rings about stars.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameGrowth {
    /// FWHM the radii are in units of \[px\].
    pub fwhm_px: f64,
    /// Light of each ring over that within 1.5 FWHM.
    pub(super) rings: [f64; N],
    /// Its error, without that of the sky.
    pub(super) err: [f64; N],
    /// Error of the sky, in the same unit per FWHM².
    pub(super) sky_err: f64,
    /// Stars behind it.
    pub n_stars: usize,
}

/// The growth curve of a frame: over bright, round, untainted sources with no bright neighbour. `None` without any.
///
/// Exact sums in circles of 0.25 to 6 FWHM about the centroid, over the clipped sky of 6 to 8 FWHM. Faint neighbours and
/// masked pixels beyond 1.5 FWHM are filled with their ring's mean; within it they rule the star out.
#[must_use]
pub fn frame_growth(
    frame: &Frame<Electrons>,
    background: &Background,
    sources: &[Source],
    fwhm_px: f64,
    clip_sigma: f64,
) -> Option<FrameGrowth> {
    if !(fwhm_px > 0.0 && fwhm_px.is_finite()) {
        return None;
    }
    let bounds = Bounds::of(frame);
    let reach = SKY_FWHM.1 * fwhm_px;
    let mut stars = Vec::new();
    for (k, s) in sources.iter().enumerate() {
        let noise = (s.flux_e.max(0.0) + 7.0 * fwhm_px * fwhm_px * background.rms(s.x_px, s.y_px).powi(2)).sqrt();
        let bright = s.flux_e > MIN_SNR * noise && s.flags == Flags::default();
        if !bright || !bounds.hold(s.x_px, s.y_px, reach) {
            continue;
        }
        let distance = |o: &Source| (o.x_px - s.x_px).hypot(o.y_px - s.y_px);
        let neighbours: Vec<&Source> = sources
            .iter()
            .enumerate()
            .filter(|(other, o)| {
                let far = reach + MASK_FWHM * fwhm_px;
                *other != k
                    && o.flux_e > NEIGHBOUR_FRAC * s.flux_e
                    && (o.y_px - s.y_px).abs() < far
                    && distance(o) < far
            })
            .map(|(_, o)| o)
            .collect();
        let alone =
            neighbours.iter().all(|o| o.flux_e < BRIGHT_NEIGHBOUR_FRAC * s.flux_e && distance(o) > NEAR_FWHM * fwhm_px);
        if alone {
            stars.extend(star_growth(frame, background, (s.x_px, s.y_px), &neighbours, fwhm_px, clip_sigma));
        }
        if stars.len() == MOST_STARS {
            break;
        }
    }
    stack(&stars, RING_SCATTER_FRAC)
}

/// The rings of one star.
fn star_growth(
    frame: &Frame<Electrons>,
    background: &Background,
    at: (f64, f64),
    neighbours: &[&Source],
    fwhm_px: f64,
    clip_sigma: f64,
) -> Option<FrameGrowth> {
    let (x, y) = centroid(frame, background, at.0, at.1, fwhm_px)?;
    let masked = |i: usize, j: usize| {
        neighbours.iter().any(|o| (o.x_px - i as f64).hypot(o.y_px - j as f64) < MASK_FWHM * fwhm_px)
    };
    let annulus = (SKY_FWHM.0 * fwhm_px, SKY_FWHM.1 * fwhm_px);
    let sky = annulus_sky(frame, background, (x, y), annulus, clip_sigma, masked);
    if sky.n == 0 {
        return None;
    }
    let bounds = Bounds::of(frame);
    let (mut rings, mut variance) = ([0.0; N], [0.0; N]);
    let (mut before, mut area_before, mut good_before) = (0.0, 0.0, 0.0);
    for (k, edge) in EDGES_FWHM.into_iter().enumerate() {
        let shape = Shape::Circle { r_px: edge * fwhm_px };
        let (mut sum, mut good) = (0.0, 0.0);
        for_each_pixel(&shape, x, y, bounds, |i, j, fraction| {
            let place = [j - bounds.y0, i - bounds.x0];
            let value = f64::from(frame.pixels[place]);
            if frame.mask[place] == 0 && value.is_finite() && !masked(i, j) {
                sum += fraction * (value - sky.level_e);
                good += fraction;
            }
        });
        let (area, good_area) = (shape.area_px() - area_before, good - good_before);
        let least = if k < CORE { 1.0 - 1e-9 } else { 0.5 };
        if good_area < least * area {
            return None;
        }
        rings[k] = (sum - before) * area / good_area;
        variance[k] = (rings[k].max(0.0) + area * sky.rms_e * sky.rms_e) * area / good_area;
        (before, area_before, good_before) = (sum, shape.area_px(), good);
    }
    let core: f64 = rings[..CORE].iter().sum();
    let noise = variance[..CORE].iter().sum::<f64>().sqrt();
    (core > MIN_SNR * noise).then(|| FrameGrowth {
        fwhm_px,
        rings: rings.map(|r| r / core),
        err: variance.map(|v| v.sqrt() / core),
        sky_err: sky.err_e * fwhm_px * fwhm_px / core,
        n_stars: 1,
    })
}

/// The stack of several curves: the weighted mean of each ring, without what lies 4 σ from their median.
///
/// Curves may differ by `scatter` of each ring beyond their errors. The error of a ring is the larger of that of the
/// weights and that of the scatter found.
pub(super) fn stack(curves: &[FrameGrowth], scatter: f64) -> Option<FrameGrowth> {
    if curves.is_empty() {
        return None;
    }
    let (mut rings, mut err) = ([0.0; N], [0.0; N]);
    for k in 0..N {
        let median = stats::median(&mut curves.iter().map(|c| c.rings[k]).collect::<Vec<_>>())?;
        let spread = stats::mad_sigma(&mut curves.iter().map(|c| c.rings[k]).collect::<Vec<_>>())?;
        let sigma = |c: &FrameGrowth| c.err[k].hypot(scatter * median.abs());
        let kept: Vec<&FrameGrowth> =
            curves.iter().filter(|c| (c.rings[k] - median).abs() <= CLIP_SIGMA * sigma(c).max(0.5 * spread)).collect();
        let weight = |c: &FrameGrowth| sigma(c).powi(2).recip();
        let total: f64 = kept.iter().map(|c| weight(c)).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        rings[k] = kept.iter().map(|c| weight(c) * c.rings[k]).sum::<f64>() / total;
        let found: f64 = kept.iter().map(|c| (weight(c) * (c.rings[k] - rings[k])).powi(2)).sum();
        let spare = kept.len() as f64 / (kept.len() as f64 - 1.0).max(1.0);
        err[k] = total.recip().sqrt().max((found * spare).sqrt() / total).hypot(RING_FLOOR_FRAC * rings[k]);
    }
    let sky_weight: f64 = curves.iter().map(|c| c.sky_err.powi(2).recip()).filter(|w| w.is_finite()).sum();
    let mean = |f: &dyn Fn(&FrameGrowth) -> f64| curves.iter().map(f).sum::<f64>() / curves.len() as f64;
    Some(FrameGrowth {
        fwhm_px: mean(&|c| c.fwhm_px),
        rings,
        err,
        sky_err: if sky_weight > 0.0 { sky_weight.sqrt().recip() } else { 0.0 },
        n_stars: curves.iter().map(|c| c.n_stars).sum(),
    })
}
