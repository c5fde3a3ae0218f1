//! The plan of a night: the step at which passes are looked at, and the tolerance of the model.
//!
//! The error is that of the best moment of a satellite: 2.5 lg of the exposure time that is found over that of the finest plan
//! \[mag\]; a satellite that only one of the two finds observable counts as 1 mag.

use std::collections::BTreeMap;

use hifitime::Epoch;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::{Error, Result};
use crate::base::progress::Silent;
use crate::brightness::{Model, ModelSettings, Satellite, ToleranceOf};
use crate::config::Mode;
use crate::orbit::{EarthOrientation, Elements, Site, Tracker};
use crate::tables::words::PlanStatus;
use crate::visibility::duty_cycle::dark_spans;
use crate::visibility::night_plan::{Candidate, LocalHorizon, NamedModel, PlanSettings, plan};
use crate::visibility::sky_brightness::{DARK_V_MAG_ARCSEC2, K_V_MAG_AIRMASS};
use crate::visibility::telescope::macquarie;

/// Steps \[s\] at the default tolerance; tolerances at the default step.
const STEPS_S: [f64; 6] = [120.0, 60.0, 30.0, 15.0, 5.0, 2.0];
const TOLERANCES: [f64; 5] = [0.3, 0.1, 1e-2, 1e-3, 1e-4];
const DEFAULT: (f64, f64) = (30.0, 1e-2);
const FINEST: (f64, f64) = (1.0, 1e-5);
/// Counted where a satellite is observable in one plan only \[mag\].
const MISSED_MAG: f64 = 1.0;
/// Local noon at the site, 2025-06-09: MJD (UTC).
const NOON_MJD_D: f64 = 60_835.08;

/// The night of a plan.
struct Night {
    site: Site,
    eop: EarthOrientation,
    dark: Vec<[Epoch; 2]>,
    n: usize,
}

/// Satellites on circular orbits of 53 deg at 550 km, all around the Earth.
fn candidates(night: &Night) -> Result<Vec<Candidate>> {
    let with_checksum = |line: String| {
        let sum: u32 = line.chars().map(|c| c.to_digit(10).unwrap_or(u32::from(c == '-'))).sum();
        format!("{line}{}", sum % 10)
    };
    let one = |i: usize| {
        let (number, node, anomaly) =
            (44_000 + i as u64, 30.0 * (i % 12) as f64, 360.0 * (0.618_034 * i as f64).fract());
        let first = format!("1 {number:05}U 19074A   25160.50000000  .00000000  00000+0  00000+0 0  999");
        let second = format!("2 {number:05}  53.0500 {node:8.4} 0001632 195.4618 {anomaly:8.4} 15.06000000 1000");
        let elements = Elements::from_tle("", &with_checksum(first), &with_checksum(second))?;
        let tracker = Tracker::new(vec![elements], None, night.site.clone(), night.eop)?;
        let (object_name, object_id) = (String::new(), String::new());
        Ok(Candidate { object_name, norad_cat_id: number, object_id, tracker: Ok(tracker), model: Ok(0) })
    };
    (0..night.n).map(one).collect()
}

/// The shortest exposure time of each satellite that is observable.
fn best(night: &Night, (step_s, tolerance): (f64, f64)) -> Result<BTreeMap<i64, f64>> {
    let satellite = Satellite::named("starlink-v2").ok_or_else(|| Error::Model { problem: "no starlink-v2".into() })?;
    let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(Mode::Corrected, tolerance) };
    let model = NamedModel { name: satellite.name.clone(), model: Model::new(&satellite, &settings)? };
    let asked = PlanSettings {
        calculator: macquarie(None)?,
        sky_band: "V".into(),
        dark_sky_mag_arcsec2: DARK_V_MAG_ARCSEC2,
        k_mag_airmass: K_V_MAG_AIRMASS,
        min_alt_rad: 20f64.to_radians(),
        horizon: LocalHorizon::default(),
        moon_sep_rad: 20f64.to_radians(),
        max_rate_rad_s: 5f64.to_radians(),
        exptime_s: 1.0,
        min_exptime_s: 1e-6,
        snr: 10.0,
        slew_s: 60.0,
        longest_s: 600.0,
        step_s,
    };
    let rows = plan(&candidates(night)?, &[model], &night.dark, &night.eop, &asked, &Silent)?;
    let mut best = BTreeMap::new();
    for row in rows.iter().filter(|r| r.status == PlanStatus::Observable) {
        let needed = row.needed_exptime_s.unwrap_or(f64::INFINITY);
        best.entry(row.norad_cat_id).and_modify(|b: &mut f64| *b = b.min(needed)).or_insert(needed);
    }
    Ok(best)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let (site, eop) = (Site::new(-33.7703, 151.1113, 70.0)?, EarthOrientation::default());
    let dark = dark_spans(&site, &eop, &Epoch::from_mjd_utc(NOON_MJD_D), 1.0, (-6f64).to_radians())?;
    let night = Night { site, eop, dark, n: stopwatch.effort.of(6, 60) };
    let finest = best(&night, FINEST)?;
    let point = |setting: String, knobs: (f64, f64)| -> Result<Option<SweepPoint>> {
        let found = best(&night, knobs)?;
        let off = |number: &i64| match (found.get(number), finest.get(number)) {
            (Some(a), Some(b)) => 2.5 * (a / b).log10(),
            _ => MISSED_MAG,
        };
        let both: std::collections::BTreeSet<i64> = found.keys().chain(finest.keys()).copied().collect();
        let errors = Errors::of(&both.iter().map(off).collect::<Vec<_>>());
        let us = cpu_us(stopwatch, || {
            std::hint::black_box(best(&night, knobs).is_ok());
        });
        let cpu_us = us / night.n as f64;
        Ok(errors.map(|errors| SweepPoint { setting, errors, cpu_us, memory_kb: None, is_default: knobs == DEFAULT }))
    };
    let of = |label: &str, points: Vec<Option<SweepPoint>>| Series {
        label: label.into(),
        points: points.into_iter().flatten().collect(),
    };
    let by_step = STEPS_S.map(|s| point(format!("{s} s"), (s, DEFAULT.1))).into_iter().collect::<Result<_>>()?;
    let by_tolerance =
        TOLERANCES.map(|t| point(format!("{t:e}"), (DEFAULT.0, t))).into_iter().collect::<Result<_>>()?;
    Ok(Sweep {
        knob: "step, tolerance",
        work: "one satellite, one night",
        error: "mag",
        reference: "a step of 1 s and a tolerance of 1e-5",
        default_because: "longer steps miss glints (1 of 60 satellites); predictions are known to 0.3 mag at best",
        series: vec![of("step, tolerance 1e-2", by_step), of("tolerance, step 30 s", by_tolerance)],
    })
}
