//! Apertures: circle, ellipse, rotated rectangle and pill, and the exact share of each pixel they cover.
//!
//! Pixels are unit squares centred on integers; positions in pixels, angles from +x towards +y in radians. Every shape
//! is convex and symmetric about its centre. Exact costs what 3 to 5 subpixels cost, which leave 2e-3 at r = 5 px (`satphot
//! accuracy apertures`). It does not cover growth curves, sky or masks.

mod outline;
mod oval;
mod overlap;
mod pixels;
mod ring;
mod shape;

pub use shape::Shape;

use std::f64::consts::PI;
use std::fmt;

pub(crate) use outline::Outline;
pub use pixels::{Bounds, circle_sum, for_each_pixel, shape_sum, sum_aperture};
pub(crate) use pixels::{cells, for_each_row};
pub(crate) use ring::for_each_ring_run;

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Shape {
    /// The name written in tables.
    #[doc(hidden)]
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Shape::Circle { .. } => "circle",
            Shape::Ellipse { .. } => "ellipse",
            Shape::Rectangle { .. } => "rectangle",
            Shape::Pill { .. } => "pill",
        }
    }

    /// The shape of two axes that a table names, along x; an ellipse under any other name.
    pub(crate) fn named(name: &str, a_px: f64, b_px: f64) -> Self {
        let theta_rad = 0.0;
        let shapes = [Shape::Rectangle { a_px, b_px, theta_rad }, Shape::Pill { a_px, b_px, theta_rad }];
        shapes.into_iter().find(|shape| shape.name() == name).unwrap_or(Shape::Ellipse { a_px, b_px, theta_rad })
    }

    /// Half the length, half the width \[px\] and the angle of the length \[rad\].
    #[doc(hidden)]
    #[must_use]
    pub fn axes(&self) -> (f64, f64, f64) {
        match *self {
            Shape::Circle { r_px } => (r_px, r_px, 0.0),
            Shape::Ellipse { a_px, b_px, theta_rad }
            | Shape::Rectangle { a_px, b_px, theta_rad }
            | Shape::Pill { a_px, b_px, theta_rad } => (a_px, b_px, theta_rad),
        }
    }

    /// Area \[px²\]: πr², πab, 4ab, and 4(a − b)b + πb² of a pill.
    #[must_use]
    pub fn area_px(&self) -> f64 {
        let (a, b, _) = self.axes();
        match self {
            Shape::Circle { .. } | Shape::Ellipse { .. } => PI * a * b,
            Shape::Rectangle { .. } => 4.0 * a * b,
            Shape::Pill { .. } => {
                let cap = b.min(a);
                4.0 * (a - cap) * cap + PI * cap * cap
            }
        }
    }

    /// Radius of the smallest circle about the centre that holds the shape \[px\].
    #[must_use]
    pub fn bounding_radius_px(&self) -> f64 {
        let (a, b, _) = self.axes();
        match self {
            Shape::Circle { .. } | Shape::Ellipse { .. } => a.max(b),
            Shape::Rectangle { .. } => a.hypot(b),
            Shape::Pill { .. } => a,
        }
    }

    /// The shape with its outline moved outwards by `by_px` on both axes; never smaller than nothing.
    #[doc(hidden)]
    #[must_use]
    pub fn grown(&self, by_px: f64) -> Shape {
        let by = |axis: f64| (axis + by_px).max(0.0);
        match *self {
            Shape::Circle { r_px } => Shape::Circle { r_px: by(r_px) },
            Shape::Ellipse { a_px, b_px, theta_rad } => Shape::Ellipse { a_px: by(a_px), b_px: by(b_px), theta_rad },
            Shape::Rectangle { a_px, b_px, theta_rad } => {
                Shape::Rectangle { a_px: by(a_px), b_px: by(b_px), theta_rad }
            }
            Shape::Pill { a_px, b_px, theta_rad } => Shape::Pill { a_px: by(a_px), b_px: by(b_px), theta_rad },
        }
    }

    /// Whether the point at (`dx`, `dy`) \[px\] from the centre is inside.
    #[must_use]
    pub fn contains(&self, dx: f64, dy: f64) -> bool {
        Outline::of(self).contains(dx, dy)
    }

    /// Whether the shape has an area: finite axes above zero.
    fn is_drawn(&self) -> bool {
        let (a, b, t) = self.axes();
        a > 0.0 && b > 0.0 && a.is_finite() && b.is_finite() && t.is_finite()
    }

    /// Share of the unit pixel whose centre is at (`dx`, `dy`) \[px\] from the centre of the shape, exact to rounding.
    #[must_use]
    pub fn pixel_fraction(&self, dx: f64, dy: f64) -> f64 {
        if self.is_drawn() { Outline::of(self).pixel_fraction(dx, dy) } else { 0.0 }
    }

    /// Share of the same pixel by counting which of `n` × `n` points are inside: what `n` subpixels cost in accuracy.
    ///
    /// For comparison only; its error falls as the outline's length in the pixel over `n`.
    #[doc(hidden)]
    #[must_use]
    pub fn subpixel_fraction(&self, dx: f64, dy: f64, n: usize) -> f64 {
        if !self.is_drawn() || n == 0 {
            return 0.0;
        }
        let outline = Outline::of(self);
        let at = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        let inside = (0..n * n).filter(|k| outline.contains(dx + at(k % n), dy + at(k / n))).count();
        inside as f64 / (n * n) as f64
    }
}
