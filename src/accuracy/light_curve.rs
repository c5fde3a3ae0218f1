//! A light curve: V along the passes of a day, by the step between its rows and the tolerance of the model.
//!
//! The ISS over Macquarie. Between rows V is linear in time. The reference is the model at that very moment with a
//! tolerance of 1e-9. Errors in magnitudes.

use hifitime::{Duration, Epoch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::{Error, Result};
use crate::base::progress::Silent;
use crate::base::time::seconds_between;
use crate::brightness::{Model, ModelSettings, Satellite};
use crate::config::Mode;
use crate::orbit::{Pass, Site, Tracker};
use crate::tables::PhotometryRow;
use crate::visibility::forecast::{Window, moments, predict, visible};

/// Steps \[s\] at the default tolerance; tolerances at the default step. `predict pass` takes the defaults.
const STEPS_S: [f64; 6] = [60.0, 30.0, 10.0, 5.0, 2.0, 1.0];
const TOLERANCES: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8];
const DEFAULT: (f64, f64) = (5.0, 1e-4);
const FINEST_TOLERANCE: f64 = 1e-9;
const ELEMENTS: &str = include_str!("../presets/iss_2025_june.tle");

/// The passes and what the light curve is compared at.
struct Day {
    tracker: Tracker,
    window: Window,
    passes: Vec<Pass>,
    /// Moments in the passes and V there.
    truth: Vec<(Epoch, f64)>,
}

fn model(tolerance: f64) -> Result<Model> {
    let satellite = Satellite::named("iss").ok_or_else(|| Error::Model { problem: "no iss".into() })?;
    Model::new(&satellite, &ModelSettings::new(Mode::Corrected, tolerance))
}

impl Day {
    fn new(stopwatch: &Stopwatch) -> Result<Self> {
        let tracker = Tracker::from_text(ELEMENTS, Site::new(-33.7703, 151.1113, 70.0)?)?;
        let start = crate::base::time::parse_utc("time", "2025-06-09T08:00:00")?;
        let hours = stopwatch.effort.of(4.0, 24.0);
        let end = start + Duration::from_hours(hours);
        let window = Window { start, end, step_s: DEFAULT.0, min_alt_rad: 15f64.to_radians() };
        let passes = visible(&tracker, &window)?;
        let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(41));
        let mut epochs = Vec::new();
        for pass in &passes {
            let length_s = seconds_between(pass.rise.epoch, pass.set.epoch);
            let within = |rng: &mut ChaCha12Rng| rng.random_range(0.0..length_s);
            epochs.extend(
                (0..stopwatch.effort.of(40, 300)).map(|_| pass.rise.epoch + Duration::from_seconds(within(&mut rng))),
            );
        }
        let rows = predict(&tracker, &model(FINEST_TOLERANCE)?, &epochs, &Silent)?;
        let truth = epochs.into_iter().zip(rows).filter_map(|(epoch, row)| Some((epoch, row.model_v_mag?))).collect();
        Ok(Self { tracker, window, passes, truth })
    }

    fn rows(&self, (step_s, tolerance): (f64, f64)) -> Result<(Vec<Epoch>, Vec<PhotometryRow>)> {
        let epochs = moments(&Window { step_s, ..self.window }, &self.passes)?;
        let rows = predict(&self.tracker, &model(tolerance)?, &epochs, &Silent)?;
        Ok((epochs, rows))
    }

    /// V between the rows less the truth, where rows of the same pass with light lie on both sides.
    fn off(&self, (step_s, tolerance): (f64, f64)) -> Result<Vec<f64>> {
        let (epochs, rows) = self.rows((step_s, tolerance))?;
        let at = |(epoch, truth): &(Epoch, f64)| {
            let after = epochs.partition_point(|e| e < epoch);
            let before = after.checked_sub(1)?;
            let between_s = seconds_between(*epochs.get(before)?, *epochs.get(after)?);
            let share = seconds_between(*epochs.get(before)?, *epoch) / between_s;
            let (a, b) = (rows.get(before)?.model_v_mag?, rows.get(after)?.model_v_mag?);
            (between_s < 1.5 * step_s).then_some((1.0 - share) * a + share * b - truth)
        };
        Ok(self.truth.iter().filter_map(at).collect())
    }
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let day = Day::new(stopwatch)?;
    let passes = day.passes.len().max(1) as f64;
    let timed = |knobs: (f64, f64)| {
        let us = cpu_us(stopwatch, || {
            std::hint::black_box(day.rows(knobs).is_ok());
        });
        us / passes
    };
    let point = |setting: String, knobs: (f64, f64), errors: Vec<f64>| {
        let cpu_us = timed(knobs);
        Errors::of(&errors).map(|errors| SweepPoint {
            setting,
            errors,
            cpu_us,
            memory_kb: None,
            is_default: knobs == DEFAULT,
        })
    };
    let mut by_step = Vec::new();
    for step_s in STEPS_S {
        let knobs = (step_s, DEFAULT.1);
        by_step.extend(point(format!("{step_s} s"), knobs, day.off(knobs)?));
    }
    let mut by_tolerance = Vec::new();
    let epochs: Vec<Epoch> = day.truth.iter().map(|(epoch, _)| *epoch).collect();
    for tolerance in TOLERANCES {
        // the tolerance alone: at the very moments, not between rows
        let rows = predict(&day.tracker, &model(tolerance)?, &epochs, &Silent)?;
        let off = rows.iter().zip(&day.truth).filter_map(|(row, (_, truth))| Some(row.model_v_mag? - truth));
        by_tolerance.extend(point(format!("{tolerance:e}"), (DEFAULT.0, tolerance), off.collect()));
    }
    Ok(Sweep {
        knob: "step, tolerance",
        work: "one pass",
        error: "mag",
        reference: "the model at that very moment with a tolerance of 1e-9",
        default_because: "predictions are known to 0.3 mag at best; only the edge of the shadow changes within 5 s",
        series: vec![
            Series { label: "step, between rows".into(), points: by_step },
            Series { label: "tolerance, at a row".into(), points: by_tolerance },
        ],
    })
}
