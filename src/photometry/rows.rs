//! Any part of a row of pixels less the sky.

use crate::frames::Electrons;
use crate::frames::Frame;
use ndarray::CowArray;
use ndarray::Ix2;
use std::ops::Range;

/// The rows of a frame, each a slice.
pub(crate) struct Rows<'a> {
    pub(super) pixels: CowArray<'a, f32, Ix2>,
    pub(super) mask: CowArray<'a, u8, Ix2>,
    pub(super) nx: usize,
}

impl<'a> Rows<'a> {
    /// The rows of a frame; only one whose rows are not laid out one after another is copied.
    pub fn of(frame: &'a Frame<Electrons>) -> Self {
        let (pixels, mask) = (frame.pixels.as_standard_layout(), frame.mask.as_standard_layout());
        Self { pixels, mask, nx: frame.pixels.ncols() }
    }

    /// Pixels and mask of a part of the local row `j`.
    pub fn part(&self, j: usize, columns: Range<usize>) -> (&[f32], &[u8]) {
        let at = j * self.nx + columns.start..j * self.nx + columns.end;
        // in standard layout there always is a slice
        let pixels = self.pixels.as_slice().map_or(&[][..], |p| &p[at.clone()]);
        (pixels, self.mask.as_slice().map_or(&[][..], |m| &m[at]))
    }
}
