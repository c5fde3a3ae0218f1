//! Areas of small convex polygons, clipped by lines and by the unit disc. Exact to rounding; any unit of length.

/// A convex polygon of at most eight corners, counter-clockwise: a square clipped four times.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    corners: [[f64; 2]; Polygon::MOST],
    n: usize,
}

impl Polygon {
    /// Most corners of a square clipped by four lines: each line adds one.
    pub(super) const MOST: usize = 8;

    pub(super) fn new(square: &[[f64; 2]; 4]) -> Self {
        let mut polygon = Self { corners: [[0.0; 2]; Self::MOST], n: 0 };
        square.iter().for_each(|corner| polygon.push(*corner));
        polygon
    }

    fn push(&mut self, corner: [f64; 2]) {
        // rounding may cut a sliver twice: what finds no room is of no area
        if let Some(place) = self.corners.get_mut(self.n) {
            *place = corner;
            self.n += 1;
        }
    }

    pub(super) fn points(&self) -> &[[f64; 2]] {
        &self.corners[..self.n]
    }

    /// The part where coordinate `axis` is at most `limit`.
    pub(super) fn below(&self, axis: usize, limit: f64) -> Self {
        self.clipped(|p| limit - p[axis])
    }

    /// The part where coordinate `axis` is at least `limit`.
    pub(super) fn above(&self, axis: usize, limit: f64) -> Self {
        self.clipped(|p| p[axis] - limit)
    }

    /// The part where a linear function is not negative (Sutherland & Hodgman 1974, CACM 17, 32).
    fn clipped(&self, inside_by: impl Fn([f64; 2]) -> f64) -> Self {
        let mut out = Self { corners: [[0.0; 2]; Self::MOST], n: 0 };
        for (k, &q) in self.points().iter().enumerate() {
            let p = self.corners[(k + self.n - 1) % self.n];
            let (from, to) = (inside_by(p), inside_by(q));
            if (from >= 0.0) != (to >= 0.0) {
                let t = from / (from - to);
                out.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
            if to >= 0.0 {
                out.push(q);
            }
        }
        out
    }

    /// Area, about the first corner: far from the origin no digit is lost.
    pub(super) fn area(&self) -> f64 {
        let Some((o, rest)) = self.points().split_first() else { return 0.0 };
        let triangle = |p: &[f64; 2], q: &[f64; 2]| (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
        0.5 * rest.windows(2).map(|edge| triangle(&edge[0], &edge[1])).sum::<f64>()
    }
}

/// Area of the unit disc inside a polygon given counter-clockwise: Σ over edges of the signed area of
/// disc ∩ triangle(origin, p, q).
pub(super) fn unit_disc_polygon_area(corners: &[[f64; 2]]) -> f64 {
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
