//! Means of small squares of an image: what the sky is fitted to.
//!
//! Electrons; columns and rows of a cutout. Hits do not count. It does not cover what lies on the sky: trails and targets are in the means.

use ndarray::{Array2, s};

use crate::photometry::clip::HIT_SIGMA;

/// Mean and scatter of a square of pixels about (`x`, `y`).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    pub x: f64,
    pub y: f64,
    pub mean: f64,
    pub sd: f64,
    pub n: f64,
}

/// The blocks of a cutout and their side \[px\].
#[derive(Debug)]
pub(crate) struct Blocks {
    pub size_px: usize,
    pub all: Vec<Block>,
}

/// The blocks of `size` pixels of an image that are at least half good (NaN is bad).
pub(crate) fn blocks(pixels: &Array2<f32>, size: usize) -> Blocks {
    let (ny, nx) = pixels.dim();
    let mut out = Vec::with_capacity((ny / size + 1) * (nx / size + 1));
    let mut values: Vec<f64> = Vec::with_capacity(size * size);
    for y0 in (0..ny).step_by(size) {
        for x0 in (0..nx).step_by(size) {
            let part = pixels.slice(s![y0..(y0 + size).min(ny), x0..(x0 + size).min(nx)]);
            values.clear();
            for row in part.rows() {
                values.extend(row.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)));
            }
            if 2 * values.len() < size * size {
                continue;
            }
            if let Some((mean, sd, n)) = mean_without_hits(&values) {
                let middle = |from: usize, length: usize| from as f64 + 0.5 * (length as f64 - 1.0);
                out.push(Block { x: middle(x0, part.ncols()), y: middle(y0, part.nrows()), mean, sd, n: n as f64 });
            }
        }
    }
    Blocks { size_px: size, all: out }
}

/// Mean, standard deviation and number of the values within 5 σ of the mean, twice over.
fn mean_without_hits(values: &[f64]) -> Option<(f64, f64, usize)> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut result = None;
    for _ in 0..2 {
        let (mut n, mut sum, mut square) = (0usize, 0.0, 0.0);
        let about = values.first().copied()?;
        for v in values.iter().filter(|v| **v >= low && **v <= high) {
            n += 1;
            sum += v - about;
            square += (v - about) * (v - about);
        }
        if n < 2 {
            return result;
        }
        let mean = sum / n as f64;
        let sd = ((square - sum * mean).max(0.0) / (n as f64 - 1.0)).sqrt();
        result = Some((about + mean, sd, n));
        (low, high) = (about + mean - HIT_SIGMA * sd, about + mean + HIT_SIGMA * sd);
    }
    result
}
