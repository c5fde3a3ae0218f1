//! Whether any scene seen through the optics explains a few pixels: the sum of point images that fits them best.
//!
//! Electrons and pixels. Any image of the sky is a sum of point images, so what no such sum explains has passed no optics, however it
//! bends. It has no power where hits are faint; there `sharpness` compares hit and star.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::photometry::target::cosmic_rays::{DOUBT_OF_PSF, pixel_share};

/// Pixels whose χ² is exceeded by chance less often than this are no image of the sky.
const LEAST_CHANCE: f64 = 1e-5;
/// Point images stand this far apart \[px\] ...
const STEP_PX: f64 = 0.5;
/// ... and up to this far outside the pixels.
const OUTSIDE_PX: f64 = 1.0;
/// Most rounds over the point images.
const MOST_ROUNDS: usize = 400;
/// After so many rounds each, pixels have the variance of the sum.
const WEIGHED_ROUNDS: [usize; 3] = [3, 10, 30];
/// A round that gains less than this is the last \[χ²\].
const LEAST_GAIN: f64 = 0.02;

/// A pixel that a fit sees.
#[derive(Clone, Copy)]
pub(crate) struct Pixel {
    pub x: f64,
    pub y: f64,
    /// Light above the sky \[e⁻\].
    pub above: f64,
    /// Variance without the photons of that light \[e⁻²\].
    pub empty: f64,
    pub weight: f64,
}

/// Whether no sum of point images of this σ \[px\] explains the pixels: min Σ (d − Σ a_k P_k)²/v over all a_k ≥ 0 has a chance below
/// 10⁻⁵ under χ² of as many degrees of freedom as pixels.
///
/// Images that are wider are sums of these, too. v = `empty` + m + (0.02 m)², m being the sum itself.
pub(crate) fn is_no_image(pixels: &[Pixel], sigma: f64) -> bool {
    let Ok(chance) = ChiSquared::new(pixels.len().max(1) as f64) else { return false };
    let most = chance.inverse_cdf(1.0 - LEAST_CHANCE);
    let images = point_images(pixels, sigma);
    let mut light = vec![0.0; images.len()];
    let mut sum = vec![0.0; pixels.len()];
    let mut weight: Vec<f64> = pixels.iter().map(|p| p.weight).collect();
    let mut last = f64::INFINITY;
    for round in 0..MOST_ROUNDS {
        for (own, image) in light.iter_mut().zip(&images) {
            let (mut num, mut den) = (0.0, 0.0);
            for &(k, p) in image {
                num += weight[k] * p * (pixels[k].above - sum[k]);
                den += weight[k] * p * p;
            }
            let step = if den > 0.0 { (num / den).max(-*own) } else { 0.0 };
            *own += step;
            image.iter().for_each(|&(k, p)| sum[k] += step * p);
        }
        if WEIGHED_ROUNDS.contains(&round) {
            for ((w, p), m) in weight.iter_mut().zip(pixels).zip(&sum) {
                *w = 1.0 / (p.empty + m + (DOUBT_OF_PSF * m).powi(2));
            }
            continue;
        }
        let off = pixels.iter().zip(&sum).zip(&weight);
        let chi2: f64 = off.map(|((p, m), w)| w * (p.above - m).powi(2)).sum();
        let is_weighed = WEIGHED_ROUNDS.iter().all(|r| round > *r);
        if is_weighed && (chi2 < most || last - chi2 < LEAST_GAIN) {
            return chi2 > most;
        }
        last = chi2;
    }
    last > most
}

/// The images of points on a grid over the pixels: which pixels see them, and how much.
fn point_images(pixels: &[Pixel], sigma: f64) -> Vec<Vec<(usize, f64)>> {
    let places = |at: fn(&Pixel) -> f64| -> Vec<f64> {
        let (low, high) =
            pixels.iter().map(at).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let n = ((high - low + 2.0 * OUTSIDE_PX) / STEP_PX).floor().max(0.0) as usize;
        (0..=n).map(|k| low - OUTSIDE_PX + k as f64 * STEP_PX).collect()
    };
    let of_axis = |place: f64, at: fn(&Pixel) -> f64| -> Vec<f64> {
        pixels.iter().map(|p| pixel_share(at(p) - place, sigma)).collect()
    };
    let columns: Vec<Vec<f64>> = places(|p| p.x).into_iter().map(|x| of_axis(x, |p| p.x)).collect();
    let rows: Vec<Vec<f64>> = places(|p| p.y).into_iter().map(|y| of_axis(y, |p| p.y)).collect();
    let image = |gx: &[f64], gy: &[f64]| {
        gx.iter().zip(gy).map(|(gx, gy)| gx * gy).enumerate().filter(|(_, p)| *p > 1e-6).collect::<Vec<_>>()
    };
    rows.iter().flat_map(|gy| columns.iter().map(move |gx| image(gx, gy))).filter(|image| !image.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use statrs::function::erf::erf;

    use super::*;

    /// 9 × 9 pixels of the light of pieces (x, y, electrons), each of this σ.
    fn window(pieces: &[(f64, f64, f64)], sigma: f64) -> Vec<Pixel> {
        let share = |d: f64| {
            let z = |edge: f64| erf(edge / (sigma * std::f64::consts::SQRT_2));
            0.5 * (z(d + 0.5) - z(d - 0.5))
        };
        let pixel = |k: usize| {
            let (x, y) = ((k % 9) as f64, (k / 9) as f64);
            let above: f64 = pieces.iter().map(|(u, v, e)| e * share(x - u) * share(y - v)).sum();
            Pixel { x, y, above, empty: 60.0, weight: 1.0 / (60.0 + above) }
        };
        (0..81).map(pixel).collect()
    }

    /// A track that turns by π within three pixels.
    fn bent(e: f64) -> Vec<(f64, f64, f64)> {
        (0..=60)
            .map(|k| f64::from(k) * std::f64::consts::PI / 60.0)
            .map(|a| (4.0 + 1.5 * a.cos(), 3.3 + 1.5 * a.sin(), e / 61.0))
            .collect()
    }

    #[test]
    fn bright_bent_tracks_are_no_image_and_whatever_the_optics_show_is_one() {
        for sigma in [0.64, 0.85, 1.06] {
            let sharpest = 0.8 * sigma;
            // a star, two, an arc and a disc of stars up to saturation
            for e in [1e3, 1e5] {
                assert!(!is_no_image(&window(&[(4.2, 3.7, e)], sigma), sharpest), "star of {e}, {sigma}");
                assert!(
                    !is_no_image(&window(&[(3.5, 3.7, e), (5.3, 4.4, 0.3 * e)], sigma), sharpest),
                    "pair of {e}, {sigma}"
                );
                assert!(!is_no_image(&window(&bent(e), sigma), sharpest), "arc of {e}, {sigma}");
                let disc: Vec<_> =
                    (0..49).map(|k| (3.0 + f64::from(k % 7) / 3.0, 3.0 + f64::from(k / 7) / 3.0, e / 49.0)).collect();
                assert!(!is_no_image(&window(&disc, sigma), sharpest), "disc of {e}, {sigma}");
            }
            for diffusion in [0.15, 0.35] {
                assert!(is_no_image(&window(&bent(20_000.0), diffusion), sharpest), "{diffusion}, {sigma}");
            }
        }
    }
}
