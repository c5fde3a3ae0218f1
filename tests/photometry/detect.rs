//! Detection, centroids and widths against injected stars.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use photometry_scene::{Scene, clipped, mean_sd};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use satphot::frames::mask;
use satphot::photometry::Flags;
use satphot::photometry::background::background;
use satphot::photometry::centroid::centroid;
use satphot::photometry::detect::{detect, stellar_fwhm};

fn field(fwhm: f64, seed: u64) -> (Scene, Vec<(f64, f64)>) {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut scene = Scene::new(640, 640, 80.0);
    let stars: Vec<(f64, f64)> = (0..64)
        .map(|k| {
            let place = |c: u32| f64::from(c * 80 + 40);
            (place(k % 8) + rng.random_range(-9.0..9.0), place(k / 8) + rng.random_range(-9.0..9.0))
        })
        .collect();
    for &(x, y) in &stars {
        scene.star(x, y, fwhm * fwhm * 10f64.powf(rng.random_range(2.5..4.0)), fwhm);
    }
    (scene, stars)
}

#[test]
fn the_width_of_pixel_integrated_gaussians_is_right_from_2_5_to_10_px() {
    for fwhm in [2.5, 3.0, 4.0, 6.0, 10.0] {
        let (scene, _) = field(fwhm, 11);
        let frame = scene.expose(2.0, 12);
        let sky = background(&frame, 64, 3.0).unwrap();
        let got = stellar_fwhm(&frame, &sky, &detect(&frame, &sky, 5.0, None)).unwrap();
        println!("FWHM {fwhm}: {got:.3}");
        assert!((got / fwhm - 1.0).abs() < 0.03, "{fwhm}: {got}");
    }
}

#[test]
fn every_star_is_found_once_and_nothing_else() {
    let (scene, stars) = field(4.0, 5);
    let frame = scene.expose(2.0, 6);
    let sky = background(&frame, 64, 3.0).unwrap();
    let sources = detect(&frame, &sky, 5.0, Some(4.0));
    assert_eq!(sources.len(), stars.len());
    for (x, y) in stars {
        let near = sources.iter().filter(|s| (s.x_px - x).hypot(s.y_px - y) < 0.7).count();
        assert_eq!(near, 1, "{x} {y}");
    }
    assert!(sources.windows(2).all(|w| w[0].flux_e >= w[1].flux_e));
    assert!(sources.iter().all(|s| !s.flags.any(Flags::EDGE | Flags::MASKED | Flags::SATURATED)));
}

#[test]
fn pure_noise_holds_next_to_nothing_at_5_sigma() {
    let mut false_alarms = 0;
    for seed in 0..4 {
        let frame = Scene::new(500, 500, 30.0).expose(2.0, seed);
        false_alarms += detect(&frame, &background(&frame, 64, 3.0).unwrap(), 5.0, Some(4.0)).len();
    }
    // 1e6 px of smoothed Gaussian noise: 0.3 expected; the skewness of 30 e⁻ adds a little
    assert!(false_alarms <= 3, "{false_alarms}");
}

#[test]
fn detection_is_the_same_for_any_number_of_threads() {
    let (scene, _) = field(3.0, 8);
    let frame = clipped(scene.expose(2.0, 9), 310.0);
    let in_pool = |n: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| {
            let sky = background(&frame, 64, 3.0).unwrap();
            let sources = detect(&frame, &sky, 3.0, None);
            format!("{sources:?} {:?}", stellar_fwhm(&frame, &sky, &sources))
        })
    };
    let one = in_pool(1);
    assert!(one.len() > 1000 && one == in_pool(2) && one == in_pool(3));
}

#[test]
fn a_bright_sky_shows_the_same_stars_as_the_brightest() {
    let (mut scene, stars) = field(4.0, 5);
    scene.mean -= 80.0;
    let peak = scene.mean.iter().copied().fold(0.0, f64::max);
    // a spread of 1e-4 of the sky, stars in units of the sky
    for sky_e in [1e5, 1e9, 1e12] {
        let pixels = scene.mean.indexed_iter().map(|((j, i), star)| {
            let spread = ((i * 7 + j * 13 + i * j % 11) % 31) as f64 / 15.0 - 1.0;
            (sky_e * (1.0 + 1e-4 * spread + 0.1 * star / peak)) as f32
        });
        let pixels = ndarray::Array2::from_shape_vec(scene.mean.dim(), pixels.collect()).unwrap();
        let frame = photometry_scene::frame(pixels, 0.0);
        let sky = background(&frame, 64, 3.0).unwrap();
        let sources = detect(&frame, &sky, 8.0, Some(4.0));
        let near = |x: f64, y: f64| sources.iter().any(|s| (s.x_px - x).hypot(s.y_px - y) < 0.7);
        let found = stars.iter().filter(|(x, y)| near(*x, *y)).count();
        // the faintest is a 30th of the brightest, some 50 σ
        assert_eq!((found, sources.len()), (stars.len(), stars.len()), "{sky_e}");
    }
}

#[test]
fn single_electrons_on_a_dark_sky_without_read_noise_are_sources_of_finite_flux() {
    // 1e-3 e⁻ per pixel: the mode and its scatter are zero, so every electron stands above the sky
    let frame = Scene::new(300, 300, 1e-3).expose(0.0, 3);
    let sources = detect(&frame, &background(&frame, 64, 3.0).unwrap(), 5.0, None);
    let electrons: f64 = frame.pixels.iter().map(|v| f64::from(*v)).sum();
    assert!(electrons > 50.0 && !sources.is_empty());
    assert!((sources.iter().map(|s| s.flux_e).sum::<f64>() / electrons - 1.0).abs() < 1e-6);
}

#[test]
fn frames_without_scatter_hold_no_sources() {
    for value in [0.0, 42.0, 1e12] {
        let frame = photometry_scene::frame(ndarray::Array2::from_elem((70, 90), value), 0.0);
        assert!(detect(&frame, &background(&frame, 64, 3.0).unwrap(), 5.0, Some(10.0)).is_empty());
    }
}

#[test]
fn centroids_are_as_precise_as_the_photons_allow_and_unbiased() {
    let fwhm = 4.0;
    let (scene, stars) = field(fwhm, 21);
    let frame = scene.expose(2.0, 22);
    let sky = background(&frame, 64, 3.0).unwrap();
    let mut errors = Vec::new();
    for (x, y) in stars {
        let (gx, gy) = centroid(&frame, &sky, x + 0.8, y - 0.6, fwhm).unwrap();
        errors.extend([gx - x, gy - y]);
    }
    let (mean, sd) = mean_sd(&errors);
    println!("centroid error {mean:+.4} ± {sd:.4} px");
    assert!(mean.abs() < 0.01 && sd < 0.06, "{mean} {sd}");
}

#[test]
fn a_centroid_that_runs_away_or_meets_no_light_is_none() {
    let mut scene = Scene::new(200, 200, 80.0);
    scene.star(100.0, 100.0, 50_000.0, 4.0);
    let frame = scene.expose(2.0, 2);
    let sky = background(&frame, 64, 3.0).unwrap();
    assert!(centroid(&frame, &sky, 107.0, 100.0, 4.0).is_none());
    assert!(centroid(&frame, &sky, f64::NAN, 100.0, 4.0).is_none());
    assert!(centroid(&frame, &sky, -500.0, 100.0, 4.0).is_none());
    assert!(centroid(&frame, &sky, 100.0, 100.0, 0.0).is_none());
}

#[test]
fn masks_and_edges_are_flagged_on_sources() {
    let mut scene = Scene::new(200, 200, 80.0);
    for (x, y) in [(50.0, 50.0), (150.0, 50.0), (50.0, 150.0), (199.0, 120.0), (150.0, 150.0)] {
        scene.star(x, y, 50_000.0, 4.0);
    }
    let mut frame = scene.expose(2.0, 2);
    frame.mask[[50, 50]] = mask::SATURATED;
    frame.mask[[51, 150]] = mask::BAD;
    frame.pixels[[51, 150]] = f32::NAN;
    frame.mask.slice_mut(ndarray::s![140..160, 145..155]).fill(mask::CLIPPED);
    let sky = background(&frame, 64, 3.0).unwrap();
    let sources = detect(&frame, &sky, 5.0, Some(4.0));
    let near = |x: f64, y: f64| sources.iter().find(|s| (s.x_px - x).hypot(s.y_px - y) < 3.0).map(|s| s.flags);
    assert_eq!(near(50.0, 50.0), Some(Flags::SATURATED));
    assert_eq!(near(150.0, 50.0), Some(Flags::MASKED));
    assert_eq!(near(50.0, 150.0), Some(Flags::default()));
    assert!(near(198.0, 120.0).unwrap().has(Flags::EDGE));
    assert!(near(150.0, 150.0).is_none()); // what is clipped is not there
}

#[test]
fn an_all_masked_frame_has_no_sources_and_no_width() {
    let mut frame = Scene::new(100, 100, 80.0).expose(2.0, 2);
    let sky = background(&frame, 50, 3.0).unwrap();
    frame.mask.fill(mask::BAD);
    assert!(detect(&frame, &sky, 5.0, None).is_empty());
    assert!(stellar_fwhm(&frame, &sky, &[]).is_none());
}
