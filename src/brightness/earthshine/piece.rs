//! One piece of a circle under one rule: the nodes, the ground's light, the law, two sums.
//!
//! Angles in rad, results in 1/sr. With T = tan(Δ/2) the nodes need no sine or cosine; graded pieces put them at
//! T ∝ sinh, so that a lobe of any width takes as many as its logarithm. Rows of at most 31 nodes go through together.

use std::f64::consts::TAU;
use std::ops::{Add, AddAssign};
use std::sync::OnceLock;

use multiversion::multiversion;

use super::arithmetic::{exp, positive_power};
use super::facet::Facet;
use super::profile::Metric;
use crate::base::quadrature::{PAIRS, Pair, end_clustered, kronrod};
use crate::brightness::ground::{Circle, Ground, GroundLaw};

/// How far the digits of the finer rule are trusted beyond those it shares with the coarser.
const INDEPENDENCE: f64 = 10.0;
/// Longest row of nodes.
const ROW: usize = 32;
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

/// Rows of node quantities, used again for every piece.
pub(super) struct Scratch {
    /// Seven digits will do.
    pub quick: bool,
    rules: &'static [Pair; PAIRS],
    cos: [f64; ROW],
    sin: [f64; ROW],
    weight: [f64; ROW],
    x2: [f64; ROW],
    f: [f64; ROW],
    per_delta: [f64; ROW],
}

impl Scratch {
    pub fn new(quick: bool) -> Self {
        let row = [0.0; ROW];
        Self { quick, rules: kronrod(), cos: row, sin: row, weight: row, x2: row, f: row, per_delta: [1.0; ROW] }
    }
}

impl CircleIntegrand<'_> {
    /// ∫ from one angle to another (less than 180° apart).
    pub fn sum(&self, from: f64, to: f64, shape: Shape, level: usize, scratch: &mut Scratch) -> Integral {
        sum(self, (from, to), shape, level, scratch)
    }

    #[inline(always)]
    fn sum_inline(&self, (from, to): (f64, f64), shape: Shape, level: usize, scratch: &mut Scratch) -> Integral {
        // a graded piece has as many scales in it as its reach implies
        let reach = match shape {
            Shape::FromStart(scale) | Shape::FromEnd(scale) => ((0.5 * (to - from)).tan() / (0.5 * scale)).asinh(),
            _ => 0.0,
        };
        let level = level + extra_order(reach);
        let rule = &scratch.rules[level.min(PAIRS - 1)];
        let parts = 1_usize << (level + 1).saturating_sub(PAIRS).min(8);
        let n = rule.x.len();
        let mut sum = Integral::default();
        for part in 0..parts {
            let (start, step) = (part as f64 / parts as f64, 0.5 / parts as f64);
            let Scratch { cos, sin, weight, .. } = scratch;
            let (x, cos, sin, weight) = (&rule.x[..n], &mut cos[..n], &mut sin[..n], &mut weight[..n]);
            // T = tan(Δ/2) of each node in `cos`, dT/dx in `weight`
            let (base, sign) = match shape {
                Shape::Plain => {
                    let t = (0.25 * (to - from)).tan();
                    for j in 0..n {
                        cos[j] = t * (2.0 * (start + step * (1.0 + x[j])) - 1.0);
                        weight[j] = 2.0 * t * step;
                    }
                    (0.5 * (from + to), 1.0)
                }
                Shape::Clustered => {
                    let t = (0.25 * (to - from)).tan();
                    for j in 0..n {
                        let (y, dy) = end_clustered(start + step * (1.0 + x[j]));
                        cos[j] = t * (2.0 * y - 1.0);
                        weight[j] = 2.0 * t * step * dy;
                    }
                    (0.5 * (from + to), 1.0)
                }
                Shape::FromStart(scale) | Shape::FromEnd(scale) => {
                    let quarter = 0.25 * scale;
                    let slope = quarter * reach * step;
                    for j in 0..n {
                        let e = exp::<false>(reach * (start + step * (1.0 + x[j])));
                        let inverse = 1.0 / e;
                        cos[j] = quarter * (e - inverse);
                        weight[j] = slope * (e + inverse);
                    }
                    if matches!(shape, Shape::FromStart(_)) { (from, 1.0) } else { (to, -1.0) }
                }
            };
            let (sin_base, cos_base) = base.sin_cos();
            for j in 0..n {
                let t = cos[j];
                // cos Δ = (1 − T²)/(1 + T²), sin Δ = 2T/(1 + T²), dΔ = 2 dT/(1 + T²)
                let scale = 1.0 / (1.0 + t * t);
                let (cos_d, sin_d) = ((1.0 - t * t) * scale, sign * 2.0 * t * scale);
                cos[j] = cos_base * cos_d - sin_base * sin_d;
                sin[j] = sin_base * cos_d + cos_base * sin_d;
                weight[j] *= 2.0 * scale;
            }
            self.evaluate(n, scratch);
            let (mut fine, mut coarse, mut coarsest) = (0.0, 0.0, 0.0);
            let (f, w, v, u) = (&scratch.f[..n], &rule.fine[..n], &rule.coarse[..n], &rule.coarsest[..n]);
            for j in 0..n {
                fine += w[j] * f[j];
                coarse += v[j] * f[j];
                coarsest += u[j] * f[j];
            }
            let sharp = shape == Shape::Clustered || self.ground.has_kink();
            let err = if sharp { (fine - coarse).abs() } else { estimate(fine, coarse, coarsest) };
            sum += Integral { value: fine, err, nodes: n };
        }
        sum
    }

    /// ∫ over the whole circle where nothing on it changes character: equal weights converge fastest.
    pub fn whole(&self, level: usize, scratch: &mut Scratch) -> Integral {
        let n = WHOLE[level.min(WHOLE.len() - 1)];
        let (stride, directions) = (TURN / n, directions());
        let (mut fine, mut coarse) = (0.0, 0.0);
        for start in (0..n).step_by(ROW) {
            let count = ROW.min(n - start);
            for j in 0..count {
                (scratch.sin[j], scratch.cos[j]) = directions[(start + j) * stride];
                scratch.weight[j] = 1.0;
            }
            evaluate(self, count, scratch);
            fine += scratch.f[..count].iter().sum::<f64>();
            coarse += scratch.f[..count].iter().step_by(2).sum::<f64>();
        }
        let step = TAU / n as f64;
        let (fine, coarse) = (fine * step, 2.0 * coarse * step);
        let err = if self.ground.has_kink() { (fine - coarse).abs() } else { estimate(fine, coarse, coarse) };
        Integral { value: fine, err, nodes: n }
    }

    /// Multiplies by the radiance of ground with a lobe.
    #[inline(always)]
    fn shine<const QUICK: bool>(
        &self,
        (cos, per_delta): (&[f64], &[f64]),
        weight: &mut [f64],
        (diffuse, peak, n): (f64, f64, f64),
    ) {
        let (height, glint) = (self.circle.height, self.circle.glint);
        let nodes = weight.len();
        let (cos, per_delta) = (&cos[..nodes], &per_delta[..nodes]);
        for j in 0..nodes {
            let lobe = positive_power::<QUICK>((glint.0 + glint.1 * cos[j]) * per_delta[j], n);
            weight[j] *= (height.0 + height.1 * cos[j]).max(0.0) * (diffuse + peak * lobe);
        }
    }

    /// weight · L f (n·w) at the nodes (cos u, sin u) of a row, into `f`.
    #[inline(always)]
    fn evaluate(&self, n: usize, scratch: &mut Scratch) {
        let Scratch { quick, cos, sin, weight, x2, f, per_delta, .. } = scratch;
        let quick = *quick;
        let (cos, sin, weight, x2, f) = (&cos[..n], &sin[..n], &mut weight[..n], &mut x2[..n], &mut f[..n]);
        let (facet, circle) = (self.facet, self.circle);
        let (normal, mirror) = (&facet.normal, &facet.mirror);
        let (sin_eta, cos_eta) = circle.eta;
        // cos φ = −sin u, sin φ = cos u
        let (nx, ny, nz) = (-sin_eta * normal.x(), sin_eta * normal.y(), -cos_eta * normal.z());
        if matches!(self.ground.law, GroundLaw::Phong { .. }) {
            self.ground.weigh(circle, (cos, sin), weight, &mut per_delta[..n]);
        }
        match &self.ground.law {
            GroundLaw::Phong { diffuse, peak, n: exponent } if *peak > 0.0 => {
                let (places, law) = ((cos, &per_delta[..n]), (*diffuse, *peak, *exponent));
                if quick {
                    self.shine::<true>(places, weight, law);
                } else {
                    self.shine::<false>(places, weight, law);
                }
            }
            GroundLaw::Phong { diffuse, .. } => {
                for j in 0..cos.len() {
                    let height = (circle.height.0 + circle.height.1 * cos[j]).max(0.0);
                    weight[j] *= height * diffuse;
                }
            }
            GroundLaw::Other(_) => {
                for j in 0..cos.len() {
                    weight[j] *= self.ground.radiance(circle, (cos[j], -sin[j]));
                }
            }
        }
        match facet.metric {
            Metric::None => {
                for j in 0..cos.len() {
                    weight[j] *= (nz + nx * sin[j] + ny * cos[j]).max(0.0);
                }
            }
            Metric::Chord | Metric::Plane => {
                let share = if facet.metric == Metric::Plane { 1.0 } else { 0.0 };
                let dz = -cos_eta - mirror.z();
                for j in 0..cos.len() {
                    let cos_in = nz + nx * sin[j] + ny * cos[j];
                    let (dx, dy) = (-sin_eta * sin[j] - mirror.x(), sin_eta * cos[j] - mirror.y());
                    // n·δ = n·w − n·m
                    let off = normal.x() * dx + normal.y() * dy + normal.z() * dz;
                    x2[j] = (dx * dx + dy * dy + dz * dz - share * off * off).max(0.0);
                    weight[j] *= cos_in.max(0.0);
                }
            }
        }
        if facet.law.needs_v() {
            for j in 0..cos.len() {
                let w = circle.direction((cos[j], -sin[j]));
                // V = −o_t·w_t
                let v = facet.cos_out * normal.dot(&w) - facet.observer.dot(&w);
                f[j] = facet.law.value_at(x2[j].sqrt(), v);
            }
        } else {
            facet.law.fill(x2, f, quick);
        }
        for j in 0..f.len() {
            f[j] *= weight[j];
        }
    }
}

/// [`CircleIntegrand::sum`] at the width of the machine it runs on; the sums add in the same order on every machine.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn sum(of: &CircleIntegrand, ends: (f64, f64), shape: Shape, level: usize, scratch: &mut Scratch) -> Integral {
    of.sum_inline(ends, shape, level, scratch)
}

/// [`CircleIntegrand::evaluate`] at the width of the machine it runs on.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn evaluate(of: &CircleIntegrand, n: usize, scratch: &mut Scratch) {
    of.evaluate(n, scratch);
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
