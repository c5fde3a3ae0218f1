//! How many flats a master needs: the noise of a pixel of a median of flats, and the fewest that reach what is accepted.
//!
//! A flat of L electrons at read noise RN has the noise σ = √(L + RN²)/L at its median level; a pixel that sees the share r
//! of the light has 1/√r of it more. Shares without unit.

use crate::base::constants::MAG_PER_LN;
use crate::base::stats::median_variance_factor;
use crate::frames::frame::Gain;

/// Flats that are combined at least, where there are more than are needed: of five, one with a star, a cloud or a hit leaves the
/// median among the other four, and a flat that differs from the others is found (four are needed for that).
const FEWEST: usize = 5;
/// Noise-equivalent area of a Gaussian: 4 π σ² = 2.266 FWHM².
const NOISE_AREA_PER_FWHM2: f64 = 2.266;

/// Noise of a pixel of a flat, `level_adu` above the pedestal: √(L + RN²)/L.
pub(super) fn noise_of_flat(level_adu: f64, gain: &Gain) -> f64 {
    let level_e = level_adu * gain.e_per_adu.0;
    (level_e + gain.read_noise_e.powi(2)).sqrt() / level_e
}

/// Noise of a pixel of the master of flats of these noises: √(m(n)/n · mean σ²), m the variance of a median over that of a mean.
/// `None` without flats, or where the noise of one is not known.
pub(super) fn noise_of_master(noises: &[Option<f64>]) -> Option<f64> {
    let sum: f64 = noises.iter().map(|noise| noise.map(|noise| noise * noise)).sum::<Option<f64>>()?;
    let n = noises.len() as f64;
    (n > 0.0).then(|| (median_variance_factor(noises.len()) / n * (sum / n)).sqrt())
}

/// Which of the flats of these noises are combined: all, or the fewest whose master has at most the noise `accepted`, spread evenly
/// over all in their order.
pub(super) fn needed(noises: &[Option<f64>], accepted: Option<f64>, min_flats: usize) -> Vec<usize> {
    let all = noises.len();
    let Some(accepted) = accepted else { return (0..all).collect() };
    let evenly = |n: usize| -> Vec<usize> { (0..n).map(|i| i * (all - 1) / (n - 1)).collect() };
    (FEWEST.max(min_flats)..all)
        .map(evenly)
        .find(|some| {
            let noise = noise_of_master(&some.iter().map(|k| noises[*k]).collect::<Vec<_>>());
            noise.is_some_and(|noise| noise <= accepted)
        })
        .unwrap_or_else(|| (0..all).collect())
}

/// What the noise of a master flat adds to the error of a magnitude \[mag\]: 1.0857 σ/√A of a point that stands on the same pixels
/// in every frame, A the noise-equivalent area of its image; less of what is extended.
pub(crate) fn noise_mag(noise_frac: f64, fwhm_px: f64) -> f64 {
    MAG_PER_LN * noise_frac / noise_area_px(fwhm_px).sqrt()
}

/// Noise-equivalent area of the image of a point \[px²\], one pixel at least.
pub(super) fn noise_area_px(fwhm_px: f64) -> f64 {
    (NOISE_AREA_PER_FWHM2 * fwhm_px * fwhm_px).max(1.0)
}
