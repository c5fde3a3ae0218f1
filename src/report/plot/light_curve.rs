//! Being drawn.
use crate::error::Result;
use crate::report::rows::PhotometryRow;
use std::path::Path;
use std::path::PathBuf;
/// Draws.
pub fn light_curve(path: &Path, rows: &[PhotometryRow], title: &str) -> Result<()> {
    let _ = rows;
    super::canvas::no_data(path, (960, 640), title, "")
}
/// x
pub fn light_curves(dir: &Path, rows: &[PhotometryRow], title: &str) -> Result<Vec<PathBuf>> {
    let _ = (dir, rows, title);
    Ok(Vec::new())
}
