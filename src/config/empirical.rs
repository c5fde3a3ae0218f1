//! A satellite whose magnitudes are known, and not its surfaces: the law as a file states it.
//!
//! Magnitudes in V outside the atmosphere at 1000 km, phase angles (Sun, satellite, observer; 0 = fully lit) in degrees.

use serde::{Deserialize, Serialize};

use super::range;
use crate::base::error::{Error, Result};

/// How V in full sunlight depends on phase angle φ and range R: V = m(φ) + 5 lg(R / 1000 km); as a polynomial also on the altitude
/// of the Sun at the satellite.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Empirical {
    /// m(φ, h) = Σ c_k φ^k + Σ d_k h^k, h the altitude of the Sun at the satellite, which tells how its underside is lit.
    Polynomial {
        /// c_0, c_1, ... \[mag/deg^k\].
        mag_1000km: Vec<f64>,
        /// d_1, d_2, ... \[mag/deg^k\].
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        per_sun_alt_sat: Vec<f64>,
        /// Phase angles of the observations that it was fitted to \[deg\]; nothing is said outside.
        phase_deg: [f64; 2],
        /// Altitudes of the Sun at the satellite of the observations that it was fitted to \[deg\]; nothing is said outside.
        #[serde(default = "all_altitudes", skip_serializing_if = "is_all_altitudes")]
        sun_alt_sat_deg: [f64; 2],
    },
    /// m(φ) = `mag_1000km` − 2.5 lg(f(φ) / f(`at_phase_deg`)).
    Standard {
        /// The standard magnitude.
        mag_1000km: f64,
        /// The phase angle it holds at \[deg\]: 90 for McCants, Molczan and MMT-9, 0 where it is of full phase.
        at_phase_deg: f64,
        /// f.
        law: PhaseLaw,
        /// Phase angles it is used for \[deg\].
        #[serde(default = "all_phases")]
        phase_deg: [f64; 2],
    },
    /// A diffuse sphere: V = V_Sun − 2.5 lg(2 ρA f(φ) / (3 π R²)), f of a Lambert sphere.
    Sphere {
        /// Reflectance times cross-section \[m²\].
        reflecting_area_m2: f64,
        /// Phase angles it is used for \[deg\].
        #[serde(default = "all_phases")]
        phase_deg: [f64; 2],
    },
}

/// The share of the light of full phase, f(0) = 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PhaseLaw {
    /// (1 + cos φ) / 2: McCants, Molczan, Stellarium.
    LitFraction,
    /// \[sin φ + (π − φ) cos φ\] / π.
    LambertSphere,
}

impl Empirical {
    /// A polynomial of the phase angle alone.
    #[must_use]
    pub fn polynomial(mag_1000km: Vec<f64>, phase_deg: [f64; 2]) -> Self {
        Self::Polynomial { mag_1000km, per_sun_alt_sat: Vec::new(), phase_deg, sun_alt_sat_deg: all_altitudes() }
    }

    /// Phase angles it holds for \[deg\].
    #[must_use]
    pub fn phase_deg(&self) -> [f64; 2] {
        let (Self::Polynomial { phase_deg, .. } | Self::Standard { phase_deg, .. } | Self::Sphere { phase_deg, .. }) =
            self;
        *phase_deg
    }

    /// Altitudes of the Sun at the satellite that it holds for \[deg\].
    #[must_use]
    pub fn sun_alt_sat_deg(&self) -> [f64; 2] {
        match self {
            Self::Polynomial { sun_alt_sat_deg, .. } => *sun_alt_sat_deg,
            Self::Standard { .. } | Self::Sphere { .. } => all_altitudes(),
        }
    }

    /// Checks every number; `key` is the model's own, e.g. `satellites.sphere.empirical`.
    ///
    /// # Errors
    /// [`Error::Config`] naming the key, the value and what is accepted.
    pub fn check(&self, key: &str) -> Result<()> {
        let [low, high] = self.phase_deg();
        range(&format!("{key}.phase_deg"), low, 0.0, 180.0, "deg")?;
        range(&format!("{key}.phase_deg"), high, low, 180.0, "deg")?;
        let mag = format!("{key}.mag_1000km");
        match self {
            Self::Polynomial { mag_1000km, per_sun_alt_sat, .. } => {
                let [low, high] = self.sun_alt_sat_deg();
                range(&format!("{key}.sun_alt_sat_deg"), low, -90.0, 90.0, "deg")?;
                range(&format!("{key}.sun_alt_sat_deg"), high, low, 90.0, "deg")?;
                for (key, c, fewest) in [(mag, mag_1000km, 1), (format!("{key}.per_sun_alt_sat"), per_sun_alt_sat, 0)] {
                    if !(fewest..=8).contains(&c.len()) {
                        let problem = format!("{} coefficients; accepted are {fewest} to 8", c.len());
                        return Err(Error::Config { key, problem });
                    }
                    c.iter().try_for_each(|c| range(&key, *c, -100.0, 100.0, "mag/deg^k"))?;
                }
                Ok(())
            }
            Self::Standard { mag_1000km, at_phase_deg, .. } => {
                range(&mag, *mag_1000km, -30.0, 30.0, "mag")?;
                range(&format!("{key}.at_phase_deg"), *at_phase_deg, 0.0, 170.0, "deg")
            }
            Self::Sphere { reflecting_area_m2, .. } => {
                range(&format!("{key}.reflecting_area_m2"), *reflecting_area_m2, 1e-9, 1e9, "m²")
            }
        }
    }
}

fn all_altitudes() -> [f64; 2] {
    [-90.0, 90.0]
}

fn is_all_altitudes(range: &[f64; 2]) -> bool {
    *range == all_altitudes()
}

fn all_phases() -> [f64; 2] {
    [0.0, 180.0]
}
