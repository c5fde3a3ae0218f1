//! A target beside star trails that end in the frame: error and cost of what is known of their length.
//!
//! Frames of 320 px with a sky of 60 e⁻ and stars of 4 px FWHM. A point of S/N 10 to 100 among trails of 25 or 45 FWHM of a known
//! direction, each FWHM of which has 0.1 to 10 times the light of the target; the first passes within 4 FWHM of it. Magnitudes; the
//! reference is the light put in. A target that is not found, or another thing that is, does not count.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use statrs::function::erf::erf;

use super::effort::Stopwatch;
use super::simulated::noisy_frame;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use super::target;
use crate::base::constants::{FWHM_PER_SIGMA, MAG_PER_LN};
use crate::base::error::Result;
use crate::frames::{Electrons, Frame};
use crate::photometry::background::{Background, background};
use crate::photometry::target::measure::{KnownDirection, TargetFound, measure_target};
use crate::photometry::target::settings::TargetSettings;

const SIDE_PX: usize = 320;
const SKY_E: f64 = 60.0;
const FWHM_PX: f64 = 4.0;
const SIGMA_PX: f64 = FWHM_PX / FWHM_PER_SIGMA;
/// Error of the known direction \[rad\].
const DIRECTION_ERR_RAD: f64 = 0.003;
/// What the length is said to be, as a share of the true one.
const LENGTHS: [(&str, Option<f64>, bool); 4] =
    [("not known", None, false), ("half", Some(0.5), false), ("known", Some(1.0), true), ("twice", Some(2.0), false)];

/// A frame, and where its target is, its light, and the direction and length of the trails.
struct Simulated {
    frame: Frame<Electrons>,
    sky: Background,
    x_px: f64,
    y_px: f64,
    flux_e: f64,
    theta_rad: f64,
    length_px: f64,
}

fn simulated(length_px: f64, trails: usize, rng: &mut ChaCha12Rng) -> Result<Simulated> {
    let middle = 0.5 * SIDE_PX as f64;
    let mut place = || middle + rng.random_range(-10.0..10.0);
    let (x_px, y_px) = (place(), place());
    let flux_e = target::flux_e(10f64.powf(rng.random_range(1.0..2.0)));
    let theta_rad = rng.random_range(-1.5..1.5f64);
    let (sin, cos) = theta_rad.sin_cos();
    // middle of each trail, along and across, from the target, and its light per pixel of length
    let trails: Vec<(f64, f64, f64)> = (0..trails)
        .map(|k| {
            let (along, across) = if k == 0 { (0.5 * length_px, 4.0 * FWHM_PX) } else { (0.4 * 320.0, 0.4 * 320.0) };
            let light = flux_e / FWHM_PX * 10f64.powf(rng.random_range(-1.0..1.0));
            (rng.random_range(-along..along), rng.random_range(-across..across), light)
        })
        .collect();
    let gaussian = |r2: f64| (-0.5 * r2 / SIGMA_PX.powi(2)).exp() / (std::f64::consts::TAU.sqrt() * SIGMA_PX);
    let step = |u: f64| 0.5 * erf((u / (std::f64::consts::SQRT_2 * SIGMA_PX)).clamp(-5.0, 5.0));
    let pixels = Array2::from_shape_fn((SIDE_PX, SIDE_PX), |(j, i)| {
        let (dx, dy) = (i as f64 - x_px, j as f64 - y_px);
        let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let of_trail = |&(along, across, light): &(f64, f64, f64)| {
            let ends = step(u - along + 0.5 * length_px) - step(u - along - 0.5 * length_px);
            light * gaussian((v - across).powi(2)) * ends
        };
        SKY_E + flux_e * gaussian(dx * dx) * gaussian(dy * dy) + trails.iter().map(of_trail).sum::<f64>()
    });
    let frame = noisy_frame(&pixels, rng);
    let sky = background(&frame, 64, 3.0)?;
    Ok(Simulated { frame, sky, x_px, y_px, flux_e, theta_rad, length_px })
}

/// Error of the magnitude and the one that is stated, with the length at `share` of the true one.
fn off_mag(s: &Simulated, share: Option<f64>) -> Option<(f64, f64)> {
    let direction = KnownDirection { theta_rad: s.theta_rad + DIRECTION_ERR_RAD, err_rad: DIRECTION_ERR_RAD };
    let settings = TargetSettings {
        trail_direction: Some(direction),
        trail_length_px: share.map(|share| share * s.length_px),
        ..target::settings(SIDE_PX)
    };
    match measure_target(&s.frame, &s.sky, &settings) {
        TargetFound::Detected { flux, x_px, y_px, .. } => {
            let at_target = (x_px - s.x_px).hypot(y_px - s.y_px) < 3.0 * FWHM_PX && flux.flux_e > 0.0;
            at_target.then(|| (-MAG_PER_LN * (flux.flux_e / s.flux_e).ln(), MAG_PER_LN * flux.flux_err_e / flux.flux_e))
        }
        TargetFound::NotDetected { .. } => None,
    }
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let n = stopwatch.effort.of(8, 60);
    let cases = [
        ("trails of 25 FWHM, one of them", 25.0, 1),
        ("trails of 25 FWHM, five", 25.0, 5),
        ("trails of 45 FWHM, five", 45.0, 5),
    ];
    let mut series = Vec::new();
    for (label, length_fwhm, trails) in cases {
        let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(37));
        let frames = (0..n).map(|_| simulated(length_fwhm * FWHM_PX, trails, &mut rng)).collect::<Result<Vec<_>>>()?;
        let mut points = Vec::new();
        for (setting, share, is_default) in LENGTHS {
            let off: Vec<(f64, f64)> = frames.iter().filter_map(|f| off_mag(f, share)).collect();
            let us = cpu_us(stopwatch, || {
                std::hint::black_box(off_mag(&frames[0], share));
            });
            points.extend(Errors::with_stated(&off).map(|errors| SweepPoint {
                setting: setting.into(),
                errors,
                cpu_us: us,
                memory_kb: None,
                is_default,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "length of the star trails",
        work: "one frame",
        error: "mag",
        reference: "the light put in, where the target is found",
        default_because: "only trails whose length is known are seen to end, and are subtracted one by one; a wrong length is as bad \
                          as none",
        series,
    })
}
