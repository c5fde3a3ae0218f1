//! How faint a target this frame would have shown: injection and recovery in the frame's own pixels.
//!
//! Electrons and full-frame pixels. Point sources of the night's width are put at places spread over the search region,
//! one at a time, and looked for by the same search and with the same cuts as the target. Skipped: sources wider than
//! a star, for which the night scales the limit by their size.

use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Poisson};
use statrs::function::erf::erf;

use crate::constants::FWHM_PER_SIGMA;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::background::Background;
use crate::photometry::flux::detectable_e;
use crate::photometry::stats;
use crate::photometry::target::{TargetFound, TargetSettings, found_in};

/// Share of the injected sources that are detected at the limit.
pub const LIMIT_COMPLETENESS: f64 = 0.95;
/// The same in σ of a Gaussian: that many errors above the threshold lies a flux that passes it so often.
pub const LIMIT_MARGIN_SIGMA: f64 = 1.644_853_627;
/// Places of the search region that are tried.
const PLACES: usize = 32;
/// One of so many is tried first, to learn about how bright the sources must be.
const FIRST_EVERY: usize = 4;
/// The 95 % quantile of 32 values is itself uncertain by 0.35 σ: so much further out the mean share is 95 %.
const OWN_SCATTER: f64 = 1.06;
/// A source that is not found is tried again this much brighter, so many times.
const BRIGHTER: f64 = 1.4;
const MOST_TRIES: usize = 12;
/// Half the side of the part of the frame that is searched for one source: at least so many px, and so many FWHM.
const AROUND_PX: f64 = 60.0;
const AROUND_FWHM: f64 = 5.0;
/// Half that side where there are star trails, whose direction must be found [px].
const AROUND_AMONG_TRAILS_PX: f64 = 160.0;
/// How far from its place a source may be found \[FWHM\].
const HERE_FWHM: f64 = 1.5;

/// What is needed of the frame to look for sources in it.
pub(crate) struct Injection<'a> {
    pub frame: &'a Frame<Electrons>,
    pub background: &'a Background,
    pub settings: &'a TargetSettings,
    /// Whether star trails were found.
    pub trails: bool,
    /// Of the frame's own pixels.
    pub seed: u64,
}

impl Injection<'_> {
    /// The flux at which 95 % of sources are detected \[e⁻\]; NaN where no place of the search region can be used, or
    /// where sources of any brightness are missed more often than that. `empty_e` = error of an empty aperture.
    ///
    /// Every place has its own threshold F: the flux that just passes there, with that place's noise. One measured flux m
    /// of a source of flux f tells it: F = f − m + t, t the flux that is just detected with the error of m. The limit is
    /// the 95 % quantile of F over the places.
    pub fn limit_e(&self, empty_e: f64) -> f64 {
        let places = self.places();
        if places.is_empty() || !(empty_e > 0.0) {
            return f64::NAN;
        }
        let guess = detectable_e(0.0, empty_e, self.settings.detect_sigma + LIMIT_MARGIN_SIGMA);
        let is_first = |k: &usize| k % FIRST_EVERY == 0;
        let tried = |k: usize, flux_e: f64| self.threshold_e(k, places[k], flux_e);
        let mut thresholds: Vec<f64> = (0..places.len()).filter(is_first).map(|k| tried(k, guess)).collect();
        let better = quantile(thresholds.clone()).unwrap_or(guess);
        thresholds.extend((0..places.len()).filter(|k| !is_first(k)).map(|k| tried(k, better)));
        quantile(thresholds).unwrap_or(f64::NAN)
    }

    /// Places spread evenly over that part of the search region where the frame has pixels.
    ///
    /// Kronecker's sequence of the plastic number (Roberts 2018), its start given by the frame.
    fn places(&self) -> Vec<(f64, f64)> {
        const PLASTIC: f64 = 1.324_717_957_244_746;
        let start = |shift: u32| (self.seed.rotate_left(shift) >> 11) as f64 / (1u64 << 53) as f64;
        let s = self.settings;
        let (nx, ny) = (self.frame.pixels.ncols() as f64, self.frame.pixels.nrows() as f64);
        let (ox, oy) = (self.frame.origin_px.0 as f64, self.frame.origin_px.1 as f64);
        (0..PLACES)
            .map(|k| {
                let k = k as f64;
                let u = (start(0) + k / PLASTIC).fract();
                let v = (start(32) + k / (PLASTIC * PLASTIC)).fract();
                let (r, angle) = (s.search_radius_px * u.sqrt(), std::f64::consts::TAU * v);
                (s.x_px + r * angle.cos(), s.y_px + r * angle.sin())
            })
            .filter(|&(x, y)| {
                let (i, j) = ((x - ox).round(), (y - oy).round());
                let inside = i >= 0.0 && j >= 0.0 && i < nx && j < ny;
                inside && self.frame.mask[[j as usize, i as usize]] & (mask::BAD | mask::CLIPPED) == 0
            })
            .collect()
    }

    /// The flux that is just detected at a place, tried with a source of `flux_e` or brighter; infinite where none is.
    fn threshold_e(&self, k: usize, place: (f64, f64), flux_e: f64) -> f64 {
        let mut flux_e = flux_e;
        for _ in 0..MOST_TRIES {
            if let Some((measured_e, least_e)) = self.measured(k, place, flux_e) {
                return flux_e - measured_e + least_e;
            }
            flux_e *= BRIGHTER;
        }
        f64::INFINITY
    }

    /// A source of `flux_e` at a place: what is measured of it, and the flux that its error would just let pass; `None`
    /// where it is not found.
    fn measured(&self, k: usize, (x, y): (f64, f64), flux_e: f64) -> Option<(f64, f64)> {
        let s = self.settings;
        let frame = self.with_source(k, (x, y), flux_e)?;
        let around = TargetSettings { x_px: x, y_px: y, search_radius_px: 2.0 * HERE_FWHM * s.fwhm_px, ..*s };
        match found_in(&frame, self.background, &around) {
            TargetFound::Detected { flux, x_px, y_px, .. } => {
                let here = (x_px - x).hypot(y_px - y) < HERE_FWHM * s.fwhm_px.max(2.0);
                here.then(|| (flux.flux_e, detectable_e(flux.flux_e, flux.flux_err_e, s.detect_sigma)))
                    .filter(|(measured_e, least_e)| measured_e.is_finite() && least_e.is_finite())
            }
            TargetFound::NotDetected { .. } => None,
        }
    }

    /// The frame around a place with a source in it, photons counted.
    fn with_source(&self, k: usize, (x, y): (f64, f64), flux_e: f64) -> Option<Frame<Electrons>> {
        let s = self.settings;
        let least = if self.trails { AROUND_AMONG_TRAILS_PX } else { AROUND_PX };
        // never farther than the target itself is measured from, so that a part of a frame says what the whole does
        let reach = least.max(s.sky_out_px + AROUND_FWHM * s.fwhm_px).min(s.reach_px() - s.search_radius_px);
        let (ny, nx) = self.frame.pixels.dim();
        let (ox, oy) = self.frame.origin_px;
        let span = |at: f64, n: usize| {
            let from = (at - reach).round().clamp(0.0, n as f64) as usize;
            from..((at + reach).round().clamp(0.0, n as f64) as usize).max(from)
        };
        let (at_x, at_y) = (x - ox as f64, y - oy as f64);
        let (columns, rows) = (span(at_x, nx), span(at_y, ny));
        let part = ndarray::s![rows.clone(), columns.clone()];
        let mut pixels = self.frame.pixels.slice(part).to_owned();
        let mut rng = ChaCha12Rng::seed_from_u64(self.seed ^ (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let root = s.fwhm_px / FWHM_PER_SIGMA * std::f64::consts::SQRT_2;
        let share = |i: usize, at: f64| 0.5 * (erf((i as f64 + 0.5 - at) / root) - erf((i as f64 - 0.5 - at) / root));
        for ((j, i), pixel) in pixels.indexed_iter_mut() {
            let mean = flux_e * share(i + columns.start, at_x) * share(j + rows.start, at_y);
            if mean > 1e-6 {
                *pixel += Poisson::new(mean).ok()?.sample(&mut rng) as f32;
            }
        }
        let mut frame = Frame::from_electrons(self.frame.path.clone(), pixels, self.frame.gain.clone());
        frame.mask = self.frame.mask.slice(part).to_owned();
        frame.origin_px = (ox + columns.start, oy + rows.start);
        frame.full_size_px = self.frame.full_size_px;
        Some(frame)
    }
}

/// The 95 % quantile of thresholds: median and 1.645 times the scatter of those above it, or, where a few lie far out,
/// the value that 95 % are below; infinite thresholds count as far out. `None` without values.
fn quantile(mut thresholds: Vec<f64>) -> Option<f64> {
    let n = thresholds.len();
    let middle = stats::median(&mut thresholds)?;
    thresholds.sort_by(f64::total_cmp);
    let above: Vec<f64> = thresholds.iter().filter(|t| **t >= middle && t.is_finite()).map(|t| t - middle).collect();
    let scatter = (above.iter().map(|d| d * d).sum::<f64>() / above.len().max(1) as f64).sqrt();
    let gaussian = middle + LIMIT_MARGIN_SIGMA * OWN_SCATTER * scatter;
    // the thresholds that may lie beyond
    let beyond = ((1.0 - LIMIT_COMPLETENESS) * n as f64).round() as usize;
    let counted = thresholds[n - 1 - beyond.min(n - 1)];
    Some(gaussian.max(counted)).filter(|q| q.is_finite())
}
