//! What every observation of a table shares: site, band, zeropoint, whether it is real, and who reports it.
//!
//! From the meta block of the table first, then from the configuration of the run. What a format needs and nobody said
//! is an error that names the option and the key.

use serde::{Deserialize, Serialize};

use crate::bands::Band;
use crate::bands::CalibratedBand;
use crate::bands::How;
use crate::bands::Light;
use crate::base::error::{Error, Result};
use crate::config::{Config, Reporter};
use crate::tables::meta::{Meta, MetaValue};

/// Whether the light came from the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum DataMode {
    /// Real frames.
    Real,
    /// Frames of `satphot simulate`, at least one of them.
    Simulated,
    /// Real or not, for testing a receiver.
    Test,
    /// Part of an exercise.
    Exercise,
}

impl DataMode {
    /// The word for it in meta blocks and in the UDL.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            DataMode::Real => "REAL",
            DataMode::Simulated => "SIMULATED",
            DataMode::Test => "TEST",
            DataMode::Exercise => "EXERCISE",
        }
    }

    /// The mode of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        [DataMode::Real, DataMode::Simulated, DataMode::Test, DataMode::Exercise].into_iter().find(|m| m.name() == name)
    }
}

/// The zeropoint of the magnitudes: `V = inst − ZP − k X − C (B−V)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zeropoint {
    /// ZP \[mag\].
    pub zp_mag: f64,
    /// Extinction \[mag/airmass\].
    pub k_mag_airmass: f64,
    /// 1-sigma of ZP \[mag\].
    pub zp_err_mag: Option<f64>,
    /// 1-sigma of k \[mag/airmass\].
    pub k_err_mag_airmass: Option<f64>,
    /// Star measurements in the fit.
    pub n_used: Option<f64>,
}

/// What every observation of a table shares.
#[derive(Debug, Clone)]
pub struct Facts {
    /// Latitude \[deg\], longitude east positive, −180 to 180 \[deg\], height above the ellipsoid \[m\].
    pub site: Option<[f64; 3]>,
    /// Name of the site.
    pub site_name: Option<String>,
    /// Telescope.
    pub telescope: Option<String>,
    /// Camera.
    pub camera: Option<String>,
    /// Band of the magnitudes, `V`.
    pub band: String,
    /// Band and how the magnitudes came into it, in words: `V, unfiltered, colour-transformed`.
    pub calibration: String,
    /// The magnitudes are of a band that the filter is not of, because the observer declares it.
    pub declared: bool,
    /// System of the magnitudes, `Vega`.
    pub mag_system: String,
    /// Whether the frames are real; `None` where the table does not say.
    pub data_mode: Option<DataMode>,
    /// S/N below which a target counts as not detected.
    pub detect_sigma: f64,
    /// The zeropoint, where there is one.
    pub zeropoint: Option<Zeropoint>,
    /// Program that wrote the table.
    pub tool: String,
    /// Who reports.
    pub reporter: Reporter,
}

impl Facts {
    /// From the meta block of a table and the configuration of its run; `reporter` wins over that of the latter.
    ///
    /// # Errors
    /// [`Error::Config`] for a data_mode or a place that cannot be.
    pub fn new(meta: &Meta, config: Option<&Config>, reporter: Reporter) -> Result<Self> {
        let text = |key: &str| match meta.get(key) {
            Some(MetaValue::Text(t)) if !t.is_empty() => Some(t.clone()),
            _ => None,
        };
        let site = (meta.number_in("site", "lat_deg"))
            .zip(meta.number_in("site", "lon_deg"))
            .zip(meta.number_in("site", "alt_m"))
            .map(|((lat, lon), alt)| [lat, lon, alt])
            .or_else(|| config.map(|c| [c.site.lat_deg, c.site.lon_deg, c.site.alt_m]));
        let data_mode = match text("data_mode") {
            None => None,
            Some(name) => Some(DataMode::named(&name).ok_or_else(|| {
                wrong(
                    "data_mode",
                    format!("`{name}` in the meta of the table is not REAL, SIMULATED, TEST or EXERCISE"),
                )
            })?),
        };
        let band = text("band").unwrap_or_else(|| Band::or_v(None).name().into());
        let known =
            Band::named(&band).zip(text("filter")).map(|(band, f)| CalibratedBand::known(band, Light::named(&f)));
        Ok(Self {
            calibration: text("calibration").unwrap_or_else(|| band.clone()),
            declared: known.is_some_and(|known| known.how == How::Declared),
            site: site.map(checked).transpose()?,
            site_name: config.map(|c| c.site.name.clone()),
            telescope: text("telescope").or_else(|| config.map(|c| c.telescope.name.clone())),
            camera: config.map(|c| c.detector.camera.clone()),
            band,
            mag_system: text("mag_system").unwrap_or_else(|| "Vega".into()),
            data_mode,
            detect_sigma: config.map_or(5.0, |c| c.target.detect_sigma),
            zeropoint: zeropoint(meta),
            tool: text("tool").unwrap_or_else(|| "satphot".into()),
            reporter: match config {
                Some(config) => reporter.or(&config.reporter),
                None => reporter,
            },
        })
    }

    /// Puts the observatory elsewhere: latitude \[deg\], longitude \[deg\], height \[m\]. Whether that is a change.
    ///
    /// # Errors
    /// [`Error::Config`] for a place that cannot be.
    pub fn place(&mut self, site: [f64; 3]) -> Result<bool> {
        let site = checked(site)?;
        Ok(self.site.replace(site).is_some_and(|before| before != site))
    }

    /// The site, or what to do about its absence.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn site(&self) -> Result<[f64; 3]> {
        self.site.ok_or_else(|| needed("the place of the observatory", "site", "[site]"))
    }

    /// Real or not, or what to do about a table that does not say.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn data_mode(&self) -> Result<DataMode> {
        self.data_mode.ok_or_else(|| {
            argument(
                "data_mode",
                "the table does not say whether its frames are real (meta data_mode, written by `run` and \
                 `measure`); reduce the night again, or say REAL, SIMULATED, TEST or EXERCISE"
                    .into(),
            )
        })
    }

    /// Name of the station.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn station(&self) -> Result<&str> {
        said(&self.reporter.station)
            .or_else(|| said(&self.site_name))
            .ok_or_else(|| needed("the name of the station", "station", "reporter.station"))
    }

    /// Organisation that sends the file.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn organisation(&self) -> Result<&str> {
        said(&self.reporter.organisation)
            .ok_or_else(|| needed("the name of who reports", "organisation", "reporter.organisation"))
    }
}

/// The text, if it is there and not blank.
pub(super) fn said(text: &Option<String>) -> Option<&str> {
    text.as_deref().map(str::trim).filter(|t| !t.is_empty())
}

/// Something nobody said.
pub(super) fn needed(what: &str, name: &str, key: &str) -> Error {
    argument(name, format!("{what} is needed: give argument `{name}`, or {key} in the configuration"))
}

/// An argument that is missing or wrong.
pub(super) fn argument(name: &str, problem: String) -> Error {
    Error::Argument { name: name.into(), problem }
}

pub(super) fn wrong(key: &str, problem: String) -> Error {
    Error::Config { key: key.into(), problem }
}

/// Longitudes may be derived from 0 to 360 deg; archives want −180 to 180.
fn checked([lat, lon, alt]: [f64; 3]) -> Result<[f64; 3]> {
    if !(-90.0..=90.0).contains(&lat) || !(-180.0..=360.0).contains(&lon) || !(-500.0..=9_000.0).contains(&alt) {
        return Err(wrong(
            "site",
            format!(
                "latitude {lat}, longitude {lon} deg, height {alt} m: accepted are -90 to 90, -180 to 360, -500 to 9000"
            ),
        ));
    }
    Ok([lat, if lon > 180.0 { lon - 360.0 } else { lon }, alt])
}

fn zeropoint(meta: &Meta) -> Option<Zeropoint> {
    let Some(MetaValue::Map(pairs)) = meta.get("zeropoint") else { return None };
    let variance = |i: usize| match pairs.iter().find(|(k, _)| k == "cov").map(|(_, v)| v) {
        Some(MetaValue::List(rows)) => match rows.get(i) {
            Some(MetaValue::List(row)) => match row.get(i) {
                Some(MetaValue::Number(n)) if *n >= 0.0 => Some(n.sqrt()),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    };
    Some(Zeropoint {
        zp_mag: meta.number_in("zeropoint", "zp_mag")?,
        k_mag_airmass: meta.number_in("zeropoint", "k_mag_airmass")?,
        zp_err_mag: variance(0),
        k_err_mag_airmass: variance(1),
        n_used: meta.number_in("zeropoint", "n_used"),
    })
}
