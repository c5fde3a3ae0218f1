//! How much of the Sun or the Moon a satellite sees past the Earth, and through its air.
//!
//! Angles in rad, distances in km. Three shadows: a cylinder, the penumbra of an airless Earth, and the penumbra
//! through the atmosphere. Not included: limb darkening, clouds and aerosol, the diffuse light of the twilight air.

mod atmosphere;
mod colour;
mod disc;

pub use atmosphere::atmospheric;
pub(crate) use atmosphere::{ORDER as ATMOSPHERE_ORDER, mean_over_disc};
pub use colour::Colour;
pub use disc::visible_fraction;

use crate::base::vector::{Itrs, Vector};
use crate::config::Shadow;

/// Share of a source's light that reaches a satellite past a spherical Earth of `radius_km`, 0 to 1.
///
/// `colour` is used by [`Shadow::Atmospheric`] alone. A source nearer to the satellite than the Earth's centre is in
/// front of the Earth.
#[must_use]
pub fn lit_fraction(
    satellite_km: &Vector<Itrs>,
    source_km: &Vector<Itrs>,
    source_radius_km: f64,
    radius_km: f64,
    shadow: Shadow,
    colour: &Colour,
) -> f64 {
    if shadow == Shadow::Cylinder {
        return cylinder(satellite_km, source_km, radius_km);
    }
    let (to_source, r_km) = (*source_km - *satellite_km, satellite_km.norm());
    if to_source.norm() < r_km {
        return 1.0; // a Moon nearer than the Earth is in front of it
    }
    let disc_rad = (source_radius_km / to_source.norm()).min(1.0).asin();
    let from_nadir_rad = to_source.angle_to(&-*satellite_km);
    if shadow == Shadow::Penumbra {
        return visible_fraction(disc_rad, (radius_km / r_km).min(1.0).asin(), from_nadir_rad);
    }
    atmospheric(r_km, radius_km, disc_rad, from_nadir_rad, colour)
}

/// Share of a source's disc that a satellite sees past an airless spherical Earth of `radius_km`, 0 to 1.
///
/// `a = asin(R_source/distance)`, `b = asin(R/r)`, c the angle between source and nadir.
#[must_use]
pub fn penumbra(satellite_km: &Vector<Itrs>, source_km: &Vector<Itrs>, source_radius_km: f64, radius_km: f64) -> f64 {
    lit_fraction(satellite_km, source_km, source_radius_km, radius_km, Shadow::Penumbra, &Colour::V)
}

/// 1 outside, 0 inside the cylinder behind the Earth: dark from arccos(R/r) past the terminator.
#[must_use]
pub fn cylinder(satellite_km: &Vector<Itrs>, source_km: &Vector<Itrs>, radius_km: f64) -> f64 {
    let past_terminator_rad = source_km.angle_to(satellite_km) - std::f64::consts::FRAC_PI_2;
    if past_terminator_rad > (radius_km / satellite_km.norm()).min(1.0).acos() { 0.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cylinder_ends_at_the_documented_angles() {
        for (radius, r, expected_deg) in [(6378.0, 6798.0, 20.245_730_861_159_473_f64), (6378.0, 42_164.0, 81.3)] {
            let sat = Vector::<Itrs>::new(0.0, 0.0, r);
            let lit = |past_deg: f64| {
                let e = -past_deg.to_radians();
                cylinder(&sat, &(Vector::new(0.0, e.cos(), e.sin()) * 1e9), radius)
            };
            let edge = 0.02; // the GEO figure is printed to 0.1 deg: 90 − 8.7
            assert_eq!((lit(expected_deg - edge), lit(expected_deg + edge)), (1.0, 0.0), "{r}");
        }
    }

    #[test]
    fn in_front_of_the_earth_the_sun_is_whole_and_behind_it_gone() {
        let sat = Vector::<Itrs>::new(0.0, 0.0, 6800.0);
        let sun = Vector::new(0.0, 0.0, 1.496e8);
        assert_eq!(penumbra(&sat, &sun, 695_700.0, 6371.0), 1.0);
        assert_eq!(penumbra(&sat, &-sun, 695_700.0, 6371.0), 0.0);
    }
}
