//! From a file to a frame: only the box of the clip circle, in row tiles, with every untrustworthy pixel marked.
//!
//! Pixels in ADU, then electrons. BSCALE, BZERO and BLANK are applied here; the flat and the clip follow as steps of their own.

use std::marker::PhantomData;
use std::path::Path;

use ndarray::Array2;

use super::cards::Header;
use super::clip::Region;
use super::exposure::Exposure;
use super::flat::MasterFlat;
use super::frame::{Adu, Electrons, Frame, Gain, mask};
use super::raw::{OpenImage, guarded};
use crate::error::{Error, Result};

/// Rows read at a time: a tile of a full-size frame stays near 2 MB.
pub(super) const TILE_ROWS: usize = 64;

/// An image open for reading as f32, whatever its BITPIX.
pub(super) struct Pixels<'a> {
    image: OpenImage<'a>,
    storage: Storage,
}

/// How the file holds its pixels, and so which type is read fastest without loss.
enum Storage {
    /// Unsigned 16 bit: exact in f32, and the library's quickest path.
    U16(Vec<u16>),
    /// 32 and 64 bit go through f64, so that large values neither overflow nor collide with BLANK.
    Wide(Vec<f64>),
    /// The rest is converted by the library.
    Plain,
}

impl<'a> Pixels<'a> {
    pub(super) fn open(path: &'a Path, header: &Header) -> Result<Self> {
        let unsigned = header.bitpix() == 16
            && header.number("BZERO") == Some(32768.0)
            && header.number("BSCALE").unwrap_or(1.0) == 1.0
            && ["BLANK", "ZBLANK"].iter().all(|k| header.card(k).is_none());
        let storage = match header.bitpix() {
            16 if unsigned => Storage::U16(Vec::new()),
            32 | 64 | -64 => Storage::Wide(Vec::new()),
            _ => Storage::Plain,
        };
        Ok(Self { image: OpenImage::open(path, header)?, storage })
    }

    /// Fills `out` with the rectangle at `origin_px` of `size_px`; BLANK becomes NaN.
    pub(super) fn read(&mut self, origin_px: (usize, usize), size_px: (usize, usize), out: &mut [f32]) -> Result<()> {
        match &mut self.storage {
            Storage::Plain => self.image.read(origin_px, size_px, out)?,
            Storage::U16(buffer) => {
                buffer.resize(out.len(), 0);
                self.image.read(origin_px, size_px, buffer)?;
                out.iter_mut().zip(buffer).for_each(|(to, from)| *to = f32::from(*from));
            }
            Storage::Wide(buffer) => {
                buffer.resize(out.len(), 0.0);
                self.image.read(origin_px, size_px, buffer)?;
                out.iter_mut().zip(buffer).for_each(|(to, from)| *to = *from as f32);
            }
        }
        Ok(())
    }
}

/// Reads the part of a frame that lies in the box of the clip circle.
///
/// The circle is centred on ((nx−1)/2, (ny−1)/2). Shape (ny, nx) of the box, ADU. NaN, infinite and BLANK pixels are
/// NaN and BAD, pixels at or above `gain.saturation_adu` are SATURATED. Pixels in the corners of the box are not yet
/// marked: see [`Frame::clipped`].
///
/// # Errors
/// [`Error::Fits`] if the file is damaged or has changed since it was classified.
pub fn read(exposure: &Exposure, gain: Gain, clip_radius_px: Option<f64>) -> Result<Frame<Adu>> {
    let path = &exposure.path;
    let region = Region::new(exposure.size_px, clip_radius_px);
    let (nx, ny) = region.size_px;
    let fits = |problem: String| Error::Fits { path: path.clone(), problem };
    if exposure.size_px.0 == 0 || exposure.size_px.1 == 0 {
        return Err(fits("no image in the header".into()));
    }
    let mut values = vec![0f32; nx * ny];
    guarded(path, || {
        let mut pixels = Pixels::open(path, &exposure.header)?;
        for (tile, out) in values.chunks_mut(nx * TILE_ROWS).enumerate() {
            let origin = (region.origin_px.0, region.origin_px.1 + tile * TILE_ROWS);
            pixels.read(origin, (nx, out.len() / nx), out)?;
        }
        Ok(())
    })?;
    let saturation_adu = gain.saturation_adu as f32;
    let mut bits = vec![0u8; nx * ny];
    for (value, bit) in values.iter_mut().zip(&mut bits) {
        if !value.is_finite() {
            *value = f32::NAN;
            *bit = mask::BAD;
        } else if *value >= saturation_adu {
            *bit = mask::SATURATED;
        }
    }
    let shaped = |e: ndarray::ShapeError| fits(e.to_string());
    Ok(Frame {
        path: path.clone(),
        pixels: Array2::from_shape_vec((ny, nx), values).map_err(shaped)?,
        mask: Array2::from_shape_vec((ny, nx), bits).map_err(shaped)?,
        origin_px: region.origin_px,
        full_size_px: region.full_size_px,
        gain,
        unit: PhantomData,
    })
}

impl Frame<Adu> {
    /// Converts raw counts to photo-electrons at the gain this frame was taken with.
    ///
    /// N_e = g (N_adu − pedestal). Consumes the frame, so it cannot run twice. Masked pixels stay masked.
    #[must_use]
    pub fn into_electrons(mut self) -> Frame<Electrons> {
        let (e_per_adu, pedestal_adu) = (self.gain.e_per_adu.0, self.gain.pedestal_adu);
        self.pixels.mapv_inplace(|n_adu| (e_per_adu * (f64::from(n_adu) - pedestal_adu)) as f32);
        Frame {
            path: self.path,
            pixels: self.pixels,
            mask: self.mask,
            origin_px: self.origin_px,
            full_size_px: self.full_size_px,
            gain: self.gain,
            unit: PhantomData,
        }
    }
}

impl Frame<Electrons> {
    /// Divides by the master flat: N = N_e / F.
    ///
    /// Where the flat is masked the pixel is marked BAD and not divided.
    ///
    /// # Errors
    /// [`Error::Flat`] if the flat is of another detector size, or does not cover this frame.
    pub fn flattened(mut self, flat: &MasterFlat) -> Result<Self> {
        let (ny, nx) = self.pixels.dim();
        let (flat_ny, flat_nx) = flat.response.dim();
        let offset = (
            self.origin_px.0.checked_sub(flat.origin_px.0).filter(|x| x + nx <= flat_nx),
            self.origin_px.1.checked_sub(flat.origin_px.1).filter(|y| y + ny <= flat_ny),
        );
        let (Some(x0), Some(y0), true) = (offset.0, offset.1, self.full_size_px == flat.full_size_px) else {
            let problem = format!(
                "{} is {}x{} px, of which {nx}x{ny} at ({}, {}) are used; the master flat is {}x{} px with {flat_nx}x{flat_ny} \
                 at ({}, {}): take flats with the same binning, read-out and clip radius",
                self.path.display(),
                self.full_size_px.0,
                self.full_size_px.1,
                self.origin_px.0,
                self.origin_px.1,
                flat.full_size_px.0,
                flat.full_size_px.1,
                flat.origin_px.0,
                flat.origin_px.1
            );
            return Err(Error::Flat { problem });
        };
        let part = ndarray::s![y0..y0 + ny, x0..x0 + nx];
        ndarray::Zip::from(&mut self.pixels)
            .and(&mut self.mask)
            .and(flat.response.slice(part))
            .and(flat.mask.slice(part))
            .for_each(|pixel, bits, response, flat_bits| {
                if *flat_bits == 0 {
                    *pixel /= *response;
                } else {
                    *bits |= mask::BAD;
                }
            });
        Ok(self)
    }

    /// Marks every pixel outside the circle around the detector's centre as CLIPPED.
    #[must_use]
    pub fn clipped(mut self, radius_px: f64) -> Self {
        let (ny, nx) = self.pixels.dim();
        let region = Region {
            origin_px: self.origin_px,
            size_px: (nx, ny),
            full_size_px: self.full_size_px,
            radius_px: Some(radius_px),
        };
        for (j, mut row) in self.mask.outer_iter_mut().enumerate() {
            let inside = region.inside(j);
            for (i, bits) in row.iter_mut().enumerate() {
                if !inside.contains(&i) {
                    *bits |= mask::CLIPPED;
                }
            }
        }
        self
    }

    /// Whether no pixel can be used: all are BAD or CLIPPED.
    #[must_use]
    pub fn all_bad(&self) -> bool {
        self.mask.iter().all(|bits| bits & (mask::BAD | mask::CLIPPED) != 0)
    }
}
