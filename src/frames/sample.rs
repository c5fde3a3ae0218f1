//! A fair part of a frame's raw pixels: square blocks spread over the clip circle, or every value counted in one pass.
//!
//! ADU as in the file, blocks of 64x64 px. Bounded in time and memory whatever the frame's size. It does not cover what
//! the values mean ([`crate::detector::adc`], [`crate::detector::transfer`]).

use super::clip::Region;
use super::exposure::Exposure;
use super::read::Pixels;
use crate::base::error::Result;
use crate::base::pages::zeros;
use crate::fits::raw::guarded;

/// Side of a block \[px\].
const BLOCK_PX: usize = 64;
/// Blocks read of one frame: 0.8 Mpx give a variance to 0.2 %.
const MAX_BLOCKS: usize = 192;

/// Where the blocks of a frame lie: the same for every frame of one size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Blocks {
    /// Side of each block \[px\].
    pub side_px: usize,
    /// First column and row of each block, in rows from the bottom.
    places: Vec<(usize, usize)>,
}

impl Blocks {
    /// Blocks evenly spread over the clip circle of a frame of `size_px`; `None` if not even one of 8x8 px fits.
    ///
    /// Blocks are 64 px wide, or a fourth of a smaller frame; at most 192 of them, whole blocks inside the circle only.
    #[must_use]
    pub fn layout(size_px: (usize, usize), clip_radius_px: Option<f64>) -> Option<Blocks> {
        if size_px.0 == 0 || size_px.1 == 0 {
            return None;
        }
        let region = Region::new(size_px, clip_radius_px);
        let side_px = (region.size_px.0.min(region.size_px.1) / 4).min(BLOCK_PX);
        if side_px < 8 {
            return None;
        }
        let (columns, rows) = (region.size_px.0 / side_px, region.size_px.1 / side_px);
        let inside = |i: usize, j: usize| {
            let (first, end) = (i * side_px, (i + 1) * side_px);
            [j * side_px, (j + 1) * side_px - 1].into_iter().all(|row| {
                let kept = region.inside(row);
                kept.start <= first && end <= kept.end
            })
        };
        let mut stride = 1;
        loop {
            let places: Vec<(usize, usize)> = (stride / 2..rows)
                .step_by(stride)
                .flat_map(|j| (stride / 2..columns).step_by(stride).map(move |i| (i, j)))
                .filter(|(i, j)| inside(*i, *j))
                .map(|(i, j)| (region.origin_px.0 + i * side_px, region.origin_px.1 + j * side_px))
                .collect();
            if places.len() <= MAX_BLOCKS {
                return (!places.is_empty()).then_some(Blocks { side_px, places });
            }
            stride += 1;
        }
    }

    /// Number of blocks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Reads the blocks of one frame, each `side_px`² values in rows \[ADU\]; BLANK is NaN.
    ///
    /// Whole bands of rows are read at once, so that a compressed row is unpacked only once.
    ///
    /// # Errors
    /// [`crate::Error::Fits`] if the file is damaged, or not of the size the blocks were laid out for.
    pub fn read(&self, exposure: &Exposure) -> Result<Vec<Vec<f32>>> {
        let side = self.side_px;
        guarded(&exposure.path, || {
            let mut pixels = Pixels::open(&exposure.path, &exposure.header)?;
            let mut blocks = Vec::with_capacity(self.places.len());
            let mut band = Vec::new();
            for row in self.places.chunk_by(|a, b| a.1 == b.1) {
                let (Some(first), Some(last)) = (row.first(), row.last()) else { continue };
                let width = last.0 + side - first.0;
                band.resize(width * side, 0f32);
                pixels.read(*first, (width, side), &mut band)?;
                blocks.extend(row.iter().map(|(x, _)| -> Vec<f32> {
                    let from = x - first.0;
                    band.chunks(width).flat_map(|line| line[from..from + side].iter().copied()).collect()
                }));
            }
            Ok(blocks)
        })
    }
}

/// Rows of a frame from which it is decided whether it was ever filled.
const FILL_ROWS: usize = 5;

/// The one value \[ADU\] that all pixels of five rows inside the clip circle have, if they do: no sky, no bias and no
/// flat has a row without noise, but the file of a camera that stopped before it wrote the pixels has. BLANK is not a
/// value.
///
/// # Errors
/// [`crate::Error::Fits`] if the file is damaged or holds no image.
pub fn never_filled(exposure: &Exposure, clip_radius_px: Option<f64>) -> Result<Option<f32>> {
    if exposure.size_px.0 * exposure.size_px.1 < 64 {
        return Ok(None); // too few to decide
    }
    let region = Region::new(exposure.size_px, clip_radius_px);
    let (nx, ny) = region.size_px;
    guarded(&exposure.path, || {
        let mut pixels = Pixels::open(&exposure.path, &exposure.header)?;
        let mut row = zeros(&exposure.path, nx)?;
        let mut value = None;
        for k in 0..FILL_ROWS {
            let y = (2 * k + 1) * ny / (2 * FILL_ROWS);
            pixels.read((region.origin_px.0, region.origin_px.1 + y), (nx, 1), &mut row)?;
            let first = *value.get_or_insert(row[0]);
            if !row.iter().all(|v| *v == first) {
                return Ok(None);
            }
        }
        Ok(value)
    })
}

/// Reads a rectangle of `size_px` at `origin_px` in rows \[ADU\].
///
/// # Errors
/// [`crate::Error::Fits`] if it does not lie in the frame, or the file is damaged.
pub fn read_box(exposure: &Exposure, origin_px: (usize, usize), size_px: (usize, usize)) -> Result<Vec<f32>> {
    guarded(&exposure.path, || {
        let mut values = zeros(&exposure.path, size_px.0 * size_px.1)?;
        Pixels::open(&exposure.path, &exposure.header)?.read(origin_px, size_px, &mut values)?;
        Ok(values)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_lie_inside_the_circle_do_not_overlap_and_are_few() {
        for (size, clip) in
            [((9576, 6388), Some(2500.0)), ((9576, 6388), None), ((400, 400), Some(170.0)), ((40, 33), None)]
        {
            let blocks = Blocks::layout(size, clip).unwrap();
            assert!((1..=MAX_BLOCKS).contains(&blocks.len()), "{size:?}: {}", blocks.len());
            let (cx, cy) = ((size.0 as f64 - 1.0) / 2.0, (size.1 as f64 - 1.0) / 2.0);
            let side = blocks.side_px;
            for (n, (x, y)) in blocks.places.iter().enumerate() {
                for (i, j) in [(*x, *y), (x + side - 1, *y), (*x, y + side - 1), (x + side - 1, y + side - 1)] {
                    assert!(i < size.0 && j < size.1);
                    assert!(clip.is_none_or(|r| (i as f64 - cx).hypot(j as f64 - cy) <= r + 1e-9));
                }
                let apart = |a: usize, b: usize| a.abs_diff(b) >= side;
                assert!(blocks.places[..n].iter().all(|(u, v)| apart(*u, *x) || apart(*v, *y)));
            }
        }
        assert!(Blocks::layout((20, 20), None).is_none() && Blocks::layout((0, 5), None).is_none());
        // a circle too small for a block of its own
        assert!(Blocks::layout((400, 400), Some(3.0)).is_none());
    }
}
