//! Being drawn.
use std::path::Path;

use crate::error::Result;
use crate::report::rows::ResidualRow;
/// Draws.
pub fn residuals_altitude(path: &Path, rows: &[ResidualRow]) -> Result<()> {
    let _ = rows;
    super::canvas::no_data(path, (960, 640), "", "")
}
