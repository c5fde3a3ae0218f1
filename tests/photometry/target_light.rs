//! What the target looks like and what is mixed with it: surface brightness, hits, edges, neighbours, trails, moonlight.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use photometry_scene::station::{Case, Stars};
use photometry_scene::{Scene, mean_sd};
use rayon::prelude::*;
use satphot::config::ApertureShape;
use satphot::frames::{Electrons, Frame, mask};
use satphot::photometry::Flags;
use satphot::photometry::aperture::Shape;
use satphot::photometry::background::background;
use satphot::photometry::flux::Flux;
use satphot::photometry::surface_brightness::inst_mu;
use satphot::photometry::target::measure::Light;
use satphot::photometry::target::measure::TargetFound;
use satphot::photometry::target::measure::measure_target;
use satphot::photometry::target::settings::TargetSettings;

const FWHM: f64 = 4.0;
const SKY: f64 = 60.0;

fn settings(n: f64) -> TargetSettings {
    photometry_scene::target_settings(n, 0.35 * n, FWHM)
}

fn detected(frame: &Frame<Electrons>, s: &TargetSettings) -> (Flux, f64, f64, Light) {
    match measure_target(frame, &background(frame, 64, 3.0).unwrap(), s) {
        TargetFound::Detected { flux, x_px, y_px, light, .. } => (flux, x_px, y_px, light),
        TargetFound::NotDetected { .. } => panic!("not found"),
    }
}

/// An even disc of `e_px` electrons per pixel, its edge as sharp as a pixel, blurred by nothing.
fn disc(n: usize, r_px: f64, e_px: f64) -> Scene {
    let mut scene = Scene::new(n, n, SKY);
    let c = n as f64 / 2.0;
    for ((j, i), m) in scene.mean.indexed_iter_mut() {
        *m += e_px * Shape::Circle { r_px }.pixel_fraction(i as f64 - c, j as f64 - c);
    }
    scene
}

#[test]
fn an_even_disc_has_its_own_surface_brightness_at_any_pixel_scale_and_exposure() {
    // 20 mag/arcsec2 is 1e-8 e-/s/arcsec2 for an instrumental zeropoint of 0: brightness per pixel goes with scale² and time
    for (scale_arcsec, exptime_s, r_px) in [(0.5, 1.0, 40.0), (1.0, 1.0, 20.0), (0.5, 4.0, 40.0), (1.0, 0.25, 20.0)] {
        let per_arcsec2 = 400.0;
        let e_px = per_arcsec2 * exptime_s * scale_arcsec * scale_arcsec;
        let frame = disc(300, r_px, e_px).expose(2.0, 5);
        let (flux, _, _, light) = detected(&frame, &settings(300.0));
        let peak = inst_mu(light.peak_disc_e_px.unwrap(), exptime_s, 1.0, scale_arcsec).unwrap();
        let truth = -2.5 * f64::log10(per_arcsec2);
        // the brightest of some hundred discs of 12 px: up to 3 σ of noise of a disc
        let noise = 3.5 * ((SKY + 4.0 + e_px) / (0.25 * std::f64::consts::PI * FWHM * FWHM)).sqrt() / e_px;
        println!("{scale_arcsec} arcsec, {exptime_s} s: peak {peak:.3}, truth {truth:.3}, noise {noise:.3}");
        assert!(truth - peak < 1.1 * noise && truth - peak > -0.02, "{peak} {truth}");
        // the mean is over the aperture, whose margin is empty
        let mean = inst_mu(flux.flux_e, exptime_s, flux.area_px, scale_arcsec).unwrap();
        let disc_area = std::f64::consts::PI * r_px * r_px;
        assert!((mean - truth - 2.5 * (flux.area_px / disc_area).log10()).abs() < 0.03, "{mean}");
    }
    assert_eq!(inst_mu(-1.0, 1.0, 1.0, 1.0), None);
    assert_eq!(inst_mu(100.0, 0.0, 1.0, 1.0), None);
}

#[test]
fn every_forced_shape_holds_the_target_and_auto_is_the_smallest_of_them() {
    let case = Case { stars: Stars::None, snr: 150.0, seed: 11, ..station() };
    let scene = case.expose();
    let forced = |shape| {
        let (flux, ..) = detected(&scene.frame, &TargetSettings { shape, ..of_station(&case) });
        assert!((flux.flux_e - scene.flux_e).abs() < 4.0 * flux.flux_err_e, "{shape:?}: {}", flux.flux_e);
        flux.shape
    };
    let kinds = [ApertureShape::Circle, ApertureShape::Ellipse, ApertureShape::Rectangle, ApertureShape::Pill];
    let shapes = kinds.map(forced);
    assert_eq!(shapes.map(|s| s.name()), ["circle", "ellipse", "rectangle", "pill"]);
    let auto = forced(ApertureShape::Auto).area_px();
    let least = shapes.iter().map(Shape::area_px).fold(f64::INFINITY, f64::min);
    // a simpler shape is taken within a tenth
    assert!(auto <= 1.1 * least + 1e-6, "{auto} {least}");
}

fn station() -> Case {
    Case {
        n: 400,
        fwhm: 3.5,
        length: 98.0,
        sky_e: 200.0,
        read_noise_e: 2.0,
        snr: 50.0,
        stars: Stars::None,
        gradient: 1.0,
        seed: 1,
    }
}

fn of_station(case: &Case) -> TargetSettings {
    let n = case.n as f64;
    TargetSettings {
        fwhm_px: case.fwhm,
        search_radius_px: 0.4 * n,
        margin_px: 1.5 * case.fwhm,
        limit_r_px: 2.0 * case.fwhm,
        sky_in_px: 3.0 * case.fwhm,
        sky_out_px: 5.0 * case.fwhm,
        ..settings(n)
    }
}

#[test]
fn a_hit_is_flagged_and_neither_structure_nor_noise_is() {
    let results: Vec<(bool, bool)> = (0..9u64)
        .into_par_iter()
        .map(|seed| {
            let case = Case { seed: 300 + seed, snr: [20.0, 100.0, 500.0][seed as usize % 3], ..station() };
            let mut scene = case.expose();
            let clean = detected(&scene.frame, &of_station(&case)).0.flags.has(Flags::HIT);
            let at = [(scene.y + 2.0) as usize, (scene.x + 3.0) as usize];
            // twice what is there and 15 σ more: at 3.5 px a star may be as sharp as half of that
            let expected = scene.frame.pixels[at].max(case.sky_e as f32);
            scene.frame.pixels[at] += 15.0 * expected.sqrt() + (expected - case.sky_e as f32).max(0.0);
            (clean, detected(&scene.frame, &of_station(&case)).0.flags.has(Flags::HIT))
        })
        .collect();
    let (alarms, hits) = (results.iter().filter(|r| r.0).count(), results.iter().filter(|r| r.1).count());
    println!("hits {hits}, false alarms {alarms} of {}", results.len());
    assert!(alarms == 0 && hits >= 8, "{alarms} {hits}");
}

#[test]
fn a_target_cut_by_the_frame_or_by_the_clip_circle_is_flagged() {
    let mut scene = Scene::new(200, 200, SKY);
    scene.smear(100.0, 3.0, 20_000.0, FWHM, 20.0, 0.2);
    let at_edge = TargetSettings { y_px: 20.0, ..settings(200.0) };
    let (flux, ..) = detected(&scene.expose(2.0, 1), &at_edge);
    assert!(flux.flags.has(Flags::EDGE) && !flux.flags.has(Flags::CLIP_EDGE), "{}", flux.flags);
    let mut scene = Scene::new(240, 240, SKY);
    scene.smear(190.0, 120.0, 20_000.0, FWHM, 20.0, 0.2);
    let mut frame = scene.expose(2.0, 2);
    for ((j, i), m) in frame.mask.indexed_iter_mut() {
        if (i as f64 - 120.0).hypot(j as f64 - 120.0) > 78.0 {
            *m |= mask::CLIPPED;
        }
    }
    let (flux, ..) = detected(&frame, &settings(240.0));
    assert!(flux.flags.has(Flags::CLIP_EDGE) && !flux.flags.has(Flags::EDGE), "{}", flux.flags);
}

#[test]
fn a_point_source_next_to_the_target_is_contamination() {
    // within the rectangle around an L of light, but not of it
    let near_the_corner = TargetSettings { x_px: 122.0, y_px: 132.0, ..settings(300.0) };
    let mut scene = Scene::new(300, 300, SKY);
    scene.smear(150.0, 130.0, 60_000.0, FWHM, 60.0, 0.0);
    scene.smear(120.0, 160.0, 60_000.0, FWHM, 60.0, std::f64::consts::FRAC_PI_2);
    let alone = detected(&scene.expose(2.0, 3), &near_the_corner);
    assert!(!alone.0.flags.has(Flags::CONTAMINATED), "{}", alone.0.flags);
    scene.star(150.0, 160.0, 15_000.0, FWHM);
    let (flux, _, _, light) = detected(&scene.expose(2.0, 3), &near_the_corner);
    assert!(flux.flags.has(Flags::CONTAMINATED), "{} {light:?}", flux.flags);
    // 0.94 of the light of a star lies within its FWHM
    assert!((light.contamination_e / 15_000.0 - 1.0).abs() < 0.1, "{}", light.contamination_e);
}

#[test]
fn moonlight_across_the_frame_neither_moves_the_flux_nor_belies_its_error() {
    // level doubled or trebled across the frame, linear and quadratic; with and without trails
    for (stars, gradient) in [(Stars::None, 3.0), (Stars::Few, 3.0)] {
        let pulls: Vec<f64> = (0..12u64)
            .into_par_iter()
            .map(|seed| {
                let case = Case { stars, gradient, seed: 7000 + seed, ..station() };
                let scene = case.expose();
                let (flux, ..) = detected(&scene.frame, &of_station(&case));
                (flux.flux_e - scene.flux_e) / flux.flux_err_e
            })
            .collect();
        let (mean, sd) = mean_sd(&pulls);
        println!("{stars:?}, gradient {gradient}: pull {mean:+.2} ± {sd:.2}");
        // 3 standard errors of 12 values, and of their standard deviation
        assert!(mean.abs() < 3.0 / 12f64.sqrt() && sd < 1.0 + 3.0 / 24f64.sqrt(), "{stars:?} {gradient}: {mean} {sd}");
    }
}

#[test]
fn a_single_faint_trail_through_the_target_is_found_and_only_there() {
    let flagged = |stars: Stars| -> Vec<(bool, f64)> {
        (0..12u64)
            .into_par_iter()
            .map(|seed| {
                let case = Case { stars, seed: 8000 + seed, ..station() };
                let scene = case.expose();
                let (flux, x, y, _) = detected(&scene.frame, &of_station(&case));
                let light: f64 = scene.light_of_trails(x, y, &flux.shape).iter().sum();
                (flux.flags.has(Flags::CONTAMINATED), light / scene.flux_e)
            })
            .collect()
    };
    let alarms = flagged(Stars::None).iter().filter(|f| f.0).count();
    let one = flagged(Stars::One);
    let missed: Vec<f64> = one.iter().filter(|f| f.1 > 0.05 && !f.0).map(|f| f.1).collect();
    let wanted = one.iter().filter(|f| f.1 > 0.05).count();
    println!("{alarms} false alarms; missed {missed:.2?} of {wanted}");
    assert!(alarms <= 1 && missed.len() <= 1, "{alarms} {missed:?}");
}
