//! A natural bicubic spline through the nodes of a mesh, row by row.
//!
//! Positions in units of boxes, the centre of the first being 0; values in the unit of the nodes. The second derivatives
//! of a row along x are linear in the nodes, so they are made once per node: a row costs a cubic per interval.

use std::ops::{Range, RangeInclusive};

use multiversion::multiversion;
use ndarray::{Array2, ArrayView1, Zip};

/// Value at a node and the second derivatives (per box²) along y, along x, and along x of that along y.
type Node = [f64; 4];

/// A part of a row of a frame and the bits of its mask that forbid a pixel.
#[derive(Clone, Copy)]
pub(crate) struct Pixels<'a> {
    pub values: &'a [f32],
    pub bits: &'a [u8],
    pub unusable: u8,
}

/// Mesh nodes with their second derivatives.
#[derive(Debug, Clone)]
pub(crate) struct Spline {
    nodes: Array2<Node>,
}

/// Second derivatives (per box²) of the natural cubic spline through equally spaced values.
fn natural_curvature(values: ArrayView1<f64>, out: &mut [f64], work: &mut Vec<f64>) {
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

/// Weights of a cubic at `t` on the values at both ends and on the second derivatives there.
fn weights(t: f64) -> [f64; 4] {
    let u = 1.0 - t;
    [u, t, (u * u * u - u) / 6.0, (t * t * t - t) / 6.0]
}

/// How far a cubic may lie outside its ends, in units of their difference and of the largest second derivative: between
/// the nodes, or up to half a box beyond the outermost.
fn overshoot(range: &RangeInclusive<f64>, n: usize) -> (f64, f64) {
    let inside = *range.start() >= 0.0 && *range.end() <= (n - 1) as f64;
    // |u³ − u|/6 + |t³ − t|/6 is at most 1/8 for t in [0, 1], 3/8 for t in [−1/2, 3/2]
    if inside { (0.0, 0.125) } else { (0.5, 0.375) }
}

impl Spline {
    pub fn through(values: &Array2<f64>) -> Self {
        let along = |map: &Array2<f64>, axis: usize| {
            let mut curvature = Array2::zeros(map.dim());
            let (mut out, mut work) = (vec![0.0; map.len_of(ndarray::Axis(axis))], Vec::new());
            Zip::from(map.lanes(ndarray::Axis(axis))).and(curvature.lanes_mut(ndarray::Axis(axis))).for_each(
                |lane, mut curvature| {
                    natural_curvature(lane, &mut out, &mut work);
                    curvature.iter_mut().zip(&out).for_each(|(c, o)| *c = *o);
                },
            );
            curvature
        };
        let of_y = along(values, 0);
        let (of_x, of_xy) = (along(values, 1), along(&of_y, 1));
        let nodes = Zip::from(values).and(&of_y).and(&of_x).and(&of_xy).map_collect(|v, y, x, xy| [*v, *y, *x, *xy]);
        Self { nodes }
    }

    /// Value at a position.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let (k, t) = interval(y, self.nodes.nrows());
        let next = (k + 1).min(self.nodes.nrows() - 1);
        let across = if next == k { [1.0, 0.0, 0.0, 0.0] } else { weights(t) };
        let (i, t) = interval(x, self.nodes.ncols());
        let (value, curvature) = node_at_row(&across, &self.nodes[[k, i]], &self.nodes[[next, i]]);
        if self.nodes.ncols() == 1 {
            return value;
        }
        let (v1, m1) = node_at_row(&across, &self.nodes[[k, i + 1]], &self.nodes[[next, i + 1]]);
        let w = weights(t);
        w[0] * value + w[1] * v1 + (w[2] * curvature + w[3] * m1)
    }

    /// Values along x at `y`, from `x` on in steps of `step`.
    pub fn row(&self, y: f64, x: f64, step: f64, out: &mut [f32]) {
        let (across, below, above) = self.nodes_around(y);
        row_between(below, above, &across, x, step, out);
    }

    /// What pixels along x at `y` have above the values there and `offset`; 0 where `unusable` bits are set or a pixel
    /// is not finite.
    pub fn row_above(&self, (y, x, step): (f64, f64, f64), pixels: Pixels, offset: f32, out: &mut [f32]) {
        let (across, below, above) = self.nodes_around(y);
        above_row_between(below, above, &across, (x, step), pixels, offset, out);
    }

    /// Weights and nodes of the rows below and above `y`.
    fn nodes_around(&self, y: f64) -> ([f64; 4], &[Node], &[Node]) {
        let n = self.nodes.nrows();
        let (k, t) = interval(y, n);
        let (across, next) = if n == 1 { ([1.0, 0.0, 0.0, 0.0], k) } else { (weights(t), k + 1) };
        // in standard layout there always is a slice
        let row = |k: usize| self.nodes.row(k).to_slice().unwrap_or(&[]);
        (across, row(k), row(next))
    }

    /// A value that none in a range of positions lies below.
    pub fn floor_over(&self, xs: RangeInclusive<f64>, ys: RangeInclusive<f64>) -> f64 {
        let (ny, nx) = self.nodes.dim();
        let span = |range: &RangeInclusive<f64>, n: usize| {
            interval(*range.start(), n).0..=(interval(*range.end(), n).0 + 1).min(n - 1)
        };
        let (mut least, mut most, mut curved) = (f64::INFINITY, f64::NEG_INFINITY, [0f64; 3]);
        for j in span(&ys, ny) {
            for i in span(&xs, nx) {
                let [v, y, x, xy] = self.nodes[[j, i]];
                (least, most) = (least.min(v), most.max(v));
                curved = [curved[0].max(y.abs()), curved[1].max(x.abs()), curved[2].max(xy.abs())];
            }
        }
        // first along y for every node of a row, then along x
        let (ends, bend) = overshoot(&ys, ny);
        let beyond = ends * (most - least) + bend * curved[0];
        let curvature = (1.0 + 2.0 * ends) * curved[1] + bend * curved[2];
        let (low, high) = (least - beyond, most + beyond);
        let (ends, bend) = overshoot(&xs, nx);
        low - ends * (high - low) - bend * curvature
    }
}

/// Value and second derivative along x of a node at a row between two rows of nodes.
#[inline(always)]
fn node_at_row(across: &[f64; 4], below: &Node, above: &Node) -> (f64, f64) {
    let at =
        |q: usize| across[0] * below[q] + across[1] * above[q] + (across[2] * below[q + 1] + across[3] * above[q + 1]);
    (at(0), at(2))
}

/// A piece of a row between two nodes: value = c₀ + t (c₁ + t (c₂ + t c₃)), t = `first` + i · step for its i-th pixel.
struct Cubic {
    pixels: Range<usize>,
    first: f64,
    step: f64,
    c: [f64; 4],
}

impl Cubic {
    /// In f64 and then rounded: a bright sky keeps its digits.
    #[inline(always)]
    fn at(&self, i: usize) -> f32 {
        let t = self.first + f64::from(i as i32) * self.step;
        (self.c[0] + t * (self.c[1] + t * (self.c[2] + t * self.c[3]))) as f32
    }
}

/// The cubics of a row of `len` pixels at `across` between two rows of nodes.
#[inline(always)]
fn cubics(
    (below, above): (&[Node], &[Node]),
    across: &[f64; 4],
    (x, step): (f64, f64),
    len: usize,
    mut each: impl FnMut(Cubic),
) {
    const SIXTH: f64 = 1.0 / 6.0;
    let n = below.len();
    if n == 1 {
        let (value, _) = node_at_row(across, &below[0], &above[0]);
        return each(Cubic { pixels: 0..len, first: 0.0, step: 0.0, c: [value, 0.0, 0.0, 0.0] });
    }
    let per_box = 1.0 / step;
    let mut done = 0;
    let mut k = interval(x, n).0;
    let (mut v0, mut m0) = node_at_row(across, &below[k], &above[k]);
    while done < len {
        // up to the next node; the last cubic goes on to the end
        let end = if k + 2 < n { (((k + 1) as f64 - x) * per_box).ceil() as usize } else { len };
        let end = end.clamp(done, len);
        let (v1, m1) = node_at_row(across, &below[k + 1], &above[k + 1]);
        let c = [v0, v1 - v0 - (2.0 * m0 + m1) * SIXTH, 0.5 * m0, (m1 - m0) * SIXTH];
        each(Cubic { pixels: done..end, first: x - k as f64 + done as f64 * step, step, c });
        (done, k, v0, m0) = (end, k + 1, v1, m1);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn row_between(below: &[Node], above: &[Node], across: &[f64; 4], x: f64, step: f64, out: &mut [f32]) {
    cubics((below, above), across, (x, step), out.len(), |cubic| {
        for (i, o) in out[cubic.pixels.clone()].iter_mut().enumerate() {
            *o = cubic.at(i);
        }
    });
}

/// As [`row_between`], subtracted from the pixels in the same pass: they come from memory while the cubics are worked
/// out.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn above_row_between(
    below: &[Node],
    above: &[Node],
    across: &[f64; 4],
    place: (f64, f64),
    pixels: Pixels,
    offset: f32,
    out: &mut [f32],
) {
    cubics((below, above), across, place, out.len(), |cubic| {
        let part = cubic.pixels.clone();
        let (values, bits) = (&pixels.values[part.clone()], &pixels.bits[part.clone()]);
        for (i, ((o, v), m)) in out[part].iter_mut().zip(values).zip(bits).enumerate() {
            let usable = (m & pixels.unusable == 0) & v.is_finite();
            let net = v - cubic.at(i) - offset;
            *o = if usable { net } else { 0.0 };
        }
    });
}

#[cfg(test)]
#[path = "spline_tests.rs"]
mod tests;
