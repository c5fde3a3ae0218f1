//! The Earth's shadow on the Moon.
//!
//! Angles seen from the Earth's centre, in rad; positions geocentric, in km. The umbra is one grey floor.

use std::f64::consts::PI;

use crate::base::constants::{MOON_RADIUS_KM, SUN_RADIUS_KM, WGS84_A_KM};
use crate::base::quadrature::gauss;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::shadow::visible_fraction;

/// Light left in the umbra of a lunar eclipse, relative to the full Moon: refracted and red. An order of magnitude.
pub const UMBRA_FLOOR: f64 = 1e-4;

/// Light left on the Moon by the Earth's shadow, averaged over its disc: 1 outside the penumbra, 1e-4 in the umbra.
///
/// Seen from the Earth's centre the umbra ends at `1.02 (0.99834 π_m − s + π_s)` from the antisolar point and the
/// penumbra at `1.02 (0.99834 π_m + s + π_s)`, with the parallaxes of Moon and Sun and the Sun's radius s (the 2 % is
/// the atmosphere; Espenak & Meeus 2009, NASA/TP-2009-214173). Between them a point of the Moon sees a disc of
/// 1.02 s behind a cover of half their sum.
#[must_use]
pub fn eclipse_factor(moon_km: &Vector<Itrs>, sun_km: &Vector<Itrs>) -> f64 {
    let ratio_rad = |radius_km: f64, far: &Vector<Itrs>| (radius_km / far.norm()).min(1.0).asin();
    let sun_rad = 1.02 * ratio_rad(SUN_RADIUS_KM, sun_km);
    let cover_rad = 1.02 * (0.998_34 * ratio_rad(WGS84_A_KM, moon_km) + ratio_rad(WGS84_A_KM, sun_km));
    let moon_rad = ratio_rad(MOON_RADIUS_KM, moon_km);
    let sep_rad = moon_km.angle_to(&-*sun_km);
    if sep_rad >= sun_rad + cover_rad + moon_rad {
        return 1.0;
    }
    // mean over the disc: ρ² uniform in radius, equal steps over half the turn (the other half is its mirror image)
    let (shares, weights) = gauss(12);
    let turns = 24;
    let mut mean = 0.0;
    for (share, weight) in shares.iter().zip(weights) {
        let rho = moon_rad * share.sqrt();
        for j in 0..turns {
            let turn = PI * (f64::from(j) + 0.5) / f64::from(turns);
            let from_axis = (sep_rad + rho * turn.cos()).hypot(rho * turn.sin());
            mean += weight / f64::from(turns) * visible_fraction(sun_rad, cover_rad, from_axis);
        }
    }
    mean + UMBRA_FLOOR * (1.0 - mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::AU_KM;

    #[test]
    fn the_moon_is_red_in_the_umbra_dim_in_the_penumbra_and_whole_outside() {
        let sun = Vector::new(AU_KM, 0.0, 0.0);
        let factor = |sep_deg: f64| {
            let a = sep_deg.to_radians();
            eclipse_factor(&(Vector::new(-a.cos(), a.sin(), 0.0) * 370_000.0), &sun)
        };
        // 2025-09-07: 0.272° from the antisolar point is a total eclipse
        assert!((factor(0.272) - UMBRA_FLOOR).abs() < 1e-9);
        assert_eq!(factor(1.8), 1.0);
        let mut before = 0.0;
        for j in 0..=180 {
            let now = factor(0.01 * f64::from(j));
            assert!(now >= before - 1e-9 && now - before < 0.05, "{j}");
            before = now;
        }
    }
}
