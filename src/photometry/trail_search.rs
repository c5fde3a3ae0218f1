//! One faint trail in a frame without others: the line along which the light stands out, the target masked.
//!
//! Cells. Every angle and offset is tried (a Radon transform of the clipped cells), and the best line is believed only
//! beyond what the best of that many lines of noise would reach. Leaves out: trails that end in the cutout.

use ndarray::Array2;

use crate::photometry::stats;
use crate::photometry::trail::Turned;

/// A cell counts for at most this \[σ\]: a compact object cannot make a line.
const CLIP_SIGMA: f64 = 3.0;
/// Significance a line through the target must have: of some 5000 such lines, one in a hundred frames by chance.
const THROUGH_SIGMA: f64 = 4.8;
/// The same for a line anywhere: ten times as many.
const ANYWHERE_SIGMA: f64 = 5.3;
/// Significance the line must have on each side of the target by itself.
const SIDE_SIGMA: f64 = 1.5;

/// A coarse cell: place, clipped value \[σ\], and how many cells of the fine grid it holds.
struct Point {
    x: f64,
    y: f64,
    value: f64,
}

/// The direction of the most significant line from +x towards +y \[rad\]; `None` if it may be noise.
///
/// `target` = centre and radius of what is masked by `hidden`; `noise` = scatter of a cell.
pub(crate) fn faint_direction(
    net: &Array2<f32>,
    hidden: &Array2<bool>,
    target: (f64, f64, f64),
    noise: f64,
    fwhm: f64,
) -> Option<f64> {
    let points = coarse(net, hidden, noise, ((0.75 * fwhm).round() as usize).max(1));
    if points.len() < 100 {
        return None;
    }
    let dim = net.dim();
    let bin = 0.75 * fwhm;
    let half = 0.5 * (dim.0 as f64).hypot(dim.1 as f64) + 2.0 * bin;
    let step = (0.8 * fwhm / half).min(0.05);
    let n = (std::f64::consts::PI / step).ceil() as usize;
    let mut sums: Vec<[f64; 2]> = vec![[0.0; 2]; (2.0 * half / bin) as usize + 2];
    let mut all: Vec<f64> = Vec::new();
    // significance, angle, offset of the best line through the target and of the best anywhere
    let mut best = [(0.0, 0.0, 0.0); 2];
    for k in 0..n {
        let theta = k as f64 * std::f64::consts::PI / n as f64;
        let turned = Turned::new(dim, theta);
        add_up(&points, turned, half, bin, &mut sums);
        let own = turned.uv(target.0, target.1).1;
        for (q, pair) in sums.windows(2).enumerate() {
            let weight = pair[0][1] + pair[1][1];
            if weight < 8.0 {
                continue;
            }
            let snr = (pair[0][0] + pair[1][0]) / weight.sqrt();
            let v = (q + 1) as f64 * bin - half;
            let through = (v - own).abs() < target.2;
            for (b, counts) in best.iter_mut().zip([through, true]) {
                if counts && snr > b.0 {
                    *b = (snr, theta, v);
                }
            }
            if (k + q) % 7 == 0 {
                all.push(snr);
            }
        }
    }
    // a sky that is not white makes lines, too
    let unit = stats::mad_sigma(&mut all).unwrap_or(1.0).max(1.0);
    let [through, anywhere] = best;
    [(anywhere, ANYWHERE_SIGMA), (through, THROUGH_SIGMA)]
        .into_iter()
        .filter(|((snr, ..), threshold)| *snr > threshold * unit)
        .map(|((_, theta, v), _)| sharpened(&points, dim, theta, v, step, bin))
        .find(|&(theta, v)| on_both_sides(&points, Turned::new(dim, theta), v, target, bin))
        .map(|(theta, _)| theta)
}

/// Squares of `k` cells outside `hidden`, in units of their noise.
fn coarse(net: &Array2<f32>, hidden: &Array2<bool>, noise: f64, k: usize) -> Vec<Point> {
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
                let value = (sum / (noise * (n as f64).sqrt())).clamp(-CLIP_SIGMA, CLIP_SIGMA);
                let middle = 0.5 * (k as f64 - 1.0);
                points.push(Point { x: i as f64 + middle, y: j as f64 + middle, value });
            }
        }
    }
    points
}

/// Sum and number of the points in every bin across the direction.
fn add_up(points: &[Point], turned: Turned, half: f64, bin: f64, sums: &mut [[f64; 2]]) {
    sums.fill([0.0; 2]);
    let per_bin = 1.0 / bin;
    for p in points {
        let at = &mut sums[((turned.uv(p.x, p.y).1 + half) * per_bin) as usize];
        at[0] += p.value;
        at[1] += 1.0;
    }
}

/// Sum and number of the points within a bin of the line, for which `counts(u)`.
fn along(points: &[Point], turned: Turned, v: f64, bin: f64, counts: impl Fn(f64) -> bool) -> (f64, f64) {
    points.iter().fold((0.0, 0.0), |(sum, n), p| {
        let (u, at) = turned.uv(p.x, p.y);
        if (at - v).abs() < bin && counts(u) { (sum + p.value, n + 1.0) } else { (sum, n) }
    })
}

/// The line in finer steps of angle and offset.
fn sharpened(points: &[Point], dim: (usize, usize), theta: f64, v: f64, step: f64, bin: f64) -> (f64, f64) {
    const STEPS: usize = 24;
    let mut best = (f64::NEG_INFINITY, theta, v);
    let fine = 0.25 * bin;
    for k in -6..=6 {
        let theta = theta + 0.25 * f64::from(k) * step;
        let turned = Turned::new(dim, theta);
        // offsets from 3 bins below to 3 above
        let mut sums = [[0.0; 2]; STEPS];
        for p in points {
            let q = (turned.uv(p.x, p.y).1 - v) / fine + 0.5 * STEPS as f64;
            if let Some(at) = sums.get_mut(q as usize).filter(|_| q >= 0.0) {
                at[0] += p.value;
                at[1] += 1.0;
            }
        }
        for (l, window) in sums.windows(8).enumerate() {
            let (sum, n) = window.iter().fold((0.0, 0.0), |(s, n), w| (s + w[0], n + w[1]));
            let snr = sum / f64::max(n, 1.0).sqrt();
            if snr > best.0 {
                best = (snr, theta, v + fine * (l as f64 + 4.0 - 0.5 * STEPS as f64));
            }
        }
    }
    (best.1, best.2)
}

/// Whether the line is there before and behind the target, equally bright within the noise.
fn on_both_sides(points: &[Point], turned: Turned, v: f64, target: (f64, f64, f64), bin: f64) -> bool {
    let own = turned.uv(target.0, target.1).0;
    let (before, behind) = (along(points, turned, v, bin, |u| u < own), along(points, turned, v, bin, |u| u >= own));
    let there = |(sum, n): (f64, f64)| n < 8.0 || sum / n.sqrt() > SIDE_SIGMA;
    let equal = before.1 < 8.0
        || behind.1 < 8.0
        || (before.0 / before.1 - behind.0 / behind.1).abs() < 4.0 * (1.0 / before.1 + 1.0 / behind.1).sqrt();
    there(before) && there(behind) && equal
}
