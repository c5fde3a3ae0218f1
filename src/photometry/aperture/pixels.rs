//! Which pixels an aperture covers, row by row, and by how much.
//!
//! Full-frame columns and rows. Inside the outline no pixel is integrated. Leaves out: sky, masks, errors.

use ndarray::Array2;

use super::Shape;
use super::outline::Outline;
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
pub(crate) fn cells(from: f64, to: f64, lo: usize, hi: usize) -> std::ops::Range<usize> {
    if from.is_nan() || to.is_nan() || from > to {
        return lo..lo;
    }
    let first = (from + 0.5).floor().clamp(lo as f64, hi as f64) as usize;
    let last = (to + 0.5).floor().clamp(lo as f64 - 1.0, hi as f64 - 1.0) + 1.0;
    first..(last.max(0.0) as usize).max(first)
}

/// Calls `visit(i, j, fraction)` for every pixel (column i, row j) of `bounds` that the shape at (`x`, `y`) covers.
///
/// Rows in ascending order, columns in ascending order within a row. Pixels wholly inside have exactly 1, found from the
/// chords at the two edges of the row (the shape is convex); only outline pixels are integrated. A position that is not
/// finite or a shape without area visits nothing.
pub fn for_each_pixel(shape: &Shape, x: f64, y: f64, bounds: Bounds, mut visit: impl FnMut(usize, usize, f64)) {
    if !(shape.is_drawn() && x.is_finite() && y.is_finite()) {
        return;
    }
    let outline = Outline::of(shape);
    let (right, right_dy) = outline.rightmost();
    let top = outline.top();
    for j in cells(y - top, y + top, bounds.y0, bounds.y1) {
        let (low, high) = (j as f64 - 0.5 - y, j as f64 + 0.5 - y);
        // the range of dx the shape reaches in this row, and the range it fills
        let (mut reach, mut fill) = ((f64::INFINITY, f64::NEG_INFINITY), (f64::NEG_INFINITY, f64::INFINITY));
        for dy in [low, high] {
            match outline.chord(dy) {
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
        for i in cells(x + reach.0 - 1e-9, x + reach.1 + 1e-9, bounds.x0, bounds.x1) {
            let dx = i as f64 - x;
            if dx - 0.5 >= fill.0 && dx + 0.5 <= fill.1 {
                visit(i, j, 1.0);
            } else {
                let fraction = outline.pixel_fraction(dx, j as f64 - y);
                if fraction > 0.0 {
                    visit(i, j, fraction);
                }
            }
        }
    }
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
