//! The table of `satphot limits footprint`: one row per nearest approach of a mirror's beam to a site.
//!
//! Units are those of the columns. Missing numbers are `None`.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::tables::columns::{Column, Datatype};
use crate::tables::ecsv;
use crate::tables::meta::Meta;

/// One nearest approach.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FootprintRow {
    /// `sun` or `moon`.
    pub lamp: String,
    /// When, UTC.
    pub date_mid: String,
    /// Altitude of the mirror \[deg\].
    pub alt_deg: f64,
    /// Distance of the mirror \[km\].
    pub range_km: f64,
    /// Angle at the mirror between beam and site \[deg\].
    pub offset_deg: f64,
    /// Distance of the site from the middle line of the beam \[km\].
    pub miss_km: f64,
    /// Longest diameter of the spot on the ground \[km\].
    pub spot_along_km: Option<f64>,
    /// Shortest diameter \[km\].
    pub spot_across_km: Option<f64>,
    /// Angle of the beam from the vertical of its spot \[deg\].
    pub incidence_deg: Option<f64>,
    /// Share of the lamp's disc the mirror sees.
    pub lit_frac: f64,
    /// First moment in the beam, UTC.
    pub in_beam_from: String,
    /// Time in the beam \[s\].
    pub in_beam_s: Option<f64>,
    /// V in the beam \[mag\].
    pub v_mag: Option<f64>,
}

const fn number(name: &'static str, unit: &'static str, description: &'static str) -> Column {
    Column { name, unit, datatype: Datatype::Float64, description }
}
const fn text(name: &'static str, description: &'static str) -> Column {
    Column { name, unit: "", datatype: Datatype::Text, description }
}

/// Columns of `footprint.ecsv`.
pub const FOOTPRINT: &[Column] = &[
    text("lamp", "sun or moon: whose light the beam is"),
    text("date_mid", "UTC of the nearest approach, ISO 8601"),
    number("alt_deg", "deg", "altitude of the mirror above the horizon of the site"),
    number("range_km", "km", "distance of the mirror from the site"),
    number("offset_deg", "deg", "angle at the mirror between the middle of the beam and the site"),
    number("miss_km", "km", "distance of the site from the middle line of the beam"),
    number("spot_along_km", "km", "longest diameter of the spot on the ground"),
    number("spot_across_km", "km", "shortest diameter of the spot on the ground"),
    number("incidence_deg", "deg", "angle of the beam from the vertical of its spot"),
    number("lit_frac", "", "share of the lamp's disc the mirror sees past the Earth"),
    text("in_beam_from", "first moment in the beam, UTC; empty if the beam misses the site"),
    number("in_beam_s", "s", "time in the beam"),
    number("v_mag", "mag", "V magnitude in the beam"),
];

/// Writes the table.
///
/// # Errors
/// [`crate::Error::Table`] naming row and column of a NaN or infinite number; [`crate::Error::Io`].
pub fn write_footprint(path: &Path, rows: &[FootprintRow], meta: &Meta) -> Result<()> {
    ecsv::write(path, rows, FOOTPRINT, meta)
}
