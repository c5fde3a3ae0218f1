//! The cutout in cells: squares of pixels a quarter of a star wide, in which the target and the trails are looked for.
//!
//! Electrons per pixel; columns and rows of cells. Smoothing at 1, 2, 4 and 8 FWHM costs less and less this way.
//! It does not cover fluxes, which are measured in pixels.

use multiversion::multiversion;
use ndarray::Array2;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::smooth::{Kernel, smooth_image};

/// Widths of the filter, in units of the FWHM: the target may be larger and fainter than a star. The last is the
/// elongated filter, on squares of as many cells as the one before.
pub(crate) const SCALES: [usize; 5] = [1, 2, 4, 8, 8];
/// Index of the first filter wider than any star.
pub(crate) const WIDE_SCALE: usize = 2;
/// How many of them are round.
pub(crate) const ROUND: usize = 4;

/// An image of cells.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    /// Pixels on a side.
    pub bin: usize,
    /// Mean of the good pixels; NaN where fewer than half are good.
    pub mean: Array2<f32>,
}

impl Cells {
    /// The cells of an image of `(ny, nx)` pixels whose bad ones are NaN: `line(j, out)` writes row `j` of it.
    pub fn of_lines((ny, nx): (usize, usize), fwhm_px: f64, mut line: impl FnMut(usize, &mut [f32])) -> Self {
        let bin = ((fwhm_px / 4.0).floor() as usize).max(1);
        let across = nx / bin;
        let mut mean = Array2::zeros((ny / bin, across));
        let mut pixels = vec![0f32; nx];
        let (mut sum, mut n) = (vec![0f32; across], vec![0f32; across]);
        let least = 0.5 * (bin * bin) as f32;
        for (j, row) in mean.as_slice_mut().unwrap_or_default().chunks_exact_mut(across.max(1)).enumerate() {
            if bin == 1 {
                line(j, row);
                continue;
            }
            sum.fill(0.0);
            n.fill(0.0);
            for k in 0..bin {
                line(j * bin + k, &mut pixels);
                add_good(&pixels, bin, &mut sum, &mut n);
            }
            row.iter_mut()
                .zip(sum.iter().zip(&n))
                .for_each(|(o, (s, n))| *o = if *n >= least { s / n } else { f32::NAN });
        }
        Self { bin, mean }
    }

    /// A position of pixels in cells.
    pub fn in_cells(&self, at: f64) -> f64 {
        (at - 0.5 * (self.bin as f64 - 1.0)) / self.bin as f64
    }

    /// A position of cells in pixels.
    pub fn to_px(&self, at: f64) -> f64 {
        at * self.bin as f64 + 0.5 * (self.bin as f64 - 1.0)
    }
}

/// Adds the good pixels of a line to the sums of its cells, and their numbers.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn add_good(pixels: &[f32], bin: usize, sum: &mut [f32], n: &mut [f32]) {
    match bin {
        2 => add_good_of(pixels.as_chunks::<2>().0, sum, n),
        3 => add_good_of(pixels.as_chunks::<3>().0, sum, n),
        4 => add_good_of(pixels.as_chunks::<4>().0, sum, n),
        _ => add_good_of(pixels.chunks_exact(bin), sum, n),
    }
}

/// As [`add_good`], for cells whose width the compiler may know.
#[inline(always)]
fn add_good_of<T: AsRef<[f32]>>(cells: impl IntoIterator<Item = T>, sum: &mut [f32], n: &mut [f32]) {
    for (of_cell, (sum, n)) in cells.into_iter().zip(sum.iter_mut().zip(n)) {
        for v in of_cell.as_ref() {
            *sum += if v.is_finite() { *v } else { 0.0 };
            *n += if v.is_finite() { 1.0 } else { 0.0 };
        }
    }
}

/// Row `j` of an image held row by row, as all images of the cutout are.
pub(crate) fn row_of<T>(image: &Array2<T>, j: usize) -> &[T] {
    debug_assert!(image.is_standard_layout());
    image.as_slice().map_or(&[], |all| &all[j * image.ncols()..][..image.ncols()])
}

/// Column and row of the cells of an image for which `is_one` holds, row by row.
pub(crate) fn cells_where<T>(image: &Array2<T>, is_one: impl Fn(&T) -> bool) -> Vec<(usize, usize)> {
    let mut cells = Vec::new();
    for j in 0..image.nrows() {
        let row = row_of(image, j);
        if row.iter().any(&is_one) {
            cells.extend(row.iter().enumerate().filter(|(_, v)| is_one(v)).map(|(i, _)| (i, j)));
        }
    }
    cells
}

/// The inputs of the significance of an image, per cell: value, variance, and the systematic uncertainty of the value.
pub(crate) struct Layers {
    pub value: Array2<f32>,
    pub variance: Array2<f32>,
    pub uncertainty: Option<Array2<f32>>,
}

impl Layers {
    /// Signal-to-noise under a Gaussian of `fwhm` cells, on squares of `rebin` cells; cells in `hidden` do not count.
    ///
    /// Σ k x / √(Σ k² σ² + (Σ k d)²): x the value, σ² its variance, d its systematic uncertainty, k the kernel. Under a
    /// filter wider than a star, the uncertainties of several trails are independent: (Σ k d)² becomes C Σ k² d²
    /// ([`lines_in_quadrature`]).
    pub fn significance(&self, fwhm: f64, rebin: usize, hidden: Option<&Array2<bool>>) -> Array2<f32> {
        let area = (rebin * rebin) as f32;
        let squares = |of: &Array2<f32>, per: f32| self.squares(of, per, rebin, hidden);
        let kernel = Kernel::gaussian(fwhm / rebin as f64);
        let mut snr = smooth_image(&squares(&self.value, area), &kernel);
        let mut variance = smooth_image(&squares(&self.variance, area * area), &kernel.squared());
        match &self.uncertainty {
            None => {}
            Some(uncertainty) if rebin > 1 => {
                let squared = uncertainty.mapv(|d| d * d);
                let uncertainty = smooth_image(&squares(&squared, area * area), &kernel.squared());
                let along = lines_in_quadrature(fwhm, rebin as f64);
                variance.zip_mut_with(&uncertainty, |v, d| *v += along * d);
            }
            Some(uncertainty) => {
                let uncertainty = smooth_image(&squares(uncertainty, area), &kernel);
                variance.zip_mut_with(&uncertainty, |v, d| *v += d * d);
            }
        }
        snr.zip_mut_with(&variance, |s, v| *s = ratio(*s, *v));
        snr
    }

    /// Sums over squares of `rebin` cells, each divided by `per`, which is 1 for squares of one; what is not seen does not count.
    fn squares(&self, of: &Array2<f32>, per: f32, rebin: usize, hidden: Option<&Array2<bool>>) -> Array2<f32> {
        let (ny, nx) = of.dim();
        let across = nx.div_ceil(rebin);
        let mut out = Array2::zeros((ny.div_ceil(rebin), across));
        let mut line = vec![0f32; nx];
        let sees = |j: usize, line: &mut [f32]| {
            seen(row_of(of, j), row_of(&self.value, j), line);
            if let Some(hidden) = hidden {
                line.iter_mut().zip(row_of(hidden, j)).for_each(|(o, h)| *o = if *h { 0.0 } else { *o });
            }
        };
        let rows = out.as_slice_mut().unwrap_or_default().chunks_exact_mut(across.max(1));
        for (square, to) in rows.enumerate() {
            if rebin == 1 {
                sees(square, to);
                continue;
            }
            for j in square * rebin..((square + 1) * rebin).min(ny) {
                sees(j, &mut line);
                add_parts(&line, rebin, per, to);
            }
        }
        out
    }

    /// The largest signal-to-noise under a Gaussian of 20 by 5 FWHM at any of eight angles, on squares of `rebin` cells:
    /// what shows a long faint target best. Cells in `hidden` do not count.
    pub fn elongated(&self, fwhm: f64, rebin: usize, hidden: Option<&Array2<bool>>) -> Array2<f32> {
        let area = (rebin * rebin) as f32;
        let value = self.squares(&self.value, area, rebin, hidden);
        let variance = self.squares(&self.variance, area * area, rebin, hidden);
        let uncertainty = self.uncertainty.as_ref().map(|d| self.squares(d, area, rebin, hidden));
        let fwhm = fwhm / rebin as f64;
        let mut best = Array2::zeros(value.dim());
        for k in 0..ANGLES {
            let theta = std::f64::consts::PI * k as f64 / ANGLES as f64;
            let taps = elongated_taps(LONG_FWHM.0 * fwhm, LONG_FWHM.1 * fwhm, theta);
            let squared: Vec<_> = taps.iter().map(|&(dj, di, w)| (dj, di, w * w)).collect();
            let (sum, noise) = (filtered(&value, &taps), filtered(&variance, &squared));
            let uncertainty = uncertainty.as_ref().map(|d| filtered(d, &taps));
            for (at, b) in best.indexed_iter_mut() {
                let d = uncertainty.as_ref().map_or(0.0, |d| d[at]);
                *b = f32::max(*b, ratio(sum[at], noise[at] + d * d));
            }
        }
        best
    }
}

/// C = 4π S m, m = S t/√(S² + t²): what makes C Σ k² d² the (Σ k d)² of one trail as wide as a star through the middle.
///
/// S and t = σ of the kernel k, `fwhm` cells wide, and of a star; of n trails the squares are then added.
pub(crate) fn lines_in_quadrature(fwhm: f64, rebin: f64) -> f32 {
    let (kernel, star) = (fwhm / FWHM_PER_SIGMA, fwhm / rebin / FWHM_PER_SIGMA);
    (4.0 * std::f64::consts::PI * kernel * kernel * star / kernel.hypot(star)) as f32
}

/// Length and width of the elongated filter \[FWHM\].
const LONG_FWHM: (f64, f64) = (20.0, 5.0);
/// Its angles.
const ANGLES: usize = 8;

/// Offsets and weights of an elongated Gaussian out to 2.5 σ.
fn elongated_taps(long: f64, wide: f64, theta: f64) -> Vec<(isize, isize, f32)> {
    let (a, b) = (long.max(1.0) / FWHM_PER_SIGMA, wide.max(1.0) / FWHM_PER_SIGMA);
    let (sin, cos) = theta.sin_cos();
    let reach = (2.5 * a).ceil() as isize;
    let mut taps = Vec::new();
    for dj in -reach..=reach {
        for di in -reach..=reach {
            let (u, v) = (di as f64 * cos + dj as f64 * sin, dj as f64 * cos - di as f64 * sin);
            let r2 = (u / a).powi(2) + (v / b).powi(2);
            if r2 < 6.25 {
                taps.push((dj, di, (-0.5 * r2).exp() as f32));
            }
        }
    }
    taps
}

/// Columns filtered side by side.
const LANES: usize = 32;

/// Σ weight · image; outside it is 0.
fn filtered(image: &Array2<f32>, taps: &[(isize, isize, f32)]) -> Array2<f32> {
    let (ny, nx) = image.dim();
    let r = taps.iter().map(|(dj, di, _)| dj.unsigned_abs().max(di.unsigned_abs())).max().unwrap_or(0);
    let width = nx.next_multiple_of(LANES);
    let stride = width + 2 * r;
    let mut padded = vec![0f32; (ny + 2 * r) * stride];
    for j in 0..ny {
        padded[(j + r) * stride + r..][..nx].copy_from_slice(row_of(image, j));
    }
    let place = |d: isize| d.wrapping_add_unsigned(r) as usize;
    let taps: Vec<(usize, f32)> = taps.iter().map(|&(dj, di, w)| (place(dj) * stride + place(di), w)).collect();
    let mut out = Array2::zeros((ny, nx));
    let mut line = vec![0f32; width];
    for (j, mut to) in out.rows_mut().into_iter().enumerate() {
        weighed(&padded[j * stride..], &taps, &mut line);
        to.iter_mut().zip(&line).for_each(|(to, from)| *to = *from);
    }
    out
}

/// Σ weight · pixel at each offset, for a row of whole lanes; every pixel in the order of the taps.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn weighed(padded: &[f32], taps: &[(usize, f32)], out: &mut [f32]) {
    for (b, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let mut sum = [0f32; LANES];
        for &(at, w) in taps {
            let from = &padded[b * LANES + at..][..LANES];
            for l in 0..LANES {
                sum[l] += w * from[l];
            }
        }
        *out = sum;
    }
}

/// The values of a row, 0 where a value is bad.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn seen(of: &[f32], value: &[f32], out: &mut [f32]) {
    for ((o, v), x) in out.iter_mut().zip(of).zip(value) {
        *o = if x.is_finite() { *v } else { 0.0 };
    }
}

/// Adds the sums of `rebin` neighbours of a line, each divided by `per`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn add_parts(line: &[f32], rebin: usize, per: f32, to: &mut [f32]) {
    match rebin {
        2 => add_whole_parts::<2>(line, per, to),
        4 => add_whole_parts::<4>(line, per, to),
        8 => add_whole_parts::<8>(line, per, to),
        _ => to.iter_mut().zip(line.chunks(rebin)).for_each(|(o, part)| *o += part.iter().sum::<f32>() / per),
    }
}

/// As [`add_parts`], for a number of neighbours the compiler knows.
#[inline(always)]
fn add_whole_parts<const N: usize>(line: &[f32], per: f32, to: &mut [f32]) {
    let (whole, rest) = line.as_chunks::<N>();
    to.iter_mut().zip(whole).for_each(|(o, part)| *o += part.iter().sum::<f32>() / per);
    if let (Some(o), false) = (to.get_mut(whole.len()), rest.is_empty()) {
        *o += rest.iter().sum::<f32>() / per;
    }
}

/// Value over the root of its variance; 0 where there is none.
fn ratio(value: f32, variance: f32) -> f32 {
    if variance > 0.0 { value / variance.sqrt() } else { 0.0 }
}

/// The cells of squares of `scale` cells.
pub(crate) fn cells_of(squares: &[(usize, usize)], scale: usize, (ny, nx): (usize, usize)) -> Vec<(usize, usize)> {
    let mut cells = Vec::with_capacity(squares.len() * scale * scale);
    for &(i, j) in squares {
        for jj in j * scale..((j + 1) * scale).min(ny) {
            for ii in i * scale..((i + 1) * scale).min(nx) {
                cells.push((ii, jj));
            }
        }
    }
    cells
}

/// Marks the cells of squares of `scale` cells.
pub(crate) fn paint(image: &mut Array2<bool>, squares: &[(usize, usize)], scale: usize) {
    cells_of(squares, scale, image.dim()).into_iter().for_each(|(i, j)| image[[j, i]] = true);
}

/// Every true cell grown by `by` cells along x and y.
pub(crate) fn grown(image: &Array2<bool>, by: usize) -> Array2<bool> {
    let (ny, nx) = image.dim();
    let mut out = Array2::from_elem((ny, nx), false);
    let any: Vec<bool> = (0..ny).map(|j| row_of(image, j).contains(&true)).collect();
    let rows = || (0..ny).filter(|j| any[*j]).map(|j| row_of(image, j));
    let first = rows().filter_map(|row| row.iter().position(|v| *v)).min();
    let last = rows().filter_map(|row| row.iter().rposition(|v| *v)).max();
    let Some((first, last)) = first.zip(last) else { return out };
    // columns that it can reach
    let columns = first.saturating_sub(by)..(last + by + 1).min(nx);
    let width = columns.len();
    // along x; a row of nothing stays that
    let mut along = vec![false; ny * width];
    for (j, to) in along.chunks_exact_mut(width).enumerate().filter(|(j, _)| any[*j]) {
        let mut until = 0; // columns below this are already grown
        for (i, _) in row_of(image, j)[columns.clone()].iter().enumerate().filter(|(_, v)| **v) {
            let end = (i + by + 1).min(width);
            to[i.saturating_sub(by).max(until)..end].fill(true);
            until = end;
        }
    }
    // along y, forth and back: for how many rows a cell of each column still reaches
    let reach = u32::try_from(by + 1).unwrap_or(u32::MAX);
    let all = out.as_slice_mut().unwrap_or_default();
    for back in [false, true] {
        let (mut left, mut rows_left) = (vec![0u32; width], 0);
        for k in 0..ny {
            let j = if back { ny - 1 - k } else { k };
            let before = rows_left;
            rows_left = if any[j] { reach } else { rows_left.saturating_sub(1) };
            if before.max(rows_left) > 0 {
                carry(&along[j * width..][..width], reach, &mut left, &mut all[j * nx..][columns.clone()]);
            }
        }
    }
    out
}

/// One row of growing along y: `left` = rows for which a cell of each column still reaches.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn carry(from: &[bool], reach: u32, left: &mut [u32], out: &mut [bool]) {
    for ((from, left), out) in from.iter().zip(left).zip(out) {
        *left = if *from { reach } else { left.saturating_sub(1) };
        *out |= *left > 0;
    }
}

#[cfg(test)]
#[path = "cells_tests.rs"]
mod tests;
