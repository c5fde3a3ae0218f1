//! The Sun's spectrum, outside the atmosphere and at the ground, and spectra of the user's.
//!
//! W m⁻² nm⁻¹ over nm. Not included: lines narrower than the table's 0.5 to 5 nm, and the 0.1 % the Sun varies.

use std::path::Path;

use super::curve::Curve;
use super::table;
use crate::base::error::{Error, Result};

const ASTM: &str = include_str!("../../presets/spectra/astm_g173_03.csv");

/// A spectral irradiance \[W m⁻² nm⁻¹\] over wavelength \[nm\].
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    curve: Curve,
}

/// The columns of ASTM G-173-03, all at 1 au.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolarColumn {
    /// Outside the atmosphere.
    Extraterrestrial,
    /// At the ground, all of it on a surface tilted 37° to the Sun, air mass 1.5.
    Global,
    /// At the ground, the beam and the ring around the Sun.
    Direct,
}

impl SolarColumn {
    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            SolarColumn::Extraterrestrial => "extraterrestrial",
            SolarColumn::Global => "global",
            SolarColumn::Direct => "direct",
        }
    }
}

impl Spectrum {
    /// The Sun at 1 au: ASTM G-173-03, 280 to 4000 nm.
    ///
    /// # Errors
    /// [`Error::Table`] when the embedded table is damaged.
    ///
    /// # Source
    /// Gueymard, Myers & Emery 2002, Solar Energy 73, 443 (SMARTS 2.9.2).
    pub fn sun(column: SolarColumn) -> Result<Self> {
        let rows = table::embedded(ASTM, "astm_g173_03.csv", 4)?;
        Ok(Self { curve: Curve::from_rows(&rows, 1 + column as usize) })
    }

    /// A spectrum of two columns: nm and W m⁻² nm⁻¹.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Table`]: not readable, not two numbers, wavelengths that do not rise, negative values.
    pub fn from_file(path: &Path) -> Result<Self> {
        let curve = Curve::from_file(path)?;
        match curve.values().iter().position(|v| *v < 0.0) {
            Some(i) => Err(Error::Table {
                path: path.to_owned(),
                line: None,
                problem: format!("{} W/m2/nm at {} nm is negative", curve.values()[i], curve.nm()[i]),
            }),
            None => Ok(Self { curve }),
        }
    }

    /// The curve.
    #[must_use]
    pub fn curve(&self) -> &Curve {
        &self.curve
    }

    /// ∫ f_λ dλ \[W m⁻²\] from `from_nm` to `to_nm`.
    #[must_use]
    pub fn irradiance_w_m2(&self, from_nm: f64, to_nm: f64) -> f64 {
        self.curve.integral(from_nm, to_nm)
    }

    /// This spectrum with another brightness: every value times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { curve: self.curve.scaled(factor) }
    }
}
