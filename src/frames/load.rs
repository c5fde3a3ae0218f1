//! From a file to a frame in one pass: stored counts to flattened electrons, only where the clip circle lies.
//!
//! Electrons; positions in full-frame pixels. Rows are shared out over the threads of the pool, and each is unpacked,
//! calibrated and divided while it is in the cache. Memory of frames is used again ([`Buffers`]): fresh memory costs as
//! much time as all of the calibration. It does not cover the loops over pixels ([`super::calibrate`]).

use std::marker::PhantomData;
use std::ops::{Deref, Range};
use std::path::Path;
use std::sync::Mutex;

use ndarray::Array2;
use rayon::prelude::*;

use super::calibrate::{calibrate, calibrate_stored};
use super::clip::Region;
use super::exposure::Exposure;
use super::flat::master::MasterFlat;
use super::frame::{Electrons, Frame, Gain, mask};
use super::hot_pixels::HotPixels;
use super::overscan::{Section, sections};
use super::read::{Pixels, TILE_ROWS};
use super::zero_level::{HOT_READ_NOISES, ZeroLevel};
use crate::base::error::{Error, Result};
use crate::base::pages::zeros;
use crate::fits::raw::guarded;
use crate::fits::stored::{PIXEL_BYTES, Stored};
use crate::fits::tall::open_stored;

/// Memory of frames that are done, for the next ones. There are never more than frames were held at once.
#[derive(Debug, Default)]
pub struct Buffers(Mutex<Vec<(Vec<f32>, Vec<u8>)>>);

impl Buffers {
    fn take(&self, path: &Path, len: usize) -> Result<(Vec<f32>, Vec<u8>)> {
        let used = self.0.lock().ok().and_then(|mut pool| {
            // large enough, and not so large that a larger frame will miss it
            let fits = |(pixels, _): &(Vec<f32>, Vec<u8>)| (len..=4 * len).contains(&pixels.capacity());
            pool.iter().position(fits).map(|k| pool.swap_remove(k))
        });
        let Some((mut pixels, mut bits)) = used else { return Ok((zeros(path, len)?, zeros(path, len)?)) };
        pixels.resize(len, 0.0);
        bits.resize(len, 0);
        Ok((pixels, bits))
    }

    /// Frees what is not in use: the next frames are of another size.
    pub fn clear(&self) {
        if let Ok(mut pool) = self.0.lock() {
            pool.clear();
        }
    }
}

/// A frame whose memory goes back to its [`Buffers`] in the end.
#[derive(Debug)]
pub struct PooledFrame<'a> {
    frame: Frame<Electrons>,
    buffers: &'a Buffers,
}

impl Deref for PooledFrame<'_> {
    type Target = Frame<Electrons>;
    fn deref(&self) -> &Frame<Electrons> {
        &self.frame
    }
}

impl Drop for PooledFrame<'_> {
    fn drop(&mut self) {
        let pixels = std::mem::take(&mut self.frame.pixels).into_raw_vec_and_offset().0;
        let bits = std::mem::take(&mut self.frame.mask).into_raw_vec_and_offset().0;
        if let Ok(mut pool) = self.buffers.0.lock() {
            pool.push((pixels, bits));
        }
    }
}

/// One exposure ready to be read, whole or in parts.
#[derive(Debug)]
pub struct FrameReader<'a> {
    exposure: &'a Exposure,
    gain: Gain,
    /// The box of the clip circle.
    region: Region,
    /// The master flat, and the pixel of it that belongs to the first of the box.
    flat: Option<(&'a MasterFlat, (usize, usize))>,
    /// The file, if it holds plain 16-bit counts.
    stored: Option<Stored>,
    /// What biases and darks say of its zero level.
    zero: Option<ZeroLevel<'a>>,
    /// The hot pixels of its detector.
    hot: Option<&'a HotPixels>,
    /// Where light falls, if the header says that it does not everywhere.
    lit: Option<Section>,
}

/// Reads one exposure inside the clip circle: flattened electrons.
///
/// The circle is centred on ((nx−1)/2, (ny−1)/2). Shape (ny, nx) of its box. N = g (N_adu − pedestal) / F; without a
/// flat nothing is divided. NaN, infinite and BLANK pixels are NaN and BAD, pixels at or above `gain.saturation_adu`
/// are SATURATED, pixels where the flat is masked are BAD and not divided. What is outside the circle is not read: NaN
/// and CLIPPED. The same bytes for any number of threads.
///
/// # Errors
/// [`Error::Fits`] if the file is damaged or has changed since it was classified; [`Error::Flat`] if the flat is of
/// another detector size, or does not cover this frame.
pub fn read<'a>(
    exposure: &Exposure,
    gain: Gain,
    clip_radius_px: Option<f64>,
    flat: Option<&MasterFlat>,
    buffers: &'a Buffers,
) -> Result<PooledFrame<'a>> {
    FrameReader::open(exposure, gain, clip_radius_px, flat)?.whole(buffers)
}

impl<'a> FrameReader<'a> {
    /// Opens an exposure for reading as [`read`] does.
    ///
    /// # Errors
    /// The errors of [`read`].
    pub fn open(
        exposure: &'a Exposure,
        gain: Gain,
        clip_radius_px: Option<f64>,
        flat: Option<&'a MasterFlat>,
    ) -> Result<Self> {
        if exposure.size_px.0 == 0 || exposure.size_px.1 == 0 {
            return Err(Error::Fits { path: exposure.path.clone(), problem: "no image in the header".into() });
        }
        let region = Region::new(exposure.size_px, clip_radius_px);
        let flat = flat.map(|flat| Ok((flat, place_in(flat, exposure, &region)?))).transpose()?;
        let stored = open_stored(&exposure.path, &exposure.header)?;
        // a section that is none of this frame says nothing about it
        let lit = sections(exposure).ok().flatten().and_then(|(_, lit)| lit);
        Ok(Self { exposure, gain, region, flat, stored, zero: None, hot: None, lit })
    }

    /// The same, with the zero level of biases and darks subtracted instead of the constant pedestal; its noise enters the read
    /// noise.
    #[must_use]
    pub fn less(mut self, zero: Option<ZeroLevel<'a>>) -> Self {
        self.gain.read_noise_e *= zero.as_ref().map_or(1.0, ZeroLevel::noise_factor);
        self.zero = zero;
        self
    }

    /// The same, with the pixels masked that are hot in as long an exposure.
    #[must_use]
    pub fn without(mut self, hot: Option<&'a HotPixels>) -> Self {
        self.hot = hot;
        self
    }

    /// The detector at this frame's gain.
    #[must_use]
    pub fn gain(&self) -> &Gain {
        &self.gain
    }

    /// Columns and rows of the box of the clip circle.
    #[must_use]
    pub fn box_px(&self) -> (Range<usize>, Range<usize>) {
        let ((x0, y0), (nx, ny)) = (self.region.origin_px, self.region.size_px);
        (x0..x0 + nx, y0..y0 + ny)
    }

    /// Columns of row `y_px` inside the clip circle, and where light falls.
    #[must_use]
    pub fn inside(&self, y_px: usize) -> Range<usize> {
        let x0 = self.region.origin_px.0;
        let kept = self.region.inside(y_px - self.region.origin_px.1);
        let (start, end) = (x0 + kept.start, x0 + kept.end);
        let Some(lit) = &self.lit else { return start..end };
        if !lit.y.contains(&y_px) {
            return start..start;
        }
        start.clamp(lit.x.start, lit.x.end)..end.clamp(lit.x.start, lit.x.end)
    }

    /// Whether a part of a row costs no more than its share: not where rows are compressed whole.
    #[must_use]
    pub fn reads_parts(&self) -> bool {
        self.stored.is_some()
    }

    /// All of the clip circle.
    ///
    /// # Errors
    /// [`Error::Fits`].
    pub fn whole<'b>(&self, buffers: &'b Buffers) -> Result<PooledFrame<'b>> {
        let (columns, rows) = self.box_px();
        self.part(columns, rows, buffers)
    }

    /// A rectangle of full-frame columns and rows, as far as it lies in the box of the clip circle.
    ///
    /// # Errors
    /// [`Error::Fits`], also where nothing of it lies there.
    pub fn part<'b>(&self, columns: Range<usize>, rows: Range<usize>, buffers: &'b Buffers) -> Result<PooledFrame<'b>> {
        let path = &self.exposure.path;
        let within = self.box_px();
        let columns = columns.start.max(within.0.start)..columns.end.min(within.0.end);
        let rows = rows.start.max(within.1.start)..rows.end.min(within.1.end);
        if columns.is_empty() || rows.is_empty() {
            let problem = format!("requested columns {columns:?} and rows {rows:?}, outside the clip circle");
            return Err(Error::Fits { path: path.clone(), problem });
        }
        let (nx, ny) = (columns.len(), rows.len());
        let (mut pixels, mut bits) = buffers.take(path, nx * ny)?;
        let tile = nx * TILE_ROWS;
        pixels.par_chunks_mut(tile).zip(bits.par_chunks_mut(tile)).enumerate().try_for_each_init(
            || (None, Vec::new(), Vec::new()),
            |(image, bytes, counts), (k, (pixels, bits))| {
                let first = rows.start + k * TILE_ROWS;
                match &self.stored {
                    Some(stored) => self.stored_tile(stored, bytes, &columns, first, pixels, bits),
                    None => guarded(path, || {
                        // each thread has the memory of its own tiles
                        let image = match image {
                            Some(image) => image,
                            None => {
                                let open = Pixels::open(path, &self.exposure.header)?;
                                image.insert(open.saturated_at(self.gain.saturation_adu))
                            }
                        };
                        self.converted_tile(image, counts, &columns, first, pixels, bits)
                    }),
                }
            },
        )?;
        let shaped = |e: ndarray::ShapeError| Error::Fits { path: path.clone(), problem: e.to_string() };
        let frame = Frame {
            path: path.clone(),
            pixels: Array2::from_shape_vec((ny, nx), pixels).map_err(shaped)?,
            mask: Array2::from_shape_vec((ny, nx), bits).map_err(shaped)?,
            origin_px: (columns.start, rows.start),
            full_size_px: self.region.full_size_px,
            gain: self.gain.clone(),
            unit: PhantomData,
        };
        Ok(PooledFrame { frame, buffers })
    }

    /// Plain 16-bit counts: of each row only what is inside the circle.
    fn stored_tile(
        &self,
        stored: &Stored,
        bytes: &mut Vec<u8>,
        columns: &Range<usize>,
        first_row: usize,
        pixels: &mut [f32],
        bits: &mut [u8],
    ) -> Result<()> {
        let nx = columns.len();
        for (j, (pixels, bits)) in pixels.chunks_mut(nx).zip(bits.chunks_mut(nx)).enumerate() {
            let y = first_row + j;
            let kept = self.kept(columns, y, pixels, bits);
            if !kept.is_empty() {
                bytes.resize(kept.len() * PIXEL_BYTES, 0);
                stored.read_span(y, columns.start + kept.start..columns.start + kept.end, bytes)?;
                let response = self.response(columns.start, y, &kept);
                let bytes = bytes.as_chunks().0;
                calibrate_stored(bytes, &mut pixels[kept.clone()], &mut bits[kept.clone()], response, &self.gain);
                self.correct(columns.start, y, &kept, pixels, bits);
            }
        }
        Ok(())
    }

    /// Everything else, decoded on the way: the columns any row of the tile needs.
    fn converted_tile(
        &self,
        image: &mut Pixels,
        counts: &mut Vec<f32>,
        columns: &Range<usize>,
        first_row: usize,
        pixels: &mut [f32],
        bits: &mut [u8],
    ) -> Result<()> {
        let nx = columns.len();
        let rows = pixels.len() / nx;
        let spans: Vec<Range<usize>> = pixels
            .chunks_mut(nx)
            .zip(bits.chunks_mut(nx))
            .enumerate()
            .map(|(j, (pixels, bits))| self.kept(columns, first_row + j, pixels, bits))
            .collect();
        let needed = || spans.iter().filter(|s| !s.is_empty());
        let (Some(from), Some(to)) = (needed().map(|s| s.start).min(), needed().map(|s| s.end).max()) else {
            return Ok(());
        };
        counts.resize((to - from) * rows, 0.0);
        image.read((columns.start + from, first_row), (to - from, rows), counts)?;
        let lines = pixels.chunks_mut(nx).zip(bits.chunks_mut(nx)).zip(counts.chunks(to - from));
        for ((j, kept), ((pixels, bits), counts)) in spans.into_iter().enumerate().zip(lines) {
            if !kept.is_empty() {
                pixels[kept.clone()].copy_from_slice(&counts[kept.start - from..kept.end - from]);
                let response = self.response(columns.start, first_row + j, &kept);
                calibrate(&mut pixels[kept.clone()], &mut bits[kept.clone()], response, &self.gain);
                self.correct(columns.start, first_row + j, &kept, pixels, bits);
            }
        }
        Ok(())
    }

    /// The part of a row that is inside the circle, counted from the first of `columns`; the rest of it is marked.
    fn kept(&self, columns: &Range<usize>, y: usize, pixels: &mut [f32], bits: &mut [u8]) -> Range<usize> {
        let inside = self.inside(y);
        let start = inside.start.clamp(columns.start, columns.end);
        let end = inside.end.clamp(start, columns.end);
        let kept = start - columns.start..end - columns.start;
        for outside in [0..kept.start, kept.end..pixels.len()] {
            pixels[outside.clone()].fill(f32::NAN);
            bits[outside].fill(mask::CLIPPED);
        }
        kept
    }

    /// Subtracts the zero level over columns `kept` of a row that begins at full-frame column `x0`, and masks hot pixels.
    fn correct(&self, x0: usize, y: usize, kept: &Range<usize>, pixels: &mut [f32], bits: &mut [u8]) {
        if let Some(zero) = &self.zero {
            let first = (y - self.region.origin_px.1) * self.region.size_px.0 + x0 - self.region.origin_px.0;
            let at = first + kept.start..first + kept.end;
            let (pixels, bits) = (&mut pixels[kept.clone()], &mut bits[kept.clone()]);
            zero.subtract(at, pixels, bits, self.response(x0, y, kept), &self.gain);
        }
        for peak in self.hot.map_or(&[][..], |hot| hot.row(y)) {
            let added_e = f64::from(peak.above) * self.exposure.exptime_s;
            let x = (peak.x_px as usize).checked_sub(x0).filter(|x| kept.contains(x));
            if let Some(x) = x.filter(|_| added_e > HOT_READ_NOISES * self.gain.read_noise_e) {
                bits[x] |= mask::BAD;
            }
        }
    }

    /// The master flat over columns `kept` of a row that begins at full-frame column `x0`.
    fn response(&self, x0: usize, y: usize, kept: &Range<usize>) -> Option<&[f32]> {
        self.flat.as_ref().and_then(|(flat, (fx, fy))| {
            let (i, j) = (x0 - self.region.origin_px.0 + fx, y - self.region.origin_px.1 + fy);
            flat.response.row(j).to_slice().map(|row| &row[i + kept.start..i + kept.end])
        })
    }
}

/// The pixel of the flat that belongs to the first of the box.
fn place_in(flat: &MasterFlat, exposure: &Exposure, region: &Region) -> Result<(usize, usize)> {
    let ((nx, ny), (x0, y0)) = (region.size_px, region.origin_px);
    let (flat_ny, flat_nx) = flat.response.dim();
    let place = (
        x0.checked_sub(flat.origin_px.0).filter(|x| x + nx <= flat_nx),
        y0.checked_sub(flat.origin_px.1).filter(|y| y + ny <= flat_ny),
    );
    if let (Some(x), Some(y), true) = (place.0, place.1, region.full_size_px == flat.full_size_px) {
        return Ok((x, y));
    }
    let problem = format!(
        "{} is {}x{} px, of which {nx}x{ny} at ({x0}, {y0}) are used; the master flat is {}x{} px with {flat_nx}x{flat_ny} \
         at ({}, {}): take flats with the same binning, read-out and clip radius",
        exposure.path.display(),
        region.full_size_px.0,
        region.full_size_px.1,
        flat.full_size_px.0,
        flat.full_size_px.1,
        flat.origin_px.0,
        flat.origin_px.1
    );
    Err(Error::Flat { problem })
}
