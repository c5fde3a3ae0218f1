//! What the air takes from a pass band: Rayleigh scattering and ozone, straight up.
//!
//! Magnitudes at the zenith. Not included: aerosol, water vapour, the oxygen lines (0.03 mag of the i band at the
//! zenith).

use crate::base::error::{Error, Result};
use crate::brightness::spectrum::{Band, Curve, SolarColumn, Spectrum, embedded};

/// Effective wavelength of V in sunlight \[nm\]: that of Bessell's band and the ASTM G-173 spectrum.
const V_EFFECTIVE_NM: f64 = 550.0;
/// Mean ozone coefficient of V in sunlight \[1/cm\]: that of Bessell's band, ASTM G-173 and Bird & Riordan (1984).
const V_OZONE_PER_CM: f64 = 0.079_6;

/// Extinction of clean air at the zenith, in one pass band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Colour {
    /// By Rayleigh scattering \[mag\].
    pub rayleigh_mag: f64,
    /// By ozone \[mag\].
    pub ozone_mag: f64,
}

impl Colour {
    /// V: 0.105 mag by Rayleigh scattering (Hansen & Travis 1974 have 0.1056 at 550 nm, 0.1050 at 551), 0.03 mag by
    /// ozone (350 DU of Bird & Riordan 1984; 300 DU have 0.026).
    pub const V: Self = Self { rayleigh_mag: 0.105, ozone_mag: 0.03 };

    /// Of a band: Rayleigh at its effective wavelength in sunlight, the mean of ozone over it, both as ratios to V.
    ///
    /// `τ_R = 0.008569 λ⁻⁴ (1 + 0.0113 λ⁻² + 0.00013 λ⁻⁴)`, λ in µm (Hansen & Travis 1974, Space Sci. Rev. 16, 527).
    ///
    /// # Errors
    /// [`Error::Table`] when an embedded table is damaged, [`Error::Model`] for a band without sunlight.
    pub fn of(band: &Band) -> Result<Self> {
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial)?;
        let rows = embedded(include_str!("../../presets/spectra/ozone_spctral2.csv"), "ozone_spctral2.csv", 2)?;
        let ozone = Curve::from_rows(&rows, 1);
        let (effective_nm, ozone_per_cm) = (band.effective_nm(&sun), band.mean_of(&sun, |nm| ozone.at(nm)));
        let colour = Self {
            rayleigh_mag: Self::V.rayleigh_mag * rayleigh_depth(effective_nm) / rayleigh_depth(V_EFFECTIVE_NM),
            ozone_mag: Self::V.ozone_mag * ozone_per_cm / V_OZONE_PER_CM,
        };
        if colour.rayleigh_mag.is_finite() && colour.ozone_mag.is_finite() {
            return Ok(colour);
        }
        Err(Error::Model { problem: format!("no sunlight in band {}", band.name()) })
    }
}

/// Optical depth of Rayleigh scattering from sea level up.
fn rayleigh_depth(nm: f64) -> f64 {
    let per_um2 = 1e6 / (nm * nm);
    0.008_569 * per_um2 * per_um2 * (1.0 + per_um2 * (0.011_3 + 0.000_13 * per_um2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constants_of_v_are_those_of_its_band() {
        let v = Colour::of(&Band::named("V").unwrap()).unwrap();
        assert!((v.rayleigh_mag - Colour::V.rayleigh_mag).abs() < 1e-4, "{v:?}");
        assert!((v.ozone_mag - Colour::V.ozone_mag).abs() < 1e-4, "{v:?}");
    }

    #[test]
    fn rayleigh_depth_is_the_standard_one() {
        // Bodhaine et al. 1999 (J. Atmos. Oceanic Technol. 16, 1854), Table 4: 0.0972 at 550 nm, 0.3626 at 400, from
        // memory
        assert!((rayleigh_depth(550.0) - 0.0972).abs() < 3e-4);
        assert!((rayleigh_depth(400.0) / 0.3626 - 1.0).abs() < 0.01);
    }

    #[test]
    fn blue_is_scattered_most_and_red_absorbed_most() {
        let [g, r, i] = ["g", "r", "i"].map(|b| Colour::of(&Band::named(b).unwrap()).unwrap());
        assert!(g.rayleigh_mag > Colour::V.rayleigh_mag && Colour::V.rayleigh_mag > r.rayleigh_mag);
        assert!(r.rayleigh_mag > i.rayleigh_mag);
        assert!(r.ozone_mag > Colour::V.ozone_mag && Colour::V.ozone_mag > g.ozone_mag && g.ozone_mag > i.ozone_mag);
    }
}
