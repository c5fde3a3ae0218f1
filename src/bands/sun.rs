//! The Sun's apparent magnitude at 1 au in each band.

use crate::bands::Band;

/// Band, apparent magnitude of the Sun at 1 au in Vega and in AB magnitudes.
///
/// # Source
/// Willmer 2018, ApJS 236, 47, table 3 (SDSS for u to z). G, BP and RP: the passbands of Gaia EDR3 over ASTM G-173, which
/// gives the others within 0.02 mag; Casagrande & VandenBerg 2018 (MNRAS 479, L102) have G −26.895.
const SUN: [(Band, f64, f64); 13] = [
    (Band::B, -26.13, -26.26),
    (Band::V, -26.76, -26.77),
    (Band::R, -27.15, -26.97),
    (Band::I, -27.47, -27.06),
    (Band::SloanG, -26.34, -26.47),
    (Band::SloanR, -27.04, -26.93),
    (Band::SloanI, -27.38, -27.05),
    (Band::SloanZ, -27.56, -27.07),
    (Band::GaiaG, -26.90, -26.79),
    (Band::GaiaBp, -26.58, -26.56),
    (Band::GaiaRp, -27.39, -27.04),
    (Band::TychoB, -25.99, -26.09),
    (Band::TychoV, -26.69, -26.72),
];

impl Band {
    /// Apparent magnitude of the Sun at 1 au in Vega and in AB magnitudes; `None` where it is not known.
    #[must_use]
    pub fn sun_vega_ab_mag(self) -> Option<[f64; 2]> {
        SUN.iter().find(|(band, ..)| *band == self.reference()).map(|(_, vega, ab)| [*vega, *ab])
    }

    /// Apparent magnitude of the Sun at 1 au in the system of the band; `None` where it is not known.
    #[must_use]
    pub fn sun_mag(self) -> Option<f64> {
        let [vega, ab] = self.sun_vega_ab_mag()?;
        Some(if self.mag_system() == "AB" { ab } else { vega })
    }
}
