//! The light of the Sun, and magnitudes of fluxes.

use super::settings::SourceSettings;
use crate::base::constants::AU_KM;
use crate::config::Distances;

/// V of the Sun at 1 au, Vega system (Willmer 2018, ApJS 236, 47).
pub const SUN_V_MAG: f64 = -26.76;

/// Irradiance and whether the law was extrapolated beyond its range of validity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceLight {
    /// Irradiance in the band relative to a star of magnitude 0.
    pub flux: f64,
    /// The phase angle is beyond what the lunar law was fitted to ([`super::MOON_LAW_MAX_DEG`],
    /// [`super::ROLO_RANGE_DEG`]).
    pub extrapolated: bool,
}

/// Sunlight at `distance_km`: the Sun's magnitude at 1 au, and 1/r² where distances are applied.
#[must_use]
pub fn sunlight(distance_km: f64, settings: &SourceSettings) -> SourceLight {
    let au = match settings.distances {
        Distances::Ignored => 1.0,
        Distances::Applied => distance_km / AU_KM,
    };
    SourceLight { flux: flux_of_mag(settings.sun_mag + settings.source_dimming_mag) / (au * au), extrapolated: false }
}

/// Irradiance of a magnitude, relative to magnitude 0: `10^(−0.4 m)`.
#[must_use]
pub fn flux_of_mag(mag: f64) -> f64 {
    10.0_f64.powf(-0.4 * mag)
}

/// Magnitude of an irradiance relative to magnitude 0; `None` for no light.
#[must_use]
pub fn mag_of_flux(flux: f64) -> Option<f64> {
    (flux > 0.0 && flux.is_finite()).then(|| -2.5 * flux.log10())
}
