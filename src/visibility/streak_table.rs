//! The table of `satphot limits streak`: one row per satellite and choice of its magnitude.
//!
//! Units are those of the columns. Missing numbers are `None`; a satellite without light has no magnitude.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::tables::columns::{Column, Datatype};
use crate::tables::ecsv;
use crate::tables::meta::Meta;

/// One satellite before one survey.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StreakRow {
    /// Name of the satellite.
    pub object_name: String,
    /// Where its magnitude is from.
    pub mag_source: String,
    /// Whether that is the model.
    #[serde(skip)]
    pub is_modelled: bool,
    /// Area \[m²\].
    pub area_m2: f64,
    /// Height of the orbit \[km\].
    pub height_km: Option<f64>,
    /// Observer to satellite \[km\].
    pub range_km: f64,
    /// Angular rate against the stars \[deg/s\].
    pub rate_deg_s: f64,
    /// Where the rate is from.
    pub rate_source: String,
    /// V, tracked \[mag\].
    pub v_mag: Option<f64>,
    /// Mean surface brightness, tracked \[mag/arcsec²\].
    pub mu_mag_arcsec2: Option<f64>,
    /// Diameter of a disc of the area \[m\].
    pub diameter_m: f64,
    /// Its angle \[arcsec\].
    pub satellite_arcsec: f64,
    /// Blur of being out of focus \[arcsec\].
    pub defocus_arcsec: f64,
    /// Seeing \[arcsec\].
    pub fwhm_arcsec: f64,
    /// Width of the trail \[arcsec\].
    pub trail_width_arcsec: f64,
    /// Length of the trail in the field \[arcsec\].
    pub trail_length_arcsec: f64,
    /// Exposure \[s\].
    pub exptime_s: f64,
    /// Time in the field \[s\].
    pub in_field_s: f64,
    /// Width over rate \[s\].
    pub t_eff_s: f64,
    /// The paper's short form \[s\].
    pub t_eff_simple_s: Option<f64>,
    /// Effective surface brightness in V as published \[mag/arcsec²\].
    pub nu_published_mag_arcsec2: Option<f64>,
    /// Effective surface brightness in V, corrected \[mag/arcsec²\].
    pub nu_corrected_mag_arcsec2: Option<f64>,
    /// Band of the survey.
    pub filter: String,
    /// Band magnitude less V \[mag\].
    pub colour_mag: f64,
    /// Limit of a point \[mag\].
    pub limit_point_mag: f64,
    /// Limit over a square arcsecond \[mag/arcsec²\].
    pub limit_mag_arcsec2: f64,
    /// Limit over a pixel \[mag/arcsec²\].
    pub limit_pixel_mag_arcsec2: f64,
    /// Limit over the whole trail \[mag/arcsec²\].
    pub limit_trail_mag_arcsec2: f64,
    /// Verdict as published.
    pub detected_published: String,
    /// Verdict corrected, by the square arcsecond.
    pub detected_corrected: String,
    /// Verdict corrected, by the whole trail.
    pub detected_trail: String,
    /// Electrons of the satellite in the brightest pixel.
    pub peak_pixel_e: Option<f64>,
    /// Those over what a pixel holds, the sky's with them.
    pub peak_frac_sat: Option<f64>,
    /// `yes` where that is above 1.
    pub saturated: String,
}

const fn number(name: &'static str, unit: &'static str, description: &'static str) -> Column {
    Column { name, unit, datatype: Datatype::Float64, description }
}
const fn text(name: &'static str, description: &'static str) -> Column {
    Column { name, unit: "", datatype: Datatype::Text, description }
}

/// Columns of `streak.ecsv`.
pub const STREAK: &[Column] = &[
    text("object_name", "name of the satellite"),
    text("mag_source", "where v_mag is from"),
    number("area_m2", "m2", "area of the satellite"),
    number("height_km", "km", "height of the orbit"),
    number("range_km", "km", "distance from the observer"),
    number("rate_deg_s", "deg / s", "angular rate against the stars"),
    text("rate_source", "where rate_deg_s is from"),
    number("v_mag", "mag", "V magnitude, tracked"),
    number(
        "mu_mag_arcsec2",
        "mag / arcsec2",
        "mean surface brightness while tracked, v_mag + 2.5 log10 of the solid angle",
    ),
    number("diameter_m", "m", "diameter of a disc of area_m2"),
    number("satellite_arcsec", "arcsec", "its angle"),
    number("defocus_arcsec", "arcsec", "angle of the telescope's mirror seen from the satellite"),
    number("fwhm_arcsec", "arcsec", "full width at half maximum of the seeing"),
    number("trail_width_arcsec", "arcsec", "width of the trail: the three before in quadrature"),
    number("trail_length_arcsec", "arcsec", "length of the trail in the field"),
    number("exptime_s", "s", "exposure time"),
    number("in_field_s", "s", "time the satellite is in the field, at most the exposure"),
    number("t_eff_s", "s", "trail_width_arcsec over the rate, at most the exposure"),
    number("t_eff_simple_s", "s", "2 sqrt(A/pi (R+h)/GM), in the zenith"),
    number("nu_published_mag_arcsec2", "mag / arcsec2", "effective surface brightness in V as published"),
    number("nu_corrected_mag_arcsec2", "mag / arcsec2", "effective surface brightness in V, corrected"),
    text("filter", "pass band of the survey"),
    number(
        "colour_mag",
        "mag",
        "magnitude in that band (AB) less V (Vega), added to nu_corrected before it is compared",
    ),
    number("limit_point_mag", "mag", "5-sigma limit of a point, the paper's"),
    number("limit_mag_arcsec2", "mag / arcsec2", "5-sigma limit over one square arcsecond"),
    number("limit_pixel_mag_arcsec2", "mag / arcsec2", "5-sigma limit over one pixel"),
    number("limit_trail_mag_arcsec2", "mag / arcsec2", "5-sigma limit over the whole trail, summed"),
    text("detected_published", "nu_published brighter than limit_point_mag, as the paper compares"),
    text("detected_corrected", "nu_corrected + colour_mag brighter than limit_mag_arcsec2"),
    text("detected_trail", "nu_corrected + colour_mag brighter than limit_trail_mag_arcsec2"),
    number("peak_pixel_e", "electron", "electrons of the satellite in the brightest pixel of the trail"),
    number("peak_frac_sat", "", "those and the sky's over the full well"),
    text("saturated", "yes where peak_frac_sat is above 1"),
];

/// Writes the table.
///
/// # Errors
/// [`crate::Error::Table`] naming row and column of a NaN or infinite number; [`crate::Error::Io`].
pub fn write_streak(path: &Path, rows: &[StreakRow], meta: &Meta) -> Result<()> {
    ecsv::write(path, rows, STREAK, meta)
}
