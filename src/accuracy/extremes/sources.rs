//! Extremes of what stands in a target frame: images of half a pixel, a saturated star under the target, trails everywhere.
//!
//! A flux is right within its error, or the frame carries the flag of what spoils it.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use statrs::function::erf::erf;

use super::super::simulated::ideal_gain;
use super::{Extreme, holds, or_wrong, relative};
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::error::Result;
use crate::config::ApertureShape;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::background::background;
use crate::photometry::flux::measure;
use crate::photometry::growth::FRAME_SCATTER;
use crate::photometry::target::measure::{TargetFound, measure_target};
use crate::photometry::target::settings::TargetSettings;

const AREA: &str = "sources";
const SIDE: usize = 320;
const SKY_E: f64 = 100.0;
const SATURATION_E: f64 = 60_000.0;
/// Frames of a case that draws them.
const FRAMES: u64 = 12;
/// Off by more than this many stated errors is wrong: of all the frames here one in a hundred thousand by chance.
const WRONG_SIGMA: f64 = 5.0;

/// Expected electrons of each pixel.
struct Scene(Array2<f64>);

impl Scene {
    fn new() -> Self {
        Self(Array2::from_elem((SIDE, SIDE), SKY_E))
    }

    /// A round Gaussian, integrated over each pixel.
    fn star(&mut self, (x, y): (f64, f64), flux_e: f64, fwhm_px: f64) {
        let scale = std::f64::consts::SQRT_2 * fwhm_px / FWHM_PER_SIGMA;
        let share = |i: usize, c: f64| 0.5 * (erf((i as f64 + 0.5 - c) / scale) - erf((i as f64 - 0.5 - c) / scale));
        let columns: Vec<f64> = (0..SIDE).map(|i| share(i, x)).collect();
        for (j, mut row) in self.0.outer_iter_mut().enumerate() {
            let of_row = flux_e * share(j, y);
            if of_row > 1e-12 {
                row.iter_mut().zip(&columns).for_each(|(pixel, s)| *pixel += of_row * s);
            }
        }
    }

    /// A trail without end through a place, with so many electrons per pixel of its length.
    fn trail(&mut self, (x, y): (f64, f64), theta: f64, e_per_px: f64, fwhm_px: f64) {
        let scale = std::f64::consts::SQRT_2 * fwhm_px / FWHM_PER_SIGMA;
        for ((j, i), pixel) in self.0.indexed_iter_mut() {
            let v = -(i as f64 - x) * theta.sin() + (j as f64 - y) * theta.cos();
            if v.abs() < 6.0 * scale {
                *pixel += 0.5 * e_per_px * (erf((v + 0.5) / scale) - erf((v - 0.5) / scale));
            }
        }
    }

    /// With Gaussian noise of Poisson's variance, cut at saturation and masked there.
    fn exposed(&self, rng: &mut ChaCha12Rng) -> Frame<Electrons> {
        let noisy = self.0.mapv(|e| e + e.sqrt() * rng.sample::<f64, _>(StandardNormal));
        framed(&noisy)
    }
}

fn framed(electrons: &Array2<f64>) -> Frame<Electrons> {
    let gain = ideal_gain(SATURATION_E);
    let mut frame = Frame::from_electrons("made".into(), electrons.mapv(|e| e.min(SATURATION_E) as f32), gain);
    for (bits, e) in frame.mask.iter_mut().zip(electrons) {
        if *e >= SATURATION_E {
            *bits |= mask::SATURATED;
        }
    }
    frame
}

fn settings(fwhm_px: f64) -> TargetSettings {
    let middle = 0.5 * SIDE as f64;
    TargetSettings {
        x_px: middle,
        y_px: middle,
        search_radius_px: 40.0,
        detect_sigma: 5.0,
        margin_px: 1.5 * fwhm_px,
        limit_r_px: 2.0 * fwhm_px,
        fwhm_px,
        fwhm_err_frac: FRAME_SCATTER,
        is_fwhm_known: true,
        profile: None,
        largest_fwhm: None,
        known_disc2: None,
        sky_in_px: 3.0 * fwhm_px,
        sky_out_px: 5.0 * fwhm_px,
        clip_sigma: 3.0,
        shape: ApertureShape::Auto,
        contam_frac: 0.05,
        trail_direction: None,
        trail_length_px: None,
        bound_px: None,
    }
}

/// What became of drawn frames: right within the errors, flagged, a limit, or wrong and silent.
#[derive(Default)]
struct Outcome {
    right: usize,
    flagged: usize,
    limits: usize,
    silent: Vec<String>,
}

impl Outcome {
    fn add(&mut self, frame: &Frame<Electrons>, (truth_e, fwhm_px): (f64, f64), spoils: Flags) -> Result<()> {
        let sky = background(frame, 64, 3.0)?;
        match measure_target(frame, &sky, &settings(fwhm_px)) {
            TargetFound::Detected { flux, .. } => {
                let off = (flux.flux_e - truth_e).abs() / flux.flux_err_e;
                if flux.flags.0 & spoils.0 != 0 {
                    self.flagged += 1;
                } else if off <= WRONG_SIGMA {
                    self.right += 1;
                } else {
                    self.silent.push(format!("{:.0} +- {:.0} for {truth_e:.0} e-", flux.flux_e, flux.flux_err_e));
                }
            }
            TargetFound::NotDetected { .. } => self.limits += 1,
        }
        Ok(())
    }

    fn case(&self, case: &str, expected: &str, fine: bool) -> Extreme {
        let silent = if self.silent.is_empty() { String::new() } else { format!(": {}", self.silent.join("; ")) };
        let got = format!(
            "{} right, {} flagged, {} limits, {} wrong and not flagged{silent}",
            self.right,
            self.flagged,
            self.limits,
            self.silent.len()
        );
        holds(AREA, case, expected, fine && self.silent.is_empty(), got)
    }
}

pub(super) fn cases() -> Vec<Extreme> {
    vec![
        or_wrong(AREA, "a star of 0.5 px FWHM", narrow_flux()),
        or_wrong(AREA, "a target of 0.5 px FWHM", narrow_target()),
        or_wrong(AREA, "a target on a saturated star", on_saturated()),
        or_wrong(AREA, "a target in a sky full of trails", crowd()),
    ]
}

/// The aperture holds all of it, wherever in a pixel it stands.
fn narrow_flux() -> Result<Extreme> {
    let flux_e = 2e4;
    let mut worst = flux_e;
    for (dx, dy) in [(0.0, 0.0), (0.5, 0.5), (0.25, 0.4), (0.5, 0.0), (-0.3, 0.1)] {
        let at = (160.0 + dx, 160.0 + dy);
        let mut scene = Scene::new();
        scene.star(at, flux_e, 0.5);
        let frame = framed(&scene.0);
        let got =
            measure(&frame, &background(&frame, 64, 3.0)?, at.0, at.1, Shape::Circle { r_px: 3.0 }, 5.0, 10.0, 3.0);
        if (got.flux_e - flux_e).abs() >= f64::abs(worst - flux_e) {
            worst = got.flux_e;
        }
    }
    Ok(relative(AREA, "flux of a star of 0.5 px FWHM, five places in a pixel, the worst [e-]", flux_e, worst, 1e-5))
}

/// It cannot be told from a hot pixel: found with its flux, or flagged as a hit, never wrong and silent.
fn narrow_target() -> Result<Extreme> {
    let mut outcome = Outcome::default();
    for seed in 0..FRAMES {
        let mut rng = ChaCha12Rng::seed_from_u64(7_100 + seed);
        let mut scene = Scene::new();
        scene.star((160.0 + rng.random_range(-9.0..9.0), 160.0 + rng.random_range(-9.0..9.0)), 2e4, 0.5);
        outcome.add(&scene.exposed(&mut rng), (2e4, 0.5), Flags::HIT)?;
    }
    Ok(outcome.case("targets of 0.5 px FWHM", "right within 5 sigma, flagged as a hit, or a limit", true))
}

/// A bright star that fills the well under the target: the flux of both is not that of the target.
fn on_saturated() -> Result<Extreme> {
    let mut outcome = Outcome::default();
    for seed in 0..FRAMES {
        let mut rng = ChaCha12Rng::seed_from_u64(7_200 + seed);
        let mut scene = Scene::new();
        let at = (160.0 + rng.random_range(-9.0..9.0), 160.0 + rng.random_range(-9.0..9.0));
        scene.star(at, 2e4, 4.0);
        scene.star((at.0 + rng.random_range(-2.0..2.0), at.1), 5e6, 4.0);
        outcome.add(&scene.exposed(&mut rng), (2e4, 4.0), Flags::SATURATED)?;
    }
    let all = outcome.flagged == FRAMES as usize;
    Ok(outcome.case("targets on a saturated star", "every frame flagged as saturated", all))
}

/// Two hundred trails over the frame, brighter and fainter than the target, some of them through it.
fn crowd() -> Result<Extreme> {
    let mut outcome = Outcome::default();
    for seed in 0..FRAMES {
        let mut rng = ChaCha12Rng::seed_from_u64(7_300 + seed);
        let mut scene = Scene::new();
        let theta = rng.random_range(0.0..std::f64::consts::PI);
        for _ in 0..200 {
            let at = (rng.random_range(0.0..SIDE as f64), rng.random_range(0.0..SIDE as f64));
            scene.trail(at, theta, 20.0 * rng.random_range(0.01..1.0f64).powf(-0.8), 4.0);
        }
        scene.star((160.0, 160.0), 2e4, 4.0);
        let spoils = Flags(Flags::TRAIL.0 | Flags::CONTAMINATED.0 | Flags::CROWDED_ANNULUS.0);
        outcome.add(&scene.exposed(&mut rng), (2e4, 4.0), spoils)?;
    }
    Ok(outcome.case("targets among 200 trails", "right within 5 sigma, flagged, or a limit", true))
}
