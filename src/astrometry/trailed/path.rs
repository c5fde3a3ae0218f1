//! Where the stars of a catalogue trail while the camera follows a satellite.
//!
//! ICRS degrees to pixels. The camera keeps its angle to north while it follows the satellite's path, and each star moves
//! through the frame as that path says. The path of a star within the frame is a parabola v(u).

use super::CameraOnSky;
use crate::astrometry::catalogue::direction;
use crate::base::constants::ARCSEC_PER_RAD;

/// Stars further from the middle of the path than this are not projected \[rad\].
const MOST_AWAY_RAD: f64 = 0.5;

/// A moment of the exposure: the satellite's place on the sky, east and north there.
#[derive(Debug, Clone, Copy)]
struct Node {
    t_s: f64,
    axes: [[f64; 3]; 3],
}

/// The satellite's path among the stars during an exposure.
#[derive(Debug, Clone)]
pub struct SkyPath {
    nodes: Vec<Node>,
}

/// The trail of one star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedTrail {
    /// The star, by its number in the list.
    pub star: usize,
    /// u at the start of the exposure \[px\].
    pub start_px: f64,
    /// u at its end \[px\].
    pub end_px: f64,
    /// v(u) = a + b u + c u² \[px\].
    pub across: [f64; 3],
    /// Time the star takes for a pixel where it crosses the frame \[s/px\].
    pub s_per_px: f64,
}

impl PredictedTrail {
    /// Its start and end where it is longer by this share \[px\].
    #[must_use]
    pub fn ends_px(&self, stretch: f64) -> (f64, f64) {
        let (middle, half) = (0.5 * (self.start_px + self.end_px), 0.5 * (self.end_px - self.start_px));
        (middle - half * (1.0 + stretch), middle + half * (1.0 + stretch))
    }

    /// v of the trail at u \[px\].
    #[must_use]
    pub fn v_px(&self, u_px: f64) -> f64 {
        self.across[0] + u_px * (self.across[1] + u_px * self.across[2])
    }
}

/// Where trails are looked for: half the frame's diagonal, and how far the frame may lie off along and across \[px\].
#[derive(Debug, Clone, Copy)]
pub struct Around {
    /// Half the diagonal.
    pub half_px: f64,
    /// Along the trails.
    pub along_px: f64,
    /// Across the trails.
    pub across_px: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl SkyPath {
    /// From places (seconds from mid-exposure, RA, Dec \[deg\]) in order of time, the first at the start of the exposure, the
    /// last at its end; `None` with fewer than three.
    #[must_use]
    pub fn new(places: &[(f64, f64, f64)]) -> Option<Self> {
        let node = |&(t_s, ra_deg, dec_deg): &(f64, f64, f64)| {
            let ((sa, ca), (sd, cd)) = (ra_deg.to_radians().sin_cos(), dec_deg.to_radians().sin_cos());
            Node { t_s, axes: [[cd * ca, cd * sa, sd], [-sa, ca, 0.0], [-sd * ca, -sd * sa, cd]] }
        };
        (places.len() >= 3).then(|| Self { nodes: places.iter().map(node).collect() })
    }

    fn middle(&self) -> &Node {
        &self.nodes[self.nodes.len() / 2]
    }

    /// The direction in which the stars move at mid-exposure, from +x towards +y \[rad\], and their speed \[px/s\].
    #[must_use]
    pub fn star_motion(&self, camera: &CameraOnSky) -> (f64, f64) {
        let m = self.nodes.len() / 2;
        let (before, after) = (&self.nodes[m - 1], &self.nodes[m + 1]);
        let at = |n: &Node| self.tangent(self.middle(), n.axes[0]).map_or((0.0, 0.0), |p| camera.px(p));
        let (b, a) = (at(before), at(after));
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        (dy.atan2(dx), dx.hypot(dy) / (after.t_s - before.t_s).max(1e-12))
    }

    fn tangent(&self, node: &Node, s: [f64; 3]) -> Option<(f64, f64)> {
        let [c, e, n] = node.axes;
        let depth = dot(s, c);
        (depth > MOST_AWAY_RAD.cos()).then(|| (dot(s, e) / depth, dot(s, n) / depth))
    }

    /// Tangent-plane coordinates at mid-exposure to RA and Dec \[deg\].
    #[must_use]
    pub fn sky_at_mid(&self, (xi, eta): (f64, f64)) -> (f64, f64) {
        let [c, e, n] = self.middle().axes;
        let s: Vec<f64> = (0..3).map(|k| c[k] + xi * e[k] + eta * n[k]).collect();
        (s[1].atan2(s[0]).to_degrees().rem_euclid(360.0), s[2].atan2(s[0].hypot(s[1])).to_degrees())
    }

    /// Offset of a place from the satellite at mid-exposure to the east and to the north \[arcsec\]; `None` far from it.
    #[must_use]
    pub fn offset_arcsec(&self, (ra_deg, dec_deg): (f64, f64)) -> Option<[f64; 2]> {
        let (xi, eta) = self.tangent(self.middle(), direction(ra_deg, dec_deg))?;
        Some([xi * ARCSEC_PER_RAD, eta * ARCSEC_PER_RAD])
    }

    /// Direction of the satellite's motion among the stars at mid-exposure: its east and north components.
    #[must_use]
    pub fn motion(&self) -> Option<[f64; 2]> {
        let m = self.nodes.len() / 2;
        let at = |n: &Node| self.tangent(self.middle(), n.axes[0]);
        let (before, after) = (at(&self.nodes[m - 1])?, at(&self.nodes[m + 1])?);
        let (east, north) = (after.0 - before.0, after.1 - before.1);
        let length = east.hypot(north);
        (length > 0.0).then(|| [east / length, north / length])
    }

    /// Time from the first moment to the last \[s\].
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.nodes.last().map_or(0.0, |n| n.t_s) - self.nodes.first().map_or(0.0, |n| n.t_s)
    }

    /// Half the length of the path \[deg\], as the largest distance of its moments from the middle.
    #[must_use]
    pub fn half_length_deg(&self) -> f64 {
        let c = self.middle().axes[0];
        self.nodes.iter().map(|n| dot(n.axes[0], c).clamp(-1.0, 1.0).acos().to_degrees()).fold(0.0, f64::max)
    }

    /// RA and Dec of the middle \[deg\].
    #[must_use]
    pub fn middle_deg(&self) -> (f64, f64) {
        self.sky_at_mid((0.0, 0.0))
    }

    /// The trails of `stars` (RA, Dec \[deg\]) that may touch the frame, `direction_rad` being that of their motion.
    #[must_use]
    pub fn trails(
        &self,
        stars: &[(f64, f64)],
        camera: &CameraOnSky,
        direction_rad: f64,
        around: Around,
    ) -> Vec<PredictedTrail> {
        let (sin, cos) = direction_rad.sin_cos();
        let one = |(star, &(ra_deg, dec_deg)): (usize, &(f64, f64))| {
            let s = direction(ra_deg, dec_deg);
            let mut path: Vec<(f64, f64, f64)> = Vec::with_capacity(self.nodes.len());
            for node in &self.nodes {
                let (x, y) = camera.px(self.tangent(node, s)?);
                path.push((node.t_s, x * cos + y * sin, y * cos - x * sin));
            }
            trail(star, &path, around)
        };
        stars.iter().enumerate().filter_map(one).collect()
    }
}

/// The trail of the places (t, u, v), if it may touch the frame.
fn trail(star: usize, path: &[(f64, f64, f64)], around: Around) -> Option<PredictedTrail> {
    let (start_px, end_px) = (path.first()?.1, path.last()?.1);
    let reach = around.half_px + around.along_px;
    if !(end_px > start_px) || start_px > reach || end_px < -reach {
        return None;
    }
    // the three moments nearest to the crossing of the middle
    let after = path.iter().position(|p| p.1 >= 0.0).unwrap_or(path.len() - 1);
    let first = after.saturating_sub(1).min(path.len() - 3);
    let [p, q, r] = [path[first], path[first + 1], path[first + 2]];
    let (a, b, c) = (p.1, q.1, r.1);
    if !(a < b && b < c) {
        return None;
    }
    // divided differences of v(u) and t(u)
    let parabola = |f: [f64; 3]| {
        let (d1, d2) = ((f[1] - f[0]) / (b - a), (f[2] - f[1]) / (c - b));
        let d = (d2 - d1) / (c - a);
        [f[0] - a * d1 + a * b * d, d1 - (a + b) * d, d]
    };
    let across = parabola([p.2, q.2, r.2]);
    let time = parabola([p.0, q.0, r.0]);
    let crossing = 0f64.clamp(start_px.max(-reach), end_px.min(reach));
    let s_per_px = time[1] + 2.0 * time[2] * crossing;
    let trail = PredictedTrail { star, start_px, end_px, across, s_per_px };
    let near = trail.v_px(crossing).abs() < around.half_px + around.across_px;
    (near && s_per_px > 0.0).then_some(trail)
}
