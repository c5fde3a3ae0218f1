//! The runs of pixels of a frame above a multiple of the sky's scatter after a filter, tile by tile.
//!
//! Electrons, local pixels of the frame. A step of a tile and its margin stay in the second-level cache: every row is
//! read, freed of the sky and filtered along x once per tile, and the last rows of a step serve the next. Across rows
//! only few blocks need filtering: the filtered peaks of groups of columns lie nowhere below the filtered pixels
//! (weights and rounding are monotonic), and a scatter that no pixel of the tile lies below gives a threshold below all
//! others; where the one does not reach the other, nothing is above. Memory: one tile per thread and the runs. It does
//! not cover what the runs belong to.

use std::ops::Range;

use rayon::prelude::*;

use crate::photometry::label::{Run, runs_of_part};
use crate::photometry::net::Net;
use crate::photometry::smooth::{BLOCK, GROUP, Kernel, group_peaks};

/// Columns of a tile: a page of pixels, for memory is fast where it is read in long pieces.
const TILE_COLUMNS: usize = 2 * GROUP * BLOCK;
/// Rows of a tile.
const TILE_ROWS: usize = 512;
/// Rows of a tile filtered at a time.
const STEP_ROWS: usize = 128;
/// Pixels from row to row of a filtered tile: not a power of two, whose rows would share cache sets.
const STRIDE: usize = TILE_COLUMNS + 16;
/// Groups of columns of a tile.
const PEAKS: usize = TILE_COLUMNS / GROUP;

/// The runs above `per_rms` times the scatter (and above zero) in a frame of (ny, nx), by row and column.
pub(crate) fn runs_above(net: &Net, (ny, nx): (usize, usize), kernel: &Kernel, per_rms: f32) -> Vec<Run> {
    let across = nx.div_ceil(TILE_COLUMNS);
    let tiles: Vec<Vec<Run>> = (0..across * ny.div_ceil(TILE_ROWS))
        .into_par_iter()
        .map_init(
            || Tile::new(kernel.radius()),
            |tile, t| {
                let (x0, y0) = (t % across * TILE_COLUMNS, t / across * TILE_ROWS);
                tile.runs(net, kernel, per_rms, x0..(x0 + TILE_COLUMNS).min(nx), y0..(y0 + TILE_ROWS).min(ny), (ny, nx))
            },
        )
        .collect();
    let mut runs: Vec<Run> = tiles.into_iter().flatten().collect();
    // the tiles come from left to right: a stable sort leaves the columns of a row in order
    runs.sort_by_key(|run| run.row);
    runs.dedup_by(|next, run| {
        let touch = next.row == run.row && next.columns.start == run.columns.end;
        if touch {
            run.columns.end = next.columns.end;
        }
        touch
    });
    runs
}

/// The buffers of one thread.
struct Tile {
    /// Rows of a step and a margin of the radius above and below, filtered along x.
    filtered: Vec<f32>,
    /// The peaks of groups of columns of `filtered`.
    peaks: Vec<f32>,
    /// Whether a row of `filtered` has a usable pixel.
    lit: Vec<bool>,
    /// One row with a margin of the radius on both sides.
    padded: Vec<f32>,
    /// The peaks filtered across rows, one block of them.
    bounds: Vec<[f32; BLOCK]>,
}

impl Tile {
    fn new(r: usize) -> Self {
        Self {
            filtered: vec![0.0; (STEP_ROWS + 2 * r) * STRIDE],
            peaks: vec![0.0; (STEP_ROWS + 2 * r) * PEAKS],
            lit: vec![false; STEP_ROWS + 2 * r],
            padded: vec![0.0; TILE_COLUMNS + 2 * r],
            bounds: vec![[0.0; BLOCK]; STEP_ROWS],
        }
    }

    fn runs(
        &mut self,
        net: &Net,
        kernel: &Kernel,
        per_rms: f32,
        columns: Range<usize>,
        rows: Range<usize>,
        size: (usize, usize),
    ) -> Vec<Run> {
        let mut runs = Vec::new();
        let margin = 2 * kernel.radius();
        self.padded.fill(0.0);
        for first in rows.clone().step_by(STEP_ROWS) {
            let step = first..(first + STEP_ROWS).min(rows.end);
            // the last rows of a step are the first of the next
            let known = if first == rows.start { 0 } else { margin };
            if known > 0 {
                self.filtered.copy_within(STEP_ROWS * STRIDE.., 0);
                self.peaks.copy_within(STEP_ROWS * PEAKS.., 0);
                self.lit.copy_within(STEP_ROWS.., 0);
            }
            for row in known..step.len() + margin {
                self.filter_row(net, kernel, &columns, (first, row), size);
            }
            if self.lit[..step.len() + margin].contains(&true) {
                self.search(net, kernel, per_rms, &columns, step, &mut runs);
            }
        }
        runs.sort_by_key(|run| run.row);
        runs
    }

    /// Filters a row along x, counted from a radius above the first row of the step, which may lie outside the frame.
    fn filter_row(
        &mut self,
        net: &Net,
        kernel: &Kernel,
        columns: &Range<usize>,
        (first, row): (usize, usize),
        (ny, nx): (usize, usize),
    ) {
        let r = kernel.radius();
        let width = columns.len().next_multiple_of(BLOCK);
        let (from, to) = (columns.start.saturating_sub(r), (columns.end + r).min(nx));
        let at = from + r - columns.start;
        let out = &mut self.filtered[row * STRIDE..][..STRIDE];
        let peaks = &mut self.peaks[row * PEAKS..][..PEAKS];
        let j = (first + row).wrapping_sub(r);
        self.lit[row] = j < ny && net.part(j, from..to, &mut self.padded[at..at + to - from]);
        if self.lit[row] {
            kernel.along_row(&self.padded, &mut out[..width]);
            group_peaks(&out[..width], peaks);
        } else {
            out.fill(0.0);
            peaks.fill(0.0);
        }
    }

    /// The runs of the rows of a step, by block of peaks, then by row.
    fn search(
        &mut self,
        net: &Net,
        kernel: &Kernel,
        per_rms: f32,
        columns: &Range<usize>,
        rows: Range<usize>,
        runs: &mut Vec<Run>,
    ) {
        let floor = (per_rms * net.rms_floor(columns.clone(), rows.clone())).max(0.0);
        let (mut smooth, mut rms) = ([[0f32; BLOCK]], [0f32; BLOCK]);
        for left in columns.clone().step_by(GROUP * BLOCK) {
            let bounds = &mut self.bounds[..rows.len()];
            kernel.across_rows(&self.peaks[(left - columns.start) / GROUP..], PEAKS, bounds);
            let part = left..(left + GROUP * BLOCK).min(columns.end);
            for (j, bounds) in rows.clone().zip(bounds) {
                for (x, bounds) in part.clone().step_by(BLOCK).zip(bounds.chunks_exact(BLOCK / GROUP)) {
                    if !bounds.iter().fold(false, |any, v| any | (*v > floor)) {
                        continue;
                    }
                    let from = (j - rows.start) * STRIDE + x - columns.start;
                    kernel.across_rows(&self.filtered[from..], STRIDE, &mut smooth);
                    if smooth[0].iter().fold(false, |any, v| any | (*v > floor)) {
                        let width = BLOCK.min(columns.end - x);
                        net.rms(j, x, &mut rms[..width]);
                        let above = smooth[0][..width].iter().zip(&rms).map(|(v, r)| *v > per_rms * r && *v > 0.0);
                        runs_of_part(j, x, above, runs);
                    }
                }
            }
        }
    }
}
