//! The blur of a sensor: how fine its grid, and how far a star's image reaches.

use ndarray::Array2;

use super::effort::Effort;
use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::Result;
use crate::resolved::sensor::{Blur, Pupil, Sampling, Seeing, Stamp, stamp};
use crate::resolved::{Light, RadianceImage};

/// Steps per FWHM, with the reach of the default.
const STEPS: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0];
/// Reach in FWHM, with the steps of the default.
const REACHES: [f64; 6] = [3.0, 6.0, 12.0, 18.0, 24.0, 36.0];
/// What is called exact.
const FINE: f64 = 16.0;
const FAR: f64 = 60.0;
/// Detector pixels \[arcsec\]: the published camera, binned.
const PIXEL_ARCSEC: f64 = 0.7830;
/// Side of a radiance pixel \[rad\]: 0.25 arcsec.
const PICTURE_RAD: f64 = 1.212e-6;

/// A cross of two bars, bright and faint, 30 arcsec across.
fn picture() -> RadianceImage {
    let plane = Array2::from_shape_fn((120, 120), |(j, i)| {
        let (y, x) = (j as f64 - 59.5, i as f64 - 59.5);
        if y.abs() < 6.0 {
            1.0
        } else if x.abs() < 10.0 || (x.abs() - 45.0).abs() < 4.0 {
            0.3
        } else {
            0.0
        }
    });
    RadianceImage {
        pixel_rad: PICTURE_RAD,
        range_km: 500.0,
        planes: vec![(Light::Sun, plane)],
        wavelength_um: 0.6,
        band_um: (0.3, 1.05),
    }
}

/// A pixel of the detector, 0 beyond the stamp.
fn at(of: &Stamp, y: i64, x: i64) -> f64 {
    let index = usize::try_from(y - of.y0).ok().zip(usize::try_from(x - of.x0).ok());
    index.and_then(|at| of.planes[0].1.get(at)).copied().unwrap_or(0.0)
}

/// Differences of all pixels, over the brightest.
fn differences(of: &Stamp, truth: &Stamp) -> Vec<f64> {
    let brightest = truth.planes[0].1.iter().copied().fold(0.0, f64::max);
    let pixels = truth.planes[0].1.indexed_iter();
    pixels.map(|((j, i), v)| (at(of, truth.y0 + j as i64, truth.x0 + i as i64) - v) / brightest).collect()
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let image = picture();
    let pupil = Pupil { aperture_m: 0.61, obstruction: 0.47, wavelength_um: 0.6 };
    let blur = |seeing| Blur { seeing, pupil: Some(pupil), jitter_arcsec: 0.3, drift_arcsec: (0.0, 0.0) };
    let cases = [
        ("Moffat 2 arcsec", blur(Seeing::Moffat { fwhm_arcsec: 2.0, beta: 3.5 })),
        ("Gaussian 1 arcsec", blur(Seeing::Gaussian { fwhm_arcsec: 1.0 })),
    ];
    let default = Sampling::default();
    let centre = (50.31, 49.87);
    let mut series = Vec::new();
    for (name, blur) in &cases {
        let run = |sampling: &Sampling| stamp(&image, blur, PIXEL_ARCSEC, centre, sampling);
        let fine = stopwatch.effort == Effort::Full;
        let knobs = [
            (
                "steps per FWHM",
                STEPS.map(|s| (s, Sampling { steps_per_fwhm: s, ..default })),
                default.steps_per_fwhm,
                Sampling { steps_per_fwhm: FINE, ..default },
            ),
            (
                "reach",
                REACHES.map(|r| (r, Sampling { reach_fwhm: r, ..default })),
                default.reach_fwhm,
                Sampling { reach_fwhm: if fine { FAR } else { 0.8 * FAR }, ..default },
            ),
        ];
        for (knob, settings, usual, exact) in knobs {
            let truth = run(&exact)?;
            let mut points = Vec::new();
            for (value, sampling) in settings {
                let got = run(&sampling)?;
                let cpu_us = cpu_us(stopwatch, || {
                    std::hint::black_box(run(&sampling).is_ok());
                });
                points.extend(Errors::of(&differences(&got, &truth)).map(|errors| SweepPoint {
                    setting: format!("{value} {}", if knob == "reach" { "FWHM" } else { "steps" }),
                    errors,
                    cpu_us,
                    memory_kb: None,
                    is_default: value == usual,
                }));
            }
            series.push(Series { label: format!("{knob}, {name}"), points });
        }
    }
    Ok(Sweep {
        knob: "grid of the blur",
        work: "one picture",
        error: "of the brightest pixel",
        reference: "16 steps per FWHM; a reach of 60 FWHM (48 in a quick run)",
        default_because: "a thousandth of the brightest pixel is below the noise of a picture that fills half the well",
        series,
    })
}
