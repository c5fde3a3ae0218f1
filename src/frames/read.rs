//! An image open for reading as ADU, whatever its BITPIX, scaling and compression.
//!
//! Rectangles of raw pixels in f32; BSCALE, BZERO and BLANK are applied here. It does not cover what the pixels mean
//! ([`super::load`], [`super::flat::master`]).

use std::path::Path;

use super::calibrate::decode;
use crate::base::error::Result;
use crate::fits::cards::Header;
use crate::fits::plain::Plain;
use crate::fits::stored::Stored;
use crate::fits::tiles::Tiles;

/// Rows read at a time: a tile of a full-size frame stays near 2 MB.
pub(crate) const TILE_ROWS: usize = 64;

/// An image open for reading as f32, whatever its BITPIX.
pub(crate) enum Pixels {
    /// Plain unsigned 16 bit: exact in f32.
    Stored(Stored, Vec<u8>),
    /// Every other uncompressed image.
    Plain(Plain),
    /// Tile-compressed.
    Compressed(Box<Tiles>),
}

impl Pixels {
    pub(crate) fn open(path: &Path, header: &Header) -> Result<Self> {
        if header.is_compressed() {
            return Ok(Self::Compressed(Box::new(Tiles::open(path, header)?)));
        }
        Ok(match Stored::open(path, header)? {
            Some(stored) => Self::Stored(stored, Vec::new()),
            None => Self::Plain(Plain::open(path, header)?),
        })
    }

    /// Fills `out` with the rectangle at `origin_px` of `size_px`; BLANK becomes NaN.
    pub(crate) fn read(&mut self, origin_px: (usize, usize), size_px: (usize, usize), out: &mut [f32]) -> Result<()> {
        match self {
            Self::Stored(stored, bytes) => {
                stored.read(origin_px, size_px, bytes)?;
                decode(bytes.as_chunks().0, out);
                Ok(())
            }
            Self::Plain(image) => image.read(origin_px, size_px, out),
            Self::Compressed(image) => image.read(origin_px, size_px, out),
        }
    }
}
