//! Whether a small source is as narrow as a cosmic-ray hit or as wide as a star: both are fitted to its pixels.
//!
//! Electrons and pixels. It decides where hits are too faint or too short for the line filters of `cosmic_rays`, which allow for
//! every sub-pixel position and for good seeing. Not modelled: hits as wide as a star.

use nalgebra::{SMatrix, SVector};
use ndarray::Array2;
use statrs::function::erf::erf;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::target::cosmic_rays::{Line, Patch, SHARPEST_PX, sharpest_fwhm_px};
use crate::photometry::target::images::{Pixel, is_no_image};

/// Hits and stars are compared from [`SHARPEST_PX`] up to this FWHM \[px\]: above, the line filters suffice.
const COMPARED_FWHM_PX: f64 = 5.0;
/// Sums of stars are tried below this: where stars are wider, one star is enough to compare with \[px\].
const SUMS_FWHM_PX: f64 = 2.6;
/// σ across a diffuse hit \[px\], before it is collected in pixels.
const HIT_SIGMA_PX: f64 = 0.35;
/// σ of the star that a hit is compared with, in units of the star of the night.
const STAR_SHARE: f64 = 0.95;
/// χ² by which the sharpest star that good seeing makes must fit better than that of the night: it is the less likely.
const SHARPER_CHI2: f64 = 9.0;
/// Variance of a pixel \[px²\].
const PIXEL_VARIANCE: f64 = 1.0 / 12.0;
/// Least light of a window: sum of nine pixels \[σ\].
const LEAST_LIGHT_SIGMA: f64 = 3.5;
/// The middle of a window is the brightest pixel this near \[px\].
const SUMMIT_PX: usize = 1;
/// Windows whose centres are nearer than this hold the same pixels \[px\].
const APART_PX: f64 = 3.0;
/// Most windows of one candidate.
const MOST_WINDOWS: usize = 24;
/// χ² by which a single window must prefer the hit.
const SINGLE_CHI2: f64 = 11.0;
/// χ² by which the only window of a candidate must prefer the hit at most: as a point it is expected in every frame, and of the hits few
/// are as faint and as short.
const POINT_CHI2: f64 = 6.0;
/// From this signal-to-noise on hits are not few: against the star of the night less is enough there ...
const BRIGHT_POINT_SNR: f64 = 9.0;
/// ... if it is this far from what points of that light have \[σ of their scatter\].
const UNLIKE_SIGMA: f64 = 1.75;
/// χ² by which several windows together must.
const TOTAL_CHI2: f64 = 3.0;
/// χ² by which a source at a masked hit must prefer the star, so that it is not a remnant of that hit.
const STAR_CHI2: f64 = 10.0;
/// The same of a long one: where a track bends or crosses itself, it is as wide as a star.
const LONG_REST_CHI2: f64 = 30.0;
/// χ² by which the windows of a long candidate together must prefer the star: tracks are long, and where their light per
/// pixel is in the noise no window decides.
const LONG_STAR_CHI2: f64 = 5.0;
/// A candidate is long where σ of the star that fits its brightest window best exceeds this along it, beyond its width \[FWHM\].
const LONG_FWHM: f64 = 0.7;
/// χ² that noise adds for the hit, whose place, angle and length are free.
const FREE_CHI2: f64 = 3.0;
/// Iterations of a fit.
const STEPS: usize = 15;
/// Longest σ along a piece of light \[px\].
const LONGEST_PX: f64 = 20.0;

/// The verdict on the pixels of a candidate.
pub(crate) enum Verdict {
    /// These parts of it are hits.
    Hits(Vec<Line>),
    /// All of it is.
    AllHits,
    /// It may be an image of the sky.
    Sky,
}

/// A straight piece of light with a Gaussian profile.
#[derive(Clone, Copy)]
struct GaussianSegment {
    x: f64,
    y: f64,
    theta: f64,
    /// σ along it beyond the width across it \[px\].
    length: f64,
    /// χ² of no light less that of this.
    gain: f64,
}

/// Compares hits and stars at the brightest places of a candidate; `inside` marks its pixels in the patch.
///
/// Both are `A exp(−u²/2(V + ℓ²) − v²/2V)`, u along and v across, V = σ² + 1/12 with the pixel; place, angle, ℓ and A
/// are free, and pixels have the weight of the star that fits first. Light of a source on the sky is nowhere narrower than
/// a star, a hit is: Δχ² of the two fits, with equally many free parameters, is twice the logarithm of their likelihood ratio.
/// Where the hit fits better, a star of better seeing is tried, too. A window that no sum of stars explains ([`is_no_image`]) holds a
/// hit, too.
pub(crate) fn judge(patch: &Patch, inside: &Array2<bool>, fwhm_px: f64, near_hit: bool) -> Verdict {
    if !is_compared(fwhm_px) {
        return Verdict::Sky;
    }
    let star = STAR_SHARE * fwhm_px / FWHM_PER_SIGMA;
    let reach = (1.5 * fwhm_px).round() as isize + 1;
    let (mut total, mut hits) = (0.0, Vec::new());
    let places = places(patch, inside);
    let is_one = places.len() == 1;
    let sharpest = sharpest_fwhm_px(fwhm_px) / FWHM_PER_SIGMA;
    let mut brightest = (0.0, 0.0); // χ² and length of the brightest window
    let mut least_to_sharpest = f64::INFINITY; // χ² by which a hit is preferred to the sharpest star
    for (i, j) in places {
        let mut window = window(patch, (i, j), reach);
        let first = best_fit(&window, (i, j), star);
        weigh_as(&mut window, &first, star);
        let (hit, star) = (best_fit(&window, (i, j), HIT_SIGMA_PX), best_fit(&window, (i, j), star));
        let to_sharpest = if hit.gain > star.gain {
            hit.gain - best_fit(&window, (i, j), sharpest).gain + SHARPER_CHI2
        } else {
            f64::INFINITY
        };
        let preferred = to_sharpest.min(hit.gain - star.gain);
        least_to_sharpest = least_to_sharpest.min(to_sharpest);
        total += preferred;
        brightest = if star.gain > brightest.0 { (star.gain, star.length) } else { brightest };
        // where one star fits, so does a sum of them
        let of_none: f64 = window.iter().map(|p| p.weight * p.above * p.above).sum();
        let may_be_odd = fwhm_px < SUMS_FWHM_PX && of_none - star.gain > window.len() as f64;
        if preferred > SINGLE_CHI2 || (may_be_odd && is_no_image(&window, sharpest)) {
            let half = (1.7 * hit.length).min(reach as f64);
            let (dx, dy) = (half * hit.theta.cos(), half * hit.theta.sin());
            hits.push(Line { excess: preferred, from: (hit.x - dx, hit.y - dy), to: (hit.x + dx, hit.y + dy) });
        }
    }
    if !hits.is_empty() {
        return Verdict::Hits(hits);
    }
    let most = match (brightest.1 > LONG_FWHM * fwhm_px, near_hit) {
        (true, true) => -LONG_REST_CHI2,
        (true, false) => -LONG_STAR_CHI2,
        (false, true) => -STAR_CHI2,
        (false, false) if is_one && least_to_sharpest > POINT_CHI2 => least_of_hit(brightest.0, fwhm_px),
        (false, false) if is_one => POINT_CHI2,
        (false, false) => TOTAL_CHI2,
    };
    if total > most { Verdict::AllHits } else { Verdict::Sky }
}

/// Whether a star is wide enough to differ from a hit, and not so wide that the line filters suffice.
fn is_compared(fwhm_px: f64) -> bool {
    (SHARPEST_PX..=COMPARED_FWHM_PX).contains(&fwhm_px)
}

/// The share of points of significance `snr` that are not taken for hits: Φ((d² − 3 + t)/2d), t being [`least_of_hit`].
pub(crate) fn share_kept(snr: f64, fwhm_px: f64) -> f64 {
    if !is_compared(fwhm_px) {
        return 1.0;
    }
    let (preferred, scatter) = star_preferred(snr * snr, fwhm_px);
    0.5 * (1.0 + erf((preferred + least_of_hit(snr * snr, fwhm_px)) / (scatter * std::f64::consts::SQRT_2)))
}

/// χ² by which a point of `light` (χ² of no light less that of a star) prefers the star, d² − 3, and the scatter of that, 2d.
///
/// Across them, hit and star (variances V and W with the pixel) have the overlap ρ² = 2 √(V W)/(V + W); d² = (1 − ρ²) `light`.
fn star_preferred(light: f64, fwhm_px: f64) -> (f64, f64) {
    let variance = |sigma: f64| sigma * sigma + PIXEL_VARIANCE;
    let (hit, star) = (variance(HIT_SIGMA_PX), variance(fwhm_px / FWHM_PER_SIGMA));
    let d2 = light * (1.0 - 2.0 * (hit * star).sqrt() / (hit + star));
    (d2 - FREE_CHI2, 2.0 * d2.sqrt())
}

/// χ² by which the only window of a candidate must prefer the hit: never less than 0, and of bright points few do, however bright.
fn least_of_hit(light: f64, fwhm_px: f64) -> f64 {
    let (preferred, scatter) = star_preferred(light, fwhm_px);
    let of_bright = (UNLIKE_SIGMA * scatter - preferred).clamp(0.0, POINT_CHI2);
    if light < BRIGHT_POINT_SNR * BRIGHT_POINT_SNR { POINT_CHI2 } else { of_bright }
}

/// The brightest pixels of a candidate, each a window apart from the others.
fn places(patch: &Patch, inside: &Array2<bool>) -> Vec<(usize, usize)> {
    let (ny, nx) = patch.above.dim();
    let mut all = Vec::new();
    for ((j, i), _) in inside.indexed_iter().filter(|(_, v)| **v) {
        let around = ndarray::s![j.saturating_sub(1)..(j + 2).min(ny), i.saturating_sub(1)..(i + 2).min(nx)];
        let (mut sum, mut square) = (0.0, 0.0);
        let (above, variance) = (patch.above.slice(around), patch.variance.slice(around));
        for (v, s2) in above.iter().zip(&variance).filter(|(v, _)| v.is_finite()) {
            sum += f64::from(*v);
            square += f64::from(*s2);
        }
        if patch.above[[j, i]].is_finite() && sum > LEAST_LIGHT_SIGMA * f64::sqrt(square) {
            all.push((patch.above[[j, i]], i, j));
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut places: Vec<(usize, usize)> = Vec::new();
    for (own, i, j) in all {
        if places.len() == MOST_WINDOWS {
            break;
        }
        let apart = |p: &(usize, usize)| (p.0 as f64 - i as f64).hypot(p.1 as f64 - j as f64) >= APART_PX;
        // on the flank of something bright neither a hit nor a star fits
        let around = ndarray::s![
            j.saturating_sub(SUMMIT_PX)..(j + SUMMIT_PX + 1).min(ny),
            i.saturating_sub(SUMMIT_PX)..(i + SUMMIT_PX + 1).min(nx)
        ];
        let brightest = patch.above.slice(around).iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if own >= brightest && places.iter().all(apart) {
            places.push((i, j));
        }
    }
    places
}

/// The good pixels about one.
fn window(patch: &Patch, at: (usize, usize), reach: isize) -> Vec<Pixel> {
    let (ny, nx) = patch.above.dim();
    let mut pixels = Vec::new();
    for dj in -reach..=reach {
        for di in -reach..=reach {
            let (Some(i), Some(j)) = (at.0.checked_add_signed(di), at.1.checked_add_signed(dj)) else { continue };
            if i < nx && j < ny && di * di + dj * dj <= reach * reach + 1 && patch.above[[j, i]].is_finite() {
                let (above, variance) = (f64::from(patch.above[[j, i]]), f64::from(patch.variance[[j, i]]));
                let empty = (variance - above.max(0.0)).max(1e-6);
                pixels.push(Pixel { x: i as f64, y: j as f64, above, empty, weight: 1.0 / variance.max(1e-6) });
            }
        }
    }
    pixels
}

/// Weights the pixels by the photons of a star, not by their own: where few electrons make it, a pixel that has too few by chance would
/// count more than its neighbours, and the wings of a star that are lost so make it a hit.
fn weigh_as(pixels: &mut [Pixel], star: &GaussianSegment, sigma: f64) {
    let light = light(pixels, star, sigma * sigma + PIXEL_VARIANCE);
    let (a, _) = amplitude(pixels, &light);
    for (p, [m, ..]) in pixels.iter_mut().zip(light) {
        p.weight = 1.0 / (p.empty + a * m);
    }
}

/// The piece of light of the given σ across that fits best about a pixel.
fn best_fit(pixels: &[Pixel], at: (usize, usize), sigma: f64) -> GaussianSegment {
    let start = GaussianSegment { x: at.0 as f64, y: at.1 as f64, theta: 0.0, length: 0.7, gain: f64::NEG_INFINITY };
    let quarter = std::f64::consts::FRAC_PI_4;
    (0..4)
        .map(|k| {
            fit(pixels, GaussianSegment { theta: f64::from(k) * quarter, ..start }, sigma * sigma + PIXEL_VARIANCE)
        })
        .fold(start, |best, segment| if segment.gain > best.gain { segment } else { best })
}

/// Light in each pixel and its derivatives by place, angle and length, per unit of A.
fn light(pixels: &[Pixel], p: &GaussianSegment, variance: f64) -> Vec<[f64; 5]> {
    let (sin, cos) = p.theta.sin_cos();
    let (per_along, per_across) = (1.0 / (variance + p.length * p.length), 1.0 / variance);
    let of_pixel = |pixel: &Pixel| {
        let (dx, dy) = (pixel.x - p.x, pixel.y - p.y);
        let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let (a, b) = (u * per_along, v * per_across);
        let m = (-0.5 * (u * a + v * b)).exp();
        [m, m * (a * cos - b * sin), m * (a * sin + b * cos), m * (u * b - v * a), m * a * a * p.length]
    };
    pixels.iter().map(of_pixel).collect()
}

/// A for which a piece fits best, and the χ² it gains.
fn amplitude(pixels: &[Pixel], light: &[[f64; 5]]) -> (f64, f64) {
    let (mut dm, mut mm) = (0.0, 0.0);
    for (Pixel { above, weight, .. }, [m, ..]) in pixels.iter().zip(light) {
        dm += weight * above * m;
        mm += weight * m * m;
    }
    if dm > 0.0 && mm > 0.0 { (dm / mm, dm * dm / mm) } else { (0.0, 0.0) }
}

/// Levenberg-Marquardt steps from a first guess.
fn fit(pixels: &[Pixel], start: GaussianSegment, variance: f64) -> GaussianSegment {
    let mut best = start;
    let mut light = self::light(pixels, &best, variance);
    let mut a;
    (a, best.gain) = amplitude(pixels, &light);
    let mut damping = 1e-2;
    for _ in 0..STEPS {
        // of the symmetric matrix the lower half is read
        let mut normal = SMatrix::<f64, 5, 5>::zeros();
        let mut right = SVector::<f64, 5>::zeros();
        for (Pixel { above, weight, .. }, [m, by @ ..]) in pixels.iter().zip(&light) {
            let g = [*m, a * by[0], a * by[1], a * by[2], a * by[3]];
            for k in 0..5 {
                let weighted = weight * g[k];
                right[k] += weighted * (above - a * m);
                for l in k..5 {
                    normal[(l, k)] += weighted * g[l];
                }
            }
        }
        for k in 0..5 {
            normal[(k, k)] *= 1.0 + damping;
            normal[(k, k)] += 1e-9;
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&right)) else { break };
        let mut next = GaussianSegment {
            x: (best.x + step[1]).clamp(start.x - 1.5, start.x + 1.5),
            y: (best.y + step[2]).clamp(start.y - 1.5, start.y + 1.5),
            theta: best.theta + step[3].clamp(-0.5, 0.5),
            length: (best.length + step[4].clamp(-2.0, 2.0)).clamp(0.0, LONGEST_PX),
            gain: 0.0,
        };
        let next_light = self::light(pixels, &next, variance);
        let next_a;
        (next_a, next.gain) = amplitude(pixels, &next_light);
        if next.gain > best.gain {
            let small = next.gain - best.gain < 0.02;
            (best, a, light) = (next, next_a, next_light);
            damping *= 0.3;
            if small {
                break;
            }
        } else {
            damping *= 8.0;
            if damping > 1e4 {
                break;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_bright_points_few_are_hits_and_none_that_is_more_like_a_star() {
        for fwhm in [1.3, 1.5, 1.7, 2.0, 3.0, 5.0] {
            let mut before = POINT_CHI2;
            for snr in [5.0, 7.0, 8.9, 9.0, 12.0, 15.0, 20.0, 50.0, 300.0] {
                let (least, kept) = (least_of_hit(snr * snr, fwhm), share_kept(snr, fwhm));
                assert!((0.0..=before).contains(&least), "FWHM {fwhm} S/N {snr}: {least}");
                assert!(snr >= BRIGHT_POINT_SNR || least == POINT_CHI2, "FWHM {fwhm} S/N {snr}: {least}");
                assert!((0.95..=1.0).contains(&kept), "FWHM {fwhm} S/N {snr}: {kept}");
                before = least;
            }
            assert!(before == 0.0);
        }
    }
}
