//! The flux of a point source at a given place of one frame, detected or not.
//!
//! Electrons. Measured as the target of a single frame is at its own place (`target/point.rs`), hits of what stands out
//! there masked, unless they take most of the place: then its light may be the target's, and is marked as sharp. It does not cover a source that is larger than a star.

use crate::base::constants::FWHM_PER_SIGMA;
use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::background::Background;
use crate::photometry::target::cells::grown;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::flux::circle_at;
use crate::photometry::target::search::{OUTLINE_SIGMA, components};
use crate::photometry::target::settings::TargetSettings;

/// Cells this significant at the scale of a star are neighbours \[σ\].
const NEIGHBOUR_SIGMA: f64 = 4.0;
/// Components near the place are searched for hits up to this size \[cells\].
const MOST_HIT_CELLS: usize = 2000;
/// A jitter below this is taken for this \[FWHM\]: half of what is noticed.
const UNSEEN_JITTER_FWHM: f64 = 0.05;
/// Empty places around the target whose scatter checks the errors, at this distance \[FWHM\].
const EMPTY_FWHM: f64 = 8.0;
/// Number of those places.
const EMPTY_PLACES: usize = 12;

/// The flux at a place of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedFlux {
    /// Electrons, negative or not.
    pub flux_e: f64,
    /// Its variance without the photons of the source itself \[e⁻²\].
    pub variance_e2: f64,
    /// What the photons of a source of one electron add to it.
    pub variance_per_e: f64,
    /// By how much of itself it scatters because the target does not stand still.
    pub moved_frac: f64,
    /// Trails, hits, crossing satellites, saturated or masked pixels near the place.
    pub flags: Flags,
    /// How far from the place the light is, along columns and rows, and the error of each \[px\]; `None` without light.
    pub offset_px: Option<(f64, f64, f64)>,
    /// Whether most of it is light that is sharper than that of a star: of a hit, or of a target with noise on it.
    pub is_sharp: bool,
    /// Flux and variance at empty places around the target, the same in every frame; `None` where one is masked.
    pub empty: Vec<Option<(f64, f64)>>,
}

/// By how much of itself the flux under a profile widened by the jitter scatters: v² = u²/(4 + 8u + 3u²), u = (j/σ)².
///
/// Of a Gaussian source of scale σ, displaced by δ of variance j² per axis, under the profile of variance σ² + j²: the response
/// is N(δ; 2σ² + j²)/N(0; 2σ² + 2j²), whose mean is 1.
fn moved_frac(jitter_px: f64, fwhm_px: f64) -> f64 {
    let u = (FWHM_PER_SIGMA * jitter_px / fwhm_px).powi(2);
    u / (4.0 + 8.0 * u + 3.0 * u * u).sqrt()
}

/// The flux of a point source at (`s.x_px`, `s.y_px`); `None` off the frame, or where most of it is masked by anything but hits.
///
/// `jitter_px` is the scatter of the target about the place per axis, by which the profile of the stars is widened, so that the
/// mean over many frames is the flux.
#[must_use]
pub fn forced_flux(
    frame: &Frame<Electrons>,
    background: &Background,
    s: &TargetSettings,
    jitter_px: f64,
) -> Option<ForcedFlux> {
    let moved_frac = moved_frac(jitter_px.max(UNSEEN_JITTER_FWHM * s.fwhm_px), s.fwhm_px);
    let s = &TargetSettings { fwhm_px: s.fwhm_px.hypot(FWHM_PER_SIGMA * jitter_px), ..*s };
    let mut cutout = Cutout::new(frame, s)?;
    let (ox, oy) = cutout.origin(frame);
    let place = circle_at(s.x_px - ox, s.y_px - oy, s.limit_r_px);
    cutout.exclude(&place);
    let fwhm = cutout.fwhm_cells();
    let at = (cutout.net.in_cells(place.x), cutout.net.in_cells(place.y));
    let hit = mask_hits(&mut cutout, at, fwhm);
    let is_sharp = hit && !cutout.is_seen(&cutout.psf, (place.x, place.y));
    if is_sharp {
        cutout = Cutout::new(frame, s)?;
        cutout.exclude(&place);
    }
    let snr1 = cutout.layers().significance(fwhm, 1, None);
    let objects = cutout.objects(&snr1);
    let flux_at = |at: (f64, f64)| {
        let point = cutout.forced_flux(frame, background, at, &objects, s)?;
        let finite = point.flux.flux_e.is_finite() && point.empty_err_e > 0.0 && point.empty_err_e.is_finite();
        finite.then_some(point)
    };
    let point = flux_at((place.x, place.y))?;
    let neighbours = grown(&snr1.mapv(|v| f64::from(v) > NEIGHBOUR_SIGMA), fwhm.ceil() as usize);
    let empty = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / EMPTY_PLACES as f64;
        let (x, y) = (place.x + EMPTY_FWHM * s.fwhm_px * angle.cos(), place.y + EMPTY_FWHM * s.fwhm_px * angle.sin());
        let cell = |px: f64| cutout.net.in_cells(px).round().max(0.0) as usize;
        let is_free = neighbours.get((cell(y), cell(x))).is_some_and(|neighbour| !neighbour);
        let point = is_free.then(|| flux_at((x, y))).flatten()?;
        Some((point.flux.flux_e, point.empty_err_e * point.empty_err_e))
    };
    let mut flags = point.flux.flags | cutout.crossed(&circle_at(place.x, place.y, cutout.fwhm_px), &snr1);
    if hit {
        flags.set(Flags::HIT);
    }
    Some(ForcedFlux {
        flux_e: point.flux.flux_e,
        variance_e2: point.empty_err_e * point.empty_err_e,
        variance_per_e: point.photons,
        moved_frac,
        flags,
        is_sharp,
        offset_px: cutout.place_step(&cutout.psf, (place.x, place.y)).and_then(|step| step.offset_px),
        empty: (0..EMPTY_PLACES).map(empty).collect(),
    })
}

/// Masks the hits of what stands out within 2 FWHM of the place; whether there were any.
fn mask_hits(cutout: &mut Cutout, at: (f64, f64), fwhm: f64) -> bool {
    let snr = cutout.layers().significance(fwhm, 1, None);
    let near = |&(i, j): &(usize, usize)| (i as f64 - at.0).hypot(j as f64 - at.1) < 2.0 * fwhm;
    let mut any = cutout.hits.iter().any(|&(i, j)| {
        near(&((cutout.net.in_cells(i as f64).max(0.0)) as usize, (cutout.net.in_cells(j as f64).max(0.0)) as usize))
    });
    for cells in components(&snr, OUTLINE_SIGMA) {
        if cells.len() < MOST_HIT_CELLS && cells.iter().any(near) {
            any |= cutout.mask_hits(&cells, 1);
        }
    }
    any
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_light_of_a_jittering_gaussian_under_its_widened_profile_has_the_mean_and_the_scatter_stated() {
        let fwhm_px = 4.0;
        let sigma2 = (fwhm_px / FWHM_PER_SIGMA).powi(2);
        for jitter_px in [0.5, 1.5, 5.0] {
            let j2: f64 = jitter_px * jitter_px;
            // displacements of equal probability: δ² = -2 j² ln(1 - p)
            let n = 100_000;
            let light = |k: usize| {
                let d2 = -2.0 * j2 * (1.0 - (k as f64 + 0.5) / f64::from(n)).ln();
                let (s2, t2) = (2.0 * sigma2 + j2, 2.0 * sigma2 + 2.0 * j2);
                t2 / s2 * (-0.5 * d2 / s2).exp()
            };
            let all: Vec<f64> = (0..n as usize).map(light).collect();
            let mean = all.iter().sum::<f64>() / f64::from(n);
            let variance = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n);
            assert!((mean - 1.0).abs() < 1e-3, "{jitter_px}: {mean}");
            let stated = moved_frac(jitter_px, fwhm_px);
            assert!((stated / variance.sqrt() - 1.0).abs() < 1e-3, "{jitter_px}: {stated} {}", variance.sqrt());
        }
    }
}
