//! One circle of the view: its lit arcs in front of the surface, cut where the integrand changes character.
//!
//! Angles u = φ − 90° in rad. Every end is closed form: terminator, surface horizon, ends of both lobes. The result is
//! ∫ L f (n·w) du \[1/sr\] with the estimated error of that.

use std::f64::consts::{PI, TAU};

use super::facet::{Facet, Nearest, wrapped};
use super::piece::{CircleIntegrand, Integral, Shape};
use super::profile::Metric;
use crate::brightness::ground::{Circle, Ground};

/// Longest piece one rule covers \[rad\].
const PIECE_RAD: f64 = 2.2;
/// Rounding of a node's light, relative where nothing cancels.
const ROUNDING: f64 = 4e-16;
/// Error of the quick forms.
const QUICK_ERROR: f64 = 1e-8;
/// A piece longer than this many scales is graded.
const GRADED_FROM: f64 = 2.0;
/// Lobes wider than this are left to the rule \[rad\].
const WIDE_RAD: f64 = 0.5;
/// The same for the ground's.
const NARROW_RAD: f64 = 0.2;
/// More marks than one circle can have.
const MARKS: usize = 20;

/// A place on the circle where pieces meet.
#[derive(Debug, Clone, Copy)]
struct Mark {
    u: f64,
    /// Over this distance the integrand changes here; infinite where nothing special happens.
    scale: f64,
    /// A branch point or step of a lobe's end.
    sharp: bool,
}

/// Marks in a row.
struct Marks {
    list: [Mark; MARKS],
    count: usize,
}

/// What all rings of one integral have in common.
pub(super) struct Rings<'a> {
    pub ground: &'a Ground,
    pub facet: &'a Facet<'a>,
    /// Squared distance beyond which a lobe that falls off is nothing.
    pub window2: f64,
    /// Share of a lobe's width that counts as its middle: small where a cusp is to be resolved.
    pub middle: f64,
    /// Lobes of smaller exponent are cut where they end; the rule does not see the end of others.
    pub smooth_exponent: f64,
    /// The accuracy is so high that weak singularities count: corners, edges close by the nadir.
    pub careful: bool,
    /// Rings smaller than this do not count \[rad\].
    pub detail: f64,
}

/// An arc ends where the ground's lobe does if the two are as close \[rad\].
const SAME_PLACE_RAD: f64 = 1e-7;

/// Up to two arcs, or the whole circle.
pub(super) enum Arcs {
    Whole,
    Some([(f64, f64); 2], usize),
}

impl Rings<'_> {
    /// The lit arcs in front of the surface.
    pub fn arcs(&self, circle: &Circle) -> Arcs {
        let none = Arcs::Some([(0.0, 0.0); 2], 0);
        let Some(lit) = half_angle(circle.height) else { return none };
        let Some(front) = half_angle(self.facet.front(circle)) else { return none };
        let centre = self.facet.u_normal;
        match (lit < PI, front < PI) {
            (false, false) => Arcs::Whole,
            (true, false) => Arcs::Some([(-lit, lit), (0.0, 0.0)], 1),
            (false, true) => Arcs::Some([(centre - front, centre + front), (0.0, 0.0)], 1),
            (true, true) => {
                let (mut arcs, mut count) = ([(0.0, 0.0); 2], 0);
                for turn in [-TAU, 0.0, TAU] {
                    let (from, to) = ((centre + turn - front).max(-lit), (centre + turn + front).min(lit));
                    if from < to && count < 2 {
                        arcs[count] = (from, to);
                        count += 1;
                    }
                }
                Arcs::Some(arcs, count)
            }
        }
    }

    /// Squared distance from the lobe's middle to the nearest lit place on the circle; `None` where nothing is lit.
    pub fn nearest_lit2(&self, circle: &Circle) -> Option<f64> {
        let nearest = self.facet.nearest(circle);
        match self.arcs(circle) {
            Arcs::Whole => Some(nearest.x2),
            Arcs::Some(_, 0) => None,
            Arcs::Some(arcs, count) => {
                let mut least = f64::INFINITY;
                for (from, to) in arcs.into_iter().take(count) {
                    let x2 = if within(nearest.u, from, to).is_some() {
                        nearest.x2
                    } else {
                        self.facet.distance2(circle, from).min(self.facet.distance2(circle, to))
                    };
                    least = least.min(x2);
                }
                Some(least)
            }
        }
    }

    /// ∫ L f (n·w) du over the circle.
    pub fn integral(&self, circle: &Circle, level: usize, quick: bool) -> Integral {
        let piece = CircleIntegrand { ground: self.ground, facet: self.facet, circle };
        let arcs = self.arcs(circle);
        if matches!(arcs, Arcs::Some(_, 0)) {
            return Integral::default();
        }
        let nearest = self.facet.nearest(circle);
        let mut sum = match arcs {
            Arcs::Whole => {
                let marks = self.marks(circle, &nearest, None);
                match marks.strongest() {
                    None => piece.whole(level, quick),
                    Some(start) => {
                        let ends = [start, Mark { u: start.u + TAU, ..start }];
                        self.along(&piece, ends, &marks, level, quick)
                    }
                }
            }
            Arcs::Some(arcs, count) => {
                let mut sum = Integral::default();
                // with the light source on the horizon the ground's lobe ends where its light does
                let lobe_end = if self.ground.lobe_ends_sharply() { half_angle(circle.glint) } else { None };
                for (from, to) in arcs.into_iter().take(count) {
                    let marks = self.marks(circle, &nearest, Some((from, to)));
                    let end = |u: f64| Mark {
                        u,
                        scale: self.scale_at_end(circle, &nearest, u, (from, to)),
                        sharp: lobe_end.is_some_and(|half| (wrapped(u).abs() - half).abs() < SAME_PLACE_RAD),
                    };
                    sum += self.along(&piece, [end(from), end(to)], &marks, level, quick);
                }
                sum
            }
        };
        // p·s is a small difference near the umbra's edge
        let height = circle.height.0 + circle.height.1;
        sum.err += sum.value * (ROUNDING / height + if quick { QUICK_ERROR } else { 0.0 });
        sum
    }

    /// Where on the circle, or on one arc of it, pieces must meet.
    fn marks(&self, circle: &Circle, nearest: &Nearest, arc: Option<(f64, f64)>) -> Marks {
        let mut marks = Marks { list: [Mark { u: 0.0, scale: 0.0, sharp: false }; MARKS], count: 0 };
        let mut push = |u: f64, scale: f64, sharp: bool| {
            let u = match arc {
                Some((from, to)) => within(u, from, to),
                None => Some(u),
            };
            if let Some(u) = u {
                marks.push(Mark { u, scale, sharp });
            }
        };
        if self.facet.metric != Metric::None {
            let scale = self.scale(nearest.x2, nearest.c);
            if scale < WIDE_RAD {
                push(nearest.u, scale, false);
            }
            if self.window2.is_finite() && nearest.c > 0.0 {
                // x² = x0² + 4c² sin²(Δ/2)
                let sine = ((self.window2 - nearest.x2).max(0.0)).sqrt() / (2.0 * nearest.c);
                if sine > 0.0 && sine < 1.0 {
                    let half = 2.0 * sine.asin();
                    push(nearest.u - half, f64::INFINITY, false);
                    push(nearest.u + half, f64::INFINITY, false);
                }
            }
            if self.facet.law.lobe_exponent().is_some_and(|n| n < self.smooth_exponent) {
                // m·w = 0
                if let Some(half) = half_angle(self.facet.lobe_side(circle)).filter(|half| *half < PI) {
                    let sharp = self.facet.law.ends_sharply();
                    push(self.facet.u_mirror - half, f64::INFINITY, sharp);
                    push(self.facet.u_mirror + half, f64::INFINITY, sharp);
                }
            }
        }
        let exponent = self.ground.lobe_exponent();
        if exponent.is_some_and(|n| n < self.smooth_exponent) {
            if let Some(half) = half_angle(circle.glint).filter(|half| *half < PI) {
                let sharp = self.ground.lobe_ends_sharply();
                push(-half, f64::INFINITY, sharp);
                push(half, f64::INFINITY, sharp);
            }
        } else if let Some(n) = exponent {
            // (a + b cos u)ⁿ falls over u = sqrt((a + b)/(n b))
            let scale = ((circle.glint.0 + circle.glint.1) / (n * circle.glint.1)).sqrt();
            if scale < NARROW_RAD {
                push(0.0, scale, false);
            }
        }
        marks
    }

    /// The length over which the lobe changes along the circle where it is nearest.
    fn scale(&self, x2: f64, c: f64) -> f64 {
        if self.facet.law.falls_off() {
            self.facet.width / c
        } else {
            0.7 * (x2 + (self.middle * self.facet.width).powi(2)).sqrt() / c
        }
    }

    /// The same at the end of an arc the nearest place is not on.
    fn scale_at_end(&self, circle: &Circle, nearest: &Nearest, u: f64, (from, to): (f64, f64)) -> f64 {
        if self.facet.metric == Metric::None || self.facet.width > 1.0 {
            return f64::INFINITY;
        }
        if nearest.c == 0.0 || within(nearest.u, from, to).is_some() {
            return f64::INFINITY;
        }
        let away = wrapped((u - nearest.u) % TAU);
        let scale = if self.facet.law.falls_off() {
            let x2 = self.facet.distance2(circle, u);
            // d ln f/du = −steepness · 2 c² sin Δ
            let slope = self.facet.law.steepness(x2) * 2.0 * nearest.c * nearest.c * away.sin().abs();
            1.0 / (slope + nearest.c / self.facet.width)
        } else {
            0.7 * (away * away + nearest.x2 / (nearest.c * nearest.c)).sqrt()
        };
        if scale < WIDE_RAD { scale } else { f64::INFINITY }
    }

    /// The sum over an arc cut at its marks.
    fn along(&self, piece: &CircleIntegrand, ends: [Mark; 2], marks: &Marks, level: usize, quick: bool) -> Integral {
        let mut row = Marks { list: [ends[0]; MARKS], count: 1 };
        for mark in &marks.list[..marks.count] {
            // on a whole circle the marks are moved behind its start
            let u = mark.u + TAU * ((ends[0].u - mark.u) / TAU).ceil().max(0.0);
            if u > ends[0].u && u < ends[1].u {
                row.push(Mark { u, ..*mark });
            }
        }
        row.list[..row.count].sort_unstable_by(|a, b| a.u.total_cmp(&b.u));
        row.push(ends[1]);
        let mut sum = Integral::default();
        for pair in row.list[..row.count].windows(2) {
            sum += self.between(piece, pair[0], pair[1], level, quick);
        }
        sum
    }

    /// The sum between two marks: one piece, or several where it is long or both ends are graded.
    fn between(&self, piece: &CircleIntegrand, from: Mark, to: Mark, level: usize, quick: bool) -> Integral {
        let length = to.u - from.u;
        if !(length > 0.0) {
            return Integral::default();
        }
        let middle = 0.5 * (from.u + to.u);
        if self.window2.is_finite()
            && self.facet.law.diffuse() == 0.0
            && self.facet.distance2(piece.circle, middle) > self.window2
        {
            return Integral::default();
        }
        let graded = |mark: &Mark| mark.scale * GRADED_FROM < length;
        let sharp = from.sharp || to.sharp;
        let plain = Mark { u: middle, scale: f64::INFINITY, sharp: false };
        if length > PIECE_RAD || (graded(&from) && (graded(&to) || to.sharp)) || (graded(&to) && from.sharp) {
            return self.between(piece, from, plain, level, quick) + self.between(piece, plain, to, level, quick);
        }
        let shape = if sharp {
            Shape::Clustered
        } else if graded(&from) {
            Shape::FromStart(from.scale.max(1e-12))
        } else if graded(&to) {
            Shape::FromEnd(to.scale.max(1e-12))
        } else {
            Shape::Plain
        };
        piece.sum(from.u, to.u, shape, level, quick)
    }
}

impl Marks {
    fn push(&mut self, mark: Mark) {
        if self.count < MARKS && mark.u.is_finite() {
            self.list[self.count] = mark;
            self.count += 1;
        }
    }

    /// The mark of smallest scale.
    fn strongest(&self) -> Option<Mark> {
        self.list[..self.count].iter().copied().min_by(|a, b| a.scale.total_cmp(&b.scale))
    }
}

/// Half of the arc on which a + b cos v > 0, b ≥ 0: π for all of it, `None` for nothing.
///
/// `tan²(v/2) = (b + a)/(b − a)`: no cancellation where the arc is a sliver.
pub(super) fn half_angle((a, b): (f64, f64)) -> Option<f64> {
    let (sum, difference) = (b + a, b - a);
    if !(sum > 0.0) {
        None
    } else if difference <= 0.0 {
        Some(PI)
    } else {
        Some(2.0 * sum.sqrt().atan2(difference.sqrt()))
    }
}

/// u plus full turns, if that is inside an arc.
fn within(u: f64, from: f64, to: f64) -> Option<f64> {
    let moved = u + TAU * ((from - u) / TAU).ceil();
    (moved > from && moved < to).then_some(moved)
}
