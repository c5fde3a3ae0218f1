//! The beam a mirror throws, and its spot on the ground.

use crate::base::constants::WGS84_A_KM;
use crate::base::constants::WGS84_F;
use crate::base::error::Result;
use crate::base::vector::Itrs;
use crate::base::vector::Vector;
use crate::brightness::Brdf;
use crate::brightness::direct_reflection;
use crate::brightness::scene::geodetic_up;
use crate::config::SourceDisc;
use crate::visibility::simple::above_zero;

/// Divergence of a beam of sunlight as published \[deg\]: the diameter of the Sun's disc.
pub const PUBLISHED_DIVERGENCE_DEG: f64 = 0.53;

/// A cone of reflected light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// The mirror \[km\].
    pub origin_km: Vector<Itrs>,
    /// Unit vector along the middle of the beam.
    pub axis: Vector<Itrs>,
    /// Half the divergence \[rad\].
    pub half_rad: f64,
}

/// Where a beam meets the ground: an ellipse in the plane that touches the Earth there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Its middle line's point on the WGS84 ellipsoid \[km\].
    pub centre_km: Vector<Itrs>,
    /// Mirror to that point \[km\].
    pub range_km: f64,
    /// Angle of the beam from the vertical there \[rad\].
    pub incidence_rad: f64,
    /// Longest diameter, along the beam's azimuth \[km\]; `None` where the cone leaves the plane (grazing).
    pub along_km: Option<f64>,
    /// Shortest diameter \[km\]; `None` as that.
    pub across_km: Option<f64>,
}

/// Diameter of a beam at a distance, across it \[km\]: `2 d tan(δ/2)`, δ the divergence.
///
/// # Errors
/// [`crate::Error::Model`] for a distance or divergence that is not above 0.
pub fn beam_diameter_km(range_km: f64, divergence_rad: f64) -> Result<f64> {
    Ok(2.0 * above_zero("range_km", range_km)? * (0.5 * above_zero("divergence_rad", divergence_rad)?).tan())
}

/// Direction in which a mirror sends the light of a light source: `r = 2(n·s) n − s`; `None` with the light source
/// behind it.
#[must_use]
pub fn reflected(normal: &Vector<Itrs>, toward_source: &Vector<Itrs>) -> Option<Vector<Itrs>> {
    let cos = normal.dot(toward_source);
    (cos > 0.0).then(|| *normal * (2.0 * cos) - *toward_source)
}

impl Beam {
    /// Angle between the middle of the beam and the direction to a place \[rad\].
    #[must_use]
    pub fn offset_rad(&self, place_km: &Vector<Itrs>) -> f64 {
        self.axis.angle_to(&(*place_km - self.origin_km))
    }

    /// Where the beam meets the Earth; `None` if it passes by.
    ///
    /// The cone of half-angle α under the incidence i cuts the plane in an ellipse of semi-axes
    /// `a = d sin α cos α cos i / (cos² i − sin² α)` and `b = a sqrt(1 − e²)`, `e = sin i / cos α`.
    #[must_use]
    pub fn spot(&self) -> Option<Spot> {
        // the ellipsoid as a unit sphere: z stretched
        let scale = |v: &Vector<Itrs>| Vector::<Itrs>::new(v.x(), v.y(), v.z() / (1.0 - WGS84_F)) * (1.0 / WGS84_A_KM);
        let (p, u) = (scale(&self.origin_km), scale(&self.axis));
        let (a, b, c) = (u.dot(&u), p.dot(&u), p.dot(&p) - 1.0);
        let discriminant = b * b - a * c;
        if !(discriminant >= 0.0 && b < 0.0 && c > 0.0) {
            return None;
        }
        // the nearer root, without cancellation
        let range_km = c / (discriminant.sqrt() - b);
        let centre_km = self.origin_km + self.axis * range_km;
        let up = geodetic_up(&centre_km);
        let incidence_rad = (-self.axis).angle_to(&up);
        let ((sin_a, cos_a), (sin_i, cos_i)) = (self.half_rad.sin_cos(), incidence_rad.sin_cos());
        let below = cos_i * cos_i - sin_a * sin_a;
        let along = (cos_i > 0.0 && below > 0.0).then(|| 2.0 * range_km * sin_a * cos_a * cos_i / below);
        let across = along.map(|along| along * (1.0 - (sin_i / cos_a).powi(2)).max(0.0).sqrt());
        Some(Spot { centre_km, range_km, incidence_rad, along_km: along, across_km: across })
    }
}

/// Magnitude of a mirror for an observer at `range_km` in the direction `observer`; `None` outside the beam.
///
/// `E/E_source = ρ A cos θ_i / (d² Ω)` inside, Ω the solid angle of the light source's disc: its radiance is kept. The
/// mirror is a point. Unit vectors at the mirror.
#[must_use]
pub fn glint_mag(
    (area_m2, reflectance): (f64, f64),
    (normal, toward_source, observer): (&Vector<Itrs>, &Vector<Itrs>, &Vector<Itrs>),
    range_km: f64,
    disc_rad: f64,
    source_mag: f64,
) -> Option<f64> {
    let mirror = Brdf::Mirror { reflectance };
    let per_sr = direct_reflection(&mirror, toward_source, normal, observer, disc_rad, SourceDisc::Convolved);
    let ratio = per_sr * area_m2 * normal.dot(observer).max(0.0) / (1e3 * range_km).powi(2);
    crate::visibility::simple::magnitude(ratio, source_mag)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALPHA: f64 = 0.265 * std::f64::consts::PI / 180.0;

    #[test]
    fn straight_down_the_spot_is_a_circle_of_the_published_diameter() {
        let beam = Beam {
            origin_km: Vector::new(WGS84_A_KM + 625.0, 0.0, 0.0),
            axis: Vector::new(-1.0, 0.0, 0.0),
            half_rad: ALPHA,
        };
        let spot = beam.spot().unwrap();
        assert!((spot.range_km - 625.0).abs() < 1e-9);
        assert!((spot.along_km.unwrap() - 5.781_444_372).abs() < 1e-6);
        assert!((spot.across_km.unwrap() - 5.781_444_372).abs() < 1e-6);
        assert!((beam_diameter_km(625.0, 2.0 * ALPHA).unwrap() - 5.781_444_372).abs() < 1e-6);
        let up = Beam { axis: Vector::new(1.0, 0.0, 0.0), ..beam };
        assert!(up.spot().is_none());
    }

    #[test]
    fn the_ellipse_of_a_slanted_beam_is_where_the_rays_of_its_edge_meet_the_plane() {
        let origin_km = Vector::new(WGS84_A_KM + 625.0, 0.0, 0.0);
        for slant in [0.2_f64, 0.6, 1.0] {
            let axis = Vector::new(-slant.cos(), slant.sin(), 0.0);
            let spot = Beam { origin_km, axis, half_rad: ALPHA }.spot().unwrap();
            let up = geodetic_up(&spot.centre_km);
            // rays of the edge: turned by α within and at right angles to the plane of incidence
            let meets = |ray: Vector<Itrs>| {
                let t = (spot.centre_km - origin_km).dot(&up) / ray.dot(&up);
                origin_km + ray * t
            };
            let turned = |by: f64| Vector::new(-(slant + by).cos(), (slant + by).sin(), 0.0);
            let along = (meets(turned(ALPHA)) - meets(turned(-ALPHA))).norm();
            assert!((along / spot.along_km.unwrap() - 1.0).abs() < 1e-9, "{slant}: {along}");
            let side = |s: f64| meets(axis * ALPHA.cos() + Vector::new(0.0, 0.0, s * ALPHA.sin()));
            let across = (side(1.0) - side(-1.0)).norm();
            // through the middle line, which is off the ellipse's middle by 1e-3 of it
            assert!((across / spot.across_km.unwrap() - 1.0).abs() < 1e-3, "{slant}: {across}");
            assert!(spot.along_km > spot.across_km);
        }
    }

    #[test]
    fn a_mirror_sends_light_by_the_law_of_reflection_and_none_from_behind() {
        let (n, s) = (Vector::new(0.0, 0.0, 1.0), Vector::new(0.6, 0.0, 0.8));
        assert_eq!(reflected(&n, &s).unwrap().to_array(), [-0.6, 0.0, 0.8]);
        assert!(reflected(&n, &-s).is_none());
    }
}
