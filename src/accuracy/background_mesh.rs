//! The sky under a frame: error and cost of the background mesh, by the size of its boxes.
//!
//! A sky of 60 e⁻ with a gradient and a bowl, Poisson noise, stars of 4 px FWHM; errors of the level in units of the sky's
//! scatter, over a lattice of places. The reference is the sky that was put in.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::simulated::noisy_frame;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::Result;
use crate::config;
use crate::frames::Frame;
use crate::photometry::background::background;

const SIDE_PX: usize = 1024;
const SKY_E: f64 = 60.0;
const FWHM_PX: f64 = 4.0;

/// The sky put in \[e⁻/px\]: 10 % of gradient, and a bowl 15 % deep.
fn sky_e(x: usize, y: usize) -> f64 {
    let (u, v) = (x as f64 / SIDE_PX as f64 - 0.5, y as f64 / SIDE_PX as f64 - 0.5);
    SKY_E * (1.0 + 0.1 * u + 0.05 * v - 0.3 * (u * u + v * v))
}

fn frame(stars: usize, seed: u64) -> Frame<crate::frames::Electrons> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut pixels = Array2::from_shape_fn((SIDE_PX, SIDE_PX), |(y, x)| sky_e(x, y));
    for _ in 0..stars {
        let (x0, y0) = (rng.random_range(0.0..SIDE_PX as f64), rng.random_range(0.0..SIDE_PX as f64));
        let flux_e = 500.0 * rng.random_range(0.01..1.0f64).powf(-1.3);
        let variance = (FWHM_PX / 2.355).powi(2);
        let reach = |c: f64| (c as usize).saturating_sub(14)..(c as usize + 15).min(SIDE_PX);
        for y in reach(y0) {
            for x in reach(x0) {
                let r2 = (x as f64 - x0).powi(2) + (y as f64 - y0).powi(2);
                pixels[[y, x]] += flux_e / (2.0 * std::f64::consts::PI * variance) * (-0.5 * r2 / variance).exp();
            }
        }
    }
    noisy_frame(&pixels, &mut rng)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let photometry = config::Photometry::default();
    let megapixels = (SIDE_PX * SIDE_PX) as f64 / 1e6;
    let mut series = Vec::new();
    for (label, stars) in [("no stars", 0), ("1000 stars per Mpx", 1000), ("5000 stars per Mpx", 5000)] {
        let frame = frame((stars as f64 * megapixels) as usize, stopwatch.seed(11));
        let mut points = Vec::new();
        for mesh_px in [16, 32, 64, 128, 256] {
            let sky = background(&frame, mesh_px, photometry.clip_sigma)?;
            let places = (8..SIDE_PX).step_by(16).flat_map(|y| (8..SIDE_PX).step_by(16).map(move |x| (x, y)));
            let off: Vec<f64> =
                places.map(|(x, y)| (sky.level(x as f64, y as f64) - sky_e(x, y)) / sky_e(x, y).sqrt()).collect();
            let us = cpu_us(stopwatch, || {
                std::hint::black_box(background(&frame, mesh_px, photometry.clip_sigma).is_ok());
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: mesh_px.to_string(),
                errors,
                cpu_us: us / megapixels,
                memory_kb: None,
                is_default: mesh_px == photometry.mesh_px,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "photometry.mesh_px",
        work: "one megapixel",
        error: "sigma of the sky",
        reference: "the sky put in",
        default_because: "64 px follow the steepest skies and still hold enough sky between the stars; 128 px is as good on a smooth sky",
        series,
    })
}
