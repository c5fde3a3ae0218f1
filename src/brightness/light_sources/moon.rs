//! Moonlight: magnitude against phase, distances, the surge at opposition, what happens past the limit.
//!
//! Phase angles in deg, as the laws are printed; distances in km. The Moon is a uniform disc without libration, waxing
//! as bright as waning.

use super::ROLO_RANGE_DEG;
use super::eclipse_factor;
use super::opposition::MOON_LAW_MAX_DEG;
use super::opposition::OPPOSITION_DEG;
use super::settings::SourceSettings;
use super::sun::SUN_V_MAG;
use super::sun::SourceLight;
use super::sun::flux_of_mag;
use crate::base::constants::AU_KM;
use crate::base::vector::{Itrs, Vector};
use crate::config::{Distances, LunarEclipse, MoonLaw, MoonPastLimit};

/// V of the full Moon seen from the Earth's mean distance, without the opposition surge (Cox 2002, Allen's
/// Astrophysical Quantities, 4th ed.).
pub const FULL_MOON_V_MAG: f64 = -12.73;
/// Distance the lunar laws belong to \[km\] (Cox 2002; Kieffer & Stone 2005).
pub const MOON_MEAN_DISTANCE_KM: f64 = 384_400.0;

/// Moonlight at a place, from the geometry Sun, Moon, place.
///
/// `m = −12.73 + 0.026|α| + 4·10⁻⁹ α⁴` (α in degrees, Cox 2002, V), or that with the surge, or ROLO; where distances
/// are applied `+ 5 lg(d/384400 km · r/1 au)`; where it is applied, the lunar eclipse. Past 150° the tapered flux is
/// that of 150° times `((180° − α)/30°)⁴`: continuous and dark at new Moon, our choice, unvalidated.
#[must_use]
pub fn moonlight(
    place_km: &Vector<Itrs>,
    moon_km: &Vector<Itrs>,
    sun_km: &Vector<Itrs>,
    settings: &SourceSettings,
) -> SourceLight {
    let (to_sun, to_place) = (*sun_km - *moon_km, *place_km - *moon_km);
    let phase_deg = to_sun.angle_to(&to_place).to_degrees();
    let SourceLight { mut flux, extrapolated } = settings.moonlight_at_phase(phase_deg);
    if settings.distances == Distances::Applied {
        let distance = to_place.norm() / MOON_MEAN_DISTANCE_KM * to_sun.norm() / AU_KM;
        flux /= distance * distance;
    }
    if settings.lunar_eclipse == LunarEclipse::Applied {
        flux *= eclipse_factor(moon_km, sun_km);
    }
    SourceLight { flux, extrapolated }
}

impl SourceSettings {
    /// Moonlight at mean distances and a phase angle \[deg\] of either sign, wrapped to 0 to 180: the law in the band.
    #[must_use]
    pub fn moonlight_at_phase(&self, phase_deg: f64) -> SourceLight {
        let turn = phase_deg.abs() % 360.0;
        let alpha = turn.min(360.0 - turn);
        let (law_deg, taper) = match self.moon_past_limit {
            MoonPastLimit::Polynomial => (alpha, 1.0),
            MoonPastLimit::Tapered => {
                let left = (180.0 - alpha.max(MOON_LAW_MAX_DEG)) / (180.0 - MOON_LAW_MAX_DEG);
                (alpha.min(MOON_LAW_MAX_DEG), left.powi(4))
            }
        };
        // the band: the law of V, as much brighter as the Sun is there, and the Moon's own colour
        let cox = || flux_of_mag(moon_v_mag(law_deg) + self.sun_mag - SUN_V_MAG + self.moon_minus_sun_colour_mag);
        let flux = match self.moon_law {
            MoonLaw::Cox => cox(),
            MoonLaw::CoxOpposition => cox() * opposition_factor(law_deg),
            MoonLaw::Rolo => flux_of_mag(self.sun_mag) * self.rolo.moon_over_sun(law_deg),
        };
        let (from_deg, to_deg) = if self.moon_law == MoonLaw::Rolo { ROLO_RANGE_DEG } else { (0.0, MOON_LAW_MAX_DEG) };
        SourceLight {
            flux: flux * taper * flux_of_mag(self.source_dimming_mag),
            extrapolated: !(from_deg..=to_deg).contains(&alpha),
        }
    }
}

/// V of the Moon at mean distance for a phase angle \[deg\] of either sign, Cox 2002; no limit is applied.
#[must_use]
pub fn moon_v_mag(phase_deg: f64) -> f64 {
    let alpha = phase_deg.abs();
    FULL_MOON_V_MAG + 0.026 * alpha + 4e-9 * alpha.powi(4)
}

/// The surge at opposition: `1.35 − 0.05|α|` below 7°, else 1 (Krisciunas & Schaefer 1991); α in deg.
///
/// 1.35 at 0° is 0.33 mag; against ROLO it overshoots by 0.1 mag at 2°.
#[must_use]
pub fn opposition_factor(phase_deg: f64) -> f64 {
    1.35 - 0.05 * phase_deg.abs().min(OPPOSITION_DEG)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::light_sources::sun::mag_of_flux;
    use crate::brightness::spectrum::Band;
    use crate::config::{Effects, Mode};

    #[test]
    fn the_lunar_law_is_the_printed_one_and_even() {
        for (deg, expected) in [(0.0, -12.73), (7.0, -12.547_990_396), (90.0, -10.127_56), (-30.0, -11.946_76)] {
            assert!((moon_v_mag(deg) - expected).abs() < 1e-6, "{deg}");
        }
    }

    fn settings(mode: Mode, law: MoonLaw, band: &str) -> SourceSettings {
        let effects = Effects { moon_law: law, source: crate::config::Source::ExoAtmospheric, ..Effects::of(mode) };
        SourceSettings::new(&effects, &Band::named(band).unwrap()).unwrap()
    }

    /// A Moon at `moon_km` whose phase seen from the place at the origin's far side is `phase_deg`.
    fn moonlit(phase_deg: f64, moon_distance_km: f64, sun_moon_au: f64, mode: Mode) -> SourceLight {
        let a = phase_deg.to_radians();
        // place at a distance along −z of the Moon; Sun turned by α from there, off any eclipse by placing the Moon high
        let moon = Vector::new(4e5, 0.0, 0.0);
        let place = moon + Vector::new(0.0, 0.0, -moon_distance_km);
        let sun = moon + Vector::new(0.0, a.sin(), -a.cos()) * (sun_moon_au * AU_KM);
        moonlight(&place, &moon, &sun, &settings(mode, MoonLaw::Cox, "V"))
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
        assert_eq!(settings(Mode::Corrected, MoonLaw::Cox, "V").moonlight_at_phase(180.0).flux, 0.0);
    }

    #[test]
    fn the_surge_is_a_third_of_a_magnitude_at_opposition_and_gone_at_7_degrees() {
        let v = |deg| {
            mag_of_flux(settings(Mode::Corrected, MoonLaw::CoxOpposition, "V").moonlight_at_phase(deg).flux).unwrap()
        };
        assert!((v(3.0) + 12.849_952_791_119_064).abs() < 1e-9);
        assert!((v(-3.0) - v(3.0)).abs() < 1e-12 && (v(363.0) - v(3.0)).abs() < 1e-9);
        assert!((v(0.0) - v(1e-9)).abs() < 1e-9 && (v(0.0) + 12.73 + 2.5 * 1.35_f64.log10()).abs() < 1e-12);
        assert!((v(7.0) - moon_v_mag(7.0)).abs() < 1e-12 && (v(7.000_1) - v(6.999_9)).abs() < 1e-4);
    }

    #[test]
    fn every_law_fades_with_phase_without_a_jump() {
        for law in [MoonLaw::Cox, MoonLaw::CoxOpposition, MoonLaw::Rolo] {
            for band in crate::config::Model::BANDS {
                let light_sources = settings(Mode::Corrected, law, band);
                let mut before = light_sources.moonlight_at_phase(0.0).flux;
                for j in 1..=18_000 {
                    let now = light_sources.moonlight_at_phase(0.01 * f64::from(j)).flux;
                    // 0.15 mag/deg is the steepest slope below 150°; beyond it the taper goes to zero
                    let step = if j <= 15_000 { 0.998 * before } else { 0.0 };
                    assert!(now <= before && now >= step, "{law:?} {band} {j}: {before} {now}");
                    before = now;
                }
            }
        }
    }

    #[test]
    fn the_moon_is_redder_than_the_sun() {
        let mag = |band, law| mag_of_flux(settings(Mode::Corrected, law, band).moonlight_at_phase(30.0).flux).unwrap();
        for law in [MoonLaw::Cox, MoonLaw::Rolo] {
            let g_minus_r = mag("g", law) - mag("r", law);
            // the Sun's is 0.46 (Willmer 2018)
            assert!((0.7..0.9).contains(&g_minus_r), "{law:?} {g_minus_r}");
            assert!(mag("r", law) - mag("i", law) > 0.12, "{law:?}");
        }
    }
}
