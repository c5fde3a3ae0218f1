//! Means of small squares of an image: what the sky is fitted to.
//!
//! Electrons; columns and rows of a cutout. Hits do not count. It does not cover what lies on the sky: trails and targets are in the means.

use std::ops::Range;

use multiversion::multiversion;
use ndarray::Array2;

use super::cells::row_of;
use crate::photometry::clip::HIT_SIGMA;

/// Pixels that are added up side by side.
const LANES: usize = 8;

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
    let middle = |span: &Range<usize>| span.start as f64 + 0.5 * (span.len() as f64 - 1.0);
    let mut all = Vec::with_capacity((ny / size + 1) * (nx / size + 1));
    for y0 in (0..ny).step_by(size) {
        for x0 in (0..nx).step_by(size) {
            let (columns, rows) = (x0..(x0 + size).min(nx), y0..(y0 + size).min(ny));
            if let Some((mean, sd, n)) = mean_without_hits(pixels, (&columns, &rows), 0.5 * (size * size) as f64) {
                all.push(Block { x: middle(&columns), y: middle(&rows), mean, sd, n });
            }
        }
    }
    Blocks { size_px: size, all }
}

/// Mean, standard deviation and number of the pixels within 5 σ of the mean, twice over; `None` if fewer than `least` are good.
fn mean_without_hits(
    pixels: &Array2<f32>,
    (columns, rows): (&Range<usize>, &Range<usize>),
    least: f64,
) -> Option<(f64, f64, f64)> {
    let lines = || rows.clone().map(|j| &row_of(pixels, j)[columns.clone()]);
    let about = f64::from(*lines().flatten().find(|v| v.is_finite())?);
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut result = None;
    for round in 0..2 {
        let mut sums = [[0.0; LANES]; 3];
        lines().for_each(|line| add_up(line, about, (low, high), &mut sums));
        let [n, sum, square] = sums.map(|lanes| lanes.iter().sum::<f64>());
        if n < 2.0 || (round == 0 && n < least) {
            return result;
        }
        let mean = sum / n;
        let sd = ((square - sum * mean).max(0.0) / (n - 1.0)).sqrt();
        result = Some((about + mean, sd, n));
        (low, high) = (mean - HIT_SIGMA * sd, mean + HIT_SIGMA * sd);
    }
    result
}

/// Adds the good pixels of a line that are between two limits, all of them less `about`: their number, sum, and sum of squares.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn add_up(line: &[f32], about: f64, (low, high): (f64, f64), sums: &mut [[f64; LANES]; 3]) {
    let [mut n, mut sum, mut square] = *sums;
    let mut add = |l: usize, v: f32| {
        let d = f64::from(v) - about;
        let counts = v.is_finite() & (d >= low) & (d <= high);
        let d = if counts { d } else { 0.0 };
        n[l] += if counts { 1.0 } else { 0.0 };
        sum[l] += d;
        square[l] += d * d;
    };
    let (whole, rest) = line.as_chunks::<LANES>();
    for part in whole {
        (0..LANES).for_each(|l| add(l, part[l]));
    }
    rest.iter().enumerate().for_each(|(l, v)| add(l, *v));
    *sums = [n, sum, square];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_the_mean_and_scatter_of_its_good_pixels_without_hits() {
        let image = Array2::from_shape_fn((50, 67), |(j, i)| {
            let k = (j * 7919 + i * 104_729 + j * i * 31) % 1013;
            if k % 5 == 0 { f32::NAN } else { 1e4 + k as f32 * 0.37 + if k % 331 == 0 { 1e5 } else { 0.0 } }
        });
        for size in [4, 9, 16, 24] {
            let Blocks { size_px, all } = blocks(&image, size);
            assert_eq!(size_px, size);
            assert!(all.len() > 2, "{size}");
            for Block { x, y, mean, sd, n } in all {
                let span = |middle: f64, all: usize| {
                    let from = (middle / size as f64) as usize * size;
                    from..(from + size).min(all)
                };
                let (rows, columns) = (span(y, 50), span(x, 67));
                let own = image.slice(ndarray::s![rows, columns]);
                let mut own: Vec<f64> = own.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect();
                assert!(2 * own.len() >= size * size);
                let of = |values: &[f64]| {
                    let mean = values.iter().sum::<f64>() / values.len() as f64;
                    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                    (mean, (square / (values.len() as f64 - 1.0)).sqrt())
                };
                let (first, scatter) = of(&own);
                own.retain(|v| (v - first).abs() <= HIT_SIGMA * scatter);
                let (want, want_sd) = of(&own);
                assert_eq!(n, own.len() as f64, "{size}");
                assert!(
                    (mean - want).abs() < 1e-9 * want && (sd - want_sd).abs() < 1e-7 * want_sd,
                    "{mean} {want} {sd}"
                );
            }
        }
        // hardly anything is good
        assert!(blocks(&image.mapv(|v| if v > 1.2e4 { v } else { f32::NAN }), 8).all.is_empty());
    }
}
