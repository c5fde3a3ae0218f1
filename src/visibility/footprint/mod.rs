//! The beam of a flat mirror in orbit: how wide it is, where it meets the Earth, whether an observer stands in it.
//!
//! km and rad in Earth-fixed axes, m² for the mirror, magnitudes of the lamp's band. The lamp is a uniform disc, the mirror
//! flat and far smaller than its beam. Left out: slope errors of the foil, refraction, terrain.

mod beam;
mod circle;
mod search;

pub use beam::{Beam, PUBLISHED_DIVERGENCE_DEG, Spot, beam_diameter_km, glint_mag, reflected};

pub use circle::{CircularOrbit, crossings_per_day};
pub use search::{Approach, Inside, Lamp, Mirror, approaches};

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
