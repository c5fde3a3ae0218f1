//! The forecast of a constellation over one night: satellites looked at, time between moments, tolerance of the model.
//!
//! starlink-v2, 6000 satellites, over 35° south. The error is that of how many are brighter than magnitude 7 at once on the
//! mean of the dark hours, relative, against every satellite each 2 min with a tolerance of 1e-6.

use hifitime::{Duration, Epoch};

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, timed};
use crate::base::error::{Error, Result};
use crate::brightness::{Catalogue, Model, ModelSettings, Satellite, ToleranceOf};
use crate::config::Mode;
use crate::orbit::{EarthOrientation, Site};
use crate::visibility::duty_cycle::dark_spans;
use crate::visibility::forecast::constellation::{Source, Watch};
use crate::visibility::forecast::walker::{Pattern, Walker};

const SATELLITE: &str = "starlink-v2";
const COUNT: usize = 6000;
const INCLINATION_DEG: f64 = 53.0;
const V_MAG: f64 = 7.0;
const MIN_ALT_DEG: f64 = 20.0;
/// One satellite of so many; minutes between moments; tolerances; each with the others at the default.
const ONE_OF: [usize; 4] = [30, 10, 3, 1];
const STEPS_MIN: [f64; 4] = [60.0, 30.0, 10.0, 5.0];
const TOLERANCES: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];
/// Those of `predict constellation`.
const DEFAULT: (usize, f64, f64) = (1, 10.0, 1e-2);
const FINEST: (usize, f64, f64) = (1, 2.0, 1e-6);
/// Local noon at the longitude of the site, MJD (UTC), of nights over the year.
const NOONS_MJD_D: [f64; 6] = [60_676.1, 60_737.1, 60_798.1, 60_859.1, 60_920.1, 60_981.1];

/// How many are brighter at once, on the mean of the dark hours.
fn brighter(source: &Source, noon_mjd_d: f64, (one_of, step_min, tolerance): (usize, f64, f64)) -> Result<f64> {
    let satellite = Satellite::named(SATELLITE).ok_or_else(|| Error::Model { problem: format!("no {SATELLITE}") })?;
    let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(Mode::Corrected, tolerance) };
    let model = Model::new(&satellite, &settings)?;
    let (site, noon) = (Site::new(-35.0, 151.0, 0.0)?, Epoch::from_mjd_utc(noon_mjd_d));
    let dark = dark_spans(&site, &EarthOrientation::default(), &noon, 1.0, (-12f64).to_radians())?;
    let watch =
        Watch { site: &site, model: &model, start: noon, min_alt_rad: MIN_ALT_DEG.to_radians(), shard: (0, one_of) };
    let (mut sum, mut n) = (0usize, 0usize);
    for [from, to] in dark {
        let mut epoch = from + Duration::from_seconds(30.0 * step_min);
        while epoch < to {
            let moment = watch.moment(&epoch)?;
            watch.for_each_above_horizon(source, &moment, &mut |seen| {
                sum += usize::from(seen.alt_rad >= watch.min_alt_rad && seen.v_mag().is_some_and(|v| v < V_MAG));
                Ok(())
            })?;
            n += 1;
            epoch += Duration::from_seconds(60.0 * step_min);
        }
    }
    Ok((one_of * sum) as f64 / n.max(1) as f64)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let catalogue = Catalogue::load(None)?;
    let count = stopwatch.effort.of(COUNT / 10, COUNT);
    let pattern = Pattern { inclination_rad: Some(INCLINATION_DEG.to_radians()), ..Pattern::default() };
    let source = Source::Walker(Walker::new(&catalogue.find(SATELLITE)?.orbits, count, &pattern)?);
    let nights = &NOONS_MJD_D[..stopwatch.effort.of(2, NOONS_MJD_D.len())];
    let finest = stopwatch.effort.of((1, 5.0, 1e-5), FINEST);
    let exact: Vec<f64> = nights.iter().map(|n| brighter(&source, *n, finest)).collect::<Result<_>>()?;
    let point = |setting: String, knobs: (usize, f64, f64)| -> Result<Option<SweepPoint>> {
        let all = || nights.iter().map(|n| brighter(&source, *n, knobs)).collect::<Result<Vec<f64>>>();
        let (found, time) = timed(stopwatch, all)?;
        let off: Vec<f64> = found.iter().zip(&exact).map(|(a, b)| a / b - 1.0).collect();
        let cpu_us = time / nights.len() as f64;
        let is_default = knobs == DEFAULT;
        Ok(Errors::of(&off).map(|errors| SweepPoint { setting, errors, cpu_us, memory_kb: None, is_default }))
    };
    let (_, step, tolerance) = DEFAULT;
    let of = |label: &str, points: Vec<Option<SweepPoint>>| Series {
        label: label.into(),
        points: points.into_iter().flatten().collect(),
    };
    let by_share =
        ONE_OF.map(|n| point(format!("1 of {n}"), (n, step, tolerance))).into_iter().collect::<Result<_>>()?;
    let by_step = STEPS_MIN.map(|m| point(format!("{m} min"), (1, m, tolerance))).into_iter().collect::<Result<_>>()?;
    let by_tolerance = TOLERANCES.map(|t| point(format!("{t:e}"), (1, step, t))).into_iter().collect::<Result<_>>()?;
    Ok(Sweep {
        knob: "satellites, step, tolerance",
        work: "one site, one night",
        error: "relative",
        reference: "all satellites every 2 min with a tolerance of 1e-6 (5 min and 1e-5 of a tenth of them where quick)",
        default_because: "1e-2 promises 0.01 mag, less than the step costs; which satellites fly, and how bright they are, is known less well than \
                          any of these",
        series: vec![of("satellites", by_share), of("step", by_step), of("tolerance", by_tolerance)],
    })
}
