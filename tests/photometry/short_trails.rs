//! A target beside star trails that end in the frame, as in short exposures of wide fields: their length and direction are known.
#![allow(clippy::unwrap_used, clippy::panic)]

use crate::photometry_scene;

use photometry_scene::Scene;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rayon::prelude::*;
use satphot::frames::{Electrons, Frame};
use satphot::photometry::Flags;
use satphot::photometry::background::background;
use satphot::photometry::target::measure::{KnownDirection, TargetFound, measure_target};
use satphot::photometry::target::settings::TargetSettings;

const FWHM: f64 = 4.0;
const SIDE: usize = 420;

/// How one scene was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    Right,
    /// More than 0.1 mag and 4 errors off, or elsewhere; with a flag.
    Flagged,
    /// The same without one.
    Wrong,
    NotFound,
}

/// A target of 0 to 2 FWHM and S/N 10 to 150, and one to three trails of 20 to 45 FWHM, one of which passes it within 4 FWHM. One FWHM of
/// a trail has 0.1 to 10 times the light of the target.
fn scene(seed: u64) -> (Scene, (f64, f64, f64), (f64, f64)) {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut scene = Scene::new(SIDE, SIDE, 60.0);
    let middle = 0.5 * SIDE as f64;
    let (x, y) = (middle + rng.random_range(-10.0..10.0), middle + rng.random_range(-10.0..10.0));
    let snr = 10f64.powf(rng.random_range(1.0..2.2));
    let flux_e = snr * 8.0 * (4.0 * std::f64::consts::PI).sqrt() * FWHM / photometry_scene::FWHM_PER_SIGMA;
    scene.smear(x, y, flux_e, FWHM, rng.random_range(0.0..2.0) * FWHM, rng.random_range(0.0..3.1));
    let (length, theta) = (rng.random_range(20.0..45.0) * FWHM, rng.random_range(-1.5..1.5f64));
    let (sin, cos) = theta.sin_cos();
    for k in 0..rng.random_range(1..4) {
        let (along, across) = if k == 0 {
            (rng.random_range(-0.5..0.5) * length, rng.random_range(-4.0..4.0) * FWHM)
        } else {
            (rng.random_range(-150.0..150.0), rng.random_range(-150.0..150.0))
        };
        // e⁻ per pixel of length
        let light = flux_e / FWHM * 10f64.powf(rng.random_range(-1.0..1.0));
        scene.smear(
            x + along * cos - across * sin,
            y + along * sin + across * cos,
            light * length,
            FWHM,
            length,
            theta,
        );
    }
    (scene, (x, y, flux_e), (theta, length))
}

/// A frame of such a scene, how to look at it with a length that is said to be this much of the true one, or none, and the target: its
/// place and light.
pub fn shown(seed: u64, share_of_length: Option<f64>) -> (Frame<Electrons>, TargetSettings, (f64, f64, f64)) {
    let (scene, target, (theta, length)) = scene(seed);
    let err_rad = 0.003;
    let s = TargetSettings {
        trail_direction: Some(KnownDirection { theta_rad: theta + err_rad, err_rad }),
        trail_length_px: share_of_length.map(|share| share * length),
        ..photometry_scene::target_settings(SIDE as f64, 60.0, FWHM)
    };
    (scene.expose(2.0, seed + 1), s, target)
}

fn outcome(seed: u64, share_of_length: Option<f64>) -> Outcome {
    let (frame, s, (x, y, flux_e)) = shown(seed, share_of_length);
    let sky = background(&frame, 64, 3.0).unwrap();
    match measure_target(&frame, &sky, &s) {
        TargetFound::Detected { flux, x_px, y_px, .. } => {
            let off_mag = 2.5 * (flux.flux_e / flux_e).log10();
            let is_right = (x_px - x).hypot(y_px - y) < 3.0 * FWHM
                && !(off_mag.abs() > 0.1 && (flux.flux_e - flux_e).abs() > 4.0 * flux.flux_err_e);
            if !is_right && std::env::var("OUTLIERS").is_ok() {
                let (a_px, b_px, _) = flux.shape.axes();
                println!(
                    "{seed}: {off_mag:+.2} mag, S/N {:.0}, aperture {a_px:.0} x {b_px:.0}, off {:.0} px",
                    flux.snr,
                    (x_px - x).hypot(y_px - y)
                );
            }
            match (is_right, flux.flags.has(Flags::CONTAMINATED)) {
                (true, _) => Outcome::Right,
                (false, true) => Outcome::Flagged,
                (false, false) => Outcome::Wrong,
            }
        }
        TargetFound::NotDetected { .. } => Outcome::NotFound,
    }
}

/// Right, flagged, wrong, not found.
fn counts(seeds: std::ops::Range<u64>, share_of_length: Option<f64>) -> [usize; 4] {
    let all: Vec<Outcome> = seeds.into_par_iter().map(|seed| outcome(seed, share_of_length)).collect();
    [Outcome::Right, Outcome::Flagged, Outcome::Wrong, Outcome::NotFound]
        .map(|kind| all.iter().filter(|o| **o == kind).count())
}

#[test]
fn the_length_of_the_trails_makes_more_targets_beside_them_right() {
    let first = 990_000;
    let of = |share: Option<f64>| counts(first..first + 100, share);
    let [unknown, known, half, twice] = [None, Some(1.0), Some(0.5), Some(2.0)].map(of);
    println!(
        "right, flagged, wrong, not found of 100: length unknown {unknown:?}, known {known:?}, half {half:?}, twice {twice:?}"
    );
    // nearly all of those that a trail of unknown length makes wrong by magnitudes
    assert!(known[0] >= 85 && known[2] <= 5, "{known:?}");
    // an exposure in the wrong unit or of another frame does no more harm than none
    for wrong in [half, twice] {
        assert!(wrong[0] + 5 >= unknown[0] && wrong[2] <= unknown[2], "{wrong:?} {unknown:?}");
    }
}
