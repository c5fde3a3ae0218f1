//! The spectrum of moonlight: the Sun's, as much fainter as the Moon is at its phase.
//!
//! W m⁻² nm⁻¹ at mean distances. Not included: the redness of the Moon (a grey disc, as published).

use super::SourceSettings;
use super::sun::sunlight;
use crate::base::constants::AU_KM;
use crate::brightness::spectrum::Spectrum;

/// A spectrum of the Sun scaled to the Moon at a phase \[deg\]: `f_λ · 10^(−0.4 (m_Moon(α) − m_Sun))`, both magnitudes
/// in the band of `light_sources`.
#[must_use]
pub fn moon_spectrum(sun: &Spectrum, phase_deg: f64, light_sources: &SourceSettings) -> Spectrum {
    sun.scaled(light_sources.moonlight_at_phase(phase_deg).flux / sunlight(AU_KM, light_sources).flux)
}
