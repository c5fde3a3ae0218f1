//! Passes of frames in which the target is too faint for any one of them: place, flux, error and limit of their stack.
//!
//! Wanted: ten frames of S/N 2 to 3 reach 1.1 mag deeper than one, the flux without bias, 68 % of it within its error, one
//! empty pass in a hundred with a target. `scripts/prove_pass_stack.sh` counts many.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene::{self, Scene, tracks::Track};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use satphot::photometry::background::background;
use satphot::photometry::pass::curve::{EmptyPlaces, FramePoint, bins, mean};
use satphot::photometry::pass::forced::forced_flux;
use satphot::photometry::pass::place::PassPlace;
use satphot::photometry::pass::stack::{PassStack, StackFound, frame_map};
use satphot::photometry::target::measure::{TargetFound, measure_target};
use satphot::photometry::target::settings::TargetSettings;
use statrs::function::erf::erf;

const SIDE: usize = 220;
const SEARCH: f64 = 40.0;
const SKY: f64 = 200.0;
const READ_NOISE: f64 = 3.0;
/// Time between frames [s].
const CADENCE_S: f64 = 2.0;

/// One pass of frames.
#[derive(Debug, Clone, Copy)]
struct Pass {
    n: usize,
    fwhm: f64,
    /// S/N of the target in one frame under its own profile; 0 without a target.
    snr: f64,
    /// Drift from the first frame to the last [FWHM].
    drift: f64,
    trails: bool,
    hits: usize,
    /// Whether the frames show it by themselves.
    shown: bool,
}

/// What its stack gave.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    detected: bool,
    /// Detected where the target is.
    found: bool,
    /// Flux at the true place less the truth, over its error.
    pull: f64,
    /// The same at the place the stack found.
    pull_there: Option<f64>,
    snr: f64,
    /// Error over that of one frame.
    gain: f64,
    scale: f64,
    snr_of_stack: f64,
    limit_mag_deeper: f64,
    deeper_than_theory: f64,
}

fn settings(fwhm: f64) -> TargetSettings {
    photometry_scene::target_settings(SIDE as f64, SEARCH, fwhm)
}

/// Variance of the flux of a point under the optimal weights on a sky of equal pixels: 4π σ² V.
fn variance_of_point(fwhm: f64) -> f64 {
    let sigma2 = (fwhm / photometry_scene::FWHM_PER_SIGMA).powi(2) + 1.0 / 12.0;
    4.0 * std::f64::consts::PI * sigma2 * (SKY + READ_NOISE * READ_NOISE)
}

fn run(pass: Pass, seed: u64) -> Outcome {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let s = settings(pass.fwhm);
    let flux_e = pass.snr * variance_of_point(pass.fwhm).sqrt();
    let (r, angle) = (0.8 * SEARCH * rng.random::<f64>().sqrt(), rng.random_range(0.0..std::f64::consts::TAU));
    let (x0, y0) = (SIDE as f64 / 2.0 + r * angle.cos(), SIDE as f64 / 2.0 + r * angle.sin());
    let way = rng.random_range(0.0..std::f64::consts::TAU);
    let last = (pass.n.max(2) - 1) as f64;
    let at = |k: usize| {
        let d = pass.drift * pass.fwhm * (k as f64 / last - 0.5);
        (x0 + d * way.cos(), y0 + d * way.sin())
    };
    let theta = rng.random_range(0.0..std::f64::consts::PI);
    let mut frame_of = |k: usize| {
        let mut scene = Scene::new(SIDE, SIDE, SKY);
        if pass.snr > 0.0 {
            scene.star(at(k).0, at(k).1, flux_e, pass.fwhm);
        }
        if pass.trails {
            for _ in 0..6 {
                let (x, y) = (rng.random_range(0.0..SIDE as f64), rng.random_range(0.0..SIDE as f64));
                let e_per_px = 10f64.powf(rng.random_range(1.5..3.2));
                scene.line(x, y, e_per_px, pass.fwhm, theta);
            }
        }
        let mut frame = scene.expose(READ_NOISE, seed.wrapping_mul(31).wrapping_add(k as u64));
        for _ in 0..pass.hits {
            let place = (rng.random_range(0.0..SIDE as f64), rng.random_range(0.0..SIDE as f64));
            Track::any(&mut rng, place).strike(&mut frame.pixels, &mut rng);
        }
        frame
    };
    let mut stack: Option<PassStack> = None;
    let mut at_truth = Curve::default();
    let mut single_limit = f64::NAN;
    let frames: Vec<_> = (0..pass.n).map(&mut frame_of).collect();
    for (k, frame) in frames.iter().enumerate() {
        let map = frame_map(frame, &s, 1.0, pass.shown.then(|| at(k))).unwrap();
        let stack = stack.get_or_insert_with(|| PassStack::like(&map));
        assert!(stack.add(&map, k as f64 * CADENCE_S, (k, pass.n)));
        at_truth.add(frame, &s, k, at(k), 0.0);
        if k == 0
            && pass.snr == 0.0
            && let TargetFound::NotDetected { limit_e, .. } =
                measure_target(frame, &background(frame, 64, 3.0).unwrap(), &s)
        {
            single_limit = limit_e;
        }
    }
    let StackFound { place, snr: snr_of_stack, threshold, flux_err, n_frames } = stack.unwrap().find(&s).unwrap();
    let flux_err = flux_err.unwrap();
    assert_eq!(n_frames, pass.n);
    let m = mean(&at_truth.points, at_truth.empty.error_scale()).unwrap();
    let off = |p: &PassPlace, k: usize| {
        let (x, y) = p.at(k as f64 * CADENCE_S);
        (x - at(k).0).hypot(y - at(k).1)
    };
    let found = place.as_ref().filter(|p| pass.snr > 0.0 && off(p, 0).max(off(p, pass.n - 1)) < pass.fwhm);
    let pull_there = found.map(|p| {
        let mut there = Curve::default();
        frames.iter().enumerate().for_each(|(k, f)| there.add(f, &s, k, p.at(k as f64 * CADENCE_S), 0.0));
        let m = mean(&there.points, there.empty.error_scale()).unwrap();
        (m.flux - p.freedoms as f64 / (2.0 * snr_of_stack) * m.err - flux_e) / m.err
    });
    Outcome {
        detected: place.is_some(),
        found: found.is_some(),
        pull: (m.flux - flux_e) / m.err,
        pull_there,
        snr: m.flux / m.err,
        gain: at_truth.points[0].variance.sqrt() / m.err,
        scale: at_truth.empty.error_scale(),
        snr_of_stack,
        limit_mag_deeper: 2.5 * (single_limit / ((threshold + 1.645) * flux_err)).log10(),
        // the same of the theoretical limit of one frame: S/N 5 under its own profile
        deeper_than_theory: 2.5
            * (6.645 * variance_of_point(pass.fwhm).sqrt() / ((threshold + 1.645) * flux_err)).log10(),
    }
}

#[derive(Default)]
struct Curve {
    points: Vec<FramePoint>,
    empty: EmptyPlaces,
}

impl Curve {
    fn add(
        &mut self,
        frame: &satphot::frames::Frame<satphot::frames::Electrons>,
        s: &TargetSettings,
        k: usize,
        at: (f64, f64),
        jitter_px: f64,
    ) {
        let s = TargetSettings { x_px: at.0, y_px: at.1, search_radius_px: 10.0 * s.fwhm_px, ..*s };
        let light = forced_flux(frame, &background(frame, 64, 3.0).unwrap(), &s, jitter_px);
        let Some(f) = light.filter(|f| !f.is_sharp) else { return };
        self.empty.add(&f.empty);
        self.points.push(FramePoint {
            t_s: k as f64 * CADENCE_S,
            flux: f.flux_e,
            variance: f.variance_e2,
            variance_per_flux: f.variance_per_e,
            moved_frac: 0.0,
        });
    }
}

fn passes(pass: Pass, n: u64, seed: u64) -> Vec<Outcome> {
    (0..n).into_par_iter().map(|k| run(pass, seed + 10_007 * k)).collect()
}

/// Mean, its error and the share within one, of pulls.
fn of_pulls(pulls: &[f64]) -> (f64, f64, f64) {
    let (mean, sd) = photometry_scene::mean_sd(pulls);
    let within = pulls.iter().filter(|p| p.abs() < 1.0).count() as f64 / pulls.len() as f64;
    (mean, sd / (pulls.len() as f64).sqrt(), within)
}

fn report(name: &str, outcomes: &[Outcome]) {
    let n = outcomes.len() as f64;
    let share = |of: fn(&Outcome) -> bool| 100.0 * outcomes.iter().filter(|o| of(o)).count() as f64 / n;
    let (bias, err, within) = of_pulls(&outcomes.iter().map(|o| o.pull).collect::<Vec<_>>());
    let there: Vec<f64> = outcomes.iter().filter_map(|o| o.pull_there).collect();
    let (bias_there, _, within_there) = if there.is_empty() { (0.0, 0.0, 0.0) } else { of_pulls(&there) };
    let mean = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).filter(|v| v.is_finite()).sum::<f64>() / n;
    println!(
        "{name:40} {n:5} found {:5.1} % elsewhere {:4.1} % | true place: bias {bias:+.3} +- {err:.3} sigma, 68 % -> {:4.1} %, \
         S/N {:5.2}, errors of one frame {:5.2} | found place: bias {bias_there:+.3}, {:4.1} % | S/N of stack {:5.2} scale {:.3} \
         limit {:+.2} mag, against theory of one {:+.2}",
        share(|o| o.found),
        share(|o| o.detected && !o.found),
        100.0 * within,
        mean(|o| o.snr),
        mean(|o| o.gain),
        100.0 * within_there,
        mean(|o| o.snr_of_stack),
        mean(|o| o.scale),
        mean(|o| o.limit_mag_deeper),
        mean(|o| o.deeper_than_theory),
    );
}

#[test]
fn ten_frames_show_what_one_does_not_with_the_flux_and_error_that_are_true() {
    let pass = Pass { n: 10, fwhm: 3.0, snr: 2.5, drift: 0.0, trails: false, hits: 2, shown: false };
    let all = passes(pass, 16, 77);
    report("10 frames of S/N 2.5", &all);
    assert!(all.iter().filter(|o| o.found).count() >= 15);
    let (bias, err, within) = of_pulls(&all.iter().map(|o| o.pull).collect::<Vec<_>>());
    assert!(bias.abs() < 3.0 * err && (0.35..0.97).contains(&within), "{bias} {err} {within}");
    // sqrt(10) = 3.16
    let gain = all.iter().map(|o| o.gain).sum::<f64>() / all.len() as f64;
    assert!((2.95..3.2).contains(&gain), "{gain}");
    let empty = passes(Pass { snr: 0.0, ..pass }, 16, 770_077);
    report("10 empty frames", &empty);
    assert!(empty.iter().filter(|o| o.detected).count() <= 1);
    // 1.25 mag less what the sky costs, and by how much the threshold is not that of one frame
    let theory = empty.iter().map(|o| o.deeper_than_theory).sum::<f64>() / empty.len() as f64;
    assert!((1.1..1.4).contains(&theory), "{theory}");
    let deeper: Vec<f64> = empty.iter().map(|o| o.limit_mag_deeper).filter(|m| m.is_finite()).collect();
    assert!(deeper.len() > 12 && deeper.iter().sum::<f64>() / deeper.len() as f64 > 1.1);
}

#[test]
fn a_region_that_bright_sources_hide_in_every_frame_has_no_limit() {
    let s = settings(3.0);
    let found = |n_sources: i32| {
        let mut scene = Scene::new(SIDE, SIDE, SKY);
        let middle = SIDE as f64 / 2.0;
        for k in 0..n_sources {
            scene.star(middle + 12.0 * f64::from(k % 4 - 1), middle + 12.0 * f64::from(k / 4 - 1), 3e4, 3.0);
        }
        let mut stack: Option<PassStack> = None;
        for k in 0..4 {
            let map = frame_map(&scene.expose(READ_NOISE, 800 + k), &s, 1.0, None).unwrap();
            stack.get_or_insert_with(|| PassStack::like(&map)).add(&map, k as f64, (k as usize, 4));
        }
        stack.unwrap().find(&s).unwrap()
    };
    assert!(found(0).flux_err.is_some());
    let hidden = found(8);
    assert!(hidden.flux_err.is_none() && hidden.place.is_none(), "{hidden:?}");
}

#[test]
fn two_frames_that_show_the_target_show_it_in_their_sum_as_well() {
    // three detections would give its place
    let pass = Pass { n: 2, fwhm: 3.0, snr: 7.0, drift: 0.0, trails: false, hits: 2, shown: true };
    let found = |pass: Pass| passes(pass, 16, 4_711).iter().filter(|o| o.found).count();
    // otherwise it is masked as what one frame alone shows
    assert!(found(pass) >= 15 && found(Pass { shown: false, ..pass }) <= 8);
}

#[test]
#[ignore = "minutes; run by scripts/prove_pass_stack.sh"]
fn passes_of_ten_to_three_thousand_frames() {
    let number = |key: &str, or: u64| std::env::var(key).ok().and_then(|v| v.parse().ok()).unwrap_or(or);
    let (n, seed) = (number("PASSES", 200), number("SEED", 20_261_125));
    let base = Pass { n: 10, fwhm: 3.0, snr: 2.5, drift: 0.0, trails: false, hits: 0, shown: false };
    for fwhm in [1.5, 2.0, 4.0, 8.0] {
        report(&format!("10 frames, FWHM {fwhm}, S/N 2.5"), &passes(Pass { fwhm, ..base }, n, seed));
    }
    for snr in [2.0, 3.0] {
        report(&format!("10 frames, S/N {snr}"), &passes(Pass { snr, ..base }, n, seed + 1));
    }
    report("10 frames, S/N 2.5, drift of 3 FWHM", &passes(Pass { drift: 3.0, ..base }, n, seed + 2));
    report("10 frames, S/N 3, drift of 5 FWHM", &passes(Pass { drift: 5.0, snr: 3.0, ..base }, n, seed + 3));
    report("10 frames, S/N 2.5, 6 trails, 3 hits", &passes(Pass { trails: true, hits: 3, ..base }, n, seed + 4));
    report("10 empty frames", &passes(Pass { snr: 0.0, ..base }, 2 * n, seed + 5));
    report(
        "10 empty frames, 6 trails, 3 hits",
        &passes(Pass { snr: 0.0, trails: true, hits: 3, ..base }, 2 * n, seed + 6),
    );
    report("100 frames, S/N 0.9, 2 hits", &passes(Pass { n: 100, snr: 0.9, hits: 2, ..base }, n / 5, seed + 7));
    report("100 frames, S/N 0.9, trails", &passes(Pass { n: 100, snr: 0.9, trails: true, ..base }, n / 5, seed + 8));
    report("100 empty frames", &passes(Pass { n: 100, snr: 0.0, ..base }, n / 5, seed + 9));
    let many = Pass { n: 3000, snr: 0.18, hits: 2, ..base };
    report("3000 frames, S/N 0.18, 2 hits", &passes(many, n / 20, seed + 10));
    report("3000 empty frames, 2 hits", &passes(Pass { snr: 0.0, ..many }, n / 20, seed + 11));
}

/// A light curve of a target that brightens by a factor of four, in bins.
#[test]
fn bins_end_at_equal_signal_to_noise_and_are_not_brighter_for_it() {
    let mut rng = ChaCha12Rng::seed_from_u64(5);
    let mut normal = || {
        let (u, v): (f64, f64) = (rng.random_range(1e-12..1.0), rng.random());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let truth = |k: usize| 0.5 + 1.5 * k as f64 / 199.0;
    let (mut pulls, mut snrs, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..300 {
        let points: Vec<FramePoint> = (0..200)
            .map(|k| FramePoint {
                t_s: k as f64,
                flux: truth(k) + normal(),
                variance: 1.0,
                variance_per_flux: 0.0,
                moved_frac: 0.0,
            })
            .collect();
        let of = bins(&points, 5.0, 1.0);
        assert!(of.windows(2).all(|w| w[0].end == w[1].start) && of[0].start == 0 && of[of.len() - 1].end == 200);
        for bin in &of {
            let m = mean(&points[bin.clone()], 1.0).unwrap();
            let true_mean = bin.clone().map(truth).sum::<f64>() / bin.len() as f64;
            pulls.push((m.flux - true_mean) / m.err);
            snrs.push(true_mean / m.err);
        }
        numbers.push(of.len() as f64);
    }
    let (bias, err, within) = of_pulls(&pulls);
    println!(
        "{} bins: bias {bias:+.3} +- {err:.3}, 68 % -> {within:.3}, S/N {:?}",
        pulls.len(),
        photometry_scene::mean_sd(&snrs)
    );
    assert!(bias.abs() < 0.05 && (within - erf(0.5f64.sqrt())).abs() < 0.03);
    let (snr, sd) = photometry_scene::mean_sd(&snrs);
    assert!((4.8..6.0).contains(&snr) && sd < 1.0, "{snr} {sd}");
    // closed by their own S/N, bins would be too bright by a few tenths of their errors
    assert!(numbers.iter().all(|n| *n > 5.0));
    // nothing there: one bin
    let empty: Vec<FramePoint> = (0..50)
        .map(|k| FramePoint {
            t_s: f64::from(k),
            flux: 0.3 * f64::from(k % 2) - 0.15,
            variance: 1.0,
            variance_per_flux: 0.0,
            moved_frac: 0.0,
        })
        .collect();
    let whole = bins(&empty, 5.0, 1.0);
    assert!(whole.len() == 1 && whole[0] == (0..50));
    assert!(bins(&[], 5.0, 1.0).is_empty() && mean(&[], 1.0).is_none());
}

#[test]
fn errors_that_do_not_hold_at_empty_places_are_multiplied_and_others_are_left() {
    let mut rng = ChaCha12Rng::seed_from_u64(9);
    let mut normal = || {
        let (u, v): (f64, f64) = (rng.random_range(1e-12..1.0), rng.random());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    for (factor, offset) in [(1.0, 0.0), (2.0, 0.0), (1.0, 0.5)] {
        let mut places = EmptyPlaces::default();
        for _ in 0..100 {
            places.add(
                &(0..12).map(|k| Some((factor * normal() + offset * f64::from(k - 6) / 3.0, 1.0))).collect::<Vec<_>>(),
            );
        }
        let scale = places.error_scale();
        match (factor, offset) {
            (1.0, 0.0) => assert_eq!(scale, 1.0),
            (2.0, _) => assert!((1.8..3.0).contains(&scale), "{scale}"),
            // 0.5 errors of a frame are 5 of their mean
            _ => assert!((4.0..7.0).contains(&scale), "{scale}"),
        }
    }
    assert_eq!(EmptyPlaces::default().error_scale(), 1.0);
}

#[test]
fn frames_that_missed_the_target_neither_carry_the_mean_nor_state_the_error_of_a_fainter_one() {
    let (flux, n) = (100.0, 4000);
    let mut rng = ChaCha12Rng::seed_from_u64(25_130);
    let noise = Normal::new(0.0, 1.0).unwrap();
    let (mut pulls, mut alone) = (Vec::new(), Vec::new());
    for _ in 0..n {
        let mut points = Vec::new();
        for k in 0..8 {
            // six outlines with an error of 3, and two small apertures at the place, of a target that is next to it: half to one and a
            // half of its light, with equal chances
            let missed = k >= 6;
            let (err, moved_frac) = if missed { (0.5, 0.5 / 3f64.sqrt()) } else { (3.0, 0.0) };
            let share = if missed { 0.5 + rng.random::<f64>() } else { 1.0 };
            points.push(FramePoint {
                t_s: f64::from(k),
                flux: flux * share + err * noise.sample(&mut rng),
                variance: err * err,
                variance_per_flux: 0.0,
                moved_frac,
            });
        }
        let m = mean(&points, 1.0).unwrap();
        pulls.push((m.flux - flux) / m.err);
        assert!(m.err < 1.3 && m.err > 1.1, "{m:?}");
        let one = mean(&points[7..], 1.0).unwrap();
        alone.push((one.flux - flux) / one.err_of_expected(m.flux));
    }
    let (mean, err, within) = of_pulls(&pulls);
    assert!(mean.abs() < 4.0 * err && (within - 0.68).abs() < 0.03, "{mean} +- {err}, {within}");
    // an even distribution has 58 % within one of its standard deviations; brighter ones have a larger error, of their own flux
    let (_, _, within) = of_pulls(&alone);
    assert!((0.56..0.70).contains(&within), "{within}");
}

#[test]
fn noise_on_a_target_does_not_take_its_light_from_a_frame_and_a_hit_at_its_place_is_no_light_of_it() {
    let (fwhm, snr, n) = (2.0, 8.0, 400);
    let s = TargetSettings { search_radius_px: 20.0, ..settings(fwhm) };
    let flux_e = snr * variance_of_point(fwhm).sqrt();
    let (mut points, mut sharp, mut hits) = (Vec::new(), Vec::new(), Vec::new());
    let mut rng = ChaCha12Rng::seed_from_u64(25_201);
    for k in 0..n {
        let at = [0, 1].map(|_| SIDE as f64 / 2.0 + rng.random_range(-0.5..0.5));
        let mut scene = Scene::new(SIDE, SIDE, SKY);
        scene.star(at[0], at[1], flux_e, fwhm);
        let mut frame = scene.expose(READ_NOISE, 77_000 + k);
        // every eighth with a hit on the target as well: of one pixel, or a track along a diagonal
        let is_hit = k % 8 == 7;
        let [x, y] = at.map(|v| v.round() as usize);
        let length = if k % 16 == 7 { 1 } else { 9 };
        for step in (0..length).filter(|_| is_hit) {
            let along = step + 4 - length / 2;
            frame.pixels[[y + along - 4, x + along - 4]] += (8.0 * flux_e / length as f64) as f32;
        }
        let there = TargetSettings { x_px: at[0], y_px: at[1], ..s };
        let light = forced_flux(&frame, &background(&frame, 64, 3.0).unwrap(), &there, 0.0).unwrap();
        let (variance, variance_per_flux) = (light.variance_e2, light.variance_per_e);
        let t_s = k as f64;
        let point = FramePoint { t_s, flux: light.flux_e, variance, variance_per_flux, moved_frac: 0.0 };
        match (is_hit, light.is_sharp) {
            (true, is_sharp) => hits.push((point, is_sharp)),
            (false, true) => sharp.push(point),
            (false, false) => points.push(point),
        }
    }
    let of_pass = mean(&points, 1.0).unwrap();
    let others = sharp.iter().filter(|p| of_pass.may_be(p)).count();
    println!("{} clear, {others} of {} sharp ones are the target's", points.len(), sharp.len());
    // about one in fifty looks like a hit: all of these are the target, and the mean with them is its light
    assert!(!sharp.is_empty() && others == sharp.len() && sharp.len() < points.len() / 10, "{}", sharp.len());
    let all: Vec<FramePoint> = points.iter().chain(&sharp).copied().collect();
    let m = mean(&all, 1.0).unwrap();
    assert!((m.flux - flux_e).abs() < 3.0 * m.err, "{} {flux_e} {}", m.flux, m.err);
    // what a hit left of it is measured, or nothing
    let taken: Vec<f64> = hits
        .iter()
        .filter(|(p, is_sharp)| !is_sharp || of_pass.may_be(p))
        .map(|(p, _)| (p.flux - flux_e) / (p.variance + flux_e * p.variance_per_flux).sqrt())
        .collect();
    println!("{} of {} with hits: {taken:.1?}", taken.len(), hits.len());
    assert!(hits.len() == 50 && (20..45).contains(&taken.len()) && taken.iter().all(|p| p.abs() < 4.5), "{taken:?}");
}
