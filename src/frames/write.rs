//! FITS files out: u16 images (plain or Rice-compressed) and f32 images, with their cards, written atomically.
//!
//! A file appears under its name only when it is complete. Used by the simulator and the master flat. Leaves out tables.

use std::path::{Path, PathBuf};

use ndarray::Array2;

use super::raw::{self, Pixels};
use crate::error::{Error, Result};

/// The value of a card to be written. A `Text` under the keyword HISTORY or COMMENT becomes such lines.
#[derive(Debug, Clone, PartialEq)]
pub enum CardValue {
    /// A string, of any length.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A finite real number, written so that it reads back exactly.
    Real(f64),
    /// T or F.
    Logical(bool),
}

/// Writes raw counts as 16-bit integers with BZERO = 32768; `compress` makes a Rice tile-compressed extension.
///
/// Shape (ny, nx). An existing file is replaced, never half-written.
///
/// # Errors
/// [`Error::Fits`] or [`Error::Io`]; a card that is not finite is refused.
pub fn write_u16(
    path: &Path,
    pixels: &Array2<u16>,
    cards: &[(String, CardValue, String)],
    compress: bool,
) -> Result<()> {
    let pixels = pixels.as_standard_layout();
    let (ny, nx) = pixels.dim();
    write(path, &Pixels::U16(pixels.as_slice().unwrap_or(&[])), (nx, ny), cards, compress)
}

/// Writes 32-bit floats; NaN is kept.
///
/// Shape (ny, nx). An existing file is replaced, never half-written.
///
/// # Errors
/// As [`write_u16`].
pub fn write_f32(path: &Path, pixels: &Array2<f32>, cards: &[(String, CardValue, String)]) -> Result<()> {
    let pixels = pixels.as_standard_layout();
    let (ny, nx) = pixels.dim();
    write(path, &Pixels::F32(pixels.as_slice().unwrap_or(&[])), (nx, ny), cards, false)
}

fn write(
    path: &Path,
    pixels: &Pixels<'_>,
    size_px: (usize, usize),
    cards: &[(String, CardValue, String)],
    compress: bool,
) -> Result<()> {
    for (key, value, _) in cards {
        if matches!(value, CardValue::Real(v) if !v.is_finite()) {
            return Err(Error::Fits {
                path: path.to_path_buf(),
                problem: format!("card {key} is not a finite number"),
            });
        }
    }
    let temporary = temporary(path)?;
    let written = raw::guarded(path, || raw::write_image(&temporary, pixels, size_px, cards, compress))
        .and_then(|()| std::fs::rename(&temporary, path).map_err(|e| Error::io(path, e)));
    if written.is_err() {
        // The error being reported matters more than a leftover.
        std::fs::remove_file(&temporary).ok();
    }
    written
}

/// A hidden name beside `path`, free of an earlier run's leftover.
fn temporary(path: &Path) -> Result<PathBuf> {
    let name = path.file_name().and_then(|n| n.to_str());
    let name = name.ok_or_else(|| Error::Fits { path: path.to_path_buf(), problem: "not a UTF-8 file name".into() })?;
    let temporary = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
    match std::fs::remove_file(&temporary) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(&temporary, e)),
        _ => Ok(temporary),
    }
}
