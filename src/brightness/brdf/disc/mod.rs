//! A light source is a disc: the direct reflection of all its points, averaged.
//!
//! Radians and 1/sr. The disc is uniform; limb darkening and the pattern of the Moon are excluded. Laws of the angle to
//! the mirror direction are averaged in `lobe`, laws of D in `plane`, both exactly cut at the surface's horizon.

mod boundary;
mod lobe;
mod plane;
mod primitive;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::law::Brdf;
use crate::base::vector::Vector;
use crate::config::SourceDisc;

/// A disc up to this radius is a point \[rad\]: 2 milliarcseconds.
const POINT_RAD: f64 = 1e-8;

/// What a surface sends towards the observer of a light source's light, per unit of irradiance across the beam
/// \[1/sr\].
///
/// `(1/Ω) ∫ f(s', n, o) max(0, n·s') dω'` over the light source's disc, Ω = 2π(1 − cos α); `f(s, n, o) (n·s)` for a
/// [`SourceDisc::Point`]. The cosine towards the light source is in it: the flux is E₀ A (n·o)/d² times this.
///
/// A mirror needs the disc in either case: ρ/Ω where the observer's mirror direction meets it, so that radiance is
/// conserved, else 0; with a point source the centre of the disc must be above the surface's horizon too.
///
/// All vectors are unit vectors at the surface; `disc_rad` is the disc's angular radius α, 0 to π/2. Good to 1e-8 of
/// the value. A law that hardly changes over the disc costs one value of f and the first terms of the average's series
/// (the first neglected one is bounded by the law's own slope and curvature); the plain point value would be off by
/// α²/4 at least, 5e-6 for the Sun, since even a cosine is not its own average.
#[must_use]
pub fn direct_reflection<F>(
    brdf: &Brdf,
    toward_source: &Vector<F>,
    normal: &Vector<F>,
    observer: &Vector<F>,
    disc_rad: f64,
    disc: SourceDisc,
) -> f64 {
    let cos_out = normal.dot(observer);
    if !(cos_out > 0.0) {
        return 0.0;
    }
    let disc_rad = disc_rad.clamp(0.0, FRAC_PI_2);
    let cos_source = normal.dot(toward_source);
    if let Brdf::Mirror { reflectance } = brdf {
        let lit = disc == SourceDisc::Convolved || cos_source > 0.0;
        return if lit { mirror_reflection(*reflectance, toward_source, normal, observer, disc_rad, 0.0) } else { 0.0 };
    }
    if disc == SourceDisc::Point || !(disc_rad > POINT_RAD) {
        return brdf.value(toward_source, normal, observer) * cos_source.max(0.0);
    }
    let Some(view) = View::new(toward_source, normal, observer, disc_rad) else { return 0.0 };
    match brdf {
        Brdf::Lambert { albedo } => albedo / PI * view.mean_cosine(),
        Brdf::Phong { kd, ks, n } => {
            let diffuse = kd / PI * view.mean_cosine();
            diffuse + lobe::mean(&view, &lobe::Lobe::cosine_power(ks * (n + 2.0) / TAU, *n), diffuse)
        }
        Brdf::Gaussian { peak_per_sr, sigma } => lobe::mean(&view, &lobe::Lobe::gaussian(*peak_per_sr, *sigma), 0.0),
        Brdf::Abg { .. } | Brdf::Binomial(_) => plane::mean(&view, brdf),
        Brdf::Mirror { .. } => 0.0,
    }
}

/// The same for a mirror that itself has the angular radius `mirror_rad` seen by the observer \[1/sr\].
///
/// ρ/Ω times the share of the mirror in which the light source's disc is seen: 1 well inside the image of the disc, 0
/// outside, falling continuously over its edge; a step for `mirror_rad` = 0. 0 where the light source has no disc.
#[must_use]
pub fn mirror_reflection<F>(
    reflectance: f64,
    toward_source: &Vector<F>,
    normal: &Vector<F>,
    observer: &Vector<F>,
    disc_rad: f64,
    mirror_rad: f64,
) -> f64 {
    let cos_out = normal.dot(observer);
    if !(cos_out > 0.0 && solid_angle(disc_rad) > 0.0) {
        return 0.0;
    }
    let mirror = *normal * (2.0 * cos_out) - *observer;
    reflectance / solid_angle(disc_rad) * share_covered(mirror.angle_to(toward_source), disc_rad, mirror_rad)
}

/// Share of a disc of radius `own` that lies within another of radius `other`, their centres `apart`; all in one unit.
fn share_covered(apart: f64, other: f64, own: f64) -> f64 {
    if !(own > 0.0) {
        return if apart <= other { 1.0 } else { 0.0 };
    }
    if apart >= other + own {
        return 0.0;
    }
    if apart <= (other - own).abs() {
        return (other / own).powi(2).min(1.0);
    }
    // the lens: two sectors less the kite
    let sector = |r: f64, s: f64| ((apart * apart + r * r - s * s) / (2.0 * apart * r)).clamp(-1.0, 1.0).acos() * r * r;
    let kite = (other + own - apart) * (apart + other - own) * (apart - other + own) * (apart + other + own);
    let lens = sector(own, other) + sector(other, own) - 0.5 * kite.max(0.0).sqrt();
    (lens / (PI * own * own)).clamp(0.0, 1.0)
}

/// Solid angle of a disc \[sr\].
fn solid_angle(radius_rad: f64) -> f64 {
    let half = (0.5 * radius_rad).sin();
    2.0 * TAU * half * half
}

/// Light source, surface and observer in the axes of the surface: x along the tangential part of the light source's
/// direction, z the normal. Then the edge of the light source's disc is `x = X + P cosφ, y = Q sinφ`, an ellipse, in
/// the plane of the surface.
struct View {
    /// Direction to the light source's centre: (sinθ, 0, cosθ).
    light_source: [f64; 3],
    /// The observer's mirror direction m = 2(n·o)n − o.
    mirror: [f64; 3],
    /// m − s, without cancellation.
    apart: [f64; 3],
    /// Angular radius α of the disc \[rad\].
    disc_rad: f64,
    sin_disc: f64,
    cos_disc: f64,
    /// The edge above the surface's horizon is φ_c to 2π − φ_c; 0 where no part is below.
    cut: f64,
}

impl View {
    /// `None` where the whole disc is below the surface's horizon.
    fn new<F>(light_source: &Vector<F>, normal: &Vector<F>, observer: &Vector<F>, disc_rad: f64) -> Option<Self> {
        let (cos_source, cos_out) = (normal.dot(light_source), normal.dot(observer));
        let tangential = *light_source - *normal * cos_source;
        let x = tangential.unit().filter(|_| tangential.norm() > 1e-12).or_else(|| normal.any_perpendicular())?;
        let y = normal.cross(&x);
        let mirror = *normal * (2.0 * cos_out) - *observer;
        let apart = mirror - *light_source;
        let (sin_disc, cos_disc) = disc_rad.sin_cos();
        let sin_source = x.dot(&tangential);
        // z' = cosα cosθ − sinα sinθ cosφ > 0
        let (low, high) = (cos_disc * cos_source, sin_disc * sin_source);
        if low <= -high {
            return None;
        }
        Some(Self {
            light_source: [sin_source, 0.0, cos_source],
            mirror: [x.dot(&mirror), y.dot(&mirror), cos_out],
            apart: [x.dot(&apart), y.dot(&apart), normal.dot(&apart)],
            disc_rad,
            sin_disc,
            cos_disc,
            cut: if low >= high { 0.0 } else { (low / high).acos() },
        })
    }

    /// 1 − cos of the angle between light source and m.
    fn versine_apart(&self) -> f64 {
        0.5 * self.apart.iter().map(|x| x * x).sum::<f64>()
    }

    /// That angle \[rad\].
    fn apart_rad(&self) -> f64 {
        2.0 * (0.5 * self.versine_apart()).sqrt().min(1.0).asin()
    }

    /// A point of the disc's edge.
    fn edge(&self, phi: f64) -> [f64; 3] {
        let [sin_source, _, cos_source] = self.light_source;
        let (sin_phi, cos_phi) = phi.sin_cos();
        [
            self.cos_disc * sin_source + self.sin_disc * cos_phi * cos_source,
            self.sin_disc * sin_phi,
            self.cos_disc * cos_source - self.sin_disc * cos_phi * sin_source,
        ]
    }

    /// Azimuth from x of the points where the disc's edge meets the surface's horizon, ±.
    fn cut_azimuth(&self) -> f64 {
        let [x, y, _] = self.edge(self.cut);
        y.atan2(x)
    }

    /// Mean of max(0, n·s') over the disc: the area of its projection on the plane of the surface, over Ω.
    fn mean_cosine(&self) -> f64 {
        let [sin_source, _, cos_source] = self.light_source;
        if self.cut == 0.0 {
            return cos_source * 0.5 * (1.0 + self.cos_disc);
        }
        // ½ ∮ (x dy − y dx) along the edge and back along the horizon
        let (centre, p, q) = (self.cos_disc * sin_source, self.sin_disc * cos_source, self.sin_disc);
        let area = p * q * (PI - self.cut) - centre * q * self.cut.sin() + self.cut_azimuth();
        area.max(0.0) / solid_angle(self.disc_rad)
    }
}
