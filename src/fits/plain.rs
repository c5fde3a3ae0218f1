//! Uncompressed pixels of any BITPIX, read from the place the scan has checked against the file's length.
//!
//! ADU as f32: 64-bit numbers go through f64; BLANK, NaN and infinite values are NaN. Unsigned 16-bit counts have a shorter
//! way ([`super::stored`]).

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cards::Header;
use super::linear::{Linear, finite};
use super::open::open;
use super::stored::{SHORTER, read_exact_at};
use crate::base::error::{Error, Result};

/// An uncompressed image.
pub(crate) struct Plain {
    file: Arc<File>,
    path: PathBuf,
    data_at: u64,
    size_px: (usize, usize),
    bitpix: i64,
    linear: Linear,
    bytes: Vec<u8>,
}

impl Plain {
    /// Opens the image that `header` was scanned from.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Fits`] for a scaling that cannot be meant, or no image.
    pub(crate) fn open(path: &Path, header: &Header) -> Result<Self> {
        let bad = |problem: String| Error::Fits { path: path.to_path_buf(), problem };
        let data_at = header.data_at().ok_or_else(|| bad("no image in the header".into()))?;
        let linear = Linear::of(header, "BLANK").map_err(bad)?;
        let file = open(path)?;
        let (size_px, bitpix) = (header.size_px(), header.bitpix());
        Ok(Self { file: Arc::new(file), path: path.to_path_buf(), data_at, size_px, bitpix, linear, bytes: Vec::new() })
    }

    /// Values that were decoded into a file of their own as f32, from its first byte on.
    pub(crate) fn of_f32(file: Arc<File>, path: &Path, size_px: (usize, usize)) -> Self {
        Self {
            file,
            path: path.to_path_buf(),
            data_at: 0,
            size_px,
            bitpix: -32,
            linear: Linear::UNIT,
            bytes: Vec::new(),
        }
    }

    /// Reads the rectangle at `origin_px` of `size_px` row by row into `out`; whole rows in one piece.
    ///
    /// # Errors
    /// [`Error::Fits`] if it does not lie in the image, or the file has become shorter since it was scanned.
    pub(crate) fn read(&mut self, (x0, y0): (usize, usize), (nx, ny): (usize, usize), out: &mut [f32]) -> Result<()> {
        let (full_nx, full_ny) = self.size_px;
        if out.len() != nx * ny || nx == 0 || ny == 0 || x0 + nx > full_nx || y0 + ny > full_ny {
            let problem = format!("requested {nx}x{ny} pixels at ({x0}, {y0}) of {full_nx}x{full_ny}");
            return Err(Error::Fits { path: self.path.clone(), problem });
        }
        let width = (self.bitpix.unsigned_abs() / 8) as usize;
        let pieces = if nx == full_nx { 1 } else { ny };
        let length = nx * ny / pieces;
        self.bytes.resize(length * width, 0);
        for (j, out) in out.chunks_exact_mut(length).enumerate() {
            let pixel = (y0 + j) as u64 * full_nx as u64 + x0 as u64;
            read_exact_at(&self.file, &mut self.bytes, self.data_at + pixel * width as u64).map_err(|e| {
                match e.kind() {
                    std::io::ErrorKind::UnexpectedEof => {
                        Error::Fits { path: self.path.clone(), problem: SHORTER.into() }
                    }
                    _ => Error::io(&self.path, e),
                }
            })?;
            convert(&self.bytes, self.bitpix, &self.linear, out);
        }
        Ok(())
    }
}

/// Big-endian numbers of one BITPIX to physical values.
pub(crate) fn convert(bytes: &[u8], bitpix: i64, linear: &Linear, out: &mut [f32]) {
    fn each<const N: usize>(bytes: &[u8], out: &mut [f32], value: impl Fn([u8; N]) -> f32) {
        out.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, from)| *to = value(*from));
    }
    match bitpix {
        8 => each(bytes, out, |[b]| linear.integer(i64::from(b))),
        16 => each(bytes, out, |b| linear.integer(i64::from(i16::from_be_bytes(b)))),
        32 => each(bytes, out, |b| linear.integer(i64::from(i32::from_be_bytes(b)))),
        64 => each(bytes, out, |b| linear.long(i64::from_be_bytes(b))),
        -32 if *linear == Linear::UNIT => each(bytes, out, |b| finite(f32::from_be_bytes(b))),
        -32 => each(bytes, out, |b| linear.real(f64::from(f32::from_be_bytes(b)))),
        _ => each(bytes, out, |b| linear.real(f64::from_be_bytes(b))),
    }
}
