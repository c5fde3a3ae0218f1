//! What to observe in a night: the passes of many satellites in the dark, how bright each will be, what the telescope makes of it.
//!
//! UTC, rad, km; magnitudes outside the atmosphere in the band of the models. A pass is looked at in steps of the whole night, so
//! that Sun and Moon are computed once a step, and more closely where it brightens steeply; its best moment is that of the largest signal-to-noise ratio in one exposure, to a second, its ends are known to a step. Geometric
//! altitudes. Not included: weather, other satellites in the field, the errors of old elements.

mod horizon;
mod look;
mod rank;
mod settings;

use hifitime::Epoch;
use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::search::{Until, golden_section};
use crate::base::time::{iso_utc, mjd_utc, seconds_between, shifted};
use crate::brightness::Model;
use crate::orbit::sky::{SkyBodies, bodies};
use crate::orbit::{EarthOrientation, Pass, Tracker, passes};
use crate::tables::PlanRow;
use crate::tables::words::PlanStatus;

pub use horizon::LocalHorizon;
pub use settings::PlanSettings;

use look::{Look, look};

/// Most steps of a night.
const MAX_STEPS: f64 = 1e5;
/// Steps nearer to an end of a pass than this share of a step are left out.
const APART: f64 = 1e-3;
/// Between moments that differ by more than this ratio, one of them this near the best, it is looked again.
const STEEP: f64 = 1.3;
const NEAR_THE_BEST: f64 = 0.5;
/// The best moment is found to this \[s\].
const TIME_TOLERANCE_S: f64 = 1.0;
/// Most moments of one pass: what is up for hours is looked at in longer steps.
const MOST_LOOKS: usize = 60;

/// One satellite.
#[derive(Debug)]
pub struct Candidate {
    /// Name, as the elements have it.
    pub object_name: String,
    /// Catalogue number.
    pub norad_cat_id: u64,
    /// International designator.
    pub object_id: String,
    /// Its orbit, or why there is none.
    pub tracker: std::result::Result<Tracker, String>,
    /// Which of the models is its own, or why none.
    pub model: std::result::Result<usize, String>,
}

/// A model and its name.
#[derive(Debug)]
pub struct NamedModel {
    /// As the catalogue has it.
    pub name: String,
    /// Ready.
    pub model: Model,
}

/// The steps of a night with Sun and Moon.
struct Grid {
    start: Epoch,
    step_s: f64,
    bodies: Vec<SkyBodies>,
}

impl Grid {
    fn new(dark: &[[Epoch; 2]], eop: &EarthOrientation, step_s: f64) -> Result<Option<Self>> {
        let (Some([start, _]), Some([_, end])) = (dark.first(), dark.last()) else { return Ok(None) };
        let n = seconds_between(*start, *end) / step_s;
        if !(step_s > 0.0 && n <= MAX_STEPS) {
            let problem = format!("{step_s} s: must be above 0 and give at most {MAX_STEPS} steps a night");
            return Err(Error::Argument { name: "step_s".into(), problem });
        }
        let epochs = (0..=n.ceil() as usize).into_par_iter().map(|k| shifted(*start, k as f64 * step_s));
        let bodies = epochs.map(|epoch| bodies(&epoch, eop)).collect::<Result<_>>()?;
        Ok(Some(Self { start: *start, step_s, bodies }))
    }

    /// The steps inside a pass and not at its ends, at most [`MOST_LOOKS`] of them; none where it lies between two.
    fn steps_of(&self, pass: &Pass) -> Vec<(Epoch, &SkyBodies)> {
        let step = |epoch| seconds_between(self.start, epoch) / self.step_s;
        let first = (step(pass.rise.epoch) + APART).ceil().max(0.0) as usize;
        let last = (step(pass.set.epoch) - APART).floor();
        if last < first as f64 {
            return Vec::new();
        }
        let last = (last as usize).min(self.bodies.len().saturating_sub(1));
        let stride = (last.saturating_sub(first) / MOST_LOOKS) + 1;
        let epoch = |k: usize| shifted(self.start, k as f64 * self.step_s);
        (first..=last).step_by(stride).filter_map(|k| Some((epoch(k), self.bodies.get(k)?))).collect()
    }
}

/// The plan of a night: a row for every pass in the dark spans (`duty_cycle::dark_spans`), the observable ones first, by rank.
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::Argument`] for a step that makes no sense, [`Error::Orbit`] for a night outside 1900-2100, [`Error::Model`] for a
/// telescope, a sky or a scene that makes no sense. Elements that cannot be used are rows.
pub fn plan(
    candidates: &[Candidate],
    models: &[NamedModel],
    dark: &[[Epoch; 2]],
    eop: &EarthOrientation,
    settings: &PlanSettings,
    progress: &dyn Progress,
) -> Result<Vec<PlanRow>> {
    settings.calculator.check()?;
    let Some(grid) = Grid::new(dark, eop, settings.step_s)? else { return Ok(Vec::new()) };
    progress.stage("plan", candidates.len());
    let rows = candidates
        .par_iter()
        .map(|candidate| {
            let rows = rows_of(candidate, models, dark, &grid, settings);
            progress.tick();
            rows
        })
        .collect::<Result<Vec<Vec<PlanRow>>>>();
    progress.done();
    let mut rows: Vec<PlanRow> = rows?.into_iter().flatten().collect();
    rank::rank(&mut rows, settings.slew_s);
    Ok(rows)
}

/// The rows of one satellite.
fn rows_of(
    candidate: &Candidate,
    models: &[NamedModel],
    dark: &[[Epoch; 2]],
    grid: &Grid,
    settings: &PlanSettings,
) -> Result<Vec<PlanRow>> {
    let named = candidate.model.as_ref().ok().and_then(|i| models.get(*i));
    let row = PlanRow {
        object_name: candidate.object_name.clone(),
        norad_cat_id: i64::try_from(candidate.norad_cat_id).unwrap_or_default(),
        object_id: candidate.object_id.clone(),
        model: named.map(|m| m.name.clone()).unwrap_or_default(),
        ..PlanRow::default()
    };
    let without = |status: PlanStatus, reason: String| PlanRow { status: status.into(), reason, ..row.clone() };
    let tracker = match &candidate.tracker {
        Ok(tracker) => tracker,
        Err(reason) => return Ok(vec![without(PlanStatus::Failed, reason.clone())]),
    };
    let found = dark.iter().map(|[start, end]| passes(tracker, start, end, settings.min_alt_rad)).collect();
    let found: Vec<Vec<Pass>> = match found {
        Ok(found) => found,
        Err(error @ Error::Orbit { .. }) => return Ok(vec![without(PlanStatus::Failed, error.to_string())]),
        Err(other) => return Err(other),
    };
    let mut rows = Vec::new();
    for pass in found.iter().flatten() {
        let model = named.map(|m| &m.model);
        // the ends of the pass, and the steps between: low in the sky towards the Sun a satellite may be brightest
        let mut looks = vec![look(pass.rise.geometry.clone(), model, settings)?];
        for (epoch, bodies) in grid.steps_of(pass) {
            looks.push(look(tracker.at_under(&epoch, bodies)?, model, settings)?);
        }
        looks.push(look(pass.set.geometry.clone(), model, settings)?);
        let at = |epoch: &Epoch| look(tracker.at(epoch)?, model, settings);
        densify(&mut looks, &at)?;
        let (status, best) = judged(&looks, model.is_some(), settings);
        if status == PlanStatus::Observable {
            refine(&mut looks, best, &at, settings)?;
        }
        let mut row = row_of(row.clone(), pass, &looks, (status, best), settings);
        if let (Err(why), true) = (&candidate.model, row.status == PlanStatus::NoModel) {
            row.reason.clone_from(why);
        }
        rows.push(row);
    }
    if rows.is_empty() {
        let reason = format!("never above {:.1} deg in the dark", settings.min_alt_rad.to_degrees());
        rows.push(without(PlanStatus::NotUp, reason));
    }
    Ok(rows)
}

/// The row of a pass from what was seen of it.
fn row_of(
    mut row: PlanRow,
    pass: &Pass,
    looks: &[Look],
    (status, best): (PlanStatus, usize),
    settings: &PlanSettings,
) -> PlanRow {
    let [from, to] = match status {
        PlanStatus::Observable => window(looks, best, settings),
        _ => [pass.rise.epoch, pass.set.epoch],
    };
    row.status = status.into();
    row.reason = reason(status, looks, best, settings);
    (row.date_beg, row.date_end) = (iso_utc(from, 0), iso_utc(to, 0));
    row.max_alt_deg = Some(pass.culmination.alt_rad.to_degrees());
    if let Some(look) = looks.get(best) {
        look.fill(&mut row, settings);
        row.date_best = iso_utc(look.geometry.epoch, 0);
        row.mjd_best_d = Some(mjd_utc(look.geometry.epoch));
    }
    row
}

/// What a pass is worth, and its best moment.
fn judged(looks: &[Look], modelled: bool, settings: &PlanSettings) -> (PlanStatus, usize) {
    let best = |accept: &dyn Fn(&Look) -> bool| {
        let accepted = looks.iter().enumerate().filter(|(_, l)| l.snr.is_some() && accept(l));
        accepted.reduce(|a, b| if b.1.merit > a.1.merit { b } else { a })
    };
    let highest = || {
        let alt = |i: usize| looks.get(i).map_or(f64::NEG_INFINITY, |l| l.geometry.alt_rad);
        (0..looks.len()).reduce(|a, b| if alt(b) > alt(a) { b } else { a }).unwrap_or_default()
    };
    let enough = |l: &Look| l.snr.is_some_and(|snr| snr >= settings.snr);
    let above = |l: &Look| l.above_horizon(settings);
    if !looks.iter().any(above) {
        return (PlanStatus::NotUp, highest());
    }
    let Some((brightest, most)) = best(&above) else {
        return match looks.iter().position(|l| l.saturated && above(l)) {
            Some(first) => (PlanStatus::TooBright, first),
            None => (if modelled { PlanStatus::NoLight } else { PlanStatus::NoModel }, highest()),
        };
    };
    if !enough(most) {
        return (PlanStatus::Faint, brightest);
    }
    match best(&|l| l.observable(settings)) {
        Some((i, _)) => (PlanStatus::Observable, i),
        None if looks.iter().any(|l| enough(l) && above(l) && l.slow(settings)) => (PlanStatus::NearMoon, brightest),
        None => (PlanStatus::TooFast, brightest),
    }
}

/// Looks again half-way between two moments, one of which is among the brightest and the other much fainter: the edge of the
/// shadow and glints are shorter than a step.
fn densify(looks: &mut Vec<Look>, at: &dyn Fn(&Epoch) -> Result<Look>) -> Result<()> {
    loop {
        let best = looks.iter().map(|l| l.merit).fold(0.0, f64::max);
        let wanted = |pair: &[Look]| {
            let (low, high) = (pair[0].merit.min(pair[1].merit), pair[0].merit.max(pair[1].merit));
            let apart_s = seconds_between(pair[0].geometry.epoch, pair[1].geometry.epoch);
            high > 0.0 && high >= NEAR_THE_BEST * best && high > STEEP * low && apart_s > 2.0 * TIME_TOLERANCE_S
        };
        let Some(k) = looks.windows(2).position(wanted) else { return Ok(()) };
        let (a, b) = (looks[k].geometry.epoch, looks[k + 1].geometry.epoch);
        looks.insert(k + 1, at(&shifted(a, 0.5 * seconds_between(a, b)))?);
    }
}

/// Moves the best moment to the largest signal-to-noise ratio between its neighbours.
fn refine(looks: &mut [Look], best: usize, at: &dyn Fn(&Epoch) -> Result<Look>, settings: &PlanSettings) -> Result<()> {
    let middle = looks[best].geometry.epoch;
    let from_middle = |i: usize| looks.get(i).map_or(0.0, |l| seconds_between(middle, l.geometry.epoch));
    let (lo, hi) = (from_middle(best.saturating_sub(1)), from_middle(best + 1));
    let merit = |t_s: f64| at(&shifted(middle, t_s)).map(|l| if l.observable(settings) { l.merit } else { 0.0 });
    let (t_s, _) = golden_section(lo, hi, Until::Length(TIME_TOLERANCE_S), merit)?;
    let refined = at(&shifted(middle, t_s))?;
    if refined.observable(settings) && refined.merit > looks[best].merit {
        looks[best] = refined;
    }
    Ok(())
}

/// The unbroken time around the best moment in which the target is observable, cut to the longest allowed.
fn window(looks: &[Look], best: usize, settings: &PlanSettings) -> [Epoch; 2] {
    let good = |l: &Look| l.observable(settings);
    let first = best - looks[..best].iter().rev().take_while(|l| good(l)).count();
    let last = best + looks[best + 1..].iter().take_while(|l| good(l)).count();
    let [from, middle, to] = [first, best, last].map(|i| looks[i].geometry.epoch);
    let half_s = 0.5 * settings.longest_s;
    let (before_s, after_s) = (seconds_between(from, middle), seconds_between(middle, to));
    // what is missing on one side is taken from the other
    let (before_s, after_s) =
        (before_s.min(half_s + (half_s - after_s).max(0.0)), after_s.min(half_s + (half_s - before_s).max(0.0)));
    [shifted(middle, -before_s), shifted(middle, after_s)]
}

/// Why a pass is not observable.
fn reason(status: PlanStatus, looks: &[Look], best: usize, settings: &PlanSettings) -> String {
    let Some(look) = looks.get(best) else { return String::new() };
    match status {
        PlanStatus::Faint => {
            let snr = look.snr.unwrap_or_default();
            format!("S/N {snr:.1} in {} s, {} is asked for", look.exptime_s, settings.snr)
        }
        PlanStatus::NearMoon => format!(
            "Moon {:.0} deg away, {:.0} deg is the least",
            look.geometry.moon_sep_rad.to_degrees(),
            settings.moon_sep_rad.to_degrees()
        ),
        PlanStatus::TooFast => format!(
            "{:.3} deg/s, the mount follows {:.3}",
            look.geometry.rate_rad_s.to_degrees(),
            settings.max_rate_rad_s.to_degrees()
        ),
        PlanStatus::TooBright => format!("saturates in {} s, the shortest exposure", settings.min_exptime_s),
        PlanStatus::NotUp => format!(
            "below the local horizon: altitude {:.1} deg, the horizon there is at {:.1} deg",
            look.geometry.alt_rad.to_degrees(),
            settings.horizon.alt_rad(look.geometry.az_rad).to_degrees()
        ),
        PlanStatus::NoLight => look.skipped(),
        _ => String::new(),
    }
}
