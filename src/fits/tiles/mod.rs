//! Tile-compressed images (`.fz`), decoded without the FITS library: what C code reads past the end of a damaged tile
//! cannot be caught.
//!
//! Rice, gzip, H-compress, PLIO and uncompressed tiles of integers and floats (FITS 4.0 section 10); out come physical
//! values in f32, NaN where undefined. Memory: the tiles of one row of tiles. Where things lie is in [`layout`].

mod dither;
mod gzip;
mod hcompress;
mod hsmooth;
mod layout;
mod plio;
mod rice;

use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::cards::Header;
use super::linear::Linear;
use super::open::open;
use super::plain::convert;
use super::stored::{SHORTER, read_exact_at};
use crate::base::error::{Error, Result};
use crate::base::pages::resize;
use layout::{Layout, Method, Place};

/// Bytes between two tiles that are read rather than skipped.
const GAP: u64 = 1 << 16;

/// Rows of the table that are looked at together before an image is read.
const ROWS_AT_ONCE: usize = 4096;

/// A tile-compressed image open for reading.
pub(crate) struct Tiles {
    file: File,
    path: PathBuf,
    layout: Layout,
    /// Rows of the table, and the part of the heap, that the last request needed.
    rows: Vec<u8>,
    heap: Vec<u8>,
    heap_from: u64,
    /// The tiles decoded last: which row of tiles, which of it, and their pixels in rows.
    band: Option<(usize, Range<usize>)>,
    pixels: Vec<f32>,
    scratch: Scratch,
}

/// Memory of one tile.
#[derive(Default)]
struct Scratch {
    integers: Vec<i32>,
    bytes: Vec<u8>,
    values: Vec<f32>,
}

impl Tiles {
    /// Opens the image that `header` was scanned from.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Fits`] for a table that cannot hold this image.
    pub(crate) fn open(path: &Path, header: &Header) -> Result<Self> {
        let bad = |problem: String| Error::Fits { path: path.to_path_buf(), problem };
        let file = open(path)?;
        let layout = Layout::of(header).map_err(bad)?;
        Ok(Self {
            file,
            path: path.to_path_buf(),
            layout,
            rows: Vec::new(),
            heap: Vec::new(),
            heap_from: 0,
            band: None,
            pixels: Vec::new(),
            scratch: Scratch::default(),
        })
    }

    fn bad(&self, problem: String) -> Error {
        Error::Fits { path: self.path.clone(), problem }
    }

    /// Reads the rectangle at `origin_px` of `size_px` in rows.
    ///
    /// # Errors
    /// [`Error::Fits`] if it does not lie in the image, or naming the tile that is damaged and how.
    pub(crate) fn read(&mut self, (x0, y0): (usize, usize), (nx, ny): (usize, usize), out: &mut [f32]) -> Result<()> {
        let (full_nx, full_ny) = self.layout.size_px;
        if out.len() != nx * ny || nx == 0 || ny == 0 || x0 + nx > full_nx || y0 + ny > full_ny {
            return Err(self.bad(format!("requested {nx}x{ny} pixels at ({x0}, {y0}) of {full_nx}x{full_ny}")));
        }
        let (tile_nx, tile_ny) = self.layout.tile_px;
        let along = x0 / tile_nx..(x0 + nx).div_ceil(tile_nx);
        let down = y0 / tile_ny..(y0 + ny).div_ceil(tile_ny);
        let from_x = along.start * tile_nx;
        let width = (along.end * tile_nx).min(full_nx) - from_x;
        let mut fetched = false;
        for j in down.clone() {
            let band = Some((j, along.clone()));
            if self.band != band {
                self.band = None;
                if !fetched {
                    self.fetch(down.clone(), &along)?;
                    fetched = true;
                }
                self.decode_band(j, &along, width)?;
                self.band = band;
            }
            let top = j * tile_ny;
            for y in top.max(y0)..(top + tile_ny).min(y0 + ny) {
                let from = &self.pixels[(y - top) * width + x0 - from_x..][..nx];
                out[(y - y0) * nx..][..nx].copy_from_slice(from);
            }
        }
        Ok(())
    }

    /// Reads the table rows of these tiles, and their part of the heap if it lies together.
    fn fetch(&mut self, down: Range<usize>, along: &Range<usize>) -> Result<()> {
        let layout = &self.layout;
        let (first, last) = (layout.index(down.start, along.start), layout.index(down.end - 1, along.end - 1));
        let (from, rows) = (layout.table_at + (first * layout.row_bytes) as u64, last + 1 - first);
        resize(&mut self.rows, rows * layout.row_bytes).map_err(|problem| self.bad(problem))?;
        read_at(&self.file, &self.path, &mut self.rows, from)?;
        let (mut start, mut end, mut sum) = (u64::MAX, 0, 0);
        for j in down.clone() {
            for i in along.clone() {
                let index = layout.index(j, i);
                let row = &self.rows[(index - first) * layout.row_bytes..][..layout.row_bytes];
                let place = layout.place(row, index).map_err(|problem| self.bad(problem))?;
                start = start.min(place.at);
                end = end.max(place.at + place.bytes);
                sum += place.bytes;
            }
        }
        self.heap.clear();
        self.heap_from = start;
        if start < end && end - start <= 2 * sum + GAP {
            resize(&mut self.heap, (end - start) as usize).map_err(|problem| self.bad(problem))?;
            read_at(&self.file, &self.path, &mut self.heap, start)?;
        }
        self.layout.first_held = first;
        Ok(())
    }

    /// Decodes tiles `along` of row `j` of tiles into `pixels`, rows `width` long.
    fn decode_band(&mut self, j: usize, along: &Range<usize>, width: usize) -> Result<()> {
        let (tile_nx, tile_ny) = self.layout.tile_px;
        let height = tile_ny.min(self.layout.size_px.1 - j * tile_ny);
        let mut pixels = std::mem::take(&mut self.pixels);
        resize(&mut pixels, width * height).map_err(|problem| self.bad(problem))?;
        for i in along.clone() {
            let left = (i - along.start) * tile_nx;
            let tile_width = tile_nx.min(self.layout.size_px.0 - i * tile_nx);
            let index = self.layout.index(j, i);
            if tile_width == width {
                self.decode_tile(index, (tile_width, height), &mut pixels)?;
                continue;
            }
            let mut tile = std::mem::take(&mut self.scratch.values);
            resize(&mut tile, tile_width * height).map_err(|problem| self.bad(problem))?;
            self.decode_tile(index, (tile_width, height), &mut tile)?;
            for (to, from) in pixels.chunks_mut(width).zip(tile.chunks(tile_width)) {
                to[left..left + tile_width].copy_from_slice(from);
            }
            self.scratch.values = tile;
        }
        self.pixels = pixels;
        Ok(())
    }

    /// Decodes one tile of `size_px` into `out`, in rows.
    fn decode_tile(&mut self, index: usize, size_px: (usize, usize), out: &mut [f32]) -> Result<()> {
        let layout = &self.layout;
        let row = (index - layout.first_held) * layout.row_bytes;
        let row = self.rows.get(row..row + layout.row_bytes).unwrap_or_default();
        let tile = |problem: String| Error::Fits {
            path: self.path.clone(),
            problem: format!("tile {} of {}: {problem}", index + 1, layout.tiles()),
        };
        let place = layout.place(row, index).map_err(|problem| self.bad(problem))?;
        let held = place.at.checked_sub(self.heap_from).and_then(|from| {
            let from = usize::try_from(from).ok()?;
            self.heap.get(from..from.checked_add(place.bytes as usize)?)
        });
        let bytes = match held {
            Some(bytes) => bytes,
            None => {
                resize(&mut self.scratch.bytes, place.bytes as usize).map_err(tile)?;
                read_at(&self.file, &self.path, &mut self.scratch.bytes, place.at)?;
                &self.scratch.bytes
            }
        };
        let linear = layout.linear(row);
        let integers = &mut self.scratch.integers;
        decode(layout, &place, bytes, (index, size_px), &linear, integers, out).map_err(tile)
    }
}

/// Refuses an image of more pixels than its tiles can hold, before anybody allocates them.
///
/// # Errors
/// [`Error::Io`]; [`Error::Fits`] with both numbers.
pub(crate) fn refuse_impossible(file: &File, path: &Path, header: &Header) -> Result<()> {
    let bad = |problem: String| Error::Fits { path: path.to_path_buf(), problem };
    let layout = Layout::of(header).map_err(bad)?;
    let pixels = layout.size_px.0 as u128 * layout.size_px.1 as u128;
    let (mut most, mut damaged) = (0, None);
    let mut rows = Vec::new();
    for first in (0..layout.tiles()).step_by(ROWS_AT_ONCE) {
        rows.resize(ROWS_AT_ONCE.min(layout.tiles() - first) * layout.row_bytes, 0);
        read_at(file, path, &mut rows, layout.table_at + (first * layout.row_bytes) as u64)?;
        for (k, row) in rows.chunks_exact(layout.row_bytes.max(1)).enumerate() {
            match layout.place(row, first + k) {
                Ok(place) => most += place.most_pixels(),
                // reported when its tile is read, if the others can hold the image
                Err(problem) => damaged = damaged.or(Some(problem)),
            }
        }
    }
    if pixels > most {
        let why = damaged.map_or(String::new(), |problem| format!(" ({problem})"));
        return Err(bad(format!("the header promises {pixels} pixels; its tiles can hold {most} at most{why}")));
    }
    Ok(())
}

/// The bytes of one tile to physical values.
fn decode(
    layout: &Layout,
    place: &Place,
    bytes: &[u8],
    (index, size_px): (usize, (usize, usize)),
    linear: &Linear,
    integers: &mut Vec<i32>,
    out: &mut [f32],
) -> std::result::Result<(), String> {
    let float = |bytes: &[u8], out: &mut [f32]| convert(bytes, layout.bitpix, &Linear::UNIT, out);
    let width = (layout.bitpix.unsigned_abs() / 8) as usize;
    match place.method {
        Method::LosslessFloats => {
            float(&gzip::inflate(bytes, &[out.len() * width])?, out);
            return Ok(());
        }
        Method::Uncompressed(bitpix) => {
            if bytes.len() != out.len() * (bitpix.unsigned_abs() / 8) as usize {
                return Err(format!("{} bytes for {} uncompressed pixels", bytes.len(), out.len()));
            }
            let linear = if layout.bitpix < 0 { &Linear::UNIT } else { linear };
            convert(bytes, bitpix, linear, out);
            return Ok(());
        }
        _ => resize(integers, out.len())?,
    }
    match place.method {
        Method::Rice { byte_pix, block } => rice::decode(bytes, byte_pix, block, integers)?,
        Method::HCompress { smooth } => hcompress::decode(bytes, size_px, smooth, integers)?,
        Method::Plio => plio::decode(bytes, integers)?,
        Method::Gzip { shuffled } | Method::Bytes { shuffled } => {
            let sizes = layout.stored_widths().map(|w| w * out.len());
            let inflated;
            let bytes = if matches!(place.method, Method::Gzip { .. }) {
                inflated = gzip::inflate(bytes, &sizes)?;
                &inflated
            } else if sizes.contains(&bytes.len()) {
                bytes
            } else {
                return Err(format!("{} bytes for {} pixels", bytes.len(), out.len()));
            };
            let width = bytes.len() / out.len();
            let ordered = if shuffled { gzip::unshuffled(bytes, width) } else { bytes.to_vec() };
            if !layout.quantised {
                let (stored, linear) =
                    if layout.bitpix < 0 { (layout.bitpix, layout.floats()) } else { (8 * width as i64, *linear) };
                convert(&ordered, stored, &linear, out);
                return Ok(());
            }
            integers.iter_mut().zip(ordered.as_chunks().0).for_each(|(to, from)| *to = i32::from_be_bytes(*from));
        }
        Method::LosslessFloats | Method::Uncompressed(_) => {}
    }
    if layout.quantised {
        dither::undither(integers, linear, layout.dither, index, out);
    } else {
        let narrow = matches!(place.method, Method::Rice { byte_pix: 1 | 2, .. });
        linear.integers(integers, narrow, out);
    }
    Ok(())
}

/// Reads bytes at a place of the file.
fn read_at(file: &File, path: &Path, bytes: &mut [u8], at: u64) -> Result<()> {
    read_exact_at(file, bytes, at).map_err(|e| match e.kind() {
        std::io::ErrorKind::UnexpectedEof => Error::Fits { path: path.to_path_buf(), problem: SHORTER.into() },
        _ => Error::io(path, e),
    })
}
