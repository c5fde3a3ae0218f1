//! Star trails of a tracked frame: their common direction, where each runs, and the light to take off.
//!
//! Positions are columns and rows of a cutout; u runs along the trails, v across. A trail is straight and as bright at one
//! end as at the other. Leaves out: curved trails, flicker (five per cent of the trail is allowed for as noise by the user
//! of the model).

use ndarray::Array2;

use crate::photometry::stats;

/// Width of a bin of the cross profile \[px\].
const BIN_PX: f64 = 0.5;
/// Most points of the direction search.
const MAX_POINTS: usize = 20_000;

/// What the trails of a cutout add.
#[derive(Debug, Clone)]
pub(crate) struct Trails {
    /// Direction from +x towards +y \[rad\], if there are trails.
    pub theta_rad: Option<f64>,
    /// Light of the trails \[e⁻\].
    pub light: Array2<f32>,
    /// One over the number of pixels each value of the model rests on; 0 without a trail.
    pub per_pixel: Array2<f32>,
    /// Ends of trails, where the model does not hold.
    pub ends: Array2<bool>,
}

/// One trail: its range across and along \[px\].
#[derive(Debug, Clone, Copy)]
struct Trail {
    v: (f64, f64),
    u: (f64, f64),
}

/// The turned coordinates of a cutout, about its centre.
#[derive(Debug, Clone, Copy)]
struct Turned {
    x0: f64,
    y0: f64,
    sin: f64,
    cos: f64,
}

impl Turned {
    fn new(dim: (usize, usize), theta: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { x0: 0.5 * dim.1 as f64, y0: 0.5 * dim.0 as f64, sin, cos }
    }
    fn uv(&self, i: usize, j: usize) -> (f64, f64) {
        let (dx, dy) = (i as f64 - self.x0, j as f64 - self.y0);
        (dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin)
    }
    /// Columns of row `j` with v in a range.
    fn columns(&self, j: usize, v: (f64, f64), nx: usize) -> std::ops::Range<usize> {
        let dy = j as f64 - self.y0;
        if self.sin.abs() < 1e-9 {
            let here = dy * self.cos;
            return if here >= v.0 && here <= v.1 { 0..nx } else { 0..0 };
        }
        let (p, q) = ((dy * self.cos - v.0) / self.sin + self.x0, (dy * self.cos - v.1) / self.sin + self.x0);
        let first = p.min(q).ceil().clamp(0.0, nx as f64) as usize;
        let last = (p.max(q).floor() + 1.0).clamp(0.0, nx as f64) as usize;
        first..last.max(first)
    }
}

/// Finds the trails and models their light in `net` (sky-subtracted, \[e⁻\]).
///
/// Trails are runs of at least 15 FWHM of the pixels `above` the noise, or of at least a third of the cutout of the
/// `faint` ones. `keep_out` = (column, row, radius) of a known object that must not enter the profiles.
pub(crate) fn trails(
    net: &Array2<f32>,
    above: &Array2<bool>,
    faint: &Array2<bool>,
    fwhm_px: f64,
    keep_out: Option<(f64, f64, f64)>,
) -> Trails {
    let dim = net.dim();
    let mut model = Trails {
        theta_rad: None,
        light: Array2::zeros(dim),
        per_pixel: Array2::zeros(dim),
        ends: Array2::from_elem(dim, false),
    };
    let min_length = (15.0 * fwhm_px).max(60.0);
    let min_faint = min_length.max(dim.0.min(dim.1) as f64 / 3.0);
    let points_of = |image: &Array2<bool>| -> Vec<(usize, usize)> {
        image.indexed_iter().filter(|(_, a)| **a).map(|((j, i), _)| (i, j)).collect()
    };
    let (bright, faint) = (points_of(above), points_of(faint));
    if (faint.len() as f64) < min_length {
        return model;
    }
    // few bright points hold no direction: then the faint ones may
    let theta = direction(if bright.len() as f64 > 2.0 * min_length { &bright } else { &faint }, dim);
    let turned = Turned::new(dim, theta);
    let mut found = long_runs(&bright, turned, dim, fwhm_px, min_length);
    let bright_trails = found.len();
    for trail in long_runs(&faint, turned, dim, fwhm_px, min_faint) {
        let known = found[..bright_trails].iter().any(|t| trail.v.0 <= t.v.1 + fwhm_px && t.v.0 <= trail.v.1 + fwhm_px);
        if !known {
            found.push(trail);
        }
    }
    for trail in found {
        model.theta_rad = Some(theta);
        add_light(&mut model, net, turned, trail, fwhm_px, keep_out);
    }
    model
}

/// The direction in which the points line up best: largest Σ h² of their histogram across it.
fn direction(points: &[(usize, usize)], dim: (usize, usize)) -> f64 {
    let stride = points.len().div_ceil(MAX_POINTS);
    let half = (dim.0 as f64).hypot(dim.1 as f64) * 0.5 + 2.0;
    let score = |theta: f64, bin: f64| -> f64 {
        let turned = Turned::new(dim, theta);
        let mut counts = vec![0f64; (2.0 * half / bin) as usize + 2];
        for &(i, j) in points.iter().step_by(stride) {
            counts[((turned.uv(i, j).1 + half) / bin) as usize] += 1.0;
        }
        counts.iter().map(|c| c * c).sum()
    };
    let best_of = |centre: f64, step: f64, n: i32, bin: f64| -> f64 {
        let mut best = (f64::NEG_INFINITY, centre);
        for k in -n..=n {
            let theta = centre + f64::from(k) * step;
            let s = score(theta, bin);
            if s > best.0 {
                best = (s, theta);
            }
        }
        best.1
    };
    let degree = std::f64::consts::PI / 180.0;
    let coarse = best_of(0.0, 0.5 * degree, 180, 4.0);
    let fine = best_of(coarse, 0.05 * degree, 12, 1.5);
    best_of(fine, 0.01 * degree, 6, 1.0)
}

/// Trails: stretches along u of at least `min_length` that are above the noise, gaps of two FWHM allowed.
fn long_runs(
    points: &[(usize, usize)],
    turned: Turned,
    dim: (usize, usize),
    fwhm_px: f64,
    min_length: f64,
) -> Vec<Trail> {
    let half = (dim.0 as f64).hypot(dim.1 as f64) * 0.5 + 2.0;
    let n_v = (2.0 * half) as usize + 2;
    let mut lines: Vec<Vec<f64>> = vec![Vec::new(); n_v];
    for &(i, j) in points {
        let (u, v) = turned.uv(i, j);
        lines[(v + half) as usize].push(u);
    }
    let gap = (2.0 * fwhm_px).max(4.0);
    let mut open: Vec<Trail> = Vec::new();
    for (k, line) in lines.iter_mut().enumerate() {
        line.sort_by(f64::total_cmp);
        let v = (k as f64 - half, k as f64 + 1.0 - half);
        let mut start = 0;
        for end in 1..=line.len() {
            if end < line.len() && line[end] - line[end - 1] <= gap {
                continue;
            }
            let u = (line[start], line[end - 1]);
            if u.1 - u.0 >= min_length {
                // joins a run of the line before that covers the same stretch
                let same = open.iter_mut().find(|t| {
                    let shared = u.1.min(t.u.1) - u.0.max(t.u.0);
                    v.0 - t.v.1 < 1.5 && shared > 0.7 * (u.1 - u.0).min(t.u.1 - t.u.0)
                });
                match same {
                    Some(t) => {
                        t.v.1 = v.1;
                        t.u = (t.u.0.min(u.0), t.u.1.max(u.1));
                    }
                    None => open.push(Trail { v, u }),
                }
            }
            start = end;
        }
    }
    // a trail is thin: a block wider than this is an object
    open.retain(|t| t.v.1 - t.v.0 < 0.5 * (t.u.1 - t.u.0));
    open.sort_by(|p, q| (q.u.1 - q.u.0).total_cmp(&(p.u.1 - p.u.0)).then(p.v.0.total_cmp(&q.v.0)));
    open
}

/// Adds a trail's light: its mean cross profile over the trail's own stretch, what is already modelled taken off first.
fn add_light(
    model: &mut Trails,
    net: &Array2<f32>,
    turned: Turned,
    trail: Trail,
    fwhm_px: f64,
    keep_out: Option<(f64, f64, f64)>,
) {
    let (ny, nx) = net.dim();
    let wing = 2.5 * fwhm_px;
    let v_range = (trail.v.0 - wing, trail.v.1 + wing);
    let bins = ((v_range.1 - v_range.0) / BIN_PX).ceil() as usize + 1;
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); bins];
    let mut places = vec![(0.0, 0.0); bins];
    let bin_of = |v: f64| ((v - v_range.0) / BIN_PX) as usize;
    for j in 0..ny {
        for i in turned.columns(j, v_range, nx) {
            let (u, v) = turned.uv(i, j);
            let out = keep_out.is_some_and(|(x, y, r)| (i as f64 - x).hypot(j as f64 - y) < r);
            if out || u < trail.u.0 + fwhm_px || u > trail.u.1 - fwhm_px || net[[j, i]] == 0.0 {
                continue;
            }
            let b = bin_of(v);
            values[b].push(f64::from(net[[j, i]] - model.light[[j, i]]));
            places[b] = (places[b].0 + v, places[b].1 + 1.0);
        }
    }
    // nodes of the profile: mean place, clipped mean, number; and the error of each mean
    let mut errors = Vec::new();
    let mut nodes: Vec<(f64, f64, usize)> = Vec::new();
    for (values, (sum, n)) in values.iter_mut().zip(&places).filter(|(values, _)| values.len() >= 8) {
        if let Some(c) = stats::sigma_clip(values, 3.0) {
            nodes.push((sum / n, c.mean, c.n));
            errors.push(c.sigma / (c.n as f64).sqrt());
        }
    }
    if nodes.len() < 4 {
        return;
    }
    // the mesh may be a little off here: the trail is what stands above the outer wings, the lower of both
    let mean_of = |from: f64, to: f64| {
        let (sum, n) =
            nodes.iter().filter(|k| k.0 >= from && k.0 <= to).fold((0.0, 0.0), |(s, n), k| (s + k.1, n + 1.0));
        if n > 0.0 { sum / n } else { f64::INFINITY }
    };
    let outer = 0.4 * wing;
    let pedestal = mean_of(v_range.0, v_range.0 + outer).min(mean_of(v_range.1 - outer, v_range.1));
    for (node, err) in nodes.iter_mut().zip(errors) {
        node.1 -= if pedestal.is_finite() { pedestal } else { 0.0 };
        if node.1 < 2.0 * err {
            node.1 = 0.0;
        }
    }
    let end = 2.5 * fwhm_px;
    for j in 0..ny {
        for i in turned.columns(j, v_range, nx) {
            let (u, v) = turned.uv(i, j);
            if u < trail.u.0 - end || u > trail.u.1 + end {
                continue;
            }
            // a bright trail's round ends, and where it has no constant profile yet
            if (u < trail.u.0 + fwhm_px || u > trail.u.1 - fwhm_px)
                && v > v_range.0 + 0.5 * wing
                && v < v_range.1 - 0.5 * wing
            {
                model.ends[[j, i]] = true;
            }
            if u < trail.u.0 || u > trail.u.1 {
                continue;
            }
            let k = nodes.partition_point(|n| n.0 <= v).clamp(1, nodes.len() - 1);
            let (a, b) = (nodes[k - 1], nodes[k]);
            let t = ((v - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
            model.light[[j, i]] += (a.1 + t * (b.1 - a.1)) as f32;
            model.per_pixel[[j, i]] += 1.0 / a.2.min(b.2).max(1) as f32;
        }
    }
}
