//! Which pixels an aperture covers, row by row, and by how much.
//!
//! Full-frame columns and rows. Inside the outline no pixel is integrated. It does not cover sky, masks or errors.

use std::ops::Range;

use ndarray::Array2;

use super::outline::Outline;
use super::oval::LANES;
use super::shape::Shape;
use crate::frames::Frame;

/// The pixels that exist: full-frame columns `x0..x1` and rows `y0..y1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// First column.
    pub x0: usize,
    /// One past the last column.
    pub x1: usize,
    /// First row.
    pub y0: usize,
    /// One past the last row.
    pub y1: usize,
}

impl Bounds {
    /// The pixels a frame holds.
    #[must_use]
    pub fn of<U>(frame: &Frame<U>) -> Self {
        let ((x0, y0), (ny, nx)) = (frame.origin_px, frame.pixels.dim());
        Self { x0, x1: x0 + nx, y0, y1: y0 + ny }
    }

    /// Whether a circle around a position lies wholly on these pixels.
    #[must_use]
    pub fn hold(&self, x_px: f64, y_px: f64, r_px: f64) -> bool {
        x_px - r_px >= self.x0 as f64 - 0.5
            && x_px + r_px <= self.x1 as f64 - 0.5
            && y_px - r_px >= self.y0 as f64 - 0.5
            && y_px + r_px <= self.y1 as f64 - 0.5
    }
}

/// The integers i in `lo..hi` whose unit cells meet the interval from `from` to `to`.
#[inline]
pub(crate) fn cells(from: f64, to: f64, lo: usize, hi: usize) -> Range<usize> {
    if from.is_nan() || to.is_nan() || from > to {
        return lo..lo;
    }
    // clamped above zero first, a cast is the floor: without SSE 4.1 `floor` is a function
    let first = (from + 0.5).clamp(lo as f64, hi as f64) as usize;
    let last = (to + 0.5).clamp(lo as f64 - 1.0, hi as f64 - 1.0);
    let end = if last < 0.0 { 0 } else { last as usize + 1 };
    first..end.max(first)
}

/// Calls `visit(i, j, fraction)` for every pixel (column i, row j) of `bounds` that the shape at (`x`, `y`) covers.
///
/// Rows in ascending order, columns in ascending order within a row. Pixels wholly inside have exactly 1, found from the
/// chords at the two edges of the row (the shape is convex); only outline pixels are integrated. A position that is not
/// finite or a shape without area visits nothing.
pub fn for_each_pixel(shape: &Shape, x: f64, y: f64, bounds: Bounds, mut visit: impl FnMut(usize, usize, f64)) {
    for_each_row(shape, x, y, bounds, |first, j, shares| {
        for (i, share) in (first..).zip(shares).filter(|(_, share)| **share > 0.0) {
            visit(i, j, *share);
        }
    });
}

/// The same pixels row by row: `visit(first, j, shares)` with the shares of the columns from `first` on, so that a row
/// can be summed as a slice. Those at its ends may be 0.
pub(crate) fn for_each_row(shape: &Shape, x: f64, y: f64, bounds: Bounds, mut visit: impl FnMut(usize, usize, &[f64])) {
    if !(shape.is_drawn() && x.is_finite() && y.is_finite()) {
        return;
    }
    let outline = Outline::of(shape);
    let oval = outline.wide_oval();
    let (right, right_dy) = outline.rightmost();
    let top = outline.top();
    let rows = cells(y - top, y + top, bounds.y0, bounds.y1);
    // edges of pixels: i − ½ is exact, so neighbours and rows agree on them to the bit
    let column_edge = |i: usize| (i as f64 - 0.5) - x;
    let row_edge = |j: usize| (j as f64 - 0.5) - y;
    let mut shares = Vec::new();
    let mut at_high = outline.chord(row_edge(rows.start));
    for j in rows {
        let (low, high) = (row_edge(j), row_edge(j + 1));
        let at_low = std::mem::replace(&mut at_high, outline.chord(high));
        // the range of dx the shape reaches in this row, and the range it fills
        let (mut reach, mut fill) = ((f64::INFINITY, f64::NEG_INFINITY), (f64::NEG_INFINITY, f64::INFINITY));
        for chord in [at_low, at_high] {
            match chord {
                Some((l, r)) => {
                    reach = (reach.0.min(l), reach.1.max(r));
                    fill = (fill.0.max(l), fill.1.min(r));
                }
                None => fill = (f64::INFINITY, f64::NEG_INFINITY),
            }
        }
        if (low..=high).contains(&right_dy) {
            reach.1 = right;
        }
        if (low..=high).contains(&-right_dy) {
            reach.0 = -right;
        }
        if reach.0 > reach.1 {
            // neither edge of the row cuts the shape: it lies wholly between them
            reach = (-right, right);
        }
        // a little slack on both sides: rounding must not lose a sliver
        let reached = cells(x + reach.0 - 1e-9, x + reach.1 + 1e-9, bounds.x0, bounds.x1);
        let filled = columns_within(fill, &reached, x, column_edge);
        let row = oval.map(|oval| oval.row(low, high, at_low, at_high));
        shares.clear();
        shares.resize(reached.len(), 1.0);
        // the outline's pixels, those left of the filled ones and those right of them, as one sequence
        let (n_left, n) = (filled.start - reached.start, reached.len() - filled.len());
        let place = |k: usize| if k < n_left { k } else { k + filled.len() };
        match &row {
            Some(row) => {
                for k in (0..n).step_by(LANES) {
                    let (mut left, mut right) = ([0.0; LANES], [0.0; LANES]);
                    for lane in 0..LANES {
                        let i = reached.start + place(k + lane);
                        (left[lane], right[lane]) = (column_edge(i), column_edge(i + 1));
                    }
                    let of_block = row.shares(&left, &right);
                    for lane in 0..LANES.min(n - k) {
                        shares[place(k + lane)] = of_block[lane];
                    }
                }
            }
            None => {
                for k in (0..n).map(place) {
                    shares[k] = outline.pixel_fraction((reached.start + k) as f64 - x, j as f64 - y);
                }
            }
        }
        if !shares.is_empty() {
            visit(reached.start, j, &shares);
        }
    }
}

/// The columns of `reached` whose pixels lie wholly in the range `fill` of dx; without any, an empty range at its end.
fn columns_within(
    fill: (f64, f64),
    reached: &Range<usize>,
    x: f64,
    column_edge: impl Fn(usize) -> f64,
) -> Range<usize> {
    let nothing = reached.end..reached.end;
    if fill.0 > fill.1 {
        return nothing;
    }
    // a guess by rounding, at most two off, corrected by the exact test
    let clamp = |v: f64| v.clamp(reached.start as f64, reached.end as f64) as usize;
    let mut first = clamp(fill.0 + x + 0.5);
    for _ in 0..2 {
        first += usize::from(first < reached.end && column_edge(first) < fill.0);
    }
    let mut end = clamp(fill.1 + x + 1.5);
    for _ in 0..2 {
        end -= usize::from(end > first && column_edge(end) > fill.1);
    }
    if first < end { first..end } else { nothing }
}

/// Sum of the pixels in an aperture at (`x_px`, `y_px`): `Σ fᵢ pᵢ`, fᵢ the exact share of pixel i that it covers.
///
/// `pixels` has the shape (rows, columns); pixel `[[j, i]]` is the unit square centred on x = i, y = j. The sum has the unit
/// of the pixels. Nothing is subtracted and nothing is masked. What lies outside the image adds nothing, and an aperture
/// without area, or at a position that is not finite, gives 0.
///
/// ```
/// use satphot::ndarray::Array2;
/// use satphot::{Aperture, sum_aperture};
///
/// let flat = Array2::from_elem((32, 32), 2.0);
/// let circle = Aperture::Circle { r_px: 5.0 };
/// let sum = sum_aperture(&flat, &circle, 15.3, 16.8);
/// assert!((sum - 2.0 * circle.area_px()).abs() < 1e-9); // 2 per pixel times πr²
/// ```
#[must_use]
pub fn sum_aperture(pixels: &Array2<f64>, aperture: &Shape, x_px: f64, y_px: f64) -> f64 {
    shape_sum(pixels, aperture, x_px, y_px)
}

/// Sum of the pixels in a shape: the plain kernel, no sky, no mask.
#[must_use]
pub fn shape_sum(pixels: &Array2<f64>, shape: &Shape, x: f64, y: f64) -> f64 {
    let (ny, nx) = pixels.dim();
    let mut sum = 0.0;
    for_each_pixel(shape, x, y, Bounds { x0: 0, x1: nx, y0: 0, y1: ny }, |i, j, fraction| {
        sum += fraction * pixels[[j, i]];
    });
    sum
}

/// Sum of the pixels in a circle of radius `r` \[px\].
#[must_use]
pub fn circle_sum(pixels: &Array2<f64>, x: f64, y: f64, r: f64) -> f64 {
    shape_sum(pixels, &Shape::Circle { r_px: r }, x, y)
}
