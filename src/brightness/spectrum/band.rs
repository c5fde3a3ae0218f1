//! Pass bands: transmission, what it multiplies, and the magnitude of the Sun in it.
//!
//! Wavelengths in nm. A band's magnitudes are ratios to the Sun's: its cited magnitude where there is one, else that of
//! the ASTM extraterrestrial spectrum in AB. Not included: leaks outside the table, the change of a filter with
//! temperature.

use std::path::Path;

use super::curve::{Curve, trapezoid, union_nm};
use super::magnitude::{MagSystem, ab_mag};
use super::solar::{SolarColumn, Spectrum};
use super::table;
use crate::bands;
use crate::base::constants::SPEED_OF_LIGHT_KM_S;
use crate::base::error::{Error, Result};
use crate::config::Model;

/// What the transmission of a table multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response {
    /// Photons: the signal is ∫ f_λ T λ dλ (CCDs, SDSS).
    Photon,
    /// Energy: the signal is ∫ f_λ T dλ (the tables of Bessell 1990).
    Energy,
}

/// A pass band and its magnitude system.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    name: String,
    transmission: Curve,
    response: Response,
    system: MagSystem,
    sun_ab_mag: f64,
    sun_vega_mag: Option<f64>,
}

/// Band, transmission, response.
type Named = (bands::Band, &'static str, Response);
const NAMED: [Named; 9] = [
    (bands::Band::B, include_str!("../../presets/spectra/bessell_1990_b.csv"), Response::Energy),
    (bands::Band::V, include_str!("../../presets/spectra/bessell_1990_v.csv"), Response::Energy),
    (bands::Band::R, include_str!("../../presets/spectra/bessell_1990_r.csv"), Response::Energy),
    (bands::Band::I, include_str!("../../presets/spectra/bessell_1990_i.csv"), Response::Energy),
    (bands::Band::SloanG, include_str!("../../presets/spectra/sdss_doi_2010_g.csv"), Response::Photon),
    (bands::Band::SloanR, include_str!("../../presets/spectra/sdss_doi_2010_r.csv"), Response::Photon),
    (bands::Band::SloanI, include_str!("../../presets/spectra/sdss_doi_2010_i.csv"), Response::Photon),
    (bands::Band::SloanZ, include_str!("../../presets/spectra/sdss_doi_2010_z.csv"), Response::Photon),
    (bands::Band::GaiaG, include_str!("../../presets/spectra/gaia_edr3_g.csv"), Response::Photon),
];

impl Band {
    /// `B`, `V`, `R`, `I` of Bessell (1990) in Vega magnitudes; `g`, `r`, `i`, `z` of SDSS (Doi et al. 2010) in AB; `G` of
    /// Gaia EDR3 (Riello et al. 2021) in Vega magnitudes; `None` for other names.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let (band, text, response) = NAMED.iter().find(|n| n.0.name() == name)?;
        let rows = table::embedded(text, band.name(), 2).ok()?;
        let [vega, ab] = band.sun_vega_ab_mag()?;
        Some(Self {
            name: band.name().to_owned(),
            transmission: Curve::from_rows(&rows, 1),
            response: *response,
            system: if band.mag_system() == "AB" { MagSystem::Ab } else { MagSystem::Vega },
            sun_ab_mag: ab,
            sun_vega_mag: Some(vega),
        })
    }

    /// A band of a file `wavelength_nm,transmission`, photon response, AB magnitudes.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Table`]: not readable, not two numbers in a row, wavelengths that do not rise or reach
    /// beyond the solar spectrum (280 to 4000 nm), a transmission that is negative or zero throughout.
    pub fn from_file(path: &Path) -> Result<Self> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self::from_curve(&name, Curve::from_file(path)?, Response::Photon).map_err(|problem| Error::Table {
            path: path.to_owned(),
            line: None,
            problem,
        })
    }

    /// A band that lets everything through between two wavelengths \[nm\] and nothing else; energy response, AB
    /// magnitudes.
    ///
    /// # Errors
    /// [`Error::Model`] for wavelengths that do not rise or reach beyond the solar spectrum (280 to 4000 nm).
    pub fn between(from_nm: f64, to_nm: f64) -> Result<Self> {
        let fault = |problem: String| Error::Model { problem: format!("band {from_nm} to {to_nm} nm: {problem}") };
        if !(from_nm > 0.0 && from_nm < to_nm && to_nm.is_finite()) {
            return Err(fault("accepted are two wavelengths above 0 that rise".into()));
        }
        let curve = Curve::from_rows(&[vec![from_nm, 1.0], vec![to_nm, 1.0]], 1);
        Self::from_curve(&format!("{from_nm}-{to_nm} nm"), curve, Response::Energy).map_err(fault)
    }

    /// The band a configuration names: one of those of [`Band::named`], or a file.
    ///
    /// # Errors
    /// [`Error::Config`] for a name that is neither; as [`Band::from_file`] for a file.
    pub fn of_config(name: &str) -> Result<Self> {
        if let Some(band) = Self::named(name) {
            return Ok(band);
        }
        if Path::new(name).exists() {
            return Self::from_file(Path::new(name));
        }
        Err(Error::Config {
            key: "model.band".into(),
            problem: format!(
                "\"{name}\" is neither {} nor a file of wavelength_nm,transmission",
                Model::BANDS.join(", ")
            ),
        })
    }

    /// This band behind a telescope and before a detector: the transmission times a throughput curve, as a band of its
    /// own in AB magnitudes.
    ///
    /// # Errors
    /// [`Error::Model`] when the curves do not overlap or nothing gets through.
    pub fn through(&self, throughput: &Curve) -> Result<Self> {
        let fault = |problem: String| Error::Model { problem: format!("band {}: {problem}", self.name) };
        let transmission =
            self.transmission.times(throughput).ok_or_else(|| fault("does not overlap the throughput curve".into()))?;
        Self::from_curve(&self.name, transmission, self.response).map_err(fault)
    }

    fn from_curve(name: &str, transmission: Curve, response: Response) -> std::result::Result<Self, String> {
        if let Some(t) = transmission.values().iter().find(|t| **t < 0.0) {
            return Err(format!("transmission {t} is negative"));
        }
        if transmission.integral(0.0, f64::INFINITY) <= 0.0 {
            return Err("the transmission is zero throughout".into());
        }
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial).map_err(|e| e.to_string())?;
        let (first, last) = transmission.range_nm();
        let (from, to) = sun.curve().range_nm();
        if first < from || last > to {
            return Err(format!("{first} to {last} nm is beyond the solar spectrum, {from} to {to} nm"));
        }
        let mut band = Self {
            name: name.to_owned(),
            transmission,
            response,
            system: MagSystem::Ab,
            sun_ab_mag: f64::NAN,
            sun_vega_mag: None,
        };
        band.sun_ab_mag = band.ab_mag(&sun).ok_or("no sunlight gets through")?;
        Ok(band)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Transmission over nm.
    #[must_use]
    pub fn transmission(&self) -> &Curve {
        &self.transmission
    }

    /// Photon or energy.
    #[must_use]
    pub fn response(&self) -> Response {
        self.response
    }

    /// The system of its magnitudes.
    #[must_use]
    pub fn system(&self) -> MagSystem {
        self.system
    }

    /// Magnitude of the Sun at 1 au in the band and its system.
    #[must_use]
    pub fn sun_mag(&self) -> f64 {
        self.sun_mag_in(self.system).unwrap_or(self.sun_ab_mag)
    }

    /// Magnitude of the Sun at 1 au in either system; in Vega only where it is cited.
    #[must_use]
    pub fn sun_mag_in(&self, system: MagSystem) -> Option<f64> {
        match system {
            MagSystem::Ab => Some(self.sun_ab_mag),
            MagSystem::Vega => self.sun_vega_mag,
        }
    }

    /// Mean spectral irradiance ⟨f_ν⟩ \[W m⁻² Hz⁻¹\].
    ///
    /// `∫ f_ν T dν/ν / ∫ T dν/ν` for photons, `∫ f_ν T dν / ∫ T dν` for energy; over wavelength
    /// `∫ f_λ S dλ / c ∫ S λ⁻² dλ` with S = λT and T.
    #[must_use]
    pub fn mean_f_nu(&self, spectrum: &Spectrum) -> f64 {
        let c_nm_s = SPEED_OF_LIGHT_KM_S * 1e12;
        let nm = union_nm(&[&self.transmission, spectrum.curve()]);
        let f_nu = trapezoid(&nm, |x| spectrum.curve().at(x) * self.weight(x));
        // the flat spectrum too on these points, so that its own magnitude is exactly its own
        f_nu / (c_nm_s * trapezoid(&nm, |x| self.weight(x) / (x * x)))
    }

    /// AB magnitude of a spectrum in this band; `None` for no light.
    #[must_use]
    pub fn ab_mag(&self, spectrum: &Spectrum) -> Option<f64> {
        ab_mag(self.mean_f_nu(spectrum))
    }

    /// Energy in the band \[W m⁻²\]: `∫ f_λ T dλ`, whatever the response.
    #[must_use]
    pub fn irradiance_w_m2(&self, spectrum: &Spectrum) -> f64 {
        let nm = union_nm(&[&self.transmission, spectrum.curve()]);
        trapezoid(&nm, |x| spectrum.curve().at(x) * self.transmission.at(x))
    }

    /// Effective wavelength for a spectrum \[nm\]: its mean, weighted by the signal.
    #[must_use]
    pub fn effective_nm(&self, spectrum: &Spectrum) -> f64 {
        self.mean_of(spectrum, |x| x)
    }

    /// Mean of a quantity over the band, weighted by the signal of a spectrum: `∫ q f_λ S dλ / ∫ f_λ S dλ`.
    #[must_use]
    pub fn mean_of(&self, spectrum: &Spectrum, quantity: impl Fn(f64) -> f64) -> f64 {
        let nm = union_nm(&[&self.transmission, spectrum.curve()]);
        let signal = |x: f64| spectrum.curve().at(x) * self.weight(x);
        trapezoid(&nm, |x| quantity(x) * signal(x)) / trapezoid(&nm, signal)
    }

    /// S(λ): λT for photons, T for energy.
    fn weight(&self, nm: f64) -> f64 {
        match self.response {
            Response::Photon => nm * self.transmission.at(nm),
            Response::Energy => self.transmission.at(nm),
        }
    }
}
