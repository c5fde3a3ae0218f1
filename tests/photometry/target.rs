//! The tracked satellite among star trails, over a seeded grid of scenes.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use photometry_scene::{Scene, mean_sd};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rayon::prelude::*;
use satphot::photometry::Flags;
use satphot::photometry::background::background;
use satphot::photometry::target::measure::Light;
use satphot::photometry::target::measure::TargetFound;
use satphot::photometry::target::measure::measure_target;
use satphot::photometry::target::settings::TargetSettings;

const FWHM: f64 = 4.0;
const SKY: f64 = 60.0;
const READ_NOISE: f64 = 2.0;
/// Scatter of a sky pixel.
const SIGMA: f64 = 8.0;

fn settings(n: f64) -> TargetSettings {
    photometry_scene::target_settings(n, 120.0, FWHM)
}

/// Flux at which a star of this FWHM has the given matched signal-to-noise on the sky alone.
fn flux_of_snr(snr: f64) -> f64 {
    snr * SIGMA * (4.0 * std::f64::consts::PI).sqrt() * FWHM / photometry_scene::FWHM_PER_SIGMA
}

struct Truth {
    x: f64,
    y: f64,
    flux: f64,
}

/// Where trails are put.
#[derive(Clone, Copy, PartialEq)]
enum Stars {
    None,
    Crossing,
    Short,
    Through,
    Crowded,
}

fn scene(n: usize, snr: f64, length: f64, offset: f64, stars: Stars, seed: u64) -> (Scene, Truth) {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut scene = Scene::new(n, n, SKY);
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    let (x, y) = (n as f64 / 2.0 + offset * angle.cos(), n as f64 / 2.0 + offset * angle.sin());
    let flux = flux_of_snr(snr) * (1.0 + length / FWHM); // the same surface brightness when smeared
    scene.smear(x, y, flux, FWHM, length, rng.random_range(0.0..3.1));
    let theta = rng.random_range(0.0..3.1);
    let (sin, cos) = f64::sin_cos(theta);
    let trail = |rng: &mut ChaCha12Rng| 10f64.powf(rng.random_range(1.3..3.3)); // e⁻ per px of length
    match stars {
        Stars::None => {}
        Stars::Crossing => {
            for _ in 0..12 {
                let mut v: f64 = rng.random_range(-0.7..0.7) * n as f64;
                let own = -(x - n as f64 / 2.0) * sin + (y - n as f64 / 2.0) * cos;
                if (v - own).abs() < 25.0 + length / 2.0 {
                    v = own + (25.0 + length / 2.0) * (v - own).signum();
                }
                let c = n as f64 / 2.0;
                scene.line(c - v * sin, c + v * cos, trail(&mut rng), FWHM, theta);
            }
        }
        Stars::Through => {
            scene.line(x + rng.random_range(-4.0..4.0), y, trail(&mut rng), FWHM, theta);
            scene.line(x - 60.0 * sin, y + 60.0 * cos, trail(&mut rng), FWHM, theta);
        }
        Stars::Crowded => crowd(&mut scene, theta, &mut rng),
        Stars::Short => {
            for _ in 0..10 {
                let (px, py) = loop {
                    let (px, py) = (rng.random_range(0.0..n as f64), rng.random_range(0.0..n as f64));
                    if (px - x).hypot(py - y) > 80.0 + length {
                        break (px, py);
                    }
                };
                scene.smear(px, py, trail(&mut rng) * 90.0, FWHM, 90.0, theta);
            }
        }
    }
    (scene, Truth { x, y, flux })
}

/// 120 trails across the frame, most of them below the noise, and 15 that end in it.
fn crowd(scene: &mut Scene, theta: f64, rng: &mut ChaCha12Rng) {
    let n = scene.mean.nrows() as f64;
    let sigma = FWHM / photometry_scene::FWHM_PER_SIGMA;
    let (sin, cos) = theta.sin_cos();
    // e⁻ per px of length; N(> L) ∝ 1/L
    let light = |rng: &mut ChaCha12Rng| (6.0 / rng.random_range(0.003..1.0f64)).min(2000.0);
    let step = 0.05;
    let mut across = vec![0f64; (2.0 * n / step) as usize];
    for _ in 0..120 {
        let (at, light) = (rng.random_range(-0.75..0.75) * n, light(rng));
        for k in ((at + n - 6.0 * sigma) / step) as usize..((at + n + 6.0 * sigma) / step) as usize {
            let z = (k as f64 * step - n - at) / sigma;
            across[k] += light * (-0.5 * z * z).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
        }
    }
    let ends: Vec<(f64, f64, f64, f64)> = (0..15)
        .map(|_| {
            let way = if rng.random::<bool>() { 1.0 } else { -1.0 };
            (rng.random_range(-0.5..0.5) * n, rng.random_range(-0.5..0.5) * n, way, light(rng))
        })
        .collect();
    for ((j, i), mean) in scene.mean.indexed_iter_mut() {
        let (dx, dy) = (i as f64 - n / 2.0, j as f64 - n / 2.0);
        let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
        *mean += across[((v + n) / step) as usize];
        for &(at, end, way, light) in &ends {
            let z = (v - at) / sigma;
            if z.abs() < 6.0 {
                let part = 0.5 * (1.0 + statrs::function::erf::erf(way * (u - end) / (sigma * 2f64.sqrt())));
                *mean += part * light * (-0.5 * z * z).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
            }
        }
    }
}

struct Outcome {
    tried: usize,
    found: usize,
    pulls: Vec<f64>,
    trail_flags: usize,
}

fn run(snr: f64, length: f64, stars: Stars, seed: u64) -> Outcome {
    let n = 360;
    let results: Vec<Option<(f64, bool)>> = [0.0, 15.0, 50.0, 90.0]
        .into_par_iter()
        .enumerate()
        .map(|(k, offset)| {
            let seed = seed + 1000 * k as u64;
            let (scene, truth) = scene(n, snr, length, offset, stars, seed);
            let TargetFound::Detected { flux, x_px, y_px, .. } = at(&scene.expose(READ_NOISE, seed + 77), n) else {
                return None;
            };
            let here = (x_px - truth.x).hypot(y_px - truth.y) < FWHM + 0.2 * length;
            here.then_some(((flux.flux_e - truth.flux) / flux.flux_err_e, flux.flags.has(Flags::TRAIL)))
        })
        .collect();
    let found: Vec<(f64, bool)> = results.iter().flatten().copied().collect();
    Outcome {
        tried: results.len(),
        found: found.len(),
        pulls: found.iter().map(|f| f.0).collect(),
        trail_flags: found.iter().filter(|f| f.1).count(),
    }
}

#[test]
fn the_target_is_found_and_its_flux_is_right_over_a_grid_of_scenes() {
    let mut pulls = Vec::new();
    for (s, stars) in [Stars::None, Stars::Crossing, Stars::Short].into_iter().enumerate() {
        let (mut tried, mut found) = (0, 0);
        for (b, snr) in [8.0, 15.0, 50.0, 300.0].into_iter().enumerate() {
            for (l, length) in [0.0, 12.0, 40.0].into_iter().enumerate() {
                let got = run(snr, length, stars, (100_000 * s + 10_000 * b + 5_000 * l) as u64);
                let (mean, sd) = mean_sd(&got.pulls);
                println!("  S/N {snr}, smear {length} px: {}/{} pull {mean:+.2} ± {sd:.2}", got.found, got.tried);
                tried += got.tried;
                found += got.found;
                // S/N 8 is centred on its own noise: its flux is high by its nature, its presence is what counts
                pulls.extend(if snr > 8.0 { got.pulls } else { Vec::new() });
            }
        }
        println!("{}: found {found} of {tried}", ["no stars", "trails across the frame", "trails of 90 px"][s]);
        // three of 48 may lie on the remainder of a short trail, or be lost next to one
        assert!(found as f64 >= if stars == Stars::Short { 0.93 } else { 0.97 } * tried as f64, "{found} of {tried}");
    }
    // truth is the whole flux: what the apertures miss counts against them
    let (mean, sd) = mean_sd(&pulls);
    println!("{} pulls, mean {mean:+.3}, sd {sd:.3}", pulls.len());
    assert!(mean.abs() < 3.0 / (pulls.len() as f64).sqrt(), "{mean}");
    assert!((sd - 1.0).abs() < 3.0 / (2.0 * pulls.len() as f64).sqrt(), "{sd}");
}

#[test]
fn a_trail_through_the_target_is_subtracted_and_flagged() {
    let (mut tried, mut found, mut flagged) = (0, 0, 0);
    let mut pulls = Vec::new();
    for (b, snr) in [50.0, 300.0].into_iter().enumerate() {
        for (l, length) in [0.0, 12.0, 40.0].into_iter().enumerate() {
            let got = run(snr, length, Stars::Through, (500_000 + 10_000 * b + 5_000 * l) as u64);
            tried += got.tried;
            found += got.found;
            flagged += got.trail_flags;
            pulls.extend(got.pulls);
        }
    }
    let (mean, sd) = mean_sd(&pulls);
    println!("found {found} of {tried}, flagged {flagged}; pulls {mean:+.2} ± {sd:.2}");
    // the faintest trails (20 e⁻/px, 0.6 σ at their ridge) are neither seen nor flagged
    assert!(found as f64 >= 0.93 * tried as f64 && flagged as f64 >= 0.75 * found as f64);
    // without the subtraction a trail of 300 e⁻/px adds 50 σ
    assert!(mean.abs() < 0.5 && sd < 1.6, "{mean} {sd}");
}

fn at(frame: &satphot::frames::Frame<satphot::frames::Electrons>, n: usize) -> TargetFound {
    measure_target(frame, &background(frame, 64, 3.0).unwrap(), &settings(n as f64))
}

#[test]
fn among_many_trails_and_their_ends_flux_and_error_are_honest() {
    let (mut tried, mut found) = (0, 0);
    let mut pulls = Vec::new();
    for (b, snr) in [20.0, 40.0, 100.0].into_iter().enumerate() {
        for (l, length) in [0.0, 12.0, 30.0].into_iter().enumerate() {
            let got = run(snr, length, Stars::Crowded, (700_000 + 10_000 * b + 5_000 * l) as u64);
            let (mean, sd) = mean_sd(&got.pulls);
            println!("  S/N {snr}, smear {length} px: {}/{} pull {mean:+.2} ± {sd:.2}", got.found, got.tried);
            tried += got.tried;
            found += got.found;
            pulls.extend(got.pulls);
        }
    }
    let (mean, sd) = mean_sd(&pulls);
    println!("found {found} of {tried}; pulls {mean:+.2} ± {sd:.2}");
    assert!(found as f64 >= 0.9 * tried as f64, "{found} of {tried}");
    assert!(mean.abs() < 0.5 && sd < 1.5, "{mean} {sd}");
}

#[test]
fn trails_without_a_target_are_not_reported_as_one() {
    let alarms: Vec<f64> = (0..16u64)
        .into_par_iter()
        .filter_map(|seed| {
            let mut rng = ChaCha12Rng::seed_from_u64(60_000 + seed);
            let mut scene = Scene::new(360, 360, SKY);
            let theta = rng.random_range(0.0..3.1);
            crowd(&mut scene, theta, &mut rng);
            match at(&scene.expose(READ_NOISE, 61_000 + seed), 360) {
                TargetFound::Detected { flux, .. } => Some(flux.snr),
                TargetFound::NotDetected { .. } => None,
            }
        })
        .collect();
    println!("false alarms of 16: S/N {alarms:.1?}");
    assert!(alarms.len() <= 2 && alarms.iter().all(|snr| *snr < 5.0), "{alarms:?}");
}

#[test]
fn a_near_target_wins_over_a_bright_object_far_off() {
    let mut scene = Scene::new(400, 400, SKY);
    scene.star(212.0, 205.0, flux_of_snr(12.0), FWHM);
    scene.star(200.0, 88.0, flux_of_snr(500.0), FWHM); // 112 of 120 px away
    let TargetFound::Detected { x_px, y_px, .. } = at(&scene.expose(READ_NOISE, 31), 400) else { panic!("not found") };
    assert!((x_px - 212.0).hypot(y_px - 205.0) < FWHM, "{x_px} {y_px}");
}

#[test]
fn a_whole_object_wins_over_one_cut_by_the_edge() {
    let mut scene = Scene::new(300, 300, SKY);
    scene.star(200.0, 100.0, flux_of_snr(12.0), FWHM);
    scene.star(150.0, 0.0, flux_of_snr(100.0), FWHM);
    let frame = scene.expose(READ_NOISE, 32);
    let near_edge = TargetSettings { y_px: 60.0, ..settings(300.0) };
    let TargetFound::Detected { x_px, y_px, .. } =
        measure_target(&frame, &background(&frame, 64, 3.0).unwrap(), &near_edge)
    else {
        panic!("not found")
    };
    assert!((x_px - 200.0).hypot(y_px - 100.0) < FWHM, "{x_px} {y_px}");
}

#[test]
fn an_empty_frame_and_one_of_trails_only_give_limits() {
    let mut false_alarms = 0;
    for seed in 0..12 {
        let mut empty = Scene::new(400, 400, SKY);
        if seed % 2 == 1 {
            for v in [-150.0, -60.0, 20.0, 90.0] {
                empty.line(200.0, 200.0 + v, 300.0 + v, FWHM, 0.4);
            }
        }
        match at(&empty.expose(READ_NOISE, 900 + seed), 400) {
            TargetFound::Detected { .. } => false_alarms += 1,
            TargetFound::NotDetected { limit_e, flux, x_px, y_px, .. } => {
                assert_eq!((x_px, y_px), (200.0, 200.0));
                assert!(flux.flux_e.is_finite());
                // 95 % of points above 5 σ under their own profile are brighter than 6.6 σ, and more under a trail
                let least = flux_of_snr(6.6);
                assert!(limit_e > 0.95 * least && limit_e < 3.0 * least, "{limit_e} {least}");
            }
        }
    }
    assert!(false_alarms <= 1, "{false_alarms}");
}

#[test]
fn forced_fluxes_of_empty_sky_are_negative_half_of_the_time() {
    let negative = (0..32u64)
        .into_par_iter()
        .filter(|seed| match at(&Scene::new(200, 200, SKY).expose(READ_NOISE, 4000 + seed), 200) {
            TargetFound::NotDetected { flux, .. } => flux.flux_e < 0.0 && flux.flags.has(Flags::NEGATIVE),
            TargetFound::Detected { .. } => false,
        })
        .count();
    assert!((8..=24).contains(&negative), "{negative}"); // 16 ± 2.8
}

#[test]
fn an_elongated_target_is_flagged_and_outlined_along_its_smear() {
    let mut scene = Scene::new(400, 400, SKY);
    scene.smear(210.0, 190.0, 60_000.0, FWHM, 40.0, 0.7);
    let TargetFound::Detected { flux, x_px, y_px, light, .. } = at(&scene.expose(READ_NOISE, 3), 400) else {
        panic!("not found")
    };
    let (a_px, _, theta_rad) = flux.shape.axes();
    let aperture = theta_rad;
    let Light { theta_rad, elongation, .. } = light;
    assert!((2.0 * (aperture - 0.7)).cos() > 0.99, "{aperture}");
    assert!((x_px - 210.0).hypot(y_px - 190.0) < 0.5);
    assert!(flux.flags.has(Flags::ELONGATED) && elongation > 3.0, "{elongation}");
    assert!((theta_rad - 0.7).abs() < 0.03, "{theta_rad}");
    // 20 px, the contour at 3 σ of a peak of 190 σ seen through the filter 7 px further out, 1.5 FWHM of margin, rounding
    assert!((26.0..36.0).contains(&a_px), "{a_px}");
    assert!((flux.flux_e / 60_000.0 - 1.0).abs() < 4.0 * flux.flux_err_e / 60_000.0);
}

#[test]
fn a_gaussian_of_s_n_50_is_enclosed_to_0_995_at_any_size() {
    // noiseless light through an aperture found on the noisy frame: what the aperture misses, no more
    for fwhm in [4.0, 8.0, 16.0, 30.0] {
        let mut clean = Scene::new(500, 500, 0.0);
        let sigma = fwhm / photometry_scene::FWHM_PER_SIGMA;
        let total = 50.0 * SIGMA * (4.0 * std::f64::consts::PI).sqrt() * sigma;
        clean.star(255.0, 248.0, total, fwhm);
        let mut scene = Scene::new(500, 500, SKY);
        scene.star(255.0, 248.0, total, fwhm);
        let TargetFound::Detected { flux, x_px, y_px, .. } = at(&scene.expose(READ_NOISE, 21), 500) else {
            panic!("not found at FWHM {fwhm}")
        };
        let enclosed = satphot::photometry::aperture::shape_sum(&clean.mean, &flux.shape, x_px, y_px) / total;
        println!("FWHM {fwhm}: {:?} encloses {enclosed:.4}", flux.shape);
        assert!(enclosed > 0.995, "FWHM {fwhm}: {enclosed}");
    }
}

#[test]
fn a_faint_bar_is_measured_as_one_of_three_widths_unless_its_model_is_larger() {
    let wide = |largest_fwhm: Option<f64>| {
        (0..30)
            .into_par_iter()
            .filter(|seed| {
                let mut scene = Scene::new(300, 300, SKY);
                scene.smear(150.0, 150.0, flux_of_snr(25.0), FWHM, 2.5 * FWHM, 0.7);
                let frame = scene.expose(READ_NOISE, 900 + seed);
                let s = TargetSettings { largest_fwhm, ..settings(300.0) };
                match measure_target(&frame, &background(&frame, 64, 3.0).unwrap(), &s) {
                    TargetFound::Detected { size: Some(size), as_point_e: Some(_), .. } => {
                        size.disc2 > 1.25 + size.disc2_err
                    }
                    _ => false,
                }
            })
            .count()
    };
    assert!(wide(None) > 5 && wide(Some(6.0)) > 5, "{} {}", wide(None), wide(Some(6.0)));
    assert_eq!(wide(Some(20.0)), 0);
}

#[test]
fn a_hot_pixel_is_not_the_target() {
    let mut frame = Scene::new(300, 300, SKY).expose(READ_NOISE, 8);
    frame.pixels[[150, 150]] += 5000.0;
    assert!(matches!(at(&frame, 300), TargetFound::NotDetected { .. }));
}

#[test]
fn masked_frames_and_places_off_the_frame_do_not_panic() {
    let mut frame = Scene::new(300, 300, SKY).expose(READ_NOISE, 8);
    let sky = background(&frame, 64, 3.0).unwrap();
    frame.mask.fill(satphot::frames::mask::BAD);
    let TargetFound::NotDetected { limit_e, .. } = measure_target(&frame, &sky, &settings(300.0)) else {
        panic!("found in a masked frame")
    };
    assert!(limit_e.is_nan()); // nothing measurable: the caller writes a missing value
    for place in [-5000.0, f64::NAN, 1e12] {
        let s = TargetSettings { x_px: place, ..settings(300.0) };
        assert!(matches!(measure_target(&frame, &sky, &s), TargetFound::NotDetected { .. }));
    }
}
