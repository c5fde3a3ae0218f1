//! Pixels less the sky: any part of a row, and how far the mean sky of the frame lies above the mesh.
//!
//! Electrons. Bad and clipped pixels are 0, as sky is. It does not cover filters.

use super::rows::Rows;
use std::ops::Range;

use crate::frames::{Electrons, Frame, mask};
use crate::photometry::background::{Background, Pixels};
use crate::photometry::clip::clipped_sky;

/// About as many pixels as [`level_offset`] looks at.
const OFFSET_PX: usize = 100_000;

/// A frame and the sky under it.
pub(crate) struct Net<'a> {
    pub rows: Rows<'a>,
    pub background: &'a Background,
    /// Subtracted in addition to the mesh \[e⁻/px\].
    pub offset_e: f32,
    origin_px: (usize, usize),
}

impl<'a> Net<'a> {
    pub fn new(frame: &'a Frame<Electrons>, background: &'a Background, offset_e: f32) -> Self {
        Self { rows: Rows::of(frame), background, offset_e, origin_px: frame.origin_px }
    }

    /// A part of the local row `j` less the sky and its offset, 0 where it is bad or clipped; whether any pixel is not.
    pub fn part(&self, j: usize, columns: Range<usize>, out: &mut [f32]) -> bool {
        let x0 = self.origin_px.0 + columns.start;
        let (pixels, bits) = self.rows.part(j, columns);
        // what is wholly clipped costs one look at its mask, what is not begins with a usable pixel, mostly
        let usable = |m: &u8| m & UNUSABLE == 0;
        if !bits.first().is_some_and(usable) && !bits.iter().fold(false, |any, m| any | usable(m)) {
            out.fill(0.0);
            return false;
        }
        let pixels = Pixels { values: pixels, bits, unusable: UNUSABLE };
        self.background.above_row(self.origin_px.1 + j, x0, pixels, self.offset_e, out);
        true
    }

    /// Scatter of the sky of a part of the local row `j` from the local column `i` on.
    pub fn rms(&self, j: usize, i: usize, out: &mut [f32]) {
        self.background.rms_row(self.origin_px.1 + j, self.origin_px.0 + i, out);
    }

    /// A scatter that no pixel of a part of the frame lies below.
    pub fn rms_floor(&self, columns: Range<usize>, rows: Range<usize>) -> f32 {
        let (x, y) = self.origin_px;
        self.background.rms_floor(x + columns.start..x + columns.end, y + rows.start..y + rows.end)
    }
}

const UNUSABLE: u8 = mask::BAD | mask::CLIPPED;

/// By how much the mean sky of a frame lies above the mesh \[e⁻/px\].
///
/// A mode of skewed counts is low by some 0.4 e⁻ per pixel: nothing in one pixel, but a false σ or more once a filter
/// has averaged hundreds. Measured on about 100 000 pixels spread evenly, with the correction of the annulus sky.
pub(crate) fn level_offset(frame: &Frame<Electrons>, background: &Background) -> f32 {
    let (ny, nx) = frame.pixels.dim();
    let stride = (ny * nx / OFFSET_PX).max(1);
    // every row_stride-th row, and in it every column_stride-th pixel from a start that moves
    let row_stride = ((stride as f64).sqrt() as usize).max(1);
    let column_stride = stride.div_ceil(row_stride);
    let whole = Net::new(frame, background, 0.0);
    let mut net = vec![0f32; nx];
    let mut values = Vec::new();
    for (k, j) in (0..ny).step_by(row_stride).enumerate() {
        if whole.part(j, 0..nx, &mut net) {
            let part = net.iter().skip(k % column_stride).step_by(column_stride);
            values.extend(part.filter(|v| **v != 0.0).map(|v| f64::from(*v)));
        }
    }
    clipped_sky(&mut values, background.global_level(), 3.0).map_or(0.0, |(offset, _, _)| offset as f32)
}
