//! What the finder does to ten kinds of scenes, as one table.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::artefacts;
use crate::photometry_scene::station::{Case, Stars};
use crate::photometry_scene::tracks::Track;
use crate::photometry_scene::{Scene, target_settings};
use crate::short_trails;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rayon::prelude::*;
use satphot::base::stats;
use satphot::frames::{Electrons, Frame};
use satphot::photometry::Flags;
use satphot::photometry::background::background;
use satphot::photometry::target::measure::{TargetFound, measure_target};
use satphot::photometry::target::settings::TargetSettings;

const SIDE: usize = 260;
const SKY: f64 = 150.0;
const READ_NOISE: f64 = 3.0;
const SEARCH: f64 = 60.0;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// S/N 5 to 30, two star trails.
    Point,
    /// The same with four tracks of cosmic rays.
    PointAmongTracks,
    /// Trails and tracks alone.
    Empty,
    /// Up to four widths long, S/N 8 to 60, next to a star.
    Small,
    /// 28 widths long, S/N 10 to 100, among trails.
    Station,
    /// A point of S/N 10 to 60 on one faint trail.
    OnATrail,
    /// A point of S/N 10 to 60 near the line of a crossing satellite.
    Crossing,
    /// A target of S/N 10 to 150 beside trails of 20 to 45 widths, whose direction and length are known.
    ShortTrails,
    /// A point or a disc of up to 1.5 widths, S/N 8 to 200, whose size other frames of its pass show.
    OfAPass,
    /// A point of S/N 10 to 60 near a saturated trail whose charge spills.
    Spilt,
}

const KINDS: [Kind; 10] = [
    Kind::Point,
    Kind::PointAmongTracks,
    Kind::Empty,
    Kind::Small,
    Kind::Station,
    Kind::OnATrail,
    Kind::Crossing,
    Kind::ShortTrails,
    Kind::OfAPass,
    Kind::Spilt,
];

/// A frame, how to look at it, and where the target is, its light and its reach \[px\].
struct Shown {
    frame: Frame<Electrons>,
    settings: TargetSettings,
    target: Option<(f64, f64, f64, f64)>,
}

fn shown(kind: Kind, k: u64, seed: u64) -> Shown {
    let seed = seed + 7919 * k + 1_000_003 * kind as u64;
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    if kind == Kind::Station {
        let snr = 10f64.powf(rng.random_range(1.0..2.0));
        let case = Case {
            n: 400,
            fwhm: 3.5,
            length: 98.0,
            sky_e: 300.0,
            read_noise_e: 2.0,
            snr,
            stars: [Stars::None, Stars::One, Stars::Few][k as usize % 3],
            gradient: 1.0,
            seed,
        };
        let scene = case.expose();
        let settings = target_settings(400.0, 200.0, case.fwhm);
        return Shown {
            frame: scene.frame,
            settings,
            target: Some((scene.x, scene.y, scene.flux_e, 0.25 * case.length + case.fwhm)),
        };
    }
    if kind == Kind::ShortTrails {
        let (frame, settings, (x, y, light)) = short_trails::shown(seed, Some(1.0));
        return Shown { frame, settings, target: Some((x, y, light, 3.0 * settings.fwhm_px)) };
    }
    let fwhm = [2.0, 3.0, 5.0][k as usize % 3];
    let mut scene = Scene::new(SIDE, SIDE, SKY);
    let middle = SIDE as f64 / 2.0;
    let mut place = || {
        let (r, angle) = (0.9 * SEARCH * rng.random::<f64>().sqrt(), rng.random_range(0.0..std::f64::consts::TAU));
        (middle + r * angle.cos(), middle + r * angle.sin())
    };
    let (at, other) = (place(), place());
    let theta = rng.random_range(0.0..std::f64::consts::PI);
    let trails = if matches!(kind, Kind::OnATrail | Kind::Spilt) { 0 } else { 2 };
    for _ in 0..trails {
        let from = (rng.random_range(0.0..SIDE as f64), rng.random_range(0.0..SIDE as f64));
        scene.line(from.0, from.1, rng.random_range(30.0..400.0) * fwhm, fwhm, theta);
    }
    // of a point under its own profile, and of the noise under it
    let empty = (4.0 * std::f64::consts::PI * (SKY + READ_NOISE * READ_NOISE)).sqrt() * fwhm / 2.355;
    let mut flux = |from: f64, to: f64| {
        let snr = from * (to / from).powf(rng.random());
        0.5 * (snr * snr + (snr.powi(4) + (2.0 * snr * empty).powi(2)).sqrt())
    };
    let mut target = None;
    let mut settings = target_settings(SIDE as f64, SEARCH, fwhm);
    match kind {
        Kind::Empty | Kind::Station | Kind::ShortTrails => {}
        Kind::Point | Kind::PointAmongTracks => {
            let light = flux(5.0, 30.0);
            scene.star(at.0, at.1, light, fwhm);
            target = Some((at.0, at.1, light, fwhm));
        }
        Kind::Small => {
            let light = 1.6 * flux(8.0, 60.0);
            let length = 4.0 * fwhm * (k % 7) as f64 / 6.0;
            scene.smear(at.0, at.1, light, fwhm, length, theta + 1.0);
            let side = 10.0 * fwhm;
            scene.star(at.0 + side * theta.cos(), at.1 + side * theta.sin(), 0.3 * light, fwhm);
            target = Some((at.0, at.1, light, fwhm + 0.5 * length));
        }
        Kind::OnATrail => {
            let light = flux(10.0, 60.0);
            scene.star(at.0, at.1, light, fwhm);
            scene.line(at.0, at.1, 0.05 * light / fwhm, fwhm, theta);
            target = Some((at.0, at.1, light, fwhm));
        }
        Kind::Crossing => {
            let light = flux(10.0, 60.0);
            scene.star(at.0, at.1, light, fwhm);
            scene.line(other.0, other.1, 300.0 * fwhm, fwhm, theta + 1.0);
            target = Some((at.0, at.1, light, fwhm));
        }
        Kind::OfAPass => {
            let light = flux(8.0, 200.0);
            let diameter = 1.5 * (k % 4) as f64 / 3.0;
            // spread evenly over the disc
            let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
            for m in 0..60 {
                let (r, angle) = (0.5 * diameter * fwhm * ((f64::from(m) + 0.5) / 60.0).sqrt(), golden * f64::from(m));
                scene.star(at.0 + r * angle.cos(), at.1 + r * angle.sin(), light / 60.0, fwhm);
            }
            settings.largest_fwhm = Some(2.0);
            settings.known_disc2 = Some((diameter * diameter, 0.2));
            target = Some((at.0, at.1, light, fwhm));
        }
        Kind::Spilt => {
            let light = flux(10.0, 60.0);
            artefacts::blooming(&mut scene, &mut rng, fwhm, (middle, middle));
            scene.star(at.0, at.1, light, fwhm);
            target = Some((at.0, at.1, light, fwhm));
        }
    }
    let mut frame =
        if kind == Kind::Spilt { artefacts::exposed(scene, seed + 1) } else { scene.expose(READ_NOISE, seed + 1) };
    if matches!(kind, Kind::Empty | Kind::PointAmongTracks) {
        for _ in 0..4 {
            let from = (rng.random_range(60.0..200.0), rng.random_range(60.0..200.0));
            Track::any(&mut rng, from).strike(&mut frame.pixels, &mut rng);
        }
    }
    Shown { frame, settings, target }
}

/// Found in its place: (V − true) \[mag\] and its stated error; or something elsewhere, and no flag that says so.
enum Outcome {
    Found(f64, f64),
    False,
    Nothing,
}

fn outcome(shown: &Shown) -> Outcome {
    let sky = background(&shown.frame, 64, 3.0).unwrap();
    let TargetFound::Detected { flux, x_px, y_px, size, .. } = measure_target(&shown.frame, &sky, &shown.settings)
    else {
        return Outcome::Nothing;
    };
    if !(flux.snr >= 5.0) {
        return Outcome::Nothing;
    }
    match shown.target {
        Some((x, y, light, reach)) if (x - x_px).hypot(y - y_px) < reach => {
            Outcome::Found(-1.0857 * (flux.flux_e / light).ln(), 1.0857 * flux.flux_err_e / flux.flux_e)
        }
        _ => {
            // a row that says so is a caution, not a target
            let said = Flags::HIT | Flags::CROSSED | Flags::BLOOMING | Flags::SATURATED;
            if std::env::var_os("OUTLIERS").is_some() {
                println!(
                    "  S/N {:.1} at {x_px:.1} {y_px:.1}, {}, {size:?}, {}; target {:.1?}, FWHM {}",
                    flux.snr,
                    flux.shape.name(),
                    flux.flags,
                    shown.target,
                    shown.settings.fwhm_px
                );
            }
            if flux.flags.any(said) { Outcome::Nothing } else { Outcome::False }
        }
    }
}

#[test]
#[ignore = "a table of a minute: scripts/prove_target.sh"]
fn table_of_the_finder() {
    let number = |name: &str, or: u64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(or);
    let (n, seed) = (number("FRAMES", 60), number("SEED", 613_000_111));
    let mut failed = Vec::new();
    for kind in KINDS {
        let outcomes: Vec<Outcome> = (0..n).into_par_iter().map(|k| outcome(&shown(kind, k, seed))).collect();
        let found: Vec<(f64, f64)> = outcomes
            .iter()
            .filter_map(|o| if let Outcome::Found(off, err) = o { Some((*off, *err)) } else { None })
            .collect();
        let wrong = outcomes.iter().filter(|o| matches!(o, Outcome::False)).count();
        let mut off: Vec<f64> = found.iter().map(|f| f.0).collect();
        let mut size: Vec<f64> = found.iter().map(|f| f.0.abs()).collect();
        let within = found.iter().filter(|f| f.0.abs() < f.1).count();
        let beyond = found.iter().filter(|f| f.0.abs() > 4.0 * f.1).count();
        println!(
            "FINDER {kind:?} {n} {} {wrong} {beyond} {:.4} {:.4} {:.3}",
            found.len(),
            stats::median(&mut off).unwrap_or(f64::NAN),
            stats::quantile(&mut size, 0.68).unwrap_or(f64::NAN),
            within as f64 / found.len().max(1) as f64
        );
        let enough = if kind == Kind::Empty { 20 * wrong as u64 <= n } else { 2 * found.len() as u64 > n };
        if !enough {
            failed.push(format!("{kind:?}: {} of {n} found, {wrong} false", found.len()));
        }
    }
    // when all of the table is printed
    assert!(failed.is_empty(), "{failed:?}");
}
