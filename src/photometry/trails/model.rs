//! The light under an object among star trails: the level along the trails, on both sides of it.
//!
//! A trail is straight and as bright here as a little further along, so the mean level along it is that of every trail,
//! resolved or not, whatever their number. Electrons per pixel; u along the trails, v across, in cells of the cutout.
//! Ends of trails inside the stretch are voted down by the longer part. It does not cover scintillation or curvature.

use super::exclusion::ExclusionMask;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use ndarray::Array2;

use crate::base::constants::SIGMA_PER_MAD;
use crate::base::stats;
use crate::photometry::aperture::Shape;
use crate::photometry::clip::CLIP_SIGMA;
use crate::photometry::trails::bend::Bend;
use crate::photometry::trails::direction::Turned;
use crate::photometry::trails::rotate::{Spread, cubic_along};

/// A block is two FWHM long, and shorter where the shorter side of a cutout would hold fewer than this: next to a target
/// of a tenth of a small frame there must be blocks left.
const LEAST_BLOCKS: f64 = 20.0;
/// Blocks on each side that make a level: what is longer than this along the trails is a trail.
const SIDE_BLOCKS: usize = 16;
/// Nearest blocks of each side from which it is decided whether both agree.
const STEP_BLOCKS: usize = 5;
/// Fewest blocks of a side near the edge of the frame, where a trail may be short.
const EDGE_BLOCKS: usize = 3;

/// Least and most share of a trail's light that its constant profile gets wrong.
const SCINTILLATION: [f64; 2] = [0.01, 0.05];
/// Lines this bright show how much trails scintillate \[σ of a block\].
const BRIGHT_SIGMA: f64 = 5.0;

/// Level of a line: e⁻ per pixel, by how much its sides differ and the variance of that, and the pixels it rests on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Level {
    pub mean: f64,
    pub step: f64,
    pub step_variance: f64,
    pub n: f64,
}

/// A cutout averaged in short blocks along the trails.
#[derive(Debug, Clone)]
pub(crate) struct TrailBackground {
    pub turned: Turned,
    half: f64,
    block: usize,
    /// Mean of each block, line by line; NaN where less than half of it is on the frame.
    mean: Array2<f32>,
    /// Scatter of a cell of sky.
    noise_e: f64,
    /// Pixels of a cell.
    area_px: f64,
}

impl TrailBackground {
    /// `pixels` are cells of `area_px` pixels, NaN where they do not count; `noise_e` is the scatter of one of sky.
    pub fn new(pixels: &Array2<f32>, theta: f64, fwhm_px: f64, noise_e: f64, area_px: f64) -> Self {
        let dim = pixels.dim();
        let turned = Turned::new(dim, theta);
        let half = (0.5 * (dim.0 as f64).hypot(dim.1 as f64)).ceil() + 1.0;
        let shorter = dim.0.min(dim.1) as f64;
        let block = (2.0 * fwhm_px).min(shorter / LEAST_BLOCKS).round().max(4.0) as usize;
        let lines = 2 * half as usize + 1;
        let blocks = lines / block + 1;
        let mut mean = Array2::from_elem((lines, blocks), f32::NAN);
        let mut line = vec![0f32; blocks * block];
        for (q, mut means) in mean.rows_mut().into_iter().enumerate() {
            cubic_along(pixels.as_slice().unwrap_or_default(), dim, &turned, (-half, q as f64 - half), &mut line);
            for (out, of_block) in means.iter_mut().zip(line.chunks_exact(block)) {
                let good = of_block.iter().filter(|v| v.is_finite());
                let (sum, n) = good.fold((0.0, 0usize), |(sum, n), v| (sum + f64::from(*v), n + 1));
                if 2 * n >= block {
                    *out = (sum / n as f64) as f32;
                }
            }
        }
        Self { turned, half, block, mean, noise_e, area_px }
    }

    /// A shape at a place of the cutout in the turned coordinates.
    pub fn exclusion(&self, at: (f64, f64), shape: Shape) -> ExclusionMask {
        ExclusionMask::of(&self.turned, at, shape)
    }

    /// Direction of the trails from +x towards +y \[rad\].
    pub fn theta(&self) -> f64 {
        self.turned.sin.atan2(self.turned.cos)
    }

    /// Variance of a cell in which there is `light`.
    pub fn variance(&self, light: f64) -> f64 {
        self.noise_e * self.noise_e + light.max(0.0) / self.area_px
    }

    /// The same for the mean of a block.
    pub fn variance_of_block(&self, light: f64) -> f64 {
        self.variance(light) / self.block as f64
    }

    /// Half the length of a line.
    pub fn half(&self) -> f64 {
        self.half
    }

    /// Number of lines.
    pub fn n_lines(&self) -> usize {
        self.mean.nrows()
    }

    /// Middle u and mean of the blocks of line `q` outside every exclusion mask.
    pub fn free_blocks(&self, q: usize, exclusions: &[ExclusionMask]) -> Vec<(f64, f64)> {
        let v = self.v_of(q);
        let chords: Vec<(f64, f64)> = exclusions.iter().filter_map(|h| h.chord(v)).collect();
        let block = |p: usize| {
            let (from, to) = self.range(p);
            let value = f64::from(self.mean[[q, p]]);
            let inside = chords.iter().any(|c| to > c.0 && from < c.1);
            (value.is_finite() && !inside).then_some((0.5 * (from + to), value))
        };
        (0..self.mean.ncols()).filter_map(block).collect()
    }

    /// Subtracts a bend of the sky along the lines from every block.
    pub fn straighten(&mut self, bend: &Bend) {
        for q in 0..self.mean.nrows() {
            let v = self.v_of(q);
            for p in 0..self.mean.ncols() {
                let (from, to) = self.range(p);
                self.mean[[q, p]] -= bend.at_uv(0.5 * (from + to), v) as f32;
            }
        }
    }

    /// The level of line `q` under a stretch `u`, from the blocks next to it that are outside every exclusion mask.
    pub fn side_bands(&self, q: usize, u: (f64, f64), exclusions: &[ExclusionMask]) -> Option<Level> {
        if q >= self.mean.nrows() {
            return None;
        }
        let v = q as f64 - self.half;
        let chords: Vec<(f64, f64)> = exclusions.iter().filter_map(|h| h.chord(v)).collect();
        let free = |p: usize| {
            let (from, to) = self.range(p);
            let value = f64::from(self.mean[[q, p]]);
            let inside = chords.iter().any(|c| to > c.0 && from < c.1);
            (value.is_finite() && !inside).then_some(value)
        };
        let blocks = self.mean.ncols();
        let first = (((u.0 + self.half) / self.block as f64).floor().max(0.0) as usize).min(blocks);
        let last = (((u.1 + self.half) / self.block as f64).ceil().max(0.0) as usize).min(blocks);
        let left: Vec<f64> = (0..first).rev().filter_map(free).take(SIDE_BLOCKS).collect();
        let right: Vec<f64> = (last..blocks).filter_map(free).take(SIDE_BLOCKS).collect();
        let mut all: Vec<f64> = left.iter().chain(&right).copied().collect();
        if all.len() < EDGE_BLOCKS + 1 {
            return None;
        }
        let mean = self.robust_mean(&mut all)?;
        let near = |side: &[f64]| {
            let mut near = side[..side.len().min(STEP_BLOCKS)].to_vec();
            (stats::median(&mut near), near.len() as f64)
        };
        let variance = self.variance(mean) / self.block as f64;
        let (step, step_variance) = match (near(&left), near(&right)) {
            ((Some(l), m), (Some(r), n)) => (l - r, FRAC_PI_2 * variance * (1.0 / m + 1.0 / n)),
            _ => (0.0, 0.0),
        };
        Some(Level { mean, step, step_variance, n: (all.len() * self.block) as f64 })
    }

    /// The level of every line over its whole length, without the blocks in exclusion masks; `None` for a line of fewer
    /// than four.
    pub fn profile(&self, exclusions: &[ExclusionMask]) -> Vec<Option<Level>> {
        let mut work = Vec::new();
        (0..self.mean.nrows())
            .map(|q| {
                let v = q as f64 - self.half;
                let chords: Vec<(f64, f64)> = exclusions.iter().filter_map(|h| h.chord(v)).collect();
                let free = |p: &usize| {
                    let (from, to) = self.range(*p);
                    self.mean[[q, *p]].is_finite() && !chords.iter().any(|c| to > c.0 && from < c.1)
                };
                work.clear();
                work.extend((0..self.mean.ncols()).filter(free).map(|p| f64::from(self.mean[[q, p]])));
                if work.len() < EDGE_BLOCKS + 1 {
                    return None;
                }
                let n = (work.len() * self.block) as f64;
                self.robust_mean(&mut work).map(|mean| Level { mean, step: 0.0, step_variance: 0.0, n })
            })
            .collect()
    }

    /// The level everywhere, by how much it changes from block to block, and the share of it by which trails scintillate: a
    /// model of the sky and the trails.
    pub fn everywhere(&self, dim: (usize, usize), exclusions: &[ExclusionMask]) -> (Array2<f32>, Array2<f32>, f64) {
        let (level, change, scintillation) = self.levels(exclusions);
        let spread = Spread::new(self.turned, self.half, self.block, &level, &change);
        let (mut light, mut unsure) = (Array2::zeros(dim), Array2::zeros(dim));
        for (j, (mut light, mut unsure)) in light.rows_mut().into_iter().zip(unsure.rows_mut()).enumerate() {
            if let (Some(light), Some(unsure)) = (light.as_slice_mut(), unsure.as_slice_mut()) {
                spread.row(j, light, unsure);
            }
        }
        (light, unsure, scintillation)
    }

    /// The level of every block from its neighbours on its line, by how much it changes from block to block, and how much
    /// the blocks scatter about it.
    fn levels(&self, exclusions: &[ExclusionMask]) -> (Array2<f32>, Array2<f32>, f64) {
        let (lines, blocks) = self.mean.dim();
        let mut level = Array2::from_elem((lines, blocks), f32::NAN);
        let mut change = Array2::zeros((lines, blocks));
        let mut window = Window::default();
        let (mut valid, mut values) = (Vec::new(), Vec::new());
        let (mut scintillation, mut off) = (ScintillationExcess::default(), Vec::new());
        for q in 0..lines {
            let v = q as f64 - self.half;
            let chords: Vec<(f64, f64)> = exclusions.iter().filter_map(|h| h.chord(v)).collect();
            let is_excluded = |p: usize| {
                let (from, to) = self.range(p);
                chords.iter().any(|c| to > c.0 && from < c.1)
            };
            valid.clear();
            valid.extend((0..blocks).filter(|&p| self.mean[[q, p]].is_finite() && !is_excluded(p)));
            if valid.len() < 2 {
                continue;
            }
            values.clear();
            values.extend(valid.iter().map(|p| f64::from(self.mean[[q, *p]])));
            window.clear();
            let (mut at, mut of_last) = (0, f32::NAN);
            for p in 0..blocks {
                at += usize::from(valid.get(at).is_some_and(|k| *k < p));
                let own = usize::from(valid.get(at) == Some(&p));
                let (before, after) = (at, valid.len() - at - own);
                let side = if own == 1 { before.min(after).clamp(EDGE_BLOCKS, SIDE_BLOCKS) } else { SIDE_BLOCKS };
                // next to a line's own blocks, the neighbours are the same ones again
                if window.slide_to(&values, at - before.min(side)..at + own + after.min(side)) {
                    of_last = self.mean_near_median(&window.sorted) as f32;
                }
                level[[q, p]] = of_last;
            }
            let brightness = f64::from(level[[q, valid[valid.len() / 2]]]);
            if brightness > BRIGHT_SIGMA * self.variance_of_block(brightness).sqrt() {
                off.clear();
                off.extend(valid.iter().map(|p| f64::from((self.mean[[q, *p]] - level[[q, *p]]).abs())));
                scintillation.add(&mut off, brightness, self.variance_of_block(brightness));
            }
            for p in 0..blocks {
                let (lo, hi) = (p.saturating_sub(1), (p + 1).min(blocks - 1));
                let step = (level[[q, hi]] - level[[q, p]]).abs().max((level[[q, p]] - level[[q, lo]]).abs());
                // what noise alone changes is no end of a trail
                let noise = 2.0 * (self.variance(f64::from(level[[q, p]])) / (SIDE_BLOCKS * self.block) as f64).sqrt();
                change[[q, p]] = if step.is_finite() { (step - noise as f32).max(0.0) } else { 0.0 };
            }
        }
        (level, change, scintillation.share())
    }

    /// First line and its place v, and one past the last line, that a range of v touches.
    pub fn lines(&self, v: (f64, f64)) -> std::ops::Range<usize> {
        let first = (v.0 + self.half).floor().max(1.0) as usize - 1;
        let last = ((v.1 + self.half).ceil().max(0.0) as usize + 2).min(self.mean.nrows());
        first.min(last)..last
    }

    /// v of a line.
    pub fn v_of(&self, line: usize) -> f64 {
        line as f64 - self.half
    }

    /// u from the first to the last pixel of a block.
    fn range(&self, p: usize) -> (f64, f64) {
        let from = (p * self.block) as f64 - self.half - 0.5;
        (from, from + self.block as f64)
    }

    /// Mean of the blocks near their median.
    fn robust_mean(&self, values: &mut [f64]) -> Option<f64> {
        values.sort_unstable_by(f64::total_cmp);
        (!values.is_empty()).then(|| self.mean_near_median(values))
    }

    /// The same for sorted values, of which there is at least one.
    fn mean_near_median(&self, sorted: &[f64]) -> f64 {
        let middle = sorted.len() / 2;
        let median = if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) };
        let limit = CLIP_SIGMA * (self.variance(median) / self.block as f64).sqrt();
        let far = |x: &&f64| !((**x - median).abs() <= limit);
        let (low, high) = (sorted.iter().take_while(far).count(), sorted.iter().rev().take_while(far).count());
        if low + high >= sorted.len() {
            return median;
        }
        let near = &sorted[low..sorted.len() - high];
        near.iter().sum::<f64>() / near.len() as f64
    }
}

/// By how much bright trails scatter along themselves beyond the noise of counts: seeing, scintillation, a direction that
/// is not quite right.
#[derive(Default)]
struct ScintillationExcess {
    excess: f64,
    light: f64,
}

impl ScintillationExcess {
    /// Adds a line of known brightness: how far its blocks are off, and what variance counts alone have.
    fn add(&mut self, off: &mut [f64], brightness: f64, variance: f64) {
        if let Some(median) = stats::median(off) {
            self.excess += (SIGMA_PER_MAD * median).powi(2) - variance;
            self.light += brightness * brightness;
        }
    }

    /// Σ (σ² − σ_counts²) / Σ L², its root; the largest plausible value where no line is bright enough to measure it.
    fn share(&self) -> f64 {
        let [least, most] = SCINTILLATION;
        if self.light > 0.0 { (self.excess.max(0.0) / self.light).sqrt().clamp(least, most) } else { most }
    }
}

/// A range of values kept in order while it moves along them.
#[derive(Default)]
struct Window {
    range: Range<usize>,
    sorted: Vec<f64>,
}

impl Window {
    fn clear(&mut self) {
        self.range = 0..0;
        self.sorted.clear();
    }

    /// Moves to another range of the values; false if it is there already.
    fn slide_to(&mut self, values: &[f64], range: Range<usize>) -> bool {
        if self.range == range {
            return false;
        }
        let old = std::mem::replace(&mut self.range, range.clone());
        if range.start < old.start || range.end < old.end || range.start >= old.end {
            self.sorted.clear();
            self.sorted.extend_from_slice(&values[range]);
            self.sorted.sort_unstable_by(f64::total_cmp);
            return true;
        }
        for gone in &values[old.start..range.start] {
            let at = self.sorted.partition_point(|x| x.total_cmp(gone).is_lt());
            self.sorted.remove(at);
        }
        for new in &values[old.end..range.end] {
            let at = self.sorted.partition_point(|x| x.total_cmp(new).is_lt());
            self.sorted.insert(at, *new);
        }
        true
    }
}

#[cfg(test)]
#[path = "model_tests.rs"]
mod tests;
