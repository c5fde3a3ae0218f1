//! From the pixels of one grid to those of another by the area they share: what a pixel holds is neither lost nor made.
//!
//! Both grids are parallel; lengths in any one unit. Values are amounts (not densities), spread evenly over their pixel.

use ndarray::Array2;

/// Pixels along one axis: the lower edge of the first, the side of each, how many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ruler {
    pub start: f64,
    pub step: f64,
    pub n: usize,
}

impl Ruler {
    /// Upper edge of the last pixel.
    fn end(&self) -> f64 {
        self.start + self.step * self.n as f64
    }

    /// Which pixels of `to` a pixel of this ruler covers, and its share in each. What falls beyond `to` is given to none.
    fn shares(&self, k: usize, to: &Ruler) -> Vec<(usize, f64)> {
        let (low, high) = (self.start + k as f64 * self.step, self.start + (k + 1) as f64 * self.step);
        let index = |x: f64| ((x - to.start) / to.step).floor();
        let first = index(low.max(to.start)).max(0.0) as usize;
        let last = (index(high.min(to.end())).max(0.0) as usize).min(to.n.saturating_sub(1));
        let mut shares: Vec<(usize, f64)> = (first..=last)
            .map(|i| {
                let edge = to.start + i as f64 * to.step;
                (i, ((high.min(edge + to.step) - low.max(edge)) / self.step).max(0.0))
            })
            .collect();
        // a pixel that lies inside gives exactly all it has
        if low >= to.start
            && high <= to.end()
            && let Some(widest) = (0..shares.len()).max_by(|a, b| shares[*a].1.total_cmp(&shares[*b].1))
        {
            let others: f64 = shares.iter().enumerate().filter(|(i, _)| *i != widest).map(|(_, s)| s.1).sum();
            shares[widest].1 = 1.0 - others;
        }
        shares
    }
}

/// The amounts of `picture` (on `from`, given as x and y) on the pixels of `to`.
pub(super) fn resample(picture: &Array2<f64>, from: (Ruler, Ruler), to: (Ruler, Ruler)) -> Array2<f64> {
    // rows first, then columns: the area two pixels share is a product
    let mut wide = Array2::zeros((from.1.n, to.0.n));
    for i in 0..from.0.n {
        for (column, share) in from.0.shares(i, &to.0) {
            for j in 0..from.1.n {
                wide[[j, column]] += share * picture[[j, i]];
            }
        }
    }
    let mut out = Array2::zeros((to.1.n, to.0.n));
    for j in 0..from.1.n {
        for (row, share) in from.1.shares(j, &to.1) {
            out.row_mut(row).scaled_add(share, &wide.row(j));
        }
    }
    out
}

/// Sums of `by` times `by` pixels.
pub(super) fn bin(picture: &Array2<f64>, by: usize) -> Array2<f64> {
    let (ny, nx) = picture.dim();
    let mut out = Array2::zeros((ny / by, nx / by));
    for ((j, i), value) in picture.indexed_iter() {
        if let Some(pixel) = out.get_mut((j / by, i / by)) {
            *pixel += value;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_amount_arrives_on_finer_coarser_and_shifted_pixels() {
        let picture = Array2::from_shape_fn((17, 23), |(j, i)| ((3 * i + 7 * j) % 11) as f64);
        let from = (Ruler { start: -4.1, step: 0.37, n: 23 }, Ruler { start: 2.0, step: 0.37, n: 17 });
        for step in [0.05, 0.37, 0.371, 1.9, 40.0] {
            let n = |length: f64| (length / step).ceil() as usize + 2;
            let to = (
                Ruler { start: -4.1 - 0.7 * step, step, n: n(23.0 * 0.37) },
                Ruler { start: 2.0 - 0.01 * step, step, n: n(17.0 * 0.37) },
            );
            let out = resample(&picture, from, to);
            assert!((out.sum() / picture.sum() - 1.0).abs() < 1e-13, "{step}: {}", out.sum());
            // and its centre of light stays where it was, to half the coarser pixels' difference
            let centre = |p: &Array2<f64>, r: Ruler| {
                p.indexed_iter().map(|((_, i), v)| v * (r.start + (i as f64 + 0.5) * r.step)).sum::<f64>() / p.sum()
            };
            assert!((centre(&out, to.0) - centre(&picture, from.0)).abs() < 0.5 * step.max(0.37), "{step}");
        }
    }

    #[test]
    fn an_even_picture_stays_even_and_what_lies_outside_is_not_forced_in() {
        let picture = Array2::from_elem((8, 8), 2.0);
        let from = Ruler { start: 0.0, step: 1.0, n: 8 };
        let to = Ruler { start: 1.5, step: 0.5, n: 8 };
        let out = resample(&picture, (from, from), (to, to));
        assert!(out.iter().all(|v| (v - 0.5).abs() < 1e-14));
        let outside = Ruler { start: 6.0, step: 1.0, n: 8 };
        let out = resample(&picture, (from, from), (outside, outside));
        assert!((out.sum() - 8.0).abs() < 1e-13, "{}", out.sum());
        let away = Ruler { start: 100.0, step: 1.0, n: 3 };
        assert_eq!(resample(&picture, (from, from), (away, away)).sum(), 0.0);
    }

    #[test]
    fn binning_sums() {
        let picture = Array2::from_shape_fn((6, 9), |(j, i)| (10 * j + i) as f64);
        let out = bin(&picture, 3);
        assert_eq!(out.dim(), (2, 3));
        assert_eq!(out[[0, 0]], (0..3).flat_map(|j| (0..3).map(move |i| f64::from(10 * j + i))).sum::<f64>());
        assert_eq!(out.sum(), picture.sum());
    }
}
