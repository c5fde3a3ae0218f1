//! Injection and recovery of a resolved station, 28 FWHM long and full of structure, among star trails.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use photometry_scene::mean_sd;
use photometry_scene::station::{Case, Stars};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use satphot::photometry::Flags;
use satphot::photometry::background::background;
use satphot::photometry::target::measure::KnownDirection;
use satphot::photometry::target::measure::TargetFound;
use satphot::photometry::target::measure::measure_target;
use satphot::photometry::target::settings::TargetSettings;

fn settings(case: &Case, theta: f64) -> TargetSettings {
    let n = case.n as f64;
    TargetSettings {
        x_px: (n - 1.0) / 2.0,
        y_px: (n - 1.0) / 2.0,
        search_radius_px: 0.5 * n,
        detect_sigma: std::env::var("DETECT").ok().and_then(|v| v.parse().ok()).unwrap_or(5.0),
        margin_px: 1.5 * case.fwhm,
        limit_r_px: 2.0 * case.fwhm,
        fwhm_px: case.fwhm,
        fwhm_err_frac: satphot::photometry::growth::FRAME_SCATTER,
        is_fwhm_known: true,
        profile: None,
        largest_fwhm: None,
        known_disc2: None,
        sky_in_px: 3.0 * case.fwhm,
        sky_out_px: 5.0 * case.fwhm,
        clip_sigma: 3.0,
        shape: satphot::config::ApertureShape::Auto,
        contam_frac: 0.05,
        trail_direction: known_direction(case.seed, theta),
        trail_length_px: None,
        bound_px: None,
    }
}

/// The direction of the trails as an ephemeris and the camera's rotation give it, 0.3° uncertain.
fn known_direction(seed: u64, theta: f64) -> Option<KnownDirection> {
    let err_rad = std::env::var("ANGLE").ok().and_then(|v| v.parse().ok()).unwrap_or(0.3f64).to_radians();
    let error = Normal::new(0.0, 1.0).unwrap().sample(&mut ChaCha12Rng::seed_from_u64(seed ^ 0xa791e));
    (err_rad > 0.0).then_some(KnownDirection { theta_rad: theta + err_rad * error, err_rad })
}

/// What became of one frame.
struct Outcome {
    detected: bool,
    found: bool,
    /// (measured − true)/error, and (measured − true)/true.
    pull: f64,
    error_frac: f64,
    snr: f64,
    /// Share of the brightest trail and of all trails.
    contamination: (f64, f64),
    flagged: bool,
    /// What is said of that share.
    contamination_reported: f64,
    area_px: f64,
    cpu_ms: f64,
}

impl Outcome {
    /// Not found, far off, or flagged where it should not be or the other way round.
    fn is_outlier(&self) -> bool {
        let (brightest, all) = self.contamination;
        let wrong_flag = if self.flagged { all < 0.05 } else { brightest > 0.05 };
        !self.found || self.pull.abs() > 3.5 || wrong_flag
    }
}

/// CPU time of this thread so far, where the system reports it.
fn cpu_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).map_or(f64::NAN, |ns| ns / 1e6)
}

fn observe(case: &Case) -> Outcome {
    let scene = case.expose();
    let start = cpu_ms();
    let sky = background(&scene.frame, 64, 3.0).unwrap();
    let found = measure_target(&scene.frame, &sky, &settings(case, scene.theta));
    let cpu_ms = cpu_ms() - start;
    let (flux, x, y, detected) = match &found {
        TargetFound::Detected { flux, x_px, y_px, .. } => (flux, *x_px, *y_px, true),
        TargetFound::NotDetected { flux, x_px, y_px, .. } => (flux, *x_px, *y_px, false),
    };
    let near = (x - scene.x).hypot(y - scene.y) < 0.25 * case.length + case.fwhm;
    let light = scene.light_of_trails(x, y, &flux.shape);
    Outcome {
        detected,
        found: detected && near,
        pull: (flux.flux_e - scene.flux_e) / flux.flux_err_e,
        error_frac: flux.flux_e / scene.flux_e - 1.0,
        snr: flux.snr,
        contamination: (
            light.iter().copied().fold(0.0, f64::max) / scene.flux_e,
            light.iter().sum::<f64>() / scene.flux_e,
        ),
        flagged: flux.flags.has(Flags::CONTAMINATED),
        contamination_reported: match &found {
            TargetFound::Detected { light, .. } => light.contamination_e / flux.flux_e,
            TargetFound::NotDetected { .. } => 0.0,
        },
        area_px: flux.area_px,
        cpu_ms,
    }
}

/// A small sample of the whole table, at a FWHM of 3.5 px.
fn sample(stars: Stars, snr: f64, frames: u64) -> Vec<Outcome> {
    let of = |seed| Case {
        n: 400,
        fwhm: 3.5,
        length: 98.0,
        sky_e: 300.0,
        read_noise_e: 2.0,
        snr,
        stars,
        gradient: 1.0,
        seed,
    };
    (0..frames).into_par_iter().map(|k| observe(&of(90_000 + 100 * snr as u64 + k))).collect()
}

#[test]
fn the_flux_of_a_resolved_station_is_recovered_and_its_contamination_flagged() {
    let (mut pulls, mut hits, mut wanted, mut alarms, mut clean) = (Vec::new(), 0, 0, 0, 0);
    for (stars, snr) in [(Stars::None, 10.0), (Stars::None, 100.0), (Stars::One, 50.0), (Stars::Few, 50.0)] {
        let all = sample(stars, snr, 12);
        let found: Vec<&Outcome> = all.iter().filter(|o| o.found).collect();
        let of_these: Vec<f64> = found.iter().map(|o| o.pull).collect();
        let (mean, sd) = mean_sd(&of_these);
        println!("{stars:?}, S/N {snr}: {}/{} pull {mean:+.2} ± {sd:.2}", found.len(), all.len());
        // at S/N 10 one in a dozen may be missed
        assert!(found.len() + usize::from(snr < 20.0) >= all.len(), "{stars:?} {snr}: {}", found.len());
        pulls.extend(of_these);
        for o in found {
            wanted += usize::from(o.contamination.0 > 0.06);
            hits += usize::from(o.contamination.0 > 0.06 && o.flagged);
            clean += usize::from(o.contamination.1 < 0.04);
            alarms += usize::from(o.contamination.1 < 0.04 && o.flagged);
        }
    }
    let (mean, sd) = mean_sd(&pulls);
    println!(
        "{} pulls {mean:+.2} ± {sd:.2}; contamination {hits} of {wanted}, false alarms {alarms} of {clean}",
        pulls.len()
    );
    // 3 standard errors of a mean and of a standard deviation, and 0.1 σ of bias
    assert!(mean.abs() < 0.1 + 3.0 / (pulls.len() as f64).sqrt(), "{mean}");
    assert!((sd - 1.0).abs() < 3.0 / (2.0 * pulls.len() as f64).sqrt(), "{sd}");
    assert!(hits + 1 >= wanted && alarms <= 1, "{hits} of {wanted}, {alarms} of {clean}");
}

#[test]
#[ignore = "the whole table takes minutes: scripts/prove_target.sh"]
fn the_whole_table() {
    let number = |key: &str, default: f64| std::env::var(key).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    let (frames, first, bin) = (number("FRAMES", 40.0) as u64, number("SEED", 1.0) as u64, number("BIN", 1.0));
    let gradient = number("GRADIENT", 1.0);
    println!("stars     S/N  found  |S/N| bias/flux bias/err  scatter/err   hits>5%   false<5%  area/1000 ms");
    for stars in [Stars::None, Stars::One, Stars::Few, Stars::Crowded] {
        if std::env::var("STARS").is_ok_and(|s| s != format!("{stars:?}")) {
            continue;
        }
        for snr in [5.0, 7.0, 10.0, 15.0, 20.0, 50.0, 150.0, 500.0] {
            if std::env::var("SNR").is_ok_and(|s| !s.split(',').any(|s| s.parse() == Ok(snr))) {
                continue;
            }
            let one = std::env::var("FRAME").ok().and_then(|v| v.parse::<u64>().ok());
            let all: Vec<Outcome> = one
                .map_or(0..frames, |k| k..k + 1)
                .into_par_iter()
                .map(|k| {
                    let (n, fwhm, length) = ((1200.0 / bin) as usize, 10.0 / bin, 280.0 / bin);
                    let sky_e = 60.0 * bin * bin;
                    let seed = first * 1_000_000 + (snr as u64) * 1000 + k;
                    observe(&Case { n, fwhm, length, sky_e, read_noise_e: 2.0, snr, stars, gradient, seed })
                })
                .collect();
            if std::env::var("OUTLIERS").is_ok() {
                for (k, o) in all.iter().enumerate().filter(|(_, o)| o.is_outlier()) {
                    let (brightest, all) = o.contamination;
                    println!(
                        "    {k}: found {} pull {:+.1} S/N {:.1} area {:.0} trail {brightest:.3} trails {all:.3} reported {:.3} flagged {}",
                        o.found, o.pull, o.snr, o.area_px, o.contamination_reported, o.flagged
                    );
                }
            }
            let found: Vec<&Outcome> = all.iter().filter(|o| o.found).collect();
            let of = |f: &dyn Fn(&Outcome) -> f64| -> (f64, f64) {
                mean_sd(&found.iter().map(|o| f(o)).collect::<Vec<_>>())
            };
            let (pull, scatter) = of(&|o| o.pull);
            let hit: Vec<bool> = found.iter().filter(|o| o.contamination.0 > 0.05).map(|o| o.flagged).collect();
            let alarm: Vec<bool> = found.iter().filter(|o| o.contamination.1 < 0.05).map(|o| o.flagged).collect();
            let rate = |v: &[bool]| format!("{:3}/{:3}", v.iter().filter(|b| **b).count(), v.len());
            println!(
                "{:9} {snr:4} {:3}+{:2}/{:3} {:5.1} {:+8.4}  {pull:+6.3}±{:.3}  {scatter:5.2}  {}  {}  {:6.1} {:6.1}",
                format!("{stars:?}"),
                found.len(),
                all.iter().filter(|o| o.detected && !o.found).count(),
                all.len(),
                of(&|o| o.snr).0,
                of(&|o| o.error_frac).0,
                scatter / (found.len() as f64).sqrt(),
                rate(&hit),
                rate(&alarm),
                of(&|o| o.area_px / 1000.0).0,
                of(&|o| o.cpu_ms).0,
            );
        }
    }
}
