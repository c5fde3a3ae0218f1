//! The smallest circle, ellipse, rectangle or pill around a set of points.
//!
//! Any unit of length; angles from +x towards +y \[rad\]. Works on the convex hull, so its cost does not grow with the
//! size of the target. It does not cover shapes that are not convex.

use std::f64::consts::FRAC_PI_2;

use super::placed::Placed;
use crate::config::ApertureShape;
use crate::photometry::aperture::Shape;

/// A simpler shape is taken where it is at most this much larger than the smallest.
const SIMPLER: f64 = 1.1;
/// Accuracy of the smallest ellipse.
const ELLIPSE_TOLERANCE: f64 = 1e-3;

type Point = [f64; 2];

/// The shape of the wanted kind around the points, moved outwards by `margin` and nowhere narrower than `least`;
/// `Auto` takes the smallest, or the first of circle, ellipse, pill and rectangle within a tenth of it.
pub(crate) fn minimum_aperture(points: &[Point], kind: ApertureShape, margin: f64, least: f64) -> Option<Placed> {
    let hull = convex_hull(points);
    if hull.is_empty() {
        return None;
    }
    let circle = || with_margin(smallest_circle(&hull), margin, least);
    let ellipse = || with_margin(smallest_ellipse(&hull), margin, least);
    let pill = || with_margin(smallest_bar(&hull, true), margin, least);
    let rectangle = || with_margin(smallest_bar(&hull, false), margin, least);
    match kind {
        ApertureShape::Circle => Some(circle()),
        ApertureShape::Ellipse => Some(ellipse()),
        ApertureShape::Pill => Some(pill()),
        ApertureShape::Rectangle => Some(rectangle()),
        ApertureShape::Auto => {
            let all = [circle(), ellipse(), pill(), rectangle()];
            let smallest = all.iter().map(|p| p.shape.area_px()).fold(f64::INFINITY, f64::min);
            all.into_iter().find(|p| p.shape.area_px() <= SIMPLER * smallest)
        }
    }
}

/// Moved outwards, each half axis at least `least`; an ellipse as wide as long is a circle.
fn with_margin(placed: Placed, margin: f64, least: f64) -> Placed {
    let (a, b, theta_rad) = placed.shape.axes();
    let (a_px, b_px) = ((a + margin).max(least), (b + margin).max(least));
    let shape = match placed.shape {
        Shape::Circle { .. } => Shape::Circle { r_px: a_px },
        Shape::Ellipse { .. } => Shape::Ellipse { a_px, b_px, theta_rad },
        Shape::Rectangle { .. } => Shape::Rectangle { a_px, b_px, theta_rad },
        Shape::Pill { .. } => Shape::Pill { a_px, b_px, theta_rad },
    };
    Placed { shape, ..placed }
}

/// Corners of the convex hull, counter-clockwise (Andrew 1979, Inf. Proc. Lett. 9, 216).
pub(crate) fn convex_hull(points: &[Point]) -> Vec<Point> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let turn = |o: Point, p: Point, q: Point| (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for p in points {
            while chain.len() >= 2 && turn(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter().copied());
    hull.extend(half(&mut sorted.iter().rev().copied()));
    hull
}

/// The smallest circle: through two or three corners of the hull, found by adding the farthest point (Welzl's move).
fn smallest_circle(hull: &[Point]) -> Placed {
    let distance = |c: Point, p: Point| (p[0] - c[0]).hypot(p[1] - c[1]);
    let inside = |c: (Point, f64), p: Point| distance(c.0, p) <= c.1 * (1.0 + 1e-9) + 1e-9;
    let of_two = |p: Point, q: Point| ([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])], 0.5 * distance(p, q));
    let mut c = (hull[0], 0.0);
    for i in 1..hull.len() {
        if inside(c, hull[i]) {
            continue;
        }
        c = (hull[i], 0.0);
        for j in 0..i {
            if inside(c, hull[j]) {
                continue;
            }
            c = of_two(hull[i], hull[j]);
            for k in 0..j {
                if !inside(c, hull[k]) {
                    c = through(hull[i], hull[j], hull[k]).unwrap_or(c);
                }
            }
        }
    }
    Placed { x: c.0[0], y: c.0[1], shape: Shape::Circle { r_px: c.1 } }
}

/// The circle through three points; `None` if they lie on a line.
fn through(p: Point, q: Point, r: Point) -> Option<(Point, f64)> {
    let (bx, by, cx, cy) = (q[0] - p[0], q[1] - p[1], r[0] - p[0], r[1] - p[1]);
    let d = 2.0 * (bx * cy - by * cx);
    let (bb, cc) = (bx * bx + by * by, cx * cx + cy * cy);
    let (x, y) = ((cy * bb - by * cc) / d, (bx * cc - cx * bb) / d);
    (d != 0.0).then(|| ([p[0] + x, p[1] + y], x.hypot(y)))
}

/// The ellipse of least area (Khachiyan 1996, Math. Oper. Res. 21, 307).
fn smallest_ellipse(hull: &[Point]) -> Placed {
    if hull.len() < 3 {
        return smallest_circle(hull);
    }
    let n = hull.len() as f64;
    let mut weight = vec![1.0 / n; hull.len()];
    let mut ellipse = (0.0, 0.0, [0.0; 3]);
    for _ in 0..1000 {
        let (x, y) = hull.iter().zip(&weight).fold((0.0, 0.0), |(x, y), (p, w)| (x + w * p[0], y + w * p[1]));
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (p, w) in hull.iter().zip(&weight) {
            let (dx, dy) = (p[0] - x, p[1] - y);
            xx += w * dx * dx;
            xy += w * dx * dy;
            yy += w * dy * dy;
        }
        let det = (xx * yy - xy * xy).max(1e-12);
        let inverse = [yy / det, -xy / det, xx / det];
        // Mahalanobis distance²; the weights settle where its largest value is 2
        let distance = |p: &Point| {
            let (dx, dy) = (p[0] - x, p[1] - y);
            inverse[0] * dx * dx + 2.0 * inverse[1] * dx * dy + inverse[2] * dy * dy
        };
        let far =
            hull.iter().enumerate().map(|(k, p)| (k, distance(p))).fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        // the covariance scaled so that the farthest point lies on it
        ellipse = (x, y, [xx * far.1, xy * far.1, yy * far.1]);
        if far.1 <= 2.0 * (1.0 + ELLIPSE_TOLERANCE) {
            break;
        }
        let step = (far.1 - 2.0) / (3.0 * far.1);
        weight.iter_mut().for_each(|w| *w *= 1.0 - step);
        weight[far.0] += step;
    }
    let (x, y, [xx, xy, yy]) = ellipse;
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    let theta_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
    Placed {
        x,
        y,
        shape: Shape::Ellipse { a_px: (mean + half).sqrt(), b_px: (mean - half).max(0.0).sqrt(), theta_rad },
    }
}

/// The smallest rectangle, one side along an edge of the hull; or the smallest such pill, as wide as the hull is there.
fn smallest_bar(hull: &[Point], caps: bool) -> Placed {
    if hull.len() < 2 {
        return smallest_circle(hull);
    }
    let mut best: Option<Placed> = None;
    for (k, p) in hull.iter().enumerate() {
        let q = hull[(k + 1) % hull.len()];
        let edge = (q[1] - p[1]).atan2(q[0] - p[0]);
        for theta in [edge, edge + FRAC_PI_2] {
            let placed = bar_along(hull, theta, caps);
            if best.is_none_or(|b| placed.shape.area_px() < b.shape.area_px()) {
                best = Some(placed);
            }
        }
    }
    best.unwrap_or_else(|| smallest_circle(hull))
}

/// The rectangle or pill along a direction around the hull; the longer half axis comes first.
fn bar_along(hull: &[Point], theta: f64, caps: bool) -> Placed {
    let (sin, cos) = theta.sin_cos();
    let turned = |p: &Point| (p[0] * cos + p[1] * sin, p[1] * cos - p[0] * sin);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
    };
    let (v0, v1) = range(&mut hull.iter().map(|p| turned(p).1));
    let (mid_v, b) = (0.5 * (v0 + v1), 0.5 * (v1 - v0));
    // how far the round cap reaches beyond the end of the core at this distance from the axis
    let cap = |v: f64| if caps { (b * b - (v - mid_v).powi(2)).max(0.0).sqrt() } else { 0.0 };
    let (_, right) = range(&mut hull.iter().map(turned).map(|(u, v)| u - cap(v)));
    let (left, _) = range(&mut hull.iter().map(turned).map(|(u, v)| u + cap(v)));
    let core = 0.5 * (right - left).max(0.0);
    let mid_u = 0.5 * (right + left);
    let (x, y) = (mid_u * cos - mid_v * sin, mid_u * sin + mid_v * cos);
    let theta_rad = (theta + FRAC_PI_2).rem_euclid(std::f64::consts::PI) - FRAC_PI_2;
    let shape = if caps {
        Shape::Pill { a_px: core + b, b_px: b, theta_rad }
    } else if core >= b {
        Shape::Rectangle { a_px: core, b_px: b, theta_rad }
    } else {
        let theta_rad = (theta_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::PI) - FRAC_PI_2;
        Shape::Rectangle { a_px: b, b_px: core, theta_rad }
    };
    Placed { x, y, shape }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points_of(placed: &Placed, n: usize) -> Vec<Point> {
        // a grid inside the shape
        let r = placed.shape.bounding_radius_px();
        (0..n * n)
            .map(|k| [(k % n) as f64, (k / n) as f64].map(|t| r * (2.0 * t / (n as f64 - 1.0) - 1.0)))
            .filter(|p| placed.shape.contains(p[0], p[1]))
            .map(|p| [p[0] + placed.x, p[1] + placed.y])
            .collect()
    }

    #[test]
    fn every_shape_is_recovered_by_its_own_kind_and_chosen_by_its_area() {
        let theta_rad = 0.6;
        let (a_px, b_px) = (100.0, 22.0);
        let cases = [
            (Shape::Circle { r_px: 60.0 }, "circle"),
            (Shape::Ellipse { a_px, b_px, theta_rad }, "ellipse"),
            (Shape::Rectangle { a_px, b_px, theta_rad }, "rectangle"),
            (Shape::Pill { a_px, b_px, theta_rad }, "pill"),
        ];
        for (shape, name) in cases {
            let points = points_of(&Placed { x: 310.0, y: 120.0, shape }, 401);
            let got = minimum_aperture(&points, ApertureShape::Auto, 0.0, 0.0).unwrap();
            assert_eq!(got.shape.name(), name);
            // the grid misses at most its step at the edge
            assert!((got.shape.area_px() / shape.area_px() - 1.0).abs() < 0.03, "{name}: {:?}", got.shape);
            assert!((got.x - 310.0).hypot(got.y - 120.0) < 1.0);
        }
    }

    #[test]
    fn every_kind_holds_every_point_of_any_cloud() {
        let mut state = 12345u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        for n in [1, 2, 3, 5, 40] {
            let points: Vec<Point> = (0..n).map(|_| [80.0 * random(), 15.0 * random() + 20.0 * random()]).collect();
            for kind in [ApertureShape::Circle, ApertureShape::Ellipse, ApertureShape::Rectangle, ApertureShape::Pill] {
                let got = minimum_aperture(&points, kind, 0.05, 0.01).unwrap();
                for p in &points {
                    assert!(got.shape.contains(p[0] - got.x, p[1] - got.y), "{n} {kind:?} {p:?} {got:?}");
                }
            }
        }
        assert!(minimum_aperture(&[], ApertureShape::Auto, 1.0, 1.0).is_none());
    }
}
