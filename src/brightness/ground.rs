//! The lit Earth as a satellite sees it: directions to ground points, their light, and every edge in that view.
//!
//! A sphere, under parallel light or under a Moon at its distance. Directions from the satellite are (ζ, φ): ζ is the
//! zenith angle of the satellite at the ground point, φ turns about the vertical. Distances enter as the ratio k = R/r
//! only. No twilight, no clouds.

use std::f64::consts::{FRAC_PI_2, PI};

use super::brdf::Brdf;
use super::light_sources::NearMoon;
use crate::base::vector::{Itrs, Vector};

/// Axes of the satellite's vertical: z up, y to the light, x = y × z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Vertical {}

/// Exponents of the ground's lobe below this end with a branch point at r·u = 0.
const SMOOTH_EXPONENT: f64 = 4.0;

/// The Earth under one light source, seen from one place.
#[derive(Debug, Clone)]
pub struct Ground {
    axes: [Vector<Itrs>; 3],
    /// R/r.
    pub(super) k: f64,
    /// The light source, in the frame of the vertical: (0, cos E, sin E).
    pub(super) light_source: Vector<Vertical>,
    /// E, the light source's elevation at the sub-satellite point above the plane through the Earth's centre.
    pub(super) elevation_rad: f64,
    /// How far the sub-satellite point is inside the lit cap: E under parallel light, E − arcsin(R/D) under a light
    /// source at D.
    pub(super) lit_rad: f64,
    near: Option<Near>,
    /// How the ground scatters.
    pub(super) law: GroundLaw,
}

/// What every place on the ground has of its own under a Moon at its distance.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// R/D.
    ratio: f64,
    /// From the Moon to the Sun.
    to_sun: Vector<Vertical>,
    /// Its component away from the Earth's centre.
    sun_outward: f64,
    moon: NearMoon,
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
    /// p·s = (a + b sin φ)/δ, the sine of the light source's elevation at the ground; δ is 1 under parallel light, the
    /// light source's distance from the place over that from the Earth's centre otherwise.
    pub height: (f64, f64),
    /// r·u = (a + b sin φ)/δ, the cosine between the mirror image of the light source in the ground and the satellite.
    pub glint: (f64, f64),
}

impl Ground {
    /// The ground under a satellite at `satellite_km`, lit from the geocentric direction `light_source`.
    ///
    /// `None` when the satellite is not above the sphere or a direction is undefined.
    #[must_use]
    pub fn new(satellite_km: &Vector<Itrs>, radius_km: f64, light_source: &Vector<Itrs>, brdf: &Brdf) -> Option<Self> {
        let k = radius_km / satellite_km.norm();
        if !(k > 0.0 && k < 1.0) {
            return None;
        }
        let z = satellite_km.unit()?;
        let light_source = light_source.unit()?;
        let sin_e = z.dot(&light_source).clamp(-1.0, 1.0);
        // with the light source in the zenith or the nadir every y will do
        let across = light_source - z * sin_e;
        let y = if across.norm() > 1e-12 { across.unit()? } else { z.any_perpendicular()? };
        let cos_e = across.norm();
        Some(Self {
            axes: [y.cross(&z), y, z],
            k,
            light_source: Vector::new(0.0, cos_e, sin_e),
            elevation_rad: sin_e.atan2(cos_e),
            lit_rad: sin_e.atan2(cos_e),
            near: None,
            law: GroundLaw::new(brdf),
        })
    }

    /// The ground under a satellite, every place lit by the Moon as it is seen from there: direction, distance, phase.
    ///
    /// With s the Moon's direction from the Earth's centre, ε = R/D and δ² = 1 + ε² − 2ε p·s, a place p sees it in the
    /// direction (s − εp)/δ, at the distance δD, at the phase cos α = σ·(εp − s)/δ (σ from the Moon to the Sun).
    /// Irradiances are relative to that at the Earth's centre. `None` as for [`Ground::new`].
    #[must_use]
    pub fn under_moon(satellite_km: &Vector<Itrs>, radius_km: f64, moon: &NearMoon, brdf: &Brdf) -> Option<Self> {
        let mut ground = Self::new(satellite_km, radius_km, &moon.position_km, brdf)?;
        let ratio = radius_km / moon.position_km.norm();
        if !(ratio < 1.0) {
            return None;
        }
        let to_sun = ground.local(&moon.to_sun);
        ground.lit_rad -= ratio.asin();
        ground.near = Some(Near { ratio, to_sun, sun_outward: to_sun.dot(&ground.light_source), moon: *moon });
        Some(ground)
    }

    /// Some ground in view is lit: E > −arccos(R/r), under a light source at the distance D E > arcsin(R/D) −
    /// arccos(R/r).
    #[must_use]
    pub fn lit_in_view(&self) -> bool {
        self.lit_rad > -self.k.acos()
    }

    /// The light is not smooth over the ground: the lunar law has a kink among the phases it is seen at.
    pub(super) fn has_kink(&self) -> bool {
        self.near.is_some_and(|near| near.moon.phase.sharp)
    }

    /// A surface with this unit normal has some ground in front of it: its angle to nadir is below 90° + asin(R/r).
    #[must_use]
    pub fn seen_by(&self, normal: &Vector<Itrs>) -> bool {
        // −n·z > −sin η_max
        self.local(normal).z() < self.k
    }

    /// Radiance towards the satellite from the ground in direction `w` (unit, from the satellite) per unit irradiance
    /// of the light source \[1/sr\]; 0 beyond the limb and on the dark side.
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
        let (cos_e, sin_e) = (self.light_source.y(), self.light_source.z());
        // ζ + θ
        let sum = (sin_z * theta.1 + cos_z * theta.0, cos_z * theta.1 - sin_z * theta.0);
        // (s − εp)·p and (s − εp) mirrored in p, towards the satellite
        let ratio = self.near.map_or(0.0, |near| near.ratio);
        Circle {
            eta: (sin_eta, cos_eta),
            theta,
            solid_angle: self.k * self.k * sin_z * cos_z / cos_eta,
            height: (theta.1 * sin_e - ratio, theta.0 * cos_e),
            // r·u = 2 (p·s)(p·u) − s·u = cos(ζ+θ) sin E + sin(ζ+θ) cos E sin φ
            glint: (sum.1 * sin_e - ratio * cos_z, sum.0 * cos_e),
        }
    }

    /// Radiance towards the satellite from the ground in direction w per unit irradiance of the light source \[1/sr\];
    /// 0 beyond the limb and on the dark side.
    pub(super) fn radiance_from(&self, w: &Vector<Vertical>) -> f64 {
        self.place_of(w).map_or(0.0, |(circle, phi)| self.radiance(&circle, phi))
    }

    /// Circle and φ, as (sin, cos), of a direction; `None` beyond the limb.
    fn place_of(&self, w: &Vector<Vertical>) -> Option<(Circle, (f64, f64))> {
        let sin_eta = w.x().hypot(w.y());
        if !(w.z() < 0.0 && sin_eta < self.k) {
            return None;
        }
        let sin_z = sin_eta / self.k;
        let circle = self.circle_of((sin_z, ((1.0 - sin_z) * (1.0 + sin_z)).sqrt()));
        Some((circle, if sin_eta > 0.0 { (w.y() / sin_eta, w.x() / sin_eta) } else { (1.0, 0.0) }))
    }

    /// δ p·s and δ r·u of the ground in direction w: the signs say whether it is lit, and within the ground's lobe; beyond the
    /// limb those of the limb.
    pub(super) fn altitudes_from(&self, w: &Vector<Vertical>) -> (f64, f64) {
        let sin_eta = w.x().hypot(w.y());
        let sin_z = (sin_eta / self.k).min(1.0);
        let circle = self.circle_of((sin_z, ((1.0 - sin_z) * (1.0 + sin_z)).sqrt()));
        let sin_phi = if sin_eta > 0.0 { w.y() / sin_eta } else { 1.0 };
        (circle.height.0 + circle.height.1 * sin_phi, circle.glint.0 + circle.glint.1 * sin_phi)
    }

    /// Level components (x ≥ 0, y) of the direction in which the terminator meets the limb; `None` where it does not.
    pub(super) fn terminator_on_limb(&self) -> Option<(f64, f64)> {
        // at the limb θ = 90° − η: cos θ = k, and a + b sin φ = 0
        let circle = self.circle_of((1.0, 0.0));
        let sin_phi = -circle.height.0 / circle.height.1;
        (sin_phi.abs() <= 1.0).then(|| (self.k * ((1.0 - sin_phi) * (1.0 + sin_phi)).sqrt(), self.k * sin_phi))
    }

    /// The same on a circle; φ as (sin, cos). `L = f_E(s, p, −w) max(0, p·s)`, times the irradiance at the place over
    /// that at the Earth's centre.
    pub(super) fn radiance(&self, circle: &Circle, phi: (f64, f64)) -> f64 {
        let height = circle.height.0 + circle.height.1 * phi.0;
        if !(height > 0.0) {
            return 0.0;
        }
        let (moonlight, per_delta) = self.near.map_or((1.0, 1.0), |near| near.light::<false>(circle, phi));
        let f = match &self.law {
            GroundLaw::Phong { diffuse, peak, n } => {
                let glint = (circle.glint.0 + circle.glint.1 * phi.0) * per_delta;
                diffuse + if glint > 0.0 { peak * glint.min(1.0).powf(*n) } else { 0.0 }
            }
            GroundLaw::Other(brdf) => {
                let place = circle.ground_point(phi);
                let light_source =
                    self.near.map_or(self.light_source, |near| (self.light_source - place * near.ratio) * per_delta);
                brdf.value(&light_source, &place, &-circle.direction(phi))
            }
        };
        f * height * moonlight
    }

    /// What a row of nodes (cos u, sin u), u = φ − 90°, has of its own: multiplies their weights by the irradiance over
    /// that at the Earth's centre and over δ, and puts 1/δ into `per_delta`. Nothing is done under parallel light.
    #[inline(always)]
    pub(super) fn weigh(
        &self,
        circle: &Circle,
        (cos, sin): (&[f64], &[f64]),
        weight: &mut [f64],
        per_delta: &mut [f64],
    ) {
        let Some(near) = &self.near else { return };
        if near.moon.phase.is_whole() {
            near.weigh::<true>(circle, (cos, sin), weight, per_delta);
        } else {
            near.weigh::<false>(circle, (cos, sin), weight, per_delta);
        }
    }

    /// ζ where the terminator touches a circle, θ = |E|, or |E − arcsin(R/D)|; `None` for a satellite that cannot see
    /// it.
    pub(super) fn terminator_zeta(&self) -> Option<f64> {
        let (sin_t, cos_t) = self.lit_rad.abs().sin_cos();
        (cos_t > self.k).then(|| sin_t.atan2(cos_t - self.k))
    }

    /// The ζ at which the light source is seen as in a mirror in the ground, ζ + θ = 90° − E and the light source's
    /// parallax; `None` beyond the limb.
    pub(super) fn zeta_of_glint(&self) -> Option<f64> {
        let ratio = self.near.map_or(0.0, |near| near.ratio);
        self.zeta_of_glint_angle(FRAC_PI_2 - self.elevation_rad, |zeta| {
            let (sin, cos) = zeta.sin_cos();
            (-(ratio * sin).asin(), -ratio * cos)
        })
    }

    /// The ζ at which ζ + θ and a small `shift`, given with its slope, have a value between 0 and 180°, by Newton's
    /// method on the rising 2ζ − η; `None` beyond the limb.
    fn zeta_of_glint_angle(&self, wanted: f64, shift: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
        let sum = |zeta: f64| 2.0 * zeta - (self.k * zeta.sin()).asin() + shift(zeta).0;
        if !(wanted > sum(0.0) && wanted < sum(FRAC_PI_2)) {
            return None;
        }
        let (mut low, mut high) = (0.0, FRAC_PI_2);
        let mut zeta = (wanted / (2.0 - self.k)).clamp(0.0, FRAC_PI_2);
        for _ in 0..60 {
            let off = sum(zeta) - wanted;
            if off > 0.0 {
                high = zeta
            } else {
                low = zeta
            }
            let sin_eta = self.k * zeta.sin();
            let slope = 2.0 - self.k * zeta.cos() / (1.0 - sin_eta * sin_eta).sqrt() + shift(zeta).1;
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

    /// The ground's lobe ends with a branch point, a kink or a step.
    pub(super) fn lobe_ends_sharply(&self) -> bool {
        self.lobe_exponent().is_some_and(|n| n < SMOOTH_EXPONENT && (n.fract() != 0.0 || n < 2.0))
    }

    /// ζ at which an edge of the lobe touches a circle: ζ + θ = |E| and 180° − |E|.
    ///
    /// Under a light source at a distance `sin(E ∓ (ζ + θ)) = ε cos ζ`, so that arcsin(ε cos ζ) is added for one sign
    /// of E, subtracted for the other.
    pub(super) fn lobe_edge_zetas(&self) -> [Option<f64>; 3] {
        let e = self.elevation_rad;
        let Some(near) = self.near else {
            let flat = |_: f64| (0.0, 0.0);
            return [self.zeta_of_glint_angle(e.abs(), flat), self.zeta_of_glint_angle(PI - e.abs(), flat), None];
        };
        let parallax = |sign: f64| {
            move |zeta: f64| {
                let (sin, cos) = zeta.sin_cos();
                let across = near.ratio * cos;
                (sign * across.asin(), -sign * near.ratio * sin / (1.0 - across * across).sqrt())
            }
        };
        [
            self.zeta_of_glint_angle(e, parallax(1.0)),
            self.zeta_of_glint_angle(-e, parallax(-1.0)),
            if e < 0.0 {
                self.zeta_of_glint_angle(PI + e, parallax(-1.0))
            } else {
                self.zeta_of_glint_angle(PI - e, parallax(1.0))
            },
        ]
    }

    /// θ, the angle from the sub-satellite point, at which the terminator crosses the azimuth u from the light
    /// source's; not above 0 where it does not.
    pub(super) fn terminator_theta(&self, cos_u: f64) -> f64 {
        // cos θ sin E + sin θ cos E cos u = ε
        let side = cos_u * self.light_source.y();
        let theta = (-self.light_source.z() * side.signum()).atan2(side.abs());
        let ratio = self.near.map_or(0.0, |near| near.ratio);
        theta + side.signum() * (ratio / self.light_source.z().hypot(side).max(ratio + f64::MIN_POSITIVE)).asin()
    }

    /// ζ of a nadir angle η; `None` beyond the limb.
    pub(super) fn zeta_of_nadir_angle(&self, eta_rad: f64) -> Option<f64> {
        let sin_z = eta_rad.sin() / self.k;
        (eta_rad > 0.0 && eta_rad < FRAC_PI_2 && sin_z < 1.0).then(|| sin_z.asin())
    }
}

impl Near {
    /// [`Ground::weigh`] for a curve of one polynomial, or of any number.
    #[inline(always)]
    fn weigh<const WHOLE: bool>(
        &self,
        circle: &Circle,
        (cos, sin): (&[f64], &[f64]),
        weight: &mut [f64],
        per_delta: &mut [f64],
    ) {
        let nodes = weight.len();
        let (cos, sin, per_delta) = (&cos[..nodes], &sin[..nodes], &mut per_delta[..nodes]);
        for j in 0..nodes {
            let (light, inverse) = self.light::<WHOLE>(circle, (cos[j], -sin[j]));
            weight[j] *= light;
            per_delta[j] = inverse;
        }
    }

    /// At a place of a circle, φ as (sin, cos): the irradiance across the beam over that at the Earth's centre, over δ;
    /// 1/δ.
    #[inline(always)]
    fn light<const WHOLE: bool>(&self, circle: &Circle, phi: (f64, f64)) -> (f64, f64) {
        let ratio = self.ratio;
        // p·s − ε, so that δ² = 1 − ε² − 2ε (p·s − ε)
        let height = circle.height.0 + circle.height.1 * phi.0;
        let per_delta2 = 1.0 / (1.0 - ratio * ratio - 2.0 * ratio * height);
        let per_delta = per_delta2.sqrt();
        let sun_up =
            circle.theta.0 * (self.to_sun.x() * phi.1 + self.to_sun.y() * phi.0) + circle.theta.1 * self.to_sun.z();
        let phase = self.moon.phase.at::<WHOLE>((ratio * sun_up - self.sun_outward) * per_delta);
        (phase * if self.moon.by_distance { per_delta2 * per_delta } else { per_delta }, per_delta)
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
