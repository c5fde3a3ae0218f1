//! The rule of last resort: polar coordinates about the mirror direction, tanh-sinh rules in both variables.
//!
//! `w = cos γ m + sin γ e(ψ)`, azimuth ψ outside, angles in rad, results in 1/sr. Limb, terminator and horizon of the
//! surface are closed forms on every ray; the nodes crowd towards the mirror direction and towards every edge by
//! themselves, so that a cusp of any width costs the same. Dearer than panels in ζ, where those get along.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::ReflectedLight;
use super::facet::Facet;
use super::profile::Metric;
use crate::base::vector::Vector;
use crate::brightness::ground::{Ground, Vertical};

/// First and last level; the step in t is 2^−level.
const LEVELS: [i32; 4] = [2, 3, 4, 5];
/// |t| of the last node: what is beyond is below the last digit.
const T_MAX: f64 = 3.2;
/// No relative error below this is stated.
const ROUNDING: f64 = 1e-13;

type Direction = Vector<Vertical>;

/// The integral in coordinates about the mirror direction.
struct Polar<'a> {
    ground: &'a Ground,
    facet: &'a Facet<'a>,
    /// At right angles to m: towards nadir, and level.
    a: Direction,
    b: Direction,
    /// sin and cos of the nadir angle of the limb.
    limb: (f64, f64),
}

/// A node of the rule on 0 to 1: its distance from the nearer end, whether that is the end at 1, its weight.
#[derive(Clone, Copy)]
struct Node {
    off: f64,
    behind: bool,
    weight: f64,
}

/// The integral to a relative tolerance, or as well as `max_nodes` allow; `None` for a law that has no lobe.
pub(super) fn integrate(ground: &Ground, facet: &Facet, tolerance: f64, max_nodes: usize) -> Option<ReflectedLight> {
    if facet.metric == Metric::None || facet.law.needs_v() {
        return None;
    }
    let m = facet.mirror;
    let b = Vector::new(-m.y(), m.x(), 0.0).unit().unwrap_or(Vector::new(1.0, 0.0, 0.0));
    let k = ground.k;
    let polar = Polar { ground, facet, a: b.cross(&m), b, limb: (k, ((1.0 - k) * (1.0 + k)).sqrt()) };
    let edges = polar.azimuths();
    let mut best: Option<ReflectedLight> = None;
    let mut nodes = 0;
    for level in LEVELS {
        let rule = tanh_sinh(level);
        let (per_sr, used) = polar.over(&edges, &rule);
        nodes += used;
        let apart = best.map_or(f64::INFINITY, |before| (per_sr - before.per_sr).abs());
        best = Some(ReflectedLight { per_sr, err_per_sr: apart + ROUNDING * per_sr, nodes });
        if apart <= tolerance * per_sr || nodes + 4 * used > max_nodes {
            break;
        }
    }
    best.filter(|light| light.err_per_sr.is_finite())
}

/// x = ½ (1 + tanh(π/2 sinh t)) on 0 to 1.
fn tanh_sinh(level: i32) -> Vec<Node> {
    let step = 0.5_f64.powi(level);
    let count = (T_MAX / step).round() as i32;
    (-count..=count)
        .map(|j| {
            let t = f64::from(j) * step;
            let size = (-PI * t.abs().sinh()).exp();
            let off = size / (1.0 + size);
            Node { off, behind: t > 0.0, weight: step * PI * t.cosh() * off / (1.0 + size) }
        })
        .collect()
}

impl Node {
    /// Its place between two ends, never beyond either.
    fn between(&self, from: f64, to: f64) -> f64 {
        if self.behind { to - (to - from) * self.off } else { from + (to - from) * self.off }
    }
}

impl Polar<'_> {
    /// ∫ over all rays between the given azimuths, and the nodes it took.
    fn over(&self, edges: &[f64], rule: &[Node]) -> (f64, usize) {
        let (mut sum, mut nodes) = (0.0, 0);
        for pair in edges.windows(2) {
            let width = pair[1] - pair[0];
            for node in rule {
                let (value, used) = self.ray(node.between(pair[0], pair[1]), rule);
                sum += node.weight * width * value;
                nodes += used;
            }
        }
        (sum, nodes)
    }

    /// ∫ L f (n·w) sin γ dγ along a ray.
    fn ray(&self, psi: f64, rule: &[Node]) -> (f64, usize) {
        let e = self.at(psi);
        let (m, n) = (self.facet.mirror, self.facet.normal);
        let Some((low, high)) = self.in_view(&e) else { return (0.0, 0) };
        let mut marks = vec![low, high];
        let inside = |gamma: &f64| *gamma > low && *gamma < high;
        marks.extend(self.terminator(&m, &e).into_iter().flatten().map(|gamma| gamma.rem_euclid(PI)).filter(inside));
        marks.extend([self.facet.width, FRAC_PI_2].into_iter().filter(inside));
        marks.sort_by(f64::total_cmp);
        let (e_n, m_n) = (n.dot(&e), n.dot(&m));
        let plane = if self.facet.metric == Metric::Plane { 1.0 } else { 0.0 };
        // the part of w − m along n counts for nothing in the plane of the surface
        let (across, along) = (e - n * (plane * e_n), m - n * (plane * m_n));
        let (mut sum, mut nodes) = (0.0, 0);
        for pair in marks.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            if !(self.ground.radiance_from(&(m * middle.cos() + e * middle.sin())) > 0.0) {
                continue;
            }
            for node in rule {
                let gamma = node.between(pair[0], pair[1]);
                let (sin, half) = (gamma.sin(), (0.5 * gamma).sin());
                let sagitta = 2.0 * half * half;
                let apart = across * sin - along * sagitta;
                let mut f = [0.0];
                self.facet.law.fill(&[apart.dot(&apart)], &mut f, false);
                let cos_in = (m_n * (1.0 - sagitta) + e_n * sin).max(0.0);
                let light = self.ground.radiance_from(&(m * (1.0 - sagitta) + e * sin));
                sum += node.weight * (pair[1] - pair[0]) * light * f[0] * cos_in * sin;
            }
            nodes += rule.len();
        }
        (sum, nodes)
    }

    /// The direction of a ray at right angles to m.
    fn at(&self, psi: f64) -> Direction {
        self.a * psi.cos() + self.b * psi.sin()
    }

    /// The γ between which a ray is on the Earth and in front of the surface.
    fn in_view(&self, e: &Direction) -> Option<(f64, f64)> {
        let (m, n) = (&self.facet.mirror, &self.facet.normal);
        // the plane of the ray passes the vertical at the sine `off`
        let off = m.cross(e).z();
        let (sin, cos) = self.limb;
        let half = ((sin - off) * (sin + off)).max(0.0).sqrt().atan2(cos);
        let centre = (-e.z()).atan2(-m.z());
        let turn = if centre + half <= 0.0 { TAU } else { 0.0 };
        let low = (centre - half + turn).max(0.0);
        let high = (centre + half + turn).min(n.dot(e).atan2(n.dot(m)) + FRAC_PI_2).min(PI);
        (low < high).then_some((low, high))
    }

    /// The form that is 0 where light grazes the ground, and behind the Earth.
    ///
    /// The ground point `p = w d + z/k` is a unit vector with `p·s = ε`: d eliminated.
    fn grazing(&self, v: &Direction, w: &Direction) -> f64 {
        let (s, k) = (&self.ground.light_source, self.ground.k);
        let c = self.ground.parallax_ratio() * k - s.z();
        let (sv, sw) = (s.dot(v), s.dot(w));
        c * c * v.dot(w) + c * (sv * w.z() + sw * v.z()) + (1.0 - k) * (1.0 + k) * sv * sw
    }

    /// Angles t, modulo π, at which cos t v + sin t w is on the terminator.
    fn terminator(&self, v: &Direction, w: &Direction) -> [Option<f64>; 2] {
        roots(self.grazing(v, v), self.grazing(v, w), self.grazing(w, w))
    }

    /// Azimuths at which the rays change character, from 0 to a full turn.
    fn azimuths(&self) -> Vec<f64> {
        let (m, n, s) = (&self.facet.mirror, &self.facet.normal, &self.ground.light_source);
        let (a, b) = (&self.a, &self.b);
        let (sin, cos) = self.limb;
        let azimuth = |v: &Direction| v.dot(b).atan2(v.dot(a));
        // straight towards and away from the nearest limb, horizon and terminator, and across
        let slope = (self.grazing(m, a), self.grazing(m, b));
        let mut edges = Vec::with_capacity(40);
        for centre in [0.0, n.dot(b).atan2(n.dot(a)), slope.1.atan2(slope.0)] {
            edges.extend((0..4).map(|quarter| centre + FRAC_PI_2 * f64::from(quarter)));
        }
        // tangents to the limb and to the terminator
        let off = m.x().hypot(m.y());
        if off > sin {
            let t = (sin / off).asin();
            edges.extend([t, -t, PI - t, PI + t]);
        }
        let (mm, ma, mb) = (self.grazing(m, m), self.grazing(m, a), self.grazing(m, b));
        let (aa, ab, bb) = (self.grazing(a, a), self.grazing(a, b), self.grazing(b, b));
        for t in roots(ma * ma - mm * aa, ma * mb - mm * ab, mb * mb - mm * bb).into_iter().flatten() {
            edges.extend([t, t + PI]);
        }
        // where two edges meet: terminator and limb, horizon and limb, terminator and horizon
        if s.y() > 0.0 {
            let y = (self.ground.parallax_ratio() - s.z() * sin) / s.y();
            let x2 = 1.0 - sin * sin - y * y;
            if x2 >= 0.0 {
                edges.extend([-1.0, 1.0].map(|side| azimuth(&Vector::new(side * x2.sqrt(), y, sin - 1.0 / sin))));
            }
        }
        let level = n.x().hypot(n.y());
        let cosine = n.z() * cos / (level * sin);
        if level > 0.0 && cosine.abs() <= 1.0 {
            let (centre, half) = (n.y().atan2(n.x()), cosine.acos());
            let on_limb = |phi: f64| azimuth(&Vector::new(sin * phi.cos(), sin * phi.sin(), -cos));
            edges.extend([on_limb(centre - half), on_limb(centre + half)]);
        }
        if let Some(v) = n.cross(&Vector::new(0.0, 0.0, 1.0)).unit() {
            let w = n.cross(&v);
            for t in self.terminator(&v, &w).into_iter().flatten() {
                let at = v * t.cos() + w * t.sin();
                edges.extend([azimuth(&at), azimuth(&-at)]);
            }
        }
        edges.iter_mut().for_each(|psi| *psi = psi.rem_euclid(TAU));
        edges.extend([0.0, TAU]);
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|later, kept| *later - *kept < 1e-14);
        edges
    }
}

/// t, modulo π, with a cos²t + 2b cos t sin t + c sin²t = 0.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let amplitude = (0.5 * (a - c)).hypot(b);
    let cosine = -0.5 * (a + c) / amplitude;
    // a double root is lost to rounding: taken back
    if !(cosine.abs() < 1.0 + 1e-9) {
        return [None; 2];
    }
    let (centre, half) = (0.5 * b.atan2(0.5 * (a - c)), 0.5 * cosine.clamp(-1.0, 1.0).acos());
    [Some(centre - half), Some(centre + half)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_roots_logarithms_and_cusps() {
        let rule = tanh_sinh(5);
        let sum = |f: &dyn Fn(f64) -> f64| rule.iter().map(|n| n.weight * f(n.between(0.0, 1.0))).sum::<f64>();
        for (got, expected) in [
            (sum(&|_| 1.0), 1.0),
            (sum(&|x| x.sqrt()), 2.0 / 3.0),
            (sum(&|x| -x.ln()), 1.0),
            (sum(&|x| (1.0 - x).powf(0.05)), 1.0 / 1.05),
            (sum(&|x| x / (1e-14 + x * x)), 0.5 * (1e14_f64).ln_1p()),
        ] {
            assert!((got / expected - 1.0).abs() < 1e-11, "{got} {expected}");
        }
    }
}
