//! The whole pass of every stay in a window: rise, culmination and set also where they lie outside it.
//!
//! Radians and km. The search goes beyond the window as far as a pass can reach; what neither rises nor sets in that
//! time has no culmination. Not included: refraction, which lifts a satellite in the horizon by half a degree.

use hifitime::Epoch;

use super::passes::{Node, Pass, PassEvent, Search, stays};
use super::time::days_between;
use super::tracker::Tracker;
use crate::base::error::Result;

/// How far beyond the window a rise or set is looked for \[s\]: two days, in which the Earth turns twice under a
/// satellite, and two periods.
const REACH_S: f64 = 2.0 * 86_400.0;
const REACH_PERIODS: f64 = 2.0;

/// A pass of which some part lies in the window.
#[derive(Debug, Clone)]
pub struct WholePass {
    /// Where it comes up; `None` if it does not in the time searched.
    pub rise: Option<PassEvent>,
    /// Its highest point; `None` without a rise or without a set.
    pub culmination: Option<PassEvent>,
    /// Where it goes down; `None` if it does not in the time searched.
    pub set: Option<PassEvent>,
    /// The part of it in the window.
    pub inside: Pass,
    /// What was searched for this pass, from and to.
    pub searched: [Epoch; 2],
    /// The search ended where the elements cannot be used any further.
    pub elements_end: bool,
}

impl WholePass {
    /// Which of rise, culmination and set lie outside the window from `start` to `end`, in that order.
    #[must_use]
    pub fn outside(&self, start: &Epoch, end: &Epoch) -> Vec<&'static str> {
        let events = [("rise", &self.rise), ("culmination", &self.culmination), ("set", &self.set)];
        let is_outside =
            |event: &PassEvent| days_between(start, &event.epoch) < 0.0 || days_between(&event.epoch, end) < 0.0;
        events.into_iter().filter(|(_, e)| e.as_ref().is_some_and(is_outside)).map(|(name, _)| name).collect()
    }
}

/// One side of a pass outside the window.
struct Side {
    crossing_s: Option<f64>,
    /// Its highest node.
    top: Node,
    /// How far the search went \[s\].
    reached_s: f64,
    elements_end: bool,
}

/// Every pass above `min_alt_rad` that has a part between `start` and `end`, whole, in order of time.
///
/// # Errors
/// As [`super::passes()`].
pub fn whole_passes(tracker: &Tracker, start: &Epoch, end: &Epoch, min_alt_rad: f64) -> Result<Vec<WholePass>> {
    let (search, found) = stays(tracker, start, end, min_alt_rad)?;
    found.into_iter().map(|inside| whole(&search, inside, start)).collect()
}

fn whole(search: &Search, inside: Pass, start: &Epoch) -> Result<WholePass> {
    let second = |event: &PassEvent| days_between(start, &event.epoch) * 86_400.0;
    let [rise_s, top_s, set_s] = [&inside.rise, &inside.culmination, &inside.set].map(second);
    let before = if inside.starts_before { Some(outward(search, rise_s, -1.0)?) } else { None };
    let after = if inside.ends_after { Some(outward(search, set_s, 1.0)?) } else { None };
    let event = |cut: &Option<Side>, own: &PassEvent| match cut {
        None => Ok(Some(own.clone())),
        Some(side) => side.crossing_s.map(|t_s| search.event(t_s)).transpose(),
    };
    let (rise, set) = (event(&before, &inside.rise)?, event(&after, &inside.set)?);
    let mut top = search.node(top_s)?;
    for side in [&before, &after].into_iter().flatten() {
        if side.top.1 > top.1 {
            top = side.top;
        }
    }
    let culmination = match (&rise, &set) {
        (Some(_), Some(_)) if top.0 == top_s || (top.0 - top_s).abs() < 1e-6 => Some(inside.culmination.clone()),
        (Some(_), Some(_)) => Some(search.event(top.0)?),
        _ => None,
    };
    let reached = |side: &Option<Side>, own_s: f64| search.epoch(side.as_ref().map_or(own_s, |s| s.reached_s));
    Ok(WholePass {
        searched: [reached(&before, rise_s), reached(&after, set_s)],
        elements_end: [&before, &after].into_iter().flatten().any(|s| s.elements_end && s.crossing_s.is_none()),
        rise,
        culmination,
        set,
        inside,
    })
}

/// Follows the satellite from the end of the window at `edge_s`, into the past (`way` -1) or the future (1), until it
/// is below the smallest altitude.
fn outward(search: &Search, edge_s: f64, way: f64) -> Result<Side> {
    let step_s = search.tracker.safe_step_s();
    let reach_s = REACH_S.max(REACH_PERIODS * search.tracker.longest_period_s());
    let edge = search.node(edge_s)?;
    let mut side = Side { crossing_s: None, top: edge, reached_s: edge_s, elements_end: false };
    // one step into the window, so that a turn at its end is seen; elements may not reach there
    let mut last = [search.node(edge_s - way * step_s).unwrap_or(edge), edge];
    while (side.reached_s - edge_s).abs() < reach_s {
        let Ok(next) = search.node(last[1].0 + way * step_s) else {
            side.elements_end = true;
            return Ok(side);
        };
        let [a, b] = last;
        if let Some(sign) = turns(a.1, b.1, next.1) {
            let (lo, hi) = if way > 0.0 { (a.0, next.0) } else { (next.0, a.0) };
            let turn = search.turning_point(lo, hi, sign)?;
            if turn.1 > side.top.1 {
                side.top = turn;
            }
            // a dip below the limit between two samples above it
            if turn.1 < 0.0 && a.1 >= 0.0 && (turn.0 - edge_s) * way > 0.0 {
                let above = if (turn.0 - b.0) * way > 0.0 { b } else { a };
                side.crossing_s = Some(search.crossing(turn, above)?);
                return Ok(side);
            }
        }
        if next.1 > side.top.1 {
            side.top = next;
        }
        if next.1 < 0.0 {
            side.crossing_s = Some(search.crossing(next, b)?);
            return Ok(side);
        }
        side.reached_s = next.0;
        last = [b, next];
    }
    Ok(side)
}

/// 1 where the middle of three samples is a maximum, -1 where it is a minimum.
fn turns(a: f64, b: f64, c: f64) -> Option<f64> {
    if b >= a && b > c {
        Some(1.0)
    } else if b <= a && b < c {
        Some(-1.0)
    } else {
        None
    }
}
