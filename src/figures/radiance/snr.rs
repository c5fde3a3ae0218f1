//! The table of signal over noise of an exposed picture, one row for each light or sum of lights.
//!
//! e⁻ and pure numbers. Leaves out: how they are computed, see [`crate::resolved::sensor::signal_to_noise`].

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::resolved::sensor::Snr;
use crate::tables::columns::{Column, integer, number, text};
use crate::tables::ecsv;
use crate::tables::meta::Meta;

/// Signal over noise of some lights.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SnrRow {
    /// The lights, joined by ` + `.
    pub lights: String,
    /// Electrons of these lights.
    pub signal_e: f64,
    /// Variance of a pixel without the satellite \[e⁻²\].
    pub variance_e2_px: f64,
    /// Of the brightest pixel.
    pub snr_pixel: f64,
    /// Of `n_px` pixels summed.
    pub snr_summed: f64,
    /// The fewest pixels that hold 90 % of all light.
    pub n_px: i64,
    /// With the best weights.
    pub snr_matched: f64,
    /// Pixels of the frame that are saturated: S/N takes no notice of what they lost.
    pub saturated_px: i64,
}

/// Columns of the table.
pub const SNR: &[Column] = &[
    text("lights", "the lights that shine"),
    number("signal_e", "electron", "electrons of these lights, all of them"),
    number("variance_e2_px", "electron2", "variance of a pixel without the satellite: sky, dark current, read noise"),
    number("snr_pixel", "", "S/N of the brightest pixel"),
    number("snr_summed", "", "S/N of n_px pixels summed"),
    integer("n_px", "fewest pixels that hold 90 % of the light of all lights"),
    number("snr_matched", "", "S/N with the best weights"),
    integer("saturated_px", "saturated pixels of the frame; above 0 every S/N of this table is too large"),
];

/// Rows of a frame with so many saturated pixels.
#[must_use]
pub fn snr_rows(found: &[Snr], saturated_px: usize) -> Vec<SnrRow> {
    let row = |r: &Snr| SnrRow {
        lights: r.lights.iter().map(|l| l.name()).collect::<Vec<_>>().join(" + "),
        signal_e: r.signal_e,
        variance_e2_px: r.variance_e2_px,
        snr_pixel: r.pixel,
        snr_summed: r.summed,
        n_px: r.n_px as i64,
        snr_matched: r.matched,
        saturated_px: saturated_px as i64,
    };
    found.iter().map(row).collect()
}

/// Writes the table.
///
/// # Errors
/// [`crate::Error::Table`] naming row and column of a NaN or infinite number; [`crate::Error::Io`].
pub fn write_snr(path: &Path, rows: &[SnrRow], meta: &Meta) -> Result<()> {
    ecsv::write_rows(path, rows, SNR, meta)
}
