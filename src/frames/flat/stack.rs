//! The flats of a night as a stack, read in bands of rows and combined by their median.
//!
//! Only the columns inside the clip circle are read. Memory: what the caller allows for the bands of all threads.

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use super::kernel::{Layer, MedianBuffers, Pixels};
use crate::base::error::{Error, Result};
use crate::fits::raw::guarded;
use crate::fits::stored::{PIXEL_BYTES, Stored};
use crate::fits::tall::{is_tall, open_stored};
use crate::frames::clip::Region;
use crate::frames::exposure::Exposure;
use crate::frames::read;
use crate::frames::read::TILE_ROWS;

/// A band of plain flats is kept this small, so that it is still in a core's cache when its medians are taken \[bytes\].
const CACHED_BYTES: usize = 4 << 20;
/// Files held open; a system allows a process 256 at the least. Others are opened for every band.
const MAX_OPEN: usize = 128;

/// A usable flat.
pub(crate) struct Usable<'a> {
    /// The file.
    pub exposure: &'a Exposure,
    /// Level above the pedestal \[ADU\]; 1 where flats are not scaled.
    pub level_adu: f64,
    /// From here on a pixel does not vote \[ADU\].
    pub saturation_adu: f32,
}

/// The flats, and how they are combined.
pub(crate) struct Stack<'a> {
    flats: Vec<(Usable<'a>, Option<Stored>)>,
    pedestal_adu: f64,
    region: &'a Region,
    as_stored: bool,
    all_plain: bool,
}

/// A thread's buffers.
struct Workspace {
    buffers: MedianBuffers,
    bytes: Vec<Vec<u8>>,
    values: Vec<Vec<f32>>,
    medians: Vec<f32>,
}

/// Part of a band: columns of the region's box by row.
type Spans = Vec<(usize, Range<usize>)>;

impl<'a> Stack<'a> {
    /// Opens the flats. `scale`: divide each by its level; otherwise the 16-bit counts are combined as they are stored
    /// wherever all files hold such. A file that cannot be opened now is named by [`Stack::median`].
    pub(crate) fn open(flats: Vec<Usable<'a>>, scale: bool, pedestal_adu: f64, region: &'a Region) -> Self {
        let as_stored = !scale && flats.iter().all(|f| Stored::counts(&f.exposure.header));
        let plain = |f: &Usable| {
            Stored::counts(&f.exposure.header) && (!f.exposure.header.is_compressed() || is_tall(&f.exposure.header))
        };
        let all_plain = flats.iter().all(plain);
        let flats = flats.into_iter().enumerate().map(|(k, mut flat)| {
            if !scale {
                flat.level_adu = 1.0;
            }
            let open = || open_stored(&flat.exposure.path, &flat.exposure.header).ok().flatten();
            let stored = if k < MAX_OPEN { open() } else { None };
            (flat, stored)
        });
        Self { flats: flats.collect(), pedestal_adu, region, as_stored, all_plain }
    }

    /// Median of every pixel inside the circle; `out` has the shape of the region's box, row by row, and is NaN outside.
    ///
    /// `band_bytes` is what the bands of all threads may take. The result does not depend on it or on the threads.
    /// Returned are the flats that cannot be read somewhere, each with the error of its first band: with any, `out` is not
    /// to be used, and the others have to be combined again. All bands are looked at, so that the answer is the same for
    /// any number of threads.
    pub(crate) fn median(&self, band_bytes: usize, out: &mut [f32]) -> BTreeMap<usize, Error> {
        let nx = self.region.size_px.0;
        let share = band_bytes / rayon::current_num_threads().max(1);
        let pixel_bytes = self.flats.len() * if self.all_plain { PIXEL_BYTES } else { size_of::<f32>() };
        // Whole bands of other files are opened and decoded at once; plain files cost nothing to come back to.
        let room = if self.all_plain { share.min(CACHED_BYTES) } else { share };
        let rows = (room / (pixel_bytes * nx)).clamp(1, TILE_ROWS);
        let columns = (share / (pixel_bytes * rows)).clamp(1, nx);
        let workspace = || Workspace {
            buffers: MedianBuffers::new(self.flats.len(), self.as_stored),
            bytes: vec![Vec::new(); self.flats.len()],
            values: vec![Vec::new(); self.flats.len()],
            medians: Vec::new(),
        };
        let bands = out.par_chunks_mut(nx * rows).enumerate().map_init(workspace, |work, (band, out)| {
            let mut unreadable = BTreeMap::new();
            out.fill(f32::NAN);
            for first in (0..nx).step_by(columns) {
                let spans: Spans = (0..out.len() / nx)
                    .map(|j| {
                        let inside = self.region.inside(band * rows + j);
                        (j, inside.start.max(first)..inside.end.min(first + columns))
                    })
                    .filter(|(_, span)| !span.is_empty())
                    .collect();
                self.combine(band * rows, &spans, work, (out, &mut unreadable));
            }
            unreadable
        });
        let first = |earlier, mut later: BTreeMap<usize, Error>| {
            later.extend::<BTreeMap<usize, Error>>(earlier); // its errors are the ones kept
            later
        };
        bands.reduce(BTreeMap::new, first)
    }

    /// Reads the spans of all flats and puts their medians into `out`, if none is `unreadable`.
    fn combine(
        &self,
        first_row: usize,
        spans: &Spans,
        work: &mut Workspace,
        (out, unreadable): (&mut [f32], &mut BTreeMap<usize, Error>),
    ) {
        let total: usize = spans.iter().map(|(_, span)| span.len()).sum();
        if total == 0 {
            return;
        }
        for (k, (flat, held)) in self.flats.iter().enumerate() {
            let buffers = (&mut work.bytes[k], &mut work.values[k]);
            if let Err(error) = self.read(flat, held.as_ref(), first_row, spans, buffers) {
                unreadable.entry(k).or_insert(error);
            }
        }
        if !unreadable.is_empty() {
            return;
        }
        work.medians.resize(total, 0.0);
        if self.as_stored {
            let pixels = self.flats.iter().zip(&work.bytes).map(|((f, _), b)| (b.as_chunks().0, f.saturation_adu));
            work.buffers.of_counts(&pixels.collect::<Vec<_>>(), self.pedestal_adu, &mut work.medians);
        } else {
            let layers =
                self.flats.iter().zip(work.bytes.iter().zip(&work.values)).map(|((f, _), (bytes, values))| Layer {
                    pixels: if values.is_empty() {
                        Pixels::Counts(bytes.as_chunks().0)
                    } else {
                        Pixels::Values(values)
                    },
                    saturation_adu: f.saturation_adu,
                    per_level: (1.0 / f.level_adu) as f32,
                });
            work.buffers.of_scaled(&layers.collect::<Vec<_>>(), self.pedestal_adu as f32, &mut work.medians);
        }
        let mut rest = work.medians.as_slice();
        for (j, span) in spans {
            let (medians, next) = rest.split_at(span.len());
            let start = j * self.region.size_px.0 + span.start;
            out[start..start + span.len()].copy_from_slice(medians);
            rest = next;
        }
    }

    /// The pixels of one flat: as bytes where it holds plain counts, or where all are combined so; else as values.
    fn read(
        &self,
        flat: &Usable,
        held: Option<&Stored>,
        first_row: usize,
        spans: &Spans,
        (bytes, values): (&mut Vec<u8>, &mut Vec<f32>),
    ) -> Result<()> {
        let (path, header) = (&flat.exposure.path, &flat.exposure.header);
        let (x0, y0) = (self.region.origin_px.0, self.region.origin_px.1 + first_row);
        let opened = if held.is_none() { open_stored(path, header)? } else { None };
        if let Some(stored) = held.or(opened.as_ref()) {
            return read_spans(stored, (x0, y0), spans, bytes);
        }
        let (first, last) = (spans[0].0, spans[spans.len() - 1].0);
        let left = spans.iter().map(|(_, s)| s.start).min().unwrap_or(0);
        let width = spans.iter().map(|(_, s)| s.end).max().unwrap_or(0) - left;
        values.resize(width * (last + 1 - first), 0.0);
        guarded(path, || {
            let size = (width, last + 1 - first);
            read::Pixels::open(path, header)?.read((x0 + left, y0 + first), size, values)
        })?;
        let mut end = 0;
        for (j, span) in spans {
            let from = (j - first) * width + span.start - left;
            values.copy_within(from..from + span.len(), end);
            end += span.len();
        }
        values.truncate(end);
        if self.as_stored {
            // Compressed counts: back to what a plain file holds.
            bytes.clear();
            bytes.extend(values.iter().flat_map(|v| (*v as u16 ^ 0x8000).to_be_bytes()));
        }
        Ok(())
    }
}

/// The stored bytes of the spans, one after the other; whole rows in one piece.
fn read_spans(stored: &Stored, (x0, y0): (usize, usize), spans: &Spans, bytes: &mut Vec<u8>) -> Result<()> {
    let (first, columns) = &spans[0];
    if spans.iter().all(|(_, span)| span == columns) {
        return stored.read((x0 + columns.start, y0 + first), (columns.len(), spans.len()), bytes);
    }
    bytes.resize(spans.iter().map(|(_, span)| span.len() * PIXEL_BYTES).sum(), 0);
    let mut rest = bytes.as_mut_slice();
    for (j, span) in spans {
        let (row, next) = rest.split_at_mut(span.len() * PIXEL_BYTES);
        stored.read_span(y0 + j, x0 + span.start..x0 + span.end, row)?;
        rest = next;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::{card, write_u16};
    use crate::frames::classify;

    #[test]
    fn a_flat_that_becomes_shorter_while_it_is_combined_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n";
        let config = crate::config::Config::from_text(night, &[]).unwrap();
        let flats: Vec<Exposure> = (0..3)
            .map(|k| {
                let path = dir.path().join(format!("flat{k}.fits"));
                let cards = [card("IMAGETYP", "FLAT", ""), card("EXPTIME", 1.0, "")];
                write_u16(&path, &ndarray::Array2::from_elem((400, 300), 20_000 + k), &cards, false).unwrap();
                classify(&path, &config, &[]).unwrap()
            })
            .collect();
        let region = Region::new((300, 400), None);
        let usable = flats.iter().map(|exposure| Usable { exposure, level_adu: 2e4, saturation_adu: 6e4 }).collect();
        let stack = Stack::open(usable, true, 0.0, &region);
        let mut out = vec![0.0; 300 * 400];
        assert!(stack.median(1 << 20, &mut out).is_empty());
        std::fs::OpenOptions::new().write(true).open(&flats[1].path).unwrap().set_len(100_000).unwrap();
        let unreadable = stack.median(1 << 20, &mut out);
        assert_eq!(unreadable.keys().collect::<Vec<_>>(), [&1]);
        let error = unreadable[&1].to_string();
        assert!(error.contains("flat1.fits") && error.contains("shorter"), "{error}");
    }
}
