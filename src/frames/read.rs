//! An image open for reading as ADU, whatever its BITPIX, scaling and compression.
//!
//! Rectangles of raw pixels in f32; BSCALE, BZERO and BLANK are applied here. Leaves out what the pixels mean
//! ([`super::load`], [`super::flat`]).

use std::path::Path;

use super::calibrate::decode;
use super::cards::Header;
use super::raw::OpenImage;
use super::stored::Stored;
use crate::error::Result;

/// Rows read at a time: a tile of a full-size frame stays near 2 MB.
pub(super) const TILE_ROWS: usize = 64;

/// An image open for reading as f32, whatever its BITPIX.
pub(super) enum Pixels<'a> {
    /// Plain unsigned 16 bit: exact in f32, read without the library.
    Stored(Stored, Vec<u8>),
    /// 32 and 64 bit go through f64, so that large values neither overflow nor collide with BLANK.
    Wide(OpenImage<'a>, Vec<f64>),
    /// The same counts, compressed: the library's quickest path.
    Compressed(OpenImage<'a>, Vec<u16>),
    /// The rest is converted by the library.
    Plain(OpenImage<'a>),
}

impl<'a> Pixels<'a> {
    pub(super) fn open(path: &'a Path, header: &Header) -> Result<Self> {
        if let Some(stored) = Stored::open(path, header)? {
            return Ok(Self::Stored(stored, Vec::new()));
        }
        let image = OpenImage::open(path, header)?;
        Ok(match header.bitpix() {
            32 | 64 | -64 => Self::Wide(image, Vec::new()),
            16 if Stored::counts(header) => Self::Compressed(image, Vec::new()),
            _ => Self::Plain(image),
        })
    }

    /// Fills `out` with the rectangle at `origin_px` of `size_px`; BLANK becomes NaN.
    pub(super) fn read(&mut self, origin_px: (usize, usize), size_px: (usize, usize), out: &mut [f32]) -> Result<()> {
        match self {
            Self::Plain(image) => image.read(origin_px, size_px, out)?,
            Self::Stored(stored, bytes) => {
                stored.read(origin_px, size_px, bytes)?;
                decode(bytes.as_chunks().0, out);
            }
            Self::Compressed(image, buffer) => {
                buffer.resize(out.len(), 0);
                image.read(origin_px, size_px, buffer)?;
                out.iter_mut().zip(buffer).for_each(|(to, from)| *to = f32::from(*from));
            }
            Self::Wide(image, buffer) => {
                buffer.resize(out.len(), 0.0);
                image.read(origin_px, size_px, buffer)?;
                out.iter_mut().zip(buffer).for_each(|(to, from)| *to = *from as f32);
            }
        }
        Ok(())
    }
}
