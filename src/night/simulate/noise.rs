//! Electrons to raw counts: pixel response, Poisson noise, read noise, full well, converter.

use ndarray::{Array2, Axis};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Poisson};
use rayon::prelude::*;

use super::scenario::Vignetting;
use crate::frames::Gain;

/// Number of streams kept for the rows of one frame.
const STREAMS_PER_FRAME: u64 = 1 << 20;

/// The random stream of one frame's row (or of the whole frame, with `row = None`).
pub fn stream(seed: u64, frame: u64, row: Option<usize>) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(frame * STREAMS_PER_FRAME + row.map_or(0, |r| r as u64 + 1));
    rng
}

/// The stream of the detector's own pattern, the same for every frame.
const DETECTOR_FRAME: u64 = 0;

/// Multiplies a row by vignetting 1 − loss (r/r_corner)² and by the response of its pixels.
pub fn respond(row: &mut [f32], j: usize, (nx, ny): (usize, usize), vignetting: &Vignetting, seed: u64) {
    let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    let corner2 = cx * cx + cy * cy;
    let mut rng = stream(seed, DETECTOR_FRAME, Some(j));
    let scatter = Normal::new(1.0, vignetting.prnu_frac).ok();
    for (i, value) in row.iter_mut().enumerate() {
        let r2 = ((i as f64 - cx).powi(2) + (j as f64 - cy).powi(2)) / corner2;
        let pixel = scatter.map_or(1.0, |s| s.sample(&mut rng));
        *value *= ((1.0 - vignetting.corner_loss_frac * r2) * pixel) as f32;
    }
}

/// What the camera does to electrons.
#[derive(Debug, Clone, Copy)]
pub struct Camera<'a> {
    /// The detector at this frame's gain.
    pub gain: &'a Gain,
    /// Full well \[e⁻\].
    pub full_well_e: f64,
    /// Largest count of the file \[ADU\].
    pub adc_max_adu: f64,
}

/// Expected electrons (before the response) to raw counts, row by row.
///
/// N_adu = round(pedestal + (min(Poisson(λ), full well) + Normal(0, RN)) / (e⁻/ADU)), clipped to 0 … adc_max.
pub fn expose(
    mut expected_e: Array2<f32>,
    camera: Camera<'_>,
    vignetting: &Vignetting,
    seed: u64,
    frame: u64,
) -> Array2<u16> {
    let (ny, nx) = expected_e.dim();
    let mut counts = Array2::<u16>::zeros((ny, nx));
    let (e_per_adu, pedestal) = (camera.gain.e_per_adu.0, camera.gain.pedestal_adu);
    let top = camera.adc_max_adu.min(65_535.0);
    expected_e.axis_iter_mut(Axis(0)).into_par_iter().zip(counts.axis_iter_mut(Axis(0))).enumerate().for_each(
        |(j, (mut expected, mut counts))| {
            if let Some(row) = expected.as_slice_mut() {
                respond(row, j, (nx, ny), vignetting, seed);
            }
            let mut rng = stream(seed, frame, Some(j));
            let read = Normal::new(0.0, camera.gain.read_noise_e).ok();
            for (lambda, count) in expected.iter().zip(counts.iter_mut()) {
                let lambda = f64::from(*lambda);
                let electrons = Poisson::new(lambda).map_or(0.0, |p: Poisson<f64>| p.sample(&mut rng));
                let noise = read.map_or(0.0, |r| r.sample(&mut rng));
                let adu = pedestal + (electrons.min(camera.full_well_e) + noise) / e_per_adu;
                *count = adu.round().clamp(0.0, top) as u16;
            }
        },
    );
    counts
}
