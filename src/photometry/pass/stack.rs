//! The stack of the frames of a pass, for a target that no single frame shows.
//!
//! Running sums, a few images for any number of frames: of each frame the matched filter A = Σ k c d/σ² and its weight
//! B = Σ k² c²/σ² in every cell, d the electrons above sky and trails, k the kernel of a star, c the electrons of a source of
//! unit flux. F = ΣA/ΣB then is the flux with the smallest error, 1/√ΣB. It does not cover a target that drifts faster than
//! [`MOST_DRIFT_FWHM`] in the pass.

use ndarray::{Array2, Zip, s};
use rayon::prelude::*;

use super::place::PassPlace;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::stats::{mad_sigma, median, peak_significance};
use crate::frames::{Electrons, Frame};
use crate::photometry::smooth::{Kernel, smooth_image};
use crate::photometry::target::cells::{grown, lines_in_quadrature};
use crate::photometry::target::compact::least_significance;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::limit::LIMIT_COMPLETENESS;
use crate::photometry::target::settings::TargetSettings;

/// Chance that a pass without a target gets one.
pub const FALSE_ALARM: f64 = 0.01;
/// Largest drift over the whole pass \[FWHM\].
pub const MOST_DRIFT_FWHM: i32 = 6;
/// Sums of frames next to each other in time, which are shifted against each other.
const PARTS: usize = 8;
/// What is this significant in one frame is not of a target that no frame shows \[σ\], if it would be found there.
const ONE_FRAME_SIGMA: f64 = 5.5;
/// What a frame shows by itself reaches so far from its middle \[FWHM\].
const SHOWN_FWHM: f64 = 2.0;
/// The sky is the mean of the filtered stack between these radii \[FWHM\].
const RING_FWHM: (f64, f64) = (2.5, 5.0);
/// A target that is found with a drift must be this much more significant than without \[σ\].
const DRIFT_GAIN_SIGMA: f64 = 1.0;

/// The matched filter of one frame.
#[derive(Debug, Clone)]
pub struct FrameMap {
    /// Full-frame place of the first pixel, pixels of a cell.
    grid: (usize, usize, usize),
    filtered: Array2<f32>,
    weight: Array2<f32>,
}

/// The matched filter of a frame over the search region of `settings`; `None` where the region is off the frame.
///
/// `unit_e` is what a source of unit flux gives in this frame \[e⁻\]. What stands out in this frame alone is masked, but for what it
/// shows at `shown` (x, y \[px\]), which may be the target.
#[must_use]
pub fn frame_map(
    frame: &Frame<Electrons>,
    settings: &TargetSettings,
    unit_e: f64,
    shown: Option<(f64, f64)>,
) -> Option<FrameMap> {
    let cutout = Cutout::new(frame, settings)?;
    let fwhm = cutout.fwhm_cells();
    let layers = cutout.layers();
    let snr = layers.significance(fwhm, 1, None);
    let most = least_significance(settings, cutout.skewness()).max(ONE_FRAME_SIGMA);
    let mut hidden = grown(&snr.mapv(|v| f64::from(v).abs() > most), fwhm.ceil() as usize);
    let (origin, bin) = (cutout.origin(frame), cutout.net.bin as f64);
    if let Some((x, y)) = shown {
        let (x, y) = (cutout.net.in_cells(x - origin.0), cutout.net.in_cells(y - origin.1));
        let is_shown = |(j, i): (usize, usize)| (i as f64 - x).hypot(j as f64 - y) <= SHOWN_FWHM * fwhm;
        hidden.indexed_iter_mut().filter(|(at, _)| is_shown(*at)).for_each(|(_, hidden)| *hidden = false);
    }
    let mut variance = layers.variance;
    if let Some(uncertainty) = &layers.uncertainty {
        let along = lines_in_quadrature(fwhm, 1.0);
        variance.zip_mut_with(uncertainty, |v, d| *v += along * d * d);
    }
    let (mut value, mut weight) = (layers.value, variance);
    let area = (cutout.net.bin * cutout.net.bin) as f64;
    // k is normalised on cells: its light per pixel is k/a
    let unit = unit_e / area;
    Zip::from(&mut value).and(&mut weight).and(&hidden).for_each(|d, w, hidden| {
        let seen = d.is_finite() && *w > 0.0 && !hidden;
        let inverse = if seen { 1.0 / f64::from(*w) } else { 0.0 };
        *d = if seen { (f64::from(*d) * inverse * unit) as f32 } else { 0.0 };
        *w = (inverse * unit * unit) as f32;
    });
    let kernel = Kernel::gaussian(fwhm);
    // the search region, with the ring and the drift around it
    let reach = settings.search_radius_px / bin
        + (RING_FWHM.1 + 0.5 * f64::from(MOST_DRIFT_FWHM)) * fwhm
        + kernel.radius() as f64;
    let range = |at: f64, n: usize| {
        let edge = |v: f64| v.clamp(0.0, n as f64) as usize;
        edge((at - reach).floor())..edge((at + reach).ceil() + 1.0)
    };
    let (ny, nx) = value.dim();
    let columns = range(cutout.net.in_cells(settings.x_px - origin.0), nx);
    let rows = range(cutout.net.in_cells(settings.y_px - origin.1), ny);
    if columns.is_empty() || rows.is_empty() {
        return None;
    }
    let (x0, y0) = (columns.start * cutout.net.bin, rows.start * cutout.net.bin);
    let part = s![rows, columns];
    Some(FrameMap {
        grid: (origin.0 as usize + x0, origin.1 as usize + y0, cutout.net.bin),
        filtered: smooth_image(&value.slice(part).to_owned(), &kernel),
        weight: smooth_image(&weight.slice(part).to_owned(), &kernel.squared()),
    })
}

/// The sums of a part of the pass.
#[derive(Debug, Clone)]
struct Part {
    filtered: Array2<f32>,
    weight: Array2<f32>,
    time_sum_s: f64,
    n: usize,
}

/// The sums of a pass.
#[derive(Debug, Clone)]
pub struct PassStack {
    grid: (usize, usize, usize),
    parts: Vec<Option<Part>>,
    n_frames: usize,
}

/// What a stack shows.
#[derive(Debug, Clone, PartialEq)]
pub struct StackFound {
    /// The place of the target, if it stands out.
    pub place: Option<PassPlace>,
    /// Significance of the brightest place \[σ\].
    pub snr: f64,
    /// Significance a target must have \[σ\]: one pass in a hundred without a target exceeds it.
    pub threshold: f64,
    /// Error of the flux of a star, the median over the search region \[unit flux\]; `None` where less than 95 % of it is seen in any
    /// frame.
    pub flux_err: Option<f64>,
    /// Frames in the stack.
    pub n_frames: usize,
}

impl PassStack {
    /// An empty stack of frames like the first one.
    #[must_use]
    pub fn like(map: &FrameMap) -> Self {
        Self { grid: map.grid, parts: vec![None; PARTS], n_frames: 0 }
    }

    /// Adds a frame of time `t_s`, the `k`th of `n` of the pass; false where its pixels are others than those of the first.
    pub fn add(&mut self, map: &FrameMap, t_s: f64, (k, n): (usize, usize)) -> bool {
        if map.grid != self.grid {
            return false;
        }
        let part = &mut self.parts[(k * PARTS / n.max(1)).min(PARTS - 1)];
        match part {
            Some(part) if part.filtered.dim() == map.filtered.dim() => {
                part.filtered += &map.filtered;
                part.weight += &map.weight;
                part.time_sum_s += t_s;
                part.n += 1;
            }
            Some(_) => return false,
            None => {
                let (filtered, weight) = (map.filtered.clone(), map.weight.clone());
                *part = Some(Part { filtered, weight, time_sum_s: t_s, n: 1 });
            }
        }
        self.n_frames += 1;
        true
    }

    /// Looks for the target in the search region of `s`: still first, then with a drift.
    ///
    /// The threshold is such that maxima of noise ([`peak_significance`]), for the still target and for all drifts together, are
    /// half of [`FALSE_ALARM`] each.
    #[must_use]
    pub fn find(&self, s: &TargetSettings) -> Option<StackFound> {
        let fwhm = s.fwhm_px / self.grid.2 as f64;
        let parts: Vec<&Part> = self.parts.iter().flatten().collect();
        let dim = parts.first()?.filtered.dim();
        let times: Vec<f64> = parts.iter().map(|p| p.time_sum_s / p.n as f64).collect();
        let weights: f64 = parts.iter().map(|p| p.n as f64).sum();
        let t0_s = parts.iter().map(|p| p.time_sum_s).sum::<f64>() / weights;
        let span_s = times.last()? - times.first()?;
        let inside = self.search_region(s, dim);
        let sum = |drift: (f64, f64)| {
            let (mut filtered, mut weight) = (Array2::<f32>::zeros(dim), Array2::<f32>::zeros(dim));
            for (part, t) in parts.iter().zip(&times) {
                let share = if span_s > 0.0 { (t - t0_s) / span_s } else { 0.0 };
                let by = |d: f64| (d * share).round() as isize;
                add_shifted(&mut filtered, &part.filtered, (by(drift.0), by(drift.1)));
                add_shifted(&mut weight, &part.weight, (by(drift.0), by(drift.1)));
            }
            Significance::of(filtered, weight, fwhm, &inside)
        };
        let still = sum((0.0, 0.0));
        let area = std::f64::consts::PI * (s.search_radius_px / (s.fwhm_px / FWHM_PER_SIGMA)).powi(2);
        let drifts = drifts(fwhm, if parts.len() > 1 { MOST_DRIFT_FWHM } else { 0 });
        let threshold = peak_significance(area, 0.5 * FALSE_ALARM);
        let flux_err = still.median_err(&inside);
        let mut found = StackFound { place: None, snr: still.best.0, threshold, flux_err, n_frames: self.n_frames };
        let mut best = (still.best.0 > threshold).then_some((still.best, (0.0, 0.0), 2));
        let with_drift = peak_significance(area * drifts.len() as f64, 0.5 * FALSE_ALARM);
        // tried on all threads, compared in their order
        let trials: Vec<(f64, f64, f64)> = drifts.par_iter().map(|drift| sum(*drift).best).collect();
        for (trial, drift) in trials.into_iter().zip(drifts) {
            let least =
                best.as_ref().map_or(with_drift, |(b, _, k)| b.0 + if *k == 2 { DRIFT_GAIN_SIGMA } else { 0.0 });
            if trial.0 > least {
                best = Some((trial, drift, 4));
            }
        }
        if let Some(((snr, x, y), drift, freedoms)) = best {
            let to_px =
                |at: f64, origin: usize| origin as f64 + at * self.grid.2 as f64 + 0.5 * (self.grid.2 as f64 - 1.0);
            let per_s = |d: f64| if span_s > 0.0 { -d * self.grid.2 as f64 / span_s } else { 0.0 };
            found.snr = snr;
            found.place = Some(PassPlace {
                t0_s,
                x_px: to_px(x, self.grid.0),
                y_px: to_px(y, self.grid.1),
                drift_px_s: (per_s(drift.0), per_s(drift.1)),
                jitter_px: 0.0,
                freedoms,
            });
        }
        Some(found)
    }

    /// The cells within the search radius.
    fn search_region(&self, s: &TargetSettings, dim: (usize, usize)) -> Array2<bool> {
        let bin = self.grid.2 as f64;
        let to_px = |k: usize, origin: usize| origin as f64 + (k as f64 + 0.5) * bin - 0.5;
        Array2::from_shape_fn(dim, |(j, i)| {
            (to_px(i, self.grid.0) - s.x_px).hypot(to_px(j, self.grid.1) - s.y_px) <= s.search_radius_px
        })
    }
}

/// The drifts that are tried, as shifts of the last frame against the first \[cells\]: a grid of one FWHM without the middle.
fn drifts(fwhm: f64, most: i32) -> Vec<(f64, f64)> {
    let all = (-most..=most).flat_map(|k| (-most..=most).map(move |l| (k, l)));
    let within = all.filter(|(k, l)| (k, l) != (&0, &0) && k * k + l * l <= most * most);
    within.map(|(k, l)| (f64::from(k) * fwhm, f64::from(l) * fwhm)).collect()
}

/// Adds an image whose cells are moved by whole cells.
fn add_shifted(to: &mut Array2<f32>, from: &Array2<f32>, (dx, dy): (isize, isize)) {
    let (ny, nx) = to.dim();
    let range = |d: isize, n: usize| {
        let size = n.saturating_sub(d.unsigned_abs());
        let start = d.max(0) as usize;
        (start.min(n)..(start + size).min(n), (d.min(0).unsigned_abs()).min(n)..(d.min(0).unsigned_abs() + size).min(n))
    };
    let ((x_to, x_from), (y_to, y_from)) = (range(dx, nx), range(dy, ny));
    let mut part = to.slice_mut(s![y_to, x_to]);
    part += &from.slice(s![y_from, x_from]);
}

/// The significance of a stack.
struct Significance {
    weight: Array2<f32>,
    /// Scatter over the expected one, at least 1.
    unit: f64,
    /// Significance and place \[cells\] of the most significant maximum.
    best: (f64, f64, f64),
}

impl Significance {
    fn of(filtered: Array2<f32>, weight: Array2<f32>, fwhm: f64, inside: &Array2<bool>) -> Self {
        let mut flux = filtered;
        Zip::from(&mut flux).and(&weight).for_each(|a, b| *a = if *b > 0.0 { *a / *b } else { 0.0 });
        let level = ring_mean(&flux, &weight, fwhm);
        let mut snr = flux;
        Zip::from(&mut snr).and(&level).and(&weight).for_each(|f, l, b| *f = (*f - l) * b.sqrt());
        let sample = snr.iter().zip(inside).zip(&weight).filter(|((_, inside), b)| **inside && **b > 0.0);
        let mut sample: Vec<f64> = sample.step_by(3).map(|((v, _), _)| f64::from(*v)).collect();
        let unit = mad_sigma(&mut sample).unwrap_or(1.0).max(1.0);
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for ((j, i), v) in snr.indexed_iter() {
            if inside[[j, i]] && f64::from(*v) > best.0 {
                best = (f64::from(*v), i, j);
            }
        }
        let (ny, nx) = snr.dim();
        let (_, i, j) = best;
        let at = |j: usize, i: usize| f64::from(snr[[j, i]]);
        // the vertex of the parabola through three cells
        let vertex = |l: f64, m: f64, r: f64| {
            let bend = l - 2.0 * m + r;
            if bend < 0.0 { (0.5 * (l - r) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let (mut x, mut y) = (i as f64, j as f64);
        if i > 0 && i + 1 < nx && j > 0 && j + 1 < ny {
            x += vertex(at(j, i - 1), at(j, i), at(j, i + 1));
            y += vertex(at(j - 1, i), at(j, i), at(j + 1, i));
        }
        Self { weight, unit, best: (best.0 / unit, x, y) }
    }

    /// Median error of a flux in the search region; `None` where too little of it is seen.
    fn median_err(&self, inside: &Array2<bool>) -> Option<f64> {
        let seen = self.weight.iter().zip(inside).filter(|(b, inside)| **inside && **b > 0.0);
        let mut errors: Vec<f64> = seen.map(|(b, _)| self.unit / f64::from(*b).sqrt()).collect();
        let all = inside.iter().filter(|inside| **inside).count();
        if (errors.len() as f64) < LIMIT_COMPLETENESS * all as f64 { None } else { median(&mut errors) }
    }
}

/// The weighted mean of a flux between two squares about each cell, as wide as the ring.
fn ring_mean(flux: &Array2<f32>, weight: &Array2<f32>, fwhm: f64) -> Array2<f32> {
    let (ny, nx) = flux.dim();
    let mut sums = Array2::<f64>::zeros((ny + 1, nx + 1));
    let mut weights = Array2::<f64>::zeros((ny + 1, nx + 1));
    for j in 0..ny {
        let (mut sum, mut w) = (0.0, 0.0);
        for i in 0..nx {
            let b = f64::from(weight[[j, i]]);
            sum += b * f64::from(flux[[j, i]]);
            w += b;
            sums[[j + 1, i + 1]] = sums[[j, i + 1]] + sum;
            weights[[j + 1, i + 1]] = weights[[j, i + 1]] + w;
        }
    }
    let reach = |r: f64| (r * fwhm).round() as usize;
    let (inner, outer) = (reach(RING_FWHM.0), reach(RING_FWHM.1));
    let square = |of: &Array2<f64>, j: usize, i: usize, r: usize| {
        let (y0, y1, x0, x1) = (j.saturating_sub(r), (j + r + 1).min(ny), i.saturating_sub(r), (i + r + 1).min(nx));
        of[[y1, x1]] - of[[y0, x1]] - of[[y1, x0]] + of[[y0, x0]]
    };
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        let w = square(&weights, j, i, outer) - square(&weights, j, i, inner);
        let sum = square(&sums, j, i, outer) - square(&sums, j, i, inner);
        if w > 0.0 { (sum / w) as f32 } else { 0.0 }
    })
}
