//! What the observer of a plan has and accepts. Radians, seconds, magnitudes.

use super::horizon::LocalHorizon;
use crate::visibility::tracked::Calculator;

/// What the observer has and accepts.
#[derive(Debug, Clone)]
pub struct PlanSettings {
    /// The telescope; its extinction is not used, `k_mag_airmass` is.
    pub calculator: Calculator,
    /// Band of the sky: V, g, r or i. Twilight is known in V alone.
    pub sky_band: String,
    /// The sky without Moon and twilight, V \[mag/arcsec²\].
    pub dark_sky_mag_arcsec2: f64,
    /// Extinction \[mag/airmass\].
    pub k_mag_airmass: f64,
    /// Smallest altitude of a target \[rad\].
    pub min_alt_rad: f64,
    /// What hides the sky above it.
    pub horizon: LocalHorizon,
    /// Smallest distance of the Moon, while it is up \[rad\].
    pub moon_sep_rad: f64,
    /// Fastest the mount follows against the stars \[rad/s\].
    pub max_rate_rad_s: f64,
    /// One exposure \[s\]; shortened where it would saturate.
    pub exptime_s: f64,
    /// Shortest exposure of the camera \[s\]: what saturates in it is too bright.
    pub min_exptime_s: f64,
    /// Signal-to-noise ratio from which on a target is observable.
    pub snr: f64,
    /// From one target to the next \[s\].
    pub slew_s: f64,
    /// Longest time given to one pass \[s\].
    pub longest_s: f64,
    /// Between the moments that are looked at \[s\].
    pub step_s: f64,
}
