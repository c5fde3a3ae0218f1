//! The part of a frame that a fit of the background of trails excludes.

use super::direction::Turned;
use crate::photometry::aperture::Shape;

/// A shape whose light must not enter a level, in the turned coordinates; a pill counts as the rectangle around it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExclusionMask {
    pub u: f64,
    pub v: f64,
    pub a: f64,
    pub b: f64,
    /// Angle of the major axis from +u towards +v.
    pub phi: f64,
    /// Whether it has corners.
    pub(super) bar: bool,
}

impl ExclusionMask {
    /// A shape at a place of the cutout.
    pub fn of(turned: &Turned, at: (f64, f64), shape: Shape) -> Self {
        let (a, b, theta) = shape.axes();
        let (u, v) = turned.uv(at.0, at.1);
        let bar = matches!(shape, Shape::Rectangle { .. } | Shape::Pill { .. });
        Self { u, v, a, b, phi: theta - turned.sin.atan2(turned.cos), bar }
    }

    /// The stretch of the line at `v` inside.
    pub fn chord(&self, v: f64) -> Option<(f64, f64)> {
        let (sin, cos) = self.phi.sin_cos();
        let dv = v - self.v;
        if self.bar {
            // |cos·du + sin·dv| ≤ a and |cos·dv − sin·du| ≤ b
            let between = |slope: f64, offset: f64, limit: f64| -> (f64, f64) {
                if slope.abs() < 1e-12 {
                    let inside = offset.abs() <= limit;
                    return if inside { (f64::NEG_INFINITY, f64::INFINITY) } else { (0.0, -1.0) };
                }
                let (p, q) = ((-limit - offset) / slope, (limit - offset) / slope);
                (p.min(q), p.max(q))
            };
            let (one, other) = (between(cos, sin * dv, self.a), between(-sin, cos * dv, self.b));
            let (from, to) = (one.0.max(other.0), one.1.min(other.1));
            return (from <= to && from.is_finite() && to.is_finite()).then_some((self.u + from, self.u + to));
        }
        let (p, q) = (1.0 / (self.a * self.a), 1.0 / (self.b * self.b));
        let (uu, uv, vv) = (cos * cos * p + sin * sin * q, sin * cos * (p - q), sin * sin * p + cos * cos * q);
        let root = (uv * dv).powi(2) - uu * (vv * dv * dv - 1.0);
        (root >= 0.0).then(|| {
            let (mid, half) = (self.u - uv * dv / uu, root.sqrt() / uu);
            (mid - half, mid + half)
        })
    }

    /// Largest distance from its centre across the trails.
    pub fn across(&self) -> f64 {
        let (sin, cos) = self.phi.sin_cos();
        let (along, aside) = (self.a * sin, self.b * cos);
        if self.bar { along.abs() + aside.abs() } else { along.hypot(aside) }
    }
}
