//! A shape made ready for counting: its angle taken apart once, its chords, its extremes, its share of a pixel.
//!
//! Pixels relative to the centre of the shape. Ovals (circle, ellipse) are conics; bars (rectangle, pill) are a straight
//! core with or without round caps. It does not cover which pixels there are.

use super::oval::{MIN_SEMI_AXIS_PX, Oval};
use super::overlap::{Polygon, unit_disc_polygon_area};
use super::shape::Shape;

/// The parts of a shape.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// A circle or an ellipse.
    Oval(Oval),
    /// |u| ≤ core and |v| ≤ half width; with caps also all within half a width of the ends (±core, 0).
    Bar { core: f64, half_width: f64, caps: bool },
}

/// A shape with its angle taken apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outline {
    kind: Kind,
    sin: f64,
    cos: f64,
}

impl Outline {
    pub(crate) fn of(shape: &Shape) -> Self {
        let (a, b, theta) = shape.axes();
        let (sin, cos) = theta.sin_cos();
        let kind = match shape {
            Shape::Circle { .. } | Shape::Ellipse { .. } => Kind::Oval(Oval::new(a, b, (sin, cos))),
            Shape::Rectangle { .. } => Kind::Bar { core: a, half_width: b, caps: false },
            Shape::Pill { .. } => {
                let cap = b.min(a);
                Kind::Bar { core: a - cap, half_width: cap, caps: true }
            }
        };
        Self { kind, sin, cos }
    }

    /// Coordinates along and across the shape.
    fn along_across(&self, dx: f64, dy: f64) -> [f64; 2] {
        [self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx]
    }

    pub(super) fn contains(&self, dx: f64, dy: f64) -> bool {
        match self.kind {
            Kind::Oval(Oval { p, q, r, .. }) => p * dx * dx + 2.0 * q * dx * dy + r * dy * dy <= 1.0,
            Kind::Bar { core, half_width, caps } => {
                let [u, v] = self.along_across(dx, dy);
                let beyond = u.abs() - core;
                if beyond <= 0.0 { v.abs() <= half_width } else { caps && beyond.hypot(v) <= half_width }
            }
        }
    }

    /// Share of the unit pixel centred at (`dx`, `dy`).
    ///
    /// Oval: polygon ∩ disc after the shape has been mapped to the unit disc. Bar: the pixel clipped to the core, and
    /// for each cap the pixel beyond the end of the core ∩ disc.
    pub(super) fn pixel_fraction(&self, dx: f64, dy: f64) -> f64 {
        let corners =
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| self.along_across(dx + x, dy + y));
        let area = match self.kind {
            Kind::Oval(Oval { a, b, .. }) => {
                let in_disc = corners.map(|[u, v]| [u / a, v / b]);
                unit_disc_polygon_area(&in_disc) * a * b
            }
            Kind::Bar { core, half_width, caps } => {
                let pixel = Polygon::new(&corners);
                let straight = pixel.below(0, core).above(0, -core).below(1, half_width).above(1, -half_width).area();
                let cap = |end: f64| {
                    let beyond = if end > 0.0 { pixel.above(0, core) } else { pixel.below(0, -core) };
                    let mut about_end = [[0.0; 2]; Polygon::MOST];
                    for (at, point) in about_end.iter_mut().zip(beyond.points()) {
                        *at = [(point[0] - end * core) / half_width, point[1] / half_width];
                    }
                    unit_disc_polygon_area(&about_end[..beyond.points().len()]) * half_width * half_width
                };
                if caps { straight + cap(1.0) + cap(-1.0) } else { straight }
            }
        };
        area.clamp(0.0, 1.0)
    }

    /// The range of dx inside at `dy`.
    pub(super) fn chord(&self, dy: f64) -> Option<(f64, f64)> {
        match &self.kind {
            Kind::Oval(oval) => oval.chord(dy),
            Kind::Bar { .. } => self.line([0.0, dy], [1.0, 0.0]),
        }
    }

    /// The oval, if it is one and wide enough to be integrated row by row.
    pub(super) fn wide_oval(&self) -> Option<&Oval> {
        match &self.kind {
            Kind::Oval(oval) if oval.a.min(oval.b) >= MIN_SEMI_AXIS_PX => Some(oval),
            _ => None,
        }
    }

    /// The range of t for which `from` + t · `direction` is inside.
    pub(crate) fn line(&self, from: [f64; 2], direction: [f64; 2]) -> Option<(f64, f64)> {
        let ([x, y], [ux, uy]) = (from, direction);
        match self.kind {
            Kind::Oval(Oval { p, q, r, .. }) => {
                // A t² + 2 B t + C ≤ 0
                let (a, b) =
                    (p * ux * ux + 2.0 * q * ux * uy + r * uy * uy, p * x * ux + q * (x * uy + y * ux) + r * y * uy);
                let c = p * x * x + 2.0 * q * x * y + r * y * y - 1.0;
                let root = b * b - a * c;
                (root >= 0.0).then(|| {
                    let (mid, half) = (-b / a, root.sqrt() / a);
                    (mid - half, mid + half)
                })
            }
            Kind::Bar { core, half_width, caps } => {
                let ([u, v], [du, dv]) = (self.along_across(x, y), self.along_across(ux, uy));
                let straight = between(du, u, core)
                    .zip(between(dv, v, half_width))
                    .map(|((l0, r0), (l1, r1))| (l0.max(l1), r0.min(r1)))
                    .filter(|(l, r)| l <= r);
                if !caps {
                    return straight;
                }
                let d2 = du * du + dv * dv;
                let cap = |end: f64| {
                    // distance of the end from the line, from the cross product: no cancellation
                    let (toward, aside) = ((end - u) * du - v * dv, (end - u) * dv + v * du);
                    let root = half_width * half_width * d2 - aside * aside;
                    (root >= 0.0).then(|| ((toward - root.sqrt()) / d2, (toward + root.sqrt()) / d2))
                };
                // the pill is convex: its chord is the hull of the chords of its parts
                [straight, cap(core), cap(-core)].into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            }
        }
    }

    /// Largest dx of the shape and a dy where it is reached.
    pub(super) fn rightmost(&self) -> (f64, f64) {
        match self.kind {
            Kind::Oval(Oval { x_max, right_y, .. }) => (x_max, right_y),
            Kind::Bar { core, half_width, caps } => {
                let ahead = core * self.cos.signum();
                if caps {
                    return (ahead * self.cos + half_width, ahead * self.sin);
                }
                let aside = -half_width * self.sin.signum();
                (ahead * self.cos - aside * self.sin, ahead * self.sin + aside * self.cos)
            }
        }
    }

    /// Largest dy of the shape.
    pub(super) fn top(&self) -> f64 {
        match self.kind {
            Kind::Oval(Oval { y_max, .. }) => y_max,
            Kind::Bar { core, half_width, caps } => {
                core * self.sin.abs() + half_width * if caps { 1.0 } else { self.cos.abs() }
            }
        }
    }
}

/// The x with |slope·x + offset| ≤ limit.
fn between(slope: f64, offset: f64, limit: f64) -> Option<(f64, f64)> {
    if slope == 0.0 {
        return (offset.abs() <= limit).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (one, other) = ((-limit - offset) / slope, (limit - offset) / slope);
    Some((one.min(other), one.max(other)))
}
