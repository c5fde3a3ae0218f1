//! Cosmic rays and hot pixels: pixels that stand out more sharply than any image of the sky can.
//!
//! Electrons. The search does without them, the flux keeps them and is flagged: under a resolved target the true value is
//! not known to better than the flux's error. It does not cover hits as wide as a star.

use std::f64::consts::SQRT_2;

use ndarray::Array2;
use statrs::function::erf::erf;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::stats;
use crate::photometry::target::cells::row_of;
use crate::photometry::target::line_sums::{Columns, KINDS, LANES, LEAST_SHARE, Sums, any_above};
use crate::photometry::target::sky::Surface;

/// By so much a hit exceeds what its neighbours allow, and a hot or dead pixel its sky \[σ\]: of 30 000 pixels of noise none does in a thousand
/// frames.
pub(crate) const PIXEL_SIGMA: f64 = 6.0;
/// A star of a short exposure in good seeing has at least this share of the FWHM of the night's pointings ...
const SHARPEST_SHARE: f64 = 0.65;
/// ... or, where that is hardly more than the width of a hit, this share ...
const SHARPEST_IN_LINES: f64 = 0.8;
/// ... (next to single pixels, this) ...
const SHARPEST_OF_PIXELS: f64 = 0.75;
/// ... and in between this FWHM, which no hit has \[px\].
const CLEAR_OF_HITS_PX: f64 = 1.6;

/// FWHM of the sharpest star in a frame of a night whose stars have the given one \[px\]; what is sharper is a hit.
pub(crate) fn sharpest_fwhm_px(fwhm_px: f64) -> f64 {
    CLEAR_OF_HITS_PX.clamp(SHARPEST_SHARE * fwhm_px, SHARPEST_IN_LINES * fwhm_px)
}

/// Columns and rows of the hits in a cutout; NaN pixels are bad.
///
/// Any image is the sum of point sources seen through the point-spread function, so the mean of the eight neighbours of a
/// pixel is at least m times the pixel, m = (e^(−1/2s²) + e^(−1/s²))/2 being that of a star centred on it,
/// s² = (FWHM/2.355)² + 1/12 of the sharpest star. A hit exceeds `neighbours/m` by 6 σ, σ² being the variance its neighbours expect.
pub(crate) fn hits(pixels: &Array2<f32>, sky: &Surface, fwhm_px: f64) -> Vec<(usize, usize)> {
    let (ny, nx) = pixels.dim();
    let mut found = Vec::new();
    if ny < 3 || nx < 3 {
        return found;
    }
    let sharpest = sharpest_fwhm_px(fwhm_px).min(SHARPEST_OF_PIXELS * fwhm_px);
    let s2 = (sharpest / FWHM_PER_SIGMA).powi(2) + 1.0 / 12.0;
    let m = 0.5 * ((-0.5 / s2).exp() + (-1.0 / s2).exp());
    let mut level = vec![0f32; nx];
    for j in 1..ny - 1 {
        sky.row(j, &mut level);
        let rms = sky.rms(0.5 * nx as f64, j as f64);
        let least = (0.8 * PIXEL_SIGMA * rms) as f32;
        let [below, own, above] = [j - 1, j, j + 1].map(|row| pixels.row(row));
        for i in 1..nx - 1 {
            // most pixels are not hits and need no second test
            if !(own[i] - level[i] > least) {
                continue;
            }
            let around =
                [below[i - 1], below[i], below[i + 1], own[i - 1], own[i + 1], above[i - 1], above[i], above[i + 1]];
            let good = around.iter().filter(|v| v.is_finite()).count();
            if good < 5 {
                continue;
            }
            let sum: f64 = around.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).sum();
            let expected = (sum / good as f64 - f64::from(level[i])).max(0.0) / m;
            let variance = (sky.rms(i as f64, j as f64).powi(2) + expected) * (1.0 + 1.0 / (good as f64 * m * m));
            if f64::from(own[i] - level[i]) - expected > PIXEL_SIGMA * variance.sqrt() {
                found.push((i, j));
            }
        }
    }
    found
}

/// σ of the charge of a hit across its track \[px\], before it is collected in pixels.
const DIFFUSION_PX: f64 = 0.25;
/// Below this FWHM \[px\] a star is as sharp as a hit.
pub(crate) const SHARPEST_PX: f64 = 1.3;
/// A star is known to this share of its light; that does not make it a hit.
pub(crate) const DOUBT_OF_PSF: f64 = 0.02;
/// By so many σ at most a line may be the more significant for what is sharper than the star of the night: of a faint line
/// good seeing explains no more.
const OF_NIGHT_SIGMA: f32 = 2.0;
/// Lengths of the lines \[px\], and what a hit must exceed there \[σ\].
const LENGTHS: [(usize, f64); 7] = [(2, 5.3), (3, 5.3), (5, 5.3), (9, 5.2), (17, 5.2), (33, 5.1), (65, 5.1)];
/// Classes of the slope of a line, which widens its cut along columns.
const CLASSES: usize = 4;
/// Steps of the place of a line to a pixel.
const PHASES: usize = 3;
/// Longest line that decides how many directions there are \[px\].
const DIRECTIONS_PX: usize = 33;
/// So many lines of one candidate are masked at once.
const MOST_LINES: usize = 12;
/// Lines of this length have a direction in which they may go on \[px\].
const LEAST_PROLONGED_PX: f64 = 4.0;
/// A line goes on by so many pixels at a time.
const PROLONGED_PX: i32 = 3;
/// As long as they hold light of so many σ.
const PROLONGED_SIGMA: f64 = 3.0;
/// Pixels this near to a hit hold its charge, too \[px\].
const HIT_REACH_PX: f64 = 1.5;

/// What is seen about a candidate: pixels above sky and trails and their variance; NaN where there is nothing to see.
pub(crate) struct Patch {
    pub above: Array2<f32>,
    pub variance: Array2<f32>,
}

/// Pixels beyond a patch that its lines need.
pub(crate) fn margin_px(fwhm_px: f64) -> usize {
    reach(fwhm_px / FWHM_PER_SIGMA * 2f64.sqrt()) as usize + 2
}

fn reach(sigma: f64) -> isize {
    (2.5 * sigma + 0.5).ceil() as isize
}

impl Patch {
    /// Masks the lines of a candidate that are hits; columns and rows of the pixels masked.
    ///
    /// A hit's charge has passed no optics: it is a line of σ ≈ 0.25 px across, however faint. An image of the sky is
    /// nowhere narrower than a star. Across a line of any place, angle and length the filter is w = t − c P: t the
    /// profile of a hit, P that of a star, c = ⟨t, Q⟩/⟨P, Q⟩ with Q the sharpest star ([`sharpest_fwhm_px`]). Then ⟨w, Q⟩ = 0 for a
    /// star on the line, < 0 next to it and for everything wider: only noise makes Σ w I positive, no image of the sky.
    /// With Q as wide as the star of the night a line gains at most 2 σ more.
    pub fn mask_hits(&mut self, fwhm_px: f64) -> Vec<(usize, usize)> {
        let mut masked = Vec::new();
        if fwhm_px < SHARPEST_PX {
            return masked;
        }
        let star = fwhm_px / FWHM_PER_SIGMA;
        for _ in 0..MOST_LINES {
            let Some(mut best) = self.sharpest_line(star) else { break };
            masked.extend(self.mask_line(&mut best));
        }
        masked
    }

    /// Masks a line and what continues it; columns and rows of the pixels masked.
    pub fn mask_line(&mut self, line: &mut Line) -> Vec<(usize, usize)> {
        let mut masked = Vec::new();
        self.prolong(line);
        for ((j, i), above) in self.above.indexed_iter_mut() {
            if above.is_finite() && line.distance(i as f64, j as f64) <= HIT_REACH_PX {
                *above = f32::NAN;
                masked.push((i, j));
            }
        }
        masked
    }

    /// The line that is most certainly sharper than a star.
    fn sharpest_line(&self, star: f64) -> Option<Line> {
        let mut best = Line { excess: 1.0, ..Line::default() };
        self.best_line(star, &mut best);
        let turned = Self { above: transposed(&self.above), variance: transposed(&self.variance) };
        let mut other = Line { excess: best.excess, ..Line::default() };
        turned.best_line(star, &mut other);
        if other.excess > best.excess {
            let swap = |(x, y): (f64, f64)| (y, x);
            best = Line { from: swap(other.from), to: swap(other.to), ..other };
        }
        (best.excess > 1.0).then_some(best)
    }

    /// Moves the ends of a line on for as long as there is light ahead.
    fn prolong(&self, line: &mut Line) {
        let (ny, nx) = self.above.dim();
        let length = (line.to.0 - line.from.0).hypot(line.to.1 - line.from.1);
        if length < LEAST_PROLONGED_PX {
            return;
        }
        let ahead = ((line.to.0 - line.from.0) / length, (line.to.1 - line.from.1) / length);
        for (end, way) in [(&mut line.from, -1.0), (&mut line.to, 1.0)] {
            let step = (way * ahead.0, way * ahead.1);
            loop {
                // the next pixels, each with one on either side
                let (mut sum, mut square) = (0.0, 0.0);
                for k in 1..=PROLONGED_PX {
                    for offset in [-1.0, 0.0, 1.0] {
                        let x = end.0 + f64::from(k) * step.0 - offset * ahead.1;
                        let y = end.1 + f64::from(k) * step.1 + offset * ahead.0;
                        let (i, j) = (x.round(), y.round());
                        if i < 0.0 || j < 0.0 || i >= nx as f64 || j >= ny as f64 {
                            continue;
                        }
                        let at = [j as usize, i as usize];
                        if self.above[at].is_finite() {
                            sum += f64::from(self.above[at]);
                            square += f64::from(self.variance[at]);
                        }
                    }
                }
                let light = square > 0.0 && sum > PROLONGED_SIGMA * f64::sqrt(square);
                if !light {
                    break;
                }
                *end = (end.0 + f64::from(PROLONGED_PX) * step.0, end.1 + f64::from(PROLONGED_PX) * step.1);
            }
        }
    }

    /// The best line at up to 45° from the rows, if it is better than the best so far.
    fn best_line(&self, star: f64, best: &mut Line) {
        let (ny, nx) = self.above.dim();
        let (above, variance) = self.filled();
        let of_sharpest = sharpest_fwhm_px(FWHM_PER_SIGMA * star) / FWHM_PER_SIGMA;
        let of_class: [_; CLASSES] = std::array::from_fn(|c| {
            let slope2 = ((c as f64 + 0.5) / CLASSES as f64).powi(2);
            // a pixel is one wide in x, too, where the line moves by its slope
            let cut = |sigma: f64| (sigma * sigma * (1.0 + slope2) + slope2 / 12.0).sqrt();
            // of the part of a star in one column none is wider than the star itself, however the line runs
            let sharpest = profiles(cut(DIFFUSION_PX), cut(star), of_sharpest);
            let of_night = profiles(cut(DIFFUSION_PX), cut(star), cut(star));
            (cuts(&above, &sharpest, false), cuts(&variance, &sharpest, true), cuts(&above, &of_night, false))
        });
        let margin = margin_px(FWHM_PER_SIGMA * star);
        if ny < 2 * margin + 1 || nx < 2 {
            return;
        }
        let lengths: Vec<(usize, f64)> = LENGTHS.iter().copied().filter(|l| l.0 <= nx).collect();
        let Some(longest) = lengths.iter().map(|l| l.0).max() else { return };
        // so many directions that the ends of a line are where it is looked for
        let directions = |length: usize| (0.5 * length as f64 * PHASES as f64 / 1.5).ceil().max(1.0) as i32;
        let steps = directions(longest.min(DIRECTIONS_PX));
        let lengths: Vec<(usize, f32, i32, usize)> = lengths
            .into_iter()
            .map(|(l, least)| (l, least as f32, (steps / directions(l)).max(1), (l / 4).max(1)))
            .collect();
        let rows = margin * PHASES..(ny - margin) * PHASES;
        let columns = of_class.map(|cuts| Columns::new([&cuts.0, &cuts.1, &cuts.2], &rows));
        let mut sums = vec![[[0f32; LANES]; KINDS]; nx + 1];
        for k in -steps..=steps {
            let slope = f64::from(k) / f64::from(steps);
            let class = ((slope.abs() * CLASSES as f64) as usize).min(CLASSES - 1);
            let rises: Vec<isize> = (0..nx).map(|i| (slope * i as f64 * PHASES as f64).round() as isize).collect();
            let (low, high) = (rises[0].min(rises[nx - 1]), rises[0].max(rises[nx - 1]));
            for first in (rows.start as isize - high..rows.end as isize - low).step_by(LANES) {
                columns[class].sum(first, &rises, &mut sums);
                for &(length, least, _, step) in lengths.iter().filter(|l| k % l.2 == 0) {
                    if any_above(&sums, length, step, least * best.excess as f32) {
                        for lane in 0..LANES {
                            let y = |i: usize| (first + lane as isize) as f64 / PHASES as f64 + slope * i as f64;
                            best_piece(&sums, lane, (length, step), least, y, best);
                        }
                    }
                }
            }
        }
    }

    /// The pixels with masked ones replaced by the median around them, which is also their uncertainty.
    fn filled(&self) -> (Array2<f32>, Array2<f32>) {
        let (ny, nx) = self.above.dim();
        let (mut above, mut variance) = (self.above.clone(), self.variance.clone());
        let mut known: Vec<f64> = variance.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect();
        let typical = stats::median(&mut known).unwrap_or(1.0) as f32;
        for ((j, i), v) in above.indexed_iter_mut().filter(|(_, v)| !v.is_finite()) {
            let around = self
                .above
                .slice(ndarray::s![j.saturating_sub(3)..(j + 4).min(ny), i.saturating_sub(3)..(i + 4).min(nx)]);
            let mut around: Vec<f64> = around.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect();
            *v = stats::median(&mut around).unwrap_or(0.0) as f32;
            variance[[j, i]] = typical + *v * *v;
        }
        (above, variance)
    }
}

/// A line of a patch that is sharper than a star.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Line {
    /// Significance over the least.
    pub excess: f64,
    /// Its ends \[px of the patch\].
    pub from: (f64, f64),
    pub to: (f64, f64),
}

impl Line {
    fn distance(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (self.to.0 - self.from.0, self.to.1 - self.from.1);
        let square = dx * dx + dy * dy;
        let along = if square > 0.0 { ((x - self.from.0) * dx + (y - self.from.1) * dy) / square } else { 0.0 };
        let along = along.clamp(0.0, 1.0);
        (x - self.from.0 - along * dx).hypot(y - self.from.1 - along * dy)
    }
}

fn transposed(image: &Array2<f32>) -> Array2<f32> {
    image.t().as_standard_layout().to_owned()
}

/// A Gaussian about `at`, integrated over pixels from −reach on.
fn integrated(sigma: f64, at: f64, reach: isize) -> Vec<f64> {
    (-reach..=reach).map(|d| pixel_share(d as f64 - at, sigma)).collect()
}

/// The share of a Gaussian that a pixel sees whose centre is `d` from its own.
pub(crate) fn pixel_share(d: f64, sigma: f64) -> f64 {
    let z = |edge: f64| erf(edge / (sigma * SQRT_2));
    0.5 * (z(d + 0.5) - z(d - 0.5))
}

/// w at each of the places between two pixels.
fn profiles(hit: f64, star: f64, sharpest: f64) -> Vec<Vec<f32>> {
    let reach = reach(star);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    (0..PHASES)
        .map(|phase| {
            let at = phase as f64 / PHASES as f64;
            let (t, p) = (integrated(hit, at, reach), integrated(star, at, reach));
            // whatever part of a pixel the star lies at
            let c = (-4..=4)
                .map(|k| integrated(sharpest, at + f64::from(k) / 8.0, reach))
                .map(|q| dot(&t, &q) / dot(&p, &q))
                .fold(0.0, f64::max)
                * (1.0 + DOUBT_OF_PSF);
            t.iter().zip(&p).map(|(t, p)| (t - c * p) as f32).collect()
        })
        .collect()
}

/// Σ profile · image along the columns at every place between two pixels, or with the squares of the profile.
fn cuts(image: &Array2<f32>, profiles: &[Vec<f32>], squared: bool) -> Array2<f32> {
    let (ny, nx) = image.dim();
    let mut sums = Array2::zeros((ny * PHASES, nx));
    let all = sums.as_slice_mut().unwrap_or_default();
    for (phase, profile) in profiles.iter().enumerate() {
        for (t, d) in profile.iter().zip(-(profile.len() as isize / 2)..) {
            let t = if squared { t * t } else { *t };
            for j in 0..ny {
                let Some(from) = j.checked_add_signed(d).filter(|k| *k < ny) else { continue };
                let own = &mut all[(j * PHASES + phase) * nx..][..nx];
                own.iter_mut().zip(row_of(image, from)).for_each(|(sum, v)| *sum += t * v);
            }
        }
    }
    sums
}

/// The best piece of one line, if it is better than the best so far; `y` is the row of the line in each column.
fn best_piece(
    sums: &[Sums],
    lane: usize,
    (length, step): (usize, usize),
    least: f32,
    y: impl Fn(usize) -> f64,
    best: &mut Line,
) {
    let whole = sums.last().map_or(0.0, |whole| whole[1][lane]);
    let least = least * best.excess as f32;
    for (i, (a, b)) in sums.iter().zip(&sums[length..]).enumerate().step_by(step) {
        let [s, q, n] = [0, 1, 2].map(|kind| b[kind][lane] - a[kind][lane]);
        if n > 0.0 && n * n > least * least * q && q > LEAST_SHARE * whole {
            let root = q.sqrt();
            let significance = s / root + ((n - s) / root).min(OF_NIGHT_SIGMA);
            let excess = f64::from(significance * best.excess as f32 / least);
            if excess > best.excess {
                let end = i + length - 1;
                *best = Line { excess, from: (i as f64, y(i)), to: (end as f64, y(end)) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 61;

    fn add_star(image: &mut Array2<f32>, (x, y): (f64, f64), fwhm: f64, flux: f64) {
        let of = |at: f64| integrated(fwhm / FWHM_PER_SIGMA, at - 30.0, 30);
        let (gx, gy) = (of(x), of(y));
        for ((j, i), v) in image.indexed_iter_mut() {
            *v += (flux * gx[i] * gy[j]) as f32;
        }
    }

    /// Without noise, and so bright that nothing but w ≤ 0 keeps it from being a hit.
    fn is_clean(above: Array2<f32>, fwhm: f64, what: &str) {
        let variance = Array2::from_elem(above.dim(), 1.0);
        let line = Patch { above, variance }.sharpest_line(fwhm / FWHM_PER_SIGMA);
        assert!(line.is_none(), "FWHM {fwhm} {what}: {line:?}");
    }

    #[test]
    fn no_image_of_the_sky_is_a_hit_however_bright() {
        for fwhm in [1.5, 2.0, 3.0, 5.0] {
            for (k, phase) in [(0.0, 0.0), (0.25, 0.1), (0.5, 0.5), (0.4, 0.0), (0.15, 0.35)].into_iter().enumerate() {
                let mut star = Array2::zeros((SIDE, SIDE));
                add_star(&mut star, (30.0 + phase.0, 30.0 + phase.1), fwhm, 1e6);
                is_clean(star.clone(), fwhm, &format!("star {k}"));
                // two stars, a smeared star, a trail, and an even rectangle
                add_star(&mut star, (32.0 + 1.3 * fwhm, 29.0), fwhm, 3e5);
                is_clean(star, fwhm, &format!("pair {k}"));
                for (name, length) in [("smear", 6.0), ("trail", 56.0)] {
                    for theta in [0.0, 0.3, 0.6, 0.8, 1.3] {
                        let mut line = Array2::zeros((SIDE, SIDE));
                        for s in -50..=50 {
                            let s = f64::from(s) / 100.0 * length;
                            let at = (30.0 + phase.0 + s * f64::cos(theta), 30.0 + phase.1 + s * f64::sin(theta));
                            add_star(&mut line, at, fwhm, 1e4);
                        }
                        is_clean(line, fwhm, &format!("{name} {k} at {theta}"));
                    }
                }
            }
        }
    }
}
