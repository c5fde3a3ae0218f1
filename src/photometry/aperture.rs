//! Apertures and the exact share of each pixel they cover.
//!
//! Pixels are unit squares centred on integers; positions in pixels. A pixel's share is the area of polygon ∩ disc after
//! the shape has been mapped to the unit disc, exact to rounding. Leaves out: rectangle and pill, growth curves.

use std::f64::consts::PI;
use std::fmt;

use ndarray::Array2;

use crate::frames::Frame;

/// The outline of an aperture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A circle.
    Circle {
        /// Radius \[px\].
        r_px: f64,
    },
    /// An ellipse.
    Ellipse {
        /// Semi-major axis \[px\].
        a_px: f64,
        /// Semi-minor axis \[px\].
        b_px: f64,
        /// Angle of the major axis from +x towards +y \[rad\].
        theta_rad: f64,
    },
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The quadratic form of a shape: inside is a·dx² + 2b·dx·dy + c·dy² ≤ 1.
#[derive(Debug, Clone, Copy)]
struct Conic {
    a: f64,
    b: f64,
    c: f64,
}

impl Shape {
    /// The name written in tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Shape::Circle { .. } => "circle",
            Shape::Ellipse { .. } => "ellipse",
        }
    }

    /// Semi-axes \[px\] and angle \[rad\].
    #[must_use]
    pub fn axes(&self) -> (f64, f64, f64) {
        match *self {
            Shape::Circle { r_px } => (r_px, r_px, 0.0),
            Shape::Ellipse { a_px, b_px, theta_rad } => (a_px, b_px, theta_rad),
        }
    }

    /// Area \[px²\].
    #[must_use]
    pub fn area_px(&self) -> f64 {
        let (a, b, _) = self.axes();
        PI * a * b
    }

    /// Radius of the smallest circle about the centre that holds the shape \[px\].
    #[must_use]
    pub fn bounding_radius_px(&self) -> f64 {
        let (a, b, _) = self.axes();
        a.max(b)
    }

    /// The shape with its outline moved outwards by `by_px` on both axes; never smaller than nothing.
    #[must_use]
    pub fn grown(&self, by_px: f64) -> Shape {
        match *self {
            Shape::Circle { r_px } => Shape::Circle { r_px: (r_px + by_px).max(0.0) },
            Shape::Ellipse { a_px, b_px, theta_rad } => {
                Shape::Ellipse { a_px: (a_px + by_px).max(0.0), b_px: (b_px + by_px).max(0.0), theta_rad }
            }
        }
    }

    /// Whether the point at (`dx`, `dy`) \[px\] from the centre is inside.
    #[must_use]
    pub fn contains(&self, dx: f64, dy: f64) -> bool {
        let Conic { a, b, c } = self.conic();
        a * dx * dx + 2.0 * b * dx * dy + c * dy * dy <= 1.0
    }

    /// Whether the shape has an area: finite axes above zero.
    fn is_drawn(&self) -> bool {
        let (a, b, t) = self.axes();
        a > 0.0 && b > 0.0 && a.is_finite() && b.is_finite() && t.is_finite()
    }

    fn conic(&self) -> Conic {
        let (a, b, theta) = self.axes();
        let (sin, cos) = theta.sin_cos();
        let (p, q) = (1.0 / (a * a), 1.0 / (b * b));
        Conic { a: cos * cos * p + sin * sin * q, b: sin * cos * (p - q), c: sin * sin * p + cos * cos * q }
    }

    /// A point relative to the centre, mapped so that the shape becomes the unit disc.
    fn to_unit_disc(self, dx: f64, dy: f64) -> [f64; 2] {
        match self {
            Shape::Circle { r_px } => [dx / r_px, dy / r_px],
            Shape::Ellipse { a_px, b_px, theta_rad } => {
                let (sin, cos) = theta_rad.sin_cos();
                [(cos * dx + sin * dy) / a_px, (cos * dy - sin * dx) / b_px]
            }
        }
    }

    /// Share of the unit pixel whose centre is at (`dx`, `dy`) \[px\] from the centre of the shape.
    #[must_use]
    pub fn pixel_fraction(&self, dx: f64, dy: f64) -> f64 {
        if !self.is_drawn() {
            return 0.0;
        }
        let corners =
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(u, v)| self.to_unit_disc(dx + u, dy + v));
        let (a, b, _) = self.axes();
        (unit_disc_polygon_area(&corners) * a * b).clamp(0.0, 1.0)
    }
}

impl Conic {
    /// The chord of the shape at `dy`.
    fn chord(&self, dy: f64) -> Option<(f64, f64)> {
        let root = (self.b * dy).powi(2) - self.a * (self.c * dy * dy - 1.0);
        (root >= 0.0).then(|| {
            let (mid, half) = (-self.b * dy / self.a, root.sqrt() / self.a);
            (mid - half, mid + half)
        })
    }

    /// Largest dx of the shape and the dy where it is reached.
    fn rightmost(&self) -> (f64, f64) {
        let x = (self.c / (self.a * self.c - self.b * self.b)).sqrt();
        (x, -self.b * x / self.c)
    }

    /// Largest dy of the shape.
    fn top(&self) -> f64 {
        (self.a / (self.a * self.c - self.b * self.b)).sqrt()
    }
}

/// Area of the unit disc inside a polygon given counter-clockwise: Σ over edges of the signed area of
/// disc ∩ triangle(origin, p, q).
fn unit_disc_polygon_area(corners: &[[f64; 2]]) -> f64 {
    (0..corners.len()).map(|i| unit_disc_triangle_area(corners[i], corners[(i + 1) % corners.len()])).sum()
}

/// Signed area of the unit disc inside the triangle (origin, p, q).
fn unit_disc_triangle_area(p: [f64; 2], q: [f64; 2]) -> f64 {
    let triangle = |u: [f64; 2], v: [f64; 2]| 0.5 * (u[0] * v[1] - u[1] * v[0]);
    let sector = |u: [f64; 2], v: [f64; 2]| 0.5 * (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]);
    let inside = |u: [f64; 2]| u[0] * u[0] + u[1] * u[1] <= 1.0;
    if inside(p) && inside(q) {
        return triangle(p, q);
    }
    // the edge p + s (q − p) meets the circle where s² dd + 2 s pd + pp − 1 = 0
    let d = [q[0] - p[0], q[1] - p[1]];
    let (dd, pd) = (d[0] * d[0] + d[1] * d[1], p[0] * d[0] + p[1] * d[1]);
    // distance² of the line from the origin, from the cross product: no cancellation
    let cross = p[0] * d[1] - p[1] * d[0];
    let root = dd - cross * cross;
    if root <= 0.0 || dd == 0.0 {
        return sector(p, q);
    }
    let root = root.sqrt();
    let (enter, leave) = ((-pd - root) / dd, (-pd + root) / dd);
    if leave <= 0.0 || enter >= 1.0 {
        return sector(p, q);
    }
    let at = |s: f64| [p[0] + s * d[0], p[1] + s * d[1]];
    let (first, before) = if enter > 0.0 { (at(enter), sector(p, at(enter))) } else { (p, 0.0) };
    let (last, after) = if leave < 1.0 { (at(leave), sector(at(leave), q)) } else { (q, 0.0) };
    before + triangle(first, last) + after
}

/// The pixels that exist: full-frame columns `x0..x1` and rows `y0..y1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// First column.
    pub x0: usize,
    /// One past the last column.
    pub x1: usize,
    /// First row.
    pub y0: usize,
    /// One past the last row.
    pub y1: usize,
}

impl Bounds {
    /// The pixels a frame holds.
    #[must_use]
    pub fn of<U>(frame: &Frame<U>) -> Self {
        let ((x0, y0), (ny, nx)) = (frame.origin_px, frame.pixels.dim());
        Self { x0, x1: x0 + nx, y0, y1: y0 + ny }
    }

    /// Whether a circle around a position lies wholly on these pixels.
    #[must_use]
    pub fn hold(&self, x_px: f64, y_px: f64, r_px: f64) -> bool {
        x_px - r_px >= self.x0 as f64 - 0.5
            && x_px + r_px <= self.x1 as f64 - 0.5
            && y_px - r_px >= self.y0 as f64 - 0.5
            && y_px + r_px <= self.y1 as f64 - 0.5
    }
}

/// The integers i in `lo..hi` whose unit cells meet the interval from `from` to `to`.
pub(crate) fn cells(from: f64, to: f64, lo: usize, hi: usize) -> std::ops::Range<usize> {
    if from.is_nan() || to.is_nan() || from > to {
        return lo..lo;
    }
    let first = (from + 0.5).floor().clamp(lo as f64, hi as f64) as usize;
    let last = (to + 0.5).floor().clamp(lo as f64 - 1.0, hi as f64 - 1.0) + 1.0;
    first..(last.max(0.0) as usize).max(first)
}

/// Calls `visit(i, j, fraction)` for every pixel (column i, row j) of `bounds` that the shape at (`x`, `y`) covers.
///
/// Rows in ascending order, columns in ascending order within a row. Pixels wholly inside have exactly 1, found from the
/// chords at the two edges of the row (the shape is convex); only outline pixels are integrated. A position that is not
/// finite or a shape without area visits nothing.
pub fn for_each_pixel(shape: &Shape, x: f64, y: f64, bounds: Bounds, mut visit: impl FnMut(usize, usize, f64)) {
    if !(shape.is_drawn() && x.is_finite() && y.is_finite()) {
        return;
    }
    let conic = shape.conic();
    let (right, right_dy) = conic.rightmost();
    let top = conic.top();
    for j in cells(y - top, y + top, bounds.y0, bounds.y1) {
        let (low, high) = (j as f64 - 0.5 - y, j as f64 + 0.5 - y);
        // the range of dx the shape reaches in this row, and the range it fills
        let (mut reach, mut fill) = ((f64::INFINITY, f64::NEG_INFINITY), (f64::NEG_INFINITY, f64::INFINITY));
        for dy in [low, high] {
            match conic.chord(dy) {
                Some((l, r)) => {
                    reach = (reach.0.min(l), reach.1.max(r));
                    fill = (fill.0.max(l), fill.1.min(r));
                }
                None => fill = (f64::INFINITY, f64::NEG_INFINITY),
            }
        }
        if (low..=high).contains(&right_dy) {
            reach.1 = right;
        }
        if (low..=high).contains(&-right_dy) {
            reach.0 = -right;
        }
        if reach.0 > reach.1 {
            // neither edge of the row cuts the shape: it lies wholly between them
            reach = (-right, right);
        }
        // a little slack on both sides: rounding must not lose a sliver
        for i in cells(x + reach.0 - 1e-9, x + reach.1 + 1e-9, bounds.x0, bounds.x1) {
            let dx = i as f64 - x;
            if dx - 0.5 >= fill.0 && dx + 0.5 <= fill.1 {
                visit(i, j, 1.0);
            } else {
                let fraction = shape.pixel_fraction(dx, j as f64 - y);
                if fraction > 0.0 {
                    visit(i, j, fraction);
                }
            }
        }
    }
}

/// Sum of the pixels in a shape: the plain kernel, no sky, no mask.
#[must_use]
pub fn shape_sum(pixels: &Array2<f64>, shape: &Shape, x: f64, y: f64) -> f64 {
    let (ny, nx) = pixels.dim();
    let mut sum = 0.0;
    for_each_pixel(shape, x, y, Bounds { x0: 0, x1: nx, y0: 0, y1: ny }, |i, j, fraction| {
        sum += fraction * pixels[[j, i]];
    });
    sum
}

/// Sum of the pixels in a circle of radius `r` \[px\].
#[must_use]
pub fn circle_sum(pixels: &Array2<f64>, x: f64, y: f64, r: f64) -> f64 {
    shape_sum(pixels, &Shape::Circle { r_px: r }, x, y)
}
