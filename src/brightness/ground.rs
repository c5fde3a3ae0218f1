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

/// Exponents of the ground's lobe below this end with a branch point at r·u = 0.
const SMOOTH_EXPONENT: f64 = 4.0;

/// The Earth under one lamp, seen from one place.
#[derive(Debug, Clone)]
pub struct Ground {
    axes: [Vector<Itrs>; 3],
    /// R/r.
    pub(super) k: f64,
    /// The lamp, in the frame of the vertical: (0, cos E, sin E).
    pub(super) lamp: Vector<Vertical>,
    /// E, the lamp's elevation at the sub-satellite point.
    pub(super) elevation_rad: f64,
    /// How the ground scatters.
    pub(super) law: GroundLaw,
}

/// The ground's scattering law, taken apart.
#[derive(Debug, Clone)]
pub(super) enum GroundLaw {
    /// `diffuse + peak max(0, r·u)ⁿ` \[1/sr\]; Lambert has no peak.
    Phong { diffuse: f64, peak: f64, n: f64 },
    /// Any other, evaluated as it stands.
    Other(Brdf),
}

/// One latitude circle of the view: all directions of equal ζ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Circle {
    /// Nadir angle η of the direction: sin, cos.
    pub eta: (f64, f64),
    /// Angle θ at the Earth's centre: sin, cos.
    pub theta: (f64, f64),
    /// dω = `solid_angle` dζ dφ.
    pub solid_angle: f64,
    /// p·s = a + b sin φ, the sine of the lamp's elevation at the ground.
    pub height: (f64, f64),
    /// r·u = a + b sin φ, the cosine between the mirror image of the lamp in the ground and the satellite.
    pub glint: (f64, f64),
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
        Some(Self {
            axes: [y.cross(&z), y, z],
            k,
            lamp: Vector::new(0.0, cos_e, sin_e),
            elevation_rad: sin_e.atan2(cos_e),
            law: GroundLaw::new(brdf),
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

    /// Radiance towards the satellite from the ground in direction `w` (unit, from the satellite) per unit irradiance of
    /// the lamp \[1/sr\]; 0 beyond the limb and on the dark side.
    #[must_use]
    pub fn seen_in(&self, w: &Vector<Itrs>) -> f64 {
        self.radiance_from(&self.local(w))
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
        self.circle_of(zeta_rad.sin_cos())
    }

    fn circle_of(&self, (sin_z, cos_z): (f64, f64)) -> Circle {
        let sin_eta = self.k * sin_z;
        let cos_eta = (1.0 - sin_eta * sin_eta).sqrt();
        let theta = (sin_z * cos_eta - cos_z * sin_eta, cos_z * cos_eta + sin_z * sin_eta);
        let (cos_e, sin_e) = (self.lamp.y(), self.lamp.z());
        // ζ + θ
        let sum = (sin_z * theta.1 + cos_z * theta.0, cos_z * theta.1 - sin_z * theta.0);
        Circle {
            eta: (sin_eta, cos_eta),
            theta,
            solid_angle: self.k * self.k * sin_z * cos_z / cos_eta,
            height: (theta.1 * sin_e, theta.0 * cos_e),
            // r·u = 2 (p·s)(p·u) − s·u = cos(ζ+θ) sin E + sin(ζ+θ) cos E sin φ
            glint: (sum.1 * sin_e, sum.0 * cos_e),
        }
    }

    /// Radiance towards the satellite from the ground in direction w per unit irradiance of the lamp \[1/sr\]; 0 beyond
    /// the limb and on the dark side.
    pub(super) fn radiance_from(&self, w: &Vector<Vertical>) -> f64 {
        let sin_eta = w.x().hypot(w.y());
        if !(w.z() < 0.0 && sin_eta < self.k) {
            return 0.0;
        }
        let sin_z = sin_eta / self.k;
        let circle = self.circle_of((sin_z, ((1.0 - sin_z) * (1.0 + sin_z)).sqrt()));
        let phi = if sin_eta > 0.0 { (w.y() / sin_eta, w.x() / sin_eta) } else { (1.0, 0.0) };
        self.radiance(&circle, phi)
    }

    /// The same on a circle; φ as (sin, cos). `L = f_E(s, p, −w) max(0, p·s)`.
    pub(super) fn radiance(&self, circle: &Circle, phi: (f64, f64)) -> f64 {
        let height = circle.height.0 + circle.height.1 * phi.0;
        if !(height > 0.0) {
            return 0.0;
        }
        let f = match &self.law {
            GroundLaw::Phong { diffuse, peak, n } => {
                let glint = circle.glint.0 + circle.glint.1 * phi.0;
                diffuse + if glint > 0.0 { peak * glint.min(1.0).powf(*n) } else { 0.0 }
            }
            GroundLaw::Other(brdf) => brdf.value(&self.lamp, &circle.ground_point(phi), &-circle.direction(phi)),
        };
        f * height
    }

    /// ζ where the terminator touches a circle, θ = |E|; `None` for a satellite that cannot see it.
    pub(super) fn terminator_zeta(&self) -> Option<f64> {
        let (sin_t, cos_t) = self.elevation_rad.abs().sin_cos();
        (cos_t > self.k).then(|| sin_t.atan2(cos_t - self.k))
    }

    /// The ζ at which ζ + θ has a value between 0 and 180°, by Newton's method on the rising 2ζ − η; `None` beyond the
    /// limb.
    pub(super) fn zeta_of_glint_angle(&self, wanted: f64) -> Option<f64> {
        let sum = |zeta: f64| 2.0 * zeta - (self.k * zeta.sin()).asin();
        if !(wanted > 0.0 && wanted < sum(FRAC_PI_2)) {
            return None;
        }
        let (mut low, mut high) = (0.0, FRAC_PI_2);
        let mut zeta = (wanted / (2.0 - self.k)).min(FRAC_PI_2);
        for _ in 0..60 {
            let off = sum(zeta) - wanted;
            if off > 0.0 {
                high = zeta
            } else {
                low = zeta
            }
            let sin_eta = self.k * zeta.sin();
            let slope = 2.0 - self.k * zeta.cos() / (1.0 - sin_eta * sin_eta).sqrt();
            let next = zeta - off / slope;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - zeta).abs() < 1e-15 {
                break;
            }
            zeta = next;
        }
        Some(zeta)
    }

    /// The exponent of the ground's lobe, if it has one.
    pub(super) fn lobe_exponent(&self) -> Option<f64> {
        match self.law {
            GroundLaw::Phong { n, peak, .. } if peak > 0.0 => Some(n),
            _ => None,
        }
    }

    /// The ground's lobe ends with a branch point or a step.
    pub(super) fn lobe_ends_sharply(&self) -> bool {
        self.lobe_exponent().is_some_and(|n| n < SMOOTH_EXPONENT && (n.fract() != 0.0 || n == 0.0))
    }

    /// ζ at which an edge of the lobe touches a circle: ζ + θ = |E| and 180° − |E|.
    pub(super) fn lobe_edge_zetas(&self) -> [Option<f64>; 2] {
        let e = self.elevation_rad.abs();
        [self.zeta_of_glint_angle(e), self.zeta_of_glint_angle(PI - e)]
    }

    /// ζ of a nadir angle η; `None` beyond the limb.
    pub(super) fn zeta_of_nadir_angle(&self, eta_rad: f64) -> Option<f64> {
        let sin_z = eta_rad.sin() / self.k;
        (eta_rad > 0.0 && eta_rad < FRAC_PI_2 && sin_z < 1.0).then(|| sin_z.asin())
    }
}

impl GroundLaw {
    fn new(brdf: &Brdf) -> Self {
        match brdf {
            Brdf::Lambert { albedo } => GroundLaw::Phong { diffuse: albedo / PI, peak: 0.0, n: 1.0 },
            Brdf::Phong { kd, ks, n } => {
                GroundLaw::Phong { diffuse: kd / PI, peak: ks * (n + 2.0) / (2.0 * PI), n: *n }
            }
            other => GroundLaw::Other(other.clone()),
        }
    }
}

impl Circle {
    /// The unit vector from the satellite; φ as (sin, cos).
    pub(super) fn direction(&self, phi: (f64, f64)) -> Vector<Vertical> {
        Vector::new(self.eta.0 * phi.1, self.eta.0 * phi.0, -self.eta.1)
    }

    /// The unit vector from the Earth's centre to the ground point seen there.
    pub(super) fn ground_point(&self, phi: (f64, f64)) -> Vector<Vertical> {
        Vector::new(self.theta.0 * phi.1, self.theta.0 * phi.0, self.theta.1)
    }
}
