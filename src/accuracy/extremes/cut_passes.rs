//! Extremes of the window of time: passes that it cuts, a window of a second, rows farther apart than a pass is long.
//!
//! Cutting a window changes no moment of a pass that is inside it, and every cut is stated.

use hifitime::{Duration, Epoch};

use super::orbits::{ISS, track};
use super::{Extreme, absolute, holds, or_wrong, refused};
use crate::base::error::Result;
use crate::base::time::seconds_between;
use crate::orbit::{Pass, Tracker, passes};
use crate::visibility::forecast::{Window, moments};

const AREA: &str = "passes";
const MIN_ALT_DEG: f64 = 10.0;

fn found(tracker: &Tracker, from: Epoch, to: Epoch) -> Result<Vec<Pass>> {
    passes(tracker, &from, &to, MIN_ALT_DEG.to_radians())
}

fn after(epoch: Epoch, s: f64) -> Epoch {
    epoch + Duration::from_seconds(s)
}

pub(super) fn cases() -> Vec<Extreme> {
    match whole() {
        Ok((tracker, whole)) => of_cuts(&tracker, &whole),
        Err(error) => vec![holds(AREA, "a whole pass", "an answer", false, error.to_string())],
    }
}

/// A pass of the ISS over Macquarie that nothing cuts.
fn whole() -> Result<(Tracker, Pass)> {
    let tracker = track(ISS, -33.7703, 151.1113)?;
    let start = crate::base::time::parse_utc("time", "2025-06-09T10:00:00")?;
    let pass = found(&tracker, start, after(start, 3_600.0))?.into_iter().next();
    let none = || crate::Error::Orbit { problem: "no pass in the hour that has one".into() };
    Ok((tracker, pass.ok_or_else(none)?))
}

fn of_cuts(tracker: &Tracker, whole: &Pass) -> Vec<Extreme> {
    let (rise, top, set) = (whole.rise.epoch, whole.culmination.epoch, whole.set.epoch);
    let length_s = seconds_between(rise, set);
    let mut all = Vec::new();
    for (name, share) in [("before it culminates", 0.25), ("after it culminates", 0.75)] {
        let cut = after(rise, share * length_s);
        let case = format!("a pass cut {name}");
        let halves = found(tracker, after(rise, -600.0), cut)
            .and_then(|first| found(tracker, cut, after(set, 600.0)).map(|second| (first, second)));
        all.push(or_wrong(
            AREA,
            &case,
            halves.map(|(first, second)| {
                let ([a], [b]) = (first.as_slice(), second.as_slice()) else {
                    return holds(
                        AREA,
                        &case,
                        "one pass on each side",
                        false,
                        format!("{} and {}", first.len(), second.len()),
                    );
                };
                let off_s = [(a.rise.epoch, rise), (a.set.epoch, cut), (b.rise.epoch, cut), (b.set.epoch, set)]
                    .map(|(got, exact)| seconds_between(exact, got).abs());
                let stated = !a.starts_before && a.ends_after && b.starts_before && !b.ends_after;
                // the half with the top has it where the whole has it, the other is highest at the cut
                let (with, without) = if share > 0.5 { (a, b) } else { (b, a) };
                let tops = [(with.culmination.epoch, top), (without.culmination.epoch, cut)]
                    .map(|(got, exact)| seconds_between(exact, got).abs());
                let worst = off_s.into_iter().chain(tops).fold(0.0, f64::max);
                let case = format!("{case}: rise, top and set of both halves, cuts stated {stated} [s]");
                absolute(AREA, case, 0.0, if stated { worst } else { f64::INFINITY }, 0.01)
            }),
        ));
    }
    let second = found(tracker, after(top, 30.0), after(top, 31.0));
    all.push(or_wrong(
        AREA,
        "a window of a second inside a pass",
        second.map(|passes| {
            let fine = matches!(passes.as_slice(), [p] if p.starts_before && p.ends_after);
            let got = format!("{} passes, cut on both sides: {fine}", passes.len());
            holds(AREA, "a window of a second inside a pass", "one pass, cut on both sides", fine, got)
        }),
    ));
    all.push(refused(AREA, "a window that ends where it begins", "after the start", found(tracker, top, top)));
    let window = Window {
        start: after(rise, -7.0),
        end: after(set, 7.0),
        step_s: 6_000.0,
        min_alt_rad: MIN_ALT_DEG.to_radians(),
    };
    let rows = moments(&window, std::slice::from_ref(whole));
    all.push(or_wrong(
        AREA,
        "rows farther apart than a pass is long",
        rows.map(|rows| {
            let off_s = if rows.len() == 1 { seconds_between(top, rows[0]).abs() } else { f64::INFINITY };
            absolute(AREA, "rows farther apart than a pass is long: one at its top [s]", 0.0, off_s, 0.01)
        }),
    ));
    all
}
