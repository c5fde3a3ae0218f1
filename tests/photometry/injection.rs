//! Injection and recovery: fluxes and errors against known truth.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use ndarray::Array2;
use photometry_scene::{Scene, mean_sd};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use satphot::photometry::aperture::{Shape, circle_sum};
use satphot::photometry::background::background;
use satphot::photometry::flux::{Flux, measure};

const CELL: usize = 64;

/// Pulls (measured − flux · enclosed)/error of a frame of 400 stars on a grid with random subpixel centres.
fn pulls(sky_e: f64, read_noise_e: f64, fwhm: f64, seed: u64, step_e: f64) -> Vec<f64> {
    let n = 20;
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut scene = Scene::new(n * CELL, n * CELL, sky_e);
    let stars: Vec<(f64, f64, f64)> = (0..n * n)
        .map(|k| {
            let centre = |c: usize| (c * CELL + CELL / 2) as f64;
            let (x, y) = (centre(k % n) + rng.random_range(-0.5..0.5), centre(k / n) + rng.random_range(-0.5..0.5));
            (x, y, 10f64.powf(rng.random_range(2.7..5.5)))
        })
        .collect();
    for &(x, y, flux) in &stars {
        scene.star(x, y, flux, fwhm);
    }
    let mut frame = scene.expose(read_noise_e, seed + 1000);
    if step_e > 0.0 {
        frame.pixels.mapv_inplace(|v| ((f64::from(v) / step_e).round() * step_e) as f32);
    }
    let sky = background(&frame, CELL, 3.0).unwrap();
    stars
        .iter()
        .map(|&(x, y, flux)| {
            // the enclosed share of this very star, with its pixels: an empty scene with it alone
            let mut alone = Scene::new(CELL, CELL, 0.0);
            let (cx, cy) = ((x as usize / CELL * CELL) as f64, (y as usize / CELL * CELL) as f64);
            alone.star(x - cx, y - cy, 1.0, fwhm);
            let r = 2.0 * fwhm;
            let enclosed = circle_sum(&alone.mean, x - cx, y - cy, r);
            let got = measure(&frame, &sky, x, y, Shape::Circle { r_px: r }, 3.0 * fwhm, 5.0 * fwhm, 3.0);
            (got.flux_e - flux * enclosed) / got.flux_err_e
        })
        .collect()
}

fn assert_unit_pulls(name: &str, pulls: &[f64]) {
    let (mean, sd) = mean_sd(pulls);
    let n = pulls.len() as f64;
    println!("{name}: {n} pulls, mean {mean:+.4} (3/sqrt(N) = {:.4}), sd {sd:.4}", 3.0 / n.sqrt());
    assert!(mean.abs() < 3.0 / n.sqrt(), "{name}: mean {mean}");
    assert!(pulls.len() >= 3000 && (sd - 1.0).abs() < 0.05, "{name}: sd {sd}");
}

#[test]
fn pulls_of_injected_stars_are_unit_gaussians_on_any_sky() {
    for (k, (sky, noise)) in [(5.0, 1.5), (5.0, 3.5), (30.0, 1.5), (150.0, 2.0), (500.0, 3.5)].into_iter().enumerate() {
        let mut all = Vec::new();
        for (f, fwhm) in [2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0].into_iter().enumerate() {
            all.extend(pulls(sky, noise, fwhm, (100 * k + 10 * f) as u64, 0.0));
        }
        assert_unit_pulls(&format!("sky {sky} e-, read noise {noise} e-"), &all);
    }
}

#[test]
fn digitised_counts_do_not_lock_the_sky_to_a_level() {
    // steps of half the sky's noise: a plain median would be wrong by up to a quarter of σ in every pixel
    let mut all = Vec::new();
    for repeat in 0..8 {
        all.extend(pulls(20.0 + 0.3 * repeat as f64, 3.5, 4.0, 7000 + repeat, 2.7));
    }
    assert_unit_pulls("step 2.7 e-", &all);
}

fn one_star(sky_e: f64, flux_e: f64, extra: impl Fn(&mut Scene)) -> Vec<Flux> {
    (0..200)
        .map(|seed| {
            let mut scene = Scene::new(80, 80, sky_e);
            scene.star(40.3, 39.8, flux_e, 4.0);
            extra(&mut scene);
            let frame = scene.expose(2.0, 50 + seed);
            let sky = background(&frame, 40, 3.0).unwrap();
            measure(&frame, &sky, 40.3, 39.8, Shape::Circle { r_px: 8.0 }, 12.0, 20.0, 3.0)
        })
        .collect()
}

#[test]
fn a_bright_neighbour_in_the_annulus_does_not_move_the_flux() {
    let alone = one_star(100.0, 5000.0, |_| {});
    // 350 px at +3000 e-: a blob of 21 px across
    let crowded = one_star(100.0, 5000.0, |scene| {
        for ((j, i), m) in scene.mean.indexed_iter_mut() {
            if (i as f64 - 56.0).hypot(j as f64 - 40.0) < 10.55 && (i as f64 - 40.3).hypot(j as f64 - 39.8) > 9.0 {
                *m += 3000.0;
            }
        }
    });
    let shift: f64 =
        alone.iter().zip(&crowded).map(|(a, b)| (b.flux_e - a.flux_e) / a.flux_err_e).sum::<f64>() / alone.len() as f64;
    println!("neighbour moves the flux by {shift:.3} sigma");
    assert!(shift.abs() < 1.0, "{shift}");
    use satphot::photometry::Flags;
    assert!(crowded.iter().all(|f| f.flags.has(Flags::CROWDED_ANNULUS)));
    assert!(alone.iter().all(|f| !f.flags.has(Flags::CROWDED_ANNULUS)));
}

#[test]
fn the_error_is_that_of_counted_electrons() {
    // no noise in the pixels: sky and flux are exact, so the error must be the formula to rounding
    let (sky_e, read_noise, r) = (50.0, 3.0, 6.0);
    let mut pixels = Array2::from_elem((101, 101), sky_e as f32);
    pixels[[50, 50]] += 10_000.0;
    let frame = photometry_scene::frame(pixels, read_noise);
    let sky = background(&frame, 32, 3.0).unwrap();
    let got = measure(&frame, &sky, 50.0, 50.0, Shape::Circle { r_px: r }, 10.0, 20.0, 3.0);
    let area = std::f64::consts::PI * r * r;
    assert!((got.flux_e - 10_000.0).abs() < 1e-9 * 1e4);
    assert!((got.flux_err_e.powi(2) / (10_000.0 + area * (sky_e + 9.0)) - 1.0).abs() < 1e-12);
    assert!((got.area_px / area - 1.0).abs() < 1e-12);
    assert_eq!(got.peak_e, 10_000.0);
}

#[test]
fn the_scatter_of_the_sky_estimate_is_its_quoted_error() {
    let got = one_star(60.0, 0.0, |_| {});
    let (mean, sd) = mean_sd(&got.iter().map(|f| (f.sky_e_px - 60.0) / f.sky_err_e_px).collect::<Vec<_>>());
    assert!(mean.abs() < 3.0 / 200f64.sqrt(), "{mean}");
    assert!((sd - 1.0).abs() < 0.15, "{sd}"); // 3 σ of a standard deviation of 200 values
}

#[test]
fn a_noisier_annulus_than_the_model_enlarges_the_error() {
    let scene = Scene::new(100, 100, 100.0);
    let mut frame = scene.expose(2.0, 9);
    let quiet = frame.clone();
    let mut rng = ChaCha12Rng::seed_from_u64(4);
    frame.pixels.mapv_inplace(|v| v + rng.random_range(-60.0f32..60.0));
    let at = |f| {
        let sky = background(f, 50, 3.0).unwrap();
        measure(f, &sky, 50.0, 50.0, Shape::Circle { r_px: 8.0 }, 12.0, 20.0, 3.0).flux_err_e
    };
    // 60/√3 = 34.6 e⁻ of extra scatter on 10.2
    let ratio = at(&frame) / at(&quiet);
    assert!((ratio / (34.6f64.hypot(10.2) / 10.2) - 1.0).abs() < 0.1, "{ratio}");
}
