//! The flux of a target in its frame: error and cost of the ways to weigh its pixels.
//!
//! Frames of 220 px with a sky of 60 e⁻, stars of 4 px FWHM; points and even discs of one FWHM, by the signal-to-noise ratio
//! of a point. Magnitudes; the reference is the light put in. Apertures are put where the target is, with the aperture
//! correction of a star; the others search for it. A target that is not found does not count.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::simulated::noisy_frame;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::{FWHM_PER_SIGMA, MAG_PER_LN};
use crate::base::error::Result;
use crate::config::{self, ApertureShape};
use crate::frames::{Electrons, Frame};
use crate::photometry::aperture::Shape;
use crate::photometry::background::background;
use crate::photometry::flux::measure;
use crate::photometry::growth::{FRAME_SCATTER, StarProfile};
use crate::photometry::target::measure::{TargetFound, measure_target};
use crate::photometry::target::settings::TargetSettings;

const SIDE_PX: usize = 220;
const SKY_E: f64 = 60.0;
const FWHM_PX: f64 = 4.0;
/// Frames of a series.
const FRAMES: usize = 24;
/// Radii of the apertures \[FWHM\].
const RADII_FWHM: [f64; 5] = [0.7, 1.0, 1.5, 2.0, 3.0];

/// A frame and where the target is in it.
struct Simulated {
    frame: Frame<Electrons>,
    x_px: f64,
    y_px: f64,
}

/// Light of a point of a signal-to-noise ratio under its own profile \[e⁻\].
pub(super) fn flux_e(snr: f64) -> f64 {
    let empty = (4.0 * std::f64::consts::PI * SKY_E).sqrt() * FWHM_PX / FWHM_PER_SIGMA;
    0.5 * (snr * snr + (snr.powi(4) + (2.0 * snr * empty).powi(2)).sqrt())
}

fn simulated(flux_e: f64, disc_px: f64, rng: &mut ChaCha12Rng) -> Simulated {
    let middle = 0.5 * SIDE_PX as f64;
    let mut place = || middle + rng.random_range(-30.0..30.0);
    let (x_px, y_px) = (place(), place());
    let mut pixels = Array2::from_elem((SIDE_PX, SIDE_PX), SKY_E);
    let variance = (FWHM_PX / FWHM_PER_SIGMA).powi(2);
    // a disc of 200 points, spread evenly
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let n = if disc_px > 0.0 { 200 } else { 1 };
    for k in 0..n {
        let (r, angle) = (0.5 * disc_px * ((k as f64 + 0.5) / n as f64).sqrt(), golden * k as f64);
        let (x, y) = (x_px + r * angle.cos(), y_px + r * angle.sin());
        for ((j, i), pixel) in pixels.indexed_iter_mut() {
            let r2 = (i as f64 - x).powi(2) + (j as f64 - y).powi(2);
            if r2 < 30.0 * variance {
                *pixel += flux_e / n as f64 / (std::f64::consts::TAU * variance) * (-0.5 * r2 / variance).exp();
            }
        }
    }
    Simulated { frame: noisy_frame(&pixels, rng), x_px, y_px }
}

/// A search for a target about the middle of a frame.
pub(super) fn settings(side_px: usize) -> TargetSettings {
    let middle = 0.5 * side_px as f64;
    TargetSettings {
        x_px: middle,
        y_px: middle,
        search_radius_px: 50.0,
        detect_sigma: 5.0,
        margin_px: 1.5 * FWHM_PX,
        limit_r_px: 2.0 * FWHM_PX,
        fwhm_px: FWHM_PX,
        fwhm_err_frac: FRAME_SCATTER,
        is_fwhm_known: true,
        profile: None,
        largest_fwhm: None,
        known_disc2: None,
        sky_in_px: 3.0 * FWHM_PX,
        sky_out_px: 5.0 * FWHM_PX,
        clip_sigma: 3.0,
        shape: ApertureShape::Auto,
        contam_frac: 0.05,
        trail_direction: None,
        trail_length_px: None,
        bound_px: None,
    }
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let photometry = config::Photometry::default();
    let star = StarProfile::moffat(f64::INFINITY);
    let s = settings(SIDE_PX);
    let mut series = Vec::new();
    for (label, disc_fwhm) in [("point", 0.0), ("disc of 1 FWHM", 1.0)] {
        for snr in [8.0, 20.0, 100.0] {
            let mut rng = ChaCha12Rng::seed_from_u64(29);
            let truth_e = flux_e(snr);
            let frames: Vec<Simulated> =
                (0..FRAMES).map(|_| simulated(truth_e, disc_fwhm * FWHM_PX, &mut rng)).collect();
            let skies =
                frames.iter().map(|f| background(&f.frame, 64, photometry.clip_sigma)).collect::<Result<Vec<_>>>()?;
            let mag = |flux_e: f64| (flux_e > 0.0).then(|| -MAG_PER_LN * (flux_e / truth_e).ln());
            let mut points = Vec::new();
            for r_fwhm in RADII_FWHM {
                let shape = Shape::Circle { r_px: r_fwhm * FWHM_PX };
                let sky_px = (s.sky_in_px, s.sky_out_px);
                let correction_mag = star.correction_mag(FWHM_PX, shape, sky_px, None);
                let flux = |k: usize| {
                    let f = &frames[k];
                    measure(&f.frame, &skies[k], f.x_px, f.y_px, shape, sky_px.0, sky_px.1, s.clip_sigma).flux_e
                };
                let off: Vec<f64> = (0..FRAMES).filter_map(|k| Some(mag(flux(k))? + correction_mag)).collect();
                let us = cpu_us(stopwatch, || {
                    std::hint::black_box(flux(0));
                });
                points.extend(Errors::of(&off).map(|errors| SweepPoint {
                    setting: format!("circle {r_fwhm} FWHM"),
                    errors,
                    cpu_us: us,
                    memory_kb: None,
                    is_default: false,
                }));
            }
            let found: Vec<(Option<f64>, f64)> = (0..FRAMES)
                .filter_map(|k| match measure_target(&frames[k].frame, &skies[k], &s) {
                    TargetFound::Detected { flux, as_point_e, .. } => Some((as_point_e.map(|p| p.0), flux.flux_e)),
                    TargetFound::NotDetected { .. } => None,
                })
                .collect();
            let us = cpu_us(stopwatch, || {
                std::hint::black_box(measure_target(&frames[0].frame, &skies[0], &s));
            });
            let as_point: Vec<f64> = found.iter().filter_map(|f| mag(f.0?)).collect();
            let default: Vec<f64> = found.iter().filter_map(|f| mag(f.1)).collect();
            for (setting, off, is_default) in [("search, point", as_point, false), ("search", default, true)] {
                points.extend(Errors::of(&off).map(|errors| SweepPoint {
                    setting: setting.into(),
                    errors,
                    cpu_us: us,
                    memory_kb: None,
                    is_default,
                }));
            }
            series.push(Series { label: format!("{label}, S/N {snr}"), points });
        }
    }
    Ok(Sweep {
        knob: "weights of the target's pixels",
        work: "one frame",
        error: "mag",
        reference: "the light put in",
        default_because: "the weights of a point are best for a point and 0.17 mag too faint for a disc of one FWHM; with the size \
                          free the light of both is right",
        series,
    })
}
