//! One piece of a circle under one rule: the nodes, the ground's light, the law, two sums.
//!
//! Angles in rad, results in 1/sr. With T = tan(Δ/2) the nodes need no sine or cosine; graded pieces put them at
//! T ∝ sinh, so that a lobe of any width takes as many as its logarithm. Rows of at most 32 nodes go through together.

use std::f64::consts::TAU;
use std::ops::{Add, AddAssign};
use std::sync::OnceLock;

use multiversion::multiversion;

use super::arithmetic::{exp, ln, positive_power};
use super::facet::Facet;
use super::profile::Metric;
use crate::base::quadrature::{PAIRS, Pair, end_clustered, kronrod};
use crate::brightness::ground::{Circle, Ground, GroundLaw};

/// How far the digits of the finer rule are trusted beyond those it shares with the coarser.
const INDEPENDENCE: f64 = 10.0;
/// Longest row of nodes.
const ROW: usize = 32;
/// Nodes that go through together: rows are filled up to whole lanes, and their length is known when they are compiled.
const LANES: usize = 8;
/// Nodes of a whole circle at each level, divisors of [`TURN`].
const WHOLE: [usize; 12] = [12, 16, 24, 32, 48, 64, 96, 192, 384, 768, 1536, 3072];
/// Directions kept for whole circles.
const TURN: usize = 3072;

/// An integral by the finer rule, its estimated error, and its nodes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Integral {
    pub value: f64,
    pub err: f64,
    pub nodes: usize,
}

/// How the nodes of a piece are laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// Evenly.
    Plain,
    /// Crowded at the start, over this scale.
    FromStart(f64),
    /// Crowded at the end, over this scale.
    FromEnd(f64),
    /// Crowded at both ends, for powers.
    Clustered,
}

/// The integrand along a circle.
pub(super) struct CircleIntegrand<'a> {
    pub ground: &'a Ground,
    pub facet: &'a Facet<'a>,
    pub circle: &'a Circle,
}

/// A Gauss-Kronrod pair of at most [`ROW`] nodes, filled up to whole lanes with nodes of weight 0.
struct Row {
    nodes: usize,
    x: [f64; ROW],
    fine: [f64; ROW],
    coarse: [f64; ROW],
    coarsest: [f64; ROW],
}

/// Every pair as a row.
fn rows() -> &'static [Row] {
    static ROWS: OnceLock<Vec<Row>> = OnceLock::new();
    let filled = |values: &[f64]| std::array::from_fn(|j| values.get(j).copied().unwrap_or(0.0));
    let row = |pair: &Pair| Row {
        nodes: pair.x.len(),
        x: filled(&pair.x),
        fine: filled(&pair.fine),
        coarse: filled(&pair.coarse),
        coarsest: filled(&pair.coarsest),
    };
    ROWS.get_or_init(|| kronrod().iter().map(row).collect())
}

/// Σ a b in lanes, then over the lanes: the same order on every machine.
#[inline(always)]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut lanes = [0.0; LANES];
    for j in 0..N {
        lanes[j % LANES] += a[j] * b[j];
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

impl CircleIntegrand<'_> {
    /// ∫ from one angle to another (less than 180° apart); seven digits will do if `quick`.
    pub fn sum(&self, from: f64, to: f64, shape: Shape, level: usize, quick: bool) -> Integral {
        sum(self, (from, to), shape, level, quick)
    }

    #[inline(always)]
    fn sum_inline(&self, ends: (f64, f64), shape: Shape, level: usize, quick: bool) -> Integral {
        // a graded piece has as many scales in it as its reach implies
        let reach = match shape {
            Shape::FromStart(scale) | Shape::FromEnd(scale) => {
                let z = (0.5 * (ends.1 - ends.0)).tan() / (0.5 * scale);
                // asinh z; z is above 1
                ln::<false>(z + (z * z + 1.0).sqrt())
            }
            _ => 0.0,
        };
        let level = level + extra_order(reach);
        let row = &rows()[level.min(PAIRS - 1)];
        let parts = 1_usize << (level + 1).saturating_sub(PAIRS).min(8);
        match row.nodes.div_ceil(LANES) {
            0 | 1 => self.parts::<8>(ends, shape, reach, (row, parts), quick),
            2 => self.parts::<16>(ends, shape, reach, (row, parts), quick),
            3 => self.parts::<24>(ends, shape, reach, (row, parts), quick),
            _ => self.parts::<ROW>(ends, shape, reach, (row, parts), quick),
        }
    }

    /// The sum over the parts of a piece, under the first `N` nodes of a row: their number is known when this is compiled.
    #[inline(always)]
    fn parts<const N: usize>(
        &self,
        (from, to): (f64, f64),
        shape: Shape,
        reach: f64,
        (row, parts): (&Row, usize),
        quick: bool,
    ) -> Integral {
        let mut sum = Integral::default();
        let (Some(x), Some(w), Some(v), Some(u)) = (
            row.x.first_chunk::<N>(),
            row.fine.first_chunk::<N>(),
            row.coarse.first_chunk::<N>(),
            row.coarsest.first_chunk::<N>(),
        ) else {
            return sum;
        };
        for part in 0..parts {
            let (start, step) = (part as f64 / parts as f64, 0.5 / parts as f64);
            // T = tan(Δ/2) of each node, dT/dx in `weight`
            let (mut tan, mut weight) = ([0.0; N], [0.0; N]);
            let (base, sign) = match shape {
                Shape::Plain => {
                    let t = (0.25 * (to - from)).tan();
                    for j in 0..N {
                        tan[j] = t * (2.0 * (start + step * (1.0 + x[j])) - 1.0);
                        weight[j] = 2.0 * t * step;
                    }
                    (0.5 * (from + to), 1.0)
                }
                Shape::Clustered => {
                    let t = (0.25 * (to - from)).tan();
                    for j in 0..N {
                        let (y, dy) = end_clustered(start + step * (1.0 + x[j]));
                        tan[j] = t * (2.0 * y - 1.0);
                        weight[j] = 2.0 * t * step * dy;
                    }
                    (0.5 * (from + to), 1.0)
                }
                Shape::FromStart(scale) | Shape::FromEnd(scale) => {
                    let quarter = 0.25 * scale;
                    let slope = quarter * reach * step;
                    for j in 0..N {
                        let e = exp::<false>(reach * (start + step * (1.0 + x[j])));
                        let inverse = 1.0 / e;
                        tan[j] = quarter * (e - inverse);
                        weight[j] = slope * (e + inverse);
                    }
                    if matches!(shape, Shape::FromStart(_)) { (from, 1.0) } else { (to, -1.0) }
                }
            };
            let (sin_base, cos_base) = base.sin_cos();
            let (mut cos, mut sin) = ([0.0; N], [0.0; N]);
            for j in 0..N {
                let t = tan[j];
                // cos Δ = (1 − T²)/(1 + T²), sin Δ = 2T/(1 + T²), dΔ = 2 dT/(1 + T²)
                let scale = 1.0 / (1.0 + t * t);
                let (cos_d, sin_d) = ((1.0 - t * t) * scale, sign * 2.0 * t * scale);
                cos[j] = cos_base * cos_d - sin_base * sin_d;
                sin[j] = sin_base * cos_d + cos_base * sin_d;
                weight[j] *= 2.0 * scale;
            }
            let f = self.evaluate(row.nodes, (&cos, &sin), weight, quick);
            let (fine, coarse, coarsest) = (dot(w, &f), dot(v, &f), dot(u, &f));
            let sharp = shape == Shape::Clustered || self.ground.has_kink();
            let err = if sharp { (fine - coarse).abs() } else { estimate(fine, coarse, coarsest) };
            sum += Integral { value: fine, err, nodes: row.nodes };
        }
        sum
    }

    /// ∫ over the whole circle where nothing on it changes character: equal weights converge fastest.
    pub fn whole(&self, level: usize, quick: bool) -> Integral {
        let n = WHOLE[level.min(WHOLE.len() - 1)];
        let (mut fine, mut coarse) = (0.0, 0.0);
        for start in (0..n).step_by(ROW) {
            let (every, second) = whole_row(self, start, n, quick);
            fine += every;
            coarse += second;
        }
        let step = TAU / n as f64;
        let (fine, coarse) = (fine * step, 2.0 * coarse * step);
        let err = if self.ground.has_kink() { (fine - coarse).abs() } else { estimate(fine, coarse, coarse) };
        Integral { value: fine, err, nodes: n }
    }

    /// The sums of all values and of every second one of a row of a whole circle of `n` nodes.
    #[inline(always)]
    fn whole_row_inline<const N: usize>(&self, start: usize, n: usize, quick: bool) -> (f64, f64) {
        let (stride, directions, count) = (TURN / n, directions(), N.min(n - start));
        let (mut cos, mut sin, mut weight, mut second) = ([1.0; N], [0.0; N], [0.0; N], [0.0; N]);
        for j in 0..count {
            (sin[j], cos[j]) = directions[(start + j) * stride];
            weight[j] = 1.0;
            second[j] = (1 - j % 2) as f64;
        }
        let f = self.evaluate(count, (&cos, &sin), weight, quick);
        (dot(&weight, &f), dot(&second, &f))
    }

    /// Multiplies by the radiance of ground with a lobe.
    #[inline(always)]
    fn shine<const N: usize, const QUICK: bool>(
        &self,
        (cos, per_delta): (&[f64; N], &[f64; N]),
        weight: &mut [f64; N],
        (diffuse, peak, n): (f64, f64, f64),
    ) {
        let (height, glint) = (self.circle.height, self.circle.glint);
        for j in 0..N {
            let lobe = positive_power::<QUICK>((glint.0 + glint.1 * cos[j]) * per_delta[j], n);
            weight[j] *= (height.0 + height.1 * cos[j]).max(0.0) * (diffuse + peak * lobe);
        }
    }

    /// weight · L f (n·w) at the nodes (cos u, sin u) of a row, of which the first `nodes` count.
    #[inline(always)]
    fn evaluate<const N: usize>(
        &self,
        nodes: usize,
        (cos, sin): (&[f64; N], &[f64; N]),
        mut weight: [f64; N],
        quick: bool,
    ) -> [f64; N] {
        let (facet, circle) = (self.facet, self.circle);
        let (normal, mirror) = (&facet.normal, &facet.mirror);
        let (sin_eta, cos_eta) = circle.eta;
        // cos φ = −sin u, sin φ = cos u
        let (nx, ny, nz) = (-sin_eta * normal.x(), sin_eta * normal.y(), -cos_eta * normal.z());
        let mut per_delta = [1.0; N];
        if matches!(self.ground.law, GroundLaw::Phong { .. }) {
            self.ground.weigh(circle, (cos, sin), &mut weight, &mut per_delta);
        }
        match &self.ground.law {
            GroundLaw::Phong { diffuse, peak, n: exponent } if *peak > 0.0 => {
                let (places, law) = ((cos, &per_delta), (*diffuse, *peak, *exponent));
                if quick {
                    self.shine::<N, true>(places, &mut weight, law);
                } else {
                    self.shine::<N, false>(places, &mut weight, law);
                }
            }
            GroundLaw::Phong { diffuse, .. } => {
                for j in 0..N {
                    let height = (circle.height.0 + circle.height.1 * cos[j]).max(0.0);
                    weight[j] *= height * diffuse;
                }
            }
            GroundLaw::Other(_) => {
                for j in 0..nodes.min(N) {
                    weight[j] *= self.ground.radiance(circle, (cos[j], -sin[j]));
                }
            }
        }
        let mut x2 = [0.0; N];
        match facet.metric {
            Metric::None => {
                for j in 0..N {
                    weight[j] *= (nz + nx * sin[j] + ny * cos[j]).max(0.0);
                }
            }
            Metric::Chord | Metric::Plane => {
                let share = if facet.metric == Metric::Plane { 1.0 } else { 0.0 };
                let dz = -cos_eta - mirror.z();
                for j in 0..N {
                    let cos_in = nz + nx * sin[j] + ny * cos[j];
                    let (dx, dy) = (-sin_eta * sin[j] - mirror.x(), sin_eta * cos[j] - mirror.y());
                    // n·δ = n·w − n·m
                    let off = normal.x() * dx + normal.y() * dy + normal.z() * dz;
                    x2[j] = (dx * dx + dy * dy + dz * dz - share * off * off).max(0.0);
                    weight[j] *= cos_in.max(0.0);
                }
            }
        }
        let mut f = [0.0; N];
        if facet.law.needs_v() {
            for j in 0..nodes.min(N) {
                let w = circle.direction((cos[j], -sin[j]));
                // V = −o_t·w_t
                let v = facet.cos_out * normal.dot(&w) - facet.observer.dot(&w);
                f[j] = facet.law.value_at(x2[j].sqrt(), v);
            }
        } else {
            facet.law.fill(&x2, &mut f, nodes, quick);
        }
        for j in 0..N {
            f[j] *= weight[j];
        }
        f
    }
}

/// [`CircleIntegrand::sum`] at the width of the machine it runs on; the sums add in the same order on every machine.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn sum(of: &CircleIntegrand, ends: (f64, f64), shape: Shape, level: usize, quick: bool) -> Integral {
    of.sum_inline(ends, shape, level, quick)
}

/// [`CircleIntegrand::whole_row_inline`] at the width of the machine it runs on.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn whole_row(of: &CircleIntegrand, start: usize, n: usize, quick: bool) -> (f64, f64) {
    match (n - start).min(ROW).div_ceil(LANES) {
        0..=2 => of.whole_row_inline::<16>(start, n, quick),
        3 => of.whole_row_inline::<24>(start, n, quick),
        _ => of.whole_row_inline::<ROW>(start, n, quick),
    }
}

/// Orders a graded piece is to be above one that is not, from its reach in units of its scale, asinh(length/scale).
pub(super) fn extra_order(reach: f64) -> usize {
    usize::from(reach > 2.5) + usize::from(reach > 4.5)
}

/// Estimated error of the finest of three sums: how far they are apart, less where they agree to many digits.
///
/// `a min(1, sqrt(10 a/F))` with a the larger of the two differences: the finest rule has at least half as many digits
/// again. The integrand is positive, so that F itself is its size.
pub(super) fn estimate(fine: f64, coarse: f64, coarsest: f64) -> f64 {
    let apart = (fine - coarse).abs().max((fine - coarsest).abs());
    let relative = apart / fine.abs().max(1e-300);
    apart * (INDEPENDENCE * relative).sqrt().min(1.0) + 2e-16 * fine.abs()
}

/// (sin u, cos u) of equal steps about the circle.
fn directions() -> &'static [(f64, f64)] {
    static DIRECTIONS: OnceLock<Vec<(f64, f64)>> = OnceLock::new();
    DIRECTIONS.get_or_init(|| (0..TURN).map(|j| (TAU * j as f64 / TURN as f64).sin_cos()).collect())
}

impl Add for Integral {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, err: self.err + o.err, nodes: self.nodes + o.nodes }
    }
}

impl AddAssign for Integral {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
