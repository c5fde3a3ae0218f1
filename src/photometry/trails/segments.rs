//! Star trails whose length is known, one by one: where each begins and ends, and its light.
//!
//! Electrons per pixel; u along the trails, v across, in cells of the cutout. A trail has the same profile across all along
//! it, which is taken from its own lines, and ends as a star does. It does not cover trails whose length is not known, nor
//! how the brightness of a trail changes along it.

use std::ops::Range;

use ndarray::{Array2, ArrayView1};

use super::direction::Turned;
use super::exclusion::ExclusionMask;
use super::lines::{Lines, Segment};
use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::target::placed::Placed;

/// Most trails of a cutout.
const MOST_TRAILS: usize = 60;
/// Error of an end, and of a direction over the length of a trail that is good enough \[FWHM\].
const ERR_FWHM: f64 = 0.1;

/// The star trails of a cutout.
#[derive(Debug, Clone)]
pub(crate) struct Segments {
    turned: Turned,
    half: f64,
    sigma: f64,
    list: Vec<Segment>,
    /// Their light at each cell of the cutout.
    pub light: Array2<f32>,
    /// By how much that may be wrong where they end.
    pub unsure: Array2<f32>,
}

impl Segments {
    /// The trails of length `length` along `theta`, corrected by those that are seen well; `None` where there are none.
    ///
    /// `pixels` are cells of `area_px` pixels, NaN where they do not count, whose scatter is `noise_e` where there is sky. What lies in
    /// `exclusions` is not looked at.
    pub fn find(
        pixels: &Array2<f32>,
        (theta, length): (f64, f64),
        fwhm: f64,
        (noise_e, area_px): (f64, f64),
        exclusions: impl Fn(&Turned) -> Vec<ExclusionMask>,
    ) -> Option<Self> {
        if !Lines::can_hold(pixels.dim(), length) {
            return None;
        }
        let scale = (noise_e, area_px);
        let (mut turned, mut lines, mut list) = Self::along(pixels, (theta, length), fwhm, scale, &exclusions);
        let slope = lines.slope(&mut list);
        if !((slope * length).abs() < ERR_FWHM * fwhm) {
            (turned, lines, list) = Self::along(pixels, (theta + slope, length), fwhm, scale, &exclusions);
        }
        if list.is_empty() {
            return None;
        }
        let none = Array2::zeros(pixels.dim());
        let mut found = Self { turned, half: lines.half, sigma: lines.sigma, list, light: none.clone(), unsure: none };
        found.draw();
        Some(found)
    }

    /// The trails along `theta` alone, and the lines without them.
    fn along(
        pixels: &Array2<f32>,
        (theta, length): (f64, f64),
        fwhm: f64,
        (noise_e, area_px): (f64, f64),
        exclusions: &impl Fn(&Turned) -> Vec<ExclusionMask>,
    ) -> (Turned, Lines, Vec<Segment>) {
        let turned = Turned::new(pixels.dim(), theta);
        let mut list: Vec<Segment> = Vec::new();
        let mut lines = Lines::new(pixels, turned, fwhm, (noise_e, area_px));
        lines.exclude(&exclusions(&turned));
        let mut merit = Array2::zeros((lines.n, lines.places(length)));
        lines.merits(length, 0..lines.n, &mut merit);
        let mut best: Vec<(f32, usize)> = merit.rows().into_iter().map(best_in).collect();
        while list.len() < MOST_TRAILS {
            let first = best.iter().zip(0..).max_by(|p, q| p.0.0.total_cmp(&q.0.0)).filter(|first| first.0.0 > 0.0);
            let Some((&(_, p), q)) = first else { break };
            let u0 = lines.u_of_place(p, length);
            let found = lines.fitted(q, (u0, u0 + length), lines.piece(length) * 1.5);
            let Some(segment) = found else {
                merit.row_mut(q).fill(0.0);
                best[q].0 = 0.0;
                continue;
            };
            lines.add(&segment, -1.0);
            let around = lines.reach + lines.taps.len();
            let touched = q.saturating_sub(around)..(q + around + 1).min(lines.n);
            lines.merits(length, touched.clone(), &mut merit);
            // what is left there is no trail of its own
            let near = (0.5 * fwhm).round() as usize;
            let same =
                p.saturating_sub(lines.same_place(length))..(p + lines.same_place(length) + 1).min(merit.ncols());
            merit.slice_mut(ndarray::s![q.saturating_sub(near)..(q + near + 1).min(lines.n), same]).fill(0.0);
            touched.for_each(|q| best[q] = best_in(merit.row(q)));
            list.push(segment);
        }
        // each once more without the others
        for segment in &mut list {
            lines.add(segment, 1.0);
            let middle = segment.first + segment.profile.len() / 2;
            if let Some(again) = lines.fitted(middle, segment.u, fwhm) {
                *segment = again;
            }
            lines.add(segment, -1.0);
        }
        (turned, lines, list)
    }

    /// Their light at a place of the cutout.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = self.turned.uv(x, y);
        let of = |s: &Segment| match s.across(v + self.half) {
            0.0 => 0.0,
            across => across * s.along(u, self.sigma),
        };
        self.list.iter().map(of).sum()
    }

    /// Adds up their light at each cell, and by how much it may be wrong where they end.
    fn draw(&mut self) {
        let dim = self.light.dim();
        let end_err = ERR_FWHM * FWHM_PER_SIGMA * self.sigma;
        for s in &self.list {
            let ends = (s.u.0 - 4.0 * self.sigma, s.u.1 + 4.0 * self.sigma);
            let lines = (s.first as f64 - 1.0 - self.half, (s.first + s.profile.len()) as f64 + 1.0 - self.half);
            for j in 0..dim.0 {
                // u and v change evenly along a row
                let (start, next) = (self.turned.uv(0.0, j as f64), self.turned.uv(1.0, j as f64));
                let columns = within(start.0, next.0 - start.0, ends, dim.1);
                let of_lines = within(start.1, next.1 - start.1, lines, dim.1);
                for i in columns.start.max(of_lines.start)..columns.end.min(of_lines.end) {
                    let (u, v) = self.turned.uv(i as f64, j as f64);
                    let across = s.across(v + self.half);
                    if across == 0.0 || u < ends.0 || u > ends.1 {
                        continue;
                    }
                    self.light[[j, i]] += (across * s.along(u, self.sigma)) as f32;
                    let step = s.along(u + end_err, self.sigma) - s.along(u - end_err, self.sigma);
                    self.unsure[[j, i]] += (0.5 * across * step.abs()) as f32;
                }
            }
        }
    }

    /// Variance of their light summed over the cells of an aperture: that of their profiles, and of their ends.
    pub fn variance(&self, at: &Placed) -> f64 {
        let aperture = ExclusionMask::of(&self.turned, (at.x, at.y), at.shape);
        let end_err = ERR_FWHM * FWHM_PER_SIGMA * self.sigma;
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

/// The `k` of `n` with `start + k step` from `from` to `to`, and one more on each side.
fn within(start: f64, step: f64, (from, to): (f64, f64), n: usize) -> Range<usize> {
    let (one, other) = ((from - start) / step, (to - start) / step);
    let inside = |k: f64| k.clamp(0.0, n as f64) as usize;
    match (step.abs() > 1e-9, (from..=to).contains(&start)) {
        (true, _) => inside(one.min(other).floor() - 1.0)..inside(one.max(other).ceil() + 2.0),
        (false, true) => 0..n,
        (false, false) => 0..0,
    }
}

/// The most significant place of a line.
fn best_in(line: ArrayView1<f32>) -> (f32, usize) {
    line.iter().copied().zip(0..).max_by(|p, q| p.0.total_cmp(&q.0)).unwrap_or_default()
}

#[cfg(test)]
#[path = "segments_tests.rs"]
mod tests;
