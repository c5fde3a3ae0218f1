//! The pass bands of magnitudes: names, magnitude systems, descriptors.

use serde::{Deserialize, Serialize};

/// A pass band of calibrated magnitudes.
///
/// Source of the names: AAVSO, list of bands (TB, TG and TR are the blue, green and red filters of colour imaging);
/// B, V, R and I without more are Johnson-Cousins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Band {
    /// Johnson U.
    U,
    /// Johnson B.
    B,
    /// Johnson V.
    V,
    /// Cousins R.
    R,
    /// Cousins I.
    I,
    /// Johnson R.
    RJohnson,
    /// Johnson I.
    IJohnson,
    /// SDSS u.
    SloanU,
    /// SDSS or Pan-STARRS g.
    SloanG,
    /// SDSS or Pan-STARRS r.
    SloanR,
    /// SDSS or Pan-STARRS i.
    SloanI,
    /// SDSS or Pan-STARRS z.
    SloanZ,
    /// Pan-STARRS y.
    PanStarrsY,
    /// Blue of a set for colour imaging.
    TriBlue,
    /// Green of a set for colour imaging.
    TriGreen,
    /// Red of a set for colour imaging.
    TriRed,
    /// Gaia G.
    GaiaG,
    /// Gaia BP.
    GaiaBp,
    /// Gaia RP.
    GaiaRp,
    /// Tycho BT.
    TychoB,
    /// Tycho VT.
    TychoV,
}

impl Band {
    pub(crate) fn entry(self) -> &'static (Band, &'static str, &'static str, &'static str) {
        const V: (Band, &str, &str, &str) = (Band::V, "V", "Vega", "em.opt.V");
        BANDS.iter().find(|(band, ..)| *band == self).unwrap_or(&V)
    }

    /// Its name, as in tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.entry().1
    }

    /// The system of its magnitudes: `Vega` or `AB`.
    #[must_use]
    pub fn mag_system(self) -> &'static str {
        self.entry().2
    }

    /// The word of its wavelengths in a UCD1+.
    #[must_use]
    pub fn ucd(self) -> &'static str {
        self.entry().3
    }

    /// The band of this very name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        BANDS.iter().find(|(_, known, ..)| *known == name).map(|(band, ..)| *band)
    }

    /// The band of magnitudes whose source may not name one: V where it does not.
    ///
    /// The method is that of Caddy et al., which calibrates to V with B−V, so tables and zeropoints that do not name a band
    /// are in V: those of other programs that follow the paper, and those of satphot from before it had other bands.
    #[must_use]
    pub fn or_v(stated: Option<Self>) -> Self {
        stated.unwrap_or(Band::V)
    }

    /// Every name, for messages.
    #[must_use]
    pub fn names() -> String {
        BANDS.iter().map(|(_, name, ..)| *name).collect::<Vec<_>>().join(", ")
    }

    /// The band of the stars that calibrate it: TB, TG and TR are defined by stars of B, V and R (AAVSO), any other by its
    /// own.
    #[must_use]
    pub fn reference(self) -> Self {
        match self {
            Band::TriBlue => Band::B,
            Band::TriGreen => Band::V,
            Band::TriRed => Band::R,
            other => other,
        }
    }
}

impl std::fmt::Display for Band {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl TryFrom<String> for Band {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::declared(&name).ok_or_else(|| format!("\"{name}\" is not a band; known: {}", Self::names()))
    }
}

/// Band, name, magnitude system, UCD1+ word of its wavelengths (IVOA vocabulary 1.5: em.opt.B is 400 to 500 nm, V 500 to
/// 600, R 600 to 750, I 750 to 1000). Only V itself is given em.opt.V; other bands there are `em.opt`.
pub(crate) const BANDS: [(Band, &str, &str, &str); 21] = [
    (Band::U, "U", "Vega", "em.opt.U"),
    (Band::B, "B", "Vega", "em.opt.B"),
    (Band::V, "V", "Vega", "em.opt.V"),
    (Band::R, "R", "Vega", "em.opt.R"),
    (Band::I, "I", "Vega", "em.opt.I"),
    (Band::RJohnson, "RJ", "Vega", "em.opt.R"),
    (Band::IJohnson, "IJ", "Vega", "em.opt.I"),
    (Band::SloanU, "u", "AB", "em.opt.U"),
    (Band::SloanG, "g", "AB", "em.opt.B"),
    (Band::SloanR, "r", "AB", "em.opt.R"),
    (Band::SloanI, "i", "AB", "em.opt.I"),
    (Band::SloanZ, "z", "AB", "em.opt.I"),
    (Band::PanStarrsY, "y", "AB", "em.opt.I"),
    (Band::TriBlue, "TB", "Vega", "em.opt.B"),
    (Band::TriGreen, "TG", "Vega", "em.opt"),
    (Band::TriRed, "TR", "Vega", "em.opt.R"),
    (Band::GaiaG, "G", "Vega", "em.opt"),
    (Band::GaiaBp, "BP", "Vega", "em.opt.B"),
    (Band::GaiaRp, "RP", "Vega", "em.opt.R"),
    (Band::TychoB, "BT", "Vega", "em.opt.B"),
    (Band::TychoV, "VT", "Vega", "em.opt"),
];

impl From<Band> for String {
    fn from(band: Band) -> Self {
        band.name().to_owned()
    }
}
