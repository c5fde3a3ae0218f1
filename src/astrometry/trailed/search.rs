//! The offset at which predicted trails lie on the light of a frame, and whether chance could do as well.
//!
//! Every offset along and across is tried. What a trail should show and what lies along it are compared on a compressed scale,
//! so that one bright star alone decides nothing; the same stars at random places say what chance reaches.

use super::image::TrailImage;
use super::path::{Around, PredictedTrail};
use crate::base::constants::FWHM_PER_SIGMA;

/// Angles further apart than this are looked at with fewer pixels \[rad\].
const WIDE_RAD: f64 = 0.3;
/// Steps of the search along short trails, as a share of their length.
const STEP_OF_LENGTH: f64 = 1.0 / 12.0;
/// Cells count for at most this \[σ\].
const CLIP_SIGMA: f64 = 6.0;
/// S/N beyond which more light says little more.
const COMPRESSED_SNR: f64 = 8.0;
/// Stars that are compared: the brightest.
const MOST_STARS: usize = 30;
/// Fewest stars in the frame.
const LEAST_STARS: usize = 3;
/// Times the stars are put at random places.
const DECOYS: u64 = 4;
/// Pieces before and beyond an end \[FWHM\].
const PIECE_FWHM: f64 = 8.0;
/// Light of a pixel counts for at most this at an end \[σ\].
const MOST_PER_PX: f64 = 3.0;
/// Significance that the ends together must have ...
const LEAST_END_SCORE: f64 = 6.0;
/// ... and by how much more than at any other offset.
const END_MARGIN: f64 = 1.3;
/// Light within the three rows of a line, 1.5 FWHM.
const SHARE: f64 = 0.9;

/// A trail and its light \[e⁻ per px of length\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitTrail {
    /// Where.
    pub trail: PredictedTrail,
    /// Predicted light \[e⁻/px\].
    pub e_per_px: f64,
}

/// An offset of the frame, and how well it fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Along the trails \[px\].
    pub along_px: f64,
    /// Across \[px\].
    pub across_px: f64,
    /// Deviations from the other offsets, in their scatter.
    pub score: f64,
}

/// The direction in which the light lines up, among `around_rad` to each side of `near_rad` \[rad\].
///
/// The largest variance of the means of rows half a FWHM wide.
#[must_use]
pub fn direction(image: &TrailImage, near_rad: f64, around_rad: f64, fwhm_px: f64) -> f64 {
    let (half, row) = (image.half_px(), 0.5 * fwhm_px);
    let rows = (2.0 * half / row) as usize + 2;
    let mut sums = vec![[0f64; 2]; rows];
    // where all angles are looked at, a part of the pixels must do
    let most = if around_rad > WIDE_RAD { 100_000 } else { 400_000 };
    let stride = image.pixels.len().div_ceil(most).max(1) | 1;
    let of = |p: &super::image::Pixel| {
        let sigmas = f64::from(p.net / p.variance.sqrt()).clamp(-CLIP_SIGMA, CLIP_SIGMA);
        [f64::from(p.x) / row, f64::from(p.y) / row, sigmas]
    };
    let values: Vec<[f64; 3]> = image.pixels.iter().step_by(stride).map(of).collect();
    let half_rows = half / row;
    let mut score = |theta: f64| {
        let (sin, cos) = theta.sin_cos();
        sums.fill([0.0; 2]);
        for [x, y, sigmas] in &values {
            let sum = &mut sums[(y * cos - x * sin + half_rows) as usize];
            sum[0] += sigmas;
            sum[1] += 1.0;
        }
        sums.iter().filter(|s| s[1] > 0.0).map(|s| s[0] * s[0] / s[1]).sum::<f64>()
    };
    let mut best = near_rad;
    let mut span = around_rad;
    let mut step = (0.5 * fwhm_px / half).min(around_rad.max(1e-6));
    for _ in 0..2 {
        let n = (span / step).ceil() as i32;
        let scores: Vec<(f64, f64)> = (-n..=n)
            .map(|k| {
                let theta = best + f64::from(k) * step;
                (score(theta), theta)
            })
            .collect();
        best = scores.iter().fold((f64::NEG_INFINITY, best), |b, s| if s.0 > b.0 { *s } else { b }).1;
        (span, step) = (step, 0.2 * step);
    }
    best
}

/// FWHM of the stars by the trails along `theta_rad`, by how the means of rows one pixel wide resemble those next to them \[px\];
/// `None` where they do not.
///
/// The means of rows are the line-spread function of many trails: their autocovariance is that of a Gaussian of √2 σ, and
/// σ² = 3 / (4 ln(A₁/A₂)) with its values at one and two rows, which hold no noise.
#[must_use]
pub fn width(image: &TrailImage, theta_rad: f64) -> Option<f64> {
    let half = image.half_px();
    let mut rows = vec![[0f64; 2]; (2.0 * half) as usize + 2];
    let (sin, cos) = theta_rad.sin_cos();
    for p in &image.pixels {
        let row = &mut rows[(f64::from(p.y) * cos - f64::from(p.x) * sin + half) as usize];
        row[0] += f64::from(p.net);
        row[1] += 1.0;
    }
    let fullest = rows.iter().map(|r| r[1]).fold(0.0, f64::max);
    let long: Vec<f64> = rows.iter().filter(|r| r[1] > 0.3 * fullest).map(|r| r[0] / r[1]).collect();
    let mean = long.iter().sum::<f64>() / long.len().max(1) as f64;
    let resemblance =
        |lag: usize| long.iter().zip(long.get(lag..)?).map(|(a, b)| (a - mean) * (b - mean)).reduce(|a, b| a + b);
    let (one, two) = (resemblance(1)?, resemblance(2)?);
    let fwhm_px = FWHM_PER_SIGMA * (0.75 / (one / two).ln()).sqrt();
    (two > 0.0 && one > two && fwhm_px.is_finite()).then_some(fwhm_px)
}

/// Sums along rows of cells, so that a line of any length costs two looks.
struct Rows {
    half: f64,
    du: f64,
    dv: f64,
    nu: usize,
    nv: usize,
    /// Sum \[σ\] and number of pixels up to each cell.
    up_to: Vec<[f32; 2]>,
}

impl Rows {
    fn new(image: &TrailImage, theta: f64, fwhm_px: f64) -> Self {
        let half = image.half_px() + 1.0;
        let (du, dv) = (fwhm_px, 0.5 * fwhm_px);
        let (nu, nv) = ((2.0 * half / du) as usize + 2, (2.0 * half / dv) as usize + 2);
        let mut up_to = vec![[0f32; 2]; (nu + 1) * nv];
        let (sin, cos) = theta.sin_cos();
        for p in &image.pixels {
            let (x, y) = (f64::from(p.x), f64::from(p.y));
            let (u, v) = (x * cos + y * sin, y * cos - x * sin);
            let (k, q) = (((u + half) / du) as usize, ((v + half) / dv) as usize);
            let cell = &mut up_to[q * (nu + 1) + k + 1];
            cell[0] += (p.net / p.variance.sqrt()).clamp(-CLIP_SIGMA as f32, CLIP_SIGMA as f32);
            cell[1] += 1.0;
        }
        for row in up_to.chunks_mut(nu + 1) {
            for k in 1..=nu {
                row[k][0] += row[k - 1][0];
                row[k][1] += row[k - 1][1];
            }
        }
        Self { half, du, dv, nu, nv, up_to }
    }

    /// Sum \[σ\] and number of pixels within 0.75 FWHM of v, from u to u.
    fn line(&self, from: f64, to: f64, v: f64) -> (f64, f64) {
        let cell = |u: f64| ((u + self.half) / self.du).round().clamp(0.0, self.nu as f64) as usize;
        let (a, b) = (cell(from), cell(to));
        let q = ((v + self.half) / self.dv).floor();
        if !(q >= 1.0 && q + 1.0 < self.nv as f64) || b <= a {
            return (0.0, 0.0);
        }
        let q = q as usize;
        let (mut sum, mut n) = (0.0, 0.0);
        for row in q - 1..=q + 1 {
            let row = &self.up_to[row * (self.nu + 1)..];
            sum += row[b][0] - row[a][0];
            n += row[b][1] - row[a][1];
        }
        (f64::from(sum), f64::from(n))
    }
}

fn compressed(x: f64) -> f64 {
    x / (1.0 + x.abs() / COMPRESSED_SNR)
}

/// The best offset of the trails, and the best that the same stars at random places reach.
///
/// `trails` lie along `theta_rad` about the expected place; `None` where fewer than three can be in the frame.
#[must_use]
pub fn best_offset(
    image: &TrailImage,
    theta_rad: f64,
    trails: &[LitTrail],
    around: Around,
    fwhm_px: f64,
) -> Option<(Found, f64)> {
    let rows = Rows::new(image, theta_rad, fwhm_px);
    let mut bright: Vec<LitTrail> = trails.to_vec();
    bright.sort_by(|a, b| b.e_per_px.total_cmp(&a.e_per_px).then(a.trail.star.cmp(&b.trail.star)));
    // along a long path most trails are elsewhere: as many for each length of the frame
    let length = bright.iter().map(|t| t.trail.end_px - t.trail.start_px).fold(0.0, f64::max);
    let share = 1.0 + (length + 2.0 * around.along_px) / (2.0 * around.half_px);
    bright.truncate((MOST_STARS as f64 * share.min(8.0)) as usize);
    let step = (STEP_OF_LENGTH * length).min(around.half_px / 4.0).max(fwhm_px);
    let found = search(&rows, image, &bright, around, fwhm_px, step)?;
    let chance = (1..=DECOYS)
        .filter_map(|seed| search(&rows, image, &scattered(&bright, around, seed), around, fwhm_px, step))
        .map(|f| f.score)
        .fold(0.0, f64::max);
    Some((found, chance))
}

/// The offset along the trails at which their ends lie, near one that was found; `None` where the ends do not say.
///
/// At each end the light of a short piece before it less that of one beyond it: other trails of the same line go on and cancel.
#[must_use]
pub fn at_ends(
    image: &TrailImage,
    theta_rad: f64,
    trails: &[LitTrail],
    near: Found,
    along_px: f64,
    fwhm_px: f64,
) -> Option<f64> {
    let rows = Rows::new(image, theta_rad, fwhm_px);
    let per_sigma = SHARE / (1.5 * fwhm_px * image.sigma_e);
    let score = |a: f64| {
        let (mut together, mut norm) = (0.0, 0.0);
        for lit in trails {
            let t = &lit.trail;
            let piece = (PIECE_FWHM * fwhm_px).min(0.5 * (t.end_px - t.start_px));
            for (end, way) in [(t.start_px, 1.0), (t.end_px, -1.0)] {
                let v = t.v_px(end) + near.across_px;
                let mean = |from: f64, to: f64| {
                    let (sum, n) = rows.line((end + a + from).min(end + a + to), (end + a + from).max(end + a + to), v);
                    (sum / n, n)
                };
                let gap = 0.5 * fwhm_px;
                let ((before, n), (beyond, m)) = (mean(way * gap, way * piece), mean(-way * gap, -way * piece));
                if n < 6.0 || m < 6.0 {
                    continue;
                }
                let wanted = (lit.e_per_px * per_sigma).min(MOST_PER_PX);
                let variance = 1.0 / n + 1.0 / m;
                together += wanted * (before - beyond) / variance;
                norm += wanted * wanted / variance;
            }
        }
        if norm > 0.0 { together / norm.sqrt() } else { 0.0 }
    };
    let n = (along_px / (0.5 * fwhm_px)).ceil() as i32;
    let scores: Vec<(f64, f64)> = (-n..=n)
        .map(|k| {
            let a = near.along_px + f64::from(k) * 0.5 * fwhm_px;
            (a, score(a))
        })
        .collect();
    let best = scores.iter().copied().fold((0.0, f64::NEG_INFINITY), |b, s| if s.1 > b.1 { s } else { b });
    let apart = |s: &&(f64, f64)| (s.0 - best.0).abs() > PIECE_FWHM * fwhm_px;
    let second = scores.iter().filter(apart).map(|s| s.1).fold(0.0, f64::max);
    (best.1 > LEAST_END_SCORE && best.1 > END_MARGIN * second).then_some(best.0)
}

/// The same trails at random places of the region that is looked at.
fn scattered(trails: &[LitTrail], around: Around, seed: u64) -> Vec<LitTrail> {
    let mut state = seed;
    // SplitMix64 (Steele et al. 2014)
    let mut random = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let one = |lit: &LitTrail| {
        let half = 0.5 * (lit.trail.end_px - lit.trail.start_px);
        let middle = random() * (half + around.half_px + around.along_px);
        let v = random() * (around.half_px + around.across_px);
        let across = [v, lit.trail.across[1], lit.trail.across[2]];
        let trail = PredictedTrail { start_px: middle - half, end_px: middle + half, across, ..lit.trail };
        LitTrail { trail, ..*lit }
    };
    trails.iter().map(one).collect()
}

fn search(
    rows: &Rows,
    image: &TrailImage,
    trails: &[LitTrail],
    around: Around,
    fwhm_px: f64,
    step_u: f64,
) -> Option<Found> {
    let half = around.half_px;
    let (nu, nv) = ((around.along_px / step_u).ceil() as i32, (around.across_px / rows.dv).ceil() as i32);
    let per_sigma = SHARE / (1.5 * fwhm_px * image.sigma_e);
    let mut best: Option<Found> = None;
    let mut raw = Vec::with_capacity(2 * nv as usize + 1);
    for k in -nu..=nu {
        let a = f64::from(k) * step_u;
        let inside: Vec<(f64, f64, f64, f64)> = trails
            .iter()
            .filter_map(|lit| {
                let (from, to) = ((lit.trail.start_px + a).max(-half), (lit.trail.end_px + a).min(half));
                (to - from > fwhm_px).then(|| {
                    // the middle of what is in the frame
                    let middle = 0.5 * (from + to);
                    (from, to, lit.trail.v_px(middle - a), lit.e_per_px * per_sigma)
                })
            })
            .collect();
        if inside.len() < LEAST_STARS {
            continue;
        }
        raw.clear();
        for l in -nv..=nv {
            let b = f64::from(l) * rows.dv;
            let (mut together, mut norm, mut n_stars) = (0.0, 0.0, 0);
            for (from, to, v, per_px) in &inside {
                let (sum, n) = rows.line(*from, *to, v + b);
                if n < 6.0 {
                    continue;
                }
                let root = n.sqrt();
                let (seen, wanted) = (compressed(sum / root), compressed(per_px * root));
                together += seen * wanted;
                norm += wanted * wanted;
                n_stars += 1;
            }
            let value = if n_stars >= LEAST_STARS && norm > 0.0 { together / norm.sqrt() } else { f64::NAN };
            raw.push((b, value));
        }
        let mut known: Vec<f64> = raw.iter().map(|r| r.1).filter(|v| v.is_finite()).collect();
        let (Some(middle), Some(scatter)) =
            (crate::base::stats::median(&mut known.clone()), crate::base::stats::mad_sigma(&mut known))
        else {
            continue;
        };
        for (b, value) in &raw {
            let score = (value - middle) / scatter.max(1.0);
            if score.is_finite() && best.is_none_or(|f| score > f.score) {
                best = Some(Found { along_px: a, across_px: *b, score });
            }
        }
    }
    best
}
