//! Tables beside the paper: its numbers and ours, its passes checked, brightness by light class.
//!
//! One struct per table, one field per column, same name and order. Units are those of the column; `None` is an empty cell.

use std::path::Path;

use serde::Serialize;

use crate::base::error::Result;
use crate::tables::columns::{Column, integer, number, text};
use crate::tables::ecsv::write;
use crate::tables::meta::Meta;

/// Columns of the table of published numbers; values are in the unit of the row.
const PUBLISHED: &[Column] = &[
    text("id", "name of the row"),
    text("place", "where in the paper"),
    text("quantity", "what it is"),
    text("unit", "unit of the values of this row; empty for a pure number"),
    text("printed", "as the paper prints it"),
    number("published", "", "the same as a number"),
    number("as_published", "", "computed by the formula and the inputs of the paper"),
    number("corrected", "", "computed as the physics asks"),
    text(
        "rule",
        "kind of number, by which it is judged: digits, about, count, ...; empty for a row that is not judged",
    ),
    number(
        "tolerance",
        "",
        "how far it may be from what it is held against, in the unit of the row; 0 for counts and bounds",
    ),
    text("verdict", "reproduced, with an assumption, not reproduced, literature, beside the paper, not computed"),
    text("why", "why they differ, what was assumed, or the source"),
];

/// One published number.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PublishedRow {
    /// Name of the row.
    pub id: String,
    /// Where in the paper.
    pub place: String,
    /// What it is.
    pub quantity: String,
    /// Unit of the values.
    pub unit: String,
    /// As printed.
    pub printed: String,
    /// The same as a number.
    pub published: Option<f64>,
    /// By the formula and the inputs of the paper.
    pub as_published: Option<f64>,
    /// As the physics asks.
    pub corrected: Option<f64>,
    /// The rule it is judged by.
    pub rule: String,
    /// How far it may be off.
    pub tolerance: Option<f64>,
    /// What is to be thought of it.
    pub verdict: String,
    /// Why.
    pub why: String,
}

/// Columns of checked passes.
pub const CHECKED: &[Column] = &[
    integer("line", "line in the file that was checked"),
    text("time", "date and time as stated"),
    text("date_utc", "the same in UTC, ISO 8601"),
    text("target", "satellite as stated"),
    text("verdict", "agrees, agrees (sky only), differs, cannot be true"),
    number("stated_sun_alt_deg", "deg", "altitude of the Sun as stated"),
    number("sun_alt_deg", "deg", "altitude of the Sun at the stated time, without refraction"),
    number("stated_moon_illum_pct", "%", "illuminated fraction of the lunar disc as stated"),
    number("moon_illum_pct", "%", "illuminated fraction of the lunar disc"),
    number("moon_alt_deg", "deg", "altitude of the Moon, without refraction"),
    number("moon_phase_deg", "deg", "phase angle of the Moon (0 = full)"),
    number("moon_v_mag", "mag", "V of the Moon at that phase and mean distance (Cox 2002)"),
    number("alt_deg", "deg", "altitude of the satellite at the stated time"),
    text("pass_utc", "culmination of the pass at the stated time, else of the nearest one"),
    number("pass_alt_deg", "deg", "altitude of that culmination"),
    number("pass_range_km", "km", "range there"),
    text("stated_label", "light class as stated"),
    text("paper_label", "light class of the pass from geometry, as Caddy et al. label it"),
    text("remarks", "what does not agree, and what could not be checked"),
    text("remedy", "what would make the row true"),
];

/// One checked pass.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct CheckedRow {
    /// Line in the file.
    pub line: i64,
    /// Date and time as stated.
    pub time: String,
    /// The same in UTC.
    pub date_utc: String,
    /// Satellite as stated.
    pub target: String,
    /// Verdict.
    pub verdict: String,
    /// Altitude of the Sun as stated \[deg\].
    pub stated_sun_alt_deg: Option<f64>,
    /// Altitude of the Sun \[deg\].
    pub sun_alt_deg: f64,
    /// Lit share of the Moon as stated \[%\].
    pub stated_moon_illum_pct: Option<f64>,
    /// Lit share of the Moon \[%\].
    pub moon_illum_pct: f64,
    /// Altitude of the Moon \[deg\].
    pub moon_alt_deg: f64,
    /// Phase angle of the Moon \[deg\].
    pub moon_phase_deg: f64,
    /// V of the Moon \[mag\].
    pub moon_v_mag: f64,
    /// Altitude of the satellite at the stated time \[deg\].
    pub alt_deg: Option<f64>,
    /// Culmination of the pass at the stated time, else of the nearest one.
    pub pass_utc: String,
    /// Its altitude \[deg\].
    pub pass_alt_deg: Option<f64>,
    /// Its range \[km\].
    pub pass_range_km: Option<f64>,
    /// Light class as stated.
    pub stated_label: String,
    /// Light class of the pass.
    pub paper_label: String,
    /// What does not agree.
    pub remarks: String,
    /// What would make it true.
    pub remedy: String,
}

/// Columns of brightness by light class.
pub const LABELS: &[Column] = &[
    text("paper_label", "day, twilight or night, as Caddy et al. label a pass"),
    text("light", "sources of light, as they word it"),
    integer("n", "magnitudes"),
    number("median_v_mag", "mag", "their median"),
    number("std_v_mag", "mag", "their standard deviation"),
    integer("n_by_frame", "magnitudes when every frame has its own label, not that of its pass"),
    number("median_by_frame_v_mag", "mag", "their median"),
    integer("published_n", "magnitudes in the paper, all of the ISS"),
    number("published_median_v_mag", "mag", "median in the paper"),
    number("published_std_v_mag", "mag", "standard deviation in the paper"),
];

/// Brightness of one light class.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LabelRow {
    /// Light class.
    pub paper_label: String,
    /// Sources of light.
    pub light: String,
    /// Magnitudes.
    pub n: i64,
    /// Their median \[mag\].
    pub median_v_mag: Option<f64>,
    /// Their standard deviation \[mag\].
    pub std_v_mag: Option<f64>,
    /// Magnitudes labelled frame by frame.
    pub n_by_frame: i64,
    /// Their median \[mag\].
    pub median_by_frame_v_mag: Option<f64>,
    /// Magnitudes in the paper.
    pub published_n: i64,
    /// Median in the paper \[mag\].
    pub published_median_v_mag: f64,
    /// Standard deviation in the paper \[mag\].
    pub published_std_v_mag: f64,
}

/// Writes the table of published numbers.
///
/// # Errors
/// As [`crate::tables::write_photometry`].
pub fn write_published(path: &Path, rows: &[PublishedRow], meta: &Meta) -> Result<()> {
    write(path, rows, PUBLISHED, meta)
}

/// Writes checked passes.
///
/// # Errors
/// As [`crate::tables::write_photometry`].
pub fn write_checked(path: &Path, rows: &[CheckedRow], meta: &Meta) -> Result<()> {
    write(path, rows, CHECKED, meta)
}

/// Writes brightness by light class.
///
/// # Errors
/// As [`crate::tables::write_photometry`].
pub fn write_labels(path: &Path, rows: &[LabelRow], meta: &Meta) -> Result<()> {
    write(path, rows, LABELS, meta)
}
