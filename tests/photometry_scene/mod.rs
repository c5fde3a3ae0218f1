//! A truth scene: pixel-integrated Gaussians and trails on a sky, realised with a seed.
#![allow(dead_code)] // every test file uses its own part

pub mod station;
pub mod tracks;

use std::path::PathBuf;

use ndarray::Array2;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal, Poisson};
use satphot::frames::{Electrons, ElectronsPerAdu, Frame, Gain, mask};
use satphot::photometry::target::settings::TargetSettings;
use statrs::function::erf::erf;

/// The settings of a search around the middle of a square frame.
pub fn target_settings(side_px: f64, search_radius_px: f64, fwhm_px: f64) -> TargetSettings {
    TargetSettings {
        x_px: side_px / 2.0,
        y_px: side_px / 2.0,
        search_radius_px,
        detect_sigma: 5.0,
        margin_px: 1.5 * fwhm_px,
        limit_r_px: 2.0 * fwhm_px,
        fwhm_px,
        fwhm_err_frac: satphot::photometry::growth::FRAME_SCATTER,
        is_fwhm_known: true,
        profile: None,
        largest_fwhm: None,
        known_disc2: None,
        sky_in_px: 3.0 * fwhm_px,
        sky_out_px: 5.0 * fwhm_px,
        clip_sigma: 3.0,
        shape: satphot::config::ApertureShape::Auto,
        contam_frac: 0.05,
        trail_direction: None,
        trail_length_px: None,
        bound_px: None,
    }
}

pub const FWHM_PER_SIGMA: f64 = 2.354_820_045_030_949;

/// Expected electrons per pixel.
pub struct Scene {
    pub mean: Array2<f64>,
}

impl Scene {
    pub fn new(nx: usize, ny: usize, sky_e: f64) -> Self {
        Self { mean: Array2::from_elem((ny, nx), sky_e) }
    }

    /// A round Gaussian, integrated over pixels.
    pub fn star(&mut self, x: f64, y: f64, flux_e: f64, fwhm: f64) {
        let (ny, nx) = self.mean.dim();
        let sigma = fwhm / FWHM_PER_SIGMA;
        let share = |i: usize, c: f64| {
            let z = |edge: f64| (edge - c) / (sigma * std::f64::consts::SQRT_2);
            0.5 * (erf(z(i as f64 + 0.5)) - erf(z(i as f64 - 0.5)))
        };
        let reach = 7.0 * sigma + 1.0;
        let range = |c: f64, n: usize| ((c - reach).max(0.0) as usize)..((c + reach).clamp(0.0, n as f64) as usize);
        let columns: Vec<(usize, f64)> = range(x, nx).map(|i| (i, share(i, x))).collect();
        for j in range(y, ny) {
            let of_row = flux_e * share(j, y);
            for &(i, s) in &columns {
                self.mean[[j, i]] += of_row * s;
            }
        }
    }

    /// A round Gaussian drawn along a line of `length` px at `theta` through (x, y): a trail, or a smeared target.
    pub fn smear(&mut self, x: f64, y: f64, flux_e: f64, fwhm: f64, length: f64, theta: f64) {
        let steps = (length / (0.2 * fwhm)).ceil().max(1.0) as usize;
        for k in 0..steps {
            let s = length * ((k as f64 + 0.5) / steps as f64 - 0.5);
            self.star(x + s * theta.cos(), y + s * theta.sin(), flux_e / steps as f64, fwhm);
        }
    }

    /// A trail without end: a line at `theta` whose pixels hold `e_per_px` per pixel of length.
    pub fn line(&mut self, x: f64, y: f64, e_per_px: f64, fwhm: f64, theta: f64) {
        let (ny, nx) = self.mean.dim();
        let sigma = fwhm / FWHM_PER_SIGMA;
        for ((j, i), m) in self.mean.indexed_iter_mut() {
            debug_assert!(j < ny && i < nx);
            let v = -(i as f64 - x) * theta.sin() + (j as f64 - y) * theta.cos();
            if v.abs() < 7.0 * sigma {
                let z = |edge: f64| edge / (sigma * std::f64::consts::SQRT_2);
                *m += e_per_px * 0.5 * (erf(z(v + 0.5)) - erf(z(v - 0.5)));
            }
        }
    }

    /// Poisson counts plus read noise.
    pub fn expose(&self, read_noise_e: f64, seed: u64) -> Frame<Electrons> {
        let mut rng = ChaCha12Rng::seed_from_u64(seed);
        let read = Normal::new(0.0, read_noise_e).unwrap();
        let pixels = self.mean.mapv(|m| {
            let counts = if m > 0.0 { Poisson::new(m).unwrap().sample(&mut rng) } else { 0.0 };
            (counts + read.sample(&mut rng)) as f32
        });
        frame(pixels, read_noise_e)
    }
}

pub fn frame(pixels: Array2<f32>, read_noise_e: f64) -> Frame<Electrons> {
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "test".into(),
        read_noise_e,
        pedestal_adu: 0.0,
        saturation_adu: 1e9,
    };
    Frame::from_electrons(PathBuf::from("test.fits"), pixels, gain)
}

/// What is read inside a clip circle around the middle: NaN and CLIPPED outside.
pub fn clipped(mut frame: Frame<Electrons>, radius_px: f64) -> Frame<Electrons> {
    let (ny, nx) = frame.pixels.dim();
    let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    for ((j, i), bits) in frame.mask.indexed_iter_mut() {
        if (i as f64 - cx).powi(2) + (j as f64 - cy).powi(2) > radius_px * radius_px {
            *bits |= mask::CLIPPED;
            frame.pixels[[j, i]] = f32::NAN;
        }
    }
    frame
}

/// Mean and standard deviation.
pub fn mean_sd(values: &[f64]) -> (f64, f64) {
    satphot::base::stats::mean_and_sd(values)
}
