//! Cosmic-ray hits and hot pixels: pixels, and lines of pixels, that are sharper than any image of the sky can be.
//!
//! Electrons. The search does without them; the flux keeps them and is flagged: under a resolved target the true value is
//! not known to better than the flux's error. Not recognised: hits that are as wide as a star.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

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
/// Half the longest, with a pixel beyond its end \[px\].
const HALF_LONGEST: usize = 17;
/// Lengths that are tried everywhere in a cutout \[px\].
const SHORT_LENGTHS: usize = 4;
/// Farthest neighbours a line is compared with \[px\].
const FARTHEST_PX: i64 = 4;
/// So many of the lengths have a bound of their own.
const BOUNDED: usize = 5;
/// Lines of this length or more are bounded at their ends, too [px].
const LONG_PX: i64 = 5;
/// What the pixels beyond an end count of those on both sides: enough for a star there, little where a track goes on.
const END_WEIGHT: f64 = 0.1;
/// Two neighbours that need not hold more than this share of a star's pixels say nothing about them.
const LEAST_RATIO: f64 = 0.05;
/// Widths of lines \[px\]: light between two rows of pixels fills both.
const WIDTHS: usize = 2;
/// Brightest pixels of a candidate that are examined.
const BRIGHTEST: usize = 48;
/// What the row of a line must show by itself for the line to be looked at \[σ\].
const PIVOT_SIGMA: f64 = 0.5;
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
    /// The largest of them for each width.
    largest: [Vec<f64>; WIDTHS],
    /// The least mean of the eight neighbours over a pixel.
    around: f64,
}

/// The places beyond both ends of a line that count as beside it, from this length on: so a star beyond the end, of which
/// the line holds a wing, is none of its own.
fn ends(length: i64) -> Option<[i64; 2]> {
    (length >= LONG_PX).then_some([-(length / 2) - 1, (length - 1) / 2 + 1])
}

/// Widths of stars whose bounds are kept.
const MOST_KEPT: usize = 16;
/// Steps of the place of a star over a pixel.
const SUBPIXELS: i64 = 4;
/// A star farther from a pixel leaves nothing there [px].
const STAR_REACH_PX: i64 = 24;

impl Sharpness {
    /// Of stars of this FWHM \[px\]; kept, for a night asks for the same few again and again.
    pub fn of(fwhm_px: f64) -> Arc<Self> {
        static KEPT: Mutex<Vec<(u64, Arc<Sharpness>)>> = Mutex::new(Vec::new());
        let key = fwhm_px.to_bits();
        let kept = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = kept().iter().find(|(of, _)| *of == key) {
            return Arc::clone(known);
        }
        let made = Arc::new(Self::made(fwhm_px));
        let mut kept = kept();
        if kept.len() >= MOST_KEPT {
            kept.clear();
        }
        kept.push((key, Arc::clone(&made)));
        made
    }

    fn made(fwhm_px: f64) -> Self {
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
                        beside += END_WEIGHT * share(SUBPIXELS * t - x) * (v - d..v + width + d).map(at).sum::<f64>();
                    }
                    // what a star far from the line leaves on it is no test of its shape
                    if own > 0.02 {
                        least = f64::min(least, beside / own);
                    }
                }
            }
            least
        };
        let ratios: Vec<[[Vec<f64>; BOUNDED]; WIDTHS]> = (0..=DIRECTIONS / 4)
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
        let largest = std::array::from_fn(|w| {
            let all = || ratios.iter().flat_map(|of: &[[Vec<f64>; BOUNDED]; WIDTHS]| of[w].iter());
            let most = all().map(Vec::len).max().unwrap_or(0);
            (0..most).map(|d| all().filter_map(|r| r.get(d)).copied().fold(0.0, f64::max)).collect()
        });
        Self { ratios, largest, around: 0.5 * (g + g * g) }
    }

    /// The largest ratios of a width over all directions and lengths, by distance.
    fn largest_ratios(&self, width: i64) -> &[f64] {
        &self.largest[width as usize - 1]
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

    /// A part of it, for many looks at the same pixels.
    fn patch(&self, columns: Range<usize>, rows: Range<usize>) -> Patch<'_> {
        let size = columns.len() * rows.len();
        let (mut own, mut beside) = (Vec::with_capacity(size), Vec::with_capacity(size));
        let mut level = vec![0f32; columns.end];
        for j in rows.clone() {
            self.sky.row(j, &mut level);
            for i in columns.clone() {
                let v = self.pixels[[j, i]] - level[i];
                let hit = self.hits[[j, i]];
                own.push(if hit { f32::NAN } else { v });
                // under a hit, what is around it: the core of a star would lie above that, and yet the next pixel does
                // not need more than that to be part of a star
                let filled = || self.filled(i as i64, j as i64).map_or(f32::NAN, |v| v as f32);
                beside.push(if hit { filled() } else { v });
            }
        }
        Patch { x0: columns.start, y0: rows.start, nx: columns.len(), own, beside, sharpness: self.sharpness }
    }
}

/// Pixels above the sky, row by row; NaN where they are bad.
struct Patch<'a> {
    x0: usize,
    y0: usize,
    nx: usize,
    /// NaN where they are hits, too.
    own: Vec<f32>,
    /// Hits are filled from what is around them.
    beside: Vec<f32>,
    sharpness: &'a Sharpness,
}

impl Patch<'_> {
    fn at(&self, values: &[f32], (i, j): (i64, i64)) -> f64 {
        let (x, y) = (i - self.x0 as i64, j - self.y0 as i64);
        if x < 0 || y < 0 || x >= self.nx as i64 {
            return f64::NAN;
        }
        values.get(y as usize * self.nx + x as usize).map_or(f64::NAN, |v| f64::from(*v))
    }

    /// Whether a line through the pixel can be sharp at all: its own row, one or two pixels wide, must be.
    fn may_be_sharp(&self, (i, j): (i64, i64), noise: f64) -> bool {
        (1..=WIDTHS as i64).any(|width| {
            let largest = self.sharpness.largest_ratios(width);
            [(1, 0), (0, 1)].into_iter().any(|(dx, dy)| {
                let own: f64 = (0..width).map(|v| self.at(&self.own, (i + v * dx, j + v * dy))).sum();
                (1i64..).zip(largest).any(|(d, ratio)| {
                    let value = |v: i64| self.at(&self.beside, (i + v * dx, j + v * dy));
                    let excess = own - (value(-d) + value(width - 1 + d)) / ratio;
                    excess > PIVOT_SIGMA * (noise * (width as f64 + 2.0 / (ratio * ratio))).sqrt()
                })
            })
        })
    }

    /// The most significant line of pixels through a pixel that is sharper than stars can make it, if one is so by more
    /// than `sigma`; `noise` = variance of a pixel of sky.
    ///
    /// A line of pixels f, one or two rows wide, with neighbours at a distance d on both sides of it:
    /// Σ f − Σ (f₊ + f₋)/r(d) ≤ 0 for every image of the sky.
    fn sharp_line(&self, (i, j): (i64, i64), lengths: &[i64], noise: f64, sigma: f64) -> Option<Vec<(i64, i64)>> {
        let mut best = self.sharp_pixel((i, j), noise).map(|s| (s, vec![(i, j)])).filter(|b| b.0 > sigma);
        let mut line = Vec::new();
        for k in 0..DIRECTIONS {
            let (flat, slope) = direction(k, DIRECTIONS);
            // a place `t` along the line and `v` across it
            let across: [i64; 2 * HALF_LONGEST + 1] =
                std::array::from_fn(|t| ((t as f64 - HALF_LONGEST as f64) * slope).round() as i64);
            let at = |t: i64, v: i64| {
                let across = across[(t + HALF_LONGEST as i64) as usize] + v;
                if flat { (i + t, j + across) } else { (i + across, j + t) }
            };
            for (width, d) in (1..=WIDTHS as i64).flat_map(|w| (1..=FARTHEST_PX).map(move |d| (w, d))) {
                let (mut own, mut beside, mut n) = (0.0, 0.0, 0.0);
                let mut done = 0;
                line.clear();
                for (l, &length) in lengths.iter().enumerate() {
                    let Some(ratio) = self.sharpness.ratios(k, width, l).get(d as usize - 1) else { continue };
                    for t in longer(done, length) {
                        let light: f64 = (0..width).map(|v| self.at(&self.own, at(t, v))).sum();
                        let both = self.at(&self.beside, at(t, -d)) + self.at(&self.beside, at(t, width - 1 + d));
                        if light.is_finite() && both.is_finite() {
                            (own, beside, n) = (own + light, beside + both, n + 1.0);
                            line.extend((0..width).map(|v| at(t, v)));
                        }
                    }
                    done = length;
                    let (mut around, mut pixels) = (beside, 2.0 * n);
                    for (t, v) in ends(length).into_iter().flatten().flat_map(|t| (-d..width + d).map(move |v| (t, v)))
                    {
                        let value = self.at(&self.beside, at(t, v));
                        if value.is_finite() {
                            (around, pixels) = (around + END_WEIGHT * value, pixels + END_WEIGHT * END_WEIGHT);
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
        best.map(|b| self.lit(b.1, noise))
    }

    /// As [`Self::sharp_line`] where a star is hardly wider than a pixel: of a straight line through the pixel only those
    /// rows that it crosses near the middle of a pixel, for between two pixels a track looks as a star does.
    fn sharp_where_centred(&self, (i, j): (i64, i64), noise: f64, sigma: f64) -> Option<Vec<(i64, i64)>> {
        let ratio = *self.sharpness.ratios(0, 1, 0).first().filter(|r| **r < UNDERSAMPLED_RATIO)?;
        let mut best: Option<(f64, Vec<(i64, i64)>)> = None;
        let mut line = Vec::new();
        for (k, offset) in (0..2 * DIRECTIONS).flat_map(|k| [-0.25, 0.0, 0.25].map(|offset| (k, offset))) {
            let (flat, slope) = direction(k, 2 * DIRECTIONS);
            let (mut own, mut beside, mut n, mut done) = (0.0, 0.0, 0.0, 0);
            line.clear();
            for &length in &LENGTHS[3..] {
                for t in longer(done, length) {
                    let exact = t as f64 * slope + offset;
                    let across = exact.round() as i64;
                    let at = |v: i64| if flat { (i + t, j + across + v) } else { (i + across + v, j + t) };
                    // where it lies between two pixels both are of the line, and neither is counted
                    line.push(at(0));
                    if (exact - across as f64).abs() > CENTRED_PX {
                        line.push(at(if exact > across as f64 { 1 } else { -1 }));
                        continue;
                    }
                    let light = self.at(&self.own, at(0));
                    let both = self.at(&self.beside, at(-1)) + self.at(&self.beside, at(1));
                    if light.is_finite() && both.is_finite() {
                        (own, beside, n) = (own + light, beside + both, n + 1.0);
                    }
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
        best.map(|b| self.lit(b.1, noise))
    }

    /// By how many σ a pixel exceeds what its eight neighbours allow.
    fn sharp_pixel(&self, (i, j): (i64, i64), noise: f64) -> Option<f64> {
        let own = self.at(&self.own, (i, j));
        let around = [(1, 0), (0, 1), (1, 1), (1, -1), (-1, 0), (0, -1), (-1, -1), (-1, 1)];
        let sum: f64 = around.iter().map(|(dx, dy)| self.at(&self.beside, (i + dx, j + dy))).sum();
        let m = self.sharpness.around;
        let expected = (sum / 8.0).max(0.0) / m;
        let variance = (noise + expected) * (1.0 + 1.0 / (8.0 * m * m));
        Some((own - expected) / variance.sqrt()).filter(|s| s.is_finite() && sum.is_finite())
    }

    /// Of the places of a line those with light at all.
    fn lit(&self, mut line: Vec<(i64, i64)>, noise: f64) -> Vec<(i64, i64)> {
        line.retain(|at| self.at(&self.own, *at) > noise.sqrt());
        line
    }
}

/// Whether a direction is nearer to the rows, and its slope over the axis it is nearer to.
fn direction(k: usize, of: usize) -> (bool, f64) {
    let (sin, cos) = (std::f64::consts::PI * k as f64 / of as f64).sin_cos();
    let flat = cos.abs() >= sin.abs();
    (flat, if flat { sin / cos } else { cos / sin })
}

/// The places that a line of `length` px has beyond one of `done` px.
fn longer(done: i64, length: i64) -> impl Iterator<Item = i64> {
    let inner = if done == 0 { 0..0 } else { -(done / 2)..(done - 1) / 2 + 1 };
    (-(length / 2)..=(length - 1) / 2).filter(move |t| !inner.contains(t))
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
        if bright.is_empty() {
            break;
        }
        let seen = Seen { pixels, sky, sharpness, hits: &hits };
        let patch = seen.patch(0..nx, 0..ny);
        let line = |&(i, j): &(usize, usize)| {
            let at = (i as i64, j as i64);
            let noise = sky.rms(i as f64, j as f64).powi(2);
            patch
                .may_be_sharp(at, noise)
                .then(|| patch.sharp_line(at, &LENGTHS[..SHORT_LENGTHS], noise, HIT_SIGMA))
                .flatten()
        };
        let found: Vec<(i64, i64)> = bright.iter().filter_map(line).flatten().collect();
        if found.is_empty() {
            break;
        }
        found.into_iter().for_each(|(i, j)| hits[[j as usize, i as usize]] = true);
        bright.retain(|&(i, j)| !hits[[j, i]]);
    }
    hits
}

/// The hits among the brightest of these pixels of what may be the target, by more sensitive tests.
pub(crate) fn hits_among(seen: &Seen, pixels: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let (ny, nx) = seen.hits.dim();
    let reach = LENGTHS[LENGTHS.len() - 1] as usize;
    let span = |values: &mut dyn Iterator<Item = usize>, n: usize| {
        let (low, high) = values.fold((n, 0), |(low, high), v| (low.min(v), high.max(v)));
        low.saturating_sub(reach)..(high + reach + 1).min(n)
    };
    let columns = span(&mut pixels.iter().map(|p| p.0), nx);
    let rows = span(&mut pixels.iter().map(|p| p.1), ny);
    if columns.is_empty() || rows.is_empty() {
        return Vec::new();
    }
    let patch = seen.patch(columns, rows);
    let beside_a_hit = pixels.iter().any(|&(i, j)| {
        (j.saturating_sub(1)..(j + 2).min(ny))
            .any(|y| (i.saturating_sub(1)..(i + 2).min(nx)).any(|x| seen.hits[[y, x]]))
    });
    let sigma = if beside_a_hit { BESIDE_SIGMA } else { CANDIDATE_SIGMA };
    let noise = |i: usize, j: usize| seen.sky.rms(i as f64, j as f64).powi(2);
    let mut bright: Vec<(f64, (usize, usize))> = pixels
        .iter()
        .map(|&(i, j)| (patch.at(&patch.own, (i as i64, j as i64)), (i, j)))
        .filter(|&(v, (i, j))| v > 0.0 && v * v > 2.25 * noise(i, j))
        .collect();
    bright.sort_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)));
    bright.truncate(BRIGHTEST);
    let sharp = |(i, j): (usize, usize)| {
        let (at, noise) = ((i as i64, j as i64), noise(i, j));
        if !patch.may_be_sharp(at, noise) {
            return None;
        }
        let centred = || patch.sharp_where_centred(at, noise, sigma.max(CENTRED_SIGMA));
        patch.sharp_line(at, &LENGTHS, noise, sigma).or_else(centred)
    };
    let found = bright.into_iter().filter_map(|(_, at)| sharp(at)).flatten();
    let mut found: Vec<(usize, usize)> = found.map(|(i, j)| (i as usize, j as usize)).collect();
    found.sort_unstable_by_key(|(i, j)| (*j, *i));
    found.dedup();
    found
}
