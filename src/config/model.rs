//! What the satellite is and where it goes: elements, surfaces, scattering, the reading of the paper.
//!
//! Areas in m², times in s and d, units in the keys.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// The elements of the target.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// TLE, 3LE or OMM JSON; of several sets of one object the nearest in time is used.
    pub elements: PathBuf,
    /// Catalogue number, when the file holds several objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub norad_cat_id: Option<u64>,
    /// Elements older than this are refused \[d\].
    #[serde(default = "max_age")]
    pub max_age_d: f64,
    /// Use elements older than `max_age_d` all the same.
    #[serde(default)]
    pub force_age: bool,
    /// UT1−UTC \[s\] (IERS Bulletin A); 0 costs up to 10 arcsec on a LEO satellite near zenith.
    #[serde(default)]
    pub ut1_utc_s: f64,
    /// Polar motion x \[arcsec\].
    #[serde(default)]
    pub xp_arcsec: f64,
    /// Polar motion y \[arcsec\].
    #[serde(default)]
    pub yp_arcsec: f64,
}

/// Which reading of the paper: as printed, or with its errors put right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// As the paper prints it.
    AsPublished,
    /// As the physics asks.
    #[default]
    Corrected,
}

/// The model to compare with.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// A satellite of the catalogue (`iss`), or any name when `surfaces` are given.
    pub satellite: String,
    /// As published or corrected.
    #[serde(default)]
    pub mode: Mode,
    /// Own surfaces instead of the catalogue's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<Surface>,
    /// Relative tolerance of the Earth-reflected integral.
    #[serde(default = "tolerance")]
    pub tolerance: f64,
}

/// A flat surface of the satellite.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Name, e.g. `chassis`.
    pub name: String,
    /// Area \[m²\].
    pub area_m2: f64,
    /// How it is held.
    pub attitude: Attitude,
    /// How it scatters.
    pub brdf: Brdf,
}

/// How a surface is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Attitude {
    /// Normal to the centre of the Earth.
    Nadir,
    /// Normal to the geometric Sun, also in the shadow.
    Sun,
}

/// How a surface scatters.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Brdf {
    /// f = ρ/π.
    Lambert {
        /// Albedo ρ, 0 to 1.
        albedo: f64,
    },
    /// f = k_d/π + k_s (n+2)/2π max(0, r·o)ⁿ.
    Phong {
        /// Diffuse share.
        kd: f64,
        /// Specular share.
        ks: f64,
        /// Exponent.
        n: f64,
    },
}

fn max_age() -> f64 {
    14.0
}
fn tolerance() -> f64 {
    1e-4
}
