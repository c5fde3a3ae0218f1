//! Detection, centroids and widths against injected stars.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

mod photometry_scene;

use photometry_scene::{Scene, mean_sd};
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
    let frame = scene.expose(2.0, 9);
    let in_pool = |n: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| {
            let sky = background(&frame, 64, 3.0).unwrap();
            format!("{:?}", detect(&frame, &sky, 3.0, None))
        })
    };
    assert_eq!(in_pool(1), in_pool(3));
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
