//! FITS files out: u16 images (plain or Rice-compressed) and f32 images, with their cards, written atomically.
//!
//! A file appears under its name only when it is complete. Used by the simulator and the master flat. It does not cover
//! tables.

use super::card_value::CardValue;
use std::path::Path;

use ndarray::Array2;

use super::raw;
use super::raw::Pixels;
use crate::base::error::{Error, Result};
use crate::base::file::write_by_path;

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
    // compressed, nothing is known of its size but that of two blocks
    let bytes_per_px = match pixels {
        Pixels::U16(_) => 2,
        Pixels::F32(_) => 4,
    };
    let least = if compress { 5_760 } else { 2_880 + (size_px.0 * size_px.1 * bytes_per_px) as u64 };
    write_by_path(path, least, |temporary| {
        raw::guarded(path, || raw::write_image(temporary, pixels, size_px, cards, compress))
    })
}
