//! A surface in the frame of the satellite's vertical, and where on a circle of the view its lobe is.
//!
//! Angles in rad; u = φ − 90° is counted from the azimuth of the light source, about which the ground's light is
//! symmetric.

use std::f64::consts::{FRAC_PI_2, PI};

use super::profile::{Metric, PreparedBrdf};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::ground::{Circle, Ground, Vertical};

/// Lobes narrower than this are.
const NARROW: f64 = 0.05;

/// A surface, an observer, and the direction in which the observer sees the ground as in a mirror.
pub(super) struct Facet<'a> {
    pub law: &'a PreparedBrdf,
    pub normal: Vector<Vertical>,
    pub observer: Vector<Vertical>,
    /// m = 2 (n·o) n − o.
    pub mirror: Vector<Vertical>,
    /// n·o = n·m.
    pub cos_out: f64,
    /// u of normal and mirror direction.
    pub u_normal: f64,
    pub u_mirror: f64,
    /// sin and cos of the nadir angle of the mirror direction.
    pub eta_mirror: (f64, f64),
    pub metric: Metric,
    /// Over this distance the middle of the lobe changes.
    pub width: f64,
}

/// Where on a circle the lobe is nearest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    pub u: f64,
    /// Squared distance there.
    pub x2: f64,
    /// About u the distance grows like x2 + c² Δu².
    pub c: f64,
}

impl<'a> Facet<'a> {
    pub fn new(ground: &Ground, law: &'a PreparedBrdf, normal: &Vector<Itrs>, observer: &Vector<Itrs>) -> Self {
        let (normal, observer) = (ground.local(normal), ground.local(observer));
        let cos_out = normal.dot(&observer);
        let mirror = normal * (2.0 * cos_out) - observer;
        // −o_t·i_t at i = m
        let v = 1.0 - cos_out * cos_out;
        let u = |v: &Vector<Vertical>| (-v.x()).atan2(v.y());
        Self {
            law,
            normal,
            observer,
            mirror,
            cos_out,
            u_normal: u(&normal),
            u_mirror: u(&mirror),
            eta_mirror: (mirror.x().hypot(mirror.y()), -mirror.z()),
            metric: law.metric(),
            width: law.width_at(v),
        }
    }

    /// The lobe is so narrow that polar coordinates about it may do better than rings.
    pub fn is_narrow(&self) -> bool {
        self.metric != Metric::None && self.width < NARROW
    }

    /// n·w = a + b cos(u − u_n) on a circle.
    pub fn front(&self, circle: &Circle) -> (f64, f64) {
        (-circle.eta.1 * self.normal.z(), circle.eta.0 * self.normal.x().hypot(self.normal.y()))
    }

    /// m·w = a + b cos(u − u_m) on a circle.
    pub fn lobe_side(&self, circle: &Circle) -> (f64, f64) {
        (-circle.eta.1 * self.mirror.z(), circle.eta.0 * self.mirror.x().hypot(self.mirror.y()))
    }

    /// Squared distance of a direction from the lobe's middle, in the law's own metric.
    pub fn distance2(&self, circle: &Circle, u: f64) -> f64 {
        let (sin_u, cos_u) = u.sin_cos();
        let apart = circle.direction((cos_u, -sin_u)) - self.mirror;
        let chord2 = apart.dot(&apart);
        match self.metric {
            Metric::Plane => (chord2 - self.normal.dot(&apart).powi(2)).max(0.0),
            _ => chord2,
        }
    }

    /// Where on a circle the lobe is nearest: closed for the chord, Newton's method in the plane of the surface.
    pub fn nearest(&self, circle: &Circle) -> Nearest {
        let (sin_eta, cos_eta) = circle.eta;
        if self.metric == Metric::None {
            return Nearest { u: 0.0, x2: 0.0, c: 0.0 };
        }
        let level = self.normal.x() == 0.0 && self.normal.y() == 0.0;
        if self.metric == Metric::Plane && level {
            let ds = sin_eta - self.eta_mirror.0;
            return Nearest { u: self.u_mirror, x2: ds * ds, c: (sin_eta * self.eta_mirror.0).sqrt() };
        }
        if self.metric == Metric::Chord {
            let (ds, dc) = (sin_eta - self.eta_mirror.0, cos_eta - self.eta_mirror.1);
            return Nearest { u: self.u_mirror, x2: ds * ds + dc * dc, c: (sin_eta * self.eta_mirror.0).sqrt() };
        }
        let n = &self.normal;
        let mut u = self.u_mirror;
        for _ in 0..6 {
            let (sin_u, cos_u) = u.sin_cos();
            let w = circle.direction((cos_u, -sin_u));
            let slope = Vector::<Vertical>::new(-sin_eta * cos_u, -sin_eta * sin_u, 0.0);
            let bend = Vector::<Vertical>::new(sin_eta * sin_u, -sin_eta * cos_u, 0.0);
            let apart = w - self.mirror;
            let off = n.dot(&apart);
            // D² = |δ|² − (n·δ)² and half its derivatives
            let x2 = (apart.dot(&apart) - off * off).max(0.0);
            let first = apart.dot(&slope) - off * n.dot(&slope);
            let second = sin_eta * sin_eta + apart.dot(&bend) - n.dot(&slope).powi(2) - off * n.dot(&bend);
            if !(second > 0.0) {
                return Nearest { u, x2, c: 0.0 };
            }
            let step = (-first / second).clamp(-0.7, 0.7);
            let least = (x2 - first * first / second).max(0.0);
            u += step;
            if (step * step) * second < 0.01 * (least + 1e-6 * self.width * self.width) + 1e-30 {
                return Nearest { u: wrapped(u), x2: least, c: second.sqrt() };
            }
        }
        Nearest { u: wrapped(u), x2: self.distance2(circle, u), c: sin_eta }
    }

    /// The nadir angle of the mirror direction.
    pub fn nadir_angle_of_mirror(&self) -> f64 {
        self.eta_mirror.0.atan2(self.eta_mirror.1)
    }

    /// Nadir angle at which the great circle at right angles to an axis touches a circle of the view.
    pub fn tangent_nadir_angle(axis: &Vector<Vertical>) -> f64 {
        (FRAC_PI_2 - axis.x().hypot(axis.y()).atan2(-axis.z())).abs()
    }
}

/// An angle within −180° to 180°.
pub(super) fn wrapped(u: f64) -> f64 {
    if u > PI {
        u - 2.0 * PI
    } else if u < -PI {
        u + 2.0 * PI
    } else {
        u
    }
}
