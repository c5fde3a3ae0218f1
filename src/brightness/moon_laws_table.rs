//! The table of the lunar laws: one row for each phase angle.
//!
//! V magnitudes outside the atmosphere at mean distances.

use std::path::Path;

use serde::Serialize;

use crate::base::error::Result;
use crate::tables::columns::{Column, integer, number};
use crate::tables::ecsv::write;
use crate::tables::meta::Meta;

/// Columns of the table of lunar laws.
pub const MOON_LAWS: &[Column] = &[
    number("phase_deg", "deg", "phase angle of the Moon, 0 = full, 180 = new"),
    number("illum_frac", "", "share of the disc that is lit, (1 + cos phase)/2"),
    number("cox_v_mag", "mag", "V by Cox 2002 as printed, no surge; tapered to no light past 150 deg"),
    integer("cox_extrapolated", "1 = beyond where the law is believed, 0 to 150 deg"),
    number("ks_v_mag", "mag", "the same with the surge below 7 deg of Krisciunas & Schaefer 1991"),
    integer("ks_extrapolated", "1 = beyond 0 to 150 deg"),
    number("rolo_v_mag", "mag", "V by ROLO (Kieffer & Stone 2005), zero libration, waxing as waning"),
    integer("rolo_extrapolated", "1 = beyond what it was fitted to, 1.55 to 97 deg"),
    number("ks_minus_cox_mag", "mag", "ks_v_mag - cox_v_mag; negative is brighter than Cox"),
    number("rolo_minus_cox_mag", "mag", "rolo_v_mag - cox_v_mag; negative is brighter than Cox"),
    number(
        "cox_polynomial_v_mag",
        "mag",
        "the polynomial of Cox at every phase, as published: 180 deg is no dark Moon",
    ),
];

/// One phase angle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[allow(missing_docs)] // the columns say what each is
pub struct MoonLawRow {
    pub phase_deg: f64,
    pub illum_frac: f64,
    pub cox_v_mag: Option<f64>,
    pub cox_extrapolated: i64,
    pub ks_v_mag: Option<f64>,
    pub ks_extrapolated: i64,
    pub rolo_v_mag: Option<f64>,
    pub rolo_extrapolated: i64,
    pub ks_minus_cox_mag: Option<f64>,
    pub rolo_minus_cox_mag: Option<f64>,
    pub cox_polynomial_v_mag: f64,
}

/// Writes the table of lunar laws.
///
/// # Errors
/// [`crate::Error::Table`] naming row and column of a NaN or infinite number; [`crate::Error::Io`].
pub fn write_moon_laws(path: &Path, rows: &[MoonLawRow], meta: &Meta) -> Result<()> {
    write(path, rows, MOON_LAWS, meta)
}
