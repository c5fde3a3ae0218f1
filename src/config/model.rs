//! Where the target goes and which model it is compared with: elements, satellite, Earth, the reading of the paper.
//!
//! Times in s and d, units in the keys. Surfaces are in `surface`, the effects one by one in `effects`.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::effects::{Effects, EffectsTable, Mode};
use super::surface::{Brdf, Surface};

/// The elements of the target.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// TLE, 3LE or OMM (JSON, CSV, KVN, XML); of several sets of one object the nearest in time is used.
    pub elements: PathBuf,
    /// Catalogue number, when the file holds several objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub norad_cat_id: Option<u64>,
    /// Elements older than this are refused \[d\].
    #[serde(default = "max_age")]
    pub max_age_d: f64,
    /// Use elements older than `max_age_d`, or contradicted by another set, all the same.
    #[serde(default)]
    pub force_age: bool,
    /// UT1−UTC \[s\] instead of that of the embedded IERS table (1972 to a year after this version).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ut1_utc_s: Option<f64>,
    /// Polar motion x \[arcsec\].
    #[serde(default)]
    pub xp_arcsec: f64,
    /// Polar motion y \[arcsec\].
    #[serde(default)]
    pub yp_arcsec: f64,
}

/// The model to compare with.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// A satellite of the catalogue (`iss`), or any name when `surfaces` are given.
    pub satellite: String,
    /// A file of own satellites, in the form of `satphot satellites NAME --toml`; its names win over the catalogue's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub satellites: Option<PathBuf>,
    /// As published or corrected: the preset of every effect.
    #[serde(default)]
    pub mode: Mode,
    /// Effects that differ from the preset.
    #[serde(default)]
    pub effects: EffectsTable,
    /// Own surfaces instead of the catalogue's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<Surface>,
    /// How the ground scatters, one law for the whole Earth.
    #[serde(default = "Brdf::earth_vegetation")]
    pub earth: Brdf,
    /// Pass band: `B`, `V`, `R`, `I`, `g`, `r`, `i`, `z`, `G` (Gaia), or a file of `wavelength_nm,transmission` (photon response).
    #[serde(default = "band")]
    pub band: String,
    /// A file of `wavelength_nm,transmission` of telescope and detector, which multiplies the band; magnitudes are AB then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub throughput: Option<PathBuf>,
    /// Extinction between satellite and observer \[mag/airmass\], for `effects.source = "extincted"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub k_mag_airmass: Option<f64>,
    /// 1-sigma error of the extinction \[mag/airmass\], for the predictive error; 0 if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub k_mag_airmass_err: Option<f64>,
    /// Relative tolerance of the Earth-reflected integral. The default 1e-4 is met with 1e-7 to 1e-6 in 95 of 100 cases for 10 to
    /// 140 µs; 1e-6 takes three to seven times as long (`satphot accuracy earth-reflected`).
    #[serde(default = "tolerance")]
    pub tolerance: f64,
}

impl Model {
    /// The bands known by name.
    pub const BANDS: [&str; 9] = ["B", "V", "R", "I", "g", "r", "i", "z", "G"];

    /// The file of the pass band, unless it is one known by name.
    #[must_use]
    pub fn band_file(&self) -> Option<PathBuf> {
        (!Self::BANDS.contains(&self.band.as_str())).then(|| PathBuf::from(&self.band))
    }

    /// A satellite of the catalogue, everything else at its default.
    #[must_use]
    pub fn of(satellite: &str) -> Self {
        Self {
            satellite: satellite.into(),
            satellites: None,
            mode: Mode::default(),
            effects: EffectsTable::default(),
            surfaces: Vec::new(),
            earth: Brdf::earth_vegetation(),
            band: band(),
            throughput: None,
            k_mag_airmass: None,
            k_mag_airmass_err: None,
            tolerance: tolerance(),
        }
    }

    /// The effects: the preset of `mode`, with what `effects` changes.
    #[must_use]
    pub fn resolved_effects(&self) -> Effects {
        self.effects.over(Effects::of(self.mode))
    }
}

fn max_age() -> f64 {
    14.0
}
fn tolerance() -> f64 {
    1e-4
}
fn band() -> String {
    "V".into()
}
