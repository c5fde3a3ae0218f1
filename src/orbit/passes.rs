//! When the satellite is up inside a window of time: its stays above a smallest altitude, cut by the window.
//!
//! The whole pass of each, beyond the window, is in [`super::whole_pass`].
//!
//! Radians and km; times to better than 0.01 s. Geometric altitudes. No brightness and no weather.

use crate::base::search::{Until, bisect, golden_section};
use hifitime::{Epoch, Unit};

use super::geometry::Geometry;
use super::time::{days_between, utc_text};
use super::tracker::Tracker;
use crate::base::error::{Error, Result};

/// Most samples of one search: 100 days of a low orbit in a second of computing; longer windows are to be split.
const MAX_SAMPLES: f64 = 5e6;
/// Rise and set are refined to this \[s\].
const TIME_TOLERANCE_S: f64 = 0.001;

/// One moment of a pass.
#[derive(Debug, Clone)]
pub struct PassEvent {
    /// The moment.
    pub epoch: Epoch,
    /// Altitude \[rad\].
    pub alt_rad: f64,
    /// Azimuth \[rad\].
    pub az_rad: f64,
    /// Range \[km\].
    pub range_km: f64,
    /// Altitude of the Sun \[rad\].
    pub sun_alt_rad: f64,
    /// Altitude of the Moon \[rad\].
    pub moon_alt_rad: f64,
    /// The rest of the geometry, for the light class and the model.
    pub geometry: Geometry,
}

/// One stay above the smallest altitude.
#[derive(Debug, Clone)]
pub struct Pass {
    /// Where it comes up; the start of the window if `starts_before`.
    pub rise: PassEvent,
    /// Its highest point inside the window, an end of the window where the pass is cut before or after it culminates.
    pub culmination: PassEvent,
    /// Where it goes down; the end of the window if `ends_after`.
    pub set: PassEvent,
    /// It was up already when the window began.
    pub starts_before: bool,
    /// It is still up when the window ends.
    pub ends_after: bool,
}

/// Every stay above `min_alt_rad` between `start` and `end`, in order of time.
///
/// The altitude is sampled at a share of the period; every local maximum and minimum between samples is refined, so a
/// grazing pass shorter than a step is found; rise and set are bisected to 1 ms. A satellite that never sets gives one
/// pass, cut by the window on both sides.
///
/// # Errors
/// [`Error::Orbit`] if the window is empty or too long, or the elements fail anywhere in it.
///
/// ```
/// use satphot::{Site, Tracker, passes};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let elements = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
/// 2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";
/// let tracker = Tracker::from_text(elements, Site::new(-33.7703, 151.1113, 70.0)?)?;
/// let (start, end) = ("2025-06-09T10:00:00 UTC".parse()?, "2025-06-09T11:00:00 UTC".parse()?);
/// let found = passes(&tracker, &start, &end, 10f64.to_radians())?;
/// assert_eq!(found.len(), 1);
/// assert!((found[0].culmination.alt_rad.to_degrees() - 32.1).abs() < 0.1);
/// # Ok(())
/// # }
/// ```
pub fn passes(tracker: &Tracker, start: &Epoch, end: &Epoch, min_alt_rad: f64) -> Result<Vec<Pass>> {
    stays(tracker, start, end, min_alt_rad).map(|(_, stays)| stays)
}

/// As [`passes`], with the search itself for what lies outside the window.
pub(super) fn stays<'a>(
    tracker: &'a Tracker,
    start: &'a Epoch,
    end: &Epoch,
    min_alt_rad: f64,
) -> Result<(Search<'a>, Vec<Pass>)> {
    let length_s = days_between(start, end) * 86_400.0;
    if !(length_s > 0.0 && min_alt_rad.is_finite()) {
        return Err(Error::Orbit {
            problem: format!(
                "no passes between {} and {}: the end must be after the start",
                utc_text(start),
                utc_text(end)
            ),
        });
    }
    let n = (length_s / tracker.safe_step_s()).ceil().max(2.0);
    if n > MAX_SAMPLES {
        return Err(Error::Orbit {
            problem: format!("{:.0} days are too many for one search of passes; split the window", length_s / 86_400.0),
        });
    }
    let search = Search { tracker, start, min_alt_rad };
    let found = search.passes(length_s, n as usize)?;
    Ok((search, found))
}

/// Seconds after `start`, and the height above the smallest altitude there \[rad\].
pub(super) type Node = (f64, f64);

/// A search of altitudes by seconds after `start`.
pub(super) struct Search<'a> {
    pub(super) tracker: &'a Tracker,
    start: &'a Epoch,
    min_alt_rad: f64,
}

impl Search<'_> {
    fn passes(&self, length_s: f64, n: usize) -> Result<Vec<Pass>> {
        let nodes = self.nodes(length_s, n)?;
        let mut found = Vec::new();
        let mut i = 0;
        while i < nodes.len() {
            if nodes[i].1 < 0.0 {
                i += 1;
                continue;
            }
            let first = i;
            while i + 1 < nodes.len() && nodes[i + 1].1 >= 0.0 {
                i += 1;
            }
            let last = i;
            let rise_s = if first == 0 { nodes[0].0 } else { self.crossing(nodes[first - 1], nodes[first])? };
            let set_s =
                if last + 1 == nodes.len() { nodes[last].0 } else { self.crossing(nodes[last + 1], nodes[last])? };
            let top = nodes[first..=last].iter().fold(nodes[first], |best, n| if n.1 > best.1 { *n } else { best });
            found.push(Pass {
                rise: self.event(rise_s)?,
                culmination: self.event(top.0)?,
                set: self.event(set_s)?,
                starts_before: first == 0,
                ends_after: last + 1 == nodes.len(),
            });
            i += 1;
        }
        Ok(found)
    }

    /// Samples, and between them every turning point of the altitude.
    fn nodes(&self, length_s: f64, n: usize) -> Result<Vec<Node>> {
        let time = |i: usize| length_s * i as f64 / n as f64;
        let samples = (0..=n).map(|i| self.node(time(i))).collect::<Result<Vec<_>>>()?;
        let mut nodes = samples.clone();
        for w in samples.windows(3) {
            let [a, b, c] = [w[0], w[1], w[2]];
            if b.1 >= a.1 && b.1 > c.1 {
                nodes.push(self.turning_point(a.0, c.0, 1.0)?);
            } else if b.1 <= a.1 && b.1 < c.1 {
                nodes.push(self.turning_point(a.0, c.0, -1.0)?);
            }
        }
        // A turn inside the first or the last step has a sample on one side only.
        for (lo, hi) in [(0.0, time(1)), (time(n - 1), length_s)] {
            for sign in [1.0, -1.0] {
                nodes.push(self.turning_point(lo, hi, sign)?);
            }
        }
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(nodes)
    }

    /// Golden-section search of the maximum of `sign · altitude` between two times.
    pub(super) fn turning_point(&self, lo: f64, hi: f64, sign: f64) -> Result<Node> {
        let of = |t_s: f64| Ok::<f64, Error>(sign * self.node(t_s)?.1);
        self.node(golden_section(lo, hi, Until::Length(TIME_TOLERANCE_S), of)?.0)
    }

    /// Where the altitude crosses the limit between a node below it and one above; the time returned is above.
    pub(super) fn crossing(&self, below: Node, above: Node) -> Result<f64> {
        let is_below = |t_s: f64| Ok::<bool, Error>(self.node(t_s)?.1 < 0.0);
        Ok(bisect(below.0, above.0, Until::Length(TIME_TOLERANCE_S), is_below)?[1])
    }

    pub(super) fn node(&self, t_s: f64) -> Result<Node> {
        Ok((t_s, self.tracker.altitude_at(&self.epoch(t_s))? - self.min_alt_rad))
    }

    pub(super) fn event(&self, t_s: f64) -> Result<PassEvent> {
        let geometry = self.tracker.at(&self.epoch(t_s))?;
        Ok(PassEvent {
            epoch: geometry.epoch,
            alt_rad: geometry.alt_rad,
            az_rad: geometry.az_rad,
            range_km: geometry.range_km,
            sun_alt_rad: geometry.sun_alt_rad,
            moon_alt_rad: geometry.moon_alt_rad,
            geometry,
        })
    }

    pub(super) fn epoch(&self, t_s: f64) -> Epoch {
        *self.start + t_s * Unit::Second
    }
}
