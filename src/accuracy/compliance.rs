//! The share of sky and time that is brighter than a limit: how many directions, how many moments.
//!
//! The error is that of the share of starlink-v2 at 550 km against SATCON1 in one night, in points of percent of all sky and time, against a
//! finer sampling in both.

use hifitime::Epoch;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::{Error, Result};
use crate::base::progress::Silent;
use crate::base::time::{seconds_between, shifted};
use crate::brightness::sky_points::SkyPoints;
use crate::brightness::{ModelSettings, Satellite, ToleranceOf};
use crate::config::{Mode, Sampling};
use crate::orbit::{EarthOrientation, Site};
use crate::visibility::compliance::{BrightnessLimit, Survey, judged, sample, satcon1_v_mag};
use crate::visibility::duty_cycle::dark_spans;

/// Directions at 15 min; minutes between moments at 300 directions.
const POINTS: [usize; 4] = [30, 100, 300, 1000];
const STEPS_MIN: [f64; 4] = [60.0, 30.0, 15.0, 5.0];
const DEFAULT: (usize, f64) = (300, 15.0);
/// Latitudes and nights \[deg, MJD of the noon before\].
const NIGHTS: [(f64, f64); 4] = [(0.0, 60_754.5), (30.0, 60_847.5), (-35.0, 60_847.5), (50.0, 61_030.5)];
const HEIGHT_KM: f64 = 550.0;

/// The share of a night in percent.
fn share(night: (f64, f64), (points, step_min): (usize, f64)) -> Result<f64> {
    let satellite = Satellite::named("starlink-v2").ok_or_else(|| Error::Model { problem: "no starlink-v2".into() })?;
    let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(Mode::Corrected, 1e-2) };
    let site = Site::new(night.0, 0.0, 0.0)?;
    let dark =
        dark_spans(&site, &EarthOrientation::default(), &Epoch::from_mjd_utc(night.1), 1.0, (-12f64).to_radians())?;
    let moments = |[from, to]: &[Epoch; 2]| {
        let length_s = seconds_between(*from, *to);
        let n = (length_s / (60.0 * step_min)).ceil().max(1.0) as usize;
        (0..n).map(|k| shifted(*from, (k as f64 + 0.5) * length_s / n as f64)).collect::<Vec<_>>()
    };
    let points = SkyPoints::new(points, Sampling::SolidAngle, None)?;
    let survey = Survey {
        nights: vec![(site, dark.iter().flat_map(moments).collect())],
        points: &points,
        min_alt_rad: 30f64.to_radians(),
        height_km: HEIGHT_KM,
        inclination_rad: None,
    };
    let limit = BrightnessLimit { name: String::new(), v_mag: satcon1_v_mag(HEIGHT_KM) };
    let seen = sample(&satellite, &settings, &survey, &Silent)?;
    Ok(100.0 * judged(&seen, &limit, "").brighter_frac.unwrap_or_default())
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let nights = &NIGHTS[..stopwatch.effort.of(1, NIGHTS.len())];
    let finest = stopwatch.effort.of((1000, 5.0), (5000, 2.0));
    let exact: Vec<f64> = nights.iter().map(|n| share(*n, finest)).collect::<Result<_>>()?;
    let point = |setting: String, knobs: (usize, f64)| -> Result<Option<SweepPoint>> {
        let found: Vec<f64> = nights.iter().map(|n| share(*n, knobs)).collect::<Result<_>>()?;
        let off: Vec<f64> = found.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let cpu_us = cpu_us(stopwatch, || {
            std::hint::black_box(share(nights[0], knobs).is_ok());
        });
        let is_default = knobs == DEFAULT;
        Ok(Errors::of(&off).map(|errors| SweepPoint { setting, errors, cpu_us, memory_kb: None, is_default }))
    };
    let of = |label: &str, points: Vec<Option<SweepPoint>>| Series {
        label: label.into(),
        points: points.into_iter().flatten().collect(),
    };
    let by_points = POINTS.map(|n| point(format!("{n}"), (n, DEFAULT.1))).into_iter().collect::<Result<_>>()?;
    let by_step = STEPS_MIN.map(|m| point(format!("{m} min"), (DEFAULT.0, m))).into_iter().collect::<Result<_>>()?;
    Ok(Sweep {
        knob: "directions, step",
        work: "one site, one night",
        error: "percent of sky and time",
        reference: "5000 directions every 2 min (1000 every 5 min where quick)",
        default_because: "0.1 percent of sky and time; the error of a prediction is worth several",
        series: vec![of("directions, every 15 min", by_points), of("step, 300 directions", by_step)],
    })
}
