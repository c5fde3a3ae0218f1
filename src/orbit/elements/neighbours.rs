//! Sets of one object that cannot all be true: each is propagated to its neighbour's epoch and compared.
//!
//! km and degrees. A checksum detects typing errors, not invented orbits. The plane of an orbit is the judge: drag,
//! burns and raising move a satellite along its path by hundreds of km within days, but do not tilt its plane.

use std::fmt;

use super::set::Elements;
use crate::base::vector::{Teme, Vector};
use crate::orbit::propagate::Propagator;
use crate::orbit::time::utc_text;

/// Sets farther apart in time than this are not compared \[d\].
const SPAN_D: f64 = 14.0;
/// No satellite tilts its plane by this much within [`SPAN_D`] \[deg\]: raised by 100 km, the node of a low orbit
/// drifts by 2 degrees.
const TILT_DEG: f64 = 5.0;
/// Apart by this much within [`FAR_SPAN_D`], the observer is reported \[km\]: drag alone stays below 100 km, a reboost
/// may not.
const FAR_KM: f64 = 500.0;
/// The span of that comparison \[d\].
const FAR_SPAN_D: f64 = 5.0;

/// What the neighbours in time say about one set.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Standing {
    /// They agree, or there are none.
    Good,
    /// They put the satellite elsewhere along its path: a burn, or one of them is wrong.
    Doubted(String),
    /// It and its only neighbour lie in different planes: one of them is wrong.
    Disputed(String),
    /// Its neighbours agree with each other or with others, and not with it.
    Refuted(String),
}

/// How far two sets are from each other at the epoch of the first.
struct Gap {
    tilt_deg: f64,
    apart_km: f64,
    apart_d: f64,
    with: usize,
}

impl Gap {
    fn tilted(&self) -> bool {
        self.tilt_deg > TILT_DEG
    }
}

/// The standing of each set of one object, in order of epoch.
pub(crate) fn standings(sets: &[Elements], propagators: &[Propagator]) -> Vec<Standing> {
    let gaps: Vec<Vec<Gap>> = (0..sets.len()).map(|i| gaps(i, sets, propagators)).collect();
    // A set that agrees in plane with somebody is supported.
    let mut supported: Vec<bool> = gaps.iter().map(|own| own.iter().any(|g| !g.tilted())).collect();
    gaps.iter().flatten().filter(|g| !g.tilted()).for_each(|g| supported[g.with] = true);
    (0..sets.len())
        .map(|i| {
            let text = |gap: &Gap| GapReport { set: &sets[i], other: &sets[gap.with], gap }.to_string();
            match gaps[i].iter().find(|g| g.tilted()) {
                Some(gap) if supported[i] && !supported[gap.with] => Standing::Good,
                Some(gap) if !supported[i] && supported[gap.with] => Standing::Refuted(text(gap)),
                Some(gap) => Standing::Disputed(text(gap)),
                None => gaps[i]
                    .iter()
                    .find(|g| g.apart_km > FAR_KM && g.apart_d <= FAR_SPAN_D)
                    .map_or(Standing::Good, |g| Standing::Doubted(text(g))),
            }
        })
        .collect()
}

/// The gaps to up to two sets before and two after, none farther than [`SPAN_D`].
fn gaps(i: usize, sets: &[Elements], propagators: &[Propagator]) -> Vec<Gap> {
    let epoch = sets[i].epoch();
    let Ok(here) = propagators[i].state(&epoch) else { return Vec::new() };
    (i.saturating_sub(2)..(i + 3).min(sets.len()))
        .filter(|&j| j != i && sets[j].age_d(&epoch).abs() <= SPAN_D)
        .filter_map(|j| {
            let there = propagators[j].state(&epoch).ok()?;
            let normal = |(r, v): &(Vector<Teme>, Vector<Teme>)| r.cross(v);
            let (a, b) = (normal(&here), normal(&there));
            let tilt_rad = a.cross(&b).norm().atan2(a.dot(&b));
            Some(Gap {
                tilt_deg: tilt_rad.to_degrees(),
                apart_km: (here.0 - there.0).norm(),
                apart_d: sets[j].age_d(&epoch).abs(),
                with: j,
            })
        })
        .collect()
}

struct GapReport<'a> {
    set: &'a Elements,
    other: &'a Elements,
    gap: &'a Gap,
}

impl fmt::Display for GapReport<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "elements of {} at {} and at {} put the satellite {:.0} km apart, in planes {:.1} deg apart",
            self.set.label(),
            utc_text(&self.set.epoch()),
            utc_text(&self.other.epoch()),
            self.gap.apart_km,
            self.gap.tilt_deg
        )
    }
}
