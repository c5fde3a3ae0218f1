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
/// Where two neighbours of a star's pixel hold less than this much of it, a star is hardly wider than a pixel.
const UNDERSAMPLED_RATIO: f64 = 1.0;
/// A line this near the middle of a pixel is centred on it [px].
const CENTRED_PX: f64 = 0.25;
/// Threshold for lines of centred rows, of which there are many \[σ\].
const CENTRED_SIGMA: f64 = 4.0;
/// Directions of lines: a half turn in as many steps.
const DIRECTIONS: usize = 16;
/// Lengths of lines that are tried for the brightest pixels of a candidate \[px\].
const LENGTHS: [i64; 7] = [1, 2, 3, 5, 9, 17, 33];
/// Lengths that are tried everywhere in a cutout \[px\].
const SHORT_LENGTHS: usize = 4;
/// Farthest neighbours a line is compared with \[px\].
const FARTHEST_PX: i64 = 4;
/// So many of the lengths have a bound of their own.
const BOUNDED: usize = 5;
/// Lines of this length or more are bounded at their ends, too [px].
const LONG_PX: i64 = 5;
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
/// Any image is a sum of point sources seen through the point-spread function. Of one star the pixels at a distance d on
/// both sides of a line of pixels hold at least r(d) times what the line itself holds, wherever the star is; what holds
/// for each star holds for their sum. r is the least ratio over all places of the star, of pixels that integrate the
/// sharpest Gaussian there may be, 0.75 to 0.85 FWHM wide.
#[derive(Debug, Clone)]
pub(crate) struct Sharpness {
    /// By angle from the nearest axis, width and length of the line; one entry per distance d = 1, 2, … px.
    ratios: Vec<[[Vec<f64>; BOUNDED]; WIDTHS]>,
    /// The least mean of the eight neighbours over a pixel.
    around: f64,
}

/// The places beyond both ends of a line that count as beside it, from this length on: so a star beyond the end, of which
/// the line holds a wing, is none of its own.
fn ends(length: i64) -> Option<[i64; 2]> {
    (length >= LONG_PX).then_some([-(length / 2) - 1, (length - 1) / 2 + 1])
}

/// Steps of the place of a star over a pixel.
const SUBPIXELS: i64 = 4;
/// A star farther from a pixel leaves nothing there [px].
const STAR_REACH_PX: i64 = 24;

impl Sharpness {
    /// Of stars of this FWHM \[px\].
    pub fn of(fwhm_px: f64) -> Self {
        let undersampled = (2.0 - 0.5 * fwhm_px).clamp(0.0, 1.0);
        let sharpest = SHARPEST + (SHARPEST_UNDERSAMPLED - SHARPEST) * undersampled;
        let root = sharpest * fwhm_px / FWHM_PER_SIGMA * std::f64::consts::SQRT_2;
        let table: Vec<f64> = (0..=STAR_REACH_PX * SUBPIXELS)
            .map(|k| k as f64 / SUBPIXELS as f64)
            .map(|at| 0.5 * (erf((at + 0.5) / root) - erf((at - 0.5) / root)))
            .collect();
        // of a pixel at a distance in steps
        let share = |steps: i64| table.get(steps.unsigned_abs() as usize).copied().unwrap_or(0.0);
        let ratio = |slope: f64, width: i64, length: i64, d: i64| -> f64 {
            let line: Vec<(i64, i64)> =
                (-(length / 2)..=(length - 1) / 2).map(|t| (t, (t as f64 * slope).round() as i64)).collect();
            let mut least = f64::INFINITY;
            for x in SUBPIXELS * (-(length / 2) - 2)..=SUBPIXELS * ((length - 1) / 2 + 2) {
                let across = (x as f64 * slope).round() as i64;
                for y in across - SUBPIXELS..=across + SUBPIXELS * width {
                    let (mut own, mut beside) = (0.0, 0.0);
                    let at = |v: i64| share(SUBPIXELS * v - y);
                    for &(t, v) in &line {
                        let along = share(SUBPIXELS * t - x);
                        own += along * (0..width).map(|k| at(v + k)).sum::<f64>();
                        beside += along * (at(v - d) + at(v + width - 1 + d));
                    }
                    for t in ends(length).into_iter().flatten() {
                        let v = (t as f64 * slope).round() as i64;
                        beside += share(SUBPIXELS * t - x) * (v - d..v + width + d).map(at).sum::<f64>();
                    }
                    // what a star far from the line leaves on it is no test of its shape
                    if own > 0.02 {
                        least = f64::min(least, beside / own);
                    }
                }
            }
            least
        };
        let ratios = (0..=DIRECTIONS / 4)
            .map(|k| {
                let slope = (std::f64::consts::PI * k as f64 / DIRECTIONS as f64).tan();
                [1, 2].map(|width| {
                    std::array::from_fn(|l| {
                        (1..=FARTHEST_PX)
                            .map(|d| ratio(slope, width, LENGTHS[l], d))
                            .take_while(|r| *r > LEAST_RATIO)
                            .collect()
                    })
                })
            })
            .collect();
        let g = share(SUBPIXELS) / share(0);
        Self { ratios, around: 0.5 * (g + g * g) }
    }

    /// What a line of a direction, width and length may at most hold: the entries of `ratios`.
    fn ratios(&self, direction: usize, width: i64, length: usize) -> &[f64] {
        let quarter = DIRECTIONS / 2;
        let angle = (direction % quarter).min(quarter - direction % quarter);
        // a longer line has no other least ratio: that of a star at its end
        &self.ratios[angle][width as usize - 1][length.min(BOUNDED - 1)]
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
            for (width, d) in (1..=WIDTHS as i64).flat_map(|w| (1..=FARTHEST_PX).map(move |d| (w, d))) {
                let (mut own, mut beside, mut n, mut line) = (0.0, 0.0, 0.0, Vec::new());
                let mut done = 0;
                for (l, &length) in lengths.iter().enumerate() {
                    let Some(ratio) = self.sharpness.ratios(k, width, l).get(d as usize - 1) else { continue };
                    // the longer line adds pixels at both ends
                    let is_new = |t: &i64| done == 0 || *t < -(done / 2) || *t > (done - 1) / 2;
                    for t in (-(length / 2)..=(length - 1) / 2).filter(is_new) {
                        let value = |v: i64| self.neighbour(at(t, v).0, at(t, v).1);
                        let light = (0..width)
                            .try_fold(0.0, |sum, v| self.above(at(t, v).0, at(t, v).1).map(|value| sum + value));
                        let (Some(light), Some(one), Some(other)) = (light, value(-d), value(width - 1 + d)) else {
                            continue;
                        };
                        (own, beside, n) = (own + light, beside + one + other, n + 1.0);
                        line.extend((0..width).map(|v| at(t, v)));
                    }
                    done = length;
                    let (mut around, mut pixels) = (beside, 2.0 * n);
                    for t in ends(length).into_iter().flatten() {
                        for v in -d..width + d {
                            let (x, y) = at(t, v);
                            if let Some(value) = self.neighbour(x, y) {
                                (around, pixels) = (around + value, pixels + 1.0);
                            }
                        }
                    }
                    let allowed = around.max(0.0) / ratio;
                    let variance =
                        noise * (n * width as f64 + pixels / (ratio * ratio)) + allowed * (1.0 + 1.0 / ratio);
                    let s = (own - around / ratio) / f64::sqrt(variance);
                    if s > sigma && best.as_ref().is_none_or(|b| s > b.0) {
                        best = Some((s, line.clone()));
                    }
                }
            }
        }
        let (_, line) = best?;
        // of the line, what is light at all
        let light = |&(x, y): &(i64, i64)| self.above(x, y).is_some_and(|v| v > noise.sqrt());
        Some(line.into_iter().filter(light).map(|(x, y)| (x as usize, y as usize)).collect())
    }

    /// As [`Self::sharp_line`] where a star is hardly wider than a pixel: of a straight line through the pixel only those
    /// rows that it crosses near the middle of a pixel, for between two pixels a track looks as a star does.
    fn sharp_where_centred(&self, (i, j): (usize, usize), sigma: f64) -> Option<Vec<(usize, usize)>> {
        let ratio = *self.sharpness.ratios(0, 1, 0).first().filter(|r| **r < UNDERSAMPLED_RATIO)?;
        let (i, j) = (i as i64, j as i64);
        let noise = self.sky.rms(i as f64, j as f64).powi(2);
        let mut best: Option<(f64, Vec<(i64, i64)>)> = None;
        for k in 0..2 * DIRECTIONS {
            let theta = std::f64::consts::PI * k as f64 / (2 * DIRECTIONS) as f64;
            let (sin, cos) = theta.sin_cos();
            let flat = cos.abs() >= sin.abs();
            let slope = if flat { sin / cos } else { cos / sin };
            for offset in [-0.25, 0.0, 0.25] {
                let (mut own, mut beside, mut n, mut line, mut done) = (0.0, 0.0, 0.0, Vec::new(), 0);
                for &length in &LENGTHS[3..] {
                    let is_new = |t: &i64| done == 0 || *t < -(done / 2) || *t > (done - 1) / 2;
                    for t in (-(length / 2)..=(length - 1) / 2).filter(is_new) {
                        let exact = t as f64 * slope + offset;
                        let across = exact.round() as i64;
                        let at = |v: i64| if flat { (i + t, j + across + v) } else { (i + across + v, j + t) };
                        // where it lies between two pixels both are of the line, and neither is counted
                        line.push(at(0));
                        if (exact - across as f64).abs() > CENTRED_PX {
                            line.push(at(if exact > across as f64 { 1 } else { -1 }));
                            continue;
                        }
                        let value = |v: i64| self.neighbour(at(v).0, at(v).1);
                        let (Some(light), Some(one), Some(other)) = (self.above(at(0).0, at(0).1), value(-1), value(1))
                        else {
                            continue;
                        };
                        (own, beside, n) = (own + light, beside + one + other, n + 1.0);
                    }
                    done = length;
                    let allowed = beside.max(0.0) / ratio;
                    let variance = n * noise * (1.0 + 2.0 / (ratio * ratio)) + allowed * (1.0 + 1.0 / ratio);
                    let s = (own - beside / ratio) / f64::sqrt(variance);
                    if s > sigma && best.as_ref().is_none_or(|b| s > b.0) {
                        best = Some((s, line.clone()));
                    }
                }
            }
        }
        let (_, line) = best?;
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
        let found: Vec<(usize, usize)> = bright
            .iter()
            .filter_map(|&at| seen.sharp_line(at, &LENGTHS[..SHORT_LENGTHS], HIT_SIGMA))
            .flatten()
            .collect();
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
        (j.saturating_sub(1)..(j + 2).min(ny))
            .any(|y| (i.saturating_sub(1)..(i + 2).min(nx)).any(|x| seen.hits[[y, x]]))
    });
    let above = |at: &(usize, usize)| seen.above(at.0 as i64, at.1 as i64).unwrap_or(f64::NEG_INFINITY);
    let stands_out = |at: &(usize, usize)| above(at) > 1.5 * seen.sky.rms(at.0 as f64, at.1 as f64);
    pixels.retain(stands_out);
    pixels.sort_by(|p, q| above(q).total_cmp(&above(p)).then(p.cmp(q)));
    pixels.truncate(BRIGHTEST);
    let sigma = if beside_a_hit { BESIDE_SIGMA } else { CANDIDATE_SIGMA };
    let sharp = |at: (usize, usize)| {
        seen.sharp_line(at, &LENGTHS, sigma).or_else(|| seen.sharp_where_centred(at, sigma.max(CENTRED_SIGMA)))
    };
    let mut found: Vec<(usize, usize)> = pixels.into_iter().filter_map(sharp).flatten().collect();
    found.sort_unstable_by_key(|(i, j)| (*j, *i));
    found.dedup();
    found
}
