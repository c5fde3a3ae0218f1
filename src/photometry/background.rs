//! The sky under everything: a mesh of clipped modes, median filtered, joined by a bicubic spline.
//!
//! Levels and scatter in the unit of the frame (electrons), positions in full-frame pixels. The recipe is SExtractor's
//! (Bertin & Arnouts 1996, A&AS 117, 393, §3). Leaves out: weights, crowded-field modelling.

use ndarray::{Array2, s};
use rayon::prelude::*;

use crate::frames::{Electrons, Frame};
use crate::photometry::stats;
use crate::{Error, Result};

/// Boxes with fewer good pixels than this share of a whole box are filled from their neighbours.
const MIN_GOOD_FRAC: f64 = 0.5;
/// Cut of the first pass, which only sets the range of the histogram \[σ\].
const FIRST_CUT_SIGMA: f64 = 2.0;
/// Half the range of the histogram \[σ\].
const HISTOGRAM_SIGMA: f64 = 5.0;
/// Most levels of the histogram.
const MAX_LEVELS: usize = 4096;
/// A box whose mean and median differ by more than this is crowded: its median is used \[σ\].
const CROWDED_SIGMA: f64 = 0.3;

/// Level and scatter of the sky, a smooth function of position.
#[derive(Debug, Clone)]
pub struct Background {
    origin_px: (f64, f64),
    mesh_px: f64,
    level: Spline,
    rms: Spline,
    global_level: f64,
    global_rms: f64,
    /// Centre of each box with enough good pixels, from the centre of the frame \[px\], and its level.
    measured: Vec<(f64, f64, f64)>,
}

/// Mesh nodes and their second derivatives along y.
#[derive(Debug, Clone)]
struct Spline {
    nodes: Array2<f64>,
    curvature_y: Array2<f64>,
}

/// Measures the sky of a frame on a mesh of `mesh_px` boxes, clipping at `clip_sigma` (3 is usual).
///
/// Per box: a histogram of the unmasked pixels is clipped at ±`clip_sigma` around its median until σ settles; the level
/// is the mode 2.5 median − 1.5 mean, or the median where mean and median differ by more than 0.3 σ. Then a 3×3 median
/// over the mesh, and a natural bicubic spline through the box centres. Cost: about three passes over the pixels;
/// memory: one box per thread.
///
/// # Errors
/// [`Error::Config`] for a mesh below 8 px or a clip that is not positive; [`Error::Fits`] for a frame with no good pixel.
pub fn background(frame: &Frame<Electrons>, mesh_px: usize, clip_sigma: f64) -> Result<Background> {
    if mesh_px < 8 {
        return Err(Error::Config {
            key: "photometry.mesh_px".into(),
            problem: format!("{mesh_px} px is too small for statistics; at least 8, usually 64"),
        });
    }
    if clip_sigma.is_nan() || clip_sigma <= 0.0 {
        return Err(Error::Config {
            key: "photometry.clip_sigma".into(),
            problem: format!("{clip_sigma} is not a positive number of sigma; usually 3"),
        });
    }
    let (ny, nx) = frame.pixels.dim();
    let (boxes_y, boxes_x) = (ny.div_ceil(mesh_px), nx.div_ceil(mesh_px));
    let modes: Vec<Option<Mode>> = (0..boxes_y * boxes_x)
        .into_par_iter()
        .map_init(Vec::new, |values, b| {
            let (y0, x0) = (b / boxes_x * mesh_px, b % boxes_x * mesh_px);
            good_pixels(frame, y0..(y0 + mesh_px).min(ny), x0..(x0 + mesh_px).min(nx), values);
            // a sliver at the edge of the frame counts as its own size only if it is half a box
            let enough = MIN_GOOD_FRAC * (mesh_px * mesh_px).min(ny * nx) as f64;
            (values.len() as f64 >= enough).then(|| mode_of_box(values, clip_sigma))
        })
        .collect();
    let modes = if modes.iter().any(Option::is_some) { modes } else { whole_frame(frame, modes.len(), clip_sigma)? };

    let centre = |b: usize, n: usize| (b * mesh_px) as f64 + 0.5 * (mesh_px.min(n - b * mesh_px) as f64 - n as f64);
    let measured = modes
        .iter()
        .enumerate()
        .filter_map(|(b, mode)| mode.map(|m| (centre(b % boxes_x, nx), centre(b / boxes_x, ny), m.level)));
    let measured = measured.collect();
    let filled = fill_from_neighbours(&modes, boxes_y, boxes_x);
    let level = median_3x3(&filled.mapv(|m| m.level));
    let rms = median_3x3(&filled.mapv(|m| m.sigma));
    Ok(Background {
        origin_px: (frame.origin_px.0 as f64, frame.origin_px.1 as f64),
        mesh_px: mesh_px as f64,
        global_level: stats::median(&mut level.iter().copied().collect::<Vec<_>>()).unwrap_or(0.0),
        global_rms: stats::median(&mut rms.iter().copied().collect::<Vec<_>>()).unwrap_or(0.0),
        level: Spline::through(level),
        rms: Spline::through(rms),
        measured,
    })
}

/// Level and scatter of one box.
#[derive(Debug, Clone, Copy)]
struct Mode {
    level: f64,
    sigma: f64,
}

/// The unmasked finite pixels of a box, row by row.
fn good_pixels(
    frame: &Frame<Electrons>,
    rows: std::ops::Range<usize>,
    columns: std::ops::Range<usize>,
    out: &mut Vec<f32>,
) {
    out.clear();
    let pixels = frame.pixels.slice(s![rows.clone(), columns.clone()]);
    let mask = frame.mask.slice(s![rows, columns]);
    for (row, bits) in pixels.rows().into_iter().zip(mask.rows()) {
        out.extend(row.iter().zip(bits).filter(|(v, m)| **m == 0 && v.is_finite()).map(|(v, _)| *v));
    }
}

/// Where no single box has enough pixels: one level for the whole frame.
fn whole_frame(frame: &Frame<Electrons>, boxes: usize, clip_sigma: f64) -> Result<Vec<Option<Mode>>> {
    let (ny, nx) = frame.pixels.dim();
    let mut values = Vec::new();
    good_pixels(frame, 0..ny, 0..nx, &mut values);
    if values.is_empty() {
        return Err(Error::Fits {
            path: frame.path.clone(),
            problem: format!("none of its {nx}x{ny} pixels is good (all NaN, masked or outside the clip circle)"),
        });
    }
    Ok(vec![Some(mode_of_box(&values, clip_sigma)); boxes])
}

/// The clipped mode of the pixels of a box, from a histogram.
fn mode_of_box(values: &[f32], clip_sigma: f64) -> Mode {
    let (mean, sigma, _) = moments(values, f64::NEG_INFINITY, f64::INFINITY);
    let (mean, sigma, n) = moments(values, mean - FIRST_CUT_SIGMA * sigma, mean + FIRST_CUT_SIGMA * sigma);
    if sigma.is_nan() || sigma <= 0.0 {
        return Mode { level: mean, sigma: 0.0 };
    }
    // as many levels as put about four pixels into each at the peak of a Gaussian: n √(2/π) · 5/4
    let levels =
        ((n as f64 * (2.0 / std::f64::consts::PI).sqrt() * HISTOGRAM_SIGMA / 4.0) as usize + 1).min(MAX_LEVELS);
    let step = 2.0 * HISTOGRAM_SIGMA * sigma / levels as f64;
    let zero = mean - HISTOGRAM_SIGMA * sigma;
    let mut counts = vec![0u32; levels];
    let (per_step, shift) = (1.0 / step, 0.5 - zero / step);
    for &v in values {
        let level = f64::from(v) * per_step + shift;
        if level >= 0.0 && level < levels as f64 {
            counts[level as usize] += 1;
        }
    }
    let clipped = clip_histogram(&counts, clip_sigma);
    let (median, mean, sigma) = (zero + step * clipped.median, zero + step * clipped.mean, step * clipped.sigma);
    let crowded = (mean - median).abs() >= CROWDED_SIGMA * sigma;
    let level = if sigma <= 0.0 {
        mean
    } else if crowded {
        median
    } else {
        2.5 * median - 1.5 * mean
    };
    Mode { level, sigma }
}

/// Mean, standard deviation and number of the values within a range.
fn moments(values: &[f32], low: f64, high: f64) -> (f64, f64, usize) {
    // sums about the first value keep their digits on a bright sky
    let about = values.first().map_or(0.0, |v| f64::from(*v));
    let (mut n, mut sum, mut square) = (0usize, 0.0, 0.0);
    for &v in values {
        let v = f64::from(v);
        if v >= low && v <= high {
            n += 1;
            sum += v - about;
            square += (v - about) * (v - about);
        }
    }
    if n == 0 {
        return (about, 0.0, 0);
    }
    let mean = sum / n as f64;
    (about + mean, (square / n as f64 - mean * mean).max(0.0).sqrt(), n)
}

/// Median, mean and standard deviation of a clipped histogram \[levels\].
struct ClippedHistogram {
    median: f64,
    mean: f64,
    sigma: f64,
}

/// Clips a histogram at ±k σ around its median until σ changes by less than 1e-4 (at most 100 times).
fn clip_histogram(counts: &[u32], k: f64) -> ClippedHistogram {
    let last = counts.len() - 1;
    let (mut low, mut high) = (0usize, last);
    let mut now = ClippedHistogram { median: 0.0, mean: 0.0, sigma: 10.0 * last as f64 };
    let mut previous_sigma = 1.0;
    for _ in 0..100 {
        if now.sigma < 0.1 || (now.sigma / previous_sigma - 1.0).abs() <= 1e-4 {
            break;
        }
        previous_sigma = now.sigma;
        let kept = &counts[low..=high];
        let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
        for (i, &c) in kept.iter().enumerate() {
            let (c, x) = (f64::from(c), i as f64);
            n += c;
            sum += c * x;
            square += c * x * x;
        }
        if n == 0.0 {
            now.sigma = 0.0;
            break;
        }
        let mean = sum / n;
        now.mean = low as f64 + mean;
        now.sigma = (square / n - mean * mean).max(0.0).sqrt();
        now.median = low as f64 + median_level(kept, n);
        low = (now.median - k * now.sigma).round().clamp(0.0, last as f64) as usize;
        high = (now.median + k * now.sigma).round().clamp(low as f64, last as f64) as usize;
    }
    now
}

/// Median of a histogram of `n` counts, each spread evenly over its level.
fn median_level(counts: &[u32], n: f64) -> f64 {
    let mut below = 0.0;
    for (i, &c) in counts.iter().enumerate() {
        let c = f64::from(c);
        if c > 0.0 && below + c >= 0.5 * n {
            return i as f64 - 0.5 + (0.5 * n - below) / c;
        }
        below += c;
    }
    0.0
}

/// Gives a box without a mode the mean of its nearest boxes that have one.
fn fill_from_neighbours(modes: &[Option<Mode>], ny: usize, nx: usize) -> Array2<Mode> {
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        if let Some(mode) = modes[j * nx + i] {
            return mode;
        }
        let (mut nearest, mut n, mut level, mut sigma) = (usize::MAX, 0.0, 0.0, 0.0);
        for (b, mode) in modes.iter().enumerate() {
            let Some(mode) = mode else { continue };
            let distance = (b / nx).abs_diff(j).pow(2) + (b % nx).abs_diff(i).pow(2);
            if distance < nearest {
                (nearest, n, level, sigma) = (distance, 0.0, 0.0, 0.0);
            }
            if distance == nearest {
                n += 1.0;
                level += mode.level;
                sigma += mode.sigma;
            }
        }
        Mode { level: level / n, sigma: sigma / n }
    })
}

/// Median over 3×3 boxes; at an edge the window shrinks on both sides, so that a gradient is not bent.
fn median_3x3(map: &Array2<f64>) -> Array2<f64> {
    let (ny, nx) = map.dim();
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        let (rj, ri) = (usize::from(j > 0 && j + 1 < ny), usize::from(i > 0 && i + 1 < nx));
        let mut window: Vec<f64> = map.slice(s![j - rj..=j + rj, i - ri..=i + ri]).iter().copied().collect();
        stats::median(&mut window).unwrap_or(map[[j, i]])
    })
}

/// Second derivatives (per box²) of the natural cubic spline through equally spaced values, into `out`.
fn natural_curvature(values: &[f64], out: &mut [f64], work: &mut Vec<f64>) {
    let n = values.len();
    out.fill(0.0);
    if n < 3 {
        return;
    }
    // m[i−1] + 4 m[i] + m[i+1] = 6 (v[i−1] − 2 v[i] + v[i+1]), m[0] = m[n−1] = 0
    work.clear();
    work.resize(n, 0.0);
    for i in 1..n - 1 {
        let pivot = 4.0 - work[i - 1];
        work[i] = 1.0 / pivot;
        out[i] = (6.0 * (values[i - 1] - 2.0 * values[i] + values[i + 1]) - out[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        out[i] -= work[i] * out[i + 1];
    }
}

/// The interval of a position in units of boxes and the place in it; outside, the outermost cubic goes on.
fn interval(position: f64, n: usize) -> (usize, f64) {
    let k = (position.floor().max(0.0) as usize).min(n.saturating_sub(2));
    (k, position - k as f64)
}

/// Cubic of an interval from the values and second derivatives at its ends.
fn cubic(t: f64, v: [f64; 2], m: [f64; 2]) -> f64 {
    let u = 1.0 - t;
    u * v[0] + t * v[1] + ((u * u * u - u) * m[0] + (t * t * t - t) * m[1]) / 6.0
}

impl Spline {
    fn through(nodes: Array2<f64>) -> Self {
        let mut curvature_y = Array2::zeros(nodes.dim());
        let (mut out, mut work) = (vec![0.0; nodes.nrows()], Vec::new());
        for (column, mut curvature) in nodes.columns().into_iter().zip(curvature_y.columns_mut()) {
            natural_curvature(&column.to_vec(), &mut out, &mut work);
            curvature.iter_mut().zip(&out).for_each(|(c, o)| *c = *o);
        }
        Self { nodes, curvature_y }
    }

    /// The nodes along x at a position along y \[boxes\], and their second derivatives.
    fn at_row(&self, position: f64) -> (Vec<f64>, Vec<f64>) {
        let n = self.nodes.nrows();
        let values: Vec<f64> = if n == 1 {
            self.nodes.row(0).to_vec()
        } else {
            let (k, t) = interval(position, n);
            (0..self.nodes.ncols())
                .map(|i| {
                    let v = [self.nodes[[k, i]], self.nodes[[k + 1, i]]];
                    cubic(t, v, [self.curvature_y[[k, i]], self.curvature_y[[k + 1, i]]])
                })
                .collect()
        };
        let mut curvature = vec![0.0; values.len()];
        natural_curvature(&values, &mut curvature, &mut Vec::new());
        (values, curvature)
    }
}

/// Value along x at a position \[boxes\].
fn along_x(values: &[f64], curvature: &[f64], position: f64) -> f64 {
    if values.len() == 1 {
        return values[0];
    }
    let (k, t) = interval(position, values.len());
    cubic(t, [values[k], values[k + 1]], [curvature[k], curvature[k + 1]])
}

impl Background {
    /// Position in units of boxes: the centre of the first box is 0.
    fn boxes(&self, px: f64, origin: f64) -> f64 {
        (px - origin + 0.5) / self.mesh_px - 0.5
    }

    fn at(&self, spline: &Spline, x_px: f64, y_px: f64) -> f64 {
        let (values, curvature) = spline.at_row(self.boxes(y_px, self.origin_px.1));
        along_x(&values, &curvature, self.boxes(x_px, self.origin_px.0))
    }

    fn fill(&self, spline: &Spline, y_px: usize, x0_px: usize, out: &mut [f32]) {
        let (values, curvature) = spline.at_row(self.boxes(y_px as f64, self.origin_px.1));
        for (i, o) in out.iter_mut().enumerate() {
            *o = along_x(&values, &curvature, self.boxes((x0_px + i) as f64, self.origin_px.0)) as f32;
        }
    }

    /// Level of the sky \[e⁻/px\] at a full-frame position.
    #[must_use]
    pub fn level(&self, x_px: f64, y_px: f64) -> f64 {
        self.at(&self.level, x_px, y_px)
    }

    /// Scatter of the sky \[e⁻\] at a full-frame position.
    #[must_use]
    pub fn rms(&self, x_px: f64, y_px: f64) -> f64 {
        self.at(&self.rms, x_px, y_px).max(0.0)
    }

    /// Error of [`Background::level`] \[e⁻/px\] from noise alone: that of a mode 2.5 median − 1.5 mean of one box,
    /// σ √(2.5²·π/2 + 1.5² − 2·2.5·1.5)/n = 2.14 σ/mesh.
    #[must_use]
    pub fn level_err(&self, x_px: f64, y_px: f64) -> f64 {
        2.14 * self.rms(x_px, y_px) / self.mesh_px
    }

    /// Level at the rim of the field over that at its centre: 1 for an even field, less where the beam is cut.
    ///
    /// Rim: the boxes beyond 0.85 of the largest distance from the centre, the median of each quadrant, then the mean of
    /// the four, in which a gradient cancels. Centre: the median of the boxes within 0.3. Trails do not lift a mode.
    /// `None` where a quadrant has no box at the rim or the centre has no level above zero.
    #[must_use]
    pub fn corner_ratio(&self) -> Option<f64> {
        let farthest = self.measured.iter().map(|(x, y, _)| x.hypot(*y)).fold(0.0, f64::max);
        let median_where = |inside: &dyn Fn(f64, f64) -> bool| {
            let mut levels: Vec<f64> =
                self.measured.iter().filter(|(x, y, _)| inside(*x, *y)).map(|(_, _, level)| *level).collect();
            stats::median(&mut levels)
        };
        let mut rim = 0.0;
        for (left, below) in [(true, true), (true, false), (false, true), (false, false)] {
            let quadrant = |x: f64, y: f64| (x < 0.0) == left && (y < 0.0) == below && x.hypot(y) >= 0.85 * farthest;
            rim += 0.25 * median_where(&quadrant)?;
        }
        let centre = median_where(&|x, y| x.hypot(y) <= 0.3 * farthest)?;
        (centre > 0.0).then(|| rim / centre)
    }

    /// Median level over the mesh \[e⁻/px\].
    #[must_use]
    pub fn global_level(&self) -> f64 {
        self.global_level
    }

    /// Median scatter over the mesh \[e⁻\].
    #[must_use]
    pub fn global_rms(&self) -> f64 {
        self.global_rms
    }

    /// Level \[e⁻/px\] of a part of the full-frame row `y_px` that starts at `x0_px`.
    pub fn level_row(&self, y_px: usize, x0_px: usize, out: &mut [f32]) {
        self.fill(&self.level, y_px, x0_px, out);
    }

    /// Scatter \[e⁻\] of a part of the full-frame row `y_px` that starts at `x0_px`.
    pub fn rms_row(&self, y_px: usize, x0_px: usize, out: &mut [f32]) {
        self.fill(&self.rms, y_px, x0_px, out);
        out.iter_mut().for_each(|v| *v = v.max(0.0));
    }
}
