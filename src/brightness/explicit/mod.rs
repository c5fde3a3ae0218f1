//! One surface in a geometry stated number by number: its direct and its Earth-reflected flux per unit irradiance.
//!
//! For cross-checks with other software, so the conventions are fixed: a point source at infinity, a sphere of
//! 6378.000 km, a cylinder for its shadow, one side of one flat surface. Lengths in km, area in m², flux in W/m² per
//! W/m². Not included: everything a mode could change (discs, penumbra, distances, air).

mod case;
mod exhaustive;
mod row;

pub use case::{Case, Fluxes, RADIUS_KM, Scattering};

use case::Sight;

use crate::base::vector::Vector;

pub use exhaustive::exhaustive;
pub use row::{COLUMNS, Header, Row, read_row};

/// The two fluxes of a case; the Earth-reflected one to the relative `tolerance`.
///
/// `None` where the observer is at the satellite.
///
/// Rules: both are 0 for an observer with `z < R²/(R+h)` (the satellite is below the horizon); direct is 0 for
/// `E < −arccos(R/(R+h))` (in the cylinder of the shadow).
#[must_use]
pub fn explicit(case: &Case, tolerance: f64) -> Option<Fluxes> {
    let mut answer = Fluxes::default();
    let r_km = RADIUS_KM + case.height_km;
    let satellite_km = Vector::new(0.0, 0.0, r_km);
    let line = case.observer_km - satellite_km;
    let observer = line.unit()?;
    if case.observer_km.z() < RADIUS_KM * RADIUS_KM / r_km {
        answer.skipped.push("observer below the horizon");
        return Some(answer);
    }
    let cos_o = case.normal.dot(&observer);
    if cos_o <= 0.0 {
        answer.skipped.push("surface faces away from the observer");
        return Some(answer);
    }
    let (sin_e, cos_e) = case.elevation_rad.sin_cos();
    let range_m = line.norm() * 1e3;
    let spread = case.area_m2 * cos_o / (range_m * range_m);
    let sight = Sight { case, satellite_km, source: Vector::new(0.0, cos_e, sin_e), observer, spread };
    sight.direct(&mut answer);
    sight.by_the_ground(tolerance, &mut answer);
    Some(answer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    use crate::base::vector::Itrs;
    use crate::brightness::brdf::Brdf;

    fn case(scattering: Scattering) -> Case {
        Case {
            height_km: 550.0,
            elevation_rad: 0.5,
            observer_km: Vector::new(0.0, 0.0, RADIUS_KM),
            normal: Vector::new(0.0, 0.0, -1.0),
            area_m2: 2.0,
            scattering,
            earth: Brdf::Lambert { albedo: 0.3 },
        }
    }

    #[test]
    fn a_mirror_is_the_limit_of_a_gaussian_lobe_of_the_same_reflectance() {
        let mirror = explicit(&case(Scattering::Mirror { reflectance: 0.8, disc_rad: 0.005 }), 1e-8).unwrap();
        // ∫ A exp((c − 1)/σ) dω = 2πσA for σ → 0; relative deviation of the order of σ
        let sigma = 1e-6;
        let lobe = Brdf::Gaussian { peak_per_sr: 0.8 / (2.0 * PI * sigma), sigma };
        let narrow = explicit(&case(Scattering::Law(lobe)), 1e-6).unwrap();
        assert!(mirror.earth > 0.0 && (narrow.earth / mirror.earth - 1.0).abs() < 2e-5, "{narrow:?} {mirror:?}");
        assert_eq!((mirror.nodes, mirror.direct), (0, 0.0));
    }

    #[test]
    fn the_mirror_shows_the_disc_to_its_edge_and_not_beyond() {
        let tilt = |off_rad: f64| {
            let mut c = case(Scattering::Mirror { reflectance: 1.0, disc_rad: 0.01 });
            let (sin_e, cos_e) = c.elevation_rad.sin_cos();
            let half = (Vector::<Itrs>::new(0.0, cos_e, sin_e) + Vector::new(0.0, 0.0, -1.0)).unit().unwrap();
            // turning the normal by δ turns the mirrored direction by 2δ
            c.normal = (half + Vector::new(1.0, 0.0, 0.0) * off_rad.tan()).unit().unwrap();
            explicit(&c, 1e-4).unwrap().direct
        };
        assert!(tilt(0.0) > 0.0 && tilt(0.0049) > 0.0);
        assert_eq!(tilt(0.0051 / half_angle()), 0.0);
    }

    /// Turning out of the plane of source and observer moves the mirrored direction less than twice as much.
    fn half_angle() -> f64 {
        ((0.5 + PI / 2.0) / 2.0).cos()
    }

    #[test]
    fn the_shadow_begins_at_the_dip_of_the_horizon_and_the_observer_ends_at_his_own() {
        let lit = |elevation_rad: f64| {
            let mut c = case(Scattering::Law(Brdf::Lambert { albedo: 1.0 }));
            c.normal = Vector::new(0.0, 0.8, -0.6);
            c.elevation_rad = elevation_rad;
            explicit(&c, 1e-4).unwrap()
        };
        let dip = (RADIUS_KM / (RADIUS_KM + 550.0)).acos();
        assert!(lit(-dip + 1e-9).direct > 0.0);
        let dark = lit(-dip - 1e-9);
        assert_eq!((dark.direct, dark.earth), (0.0, 0.0));
        assert_eq!(dark.skipped, ["direct: umbra", "earth: no lit ground in view"]);

        let mut c = case(Scattering::Law(Brdf::Lambert { albedo: 1.0 }));
        for (nudge_rad, seen) in [(-1e-6, true), (1e-6, false)] {
            let (s, k) = (dip + nudge_rad).sin_cos();
            c.observer_km = Vector::new(0.0, s * RADIUS_KM, k * RADIUS_KM);
            let at = explicit(&c, 1e-4).unwrap();
            assert_eq!(at.earth > 0.0, seen, "{at:?}");
        }
    }
}
