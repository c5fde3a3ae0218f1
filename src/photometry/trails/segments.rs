//! Star trails whose length is known, one by one: where each begins and ends, and its light.
//!
//! Electrons per pixel; u along the trails, v across, in cells of the cutout. A trail has the same profile across all along
//! it, which is taken from its own lines, and ends as a star does. It does not cover trails whose length is not known, and
//! what a trail's brightness changes along it.

use std::ops::Range;

use ndarray::Array2;
use statrs::function::erf::erf;

use super::direction::Turned;
use super::exclusion::ExclusionMask;
use super::rotate::{catmull_rom, cubic_along};
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::stats;
use crate::photometry::target::placed::Placed;

/// A trail is looked at in so many pieces: what is brighter in fewer than half of them is no part of it.
const PIECES: usize = 8;
/// Fewest pieces on good pixels.
const FEWEST_PIECES: usize = 4;
/// Significance of a trail \[σ\].
const TRAIL_SIGMA: f64 = 6.0;
/// A piece counts as no brighter than this many times the faintest but a quarter of them.
const MOST_OF_A_PIECE: f64 = 1.5;
/// Most trails of a cutout.
const MOST_TRAILS: usize = 60;
/// A profile reaches so far to both sides \[FWHM\].
const REACH_FWHM: f64 = 3.0;
/// So near to its ends a trail says nothing of its profile \[FWHM\].
const END_FWHM: f64 = 1.5;
/// Times that each trail is fitted again without the others.
const ROUNDS: usize = 2;
/// Pixels further than this from the median of their line do not count \[σ\].
const CLIP_SIGMA: f64 = 3.0;
/// A half of a trail this significant shows where it is across \[σ\].
const CLEAR_SIGMA: f64 = 15.0;
/// A direction off by less than this over the length of a trail is good enough \[FWHM\].
const MOST_OFF_FWHM: f64 = 0.1;
/// Error of an end \[FWHM\].
const END_ERR_FWHM: f64 = 0.1;

/// A star trail.
#[derive(Debug, Clone)]
struct Segment {
    /// Its ends.
    u: (f64, f64),
    /// Line of the first value of its profile.
    first: usize,
    /// Light on each line, e⁻ per pixel.
    profile: Vec<f32>,
    /// Variance of that.
    variance: Vec<f32>,
}

/// The star trails of a cutout.
#[derive(Debug, Clone)]
pub(crate) struct Segments {
    turned: Turned,
    half: f64,
    sigma: f64,
    list: Vec<Segment>,
}

impl Segments {
    /// The trails of length `length` along `theta`, corrected by those that are seen well.
    ///
    /// `pixels` are cells of `area_px` pixels, NaN where they do not count, whose scatter is `noise_e` where there is sky. What lies in
    /// `exclusions` is not looked at.
    pub fn find(
        pixels: &Array2<f32>,
        (theta, length): (f64, f64),
        fwhm: f64,
        (noise_e, area_px): (f64, f64),
        exclusions: impl Fn(&Turned) -> Vec<ExclusionMask>,
    ) -> Self {
        let scale = (noise_e, area_px);
        let (found, slope) = Self::along(pixels, (theta, length), fwhm, scale, &exclusions);
        if (slope * length).abs() < MOST_OFF_FWHM * fwhm {
            return found;
        }
        Self::along(pixels, (theta + slope, length), fwhm, scale, &exclusions).0
    }

    /// The same along `theta` alone, and by how much those seen well are turned against it \[rad\].
    fn along(
        pixels: &Array2<f32>,
        (theta, length): (f64, f64),
        fwhm: f64,
        (noise_e, area_px): (f64, f64),
        exclusions: &impl Fn(&Turned) -> Vec<ExclusionMask>,
    ) -> (Self, f64) {
        let turned = Turned::new(pixels.dim(), theta);
        let mut lines = Lines::new(pixels, turned, fwhm, (noise_e, area_px));
        lines.exclude(&exclusions(&turned));
        let mut list: Vec<Segment> = Vec::new();
        let mut merit = Array2::zeros((lines.n, lines.places(length)));
        lines.merits(length, 0..lines.n, &mut merit);
        while list.len() < MOST_TRAILS {
            let best = merit.indexed_iter().max_by(|p, q| p.1.total_cmp(q.1)).map(|(at, m)| (at, f64::from(*m)));
            let Some(((q, p), _)) = best.filter(|best| best.1 > TRAIL_SIGMA) else { break };
            let u0 = lines.u_of_place(p, length);
            let found = lines.fitted(q, (u0, u0 + length), lines.piece(length) * 1.5);
            let Some(segment) = found else {
                merit.slice_mut(ndarray::s![q, ..]).fill(0.0);
                continue;
            };
            lines.add(&segment, -1.0);
            let around = lines.reach + lines.taps.len();
            let touched = q.saturating_sub(around)..(q + around + 1).min(lines.n);
            lines.merits(length, touched, &mut merit);
            // what is left there is no trail of its own
            let near = (0.5 * fwhm).round() as usize;
            let same =
                p.saturating_sub(lines.same_place(length))..(p + lines.same_place(length) + 1).min(merit.ncols());
            merit.slice_mut(ndarray::s![q.saturating_sub(near)..(q + near + 1).min(lines.n), same]).fill(0.0);
            list.push(segment);
        }
        for _ in 0..ROUNDS {
            for segment in &mut list {
                lines.add(segment, 1.0);
                let middle = segment.first + segment.profile.len() / 2;
                if let Some(again) = lines.fitted(middle, segment.u, fwhm) {
                    *segment = again;
                }
                lines.add(segment, -1.0);
            }
        }
        let slope = lines.slope(&mut list);
        (Self { turned, half: lines.half, sigma: lines.sigma, list }, slope)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Their light at a place of the cutout.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = self.turned.uv(x, y);
        self.list.iter().map(|s| s.across(v + self.half) * s.along(u, self.sigma)).sum()
    }

    /// Their light at each cell, and by how much it may be wrong where they end.
    pub fn everywhere(&self, dim: (usize, usize)) -> (Array2<f32>, Array2<f32>) {
        let (mut light, mut unsure) = (Array2::zeros(dim), Array2::zeros(dim));
        let end_err = END_ERR_FWHM * FWHM_PER_SIGMA * self.sigma;
        for s in &self.list {
            let reach = 0.5 * s.profile.len() as f64 + 4.0 * self.sigma;
            let v = s.first as f64 + 0.5 * s.profile.len() as f64 - self.half;
            // the box around it
            let corners = [s.u.0 - reach, s.u.1 + reach]
                .into_iter()
                .flat_map(|u| [v - reach, v + reach].map(|v| self.turned.xy(u, v)));
            let span = |of: fn((f64, f64)) -> f64, n: usize| {
                let (low, high) = corners.clone().map(of).fold((f64::MAX, f64::MIN), |(l, h), c| (l.min(c), h.max(c)));
                (low.floor().clamp(0.0, n as f64) as usize)..(high.ceil().clamp(0.0, n as f64) as usize)
            };
            let (columns, rows) = (span(|c| c.0, dim.1), span(|c| c.1, dim.0));
            for j in rows {
                for i in columns.clone() {
                    let (u, v) = self.turned.uv(i as f64, j as f64);
                    let across = s.across(v + self.half);
                    if across == 0.0 || u < s.u.0 - 4.0 * self.sigma || u > s.u.1 + 4.0 * self.sigma {
                        continue;
                    }
                    light[[j, i]] += (across * s.along(u, self.sigma)) as f32;
                    let step = s.along(u + end_err, self.sigma) - s.along(u - end_err, self.sigma);
                    unsure[[j, i]] += (0.5 * across * step.abs()) as f32;
                }
            }
        }
        (light, unsure)
    }

    /// Variance of their light summed over the cells of an aperture: that of their profiles, and of their ends.
    pub fn variance(&self, at: &Placed) -> f64 {
        let aperture = ExclusionMask::of(&self.turned, (at.x, at.y), at.shape);
        let end_err = END_ERR_FWHM * FWHM_PER_SIGMA * self.sigma;
        let of = |s: &Segment| {
            let (mut profile, mut ends) = (0.0, [0.0; 2]);
            for (k, (light, variance)) in s.profile.iter().zip(&s.variance).enumerate() {
                let Some((from, to)) = aperture.chord((s.first + k) as f64 - self.half) else { continue };
                let chord = (to.min(s.u.1) - from.max(s.u.0)).max(0.0);
                profile += chord * chord * f64::from(*variance);
                for (sum, end) in ends.iter_mut().zip([s.u.0, s.u.1]) {
                    if (from..to).contains(&end) {
                        *sum += f64::from(*light) * end_err;
                    }
                }
            }
            profile + ends[0].powi(2) + ends[1].powi(2)
        };
        self.list.iter().map(of).sum()
    }
}

impl Segment {
    /// Light on a line.
    fn across(&self, line: f64) -> f64 {
        let at = line - self.first as f64;
        let k = at.floor();
        if k < -1.0 || k > self.profile.len() as f64 {
            return 0.0;
        }
        let of = |m: f64| if m < 0.0 { 0.0 } else { self.profile.get(m as usize).copied().unwrap_or(0.0) };
        f64::from(catmull_rom([of(k - 1.0), of(k), of(k + 1.0), of(k + 2.0)], (at - k) as f32))
    }

    /// Share of it so far along.
    fn along(&self, u: f64, sigma: f64) -> f64 {
        let step = |x: f64| 0.5 * erf((x / (std::f64::consts::SQRT_2 * sigma)).clamp(-5.0, 5.0));
        step(u - self.u.0) - step(u - self.u.1)
    }
}

/// A cutout turned so that the trails are its lines.
struct Lines {
    half: f64,
    /// Number of lines, and of cells on each.
    n: usize,
    /// NaN where there is no cell.
    value: Array2<f32>,
    fwhm: f64,
    sigma: f64,
    /// Scatter of a cell of sky.
    noise_e: f64,
    area_px: f64,
    /// A star across, 1 at its peak.
    taps: Vec<f64>,
    /// Lines of a profile to each side.
    reach: usize,
}

impl Lines {
    fn new(pixels: &Array2<f32>, turned: Turned, fwhm: f64, (noise_e, area_px): (f64, f64)) -> Self {
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

    fn exclude(&mut self, exclusions: &[ExclusionMask]) {
        for (q, mut line) in self.value.rows_mut().into_iter().enumerate() {
            for (from, to) in exclusions.iter().filter_map(|e| e.chord(q as f64 - self.half)) {
                let cell = |u: f64| ((u + self.half).round().max(0.0) as usize).min(self.n);
                line.slice_mut(ndarray::s![cell(from)..cell(to + 1.0).max(cell(from))]).fill(f32::NAN);
            }
        }
    }

    /// Length of a piece, whole cells.
    fn piece(&self, length: f64) -> f64 {
        (length / PIECES as f64).round().max(2.0)
    }

    /// Distance of the places at which a trail may begin: a part of a piece.
    fn step(&self, length: f64) -> usize {
        ((0.5 * self.fwhm) as usize).clamp(1, self.piece(length) as usize)
    }

    /// Number of those places: it may begin before the first cell.
    fn places(&self, length: f64) -> usize {
        (self.n + length as usize) / self.step(length) + 1
    }

    /// So many places to each side are the same trail.
    fn same_place(&self, length: f64) -> usize {
        (2.0 * self.piece(length)) as usize / self.step(length)
    }

    fn u_of_place(&self, place: usize, length: f64) -> f64 {
        (place * self.step(length)) as f64 - length.floor() - self.half
    }

    /// The significance of a trail that begins at each place of some lines: the sum of its pieces under a star across them, none of
    /// which counts more than 1.5 times the faintest but a quarter of them.
    fn merits(&self, length: f64, lines: Range<usize>, merit: &mut Array2<f32>) {
        let (piece, step, r) = (self.piece(length) as usize, self.step(length), self.taps.len() / 2);
        let n = self.n;
        let (mut value, mut weight) = (vec![0f64; n + 1], vec![0f64; n + 1]);
        let mut pieces = Vec::with_capacity(PIECES);
        for q in lines {
            // light under the star's profile and the weight of the cells that are seen, up to each cell
            let (mut sum, mut norm) = (vec![0f64; n], vec![0f64; n]);
            for (t, w) in self.taps.iter().enumerate() {
                let Some(line) = (q + t).checked_sub(r).filter(|k| *k < n) else { continue };
                for (u, v) in self.value.row(line).iter().enumerate() {
                    if v.is_finite() {
                        sum[u] += w * f64::from(*v);
                        norm[u] += w * w;
                    }
                }
            }
            for u in 0..n {
                value[u + 1] = value[u] + sum[u];
                weight[u + 1] = weight[u] + norm[u];
            }
            let whole = piece as f64 * self.taps.iter().map(|w| w * w).sum::<f64>();
            for (p, out) in merit.row_mut(q).iter_mut().enumerate() {
                let start = (p * step) as i64 - length as i64;
                pieces.clear();
                let mut seen = 0.0;
                for k in 0..PIECES as i64 {
                    let cell = |at: i64| at.clamp(0, n as i64) as usize;
                    let (from, to) = (cell(start + k * piece as i64), cell(start + (k + 1) * piece as i64));
                    let norm = weight[to] - weight[from];
                    if norm > 0.5 * whole {
                        pieces.push((value[to] - value[from]) / norm);
                        seen += norm;
                    }
                }
                *out = 0.0;
                if pieces.len() >= FEWEST_PIECES {
                    pieces.sort_unstable_by(f64::total_cmp);
                    let most = MOST_OF_A_PIECE * pieces[pieces.len() / 4];
                    let mean = pieces.iter().map(|a| a.min(most)).sum::<f64>() / pieces.len() as f64;
                    *out = (mean * seen.sqrt() / self.noise_e) as f32;
                }
            }
        }
    }

    /// The trail on line `q` from about `u.0` to `u.1`, moved by no more than `most`; `None` where too little of it is seen.
    fn fitted(&self, q: usize, u: (f64, f64), most: f64) -> Option<Segment> {
        let r = self.taps.len() / 2;
        // its brightness along it
        let along: Vec<Option<f64>> = (0..self.n)
            .map(|at| {
                let (mut sum, mut norm) = (0.0, 0.0);
                for (t, w) in self.taps.iter().enumerate() {
                    let v = (q + t).checked_sub(r).and_then(|line| self.value.get([line, at])).copied();
                    if let Some(v) = v.filter(|v| v.is_finite()) {
                        sum += w * f64::from(v);
                        norm += w * w;
                    }
                }
                (norm > 0.5).then(|| sum / norm)
            })
            .collect();
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
                (profile.push(0.0), variance.push(0.0));
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
        let step = |x: f64| 0.5 + 0.5 * erf((x / (std::f64::consts::SQRT_2 * self.sigma)).clamp(-5.0, 5.0));
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
                    let model = level * step(sign * (at as f64 - self.half - end));
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
    fn slope(&mut self, list: &mut [Segment]) -> f64 {
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
    fn add(&mut self, segment: &Segment, sign: f32) {
        let cells = self.cells(segment.u.0 - 4.0 * self.sigma, segment.u.1 + 4.0 * self.sigma);
        let along: Vec<f32> =
            cells.clone().map(|at| sign * segment.along(at as f64 - self.half, self.sigma) as f32).collect();
        for (k, light) in segment.profile.iter().enumerate() {
            let mut row = self.value.row_mut(segment.first + k);
            row.iter_mut().skip(cells.start).zip(&along).for_each(|(v, a)| *v += a * light);
        }
    }
}

#[cfg(test)]
#[path = "segments_tests.rs"]
mod tests;
