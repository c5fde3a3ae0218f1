//! A satellite whose magnitudes are known, and not its surfaces: the law as a file states it.
//!
//! Magnitudes in V outside the atmosphere at 1000 km, phase angles (Sun, satellite, observer; 0 = fully lit) in degrees.

use serde::{Deserialize, Serialize};

use super::range;
use crate::base::error::{Error, Result};

/// How V in full sunlight depends on phase angle φ and range R: V = m(φ) + 5 lg(R / 1000 km).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Empirical {
    /// m(φ) = Σ c_k φ^k.
    Polynomial {
        /// c_0, c_1, ... \[mag/deg^k\].
        mag_1000km: Vec<f64>,
        /// Phase angles of the observations that it was fitted to \[deg\]; nothing is said outside.
        phase_deg: [f64; 2],
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
    /// Phase angles it holds for \[deg\].
    #[must_use]
    pub fn phase_deg(&self) -> [f64; 2] {
        let (Self::Polynomial { phase_deg, .. } | Self::Standard { phase_deg, .. } | Self::Sphere { phase_deg, .. }) =
            self;
        *phase_deg
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
            Self::Polynomial { mag_1000km, .. } => {
                if !(1..=8).contains(&mag_1000km.len()) {
                    let problem = format!("{} coefficients; accepted are 1 to 8", mag_1000km.len());
                    return Err(Error::Config { key: mag, problem });
                }
                mag_1000km.iter().try_for_each(|c| range(&mag, *c, -100.0, 100.0, "mag/deg^k"))
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

fn all_phases() -> [f64; 2] {
    [0.0, 180.0]
}
