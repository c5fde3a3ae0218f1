//! Stars of a frame: pixels above a threshold after a matched filter, joined, and their moments.
//!
//! Electrons and full-frame pixels. Fluxes here are isophotal: good for sorting and matching, never for magnitudes.
//! Leaves out: galaxies, profile fits.

use rayon::prelude::*;

use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::background::Background;
use crate::photometry::centroid::{FWHM_PER_SIGMA, adaptive_fwhm};
use crate::photometry::label::{Run, label, runs_of_row};
use crate::photometry::smooth::{Kernel, level_offset, net_row, smooth_band};
use crate::photometry::stats;

/// Rows smoothed at a time by one thread.
const BAND_ROWS: usize = 128;
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
/// the same for any number of threads. Memory: bands of 128 rows and the runs above the threshold.
#[must_use]
pub fn detect(
    frame: &Frame<Electrons>,
    background: &Background,
    threshold_sigma: f64,
    fwhm_px: Option<f64>,
) -> Vec<Source> {
    let (ny, nx) = frame.pixels.dim();
    let kernel = Kernel::gaussian(fwhm_px.unwrap_or(DEFAULT_FWHM_PX));
    let offset_e = level_offset(frame, background, 0..ny, 0..nx);
    let per_rms = (threshold_sigma * kernel.noise_factor()) as f32;
    let bands: Vec<Vec<Run>> = (0..ny.div_ceil(BAND_ROWS))
        .into_par_iter()
        .map(|band| {
            let mut runs = Vec::new();
            let mut rms = vec![0f32; nx];
            let rows = band * BAND_ROWS..((band + 1) * BAND_ROWS).min(ny);
            smooth_band(frame, background, offset_e, &kernel, rows, |j, row| {
                background.rms_row(frame.origin_px.1 + j, frame.origin_px.0, &mut rms);
                runs_of_row(j, row.iter().zip(&rms).map(|(v, r)| *v > per_rms * r && *v > 0.0), &mut runs);
            });
            runs
        })
        .collect();
    let runs: Vec<Run> = bands.into_iter().flatten().collect();
    let (labels, n) = label(&runs);
    let mut sums: Vec<Option<Sums>> = vec![None; n];
    let mut net = vec![0f32; nx];
    let mut row_held = usize::MAX;
    for (run, &component) in runs.iter().zip(&labels) {
        if run.row != row_held {
            net_row(frame, background, offset_e, run.row, &mut net);
            row_held = run.row;
        }
        let sums = sums[component].get_or_insert_with(|| Sums::at(run.columns.start as f64, run.row as f64));
        sums.add(run, &net, frame);
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

    fn add(&mut self, run: &Run, net: &[f32], frame: &Frame<Electrons>) {
        let (ny, nx) = frame.pixels.dim();
        let y = run.row as f64 - self.y0;
        let bits = frame.mask.row(run.row);
        for i in run.columns.clone() {
            let (x, w, m) = (i as f64 - self.x0, f64::from(net[i]), bits[i]);
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
/// taken off. At most the 200 brightest are used. `None` if no source serves.
#[must_use]
pub fn stellar_fwhm(frame: &Frame<Electrons>, background: &Background, sources: &[Source]) -> Option<f64> {
    let clean = |s: &Source| {
        s.flags == Flags::default() && s.npix >= 5 && s.fwhm_px > 0.8 && s.peak_e > 5.0 * background.rms(s.x_px, s.y_px)
    };
    let isolated = |k: usize| {
        let s = &sources[k];
        let reach = 4.0 * s.fwhm_px + 4.0;
        sources.iter().enumerate().all(|(other, o)| {
            other == k || o.flux_e < 0.02 * s.flux_e || (o.x_px - s.x_px).hypot(o.y_px - s.y_px) > reach
        })
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
