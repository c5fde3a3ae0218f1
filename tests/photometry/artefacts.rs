//! What looks like a target and is none: satellites that cross, charge spilt from saturated trails, reflections of bright stars.
//! Alone they are not measured, and a target near them is measured rightly or not at all.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene::{self, Scene};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rayon::prelude::*;
use satphot::frames::{Electrons, Frame, mask};
use satphot::photometry::Flags;
use satphot::photometry::background::background;
use satphot::photometry::flux::Flux;
use satphot::photometry::target::measure::{KnownDirection, TargetFound, measure_target};
use satphot::photometry::target::settings::TargetSettings;

const SIDE: usize = 260;
const SEARCH: f64 = 60.0;
const SKY: f64 = 150.0;
const READ_NOISE: f64 = 3.0;
const WELL_E: f64 = 20_000.0;
const MIDDLE: f64 = SIDE as f64 / 2.0;

/// Adds to a scene what the case is about, given a place at which a target may stand 12 FWHM away.
type Artefact = fn(&mut Scene, &mut ChaCha12Rng, f64, (f64, f64));

/// Star trails at 0.4 rad.
fn trails(scene: &mut Scene, rng: &mut ChaCha12Rng, fwhm: f64) {
    for _ in 0..4 {
        let at = (rng.random_range(0.0..SIDE as f64), rng.random_range(0.0..SIDE as f64));
        scene.line(at.0, at.1, rng.random_range(100.0..600.0), fwhm, 0.4);
    }
}

/// A satellite crosses at another angle, through the place.
fn crossing(scene: &mut Scene, rng: &mut ChaCha12Rng, fwhm: f64, (x, y): (f64, f64)) {
    trails(scene, rng, fwhm);
    scene.line(x, y, rng.random_range(1_500.0..6_000.0), fwhm, 0.4 + rng.random_range(0.5..2.5));
}

/// A saturated trail through the place, whose charge spills along its columns.
pub fn blooming(scene: &mut Scene, rng: &mut ChaCha12Rng, fwhm: f64, (x, y): (f64, f64)) {
    scene.line(x, y - 40.0, 3.0 * WELL_E * fwhm, fwhm, 0.05);
    for _ in 0..3 {
        let column = (x + rng.random_range(-30.0..30.0)) as usize;
        let width = rng.random_range(1..3);
        let (below, above) = (rng.random_range(10..50), rng.random_range(10..50));
        for j in (y as usize - 40 - below)..(y as usize - 40 + above) {
            for i in column..column + width {
                // saturated near the trail, less at the ends
                let share =
                    1.0 - (j as f64 - (y - 40.0)).abs() / if (j as f64) < y - 40.0 { below } else { above } as f64;
                scene.mean[[j.min(SIDE - 1), i.min(SIDE - 1)]] += 2.0 * WELL_E * share;
            }
        }
    }
}

/// A reflection of a bright star: an image of the telescope's mouth out of focus, whose light trails as the star does.
fn ghost(scene: &mut Scene, rng: &mut ChaCha12Rng, fwhm: f64, (x, y): (f64, f64)) {
    trails(scene, rng, fwhm);
    let (outer, hole) = (rng.random_range(8.0..20.0), rng.random_range(0.3..0.5));
    let peak = rng.random_range(10.0..100.0);
    // what a line across a ring holds, less what its hole leaves out
    let chord = |v: f64, r: f64| (r * r - v * v).max(0.0).sqrt() / outer;
    for k in -40..=40 {
        let v = outer * f64::from(k) / 40.0;
        let light = peak * (chord(v, outer) - chord(v, hole * outer)) * outer / 40.0;
        scene.line(x - v * 0.4f64.sin(), y + v * 0.4f64.cos(), light, fwhm, 0.4);
    }
}

/// Counts saturate, and such pixels are masked as they are in files.
pub fn exposed(mut scene: Scene, seed: u64) -> Frame<Electrons> {
    scene.mean.mapv_inplace(|m| m.min(WELL_E));
    let mut frame = scene.expose(READ_NOISE, seed);
    let saturated: Vec<_> =
        frame.pixels.indexed_iter().filter(|(_, v)| f64::from(**v) > 0.95 * WELL_E).map(|(at, _)| at).collect();
    saturated.into_iter().for_each(|at| frame.mask[at] |= mask::SATURATED);
    frame
}

/// Of `n` scenes: false detections, those flagged among the rest, targets found, and of them off by more than 4 σ unflagged.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    false_detections: usize,
    flagged: usize,
    found: usize,
    wrong: usize,
}

fn tally(artefact: Artefact, flag: Flags, fwhm: f64, with_target: bool, apart_fwhm: f64, n: u64, seed: u64) -> Tally {
    let one = |k: u64| {
        let mut rng = ChaCha12Rng::seed_from_u64(seed + 7919 * k);
        let mut scene = Scene::new(SIDE, SIDE, SKY);
        let angle = rng.random_range(0.0..std::f64::consts::TAU);
        let at = (MIDDLE + rng.random_range(-10.0..10.0), MIDDLE + rng.random_range(-10.0..10.0));
        artefact(&mut scene, &mut rng, fwhm, at);
        // within the search region, however wide the images
        let apart = (apart_fwhm * fwhm).min(0.75 * SEARCH);
        let target = (at.0 + apart * angle.cos(), at.1 + apart * angle.sin());
        let truth = 60.0 * (std::f64::consts::PI * (2.0 * fwhm).powi(2) * SKY).sqrt();
        if with_target {
            scene.star(target.0, target.1, truth, fwhm);
        }
        let frame = exposed(scene, seed + k);
        let s = photometry_scene::target_settings(SIDE as f64, SEARCH, fwhm);
        let found = measure_target(&frame, &background(&frame, 64, 3.0).unwrap(), &s);
        let outside = |f: &Flux| !f.flags.any(flag | Flags::SATURATED);
        let mut t = Tally::default();
        match found {
            TargetFound::Detected { flux, x_px, y_px, .. } if flux.snr >= 5.0 => {
                if with_target && (x_px - target.0).hypot(y_px - target.1) < 1.5 * fwhm {
                    t.found = 1;
                    // Moments of a point and its wings: a few per cent of the light are outside any aperture
                    let off = (flux.flux_e - truth).abs() > 4.0 * flux.flux_err_e + 0.03 * truth;
                    t.wrong = usize::from(off && outside(&flux));
                } else if outside(&flux) {
                    t.false_detections = 1;
                    if std::env::var_os("OUTLIERS").is_some() {
                        println!(
                            "  {k}: S/N {:.1} at {x_px:.1} {y_px:.1}, artefact at {at:.1?}, {}",
                            flux.snr, flux.flags
                        );
                    }
                } else {
                    t.flagged = 1;
                }
            }
            TargetFound::Detected { flux, .. } | TargetFound::NotDetected { flux, .. } => {
                t.flagged = usize::from(flux.flags.has(flag));
            }
        }
        t
    };
    (0..n).into_par_iter().map(one).reduce(Tally::default, |a, b| Tally {
        false_detections: a.false_detections + b.false_detections,
        flagged: a.flagged + b.flagged,
        found: a.found + b.found,
        wrong: a.wrong + b.wrong,
    })
}

fn check(n: u64, seed: u64, fwhms: &[f64]) {
    let cases: [(&str, Artefact, Flags); 3] = [
        ("crossing", crossing, Flags::CROSSED),
        ("blooming", blooming, Flags::BLOOMING),
        ("ghost", ghost, Flags::CONTAMINATED),
    ];
    for (name, artefact, flag) in cases {
        for &fwhm in fwhms {
            let alone = tally(artefact, flag, fwhm, false, 0.0, n, seed);
            let twin = tally(artefact, flag, fwhm, true, 12.0, n, seed + 1);
            println!(
                "{name:9} FWHM {fwhm:3.1}: alone {} false, {} flagged of {n}; with a target 12 FWHM away, 45 px at most, \
                 {} found, {} of them \
                 wrong, {} false",
                alone.false_detections, alone.flagged, twin.found, twin.wrong, twin.false_detections
            );
            if std::env::var_os("LOOK").is_none() {
                assert!(alone.false_detections as u64 <= n / 25, "{name} {fwhm}: {alone:?}");
                assert!((twin.wrong + twin.false_detections) as u64 <= n / 20, "{name} {fwhm}: {twin:?}");
                assert!(flag == Flags::CROSSED || 2 * twin.found as u64 >= n, "{name} {fwhm}: {twin:?}");
            }
        }
        // a target under the line: not measured without a word
        if flag == Flags::CROSSED {
            let under = tally(artefact, flag, 3.0, true, 0.0, n, seed + 2);
            println!(
                "{name:9} through the target: {} wrong, {} false, {} not found and flagged",
                under.wrong, under.false_detections, under.flagged
            );
            if std::env::var_os("LOOK").is_none() {
                assert!((under.wrong + under.false_detections) as u64 <= n / 25, "{under:?}");
            }
        }
    }
}

#[test]
fn crossing_satellites_spilt_charge_and_ghosts_are_not_measured_as_the_target() {
    check(6, 31, &[3.0]);
}

/// Without a star trail the only line of the frame is taken for one; where the direction of the trails is known, that it is none is seen.
#[test]
fn a_satellite_that_crosses_a_frame_without_star_trails_is_flagged_where_their_direction_is_known() {
    let flagged = |k: u64, known: f64| {
        let (mut rng, fwhm) = (ChaCha12Rng::seed_from_u64(4_242 + k), 3.0_f64);
        let mut scene = Scene::new(SIDE, SIDE, SKY);
        scene.star(MIDDLE, MIDDLE, 60.0 * (std::f64::consts::PI * (2.0 * fwhm).powi(2) * SKY).sqrt(), fwhm);
        let theta = 0.4 + rng.random_range(0.5..2.5);
        scene.line(MIDDLE, MIDDLE, rng.random_range(1_500.0..6_000.0), fwhm, theta);
        let frame = exposed(scene, k);
        let trail_direction = Some(KnownDirection { theta_rad: theta + known, err_rad: 0.01 });
        let s = TargetSettings { trail_direction, ..photometry_scene::target_settings(SIDE as f64, SEARCH, fwhm) };
        match measure_target(&frame, &background(&frame, 64, 3.0).unwrap(), &s) {
            TargetFound::Detected { flux, .. } => flux.flags.has(Flags::CROSSED),
            TargetFound::NotDetected { .. } => true,
        }
    };
    let n = 12;
    let [other, own] = [0.6, 0.0].map(|known| (0..n).into_par_iter().filter(|k| flagged(*k, known)).count());
    println!("of {n}: {other} flagged where the line is at another angle, {own} where it is a trail");
    assert!(other as u64 + 1 >= n && own <= 1, "{other} {own}");
}

#[test]
#[ignore = "minutes; run by scripts/prove_pass_stack.sh"]
fn artefacts_in_many_frames() {
    let n = std::env::var("FRAMES").ok().and_then(|v| v.parse().ok()).unwrap_or(200);
    let seed = std::env::var("SEED").ok().and_then(|v| v.parse().ok()).unwrap_or(20_261_125);
    check(n, seed, &[2.0, 3.0, 5.0, 8.0]);
}
