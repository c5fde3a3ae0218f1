//! The pixels of a cutout in lines along its star trails, and one trail of known length in them: where it may begin, its ends, its profile.
//!
//! Electrons per pixel; u along the trails, v across, in cells of the cutout. It does not cover which of them are trails
//! ([`super::segments`]).

use std::ops::Range;

use ndarray::Array2;
use statrs::function::erf::erf;

use super::direction::Turned;
use super::exclusion::ExclusionMask;
use super::rotate::{catmull_rom, cubic_along};
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::stats;
use crate::photometry::clip::CLIP_SIGMA;

/// A trail is looked at in so many pieces: what is brighter in fewer than half of them is no part of it, and half of them must be on
/// good pixels.
const PIECES: usize = 8;
/// Significance of a trail \[σ\].
const TRAIL_SIGMA: f64 = 6.0;
/// Trails are looked for on lines so far from each other \[FWHM\].
const LINES_FWHM: f64 = 0.2;
/// A piece counts as no brighter than this many times the faintest but a quarter of them.
const MOST_OF_A_PIECE: f64 = 1.5;
/// A profile reaches so far to both sides \[FWHM\].
const REACH_FWHM: f64 = 3.0;
/// So near to its ends a trail says nothing of its profile \[FWHM\].
const END_FWHM: f64 = 1.5;
/// A half of a trail this significant shows where it is across \[σ\].
const CLEAR_SIGMA: f64 = 15.0;

/// A star trail.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// Its ends.
    pub(super) u: (f64, f64),
    /// Line of the first value of its profile.
    pub(super) first: usize,
    /// Light on each line, e⁻ per pixel.
    pub(super) profile: Vec<f32>,
    /// Variance of that.
    pub(super) variance: Vec<f32>,
}

impl Segment {
    /// Light on a line.
    pub(super) fn across(&self, line: f64) -> f64 {
        let at = line - self.first as f64;
        let k = at.floor();
        if k < -1.0 || k > self.profile.len() as f64 {
            return 0.0;
        }
        let of = |m: f64| if m < 0.0 { 0.0 } else { self.profile.get(m as usize).copied().unwrap_or(0.0) };
        f64::from(catmull_rom([of(k - 1.0), of(k), of(k + 1.0), of(k + 2.0)], (at - k) as f32))
    }

    /// Share of it so far along.
    pub(super) fn along(&self, u: f64, sigma: f64) -> f64 {
        beyond(u - self.u.0, sigma) - beyond(u - self.u.1, sigma)
    }
}

/// Light of an edge that stars of this σ smear, so far beyond it: 1/2 + 1/2 erf(x / √2 σ).
fn beyond(x: f64, sigma: f64) -> f64 {
    let z = x / (std::f64::consts::SQRT_2 * sigma);
    // erf is 1 to 1e-8 there
    if z.abs() < 4.0 { 0.5 + 0.5 * erf(z) } else { f64::from(u8::from(z > 0.0)) }
}

/// Adds the cells of a line with a weight, and the square of the weight, where there are any.
fn add_weighted(line: &[f32], weight: f64, sum: &mut [f64], norm: &mut [f64]) {
    for ((sum, norm), v) in sum.iter_mut().zip(norm).zip(line) {
        let is_seen = v.is_finite();
        *sum += if is_seen { weight * f64::from(*v) } else { 0.0 };
        *norm += if is_seen { weight * weight } else { 0.0 };
    }
}

/// A cutout turned so that the trails are its lines.
pub(super) struct Lines {
    pub(super) half: f64,
    /// Number of lines, and of cells on each.
    pub(super) n: usize,
    /// NaN where there is no cell.
    value: Array2<f32>,
    fwhm: f64,
    pub(super) sigma: f64,
    /// Scatter of a cell of sky.
    noise_e: f64,
    area_px: f64,
    /// A star across, 1 at its peak.
    pub(super) taps: Vec<f64>,
    /// Lines of a profile to each side.
    pub(super) reach: usize,
}

impl Lines {
    pub(super) fn new(pixels: &Array2<f32>, turned: Turned, fwhm: f64, (noise_e, area_px): (f64, f64)) -> Self {
        let dim = pixels.dim();
        let half = (0.5 * (dim.0 as f64).hypot(dim.1 as f64)).ceil() + 1.0;
        let n = 2 * half as usize + 1;
        let mut value = Array2::from_elem((n, n), f32::NAN);
        for (q, mut line) in value.rows_mut().into_iter().enumerate() {
            if let Some(line) = line.as_slice_mut() {
                cubic_along(pixels.as_slice().unwrap_or_default(), dim, &turned, (-half, q as f64 - half), line);
            }
        }
        let sigma = fwhm / FWHM_PER_SIGMA;
        let r = fwhm.ceil() as i32;
        let taps = (-r..=r).map(|k| (-0.5 * (f64::from(k) / sigma).powi(2)).exp()).collect();
        Self { half, n, value, fwhm, sigma, noise_e, area_px, taps, reach: (REACH_FWHM * fwhm).ceil() as usize }
    }

    pub(super) fn exclude(&mut self, exclusions: &[ExclusionMask]) {
        for q in 0..self.n {
            for (from, to) in exclusions.iter().filter_map(|e| e.chord(q as f64 - self.half)) {
                let cells = self.cells(from, to + 1.0);
                self.value.slice_mut(ndarray::s![q, cells]).fill(f32::NAN);
            }
        }
    }

    /// At each cell of line `q` the cells across under a star there, with its weights, and the squares of the weights.
    fn star_sums(&self, q: usize, sum: &mut [f64], norm: &mut [f64]) {
        sum.fill(0.0);
        norm.fill(0.0);
        for (t, w) in self.taps.iter().enumerate() {
            let line = (q + t).checked_sub(self.taps.len() / 2).filter(|line| *line < self.n);
            if let Some(line) = line.map(|line| self.value.row(line)).as_ref().and_then(|row| row.as_slice()) {
                add_weighted(line, *w, sum, norm);
            }
        }
    }

    /// Length of a piece, whole cells.
    pub(super) fn piece(&self, length: f64) -> f64 {
        (length / PIECES as f64).round().max(2.0)
    }

    /// Distance of the places at which a trail may begin: a part of a piece.
    fn step(&self, length: f64) -> usize {
        ((0.5 * self.fwhm) as usize).clamp(1, self.piece(length) as usize)
    }

    /// Number of those places: it may begin before the first cell.
    pub(super) fn places(&self, length: f64) -> usize {
        (self.n + length as usize) / self.step(length) + 1
    }

    /// So many places to each side are the same trail.
    pub(super) fn same_place(&self, length: f64) -> usize {
        (2.0 * self.piece(length)) as usize / self.step(length)
    }

    pub(super) fn u_of_place(&self, place: usize, length: f64) -> f64 {
        (place * self.step(length)) as f64 - length.floor() - self.half
    }

    /// Whether so much of a trail may lie in a cutout that it counts.
    pub(super) fn can_hold((ny, nx): (usize, usize), length: f64) -> bool {
        // half of it
        0.5 * length <= (ny as f64).hypot(nx as f64)
    }

    /// The significance of a trail that begins at each place of some lines, where it is above [`TRAIL_SIGMA`], else zero: the sum of its
    /// pieces under a star across them, none of which counts more than 1.5 times the faintest but a quarter of them.
    pub(super) fn merits(&self, length: f64, lines: Range<usize>, merit: &mut Array2<f32>) {
        let (piece, step) = (self.piece(length) as usize, self.step(length));
        let n = self.n;
        let whole = piece as f64 * self.taps.iter().map(|w| w * w).sum::<f64>();
        let (mut sum, mut norm) = (vec![0f64; n], vec![0f64; n]);
        // a piece that begins so many cells before the first one, and so on: its mean and weight, none where too little of it is seen
        let mut from = vec![(0f64, 0f64); n + piece];
        let mut pieces = Vec::with_capacity(PIECES);
        // so close that a trail between two of them keeps 98 % of its light
        let apart = ((LINES_FWHM * self.fwhm) as usize).max(1);
        for q in lines.filter(|q| q.is_multiple_of(apart)) {
            self.star_sums(q, &mut sum, &mut norm);
            let (mut light, mut weight) = (0.0, 0.0);
            for (at, of_piece) in from.iter_mut().enumerate() {
                // the cell that enters at its end, and the one before its beginning
                if let (Some(sum), Some(norm)) = (sum.get(at), norm.get(at)) {
                    light += sum;
                    weight += norm;
                }
                if let Some(before) = at.checked_sub(piece) {
                    light -= sum[before];
                    weight -= norm[before];
                }
                *of_piece = if weight > 0.5 * whole { (light / weight, weight) } else { (0.0, 0.0) };
            }
            for (p, out) in merit.row_mut(q).iter_mut().enumerate() {
                *out = 0.0;
                // of the first piece in the cutout
                let first = (p * step + piece) as i64 - length as i64 - 1;
                let before = if first < 0 { first.unsigned_abs().div_ceil(piece as u64) as usize } else { 0 };
                pieces.clear();
                let (mut seen, mut all) = (0.0, 0.0);
                for k in before..PIECES {
                    let Some(&(mean, weight)) = from.get((first + (k * piece) as i64) as usize) else { break };
                    if weight > 0.0 {
                        pieces.push(mean);
                        seen += weight;
                        all += mean;
                    }
                }
                let to_sigma = seen.sqrt() / self.noise_e / pieces.len().max(1) as f64;
                // what counts is no more than all of them
                if pieces.len() >= PIECES / 2 && all * to_sigma > TRAIL_SIGMA {
                    pieces.sort_unstable_by(f64::total_cmp);
                    let most = MOST_OF_A_PIECE * pieces[pieces.len() / 4];
                    let sum = pieces.iter().map(|a| a.min(most)).sum::<f64>();
                    *out = Some((sum * to_sigma) as f32).filter(|m| f64::from(*m) > TRAIL_SIGMA).unwrap_or(0.0);
                }
            }
        }
    }

    /// The trail on line `q` from about `u.0` to `u.1`, moved by no more than `most`; `None` where too little of it is seen.
    pub(super) fn fitted(&self, q: usize, u: (f64, f64), most: f64) -> Option<Segment> {
        // its brightness along it
        let (mut sum, mut norm) = (vec![0.0; self.n], vec![0.0; self.n]);
        self.star_sums(q, &mut sum, &mut norm);
        let along: Vec<Option<f64>> = sum.iter().zip(&norm).map(|(s, n)| (*n > 0.5).then(|| s / n)).collect();
        let u = self.moved(&along, u, most)?;
        let inside = self.cells(u.0 + END_FWHM * self.fwhm, u.1 - END_FWHM * self.fwhm);
        let least = (u.1 - u.0) / PIECES as f64 * 2.0;
        let first = q.saturating_sub(self.reach);
        let (mut profile, mut variance) = (Vec::new(), Vec::new());
        let mut values = Vec::with_capacity(inside.len());
        for line in first..(q + self.reach + 1).min(self.n) {
            values.clear();
            let row = self.value.row(line);
            values.extend(
                row.iter().skip(inside.start).take(inside.len()).filter(|v| v.is_finite()).map(|v| f64::from(*v)),
            );
            if (values.len() as f64) < least {
                // nothing is known of this line
                if line.abs_diff(q) <= 1 {
                    return None;
                }
                profile.push(0.0);
                variance.push(0.0);
                continue;
            }
            values.sort_unstable_by(f64::total_cmp);
            let median = values[values.len() / 2];
            let own = self.noise_e.powi(2) + median.max(0.0) / self.area_px;
            let near = values.iter().filter(|v| (**v - median).abs() <= CLIP_SIGMA * own.sqrt());
            let (sum, n) = near.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
            profile.push((sum / f64::max(n, 1.0)) as f32);
            variance.push((own / f64::max(n, 1.0)) as f32);
        }
        Some(Segment { u, first, profile, variance })
    }

    /// Ends that fit its brightness along it: first both together, then each by itself.
    fn moved(&self, along: &[Option<f64>], u: (f64, f64), most: f64) -> Option<(f64, f64)> {
        let inside = self.cells(u.0 + most, u.1 - most);
        let mut values: Vec<f64> = along.get(inside)?.iter().flatten().copied().collect();
        let level = stats::median(&mut values)?;
        let norm: f64 = self.taps.iter().map(|w| w * w).sum();
        let sigma_e = ((self.noise_e.powi(2) + level.max(0.0) / self.area_px) / norm).sqrt();
        if !(level > 0.0) {
            return None;
        }
        // squares of what an end leaves, none of which counts for more than that of half the brightness
        let cap = (0.5 * level).powi(2) + 9.0 * sigma_e * sigma_e;
        let best = |centre: f64, most: f64, by: f64, cost: &dyn Fn(f64) -> f64| {
            let n = (most / by).ceil() as i32;
            let at = |k: i32| centre + f64::from(k) * by;
            (-n..=n)
                .map(|k| (cost(at(k)), k))
                .min_by(|p, q| p.0.total_cmp(&q.0).then(p.1.abs().cmp(&q.1.abs())))
                .map(|b| at(b.1))
        };
        // fixed cells for all shifts, so that they are compared on the same ones
        let window = |end: f64| self.cells(end - most - 3.0 * self.fwhm, end + most + 3.0 * self.fwhm);
        let over = |cells: Range<usize>, end: f64, sign: f64| -> f64 {
            cells
                .filter_map(|at| {
                    let model = level * beyond(sign * (at as f64 - self.half - end), self.sigma);
                    along[at].map(|v| (v - model).powi(2).min(cap))
                })
                .sum()
        };
        let both = |shift: f64| over(window(u.0), u.0 + shift, 1.0) + over(window(u.1), u.1 + shift, -1.0);
        let shift = best(0.0, most, 0.25 * self.fwhm, &both)?;
        let u = (u.0 + shift, u.1 + shift);
        let fine = |end: f64, sign: f64| {
            let cells = self.cells(end - 4.0 * self.fwhm, end + 4.0 * self.fwhm);
            let found = best(end, 1.5 * self.fwhm, 0.1 * self.fwhm, &|at| over(cells.clone(), at, sign));
            // of an end that is not seen nothing more is known
            let seen = cells.clone().filter(|at| along[*at].is_some()).count() as f64;
            if seen > 4.0 * self.fwhm { found.unwrap_or(end) } else { end }
        };
        Some((fine(u.0, 1.0), fine(u.1, -1.0)))
    }

    /// Mean slope of trails that are subtracted: where each is in the one half of its length against the other, weighted by its light.
    pub(super) fn slope(&mut self, list: &mut [Segment]) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for s in list {
            self.add(s, 1.0);
            let middle = 0.5 * (s.u.0 + s.u.1);
            let q = s.first + s.profile.len() / 2;
            let halves =
                [(s.u.0, middle), (middle, s.u.1)].map(|(from, to)| self.place_across(q, self.cells(from, to)));
            if let [Some((one, light)), Some((other, more))] = halves {
                let own = light.min(more);
                sum += own * (other - one) / (0.5 * (s.u.1 - s.u.0));
                weight += own;
            }
            self.add(s, -1.0);
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// Where the light of a trail near line `q` is across a stretch of it, and that light; `None` where there is too little.
    fn place_across(&self, q: usize, cells: Range<usize>) -> Option<(f64, f64)> {
        let r = (1.5 * self.fwhm) as usize;
        let (mut sum, mut first) = (0.0, 0.0);
        for line in q.saturating_sub(r)..(q + r + 1).min(self.n) {
            let row = self.value.row(line);
            let mut values: Vec<f64> = row
                .iter()
                .skip(cells.start)
                .take(cells.len())
                .filter(|v| v.is_finite())
                .map(|v| f64::from(*v))
                .collect();
            if 2 * values.len() < cells.len() {
                return None;
            }
            let light = stats::median(&mut values)?;
            sum += light;
            first += light * (line as f64 - q as f64);
        }
        let noise = self.noise_e * ((2 * r + 1) as f64 / cells.len() as f64).sqrt();
        (sum > CLEAR_SIGMA * noise).then(|| (first / sum, sum))
    }

    /// Cells of a line from one u to another.
    fn cells(&self, from: f64, to: f64) -> Range<usize> {
        let cell = |u: f64| ((u + self.half).round().max(0.0) as usize).min(self.n);
        cell(from)..cell(to).max(cell(from))
    }

    /// Adds `sign` times the light of a trail.
    pub(super) fn add(&mut self, segment: &Segment, sign: f32) {
        let cells = self.cells(segment.u.0 - 4.0 * self.sigma, segment.u.1 + 4.0 * self.sigma);
        let along: Vec<f32> =
            cells.clone().map(|at| sign * segment.along(at as f64 - self.half, self.sigma) as f32).collect();
        for (k, light) in segment.profile.iter().enumerate() {
            let mut row = self.value.row_mut(segment.first + k);
            row.iter_mut().skip(cells.start).zip(&along).for_each(|(v, a)| *v += a * light);
        }
    }
}
