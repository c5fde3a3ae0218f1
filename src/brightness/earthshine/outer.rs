//! The range of ζ cut where a ring changes character, and the changes of variable that make each span smooth.
//!
//! ζ in rad. Tangencies of terminator, horizon and lobe ends, corners, the lobe's nearest place and the ends of its
//! reach are all found beforehand, so that no rule is laid across one.

use super::edge::Edge;
use super::edge::GRADED_FROM;
use super::edge::WIDE;
use std::f64::consts::FRAC_PI_2;

use super::corners::corners;
use super::facet::Facet;
use super::lobe::lobe;
use super::piece::extra_order;
use super::profile::Metric;
use super::ring::Rings;
use crate::base::quadrature::{end_clustered, smooth_step};
use crate::brightness::ground::Ground;

/// Edges closer than this are one \[rad\].
const SAME_RAD: f64 = 1e-14;

/// One range of ζ and its variable t, 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    from: f64,
    to: f64,
    shape: SpanShape,
    grade: Grade,
}

/// How t crowds at the ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum SpanShape {
    Plain,
    RootBefore,
    RootBehind,
    Roots,
    Clustered,
}

/// The end about which ζ is graded, with the scale.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Grade {
    No,
    FromStart { scale: f64, reach: f64 },
    FromEnd { scale: f64, reach: f64 },
}

impl Span {
    /// ζ at t and dζ/dt.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let (x, dx) = match self.shape {
            SpanShape::Plain => (t, 1.0),
            SpanShape::RootBefore => (t * t, 2.0 * t),
            SpanShape::RootBehind => (t * (2.0 - t), 2.0 * (1.0 - t)),
            SpanShape::Roots => smooth_step(t),
            SpanShape::Clustered => end_clustered(t),
        };
        match self.grade {
            Grade::No => (self.from + (self.to - self.from) * x, (self.to - self.from) * dx),
            Grade::FromStart { scale, reach } => {
                let (sinh, cosh) = hyperbolic(reach * x);
                (self.from + scale * sinh, scale * reach * cosh * dx)
            }
            Grade::FromEnd { scale, reach } => {
                let (sinh, cosh) = hyperbolic(reach * (1.0 - x));
                (self.to - scale * sinh, scale * reach * cosh * dx)
            }
        }
    }

    /// Orders this span is to be above a plain one.
    pub fn extra_order(&self) -> usize {
        match self.grade {
            Grade::No => 0,
            Grade::FromStart { reach, .. } | Grade::FromEnd { reach, .. } => extra_order(reach),
        }
    }

    /// An end of the span is a branch point or a step.
    pub fn is_sharp(&self) -> bool {
        self.shape == SpanShape::Clustered
    }

    /// The middle of the span.
    pub fn middle(&self) -> f64 {
        0.5 * (self.from + self.to)
    }

    /// The spans between two edges: one, or two where both ends want a variable of their own.
    fn between(a: &Edge, b: &Edge, spans: &mut Vec<Span>) {
        let length = b.zeta - a.zeta;
        let (start, end) = (a.behind * GRADED_FROM < length, b.before * GRADED_FROM < length);
        if (start && (end || b.sharp)) || (end && a.sharp) {
            let middle = Edge::plain(0.5 * (a.zeta + b.zeta));
            Span::between(a, &middle, spans);
            Span::between(&middle, b, spans);
            return;
        }
        let shape = match (a.root, b.root) {
            _ if a.sharp || b.sharp => SpanShape::Clustered,
            (false, false) => SpanShape::Plain,
            (true, false) => SpanShape::RootBefore,
            (false, true) => SpanShape::RootBehind,
            (true, true) => SpanShape::Roots,
        };
        let reach = |scale: f64| (length / scale).asinh();
        let grade = if start {
            let scale = a.behind.max(1e-12);
            Grade::FromStart { scale, reach: reach(scale) }
        } else if end {
            let scale = b.before.max(1e-12);
            Grade::FromEnd { scale, reach: reach(scale) }
        } else {
            Grade::No
        };
        spans.push(Span { from: a.zeta, to: b.zeta, shape, grade });
    }
}

/// sinh and cosh.
fn hyperbolic(x: f64) -> (f64, f64) {
    let e = x.exp();
    (0.5 * (e - 1.0 / e), 0.5 * (e + 1.0 / e))
}

/// The spans of one integral; sets the reach of a lobe that falls off.
pub(super) fn spans(rings: &mut Rings, drop: f64) -> Vec<Span> {
    let (ground, facet) = (rings.ground, rings.facet);
    let mut edges = Vec::with_capacity(16);
    let horizon = ground.zeta_of_nadir_angle(Facet::tangent_nadir_angle(&facet.normal));
    let terminator = ground.terminator_zeta();
    let mut low = 0.0_f64;
    if ground.lit_rad < 0.0 {
        // within that distance all is dark
        let Some(zeta) = terminator else { return Vec::new() };
        low = zeta;
    }
    if facet.normal.z() > 0.0 {
        // a level normal up to rounding touches at the nadir itself
        if Facet::tangent_nadir_angle(&facet.normal) > 0.0 {
            let Some(zeta) = horizon else { return Vec::new() };
            low = low.max(zeta);
        }
    }
    edges.extend([Edge::plain(low), Edge::plain(FRAC_PI_2)]);
    // an edge that passes close by the nadir turns about it within a ring of its own distance
    let touching = |zeta: f64| {
        let behind = if rings.careful { zeta.max(rings.detail) } else { f64::INFINITY };
        Edge { root: true, behind, ..Edge::plain(zeta) }
    };
    edges.extend(terminator.map(touching));
    edges.extend(horizon.map(touching));
    if facet.law.lobe_exponent().is_some_and(|n| n < rings.smooth_exponent) {
        let zeta = ground.zeta_of_nadir_angle(Facet::tangent_nadir_angle(&facet.mirror));
        edges.extend(zeta.map(|zeta| Edge { sharp: facet.law.ends_sharply(), ..touching(zeta) }));
    }
    if let Some(n) = ground.lobe_exponent() {
        if n < rings.smooth_exponent {
            let sharp = ground.lobe_ends_sharply();
            let tangencies = ground.lobe_edge_zetas().into_iter().flatten();
            edges.extend(tangencies.map(|zeta| Edge { sharp, ..touching(zeta) }));
        }
        if n > 8.0 {
            edges.extend(glint(ground, n));
        }
    }
    if rings.careful || facet.law.ends_sharply() || ground.lobe_ends_sharply() {
        in_order(&mut edges, low);
        let mut found = Vec::new();
        edges.windows(2).for_each(|pair| corners(rings, pair[0].zeta, pair[1].zeta, &mut found));
        edges.extend(found.into_iter().map(Edge::plain));
    }
    let mut reach = f64::INFINITY;
    if facet.metric != Metric::None && facet.width < WIDE {
        reach = lobe(rings, low, drop, &mut edges);
    }
    in_order(&mut edges, low);
    let mut spans = Vec::with_capacity(edges.len());
    for pair in edges.windows(2) {
        Span::between(&pair[0], &pair[1], &mut spans);
    }
    if reach.is_finite() && facet.law.diffuse() == 0.0 {
        // beyond its reach the lobe is nothing
        let eta_mirror = facet.nadir_angle_of_mirror();
        spans.retain(|span| ((ground.k * span.middle().sin()).asin() - eta_mirror).abs() <= reach);
    }
    spans
}

/// Edges in view, rising, each once.
fn in_order(edges: &mut Vec<Edge>, low: f64) {
    edges.retain(|e| e.zeta >= low && e.zeta <= FRAC_PI_2);
    edges.sort_by(|a, b| a.zeta.total_cmp(&b.zeta));
    edges.dedup_by(|later, kept| {
        let same = later.zeta - kept.zeta < SAME_RAD;
        if same {
            kept.merge(later);
        }
        same
    });
}

/// The ring on which the light source is seen as in a mirror in the ground, ζ + θ = 90° − E.
fn glint(ground: &Ground, n: f64) -> Option<Edge> {
    let below = FRAC_PI_2 - ground.elevation_rad <= 0.0;
    let zeta = if below { 0.0 } else { ground.zeta_of_glint().unwrap_or(FRAC_PI_2) };
    let sin_eta = ground.k * zeta.sin();
    let slope = 2.0 - ground.k * zeta.cos() / (1.0 - sin_eta * sin_eta).sqrt();
    let scale = n.powf(-0.5) / slope;
    (scale < 0.5).then(|| Edge { before: scale, behind: scale, ..Edge::plain(zeta) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variable_covers_its_span_and_carries_its_own_derivative() {
        let mut spans = Vec::new();
        for root in [false, true] {
            for sharp in [false, true] {
                for scale in [f64::INFINITY, 1e-3] {
                    let a = Edge { root, sharp, before: scale, behind: scale, ..Edge::plain(0.3) };
                    Span::between(&a, &Edge::plain(0.9), &mut spans);
                    Span::between(&Edge { zeta: 0.1, ..Edge::plain(0.1) }, &a, &mut spans);
                    Span::between(&Edge { root: true, ..Edge::plain(0.1) }, &a, &mut spans);
                }
            }
        }
        for span in spans {
            assert!((span.at(0.0).0 - span.from).abs() < 1e-12 && (span.at(1.0).0 - span.to).abs() < 1e-12);
            let (step, t) = (1e-6, 0.37);
            let slope = (span.at(t + step).0 - span.at(t - step).0) / (2.0 * step);
            assert!((slope / span.at(t).1 - 1.0).abs() < 1e-6, "{span:?}");
        }
    }
}
