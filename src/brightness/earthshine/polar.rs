//! The rule of last resort, for spikes that the rings do not resolve: polar coordinates about the mirror direction.
//!
//! `w = cos γ m + sin γ e(ψ)`, angles in rad, results in 1/sr. On a ray all edges are break points and the spike is at γ = 0, so
//! that `γ = width · sinh t` makes any of them smooth and tanh-sinh rules of rising level converge; over ψ Gauss-Kronrod panels
//! are halved where they are worst. A hundred times as slow as the rings.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::facet::Facet;
use super::piece::estimate;
use super::profile::{Law, Metric};
use super::rays::{DoubleExponential, sign_changes};
use super::{Accuracy, ReflectedLight};
use crate::base::quadrature::{end_clustered, kronrod};
use crate::base::vector::Vector;
use crate::brightness::ground::{Ground, Vertical};

/// Who allows the rings fewer nodes does not get this rule, which begins with nearly as many.
pub(super) const LEAST_NODES: usize = 100_000;
/// Nodes allowed for each that the rings were allowed.
const NODES_FOR_ONE: usize = 20;
/// The pair over ψ.
const PAIR: usize = 4;
/// Longest piece of a ray in t.
const PIECE: f64 = 6.0;
/// Rays looked at for the nearest lit place.
const LOOKS: usize = 360;
/// Halvings of the first, rough sum.
const ROUGH_HALVINGS: usize = 20;
/// What is stated is this much more than the rules differ by.
const SAFETY: f64 = 6.0;

/// A value, its error and its nodes.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    value: f64,
    err: f64,
    nodes: usize,
}

/// A surface over the lit Earth.
struct Polar<'a> {
    ground: &'a Ground,
    facet: &'a Facet<'a>,
    /// Towards nadir and across, at right angles to the mirror direction.
    axes: [Vector<Vertical>; 2],
    rule: DoubleExponential,
}

/// A range of ψ: its part t of the whole between two edges.
#[derive(Debug, Clone, Copy)]
struct Panel {
    from: f64,
    width: f64,
    t: (f64, f64),
    sum: Sum,
}

/// How well a ray is wanted: relative to itself or to `scale`.
#[derive(Debug, Clone, Copy)]
struct Along {
    tolerance: f64,
    scale: f64,
}

/// The integral to the requested accuracy.
pub(super) fn integrate(ground: &Ground, facet: &Facet, accuracy: &Accuracy) -> ReflectedLight {
    let m = &facet.mirror;
    // level and across first: the other then keeps its digits where m points almost to nadir
    let across = Vector::new(-m.y(), m.x(), 0.0).unit().unwrap_or(Vector::new(1.0, 0.0, 0.0));
    let polar = Polar { ground, facet, axes: [across.cross(m), across], rule: DoubleExponential::new() };
    let edges = polar.azimuths();
    let most = NODES_FOR_ONE.saturating_mul(accuracy.max_nodes);
    let rough = polar.turn(&edges, Along { tolerance: 1e-4, scale: 0.0 }, 1e-2, 0.0, (ROUGH_HALVINGS, most));
    let along = Along { tolerance: 0.1 * accuracy.tolerance, scale: 0.01 * rough.value / TAU };
    let fine = polar.turn(&edges, along, accuracy.tolerance / SAFETY, accuracy.floor_per_sr, (usize::MAX, most));
    ReflectedLight { per_sr: fine.value, err_per_sr: SAFETY * fine.err, nodes: rough.nodes + fine.nodes }
}

impl Polar<'_> {
    /// ∫ dψ over the whole turn.
    fn turn(&self, edges: &[f64], along: Along, tolerance: f64, floor: f64, (halvings, most): (usize, usize)) -> Sum {
        let mut nodes = 0;
        let mut panel = |from: f64, width: f64, t: (f64, f64)| {
            let sum = self.panel(from, width, t, along);
            nodes += sum.nodes;
            Panel { from, width, t, sum }
        };
        let mut panels: Vec<Panel> = edges.windows(2).map(|e| panel(e[0], e[1] - e[0], (0.0, 1.0))).collect();
        let mut left = halvings;
        loop {
            let value: f64 = panels.iter().map(|p| p.sum.value).sum();
            let err: f64 = panels.iter().map(|p| p.sum.err).sum();
            let spent: usize = panels.iter().map(|p| p.sum.nodes).sum();
            let worst = (0..panels.len()).max_by(|i, j| panels[*i].sum.err.total_cmp(&panels[*j].sum.err));
            let open = err > (tolerance * value).max(floor) && left > 0 && spent < most;
            let Some(p) = worst.filter(|_| open).map(|worst| panels.swap_remove(worst)) else {
                return Sum { value, err, nodes };
            };
            let middle = 0.5 * (p.t.0 + p.t.1);
            if !(p.t.0 < middle && middle < p.t.1) {
                return Sum { value, err, nodes };
            }
            left -= 1;
            panels.push(panel(p.from, p.width, (p.t.0, middle)));
            panels.push(panel(p.from, p.width, (middle, p.t.1)));
        }
    }

    /// ∫ dψ over a part of a range between two edges.
    fn panel(&self, from: f64, width: f64, (start, end): (f64, f64), along: Along) -> Sum {
        let rule = &kronrod()[PAIR];
        let half = 0.5 * (end - start);
        let (mut fine, mut coarse, mut coarsest) = (0.0, 0.0, 0.0);
        let mut sum = Sum::default();
        for j in 0..rule.x.len() {
            let (y, dy) = end_clustered(start + half * (1.0 + rule.x[j]));
            let ray = self.ray(from + width * y, along);
            let slope = half * width * dy;
            fine += rule.fine[j] * slope * ray.value;
            coarse += rule.coarse[j] * slope * ray.value;
            coarsest += rule.coarsest[j] * slope * ray.value;
            sum.err += rule.fine[j] * slope * ray.err;
            sum.nodes += ray.nodes;
        }
        // a lobe that ends sharply ends somewhere within the panel
        let apart = (fine - coarse).abs();
        let sharp = self.ground.lobe_ends_sharply() || self.ground.has_kink() || self.facet.law.ends_sharply();
        let err = if sharp { apart } else { estimate(fine, coarse, coarsest) };
        Sum { value: fine, err: sum.err + err, nodes: sum.nodes }
    }

    /// ∫ L f (n·w) sin γ dγ along a ray.
    fn ray(&self, psi: f64, along: Along) -> Sum {
        let e = self.direction(psi);
        let Some(edges) = self.edges(&e) else { return Sum::default() };
        let (m, n) = (self.facet.mirror, self.facet.normal);
        // tangential parts, for distances in the plane of the surface
        let (e_t, m_t) = (e - n * n.dot(&e), m - n * n.dot(&m));
        let integrand = |gamma: f64| {
            let (sin, half) = (gamma.sin(), (0.5 * gamma).sin());
            let sagitta = 2.0 * half * half;
            let w = m * (1.0 - sagitta) + e * sin;
            let cos_in = self.facet.cos_out * (1.0 - sagitta) + n.dot(&e) * sin;
            if !(cos_in > 0.0) {
                return 0.0;
            }
            let x2 = if self.facet.metric == Metric::Plane {
                let apart = e_t * sin - m_t * sagitta;
                apart.dot(&apart)
            } else {
                2.0 * sagitta
            };
            self.ground.radiance_from(&w) * self.law(x2, &w) * cos_in * sin
        };
        let width = if self.facet.width < 1.0 { self.facet.width } else { 1.0 };
        let mut sum = Sum::default();
        for pair in edges.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let w = m * middle.cos() + e * middle.sin();
            if !(pair[1] > pair[0] && self.ground.radiance_from(&w) > 0.0 && n.dot(&w) > 0.0) {
                continue;
            }
            let (from, to) = ((pair[0] / width).asinh(), (pair[1] / width).asinh());
            let pieces = ((to - from) / PIECE).ceil().max(1.0);
            for piece in 0..pieces as usize {
                let at = |k: usize| from + (to - from) * k as f64 / pieces;
                let graded = |t: f64| integrand((width * t.sinh()).clamp(pair[0], pair[1])) * width * t.cosh();
                let (value, err, nodes) =
                    self.rule.integrate(graded, (at(piece), at(piece + 1)), along.tolerance, along.scale);
                sum = Sum { value: sum.value + value, err: sum.err + err, nodes: sum.nodes + nodes };
            }
        }
        sum
    }

    /// f of the surface.
    fn law(&self, x2: f64, w: &Vector<Vertical>) -> f64 {
        let law = self.facet.law;
        if law.needs_v() {
            // V = −o_t·w_t
            let v = self.facet.cos_out * self.facet.normal.dot(w) - self.facet.observer.dot(w);
            return law.value_at(x2.sqrt(), v);
        }
        let mut f = [0.0];
        law.fill(&[x2], &mut f, 1, false);
        f[0]
    }

    fn direction(&self, psi: f64) -> Vector<Vertical> {
        let (sin, cos) = psi.sin_cos();
        self.axes[0] * cos + self.axes[1] * sin
    }

    /// Limb, horizon, terminator and the ends of both lobes on a ray, rising; `None` where no ground is in front.
    fn edges(&self, e: &Vector<Vertical>) -> Option<Vec<f64>> {
        let (m, n, k) = (&self.facet.mirror, &self.facet.normal, self.ground.k);
        // the plane of the ray passes the vertical at the sine c
        let c = m.cross(e).z();
        let half = ((k - c) * (k + c)).max(0.0).sqrt().atan2(((1.0 - k) * (1.0 + k)).sqrt());
        let centre = (-e.z()).atan2(-m.z());
        let (mut low, mut high) = (centre - half, centre + half);
        if high <= 0.0 {
            (low, high) = (low + TAU, high + TAU);
        }
        low = low.max(0.0);
        high = high.min(n.dot(e).atan2(n.dot(m)) + FRAC_PI_2).min(PI);
        if !(low < high) {
            return None;
        }
        let mut edges = vec![low, high];
        if matches!(self.facet.law.law, Law::Phong { .. }) {
            edges.push(FRAC_PI_2);
        }
        let along = |gamma: f64| self.ground.altitudes_from(&(*m * gamma.cos() + *e * gamma.sin()));
        sign_changes(|gamma| along(gamma).0, (low, high), &mut edges);
        if self.ground.lobe_exponent().is_some() {
            sign_changes(|gamma| along(gamma).1, (low, high), &mut edges);
        }
        edges.retain(|gamma| *gamma >= low && *gamma <= high);
        edges.sort_by(f64::total_cmp);
        Some(edges)
    }

    /// Azimuths at which the rays change character: eighths of the turn, tangents to the limb, corners on the limb, and where
    /// lit ground is nearest to the mirror direction, more and more closely.
    fn azimuths(&self) -> Vec<f64> {
        let (m, n, k) = (&self.facet.mirror, &self.facet.normal, self.ground.k);
        let angle = |v: &Vector<Vertical>| v.dot(&self.axes[1]).atan2(v.dot(&self.axes[0])).rem_euclid(TAU);
        let mut edges: Vec<f64> = (0..=8).map(|j| TAU * f64::from(j) / 8.0).collect();
        let beyond = m.x().hypot(m.y());
        if beyond > k {
            let t = (k / beyond).asin();
            edges.extend([t, TAU - t, PI - t, PI + t]);
        }
        let on_limb = |x: f64, y: f64| Vector::new(x, y, -((1.0 - k) * (1.0 + k)).sqrt());
        if let Some((x, y)) = self.ground.terminator_on_limb() {
            edges.extend([angle(&on_limb(x, y)), angle(&on_limb(-x, y))]);
        }
        let level = n.x().hypot(n.y());
        let cosine = n.z() * ((1.0 - k) * (1.0 + k)).sqrt() / (level * k);
        if level > 0.0 && cosine.abs() <= 1.0 {
            let (at, half) = (n.y().atan2(n.x()), cosine.acos());
            edges.extend([at - half, at + half].map(|f| angle(&on_limb(k * f.cos(), k * f.sin()))));
        }
        if let Some(nearest) = self.nearest_lit() {
            let mut off = 1e-2 * self.facet.width.min(1.0);
            edges.push(nearest.rem_euclid(TAU));
            while off < 1.0 {
                edges.extend([(nearest - off).rem_euclid(TAU), (nearest + off).rem_euclid(TAU)]);
                off *= 8.0;
            }
        }
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        edges
    }

    /// ψ of the nearest lit place; `None` where the mirror direction itself is lit, or nothing.
    fn nearest_lit(&self) -> Option<f64> {
        let first = |psi: f64| {
            let e = self.direction(psi);
            let lit = |pair: &[f64]| {
                let middle = 0.5 * (pair[0] + pair[1]);
                pair[1] > pair[0]
                    && self.ground.radiance_from(&(self.facet.mirror * middle.cos() + e * middle.sin())) > 0.0
            };
            let edges = self.edges(&e)?;
            edges.windows(2).find(|pair| lit(pair)).map(|pair| pair[0])
        };
        let far = |psi: f64| first(psi).unwrap_or(f64::INFINITY);
        let step = TAU / LOOKS as f64;
        let all: Vec<f64> = (0..LOOKS).map(|j| far(step * j as f64)).collect();
        let least = (0..LOOKS).min_by(|i, j| all[*i].total_cmp(&all[*j]))?;
        if !(all[least] > 0.0 && all[least].is_finite()) {
            return None;
        }
        let (mut from, mut to) = ((least as f64 - 1.0) * step, (least as f64 + 1.0) * step);
        for _ in 0..60 {
            let (one, two) = (from + 0.45 * (to - from), from + 0.55 * (to - from));
            if far(one) < far(two) { to = two } else { from = one }
        }
        Some(0.5 * (from + to))
    }
}
