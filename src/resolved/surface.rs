//! Surfaces of triangles: how far a place is beyond one, which way a closed one is wound, what box holds it.
//!
//! Metres. Not included: surfaces that cut through themselves.

use std::f64::consts::TAU;

use super::triangle::Triangle;
use super::triangle::double_area;
use crate::base::vector::Vector;

/// Sum of the area vectors, relative to the area, below which a surface counts as closed.
const CLOSED: f64 = 1e-5;

/// Distance of a place from a surface; 0 inside a closed one.
#[must_use]
pub fn beyond_m<F>(triangles: &[Triangle<F>], place: &Vector<F>) -> f64 {
    if triangles.iter().map(|t| solid_angle_sr(t, place)).sum::<f64>().abs() > TAU {
        return 0.0;
    }
    triangles.iter().map(|t| (nearest(t, place) - *place).norm()).fold(f64::INFINITY, f64::min)
}

/// The volume a closed surface holds, below 0 when its fronts look inwards; `None` for an open one.
///
/// `V = Σ a·(b × c)/6`; a surface is closed when its area vectors add up to nothing.
#[must_use]
pub fn volume_m3<F>(triangles: &[Triangle<F>]) -> Option<f64> {
    let zero = Vector::new(0.0, 0.0, 0.0);
    let sum = triangles.iter().fold(zero, |sum, t| sum + double_area(t));
    let all: f64 = triangles.iter().map(|t| double_area(t).norm()).sum();
    (sum.norm() <= CLOSED * all).then(|| triangles.iter().map(|[a, b, c]| a.dot(&b.cross(c)) / 6.0).sum())
}

/// Ends of the box along the axes that holds a surface: x, y, z.
#[must_use]
pub fn extent_m<F>(triangles: &[Triangle<F>]) -> [[f64; 2]; 3] {
    let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for corner in triangles.iter().flatten() {
        for (end, x) in ends.iter_mut().zip(corner.to_array()) {
            *end = [end[0].min(x), end[1].max(x)];
        }
    }
    ends
}

/// Solid angle of a triangle from a place, positive from behind (van Oosterom & Strackee 1983).
fn solid_angle_sr<F>(triangle: &Triangle<F>, place: &Vector<F>) -> f64 {
    let [a, b, c] = triangle.map(|v| v - *place);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    2.0 * a.dot(&b.cross(&c)).atan2(below)
}

/// The place on a triangle that is nearest to another place.
fn nearest<F>(triangle: &Triangle<F>, place: &Vector<F>) -> Vector<F> {
    let n = double_area(triangle);
    let foot = *place - n * (n.dot(&(*place - triangle[0])) / n.dot(&n));
    let edge = |k: usize| (triangle[k], triangle[(k + 1) % 3] - triangle[k]);
    if (0..3).all(|k| n.dot(&edge(k).1.cross(&(foot - edge(k).0))) >= 0.0) {
        return foot;
    }
    let on_edge = |k: usize| {
        let (from, along) = edge(k);
        from + along * (along.dot(&(*place - from)) / along.dot(&along)).clamp(0.0, 1.0)
    };
    let far = |v: &Vector<F>| (*v - *place).norm();
    let (first, rest) = (on_edge(0), [on_edge(1), on_edge(2)]);
    rest.into_iter().fold(first, |best, v| if far(&v) < far(&best) { v } else { best })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::resolved::shape::Shape;
    use crate::resolved::triangle::Body;

    fn of(shape: &Shape) -> Vec<Triangle<Body>> {
        shape.triangles(32, Path::new("."), "test").unwrap()
    }

    #[test]
    fn a_place_inside_is_not_beyond_and_one_outside_by_its_distance() {
        let cuboid = of(&Shape::Box { size_m: [2.0, 4.0, 6.0] });
        let plate = of(&Shape::Plate { size_m: [2.0, 4.0], normal: [0.0, 0.0, 1.0], along: [1.0, 0.0, 0.0] });
        for (at, box_m, plate_m) in [
            ([0.3, -0.2, 0.1], 0.0, 0.1),
            ([1.5, 0.0, 0.0], 0.5, 0.5),
            ([4.0, 6.0, 0.0], 5.0, 5.0),
            ([0.0, 0.0, -7.0], 4.0, 7.0),
        ] {
            let at = Vector::<Body>::new(at[0], at[1], at[2]);
            assert!((beyond_m(&cuboid, &at) - box_m).abs() < 1e-12, "{at:?}");
            assert!((beyond_m(&plate, &at) - plate_m).abs() < 1e-12, "{at:?}");
        }
        assert_eq!(extent_m(&cuboid), [[-1.0, 1.0], [-2.0, 2.0], [-3.0, 3.0]]);
    }

    #[test]
    fn a_closed_surface_knows_its_volume_and_an_open_one_has_none() {
        let cuboid = of(&Shape::Box { size_m: [2.0, 4.0, 6.0] });
        let inwards: Vec<Triangle<Body>> = cuboid.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        assert!((volume_m3(&cuboid).unwrap() - 48.0).abs() < 1e-12);
        assert!((volume_m3(&inwards).unwrap() + 48.0).abs() < 1e-12);
        assert_eq!(volume_m3(&cuboid[1..]), None);
    }
}
