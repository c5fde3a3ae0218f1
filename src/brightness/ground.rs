//! The lit Earth as a satellite sees it: directions to ground points, their light, and every edge in that view.
//!
//! A sphere under parallel light. Directions from the satellite are (ζ, φ): ζ is the zenith angle of the satellite at
//! the ground point, φ turns about the vertical. Distances enter as the ratio k = R/r only. No twilight, no clouds.

use std::f64::consts::{FRAC_PI_2, PI};

use super::brdf::Brdf;
use crate::vector::{Itrs, Vector};

/// Axes of the satellite's vertical: z up, y to the light, x = y × z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Vertical {}

/// From this exponent on the end of a lobe, xⁿ, is smooth enough for a Gauss rule across it.
pub(super) const SMOOTH_EXPONENT: f64 = 4.0;

/// The Earth under one lamp, seen from one place.
#[derive(Debug, Clone)]
pub struct Ground {
    axes: [Vector<Itrs>; 3],
    /// R/r.
    pub(super) k: f64,
    /// The lamp, in the frame of the vertical: (0, cos E, sin E).
    lamp: Vector<Vertical>,
    elevation_rad: f64,
    brdf: Brdf,
}

/// One latitude circle of the view: all directions of equal ζ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Circle {
    /// Nadir angle η of the direction: sin, cos.
    pub eta: (f64, f64),
    /// Angle θ at the Earth's centre: sin, cos.
    theta: (f64, f64),
    /// dω = `solid_angle` dζ dφ.
    pub solid_angle: f64,
}

impl Ground {
    /// The ground under a satellite at `satellite_km`, lit from the geocentric direction `lamp`.
    ///
    /// `None` when the satellite is not above the sphere or a direction is undefined.
    #[must_use]
    pub fn new(satellite_km: &Vector<Itrs>, radius_km: f64, lamp: &Vector<Itrs>, brdf: &Brdf) -> Option<Self> {
        let k = radius_km / satellite_km.norm();
        if !(k > 0.0 && k < 1.0) {
            return None;
        }
        let z = satellite_km.unit()?;
        let lamp = lamp.unit()?;
        let sin_e = z.dot(&lamp).clamp(-1.0, 1.0);
        // with the lamp in the zenith or the nadir every y will do
        let across = lamp - z * sin_e;
        let y = if across.norm() > 1e-12 { across.unit()? } else { z.any_perpendicular()? };
        let cos_e = across.norm();
        let elevation_rad = sin_e.atan2(cos_e);
        Some(Self {
            axes: [y.cross(&z), y, z],
            k,
            lamp: Vector::new(0.0, cos_e, sin_e),
            elevation_rad,
            brdf: brdf.clone(),
        })
    }

    /// Some ground in view is lit: E > −arccos(R/r).
    #[must_use]
    pub fn lit_in_view(&self) -> bool {
        self.elevation_rad > -self.k.acos()
    }

    /// A surface with this unit normal has some ground in front of it: its angle to nadir is below 90° + asin(R/r).
    #[must_use]
    pub fn seen_by(&self, normal: &Vector<Itrs>) -> bool {
        // −n·z > −sin η_max
        self.local(normal).z() < self.k
    }

    /// Components of a direction in the frame of the vertical.
    pub(super) fn local(&self, v: &Vector<Itrs>) -> Vector<Vertical> {
        let [x, y, z] = &self.axes;
        Vector::new(v.dot(x), v.dot(y), v.dot(z))
    }

    /// The circle of zenith angle ζ.
    ///
    /// `sin η = k sin ζ`, `θ = ζ − η`, `dω = k² sin ζ cos ζ / cos η dζ dφ`: no singularity at the limb ζ = 90°.
    pub(super) fn circle(&self, zeta_rad: f64) -> Circle {
        let (sin_z, cos_z) = zeta_rad.sin_cos();
        let sin_eta = self.k * sin_z;
        let cos_eta = (1.0 - sin_eta * sin_eta).sqrt();
        Circle {
            eta: (sin_eta, cos_eta),
            theta: (sin_z * cos_eta - cos_z * sin_eta, cos_z * cos_eta + sin_z * sin_eta),
            solid_angle: self.k * self.k * sin_z * cos_z / cos_eta,
        }
    }

    /// Where the terminator crosses a circle: φ = 90° ± arccos(−tan E/tan θ).
    pub(super) fn terminator(&self, circle: &Circle) -> Option<(f64, f64)> {
        let x = -self.lamp.z() * circle.theta.1 / (self.lamp.y() * circle.theta.0);
        (x.abs() < 1.0).then(|| (FRAC_PI_2, x.acos()))
    }

    /// ζ where the terminator touches a circle, θ = |E|; beyond the limb for a satellite that cannot see it.
    pub(super) fn terminator_zeta(&self) -> f64 {
        let (sin_t, cos_t) = self.elevation_rad.abs().sin_cos();
        sin_t.atan2(cos_t - self.k)
    }

    /// Where a ground lobe with a branch point ends on a circle, r·u = 0: φ = 90° ± arccos(−tan E/tan(ζ+θ)).
    pub(super) fn lobe_edge(&self, circle: &Circle) -> Option<(f64, f64)> {
        self.lobe_ends()?;
        // ζ + θ = η + 2θ
        let ((sin_t, cos_t), (sin_h, cos_h)) = (circle.theta, circle.eta);
        let (sin_2t, cos_2t) = (2.0 * sin_t * cos_t, (cos_t - sin_t) * (cos_t + sin_t));
        let (sin_sum, cos_sum) = (sin_h * cos_2t + cos_h * sin_2t, cos_h * cos_2t - sin_h * sin_2t);
        let x = -self.lamp.z() * cos_sum / (self.lamp.y() * sin_sum);
        (x.abs() < 1.0).then(|| (FRAC_PI_2, x.acos()))
    }

    /// The ζ at which that edge touches a circle: ζ + θ = |E| and 180° − |E|, by bisection of the rising 2ζ − η.
    pub(super) fn lobe_edge_zetas(&self) -> Vec<f64> {
        if self.lobe_ends().is_none() {
            return Vec::new();
        }
        let sum = |zeta: f64| 2.0 * zeta - (self.k * zeta.sin()).asin();
        let e = self.elevation_rad.abs();
        let reached = [e, PI - e].into_iter().filter(|wanted| *wanted > 0.0 && *wanted < sum(FRAC_PI_2));
        reached
            .map(|wanted| {
                let (mut low, mut high) = (0.0, FRAC_PI_2);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if sum(middle) < wanted { low = middle } else { high = middle }
                }
                low
            })
            .collect()
    }

    /// The exponent of the ground's lobe when its end is not smooth.
    fn lobe_ends(&self) -> Option<f64> {
        self.brdf.lobe_exponent().filter(|n| *n < SMOOTH_EXPONENT)
    }

    /// ζ of a nadir angle η; `None` beyond the limb.
    pub(super) fn zeta_of_nadir_angle(&self, eta_rad: f64) -> Option<f64> {
        let sin_z = eta_rad.sin() / self.k;
        (eta_rad > 0.0 && eta_rad < FRAC_PI_2 && sin_z < 1.0).then(|| sin_z.asin())
    }

    /// Radiance towards the satellite per unit irradiance of the lamp \[1/sr\]; 0 on the dark side.
    ///
    /// `L = f_E(s, p, −w) max(0, p·s)`, w the direction from the satellite to the ground point p.
    pub(super) fn radiance(&self, circle: &Circle, phi: (f64, f64), w: &Vector<Vertical>) -> f64 {
        let height = self.lamp_height(circle, phi);
        if height > 0.0 { self.brdf.value(&self.lamp, &circle.ground_point(phi), &-*w) * height } else { 0.0 }
    }

    /// p·s, the sine of the lamp's elevation at a ground point; φ as (sin, cos).
    pub(super) fn lamp_height(&self, circle: &Circle, phi: (f64, f64)) -> f64 {
        circle.ground_point(phi).dot(&self.lamp)
    }
}

impl Circle {
    /// The unit vector from the satellite; φ as (sin, cos).
    pub(super) fn direction(&self, phi: (f64, f64)) -> Vector<Vertical> {
        Vector::new(self.eta.0 * phi.1, self.eta.0 * phi.0, -self.eta.1)
    }

    /// The unit vector from the Earth's centre to the ground point seen there.
    fn ground_point(&self, phi: (f64, f64)) -> Vector<Vertical> {
        Vector::new(self.theta.0 * phi.1, self.theta.0 * phi.0, self.theta.1)
    }
}

/// The directions at angle `half_rad` from an axis: a closed curve in the view.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    axis: Vector<Vertical>,
    half_rad: f64,
    /// The integrand has a branch point here.
    pub kink: bool,
}

impl Cone {
    pub(super) fn new(axis: Vector<Vertical>, half_rad: f64, kink: bool) -> Self {
        Self { axis, half_rad, kink }
    }

    /// Where the cone crosses a circle: φ = centre ± half.
    ///
    /// `w·a = sin η a_t cos(φ − φ_a) − cos η a_z = cos γ`.
    pub(super) fn crossing(&self, circle: &Circle) -> Option<(f64, f64)> {
        let across = self.axis.x().hypot(self.axis.y());
        let cos_half = if self.half_rad == FRAC_PI_2 { 0.0 } else { self.half_rad.cos() };
        let x = (cos_half + circle.eta.1 * self.axis.z()) / (circle.eta.0 * across);
        (x.abs() < 1.0).then(|| (self.axis.y().atan2(self.axis.x()), x.acos()))
    }

    /// Nadir angles at which the cone touches a circle.
    pub(super) fn tangent_nadir_angles(&self) -> [f64; 3] {
        let nadir_angle = self.axis.x().hypot(self.axis.y()).atan2(-self.axis.z());
        let sum = nadir_angle + self.half_rad;
        [(nadir_angle - self.half_rad).abs(), sum, 2.0 * PI - sum]
    }
}
