//! Satellites whose magnitudes were measured and whose surfaces are not known.
//!
//! A law of V in full sunlight is a law of reflection that depends on the phase angle and the source's altitude at the satellite
//! alone, so it serves for the Moon as well, and in every band as far as the satellite is grey: E_obs/E_source = 10^(−0.4 (V(φ, h, R)
//! − V_Sun)). What the Earth reflects is part of the magnitudes it was fitted to. Magnitudes, km. It does not cover flares.

use std::f64::consts::PI;

use super::flux_sum::FluxSum;
use super::light_sources::flux_of_mag;
use super::lights::LightSource;
use super::scene::{Scene, source_alt_rad};
use super::skip::Skip;
use crate::bands::Band;
use crate::config::{Empirical, PhaseLaw};

/// Range that the laws are reduced to \[km\].
const STANDARD_RANGE_KM: f64 = 1000.0;

/// f(φ), the share of the light of full phase.
fn phase_function(law: PhaseLaw, phase_rad: f64) -> f64 {
    match law {
        PhaseLaw::LitFraction => 0.5 * (1.0 + phase_rad.cos()),
        PhaseLaw::LambertSphere => (phase_rad.sin() + (PI - phase_rad) * phase_rad.cos()) / PI,
    }
}

impl Empirical {
    /// V outside the atmosphere in full sunlight at 1 au, at a phase angle, altitude of the Sun at the satellite, and range; `None`
    /// outside the angles it holds for, and where nothing lit is seen.
    #[must_use]
    pub fn v_mag(&self, phase_rad: f64, sun_alt_sat_rad: f64, range_km: f64) -> Option<f64> {
        let (phase_deg, alt_deg) = (phase_rad.to_degrees(), sun_alt_sat_rad.to_degrees());
        let within = |[low, high]: [f64; 2], deg: f64| (low..=high).contains(&deg);
        if !within(self.phase_deg(), phase_deg) || !within(self.sun_alt_sat_deg(), alt_deg) {
            return None;
        }
        let sum = |c: &[f64], x: f64| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let mag_1000km = match self {
            Self::Polynomial { mag_1000km, per_sun_alt_sat, .. } => {
                sum(mag_1000km, phase_deg) + alt_deg * sum(per_sun_alt_sat, alt_deg)
            }
            Self::Standard { mag_1000km, at_phase_deg, law, .. } => {
                let share = phase_function(*law, phase_rad) / phase_function(*law, at_phase_deg.to_radians());
                mag_1000km - 2.5 * share.log10()
            }
            Self::Sphere { reflecting_area_m2, .. } => {
                let range_m = 1e3 * STANDARD_RANGE_KM;
                let share = 2.0 * reflecting_area_m2 * phase_function(PhaseLaw::LambertSphere, phase_rad)
                    / (3.0 * PI * range_m * range_m);
                sun_v_mag() - 2.5 * share.log10()
            }
        };
        let mag = mag_1000km + 5.0 * (range_km / STANDARD_RANGE_KM).log10();
        mag.is_finite().then_some(mag)
    }

    /// The light of a light source, as the share of it that gets past the Earth.
    pub(super) fn direct(&self, scene: &Scene, source: &LightSource, skipped: &mut Vec<Skip>) -> FluxSum {
        if source.visible_frac <= 0.0 || source.flux_at_satellite <= 0.0 {
            skipped.push(Skip::light(source.name, source.hidden()));
            return FluxSum::default();
        }
        let phase_rad = (source.position_km - scene.satellite_km).angle_to(&(scene.observer_km - scene.satellite_km));
        let alt_rad = source_alt_rad(&scene.satellite_km, &source.position_km);
        let Some(v_mag) = self.v_mag(phase_rad, alt_rad, scene.range_km()) else {
            let [low, high] = self.sun_alt_sat_deg();
            let why = match (low..=high).contains(&alt_rad.to_degrees()) {
                true => "the phase angle is outside those of the empirical model",
                false => "the altitude of the light source at the satellite is outside those of the empirical model",
            };
            skipped.push(Skip::light(source.name, why));
            return FluxSum::default();
        };
        let reflected = flux_of_mag(v_mag - sun_v_mag());
        FluxSum { flux: source.visible_frac * source.flux_at_satellite * reflected, ..FluxSum::default() }
    }
}

/// V of the Sun at 1 au.
fn sun_v_mag() -> f64 {
    // a test sees to it that the table has V
    Band::V.sun_mag().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn phase_functions_have_their_tabulated_magnitudes() {
        // -2.5 lg f at 60, 90, 120 deg
        for (law, expected) in
            [(PhaseLaw::LambertSphere, [0.538, 1.243, 2.406]), (PhaseLaw::LitFraction, [0.312, 0.753, 1.505])]
        {
            for (phase_deg, mag) in [60f64, 90.0, 120.0].into_iter().zip(expected) {
                let found = -2.5 * phase_function(law, phase_deg.to_radians()).log10();
                assert!((found - mag).abs() < 6e-4, "{law:?} {phase_deg}: {found} {mag}");
            }
        }
    }

    #[test]
    fn a_sphere_of_one_square_metre_is_of_magnitude_6_2_at_1000_km() {
        let sphere = Empirical::Sphere { reflecting_area_m2: 1.0, phase_deg: [0.0, 180.0] };
        // with a Sun of -26.74: 6.19 at 90 deg and 4.94 at full phase
        let shift = sun_v_mag() + 26.74;
        assert!((sphere.v_mag(PI / 2.0, 0.0, 1000.0).unwrap() - shift - 6.19).abs() < 0.006);
        assert!((sphere.v_mag(0.0, 0.0, 1000.0).unwrap() - shift - 4.94).abs() < 0.006);
        // McCants: m = std - 15.75 + 2.5 lg(R^2 / g)
        let standard = Empirical::Standard {
            mag_1000km: 4.0,
            at_phase_deg: 90.0,
            law: PhaseLaw::LitFraction,
            phase_deg: [0.0, 180.0],
        };
        let (range_km, phase_rad) = (1430.0, 1.1f64);
        let mccants = 4.0 - 15.75 + 2.5 * (range_km * range_km / (0.5 * (1.0 + phase_rad.cos()))).log10();
        assert!((standard.v_mag(phase_rad, 0.0, range_km).unwrap() - mccants).abs() < 3e-3);
        assert_eq!(standard.v_mag(PI, 0.0, range_km), None);
        let fitted = Empirical::Polynomial {
            mag_1000km: vec![3.617, 0.08646, -0.0004653],
            per_sun_alt_sat: vec![0.02, 0.003],
            phase_deg: [35.0, 120.0],
            sun_alt_sat_deg: [-20.0, 10.0],
        };
        let at = |deg: f64| fitted.v_mag(deg.to_radians(), 0.0, 500.0);
        assert!((at(80.0).unwrap() - (3.617 + 80.0 * 0.08646 - 6400.0 * 0.0004653 - 1.505_15)).abs() < 1e-4);
        assert!(at(34.9).is_none() && at(120.1).is_none());
        let lower = |deg: f64| fitted.v_mag(80f64.to_radians(), deg.to_radians(), 500.0);
        assert!((lower(-10.0).unwrap() - at(80.0).unwrap() - (-0.2 + 0.3)).abs() < 1e-9);
        assert!(lower(-20.1).is_none() && lower(10.1).is_none());
    }
}
