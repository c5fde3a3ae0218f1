//! The growth curve of stars and the correction to their whole light: against injected stars and direct integration.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use std::f64::consts::PI;

use ndarray::Array2;
use photometry_scene::Scene;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use satphot::frames::{Electrons, Frame, mask};
use satphot::photometry::aperture::{Shape, shape_sum};
use satphot::photometry::background::background;
use satphot::photometry::detect::{detect, stellar_fwhm};
use satphot::photometry::flux::measure;
use satphot::photometry::growth::{FrameGrowth, GrowthCurve, StarProfile, frame_growth};

const GAUSSIAN: f64 = f64::INFINITY;

/// Adds a Moffat star (a Gaussian for an infinite exponent) of `flux_e` over the infinite plane, integrated over pixels.
fn add_star(image: &mut Array2<f64>, (x, y): (f64, f64), flux_e: f64, fwhm: f64, beta: f64) {
    let (ny, nx) = image.dim();
    let alpha2 = (fwhm / (2.0 * (2f64.powf(1.0 / beta) - 1.0).sqrt())).powi(2);
    let sigma2 = (fwhm / 2.354_820_045_030_949).powi(2);
    let at = |r2: f64| {
        if beta.is_infinite() {
            (-0.5 * r2 / sigma2).exp() / (2.0 * PI * sigma2)
        } else {
            (beta - 1.0) / (PI * alpha2) * (1.0 + r2 / alpha2).powf(-beta)
        }
    };
    // 2e-4 of the light of the widest profile is further out
    let reach = if beta.is_infinite() { 3.5 * fwhm } else { 15.0 * fwhm };
    let range = |c: f64, n: usize| ((c - reach).max(0.0) as usize)..((c + reach).clamp(0.0, n as f64) as usize);
    for j in range(y, ny) {
        for i in range(x, nx) {
            let (dx, dy) = (i as f64 - x, j as f64 - y);
            let r = dx.hypot(dy);
            // points per side of the midpoint rule, whose error is ∇²f/24n²: below 1e-4 of the light in each zone
            let n = if r < 1.5 * fwhm {
                (16.0 / fwhm).ceil() as usize + 2
            } else {
                1 + ((10.0 / r).ceil() as usize).max(usize::from(r < 8.0 * fwhm))
            };
            let place = |m: usize| (m as f64 + 0.5) / n as f64 - 0.5;
            let sum: f64 = (0..n * n).map(|k| at((dx + place(k % n)).powi(2) + (dy + place(k / n)).powi(2))).sum();
            image[[j, i]] += flux_e * sum / (n * n) as f64;
        }
    }
}

struct Night {
    frames: Vec<Frame<Electrons>>,
    stars: Vec<Vec<(f64, f64, f64)>>,
    growth: Vec<FrameGrowth>,
    fwhm: Vec<f64>,
    curve: GrowthCurve,
}

/// Frames of 7 × 7 stars of 10⁴ to 10⁶ e⁻ with random places on the pixels, one frame per FWHM, and a few faint ones.
fn night(beta: f64, fwhms: &[f64], seed: u64) -> Night {
    let (mut frames, mut all_stars, mut growth, mut widths) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (k, &fwhm) in fwhms.iter().enumerate() {
        let mut rng = ChaCha12Rng::seed_from_u64(seed + k as u64);
        let cell = (22.0 * fwhm).ceil();
        let size = (7.0 * cell) as usize;
        let mut scene = Scene::new(size, size, 60.0);
        let mut stars = Vec::new();
        for c in 0..49 {
            let centre = |c: i32| (f64::from(c) + 0.5) * cell;
            let (x, y) = (centre(c % 7) + rng.random_range(-2.0..2.0), centre(c / 7) + rng.random_range(-2.0..2.0));
            stars.push((x, y, 10f64.powf(rng.random_range(4.0..6.0))));
        }
        for &(x, y, flux) in &stars {
            add_star(&mut scene.mean, (x, y), flux, fwhm, beta);
        }
        for _ in 0..30 {
            let (x, y) = (rng.random_range(0.0..size as f64), rng.random_range(0.0..size as f64));
            add_star(&mut scene.mean, (x, y), 150.0, fwhm, beta);
        }
        let frame = scene.expose(3.0, seed + 100 + k as u64);
        let sky = background(&frame, 64, 3.0).unwrap();
        let sources = detect(&frame, &sky, 5.0, None);
        let width = stellar_fwhm(&frame, &sky, &sources).unwrap();
        growth.push(frame_growth(&frame, &sky, &sources, width, 3.0).unwrap());
        frames.push(frame);
        all_stars.push(stars);
        widths.push(width);
    }
    let curve = GrowthCurve::of_night(&growth.iter().collect::<Vec<_>>(), 2.0, (3.0, 5.0)).unwrap();
    Night { frames, stars: all_stars, growth, fwhm: widths, curve }
}

/// Mean of (measured − true) magnitude and its error, without and with the correction, weighted by the errors.
fn magnitude_errors(night: &Night) -> [(f64, f64); 2] {
    let (mut raw, mut corrected, mut weights) = (0.0, 0.0, 0.0);
    for (((frame, stars), growth), &w) in night.frames.iter().zip(&night.stars).zip(&night.growth).zip(&night.fwhm) {
        let profile = growth.profile(&night.curve.profile, w).unwrap_or(night.curve.profile);
        let sky = background(frame, 64, 3.0).unwrap();
        for &(x, y, flux) in stars {
            let (r, ring) = (2.0 * w, (3.0 * w, 5.0 * w));
            let got = measure(frame, &sky, x, y, Shape::Circle { r_px: r }, ring.0, ring.1, 3.0);
            let error = -2.5 * (got.flux_e / flux).log10();
            let weight = (1.0857 * got.flux_err_e / got.flux_e).hypot(0.003).powi(-2);
            raw += weight * error;
            corrected += weight * (error + profile.star_correction_mag(w, r, ring, got.flux_e, got.sky_rms_e));
            weights += weight;
        }
    }
    [raw, corrected].map(|sum| (sum / weights, weights.sqrt().recip()))
}

#[test]
fn star_magnitudes_are_unbiased_for_moffats_and_gaussians_and_for_seeing_that_varies() {
    for (beta, least) in [(2.5, 0.04), (3.5, 0.013), (5.0, 0.004), (GAUSSIAN, -0.001)] {
        for fwhms in [[2.3, 2.6, 2.0], [4.0, 5.2, 3.4]] {
            let night = night(beta, &fwhms, 7);
            let [(raw, _), (corrected, err)] = magnitude_errors(&night);
            println!(
                "beta {beta} FWHM {fwhms:?}: {raw:+.4} -> {corrected:+.4} +- {err:.4}; {}",
                night.curve.explanation()
            );
            assert!(raw > least, "{raw}: the loss that is to be corrected is there");
            assert!(corrected.abs() < 0.003, "beta {beta} FWHM {fwhms:?}: {corrected} +- {err}");
        }
    }
}

#[test]
fn the_exponent_found_is_the_one_injected_within_its_error() {
    for (beta, fwhm) in [(2.5, 3.0), (4.0, 3.0), (4.0, 6.0)] {
        let found = night(beta, &[fwhm], 30).curve.profile;
        let pull = (found.beta.recip() - 1.0 / beta) / found.inverse_beta_err.hypot(0.005);
        println!("beta {beta} FWHM {fwhm}: {:.3} +- {:.3}, {} stars", found.beta, found.beta_err(), found.n_stars);
        assert!(pull.abs() < 3.0 && found.beta_err() < 0.1 * beta && found.n_stars >= 20, "{found:?}");
    }
}

#[test]
fn a_night_of_gaussians_is_corrected_by_nothing() {
    for (fwhm, seed) in [(3.0, 1), (3.0, 11), (3.0, 21), (6.0, 31)] {
        let night = night(GAUSSIAN, &[fwhm], seed);
        let profile = night.curve.profile;
        let circle = Shape::Circle { r_px: 2.0 * fwhm };
        let ring = (3.0 * fwhm, 5.0 * fwhm);
        let mag = profile.correction_mag(fwhm, circle, ring, None);
        assert!(profile.beta.is_infinite() && profile.beta_err().is_infinite(), "{profile:?}");
        assert!((-2e-4..=0.0).contains(&mag), "{mag}");
        assert!(profile.correction_err_mag(fwhm, circle, ring, None) < 5e-4);
        assert!((profile.fwhm_ratio - 1.0).abs() < 0.01, "{profile:?}");
    }
}

/// Sum in an aperture less its area times the mean of the annulus, of an ellipse of light 1 blurred by a profile and
/// integrated over pixels, by brute force: many points, each drawn, at a few places on the pixels.
fn direct(beta: f64, fwhm: f64, aperture: Shape, (inner, outer): (f64, f64), source: Option<(f64, f64, f64)>) -> f64 {
    let half = (outer + 2.0).ceil();
    let size = 2 * half as usize + 1;
    let (a, b, theta) = source.unwrap_or((0.0, 0.0, 0.0));
    let points = if source.is_some() { 250 } else { 1 };
    let places = [(0.1, 0.4), (-0.3, -0.2)];
    let total: f64 = places
        .iter()
        .map(|&(px, py)| {
            let mut image = Array2::zeros((size, size));
            for k in 0..points {
                // a sunflower: uniform in the ellipse
                let (rho, phi) = (((k as f64 + 0.5) / points as f64).sqrt(), k as f64 * 2.399_963_229_728_653);
                let (u, v) = (rho * a * phi.cos(), rho * b * phi.sin());
                let (x, y) = (u * theta.cos() - v * theta.sin(), u * theta.sin() + v * theta.cos());
                add_star(&mut image, (half + px + x, half + py + y), 1.0 / points as f64, fwhm, beta);
            }
            let circle = |r_px: f64| shape_sum(&image, &Shape::Circle { r_px }, half + px, half + py);
            let level = (circle(outer) - circle(inner)) / (PI * (outer * outer - inner * inner));
            shape_sum(&image, &aperture, half + px, half + py) - aperture.area_px() * level
        })
        .sum();
    2.5 * (total / places.len() as f64).log10()
}

#[test]
fn the_correction_is_that_of_direct_integration_for_every_shape_and_source() {
    let (fwhm, ring) = (3.0, (14.0, 20.0));
    let outline = (9.0, 4.0, 0.5);
    let shapes = [
        Shape::Circle { r_px: 6.0 },
        Shape::Ellipse { a_px: 12.0, b_px: 7.0, theta_rad: 0.5 },
        Shape::Rectangle { a_px: 11.0, b_px: 6.0, theta_rad: 0.5 },
        Shape::Pill { a_px: 11.0, b_px: 6.0, theta_rad: 0.4 },
        Shape::Rectangle { a_px: 3.0, b_px: 9.0, theta_rad: 1.3 },
    ];
    for beta in [2.5, GAUSSIAN] {
        let profile = StarProfile::moffat(beta);
        for (k, shape) in shapes.into_iter().enumerate() {
            let source = (k > 0).then_some(outline);
            let got_source = source.map(|(a_px, b_px, theta_rad)| Shape::Ellipse { a_px, b_px, theta_rad });
            let start = std::time::Instant::now();
            let got = profile.correction_mag(fwhm, shape, ring, got_source);
            let us = start.elapsed().as_micros();
            let truth = direct(beta, fwhm, shape, ring, source);
            println!("beta {beta} {shape} source {source:?}: {got:+.5}, direct {truth:+.5}, {us} us");
            assert!((got - truth).abs() < 1e-3, "beta {beta} {shape:?}: {got} {truth}");
        }
        // a point in every shape
        for shape in shapes {
            let (got, truth) = (profile.correction_mag(fwhm, shape, ring, None), direct(beta, fwhm, shape, ring, None));
            assert!((got - truth).abs() < 1e-3, "beta {beta} {shape:?}: {got} {truth}");
        }
    }
}

#[test]
fn a_resolved_source_loses_more_than_a_point_and_a_vanishing_one_as_much() {
    let profile = StarProfile::moffat(3.0);
    let at = |a_px: f64, b_px: f64, grown: f64| {
        let source = Shape::Ellipse { a_px, b_px, theta_rad: 0.3 };
        profile.correction_mag(10.0, source.grown(grown), (190.0, 250.0), Some(source))
    };
    let point = profile.correction_mag(10.0, Shape::Circle { r_px: 15.0 }, (190.0, 250.0), None);
    assert!((at(1e-6, 1e-6, 15.0) - point).abs() < 1e-6);
    // 280 px across: the same margin holds nearly the same share of the light at every place of the edge, more inside
    let (small, large) = (at(5.0, 5.0, 15.0), at(140.0, 40.0, 15.0));
    assert!(point < small && small < large && large < 0.0, "{point} {small} {large}");
    // a wider margin holds more, and much holds all
    assert!(at(140.0, 40.0, 30.0) > large && at(20.0, 20.0, 150.0).abs() < 0.01);
    // the fall with radius is the same in any unit
    let scaled = profile.correction_mag(20.0, Shape::Circle { r_px: 80.0 }, (120.0, 200.0), None);
    let unscaled = profile.correction_mag(10.0, Shape::Circle { r_px: 40.0 }, (60.0, 100.0), None);
    assert!((scaled - unscaled).abs() < 1e-4, "{scaled} {unscaled}"); // pixels do not scale
}

#[test]
fn pixels_cost_what_the_anchors_say() {
    // pixel-integrated Gaussian against the continuous one, exact overlap (photutils and sep): (FWHM, r/FWHM, share)
    for (fwhm, r_fwhm, anchor, tolerance) in [
        (2.0, 0.7, -0.102, 2e-3),
        (2.0, 1.0, -0.045, 2e-3),
        (2.0, 1.5, -0.0041, 3e-4),
        (2.0, 2.0, -9e-5, 4e-5),
        (4.0, 0.7, -0.027, 6e-4),
        (4.0, 1.0, -0.011, 6e-4),
        (4.0, 1.5, -7.8e-4, 3e-5),
        (10.0, 0.7, -0.0043, 6e-5),
        (10.0, 1.0, -0.0017, 6e-5),
        (10.0, 1.5, -1.1e-4, 6e-6),
    ] {
        let profile = StarProfile::moffat(GAUSSIAN);
        let r = r_fwhm * fwhm;
        let on_pixels = 10f64.powf(0.4 * profile.correction_mag(fwhm, Shape::Circle { r_px: r }, (0.0, 0.0), None));
        let change = on_pixels / profile.enclosed(fwhm, r) - 1.0;
        assert!((change - anchor).abs() < tolerance, "FWHM {fwhm} r {r_fwhm}: {change:+.2e}, anchor {anchor:+.1e}");
    }
}

#[test]
fn corrections_of_nothing_are_nan_and_of_everything_zero_and_never_panic() {
    let profile = StarProfile::moffat(3.5);
    let circle = Shape::Circle { r_px: 6.0 };
    for fwhm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(profile.correction_mag(fwhm, circle, (9.0, 15.0), None).is_nan());
    }
    // a hundredth of the width holds 2e-4 of the light: no number is better than one that was cut at 4 mag
    assert!(profile.correction_mag(10.0, Shape::Circle { r_px: 0.1 }, (0.0, 0.0), None).is_nan());
    assert!(profile.correction_mag(3.0, Shape::Circle { r_px: 0.0 }, (9.0, 15.0), None).is_nan());
    assert!(profile.correction_mag(3.0, Shape::Circle { r_px: 1e5 }, (0.0, 0.0), None).abs() < 1e-6);
    // an aperture far too small for its source, too, holds hardly any of its light
    let tiny = Shape::Pill { a_px: 0.2, b_px: 0.1, theta_rad: 0.0 };
    let source = Some(Shape::Circle { r_px: 300.0 });
    assert!(profile.correction_mag(3.0, tiny, (9.0, 15.0), source).is_nan());
    for (flux, rms) in [(0.0, 1.0), (-50.0, 1.0), (f64::NAN, 1.0), (1e4, 0.0), (1e4, f64::NAN)] {
        let mag = profile.star_correction_mag(3.0, 6.0, (9.0, 15.0), flux, rms);
        assert!((-0.05..=0.0).contains(&mag), "{flux} {rms}: {mag}");
    }
    assert!(GrowthCurve::of_night(&[], 2.0, (3.0, 5.0)).is_none());
}

#[test]
fn saturated_crowded_and_cut_stars_are_no_part_of_the_growth_curve() {
    let (fwhm, size) = (3.0, 500);
    let star = |frame: &Frame<Electrons>| {
        let sky = background(frame, 50, 3.0).unwrap();
        frame_growth(frame, &sky, &detect(frame, &sky, 5.0, Some(fwhm)), fwhm, 3.0).map_or(0, |g| g.n_stars)
    };
    let scene = |neighbours: &[(f64, f64, f64)]| {
        let mut scene = Scene::new(size, size, 40.0);
        for &(x, y, flux) in [(250.2, 249.7, 1e5)].iter().chain(neighbours) {
            scene.star(x, y, flux, fwhm);
        }
        scene.expose(2.0, 5)
    };
    let alone = scene(&[]);
    assert_eq!(star(&alone), 1);
    let mut saturated = alone.clone();
    saturated.mask[[250, 250]] = mask::SATURATED;
    assert_eq!(star(&saturated), 0);
    let mut bad = alone.clone();
    bad.mask[[252, 251]] = mask::BAD;
    assert_eq!(star(&bad), 0);
    let mut bad_far_out = alone;
    bad_far_out.mask[[262, 251]] = mask::BAD;
    assert_eq!(star(&bad_far_out), 1);
    // as bright a neighbour in the sky annulus spoils both; a faint one there is masked; a faint one near is not
    assert_eq!(star(&scene(&[(270.0, 250.0, 9e4)])), 0);
    assert_eq!(star(&scene(&[(268.0, 250.0, 1e3)])), 1);
    assert_eq!(star(&scene(&[(261.5, 250.0, 1e3)])), 0);
    let mut edge = Scene::new(size, size, 40.0);
    edge.star(20.0, 250.0, 1e5, fwhm);
    assert_eq!(star(&edge.expose(2.0, 6)), 0);
}

#[test]
fn the_figure_of_the_growth_curve_shows_the_choice_and_an_empty_one_says_why() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let night = night(3.5, &[3.0], 3);
    let path = folder.join("growth.svg");
    satphot::figures::growth_curve(&path, Some(&night.curve)).unwrap();
    let svg = std::fs::read_to_string(&path).unwrap();
    assert!(svg.contains("FWHM holds 0.98") && svg.contains("49 stars") && !svg.contains("NaN"));
    // the points lie on the line: the curve is the profile's within its errors
    for ((enclosed, fitted), err) in night.curve.enclosed.iter().zip(&night.curve.fitted).zip(&night.curve.err) {
        assert!((enclosed - fitted).abs() < 4.0 * err, "{enclosed} {fitted} {err}");
    }
    assert!(night.curve.snr_rel.iter().all(|s| (0.0..=1.0).contains(s)));
    let best = night.curve.best_snr_r_fwhm;
    assert!((0.6..0.8).contains(&best), "{best}"); // 0.67 FWHM for a Gaussian
    let path = folder.join("growth_empty.svg");
    satphot::figures::growth_curve(&path, None).unwrap();
    assert!(std::fs::read_to_string(&path).unwrap().contains("no data"));
}
