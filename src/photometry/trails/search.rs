//! One faint trail in a frame without others: the line along which the light stands out, the target masked.
//!
//! Cells. Every angle and offset is tried (a Radon transform of the clipped cells), and the best line is accepted only
//! beyond what the best of that many lines of noise would reach. It does not cover trails that end in the cutout.

use ndarray::Array2;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::stats;
use crate::photometry::clip::CLIP_SIGMA;
use crate::photometry::trails::direction::{Turned, bins_across};

/// Significance a line through the target must have: of some 10 000 such lines one in fifty frames by chance. A trail of a
/// twentieth of the flux of a target of S/N 10 has no more; the flux of a false one is a fraction of the flux's error.
const THROUGH_SIGMA: f64 = 4.85;
/// The same for a line anywhere: many more lines, and less to lose.
const ANYWHERE_SIGMA: f64 = 5.1;
/// Lines looked at more closely.
const SHARPENED: usize = 16;
/// Width of a trail in the coarse cells \[FWHM\].
pub(crate) const SMEARED_FWHM: f64 = 1.05;
/// Significance the line must have on each side of the target by itself.
const SIDE_SIGMA: f64 = 1.5;

/// A coarse cell: place, and clipped value \[σ\].
#[derive(Clone, Copy)]
pub(crate) struct CoarseCell {
    pub x: f64,
    pub y: f64,
    pub value: f64,
}

/// The direction of the most significant line from +x towards +y \[rad\]; `None` if it may be noise.
///
/// `target` = centre and radius of what is masked by `hidden`; `noise` = scatter of a cell; `uncertainty` is added to the
/// required significance.
pub(crate) fn faint_direction(
    net: &Array2<f32>,
    hidden: &Array2<bool>,
    target: (f64, f64, f64),
    (noise, fwhm): (f64, f64),
    uncertainty: f64,
) -> Option<f64> {
    let points = coarse(net, hidden, noise, ((0.75 * fwhm).round() as usize).max(1));
    if points.len() < 100 {
        return None;
    }
    let dim = net.dim();
    let mut cells = Binned::new(&points, dim);
    let bin = 0.75 * fwhm;
    let half = 0.5 * (dim.0 as f64).hypot(dim.1 as f64) + 2.0 * bin;
    let step = (0.8 * fwhm / half).min(0.05);
    let n = (std::f64::consts::PI / step).ceil() as usize;
    let mut sums: Vec<[f64; 2]> = vec![[0.0; 2]; (2.0 * half / bin) as usize + 2];
    let mut all: Vec<f64> = Vec::new();
    // of each angle the best line through the target, and the best anywhere
    let mut lines: Vec<Line> = Vec::new();
    for k in 0..n {
        let theta = k as f64 * std::f64::consts::PI / n as f64;
        let turned = Turned::new(dim, theta);
        cells.add_up(theta, half, bin, &mut sums);
        let own = turned.uv(target.0, target.1).1;
        let mut best = [true, false].map(|through| Line { snr: 0.0, theta, v: 0.0, through });
        for (q, pair) in sums.windows(2).enumerate() {
            let weight = pair[0][1] + pair[1][1];
            if weight < 8.0 {
                continue;
            }
            let snr = (pair[0][0] + pair[1][0]) / weight.sqrt();
            let v = (q + 1) as f64 * bin - half;
            let own_line = &mut best[usize::from((v - own).abs() >= target.2)];
            if snr > own_line.snr {
                (own_line.snr, own_line.v) = (snr, v);
            }
            if (k + q) % 7 == 0 {
                all.push(snr);
            }
        }
        lines.extend(best);
    }
    // a sky with correlated noise makes lines, too
    let unit = stats::mad_sigma(&mut all).unwrap_or(1.0).max(1.0);
    lines.sort_by(|a, b| b.snr.total_cmp(&a.snr));
    let mut coarse_best: Vec<Line> = lines.iter().filter(|l| l.through).take(SHARPENED).copied().collect();
    coarse_best.extend(lines.iter().filter(|l| !l.through).take(SHARPENED / 2));
    let fine = coarse(net, hidden, noise, ((0.4 * fwhm).round() as usize).max(1));
    let mut sharp: Vec<Line> = coarse_best.iter().map(|l| sharpened(&fine, dim, l, (step, bin, fwhm))).collect();
    sharp.sort_by(|a, b| b.snr.total_cmp(&a.snr));
    sharp
        .into_iter()
        .filter(|l| l.snr > unit * (uncertainty + if l.through { THROUGH_SIGMA } else { ANYWHERE_SIGMA }))
        .find(|l| on_both_sides(&points, Turned::new(dim, l.theta), l.v, target, bin))
        .map(|l| l.theta)
}

/// A line at `v` across the direction `theta`.
#[derive(Debug, Clone, Copy)]
struct Line {
    snr: f64,
    theta: f64,
    v: f64,
    /// Whether it crosses the target.
    through: bool,
}

/// Squares of `k` cells outside `hidden`, in units of their noise.
pub(crate) fn coarse(net: &Array2<f32>, hidden: &Array2<bool>, noise: f64, k: usize) -> Vec<CoarseCell> {
    let (ny, nx) = net.dim();
    let mut points = Vec::new();
    for j in (0..(ny / k) * k).step_by(k) {
        for i in (0..(nx / k) * k).step_by(k) {
            let (mut sum, mut n) = (0.0, 0usize);
            for jj in j..j + k {
                for ii in i..i + k {
                    if net[[jj, ii]].is_finite() && !hidden[[jj, ii]] {
                        sum += f64::from(net[[jj, ii]]);
                        n += 1;
                    }
                }
            }
            if 2 * n >= k * k {
                // a compact object cannot make a line
                let value = (sum / (noise * (n as f64).sqrt())).clamp(-CLIP_SIGMA, CLIP_SIGMA);
                let middle = 0.5 * (k as f64 - 1.0);
                points.push(CoarseCell { x: i as f64 + middle, y: j as f64 + middle, value });
            }
        }
    }
    points
}

/// Coarse cells from the middle of their cutout, and the bin across a direction of each.
struct Binned {
    dx: Vec<f64>,
    dy: Vec<f64>,
    value: Vec<f64>,
    bins: Vec<i32>,
}

impl Binned {
    fn new(points: &[CoarseCell], dim: (usize, usize)) -> Self {
        let middle = Turned::new(dim, 0.0).xy(0.0, 0.0);
        Self {
            dx: points.iter().map(|p| p.x - middle.0).collect(),
            dy: points.iter().map(|p| p.y - middle.1).collect(),
            value: points.iter().map(|p| p.value).collect(),
            bins: vec![0; points.len()],
        }
    }

    /// Sum and number of the points in every bin across the direction, of those that there are.
    fn add_up(&mut self, theta: f64, half: f64, bin: f64, sums: &mut [[f64; 2]]) {
        sums.fill([0.0; 2]);
        bins_across(&self.dx, &self.dy, theta.sin_cos(), (half, bin), &mut self.bins);
        for (bin, value) in self.bins.iter().zip(&self.value) {
            if let Some(at) = sums.get_mut(*bin as usize) {
                *at = [at[0] + value, at[1] + 1.0];
            }
        }
    }
}

/// Sum and number of the points within a bin of the line, for which `counts(u)`.
pub(crate) fn along(
    points: &[CoarseCell],
    turned: Turned,
    v: f64,
    bin: f64,
    counts: impl Fn(f64) -> bool,
) -> (f64, f64) {
    points.iter().fold((0.0, 0.0), |(sum, n), p| {
        let (u, at) = turned.uv(p.x, p.y);
        if (at - v).abs() < bin && counts(u) { (sum + p.value, n + 1.0) } else { (sum, n) }
    })
}

/// The line in finer steps of angle and offset, under the Gaussian profile of a trail: `step` of the angle, `bin` of the
/// offset before.
fn sharpened(points: &[CoarseCell], dim: (usize, usize), line: &Line, (step, bin, fwhm): (f64, f64, f64)) -> Line {
    const STEPS: usize = 48;
    let fine = 0.125 * fwhm;
    let turned = Turned::new(dim, line.theta);
    let half = 0.5 * (dim.0 as f64).hypot(dim.1 as f64);
    // what no turn of the line reaches need not be turned
    let reach = 0.5 * STEPS as f64 * fine + 1.5 * step * half;
    let is_near = |p: &&CoarseCell| (turned.uv(p.x, p.y).1 - line.v).abs() < reach;
    let near: Vec<CoarseCell> = points.iter().filter(is_near).copied().collect();
    let mut near = Binned::new(&near, dim);
    let sigma = SMEARED_FWHM * fwhm / FWHM_PER_SIGMA / fine;
    let taps: Vec<f64> = (-16..=16).map(|k| (-0.5 * (f64::from(k) / sigma).powi(2)).exp()).collect();
    let mut best = Line { snr: f64::NEG_INFINITY, ..*line };
    for k in -6..=6 {
        let theta = line.theta + 0.25 * f64::from(k) * step;
        // the first bin has what lies before all others, too
        let mut sums = [[0.0; 2]; STEPS + 1];
        near.add_up(theta, (0.5 * STEPS as f64 + 1.0) * fine - line.v, fine, &mut sums);
        for (l, window) in sums[1..].windows(taps.len()).enumerate() {
            let v = line.v + fine * (l as f64 + 16.5 - 0.5 * STEPS as f64);
            let (sum, n) = window.iter().zip(&taps).fold((0.0, 0.0), |(s, n), (w, t)| (s + t * w[0], n + t * t * w[1]));
            let snr = sum / f64::max(n, 1.0).sqrt();
            if snr > best.snr && (v - line.v).abs() < 1.1 * bin {
                best = Line { snr, theta, v, ..*line };
            }
        }
    }
    best
}

/// Whether the line is there before and behind the target, equally bright within the noise.
fn on_both_sides(points: &[CoarseCell], turned: Turned, v: f64, target: (f64, f64, f64), bin: f64) -> bool {
    let own = turned.uv(target.0, target.1).0;
    let (before, behind) = (along(points, turned, v, bin, |u| u < own), along(points, turned, v, bin, |u| u >= own));
    let there = |(sum, n): (f64, f64)| n < 8.0 || sum / n.sqrt() > SIDE_SIGMA;
    let equal = before.1 < 8.0
        || behind.1 < 8.0
        || (before.0 / before.1 - behind.0 / behind.1).abs() < 4.0 * (1.0 / before.1 + 1.0 / behind.1).sqrt();
    there(before) && there(behind) && equal
}
