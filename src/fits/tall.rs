//! Compressed images whose tiles are higher than the bands in which frames are read (`fpack -w`, 1000 × 1000 tiles).
//!
//! Every band of such an image needs a whole tile, so the image is decoded once into an unnamed temporary file, which all threads
//! read like an uncompressed one. Memory: one row of tiles, one image at a time. It does not cover flat tiles ([`super::tiles`]).

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use super::cards::Header;
use super::plain::Plain;
use super::stored::Stored;
use super::tiles::Tiles;
use crate::base::error::{Error, Result};
use crate::base::pages::zeros;

/// Tiles of more rows are decoded once \[px\].
const TALL_PX: i64 = 64;
/// Rows written at a time.
const ROWS: usize = 64;
/// Images kept at once: the frames in work.
const MOST_KEPT: usize = 8;
/// Bytes that decoding takes per pixel of a row of tiles: the codec's integers, values, and what is compressed.
const BYTES_PER_PX: usize = 12;

/// A file that was decoded, and what it was decoded from.
struct Decoded {
    path: PathBuf,
    stamp: (u64, Option<SystemTime>),
    file: Arc<File>,
}

/// The images decoded last, the newest at the end.
static KEPT: Mutex<Vec<Decoded>> = Mutex::new(Vec::new());

/// Whether the image is compressed in tiles of more rows than are read at once.
pub(crate) fn is_tall(header: &Header) -> bool {
    header.is_compressed() && header.integer("ZTILE2").is_some_and(|rows| rows > TALL_PX)
}

/// The memory that decoding the image takes \[bytes\]; 0 for one that is read as it is.
pub(crate) fn decoding_bytes(header: &Header) -> usize {
    if !is_tall(header) {
        return 0;
    }
    let (nx, ny) = header.size_px();
    let rows = header.integer("ZTILE2").and_then(|rows| usize::try_from(rows).ok()).unwrap_or(ny).min(ny);
    nx.saturating_mul(rows).saturating_mul(BYTES_PER_PX)
}

/// Opens an image of unsigned 16-bit counts that can be read at any place: plain, or in high tiles; `None` for any other.
///
/// # Errors
/// [`Error::Io`]; [`Error::Fits`] for a file that is shorter than its header says, or a damaged tile.
pub(crate) fn open_stored(path: &Path, header: &Header) -> Result<Option<Stored>> {
    if !(is_tall(header) && Stored::counts(header)) {
        return Stored::open(path, header);
    }
    Ok(Some(Stored::of_counts(decoded(path, header)?, path, header.size_px())))
}

/// Opens an image of any other numbers in high tiles; `None` where its tiles are low or it has none.
///
/// # Errors
/// Those of [`open_stored`].
pub(crate) fn open_plain(path: &Path, header: &Header) -> Result<Option<Plain>> {
    if !is_tall(header) {
        return Ok(None);
    }
    Ok(Some(Plain::of_f32(decoded(path, header)?, path, header.size_px())))
}

/// The decoded pixels: 16-bit counts as FITS stores them, else f32.
fn decoded(path: &Path, header: &Header) -> Result<Arc<File>> {
    let meta = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
    let stamp = (meta.len(), meta.modified().ok());
    // held while an image is decoded: others of the same frame wait for it, those of other frames for the memory
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = kept.iter().position(|k| k.path == path && k.stamp == stamp) {
        let known = kept.remove(known);
        let file = Arc::clone(&known.file);
        kept.push(known);
        return Ok(file);
    }
    let file = Arc::new(decode(path, header)?);
    if kept.len() >= MOST_KEPT {
        kept.remove(0);
    }
    kept.push(Decoded { path: path.to_path_buf(), stamp, file: Arc::clone(&file) });
    Ok(file)
}

fn decode(path: &Path, header: &Header) -> Result<File> {
    let disk = |e| Error::io(std::env::temp_dir(), e);
    let (nx, ny) = header.size_px();
    let counts = Stored::counts(header);
    let mut tiles = Tiles::open(path, header)?;
    let mut out = BufWriter::with_capacity(1 << 18, tempfile::tempfile().map_err(disk)?);
    let mut values = zeros(path, nx * ROWS.min(ny))?;
    let mut bytes = Vec::new();
    for first in (0..ny).step_by(ROWS) {
        let rows = ROWS.min(ny - first);
        let values = &mut values[..nx * rows];
        tiles.read((0, first), (nx, rows), values)?;
        bytes.clear();
        match counts {
            true => bytes.extend(values.iter().flat_map(|v| (*v as u16 ^ 0x8000).to_be_bytes())),
            false => bytes.extend(values.iter().flat_map(|v| v.to_be_bytes())),
        }
        out.write_all(&bytes).map_err(disk)?;
    }
    out.into_inner().map_err(|e| disk(e.into_error()))
}
