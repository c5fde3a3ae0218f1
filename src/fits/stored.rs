//! Unsigned 16-bit pixels as a file holds them, read without the FITS library: most frames and flats of a night.
//!
//! Such an image is big-endian i16 with BZERO = 32768 (FITS 4.0 section 5.2.5), row after row from a place the scan has
//! checked against the file's length. In order of size the stored values are the counts. Compressed images are in
//! [`super::tiles`], every other BITPIX in [`super::plain`].

use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cards::Header;
use super::open::open;
use crate::base::error::{Error, Result};

/// Bytes of a pixel.
pub(crate) const PIXEL_BYTES: usize = 2;

/// What is wrong with a file that ends before its pixels do, though its header was found to be true.
pub(crate) const SHORTER: &str = "the file became shorter since its header was read";

/// An image of plain unsigned 16-bit pixels.
#[derive(Debug)]
pub(crate) struct Stored {
    file: Arc<File>,
    path: PathBuf,
    data_at: u64,
    size_px: (usize, usize),
}

impl Stored {
    /// Whether the image `header` was scanned from holds unsigned 16-bit counts, compressed or not, and is read pixel by pixel.
    pub(crate) fn counts(header: &Header) -> bool {
        header.bitpix() == 16
            && header.green().is_none()
            && header.number("BZERO") == Some(32768.0)
            && header.number("BSCALE").unwrap_or(1.0) == 1.0
            && ["BLANK", "ZBLANK"].iter().all(|k| header.card(k).is_none())
    }

    /// Opens the image; `None` if it is compressed or holds anything else.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Fits`] if the file has become shorter since it was scanned.
    pub(crate) fn open(path: &Path, header: &Header) -> Result<Option<Self>> {
        let plain = Self::counts(header) && !header.is_compressed();
        let Some(data_at) = header.data_at().filter(|_| plain) else { return Ok(None) };
        let file = open(path)?;
        let (nx, ny) = header.size_px();
        let bytes = file.metadata().map_err(|e| Error::io(path, e))?.len();
        if bytes < data_at + (nx * ny * PIXEL_BYTES) as u64 {
            return Err(Error::Fits { path: path.to_path_buf(), problem: SHORTER.into() });
        }
        Ok(Some(Self { file: Arc::new(file), path: path.to_path_buf(), data_at, size_px: (nx, ny) }))
    }

    /// Counts that were decoded into a file of their own, from its first byte on.
    pub(crate) fn of_counts(file: Arc<File>, path: &Path, size_px: (usize, usize)) -> Self {
        Self { file, path: path.to_path_buf(), data_at: 0, size_px }
    }

    /// Reads the stored bytes of columns `columns` of row `row` (0-based): two per pixel, the higher first.
    ///
    /// # Errors
    /// [`Error::Fits`] if the pixels are outside the image, or the file has become shorter since it was scanned.
    pub(crate) fn read_span(&self, row: usize, columns: Range<usize>, bytes: &mut [u8]) -> Result<()> {
        let (nx, ny) = self.size_px;
        if columns.end > nx || row >= ny || bytes.len() != columns.len() * PIXEL_BYTES {
            let problem = format!("requested columns {columns:?} of row {row} of {nx}x{ny}");
            return Err(Error::Fits { path: self.path.clone(), problem });
        }
        self.read_from(row * nx + columns.start, bytes)
    }

    /// Reads the stored bytes of the rectangle at `origin_px` of `size_px`, row by row; whole rows in one piece.
    ///
    /// # Errors
    /// Those of [`Stored::read_span`].
    pub(crate) fn read(&self, (x0, y0): (usize, usize), (nx, ny): (usize, usize), bytes: &mut Vec<u8>) -> Result<()> {
        bytes.resize(nx * ny * PIXEL_BYTES, 0);
        if nx == 0 {
            return Ok(());
        }
        if nx == self.size_px.0 && y0 + ny <= self.size_px.1 {
            return self.read_from(y0 * nx, bytes);
        }
        for (j, row) in bytes.chunks_exact_mut(nx * PIXEL_BYTES).enumerate() {
            self.read_span(y0 + j, x0..x0 + nx, row)?;
        }
        Ok(())
    }

    /// Fills `bytes` from a pixel counted from the first one of the image.
    fn read_from(&self, pixel: usize, bytes: &mut [u8]) -> Result<()> {
        let at = self.data_at + (pixel * PIXEL_BYTES) as u64;
        read_exact_at(&self.file, bytes, at).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => Error::Fits { path: self.path.clone(), problem: SHORTER.into() },
            _ => Error::io(&self.path, e),
        })
    }
}

/// The count a stored pixel stands for: i16 + 32768, which turns its highest bit over.
#[inline(always)]
pub(crate) fn count(bytes: [u8; PIXEL_BYTES]) -> u16 {
    u16::from_be_bytes(bytes) ^ 0x8000
}

/// Reads at a place of the file without moving its position, so that threads may share it.
#[cfg(unix)]
pub(crate) fn read_exact_at(file: &File, bytes: &mut [u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, at)
}

#[cfg(windows)]
pub(crate) fn read_exact_at(file: &File, mut bytes: &mut [u8], mut at: u64) -> std::io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, bytes, at)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            n => (bytes, at) = (&mut bytes[n..], at + n as u64),
        }
    }
    Ok(())
}
