//! A separable Gaussian filter, along rows and across them, in blocks of columns.
//!
//! Electrons in, electrons out (the kernel sums to 1). The taps are symmetric: the two pixels of a tap are added before
//! they are weighed, from the middle outwards, for every pixel in the same order whatever the width of the machine.

use multiversion::multiversion;
use ndarray::Array2;

use crate::photometry::centroid::FWHM_PER_SIGMA;

/// Columns filtered side by side: four AVX-512 registers of sums, a cache line of loads.
pub(crate) const BLOCK: usize = 64;

/// Columns whose highest pixel stands for them in a first look.
pub(crate) const GROUP: usize = 8;

/// A separable Gaussian kernel.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    taps: Vec<f32>,
}

impl Kernel {
    /// The filter of the given FWHM \[px\], at least 1 px and at most 60 px, out to 3 σ.
    pub fn gaussian(fwhm_px: f64) -> Self {
        let sigma = if fwhm_px.is_finite() { fwhm_px.clamp(1.0, 60.0) } else { 3.0 } / FWHM_PER_SIGMA;
        let radius = (3.0 * sigma).ceil() as i64;
        let weights: Vec<f64> = (-radius..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        Self { taps: weights.iter().map(|w| (w / sum) as f32).collect() }
    }

    /// The kernel of a variance: each weight squared, not normalised.
    pub fn squared(&self) -> Self {
        Self { taps: self.taps.iter().map(|k| k * k).collect() }
    }

    /// The weights, which sum to 1.
    pub fn taps(&self) -> &[f32] {
        &self.taps
    }

    /// Half the width \[px\].
    pub fn radius(&self) -> usize {
        self.taps.len() / 2
    }

    /// σ of white noise after the filter, per σ before it: Σ k² of one axis, since both axes multiply.
    pub fn noise_factor(&self) -> f64 {
        self.taps.iter().map(|k| f64::from(*k).powi(2)).sum()
    }

    /// Filters one row of whole blocks; `padded` holds it with a margin of the radius on both sides.
    pub fn along_row(&self, padded: &[f32], out: &mut [f32]) {
        along(&self.taps[self.radius()..], padded, out);
    }

    /// Filters one block of columns across rows `stride` apart: a row of `out` is the middle of the radius before and
    /// after it, so `rows` begins a radius above `out`.
    pub fn across_rows(&self, rows: &[f32], stride: usize, out: &mut [[f32; BLOCK]]) {
        across(&self.taps[self.radius()..], rows, stride, out);
    }
}

/// Σ k · neighbours of each pixel; `half` = the middle tap and those after it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn along(half: &[f32], padded: &[f32], out: &mut [f32]) {
    let r = half.len() - 1;
    let (blocks, _) = out.as_chunks_mut::<BLOCK>();
    for (b, out) in blocks.iter_mut().enumerate() {
        let around = &padded[b * BLOCK..][..BLOCK + 2 * r];
        let middle = &around[r..r + BLOCK];
        let mut sum = [0f32; BLOCK];
        for l in 0..BLOCK {
            sum[l] = half[0] * middle[l];
        }
        for (t, &k) in half.iter().enumerate().skip(1) {
            let (left, right) = (&around[r - t..r - t + BLOCK], &around[r + t..r + t + BLOCK]);
            for l in 0..BLOCK {
                sum[l] += k * (left[l] + right[l]);
            }
        }
        *out = sum;
    }
}

/// As [`along`], for rows of `stride` pixels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn across(half: &[f32], rows: &[f32], stride: usize, out: &mut [[f32; BLOCK]]) {
    let r = half.len() - 1;
    for (j, out) in out.iter_mut().enumerate() {
        let middle = &rows[(j + r) * stride..][..BLOCK];
        let mut sum = [0f32; BLOCK];
        for l in 0..BLOCK {
            sum[l] = half[0] * middle[l];
        }
        for (t, &k) in half.iter().enumerate().skip(1) {
            let (above, below) = (&rows[(j + r - t) * stride..][..BLOCK], &rows[(j + r + t) * stride..][..BLOCK]);
            for l in 0..BLOCK {
                sum[l] += k * (above[l] + below[l]);
            }
        }
        *out = sum;
    }
}

/// The highest of every [`GROUP`] pixels of a row of whole blocks.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
pub(crate) fn group_peaks(row: &[f32], out: &mut [f32]) {
    // not f32::max, which looks for NaN: there is none
    let higher = |a: f32, b: f32| if a > b { a } else { b };
    for (row, out) in row.as_chunks::<BLOCK>().0.iter().zip(out.as_chunks_mut::<{ BLOCK / GROUP }>().0) {
        let (mut of_2, mut of_4) = ([0f32; BLOCK / 2], [0f32; BLOCK / 4]);
        for l in 0..BLOCK / 2 {
            of_2[l] = higher(row[2 * l], row[2 * l + 1]);
        }
        for l in 0..BLOCK / 4 {
            of_4[l] = higher(of_2[2 * l], of_2[2 * l + 1]);
        }
        for l in 0..BLOCK / 8 {
            out[l] = higher(of_4[2 * l], of_4[2 * l + 1]);
        }
    }
}

/// Filters a small image, held row by row; outside it is 0.
pub(crate) fn smooth_image(image: &Array2<f32>, kernel: &Kernel) -> Array2<f32> {
    let (ny, nx) = image.dim();
    let (r, stride) = (kernel.radius(), nx.next_multiple_of(BLOCK));
    let mut filtered = vec![0f32; (ny + 2 * r) * stride];
    let mut padded = vec![0f32; stride + 2 * r];
    let rows = image.as_slice().unwrap_or_default().chunks_exact(nx.max(1));
    for (row, out) in rows.zip(filtered.chunks_exact_mut(stride.max(1)).skip(r)) {
        padded[r..r + nx].copy_from_slice(row);
        kernel.along_row(&padded, out);
    }
    let mut out = Array2::zeros((ny, nx));
    let mut block = vec![[0f32; BLOCK]; ny];
    let all = out.as_slice_mut().unwrap_or_default();
    for first in (0..nx).step_by(BLOCK) {
        kernel.across_rows(&filtered[first..], stride, &mut block);
        let columns = first..(first + BLOCK).min(nx);
        for (to, from) in all.chunks_exact_mut(nx).zip(&block) {
            to[columns.clone()].copy_from_slice(&from[..columns.len()]);
        }
    }
    out
}

#[cfg(test)]
#[path = "smooth_tests.rs"]
mod tests;
