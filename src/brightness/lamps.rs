//! The two lamps: how bright Sun and Moon shine at the satellite and on the ground.
//!
//! Irradiances in V as ratios to a star of V = 0; distances in km, phase angles in rad. No spectra, no opposition surge.

use std::f64::consts::PI;

use super::quadrature::gauss;
use super::shadow::visible_fraction;
use crate::config::Mode;
use crate::constants::{AU_KM, MOON_RADIUS_KM, SUN_RADIUS_KM, WGS84_A_KM};
use crate::vector::{Itrs, Vector};

/// V of the Sun at 1 au, Vega system (Willmer 2018, ApJS 236, 47).
pub const SUN_V_MAG: f64 = -26.76;
/// V of the full Moon seen from the Earth's mean distance, without the opposition surge (Cox 2002, Allen's
/// Astrophysical Quantities, 4th ed.).
pub const FULL_MOON_V_MAG: f64 = -12.73;
/// Distance the lunar law belongs to \[km\] (Cox 2002).
pub const MOON_MEAN_DISTANCE_KM: f64 = 384_400.0;
/// Phase angle up to which the lunar law is believed \[deg\]; it was fitted to less.
pub const MOON_LAW_MAX_DEG: f64 = 150.0;
/// Light left in the umbra of a lunar eclipse, relative to the full Moon: refracted and red. An order of magnitude.
pub const UMBRA_FLOOR: f64 = 1e-4;

/// Irradiance and whether the law was stretched beyond where it is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamplight {
    /// Irradiance relative to a star of V = 0.
    pub flux: f64,
    /// The phase angle is beyond [`MOON_LAW_MAX_DEG`].
    pub extrapolated: bool,
}

/// Sunlight at `distance_km`: V = −26.76, and 1/r² unless as published.
#[must_use]
pub fn sunlight(distance_km: f64, mode: Mode) -> Lamplight {
    let au = if mode == Mode::AsPublished { 1.0 } else { distance_km / AU_KM };
    Lamplight { flux: flux_of_mag(SUN_V_MAG) / (au * au), extrapolated: false }
}

/// Moonlight at a place, from the geometry Sun, Moon, place.
///
/// `V = −12.73 + 0.026|α| + 4·10⁻⁹ α⁴` (α in degrees, Cox 2002); corrected adds
/// `5 lg(d/384400 km · r/1 au)` and the lunar eclipse. Past 150° the corrected flux is that of 150° times
/// `((180° − α)/30°)⁴`: continuous and dark at new Moon, our choice, unvalidated; as published keeps the polynomial.
#[must_use]
pub fn moonlight(place_km: &Vector<Itrs>, moon_km: &Vector<Itrs>, sun_km: &Vector<Itrs>, mode: Mode) -> Lamplight {
    let (to_sun, to_place) = (*sun_km - *moon_km, *place_km - *moon_km);
    let phase_deg = to_sun.angle_to(&to_place).to_degrees();
    let extrapolated = phase_deg > MOON_LAW_MAX_DEG;
    if mode == Mode::AsPublished {
        return Lamplight { flux: flux_of_mag(moon_v_mag(phase_deg)), extrapolated };
    }
    let taper = ((180.0 - phase_deg.max(MOON_LAW_MAX_DEG)) / (180.0 - MOON_LAW_MAX_DEG)).powi(4);
    let distance = to_place.norm() / MOON_MEAN_DISTANCE_KM * to_sun.norm() / AU_KM;
    let flux = flux_of_mag(moon_v_mag(phase_deg.min(MOON_LAW_MAX_DEG))) * taper / (distance * distance);
    Lamplight { flux: flux * eclipse_factor(moon_km, sun_km), extrapolated }
}

/// V of the Moon at mean distance for a phase angle \[deg\] of either sign; no limit is applied.
#[must_use]
pub fn moon_v_mag(phase_deg: f64) -> f64 {
    let alpha = phase_deg.abs();
    FULL_MOON_V_MAG + 0.026 * alpha + 4e-9 * alpha.powi(4)
}

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

/// Irradiance of a magnitude, relative to V = 0.
#[must_use]
pub fn flux_of_mag(v_mag: f64) -> f64 {
    10.0_f64.powf(-0.4 * v_mag)
}

/// Magnitude of an irradiance relative to V = 0; `None` for no light.
#[must_use]
pub fn mag_of_flux(flux: f64) -> Option<f64> {
    (flux > 0.0 && flux.is_finite()).then(|| -2.5 * flux.log10())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lunar_law_is_the_printed_one_and_even() {
        for (deg, expected) in [(0.0, -12.73), (7.0, -12.547_990_396), (90.0, -10.127_56), (-30.0, -11.946_76)] {
            assert!((moon_v_mag(deg) - expected).abs() < 1e-6, "{deg}");
        }
    }

    /// A Moon at `moon_km` whose phase seen from the place at the origin's far side is `phase_deg`.
    fn moonlit(phase_deg: f64, moon_distance_km: f64, sun_moon_au: f64, mode: Mode) -> Lamplight {
        let a = phase_deg.to_radians();
        // place at a distance along −z of the Moon; Sun turned by α from there, off any eclipse by placing the Moon high
        let moon = Vector::new(4e5, 0.0, 0.0);
        let place = moon + Vector::new(0.0, 0.0, -moon_distance_km);
        let sun = moon + Vector::new(0.0, a.sin(), -a.cos()) * (sun_moon_au * AU_KM);
        moonlight(&place, &moon, &sun, mode)
    }

    #[test]
    fn distances_dim_the_moon_in_corrected_mode_only() {
        let v = |mode| mag_of_flux(moonlit(10.0, 405_000.0, 1.0178, mode).flux).unwrap();
        assert!((v(Mode::Corrected) + 12.318_289_546_222_816).abs() < 1e-9);
        assert!((v(Mode::AsPublished) - moon_v_mag(10.0)).abs() < 1e-9);
    }

    #[test]
    fn past_150_degrees_the_moon_is_flagged_and_fades_to_nothing() {
        let at = |deg| moonlit(deg, 384_400.0, 1.0, Mode::Corrected);
        assert!(!at(149.9).extrapolated && at(150.1).extrapolated);
        assert!((at(149.999_99).flux / at(150.000_01).flux - 1.0).abs() < 1e-5);
        assert!(at(179.999).flux < 1e-12 * at(150.0).flux);
        assert!(at(170.0).flux < at(160.0).flux);
    }

    #[test]
    fn sunlight_falls_with_the_square_of_the_distance() {
        let one = sunlight(AU_KM, Mode::Corrected).flux;
        assert!((mag_of_flux(one).unwrap() + 26.76).abs() < 1e-12);
        assert!((sunlight(2.0 * AU_KM, Mode::Corrected).flux * 4.0 / one - 1.0).abs() < 1e-12);
        assert_eq!(sunlight(2.0 * AU_KM, Mode::AsPublished).flux, one);
    }

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
