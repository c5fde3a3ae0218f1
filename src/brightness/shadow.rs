//! How much of the Sun or the Moon a satellite sees past the Earth.
//!
//! Angles in rad, distances in km. A hard spherical Earth: no refraction, no absorption, no limb darkening.

use crate::vector::{Itrs, Vector};

/// Share of a disc of angular radius `disc_rad` left visible by one of `cover_rad` at separation `sep_rad`, 0 to 1.
///
/// `1 − overlap/(πa²)` of two discs in a plane: within 5e-4 of the caps on the sphere for covers of 20° to 75°.
/// Continuous; with the cover inside the disc (annular) `1 − (b/a)²`.
#[must_use]
pub fn visible_fraction(disc_rad: f64, cover_rad: f64, sep_rad: f64) -> f64 {
    let (a, b, c) = (disc_rad, cover_rad, sep_rad);
    if c >= a + b {
        return 1.0;
    }
    if c <= b - a {
        return 0.0;
    }
    if c <= a - b {
        return 1.0 - (b / a) * (b / a);
    }
    // with x the distance of the chord from the disc's centre, y half its length:
    // overlap = a² acos(x/a) + b² acos((c−x)/b) − c y
    let x = ((c * c + (a - b) * (a + b)) / (2.0 * c)).clamp(-a, a);
    let y = ((a - x) * (a + x)).max(0.0).sqrt();
    // b² acos((c−x)/b) − (c−x) y: the cover's segment, from its half angle to keep digits when it is shallow
    let half = y.atan2(c - x);
    let segment = b * b * (half - half.sin() * half.cos());
    let overlap = a * a * (x / a).acos() - x * y + segment;
    (1.0 - overlap / (std::f64::consts::PI * a * a)).clamp(0.0, 1.0)
}

/// Share of a source's disc that a satellite sees past a spherical Earth of `radius_km`, 0 to 1.
///
/// `a = asin(R_source/distance)`, `b = asin(R/r)`, c the angle between source and nadir.
#[must_use]
pub fn penumbra(satellite_km: &Vector<Itrs>, source_km: &Vector<Itrs>, source_radius_km: f64, radius_km: f64) -> f64 {
    let to_source = *source_km - *satellite_km;
    if to_source.norm() < satellite_km.norm() {
        return 1.0; // a Moon nearer than the Earth is in front of it
    }
    let disc_rad = (source_radius_km / to_source.norm()).min(1.0).asin();
    let cover_rad = (radius_km / satellite_km.norm()).min(1.0).asin();
    visible_fraction(disc_rad, cover_rad, to_source.angle_to(&-*satellite_km))
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

    const SUN_RAD: f64 = 0.266_453_107_246_155_7 / 57.295_779_513_082_32;

    #[test]
    fn the_fraction_is_half_at_the_limb_and_annular_far_out() {
        let b = 69.743_727_418_533_2_f64.to_radians();
        assert!((visible_fraction(SUN_RAD, b, b) - 0.500_405_363_585_874_6).abs() < 1e-6);
        let [a, b, c] = [0.2666_f64, 0.2, 0.01].map(f64::to_radians);
        assert!((visible_fraction(a, b, c) - 0.437_218_644_496_082_7).abs() < 1e-9);
    }

    #[test]
    fn the_penumbra_is_monotone_and_continuous() {
        for b in [0.05_f64, 8.7, 20.0, 70.0].map(f64::to_radians) {
            let steps = 20_000;
            let at = |j: i32| {
                let past_limb = 1.2 * SUN_RAD * (2.0 * f64::from(j) / f64::from(steps) - 1.0);
                visible_fraction(SUN_RAD, b, (b + past_limb).max(0.0))
            };
            let mut before = at(0);
            for j in 1..=steps {
                let now = at(j);
                // the steepest slope is 2/(πa) per radian
                assert!(now >= before - 1e-9 && now - before < 1.2 * 2.0 / f64::from(steps), "{b} {j}: {before} {now}");
                before = now;
            }
            assert_eq!(before, 1.0);
        }
    }

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
