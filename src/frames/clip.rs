//! The clip circle: which part of the detector is kept.
//!
//! Centre ((nx−1)/2, (ny−1)/2), full-frame pixels, 0-based. A pixel is inside if its centre is at most the radius away.

/// A rectangle of the full frame, and the circle inside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Region {
    /// First column and row.
    pub origin_px: (usize, usize),
    /// Columns and rows.
    pub size_px: (usize, usize),
    /// Full-frame size.
    pub full_size_px: (usize, usize),
    /// Radius of the circle \[px\]; absent = everything is inside.
    pub radius_px: Option<f64>,
}

impl Region {
    /// The bounding box of the circle on a frame of `full_size_px` (both at least 1).
    pub(crate) fn new(full_size_px: (usize, usize), radius_px: Option<f64>) -> Region {
        let (nx, ny) = full_size_px;
        let Some(r) = radius_px else {
            return Region { origin_px: (0, 0), size_px: (nx, ny), full_size_px, radius_px };
        };
        let span = |n: usize| {
            let centre = (n as f64 - 1.0) / 2.0;
            let first = (centre - r).ceil().max(0.0) as usize;
            let last = ((centre + r).floor().max(0.0) as usize).min(n.saturating_sub(1));
            // A circle that holds no pixel centre still keeps the middle.
            if first > last { (centre as usize, 1) } else { (first, last - first + 1) }
        };
        let ((x0, w), (y0, h)) = (span(nx), span(ny));
        Region { origin_px: (x0, y0), size_px: (w, h), full_size_px, radius_px }
    }

    /// Columns of the rectangle that are inside the circle in its row `j` (0-based in the rectangle).
    pub(crate) fn inside(&self, j: usize) -> std::ops::Range<usize> {
        let width = self.size_px.0;
        let Some(r) = self.radius_px else { return 0..width };
        let (cx, cy) = ((self.full_size_px.0 as f64 - 1.0) / 2.0, (self.full_size_px.1 as f64 - 1.0) / 2.0);
        let dy = (self.origin_px.1 + j) as f64 - cy;
        // dx² + dy² ≤ r²
        let half2 = r * r - dy * dy;
        if half2 < 0.0 {
            return 0..0;
        }
        let half = half2.sqrt();
        let x0 = self.origin_px.0 as f64;
        let first = (cx - half - x0).ceil().max(0.0) as usize;
        let end = ((cx + half - x0).floor() + 1.0).max(0.0) as usize;
        let end = end.min(width);
        first.min(end)..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_circle_holds_every_pixel_within_the_radius_and_no_other() {
        for (nx, ny, r) in [(20, 13, 5.0), (21, 21, 5.5), (9, 40, 30.0), (7, 7, 1.0), (8, 8, 0.7)] {
            let region = Region::new((nx, ny), Some(r));
            let mut kept = vec![false; nx * ny];
            for j in 0..region.size_px.1 {
                for i in region.inside(j) {
                    kept[(region.origin_px.1 + j) * nx + region.origin_px.0 + i] = true;
                }
            }
            let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
            for y in 0..ny {
                for x in 0..nx {
                    let within = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2) <= r * r;
                    assert_eq!(kept[y * nx + x], within, "{nx}x{ny} r={r} at ({x}, {y})");
                }
            }
        }
    }
}
