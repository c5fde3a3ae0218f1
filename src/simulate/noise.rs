//! Electrons to raw counts: pixel response, Poisson noise, read noise, full well, converter.

use ndarray::{Array2, Axis};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;

use super::scenario::Vignetting;
use crate::frames::Camera;

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

/// Vignetting over the frame: 1 − loss (r/r_corner)², divided by its median inside the clip circle.
///
/// A master flat is normalised in the same way, so a flattened frame keeps the scenario's zeropoint.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    vignetting: Vignetting,
    centre: (f64, f64),
    corner2: f64,
    median: f64,
}

impl Response {
    /// Response of a frame of `nx` by `ny` pixels; `clip_radius_px` as the reduction will use it.
    pub fn new((nx, ny): (usize, usize), vignetting: Vignetting, clip_radius_px: Option<f64>) -> Self {
        let centre = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
        let corner2 = centre.0 * centre.0 + centre.1 * centre.1;
        let mut response = Self { vignetting, centre, corner2, median: 1.0 };
        // 10⁵ pixels give the median of a smooth surface to 10⁻⁴
        let step = (((nx * ny) as f64 / 1e5).sqrt().floor() as usize).max(1);
        let radius = clip_radius_px.unwrap_or(f64::INFINITY);
        let mut inside: Vec<f64> = (0..ny)
            .step_by(step)
            .flat_map(|j| (0..nx).step_by(step).map(move |i| (i as f64, j as f64)))
            .filter(|(x, y)| (x - centre.0).hypot(y - centre.1) <= radius)
            .map(|(x, y)| response.at(x, y))
            .collect();
        inside.sort_by(f64::total_cmp);
        response.median = inside.get(inside.len() / 2).copied().unwrap_or(1.0);
        response
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let r2 = ((x - self.centre.0).powi(2) + (y - self.centre.1).powi(2)) / self.corner2;
        (1.0 - self.vignetting.corner_loss_frac * r2) / self.median
    }
}

/// Multiplies a row by the vignetting and by the response of its pixels.
fn respond(row: &mut [f32], j: usize, response: &Response, seed: u64) {
    let mut rng = stream(seed, DETECTOR_FRAME, Some(j));
    let scatter = Normal::new(1.0, response.vignetting.prnu_frac).ok();
    for (i, value) in row.iter_mut().enumerate() {
        let pixel = scatter.map_or(1.0, |s| s.sample(&mut rng));
        *value *= (response.at(i as f64, j as f64) * pixel) as f32;
    }
}

/// Expected electrons (before the response) to raw counts, row by row.
///
/// After the response of each pixel, [`Camera::read_out`].
pub fn expose(
    mut expected_e: Array2<f32>,
    camera: Camera<'_>,
    response: &Response,
    seed: u64,
    frame: u64,
) -> Array2<u16> {
    let (ny, nx) = expected_e.dim();
    let mut counts = Array2::<u16>::zeros((ny, nx));
    expected_e.axis_iter_mut(Axis(0)).into_par_iter().zip(counts.axis_iter_mut(Axis(0))).enumerate().for_each(
        |(j, (mut expected, mut counts))| {
            if let Some(row) = expected.as_slice_mut() {
                respond(row, j, response, seed);
            }
            let mut rng = stream(seed, frame, Some(j));
            camera.read_out(expected.iter().copied(), counts.iter_mut(), &mut rng);
        },
    );
    counts
}
