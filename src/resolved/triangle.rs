//! Triangles of a surface, and their areas.

use crate::base::vector::Vector;

/// The satellite's own axes: x forward, y against the orbit's angular momentum, z to the centre of the Earth (LVLH).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {}

/// Three corners, counter-clockwise as seen from the front.
pub type Triangle<F> = [Vector<F>; 3];

/// Twice the area of a triangle along its normal: `(b − a) × (c − a)`.
#[must_use]
pub fn double_area<F>([a, b, c]: &Triangle<F>) -> Vector<F> {
    (*b - *a).cross(&(*c - *a))
}

/// What triangles show in a direction \[m²\]: `½ Σ A |n·d|` of a closed convex shape, `Σ A |n·d|` of a flat sheet.
#[must_use]
pub fn projected_m2<F>(triangles: &[Triangle<F>], direction: &Vector<F>, sheet: bool) -> f64 {
    let Some(d) = direction.unit() else { return 0.0 };
    let both: f64 = triangles.iter().map(|t| 0.5 * double_area(t).dot(&d).abs()).sum();
    if sheet { both } else { 0.5 * both }
}
