//! Cosmic-ray hits and hot pixels: pixels, and lines of pixels, that are sharper than any image of the sky can be.
//!
//! Electrons. The search does without them; the flux keeps them and is flagged: under a resolved target the true value is
//! not known to better than the flux's error. Not recognised: hits that are as wide as a star.

use ndarray::Array2;
use statrs::function::erf::erf;

use crate::constants::FWHM_PER_SIGMA;
use crate::photometry::target_sky::Surface;

/// Excess of a hit over what its neighbours allow \[σ\], anywhere in a cutout; of 30 000 pixels of noise none reaches it
/// in a thousand frames.
const HIT_SIGMA: f64 = 6.0;
/// The same for the brightest pixels of what may be the target: a few thousand combinations are tried, each of them with
/// the reserve of [`SHARPEST`].
const CANDIDATE_SIGMA: f64 = 4.5;
/// The same where the candidate touches hits that are known already.
const BESIDE_SIGMA: f64 = 3.0;
/// A moment of good seeing may make a star this much smaller than the night's FWHM, where that is 4 px or more.
const SHARPEST: f64 = 0.75;
/// And this much where it is 2 px or less: there optics and pixels make the image, not the air.
const SHARPEST_UNDERSAMPLED: f64 = 0.85;
/// Directions of lines: a half turn in as many steps.
const DIRECTIONS: usize = 16;
/// Lengths of lines that are tried for the brightest pixels of a candidate \[px\].
const LENGTHS: [i64; 7] = [1, 2, 3, 5, 9, 17, 33];
/// Lengths that are tried everywhere in a cutout \[px\].
const SHORT_LENGTHS: usize = 4;
/// Farthest neighbours a line is compared with \[px\].
const FARTHEST_PX: usize = 4;
/// Two neighbours that need not hold more than this share of a star's pixels say nothing about them.
const LEAST_RATIO: f64 = 0.05;
/// Widths of lines \[px\]: light between two rows of pixels fills both.
const WIDTHS: usize = 2;
/// Brightest pixels of a candidate that are examined.
const BRIGHTEST: usize = 300;
/// Rounds over a cutout: a hit that is masked no longer hides the one next to it.
const ROUNDS: usize = 6;

/// What any image of the sky must obey, however it is made of stars.
///
/// Any image is a sum of point sources seen through the point-spread function. For a symmetric one that falls off as a
/// Gaussian does or more slowly, the mean of two pixels at ±d from a third is at least g(d) times the third: for one
/// Gaussian at distance u the ratio is g(d) cosh(u d/s²) ≥ g(d), and what holds for each star holds for their sum, and
/// for the sum over the pixels of a line. The same holds for two rows of pixels and the rows at distance d on both sides
/// of them. The ratios are those of pixels that integrate the sharpest Gaussian, 0.75 to 0.85 FWHM wide.
#[derive(Debug, Clone)]
pub(crate) struct Sharpness {
    /// For a line of each width: sum of the two pixels at a distance of 1, 2, … px over the sum of those between them.
    ratios: [Vec<f64>; WIDTHS],
    /// The least mean of the eight neighbours over a pixel.
    around: f64,
}

impl Sharpness {
    /// Of stars of this FWHM \[px\].
    pub fn of(fwhm_px: f64) -> Self {
        let undersampled = (2.0 - 0.5 * fwhm_px).clamp(0.0, 1.0);
        let sharpest = SHARPEST + (SHARPEST_UNDERSAMPLED - SHARPEST) * undersampled;
        let sigma = sharpest * fwhm_px / FWHM_PER_SIGMA;
        let share = |at: f64| {
            let edge = |x: f64| erf(x / (sigma * std::f64::consts::SQRT_2));
            0.5 * (edge(at + 0.5) - edge(at - 0.5))
        };
        // a star in the middle has the least beside it; the integral over pixels does not change that, but is looked at
        let ratio = |width: usize, d: usize| {
            let (half, d) = (0.5 * (width as f64 - 1.0), d as f64);
            let of_star_at = |u: f64| {
                let own: f64 = (0..width).map(|k| share(k as f64 - half - u)).sum();
                (share(half + d - u) + share(half + d + u)) / own
            };
            (0..=20).map(|k| of_star_at(0.05 * f64::from(k))).fold(f64::INFINITY, f64::min)
        };
        let ratios = [1, 2].map(|width| {
            (1..=FARTHEST_PX).map(|d| ratio(width, d)).take_while(|r| *r > LEAST_RATIO).collect::<Vec<f64>>()
        });
        let g = 0.5 * ratio(1, 1);
        Self { ratios, around: 0.5 * (g + g * g) }
    }
}

/// The pixels of a cutout and its sky, with the hits found so far.
pub(crate) struct Seen<'a> {
    pub pixels: &'a Array2<f32>,
    pub sky: &'a Surface,
    pub sharpness: &'a Sharpness,
    /// True where a pixel is a hit.
    pub hits: &'a Array2<bool>,
}

impl Seen<'_> {
    /// A pixel above the sky; `None` outside, where it is bad, and where it is a hit.
    fn above(&self, i: i64, j: i64) -> Option<f64> {
        let (ny, nx) = self.pixels.dim();
        let (i, j) = (usize::try_from(i).ok().filter(|i| *i < nx)?, usize::try_from(j).ok().filter(|j| *j < ny)?);
        let v = self.pixels[[j, i]];
        (v.is_finite() && !self.hits[[j, i]]).then(|| f64::from(v) - self.sky.level(i as f64, j as f64))
    }

    /// A pixel above the sky as a neighbour: under a hit the mean of the good pixels around it.
    ///
    /// That of a star's core would lie below the core and yet above what the next pixel needs to be part of a star.
    fn neighbour(&self, i: i64, j: i64) -> Option<f64> {
        self.above(i, j).or_else(|| self.filled(i, j))
    }

    /// The mean above the sky of the good pixels next to a pixel, in a square of 3 px, else of 5.
    pub fn filled(&self, i: i64, j: i64) -> Option<f64> {
        [1i64, 2].into_iter().find_map(|r| {
            let around = (-r..=r).flat_map(|dj| (-r..=r).map(move |di| (di, dj)));
            let (sum, n) = around
                .filter_map(|(di, dj)| self.above(i + di, j + dj))
                .fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
            (n >= 2).then(|| sum / n as f64)
        })
    }

    /// The most significant line of pixels through (i, j) that is sharper than stars can make it, if one is so by more
    /// than `sigma`.
    ///
    /// A line of pixels f, one or two rows wide, with neighbours at a distance d on both sides of it:
    /// Σ f − Σ (f₊ + f₋)/r(d) ≤ 0 for every image of the sky.
    fn sharp_line(&self, (i, j): (usize, usize), lengths: &[i64], sigma: f64) -> Option<Vec<(usize, usize)>> {
        let (i, j) = (i as i64, j as i64);
        let noise = self.sky.rms(i as f64, j as f64).powi(2);
        let mut best = self.sharp_pixel((i, j), noise).map(|s| (s, vec![(i, j)])).filter(|b| b.0 > sigma);
        for k in 0..DIRECTIONS {
            let theta = std::f64::consts::PI * k as f64 / DIRECTIONS as f64;
            let (sin, cos) = theta.sin_cos();
            let flat = cos.abs() >= sin.abs();
            let slope = if flat { sin / cos } else { cos / sin };
            // a place `t` along the line and `v` across it
            let at = |t: i64, v: i64| {
                let across = (t as f64 * slope).round() as i64 + v;
                if flat { (i + t, j + across) } else { (i + across, j + t) }
            };
            for (width, ratios) in (1i64..).zip(&self.sharpness.ratios) {
                for (d, ratio) in (1i64..).zip(ratios) {
                    let (mut excess, mut variance, mut line) = (0.0, 0.0, Vec::new());
                    let mut done = 0;
                    for &length in lengths {
                        // the longer line adds pixels at both ends
                        let is_new = |t: &i64| done == 0 || *t < -(done / 2) || *t > (done - 1) / 2;
                        for t in (-(length / 2)..=(length - 1) / 2).filter(is_new) {
                            let value = |v: i64| self.neighbour(at(t, v).0, at(t, v).1);
                            let own = (0..width).try_fold(0.0, |sum, v| {
                                self.above(at(t, v).0, at(t, v).1).map(|value| sum + value)
                            });
                            let (Some(own), Some(one), Some(other)) = (own, value(-d), value(width - 1 + d)) else {
                                continue;
                            };
                            let beside = one + other;
                            excess += own - beside / ratio;
                            variance += width as f64 * noise
                                + beside.max(0.0) / ratio
                                + (2.0 * noise + beside.max(0.0)) / (ratio * ratio);
                            line.extend((0..width).map(|v| at(t, v)));
                        }
                        done = length;
                        let s = excess / f64::sqrt(variance);
                        if s > sigma && best.as_ref().is_none_or(|b| s > b.0) {
                            best = Some((s, line.clone()));
                        }
                    }
                }
            }
        }
        let (_, line) = best?;
        // of the line, what is light at all
        let light = |&(x, y): &(i64, i64)| self.above(x, y).is_some_and(|v| v > noise.sqrt());
        Some(line.into_iter().filter(light).map(|(x, y)| (x as usize, y as usize)).collect())
    }

    /// By how many σ a pixel exceeds what its eight neighbours allow.
    fn sharp_pixel(&self, (i, j): (i64, i64), noise: f64) -> Option<f64> {
        let own = self.above(i, j)?;
        let (mut sum, mut good) = (0.0, 0.0);
        for (dx, dy) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
            if let (Some(one), Some(other)) = (self.neighbour(i + dx, j + dy), self.neighbour(i - dx, j - dy)) {
                sum += one + other;
                good += 2.0;
            }
        }
        if good < 8.0 {
            return None;
        }
        let m = self.sharpness.around;
        let expected = (sum / good).max(0.0) / m;
        let variance = (noise + expected) * (1.0 + 1.0 / (good * m * m));
        Some((own - expected) / variance.sqrt())
    }
}

/// Where a cutout has hits; NaN pixels are bad.
///
/// Every pixel that stands out of the sky is held against its eight neighbours, and the short lines through it against
/// the pixels on both sides; once more with the hits masked, until no more are found.
pub(crate) fn hits(pixels: &Array2<f32>, sky: &Surface, sharpness: &Sharpness) -> Array2<bool> {
    let (ny, nx) = pixels.dim();
    let mut hits = Array2::from_elem((ny, nx), false);
    let mut level = vec![0f32; nx];
    let mut bright = Vec::new();
    for j in 0..ny {
        sky.row(j, &mut level);
        let least = (0.8 * HIT_SIGMA * sky.rms(0.5 * nx as f64, j as f64)) as f32;
        let row = pixels.row(j);
        bright.extend((0..nx).filter(|&i| row[i] - level[i] > least).map(|i| (i, j)));
    }
    for _ in 0..ROUNDS {
        let seen = Seen { pixels, sky, sharpness, hits: &hits };
        let found: Vec<(usize, usize)> =
            bright.iter().filter_map(|&at| seen.sharp_line(at, &LENGTHS[..SHORT_LENGTHS], HIT_SIGMA)).flatten().collect();
        if found.is_empty() {
            break;
        }
        found.into_iter().for_each(|(i, j)| hits[[j, i]] = true);
        bright.retain(|&(i, j)| !hits[[j, i]]);
    }
    hits
}

/// The hits among the brightest of these pixels of what may be the target, by more sensitive tests.
pub(crate) fn hits_among(seen: &Seen, mut pixels: Vec<(usize, usize)>) -> Vec<(usize, usize)> {
    let (ny, nx) = seen.hits.dim();
    let beside_a_hit = pixels.iter().any(|&(i, j)| {
        (j.saturating_sub(1)..(j + 2).min(ny)).any(|y| (i.saturating_sub(1)..(i + 2).min(nx)).any(|x| seen.hits[[y, x]]))
    });
    let above = |at: &(usize, usize)| seen.above(at.0 as i64, at.1 as i64).unwrap_or(f64::NEG_INFINITY);
    let stands_out = |at: &(usize, usize)| above(at) > 1.5 * seen.sky.rms(at.0 as f64, at.1 as f64);
    pixels.retain(stands_out);
    pixels.sort_by(|p, q| above(q).total_cmp(&above(p)).then(p.cmp(q)));
    pixels.truncate(BRIGHTEST);
    let sigma = if beside_a_hit { BESIDE_SIGMA } else { CANDIDATE_SIGMA };
    let mut found: Vec<(usize, usize)> =
        pixels.into_iter().filter_map(|at| seen.sharp_line(at, &LENGTHS, sigma)).flatten().collect();
    found.sort_unstable_by_key(|(i, j)| (*j, *i));
    found.dedup();
    found
}
