//! An image open for reading as ADU, whatever its BITPIX, scaling and compression.
//!
//! Rectangles of raw pixels in f32; BSCALE, BZERO and BLANK are applied here. It does not cover what the pixels mean
//! ([`super::load`], [`super::flat::master`]).

use std::path::Path;

use super::calibrate::decode;
use crate::base::error::Result;
use crate::fits::cards::{Green, Header};
use crate::fits::plain::Plain;
use crate::fits::stored::Stored;
use crate::fits::tall::{open_plain, open_stored};
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
    /// Superpixels of a colour sensor.
    Superpixels(Box<Superpixels>),
}

/// The green pixels of a colour sensor: of each square of 2 × 2 pixels the mean of the two.
pub(crate) struct Superpixels {
    stored: Pixels,
    green: Green,
    /// From here a single pixel is saturated \[ADU\].
    saturation_adu: f32,
    raw: Vec<f32>,
}

impl Superpixels {
    /// The mean of both green pixels; the brighter where it is saturated, so that the mean hides no saturation.
    fn read(&mut self, (x0, y0): (usize, usize), (nx, ny): (usize, usize), out: &mut [f32]) -> Result<()> {
        self.raw.resize(4 * nx * ny, 0.0);
        self.stored.read((2 * x0, 2 * y0), (2 * nx, 2 * ny), &mut self.raw)?;
        let [first, second] = match self.green {
            Green::Same => [0, 1],
            Green::Mixed => [1, 0],
        };
        for (rows, out) in self.raw.chunks_exact(4 * nx.max(1)).zip(out.chunks_exact_mut(nx.max(1))) {
            let (upper, lower) = rows.split_at(2 * nx);
            for ((a, b), out) in upper.chunks_exact(2).zip(lower.chunks_exact(2)).zip(out) {
                let (a, b) = (a[first], b[second]);
                *out = if a.max(b) >= self.saturation_adu && !a.is_nan() && !b.is_nan() {
                    a.max(b)
                } else {
                    0.5 * (a + b)
                };
            }
        }
        Ok(())
    }
}

impl Pixels {
    pub(crate) fn open(path: &Path, header: &Header) -> Result<Self> {
        if let Some(green) = header.green() {
            let stored = Self::open(path, &header.with_green(None))?;
            let saturation_adu = f32::from(u16::MAX);
            return Ok(Self::Superpixels(Box::new(Superpixels { stored, green, saturation_adu, raw: Vec::new() })));
        }
        if let Some(stored) = open_stored(path, header)? {
            return Ok(Self::Stored(stored, Vec::new()));
        }
        if let Some(plain) = open_plain(path, header)? {
            return Ok(Self::Plain(plain));
        }
        Ok(match header.is_compressed() {
            true => Self::Compressed(Box::new(Tiles::open(path, header)?)),
            false => Self::Plain(Plain::open(path, header)?),
        })
    }

    /// The same, where a pixel is saturated from this level on \[ADU\].
    pub(crate) fn saturated_at(mut self, level_adu: f64) -> Self {
        if let Self::Superpixels(image) = &mut self {
            image.saturation_adu = level_adu as f32;
        }
        self
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
            Self::Superpixels(image) => image.read(origin_px, size_px, out),
        }
    }
}
