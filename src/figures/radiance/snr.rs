//! The table of signal over noise of an exposed picture, one row for each light or sum of lights.
//!
//! e⁻ and pure numbers. It does not cover how they are computed, see [`crate::resolved::sensor::signal_to_noise`].

use crate::resolved::sensor::Snr;
use crate::tables::SnrRow;

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
