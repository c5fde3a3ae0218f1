//! The table of limits: one row for each sky, ratio to the noise and thing detected.
//!
//! Magnitudes in the band the meta block names, e⁻, s, arcsec².

use std::path::Path;

use serde::Serialize;

use crate::base::error::Result;
use crate::tables::columns::{Column, integer, number, text};
use crate::tables::ecsv::write;
use crate::tables::meta::Meta;

/// Columns of the table of limits.
pub const LIMITS: &[Column] = &[
    text("sky", "which sky"),
    number("moon_phase_deg", "deg", "phase angle of the Moon, 0 = full"),
    number("moon_alt_deg", "deg", "altitude of the Moon, where the sky is computed from it"),
    number("sky_mag_arcsec2", "mag / arcsec2", "brightness of the sky in the band"),
    number("sky_e_s_px", "electron / (pix s)", "the same in electrons per second and pixel"),
    number("exptime_s", "s", "exposure time, all exposures together"),
    integer("n_sub", "number of exposures it is split into"),
    number("snr", "", "signal-to-noise ratio of the limit"),
    text("limit_of", "what is detected: one pixel, one arcsec2, point source or extended target"),
    number("summed_arcsec2", "arcsec2", "area over which light is summed"),
    number("n_px", "pix", "the same in pixels"),
    number("noise_var_e2", "electron2", "variance in that area without the target"),
    number("limit_mag", "mag", "faintest magnitude, all light of the target"),
    number("mu_limit_mag_arcsec2", "mag / arcsec2", "faintest mean surface brightness"),
    number("saturation_mag", "mag", "magnitude at which one exposure saturates the brightest pixel"),
    integer("saturated", "1 = at the limit a pixel is saturated, by the sky or the target"),
    number("mag", "mag", "magnitude asked for"),
    number("mag_snr", "", "its signal-to-noise ratio in exptime_s"),
    number("mag_exptime_s", "s", "exposure time in which it reaches snr, all exposures together"),
    integer("mag_n_sub", "number of exposures that takes, none of them saturated"),
    text("reason", "why mag_exptime_s is missing"),
];

/// One limit.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs)] // the columns say what each is
pub struct LimitRow {
    pub sky: String,
    pub moon_phase_deg: Option<f64>,
    pub moon_alt_deg: Option<f64>,
    pub sky_mag_arcsec2: f64,
    pub sky_e_s_px: f64,
    pub exptime_s: f64,
    pub n_sub: i64,
    pub snr: f64,
    pub limit_of: String,
    pub summed_arcsec2: f64,
    pub n_px: f64,
    pub noise_var_e2: f64,
    pub limit_mag: Option<f64>,
    pub mu_limit_mag_arcsec2: Option<f64>,
    pub saturation_mag: Option<f64>,
    pub saturated: i64,
    pub mag: Option<f64>,
    pub mag_snr: Option<f64>,
    pub mag_exptime_s: Option<f64>,
    pub mag_n_sub: Option<i64>,
    pub reason: String,
}

/// Writes the table of limits.
///
/// # Errors
/// [`crate::Error::Table`] naming row and column of a NaN or infinite number; [`crate::Error::Io`].
pub fn write_limits(path: &Path, rows: &[LimitRow], meta: &Meta) -> Result<()> {
    write(path, rows, LIMITS, meta)
}
