//! FITS files out: u16 images (plain or Rice-compressed) and f32 images, with their cards, written atomically.
//!
//! A file appears under its name only when it is complete. Used by the simulator and the master flat; the pictures and
//! tables of other programs go through [`write_hdus`].

use std::path::Path;

use ndarray::Array2;

use super::card_value::CardLine;
use super::raw::{self, NewFits, Pixels};
use crate::base::error::Result;
use crate::base::file::write_by_path;

/// Writes raw counts as 16-bit integers with BZERO = 32768; `compress` makes a Rice tile-compressed extension.
///
/// Shape (ny, nx). An existing file is replaced, never half-written.
///
/// # Errors
/// [`crate::Error::Fits`] or [`crate::Error::Io`]; a card that is not finite is refused.
pub fn write_u16(path: &Path, pixels: &Array2<u16>, cards: &[CardLine], compress: bool) -> Result<()> {
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
pub fn write_f32(path: &Path, pixels: &Array2<f32>, cards: &[CardLine]) -> Result<()> {
    let pixels = pixels.as_standard_layout();
    let (ny, nx) = pixels.dim();
    write(path, &Pixels::F32(pixels.as_slice().unwrap_or(&[])), (nx, ny), cards, false)
}

fn write(path: &Path, pixels: &Pixels<'_>, size_px: (usize, usize), cards: &[CardLine], compress: bool) -> Result<()> {
    // compressed, nothing is known of its size but that of two blocks
    let bytes_per_px = match pixels {
        Pixels::U16(_) => 2,
        Pixels::F32(_) => 4,
        Pixels::F64(_) => 8,
    };
    let least = if compress { 5_760 } else { 2_880 + (size_px.0 * size_px.1 * bytes_per_px) as u64 };
    write_by_path(path, least, |temporary| {
        raw::guarded(path, || NewFits::create(temporary)?.image(pixels, size_px, cards, compress))
    })
}

/// Writes a file of several HDUs, each completed by [`NewFits::checksum`].
///
/// # Errors
/// [`crate::Error::Fits`] or [`crate::Error::Io`].
pub(crate) fn write_hdus(path: &Path, fill: impl FnOnce(&mut NewFits) -> Result<()>) -> Result<()> {
    write_by_path(path, 2_880, |temporary| raw::guarded(path, || fill(&mut NewFits::create(temporary)?)))
}
