//! The adaptive sum: panels in ζ, each with an order for ζ and one for the rings, the worse of the two refined first.
//!
//! Values and errors in 1/sr. Deterministic; work is bounded by the nodes allowed.

use super::facet::Facet;
use super::outer::{Span, spans};
use super::piece::{Integral, estimate};
use super::ring::Rings;
use super::{Accuracy, ReflectedLight, TOLERANCE_MIN};
use crate::base::quadrature::{PAIRS, kronrod};
use crate::brightness::ground::Ground;

/// The order in ζ from which a panel is halved instead, and the order of its halves.
const ORDER_MAX: usize = PAIRS - 2;
const ORDER_OF_HALVES: usize = 3;
/// Levels of the rings: the pairs, then the last pair on 2, 4, … 64 parts.
const RING_LEVELS: usize = PAIRS + 6;
/// From this tolerance on seven digits of the nodes will do.
const QUICK_FROM: f64 = 3e-7;
/// Below this tolerance weak singularities are taken care of.
const CAREFUL_BELOW: f64 = 3e-5;
/// What is to be met by refinement is this much more than the rules tell, and where a lobe ends in a step or a branch
/// point.
const SAFETY: f64 = 2.0;
const SHARP_SAFETY: f64 = 6.0;
/// What is stated is as much more again, up to the error that is wanted; of a careful integral that is part of what is to be
/// met, because one in a thousand of them would otherwise be off by 2 to 14 times that error.
const CAUTION: f64 = 3.0;
/// From this share of its upper bound on that need not be known the lowest orders begin an integral: the bound is five to ten times
/// it, and they know a per cent of it.
const FEW_DIGITS: f64 = 1e-3;
/// Levels the rings go up at a time.
const RING_STEP: usize = 2;
/// Narrowest panel in the variable of its span.
const NARROWEST: f64 = 1e-8;

/// A part of a span with its orders.
#[derive(Debug, Clone, Copy)]
struct Panel {
    span: Span,
    from: f64,
    to: f64,
    order: usize,
    ring_level: usize,
    value: f64,
    err_outer: f64,
    err_rings: f64,
    safety: f64,
}

/// No error below this share of the tolerance is stated: rules agree by chance, and rounding is not nothing.
const LEAST_SHARE: f64 = 0.1;

/// The integral to the requested accuracy.
pub(super) fn integrate(ground: &Ground, facet: &Facet, accuracy: &Accuracy) -> ReflectedLight {
    let mut light = panels(ground, facet, accuracy);
    // a careful integral has it already
    let careful = accuracy.tolerance < CAREFUL_BELOW;
    let caution = if careful { 1.0 } else { CAUTION };
    let cautious = (caution * light.err_per_sr).min(accuracy.wanted(light.per_sr));
    let least = LEAST_SHARE * accuracy.tolerance.max(TOLERANCE_MIN) * light.per_sr;
    light.err_per_sr = light.err_per_sr.max(cautious).max(least);
    light
}

/// The integral in panels in ζ.
fn panels(ground: &Ground, facet: &Facet, accuracy: &Accuracy) -> ReflectedLight {
    let tolerance = if accuracy.tolerance > TOLERANCE_MIN { accuracy.tolerance } else { TOLERANCE_MIN };
    let careful = tolerance < CAREFUL_BELOW;
    let mut rings = Rings {
        ground,
        facet,
        window2: f64::INFINITY,
        middle: (6.0 * tolerance.powf(0.25)).clamp(0.01, 1.0),
        smooth_exponent: if careful { 12.0 } else { 4.0 },
        careful,
        detail: 0.1 * tolerance.sqrt(),
    };
    let spans = spans(&mut rings, 20.0 - 1.3 * tolerance.ln());
    let level = match tolerance {
        // what is small compared with the other lights may need next to nothing
        _ if accuracy.floor_per_sr > FEW_DIGITS * accuracy.at_most_per_sr => 0,
        // from lower down a lobed law gets there in steps that cost half as much again
        t if t >= 1e-5 => 2,
        t if t >= 1e-7 => 3,
        _ => 4,
    };
    let quick = tolerance >= QUICK_FROM;
    let mut nodes = 0;
    let mut panels: Vec<Panel> = spans
        .into_iter()
        .map(|span| {
            let order = (level + span.extra_order()).min(ORDER_MAX);
            Panel::new(&rings, span, (0.0, 1.0), (order, level), quick, &mut nodes)
        })
        .collect();
    loop {
        let per_sr: f64 = panels.iter().map(|p| p.value).sum();
        let err_per_sr: f64 = panels.iter().map(Panel::err).sum();
        let done = ReflectedLight { per_sr, err_per_sr, nodes };
        if err_per_sr <= accuracy.wanted(per_sr) || nodes >= accuracy.max_nodes {
            return done;
        }
        let open = panels.iter().enumerate().filter(|(_, p)| p.can_be_refined());
        let Some((worst, _)) = open.max_by(|a, b| a.1.err().total_cmp(&b.1.err())) else { return done };
        let p = panels[worst];
        let mut again = |ends, orders| Panel::new(&rings, p.span, ends, orders, quick, &mut nodes);
        if p.wants_rings() {
            panels[worst] = again((p.from, p.to), (p.order, p.ring_level + RING_STEP));
        } else if p.order < ORDER_MAX {
            panels[worst] = again((p.from, p.to), (p.order + 1, p.ring_level));
        } else {
            let middle = 0.5 * (p.from + p.to);
            panels[worst] = again((p.from, middle), (ORDER_OF_HALVES, p.ring_level));
            panels.push(again((middle, p.to), (ORDER_OF_HALVES, p.ring_level)));
        }
    }
}

impl Panel {
    fn new(
        rings: &Rings,
        span: Span,
        (from, to): (f64, f64),
        (order, ring_level): (usize, usize),
        quick: bool,
        nodes: &mut usize,
    ) -> Self {
        let rule = &kronrod()[order];
        let half = 0.5 * (to - from);
        let (mut fine, mut coarse, mut coarsest, mut err_rings) = (0.0, 0.0, 0.0, 0.0);
        for j in 0..rule.x.len() {
            let (zeta, slope) = span.at(from + half * (1.0 + rule.x[j]));
            let circle = rings.ground.circle(zeta);
            let Integral { value, err, nodes: n } = rings.integral(&circle, ring_level, quick);
            let weight = half * slope * circle.solid_angle;
            fine += rule.fine[j] * weight * value;
            coarse += rule.coarse[j] * weight * value;
            coarsest += rule.coarsest[j] * weight * value;
            err_rings += rule.fine[j] * weight * err;
            *nodes += n;
        }
        let err_outer = if span.is_sharp() || rings.ground.has_kink() {
            (fine - coarse).abs()
        } else {
            estimate(fine, coarse, coarsest)
        };
        let sharp = rings.careful && (rings.facet.law.ends_sharply() || rings.ground.lobe_ends_sharply());
        let safety = if sharp { SHARP_SAFETY } else { SAFETY } * if rings.careful { CAUTION } else { 1.0 };
        Self { span, from, to, order, ring_level, value: fine, err_outer, err_rings, safety }
    }

    fn err(&self) -> f64 {
        self.safety * (self.err_outer + self.err_rings)
    }

    /// The rings are the worse of the two.
    fn wants_rings(&self) -> bool {
        self.ring_level + 1 < RING_LEVELS && (self.err_rings > self.err_outer || self.to - self.from < NARROWEST)
    }

    fn can_be_refined(&self) -> bool {
        self.wants_rings() || self.to - self.from >= NARROWEST
    }
}
