//! Star trails of a tracked frame: whether there are any, and their common direction.
//!
//! Positions are columns and rows of a cutout; u runs along the trails, v across. It does not cover curved trails.

use multiversion::multiversion;
use ndarray::Array2;

use crate::photometry::target::cells::row_of;

/// Most points of the direction search.
const MAX_POINTS: usize = 20_000;
/// Its coarse steps, of half a degree, look at one point in so many.
const COARSE_POINTS: usize = 4;

/// Histograms that are filled in turns.
const TURNS: usize = 4;
/// No run shorter than this is a trail \[FWHM\].
pub(crate) const SHORTEST_FWHM: f64 = 15.0;

/// Directions that differ by less are one: those of the trails and of what their model leaves, of spilt charge and of the columns \[rad\].
pub(crate) const ONE_DIRECTION: f64 = 0.06;

/// So many parallel runs, each too short to be distinguished from a long target, are trails.
pub(crate) const FAMILY: usize = 3;

/// One trail: its range across and along \[px\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trail {
    pub v: (f64, f64),
    pub u: (f64, f64),
}

/// The turned coordinates of a cutout, about its centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turned {
    x0: f64,
    y0: f64,
    pub sin: f64,
    pub cos: f64,
}

impl Turned {
    pub fn new(dim: (usize, usize), theta: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { x0: 0.5 * dim.1 as f64, y0: 0.5 * dim.0 as f64, sin, cos }
    }
    #[inline(always)]
    pub fn uv(&self, x: f64, y: f64) -> (f64, f64) {
        let (dx, dy) = (x - self.x0, y - self.y0);
        (dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin)
    }
    #[inline(always)]
    pub fn xy(&self, u: f64, v: f64) -> (f64, f64) {
        (self.x0 + u * self.cos - v * self.sin, self.y0 + u * self.sin + v * self.cos)
    }
}

/// The direction of the trails from +x towards +y \[rad\]; `None` without trails.
///
/// There are trails where a run of the pixels `above` the noise, or of the `faint` ones, is as long as a third of the
/// cutout, or where three parallel runs of the bright ones are 15 FWHM long: one alone may be the target.
pub(crate) fn trail_direction(above: &Array2<bool>, faint: &Array2<bool>, fwhm_px: f64) -> Option<f64> {
    let dim = above.dim();
    let min_length = (SHORTEST_FWHM * fwhm_px).max(60.0);
    let a_third = dim.0.min(dim.1) as f64 / 3.0;
    let points_of = |image: &Array2<bool>| -> Vec<(usize, usize)> {
        let of_row = |j: usize| row_of(image, j).iter().enumerate().filter(|(_, a)| **a).map(move |(i, _)| (i, j));
        (0..dim.0).flat_map(of_row).collect()
    };
    let (bright, faint) = (points_of(above), points_of(faint));
    if (faint.len() as f64) < min_length {
        return None;
    }
    // few bright points hold no direction: then the faint ones may
    let theta = direction(if bright.len() as f64 > 2.0 * min_length { &bright } else { &faint }, dim);
    let min_faint = min_length.max(a_third);
    let turned = Turned::new(dim, theta);
    let runs = long_runs(&bright, turned, dim, fwhm_px, min_length);
    let found = runs.len() >= FAMILY
        || runs.iter().any(|t| t.u.1 - t.u.0 >= min_faint)
        || !long_runs(&faint, turned, dim, fwhm_px, min_faint).is_empty();
    found.then_some(theta)
}

/// The direction in which the points line up best: largest Σ h² of their histogram across it.
pub(crate) fn direction(points: &[(usize, usize)], dim: (usize, usize)) -> f64 {
    let half = (dim.0 as f64).hypot(dim.1 as f64) * 0.5 + 2.0;
    let centre = Turned::new(dim, 0.0);
    let about_centre = |&(i, j): &(usize, usize)| (i as f64 - centre.x0, j as f64 - centre.y0);
    // at most so many of the points
    let some = |most: usize| -> (Vec<f64>, Vec<f64>) {
        points.iter().step_by(points.len().div_ceil(most).max(1)).map(about_centre).unzip()
    };
    let mut bins = Vec::new();
    // neighbours fall into the same bin: counted in turns, so that no count waits for the one before
    let mut counts: Vec<[u32; TURNS]> = Vec::new();
    let mut score = |(dx, dy): &(Vec<f64>, Vec<f64>), theta: f64, bin: f64| -> f64 {
        bins.resize(dx.len(), 0i32);
        bins_across(dx, dy, theta.sin_cos(), (half, bin), &mut bins);
        counts.clear();
        counts.resize((2.0 * half / bin) as usize + 2, [0; TURNS]);
        for some in bins.chunks(TURNS) {
            some.iter().enumerate().for_each(|(turn, at)| counts[*at as usize][turn] += 1);
        }
        counts.iter().map(|c| u64::from(c.iter().sum::<u32>()).pow(2)).sum::<u64>() as f64
    };
    let mut best_of = |points: &(Vec<f64>, Vec<f64>), centre: f64, step: f64, n: i32, bin: f64| -> f64 {
        let mut best = (f64::NEG_INFINITY, centre);
        for k in -n..=n {
            let theta = centre + f64::from(k) * step;
            let s = score(points, theta, bin);
            if s > best.0 {
                best = (s, theta);
            }
        }
        best.1
    };
    let degree = std::f64::consts::PI / 180.0;
    let coarse = best_of(&some(MAX_POINTS / COARSE_POINTS), 0.0, 0.5 * degree, 180, 4.0);
    let points = some(MAX_POINTS);
    let fine = best_of(&points, coarse, 0.05 * degree, 12, 1.5);
    best_of(&points, fine, 0.01 * degree, 6, 1.0)
}

/// The bin across a direction that each point falls into; `half` and `bin` as for its histogram.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn bins_across(dx: &[f64], dy: &[f64], (sin, cos): (f64, f64), (half, bin): (f64, f64), out: &mut [i32]) {
    let points = out.iter_mut().zip(dx.iter().zip(dy));
    // by a power of two it may as well be multiplied
    if bin.log2().fract() == 0.0 {
        let per_bin = 1.0 / bin;
        points.for_each(|(out, (x, y))| *out = ((y * cos - x * sin + half) * per_bin) as i32);
    } else {
        points.for_each(|(out, (x, y))| *out = ((y * cos - x * sin + half) / bin) as i32);
    }
}

/// Stretches along u of at least `min_length` that are above the noise, gaps of two FWHM allowed.
pub(crate) fn long_runs(
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
        let (u, v) = turned.uv(i as f64, j as f64);
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
    open
}
