//! The cutout in cells: squares of pixels a quarter of a star wide, in which the target and the trails are looked for.
//!
//! Electrons per pixel; columns and rows of cells. Smoothing at 1, 2, 4 and 8 FWHM costs less and less this way.
//! Leaves out: fluxes, which are measured in pixels.

use ndarray::{Array2, Zip};

use crate::constants::FWHM_PER_SIGMA;
use crate::photometry::smooth::{Kernel, smooth_image};

/// An image of cells.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    /// Pixels on a side.
    pub bin: usize,
    /// Mean of the good pixels; NaN where fewer than half are good.
    pub mean: Array2<f32>,
}

impl Cells {
    /// Of an image whose bad pixels are NaN.
    pub fn of(pixels: &Array2<f32>, fwhm_px: f64) -> Self {
        let bin = ((fwhm_px / 4.0).floor() as usize).max(1);
        Self { bin, mean: binned(pixels, bin) }
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

/// Means over squares of `bin` pixels, NaN where fewer than half are good.
fn binned(pixels: &Array2<f32>, bin: usize) -> Array2<f32> {
    if bin == 1 {
        return pixels.clone();
    }
    let (ny, nx) = (pixels.nrows() / bin, pixels.ncols() / bin);
    let mut out = Array2::zeros((ny, nx));
    let (mut sum, mut n) = (vec![0f32; nx], vec![0f32; nx]);
    for (j, mut row) in out.rows_mut().into_iter().enumerate() {
        sum.fill(0.0);
        n.fill(0.0);
        for line in 0..bin {
            for (k, v) in pixels.row(j * bin + line).iter().take(nx * bin).enumerate() {
                if v.is_finite() {
                    sum[k / bin] += v;
                    n[k / bin] += 1.0;
                }
            }
        }
        let least = 0.5 * (bin * bin) as f32;
        row.iter_mut().zip(sum.iter().zip(&n)).for_each(|(o, (s, n))| *o = if *n >= least { s / n } else { f32::NAN });
    }
    out
}

/// What the significance of an image is made of, per cell: value, variance, and the systematic doubt about the value.
pub(crate) struct Layers {
    pub value: Array2<f32>,
    pub variance: Array2<f32>,
    pub doubt: Option<Array2<f32>>,
}

impl Layers {
    /// Signal-to-noise under a Gaussian of `fwhm` cells, on squares of `rebin` cells; cells in `hidden` do not count.
    ///
    /// Σ k x / √(Σ k² σ² + (Σ k d)²): x the value, σ² its variance, d the doubt, k the kernel. Under a filter wider than
    /// a star the doubts about several trails are independent: (Σ k d)² becomes C Σ k² d² ([`lines_in_quadrature`]).
    pub fn significance(&self, fwhm: f64, rebin: usize, hidden: Option<&Array2<bool>>) -> Array2<f32> {
        let area = (rebin * rebin) as f32;
        let squares = |of: &Array2<f32>, per: f32| self.squares(of, per, rebin, hidden);
        let kernel = Kernel::gaussian(fwhm / rebin as f64);
        let mut snr = smooth_image(&squares(&self.value, area), &kernel);
        let variance = smooth_image(&squares(&self.variance, area * area), &kernel.squared());
        match &self.doubt {
            None => Zip::from(&mut snr).and(&variance).for_each(|s, v| *s = ratio(*s, *v)),
            Some(doubt) if rebin > 1 => {
                let squared = doubt.mapv(|d| d * d);
                let mut doubt = smooth_image(&squares(&squared, area * area), &kernel.squared());
                let along = lines_in_quadrature(fwhm, rebin as f64);
                doubt.mapv_inplace(|d| along * d);
                Zip::from(&mut snr).and(&variance).and(&doubt).for_each(|s, v, d| *s = ratio(*s, v + d));
            }
            Some(doubt) => {
                let doubt = smooth_image(&squares(doubt, area), &kernel);
                Zip::from(&mut snr).and(&variance).and(&doubt).for_each(|s, v, d| *s = ratio(*s, v + d * d));
            }
        }
        snr
    }

    /// Sums over squares of `rebin` cells, each divided by `per`; what is not seen does not count.
    fn squares(&self, of: &Array2<f32>, per: f32, rebin: usize, hidden: Option<&Array2<bool>>) -> Array2<f32> {
        let (ny, nx) = of.dim();
        let mut out = Array2::zeros((ny.div_ceil(rebin), nx.div_ceil(rebin)));
        let mut line = vec![0f32; nx];
        for j in 0..ny {
            line.iter_mut().zip(of.row(j)).zip(self.value.row(j)).for_each(|((o, v), x)| {
                *o = if x.is_finite() { *v } else { 0.0 };
            });
            if let Some(hidden) = hidden {
                line.iter_mut().zip(hidden.row(j)).filter(|(_, h)| **h).for_each(|(o, _)| *o = 0.0);
            }
            let to = out.row_mut(j / rebin);
            to.into_iter().zip(line.chunks(rebin)).for_each(|(o, part)| *o += part.iter().sum::<f32>() / per);
        }
        out
    }

    /// The largest signal-to-noise under a Gaussian of 20 by 5 FWHM at any of eight angles, on squares of `rebin` cells:
    /// what shows a long faint target best.
    pub fn elongated(&self, fwhm: f64, rebin: usize) -> Array2<f32> {
        let area = (rebin * rebin) as f32;
        let value = self.squares(&self.value, area, rebin, None);
        let variance = self.squares(&self.variance, area * area, rebin, None);
        let doubt = self.doubt.as_ref().map(|d| self.squares(d, area, rebin, None));
        let fwhm = fwhm / rebin as f64;
        let mut best = Array2::zeros(value.dim());
        for k in 0..ANGLES {
            let theta = std::f64::consts::PI * k as f64 / ANGLES as f64;
            let taps = elongated_taps(LONG_FWHM.0 * fwhm, LONG_FWHM.1 * fwhm, theta);
            let squared: Vec<_> = taps.iter().map(|&(dj, di, w)| (dj, di, w * w)).collect();
            let (sum, noise) = (filtered(&value, &taps), filtered(&variance, &squared));
            let doubt = doubt.as_ref().map(|d| filtered(d, &taps));
            for (at, b) in best.indexed_iter_mut() {
                let d = doubt.as_ref().map_or(0.0, |d| d[at]);
                *b = f32::max(*b, ratio(sum[at], noise[at] + d * d));
            }
        }
        best
    }
}

/// C = 4π S m, m = S t/√(S² + t²): what makes C Σ k² d² the (Σ k d)² of one trail as wide as a star through the middle.
///
/// S and t = σ of the kernel k, `fwhm` cells wide, and of a star; of n trails the squares are then added.
fn lines_in_quadrature(fwhm: f64, rebin: f64) -> f32 {
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

/// Σ weight · image; outside it is 0.
fn filtered(image: &Array2<f32>, taps: &[(isize, isize, f32)]) -> Array2<f32> {
    let (ny, nx) = image.dim();
    let mut out: Array2<f32> = Array2::zeros((ny, nx));
    for &(dj, di, w) in taps {
        let rows = 0.max(-dj)..(ny as isize).min(ny as isize - dj);
        let columns = 0.max(-di)..(nx as isize).min(nx as isize - di);
        if columns.is_empty() {
            continue;
        }
        let n = columns.len();
        for j in rows {
            let from = image.row((j + dj) as usize);
            let from = from.slice(ndarray::s![columns.start + di..columns.start + di + n as isize]);
            let mut to = out.row_mut(j as usize);
            let mut to = to.slice_mut(ndarray::s![columns.start..columns.start + n as isize]);
            to.scaled_add(w, &from);
        }
    }
    out
}

/// Value over the root of its variance; 0 where there is none.
fn ratio(value: f32, variance: f32) -> f32 {
    if variance > 0.0 { value / variance.sqrt() } else { 0.0 }
}

/// Every true cell grown by `by` cells along x and y.
pub(crate) fn grown(image: &Array2<bool>, by: usize) -> Array2<bool> {
    let (ny, nx) = image.dim();
    let mut along = Array2::from_elem((ny, nx), false);
    let mut out = Array2::from_elem((ny, nx), false);
    for ((j, i), _) in image.indexed_iter().filter(|(_, v)| **v) {
        along.slice_mut(ndarray::s![j, i.saturating_sub(by)..(i + by + 1).min(nx)]).fill(true);
    }
    for i in 0..nx {
        let mut until = 0; // rows below this are already grown
        for j in 0..ny {
            if along[[j, i]] {
                let to = (j + by + 1).min(ny);
                for k in j.saturating_sub(by).max(until)..to {
                    out[[k, i]] = true;
                }
                until = to;
            }
        }
    }
    out
}
