//! Being drawn.
use std::path::Path;

use crate::error::Result;
use crate::report::rows::StarRow;
/// Draws.
pub fn zeropoint_diagnostics(path: &Path, rows: &[StarRow], zp: f64, k: f64, c: f64) -> Result<()> {
    let _ = (rows, zp, k, c);
    super::canvas::no_data(path, (960, 640), "", "")
}
