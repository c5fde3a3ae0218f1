//! The median over a sky: its error by the number of directions, evenly on a golden spiral or at random.
//!
//! Magnitudes. Skies over Macquarie around the full Moon of June 2025, by day, in twilight and at night. The reference
//! is the median of very many directions of the same kind of spiral, which is far better than any setting.

use super::effort::Effort;
use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::{Error, Result};
use crate::base::time::from_mjd_utc;
use crate::brightness::sky_points::{SkyPoints, Spread};
use crate::brightness::{ModelSettings, Satellite, ToleranceOf};
use crate::config::{Mode, Sampling};
use crate::orbit::Site;
use crate::visibility::forecast::day::sky_light;
use crate::visibility::forecast::dome::{Dome, Overhead};

/// MJD (UTC) of the first sky: noon of 11 June 2025 at Macquarie, and the step between skies \[d\].
const FROM_MJD_D: f64 = 60_837.083_3;
const STEP_D: f64 = 0.171;
const COUNTS: [usize; 5] = [30, 100, 300, 1000, 3000];
/// That of `satphot predict day` by default.
const DEFAULT: usize = 1000;

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let site = Site::new(-33.7703, 151.1113, 70.0)?;
    let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(Mode::Corrected, 1e-3) };
    let skies = stopwatch.effort.of(4, 24);
    let reference = stopwatch.effort.of(8_000, 40_000);
    let moments: Vec<Overhead> = (0..skies)
        .map(|k| Overhead::at(&site, &from_mjd_utc(FROM_MJD_D + STEP_D * f64::from(k))))
        .collect::<Result<_>>()?;
    let mut series = Vec::new();
    let kinds =
        [("BlueBird, 520 km, spiral", "bluebird-fm1", false), ("BlueBird, 520 km, random", "bluebird-fm1", true)];
    // laboratory laws cost ten times as much
    let lobed = [("ISS, 420 km, spiral", "iss", false)];
    let wanted = kinds.iter().chain(lobed.iter().filter(|_| stopwatch.effort == Effort::Full));
    for (label, name, random) in wanted {
        let unknown = || Error::Model { problem: format!("{name} is not in the list of satellites") };
        let satellite = Satellite::named(name).ok_or_else(unknown)?;
        let dome = Dome::new(&site, &satellite, &settings, if *name == "iss" { 420.0 } else { 520.0 }, 1.0)?;
        let median = |n: usize, seed: Option<u64>, at: &Overhead| -> Result<Option<f64>> {
            let mut light = sky_light(&dome, &SkyPoints::new(n, Sampling::SolidAngle, seed)?, at)?;
            Ok(Spread::of(&mut light.v_mag).map(|s| s.median))
        };
        let mut truth = Vec::new();
        for at in &moments {
            truth.push(median(reference, None, at)?);
        }
        let mut points = Vec::new();
        for n in COUNTS {
            let mut off = Vec::new();
            for (k, (at, truth)) in moments.iter().zip(&truth).enumerate() {
                let seeds: Vec<Option<u64>> =
                    if *random { (0..5).map(|s| Some(s + 5 * k as u64)).collect() } else { vec![None] };
                for seed in seeds {
                    off.extend(median(n, seed, at)?.zip(*truth).map(|(m, truth)| m - truth));
                }
            }
            let us = cpu_us(stopwatch, || {
                let _ = median(n, None, &moments[0]);
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: n.to_string(),
                errors,
                cpu_us: us,
                memory_kb: Some((n * 8 * size_of::<f64>()) as f64 / 1024.0),
                is_default: n == DEFAULT && !random,
            }));
        }
        series.push(Series { label: (*label).into(), points });
    }
    Ok(Sweep {
        knob: "points",
        work: "one sky",
        error: "mag",
        reference: "the median of many more directions",
        default_because: "a median to 0.02 mag is finer than any figure; 300 points do for a month",
        series,
    })
}
