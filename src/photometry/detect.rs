//! Stars of a frame: pixels above a threshold after a matched filter, joined, and their moments.
//!
//! Electrons and full-frame pixels. Fluxes here are isophotal: good for sorting and matching, never for magnitudes.
//! It does not cover galaxies or profile fits.

use crate::base::stats;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::background::Background;
use crate::photometry::centroid::{FWHM_PER_SIGMA, adaptive_fwhm};
use crate::photometry::label::{Run, label};
use crate::photometry::net::{Net, level_offset};
use crate::photometry::smooth::Kernel;
use crate::photometry::threshold::runs_above;

/// FWHM of the filter where none is known \[px\].
const DEFAULT_FWHM_PX: f64 = 3.0;

/// Something above the threshold.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Barycentre \[px\].
    pub x_px: f64,
    /// Barycentre \[px\].
    pub y_px: f64,
    /// Sum of the pixels above the threshold, sky subtracted \[e⁻\].
    pub flux_e: f64,
    /// Highest pixel above the sky \[e⁻\].
    pub peak_e: f64,
    /// Number of pixels above the threshold.
    pub npix: usize,
    /// Standard deviation along the major axis \[px\].
    pub a_px: f64,
    /// Standard deviation along the minor axis \[px\].
    pub b_px: f64,
    /// Angle of the major axis from +x towards +y \[rad\].
    pub theta_rad: f64,
    /// FWHM from the moments above the threshold \[px\]: too small for faint sources; see [`stellar_fwhm`].
    pub fwhm_px: f64,
    /// `SATURATED`, `MASKED`, `EDGE`, `CLIP_EDGE` (touches a clipped pixel), `ELONGATED` (a/b above 1.5).
    pub flags: Flags,
}

/// Sums over the pixels of one component, about its first pixel.
#[derive(Debug, Clone)]
struct Sums {
    x0: f64,
    y0: f64,
    npix: usize,
    peak: f64,
    /// Σw, Σwx, Σwy, Σwxx, Σwyy, Σwxy with w the net flux.
    by_flux: [f64; 6],
    /// The same with w = 1.
    by_pixel: [f64; 6],
    flags: Flags,
}

/// Finds what is above `threshold_sigma` times the scatter of the smoothed sky.
///
/// The frame is smoothed with a Gaussian of `fwhm_px` (3 px if unknown): for a star of that width the threshold is its
/// signal-to-noise. Components are 8-connected; moments are of the unsmoothed pixels. Sorted by flux, brightest first;
/// the same for any number of threads. Memory: a tile of the frame per thread and the runs above the threshold.
#[must_use]
pub fn detect(
    frame: &Frame<Electrons>,
    background: &Background,
    threshold_sigma: f64,
    fwhm_px: Option<f64>,
) -> Vec<Source> {
    let kernel = Kernel::gaussian(fwhm_px.unwrap_or(DEFAULT_FWHM_PX));
    let net = Net::new(frame, background, level_offset(frame, background));
    let per_rms = (threshold_sigma * kernel.noise_factor()) as f32;
    let runs = runs_above(&net, frame.pixels.dim(), &kernel, per_rms);
    let (labels, n) = label(&runs);
    let mut sums: Vec<Option<Sums>> = vec![None; n];
    let mut pixels = vec![0f32; frame.pixels.ncols()];
    for (run, &component) in runs.iter().zip(&labels) {
        let pixels = &mut pixels[..run.columns.len()];
        net.part(run.row, run.columns.clone(), pixels);
        let sums = sums[component].get_or_insert_with(|| Sums::at(run.columns.start as f64, run.row as f64));
        sums.add(run, pixels, &net, frame.pixels.dim());
    }
    let mut sources: Vec<Source> = sums.into_iter().flatten().map(|s| s.source(frame.origin_px)).collect();
    sources
        .sort_by(|p, q| q.flux_e.total_cmp(&p.flux_e).then(p.y_px.total_cmp(&q.y_px)).then(p.x_px.total_cmp(&q.x_px)));
    sources
}

impl Sums {
    fn at(x0: f64, y0: f64) -> Self {
        let (by_flux, by_pixel) = ([0.0; 6], [0.0; 6]);
        Self { x0, y0, npix: 0, peak: f64::NEG_INFINITY, by_flux, by_pixel, flags: Flags::default() }
    }

    fn add(&mut self, run: &Run, pixels: &[f32], net: &Net, (ny, nx): (usize, usize)) {
        let y = run.row as f64 - self.y0;
        let (_, bits) = net.rows.part(run.row, run.columns.clone());
        for ((i, w), m) in run.columns.clone().zip(pixels).zip(bits) {
            let (x, w) = (i as f64 - self.x0, f64::from(*w));
            for (sum, term) in self.by_pixel.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += term;
            }
            for (sum, term) in self.by_flux.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += w * term;
            }
            self.peak = self.peak.max(w);
            if m & mask::SATURATED != 0 {
                self.flags.set(Flags::SATURATED);
            }
            if m & mask::BAD != 0 {
                self.flags.set(Flags::MASKED);
            }
            if m & mask::CLIPPED != 0 {
                self.flags.set(Flags::CLIP_EDGE);
            }
        }
        self.npix += run.columns.len();
        if run.row == 0 || run.row + 1 == ny || run.columns.start == 0 || run.columns.end == nx {
            self.flags.set(Flags::EDGE);
        }
    }

    fn source(&self, origin_px: (usize, usize)) -> Source {
        let ([w, wx, wy, wxx, wyy, wxy], flux_e) = match Self::central(&self.by_flux) {
            Some(m) => (m, self.by_flux[0]),
            None => (Self::central(&self.by_pixel).unwrap_or([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), self.by_flux[0]),
        };
        debug_assert!(w > 0.0);
        // eigenvalues of the covariance, never below that of one pixel
        let (mean, half) = (0.5 * (wxx + wyy), (0.25 * (wxx - wyy).powi(2) + wxy * wxy).sqrt());
        let (a_px, b_px) = ((mean + half).max(1.0 / 12.0).sqrt(), (mean - half).max(1.0 / 12.0).sqrt());
        let mut flags = self.flags;
        if a_px > 1.5 * b_px {
            flags.set(Flags::ELONGATED);
        }
        Source {
            x_px: origin_px.0 as f64 + self.x0 + wx,
            y_px: origin_px.1 as f64 + self.y0 + wy,
            flux_e,
            peak_e: self.peak,
            npix: self.npix,
            a_px,
            b_px,
            theta_rad: 0.5 * (2.0 * wxy).atan2(wxx - wyy),
            fwhm_px: FWHM_PER_SIGMA * (mean - 1.0 / 12.0).max(0.0).sqrt(),
            flags,
        }
    }

    /// \[Σw, mean x, mean y, var x, var y, cov\], or `None` if the weights do not make a covariance.
    fn central(sums: &[f64; 6]) -> Option<[f64; 6]> {
        let [w, wx, wy, wxx, wyy, wxy] = *sums;
        let (x, y) = (wx / w, wy / w);
        let (xx, yy, xy) = (wxx / w - x * x, wyy / w - y * y, wxy / w - x * y);
        (w > 0.0 && xx >= 0.0 && yy >= 0.0 && xy.is_finite()).then_some([w, x, y, xx, yy, xy])
    }
}

/// FWHM of the stars of a frame \[px\]: clipped median over its bright, round, isolated, untainted sources.
///
/// Each star's width comes from the Gaussian window that reproduces itself, free of the threshold; the pixel's share is
/// subtracted. At most the 200 brightest are used. `None` if no source is suitable.
#[must_use]
pub fn stellar_fwhm(frame: &Frame<Electrons>, background: &Background, sources: &[Source]) -> Option<f64> {
    let clean = |s: &Source| {
        s.flags == Flags::default() && s.npix >= 5 && s.fwhm_px > 0.8 && s.peak_e > 5.0 * background.rms(s.x_px, s.y_px)
    };
    let isolated = |k: usize| {
        let s = &sources[k];
        let reach = 4.0 * s.fwhm_px + 4.0;
        // far away in one axis, as nearly all are, needs no distance
        let far = |o: &Source| {
            (o.x_px - s.x_px).abs() > reach
                || (o.y_px - s.y_px).abs() > reach
                || (o.x_px - s.x_px).hypot(o.y_px - s.y_px) > reach
        };
        sources.iter().enumerate().all(|(other, o)| other == k || o.flux_e < 0.02 * s.flux_e || far(o))
    };
    let mut widths: Vec<f64> = (0..sources.len())
        .filter(|&k| clean(&sources[k]) && isolated(k))
        .take(200)
        .filter_map(|k| {
            let s = &sources[k];
            adaptive_fwhm(frame, background, s.x_px, s.y_px, s.fwhm_px.max(1.5))
        })
        .collect();
    stats::sigma_clip(&mut widths, 3.0).map(|c| c.median)
}

#[cfg(test)]
#[path = "detect_tests.rs"]
mod tests;
