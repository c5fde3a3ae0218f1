//! The frames before and after a frame: series of one target, passes, and what the neighbours suggest for a value.
//!
//! Times in s from the first frame. A value is compared with everything its neighbours suggest, so that what changes
//! gradually (Moon, twilight, range) is not a step, however steep. It does not cover steps that last longer than a few
//! frames, which cannot be distinguished from weather.

use crate::base::stats::{mad_sigma, median};
use crate::tables::PhotometryRow;
use crate::tables::row_passes::PASS_GAP_S;
use crate::tables::words::Status;

/// Frames in a row that may be astray together.
const MOST_IN_A_ROW: usize = 3;
/// Neighbours on each side that a line goes through.
const LINE: usize = 3;
/// Neighbours on each side whose median is one suggestion.
const EACH_SIDE: usize = 5;
/// Fewest neighbours that can judge a frame.
const FEWEST: usize = 4;
/// Departures must stand out of their own scatter by this many σ.
const STANDS_OUT_SIGMA: f64 = 5.0;
/// Fewest values whose scatter is used: three frames astray in a row bend five of their places.
const FEWEST_FOR_SCATTER: usize = 16;

/// Indices of the frames of each target in order of time. Frames without a time, and those whose time is impossible, are
/// in none.
pub(super) fn targets(rows: &[&PhotometryRow]) -> Vec<Vec<usize>> {
    let key = |i: usize| -> (Option<i64>, &str) {
        let row = rows[i];
        (row.norad_cat_id, if row.norad_cat_id.is_some() { "" } else { &row.object_name })
    };
    let timed = |i: &usize| rows[*i].mjd_mid_d.is_some_and(f64::is_finite) && rows[*i].status != Status::Rejected;
    let mut order: Vec<usize> = (0..rows.len()).filter(timed).collect();
    order.sort_by(|&a, &b| {
        let by_time = mjd(rows[a]).total_cmp(&mjd(rows[b]));
        key(a).cmp(&key(b)).then(by_time).then_with(|| rows[a].frame.cmp(&rows[b].frame))
    });
    order.chunk_by(|&a, &b| key(a) == key(b)).map(<[usize]>::to_vec).collect()
}

/// One target's frames without a gap longer than [`PASS_GAP_S`].
pub(super) fn passes(rows: &[&PhotometryRow], target: &[usize]) -> Vec<Vec<usize>> {
    let near = |a: &usize, b: &usize| seconds_between(rows[*a], rows[*b]) <= PASS_GAP_S;
    target.chunk_by(near).map(<[usize]>::to_vec).collect()
}

fn mjd(row: &PhotometryRow) -> f64 {
    row.mjd_mid_d.unwrap_or(f64::NAN)
}

/// Mid-exposure to mid-exposure \[s\].
pub(super) fn seconds_between(earlier: &PhotometryRow, later: &PhotometryRow) -> f64 {
    (mjd(later) - mjd(earlier)) * 86_400.0
}

/// A value per frame of a pass, in order of time.
#[derive(Clone)]
pub(super) struct Series {
    /// Times from the first frame of the pass \[s\].
    pub times_s: Vec<f64>,
    /// The values; `None` = not measured, or no longer used.
    pub values: Vec<Option<f64>>,
}

impl Series {
    /// From the rows of a pass.
    pub fn of(rows: &[&PhotometryRow], value: impl Fn(&PhotometryRow) -> Option<f64>) -> Self {
        let first = rows.first().copied();
        let times_s = rows.iter().map(|r| first.map_or(0.0, |first| seconds_between(first, r))).collect();
        Self { times_s, values: rows.iter().map(|r| value(r).filter(|v| v.is_finite())).collect() }
    }

    /// How far each of the values `from..to` lies outside of what their neighbours suggest: above the highest (positive) or
    /// below the lowest (negative); 0 in between. Empty if a value is missing or the neighbours are too few or
    /// on one side alone: an extrapolation judges nobody.
    ///
    /// Suggested are the next value on each side, the robust line through three on each side, and the median of all up
    /// to five away: a slope, a bend or a turn between the sides is inside of them, a step for some frames is not.
    pub fn departures(&self, from: usize, to: usize) -> Vec<f64> {
        let known = |k: usize| self.values[k].map(|v| (self.times_s[k], v));
        let before: Vec<(f64, f64)> = (0..from).rev().filter_map(known).take(EACH_SIDE).collect();
        let after: Vec<(f64, f64)> = (to..self.values.len()).filter_map(known).take(EACH_SIDE).collect();
        let inside: Vec<(f64, f64)> = (from..to).map_while(known).collect();
        let judges = !before.is_empty() && !after.is_empty() && before.len() + after.len() >= FEWEST;
        if inside.len() < to - from || !judges {
            return Vec::new();
        }
        let middle = median(&mut before.iter().chain(&after).map(|p| p.1).collect::<Vec<f64>>());
        let level = [before.first().map(|p| p.1), after.first().map(|p| p.1), middle];
        let outside = |&(t, value): &(f64, f64)| {
            let line = |side: &[(f64, f64)]| line_at(&side[..side.len().min(LINE)], t);
            let suggested = level.into_iter().chain([line(&before), line(&after)]).flatten();
            let (low, high) = suggested.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            (value - high).max(0.0) + (value - low).min(0.0)
        };
        inside.iter().map(outside).collect()
    }

    /// Scatter of a value about the mean of its two neighbours, robust; `None` from too few values.
    fn scatter(&self) -> Option<f64> {
        let known: Vec<f64> = self.values.iter().flatten().copied().collect();
        let mut bends: Vec<f64> = known.windows(3).map(|w| w[1] - 0.5 * (w[0] + w[2])).collect();
        // a value and half of two others: 1 + 2/4 times the variance of one
        (bends.len() + 2 >= FEWEST_FOR_SCATTER).then(|| mad_sigma(&mut bends)).flatten().map(|s| s / 1.5f64.sqrt())
    }

    /// The frames that depart so far that `limit(frame, departure)` holds and stand out of the scatter, each with its
    /// departure, in order of time: single ones and up to three in a row. The clearest is found first and no longer
    /// counts as a neighbour of the others.
    pub fn steps(mut self, limit: impl Fn(usize, f64) -> bool) -> Vec<(usize, f64)> {
        let floor = STANDS_OUT_SIGMA * self.scatter().unwrap_or(0.0);
        let n = self.values.len();
        let mut found: Vec<(usize, f64)> = Vec::new();
        loop {
            let mut best: Option<(f64, usize, Vec<f64>)> = None;
            for (from, many) in (0..n).flat_map(|from| (1..=MOST_IN_A_ROW).map(move |many| (from, many))) {
                let departures = if from + many <= n { self.departures(from, from + many) } else { Vec::new() };
                let least = departures.iter().map(|d| d.abs()).fold(f64::INFINITY, f64::min);
                let one_sign = departures.iter().all(|d| *d < 0.0) || departures.iter().all(|d| *d > 0.0);
                let all = departures.iter().enumerate().all(|(k, d)| limit(from + k, *d));
                let clearer = best.as_ref().is_none_or(|(score, ..)| least > *score);
                if !departures.is_empty() && one_sign && all && least > floor && clearer {
                    best = Some((least, from, departures));
                }
            }
            let Some((_, from, departures)) = best else { break };
            for (k, departure) in departures.into_iter().enumerate() {
                self.values[from + k] = None;
                found.push((from + k, departure));
            }
        }
        found.sort_by_key(|(i, _)| *i);
        found
    }
}

/// The line of median slope and median offset (Theil 1950, Sen 1968) at a time; `None` without a point.
fn line_at(points: &[(f64, f64)], t: f64) -> Option<f64> {
    let mut slopes: Vec<f64> = Vec::new();
    for (k, a) in points.iter().enumerate() {
        slopes.extend(points[k + 1..].iter().filter(|b| b.0 != a.0).map(|b| (b.1 - a.1) / (b.0 - a.0)));
    }
    let slope = median(&mut slopes).unwrap_or(0.0);
    median(&mut points.iter().map(|p| p.1 + slope * (t - p.0)).collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: &[f64]) -> Series {
        Series {
            times_s: (0..values.len()).map(|i| 5.0 * i as f64).collect(),
            values: values.iter().map(|v| Some(*v)).collect(),
        }
    }

    #[test]
    fn a_gradual_change_is_no_step_however_steep_and_a_dip_of_three_frames_is_found_whole() {
        let steep: Vec<f64> = (0..30).map(|i| (0.3 * f64::from(i)).exp()).collect();
        assert!((1..29).all(|i| series(&steep).departures(i, i + 1) == [0.0]), "between its neighbours");
        // the sky of a pass, lowest at its culmination, half a minute between frames
        let valley = [5.56, 5.34, 5.06, 4.81, 4.73, 4.84, 5.07, 5.30, 5.53];
        assert!(series(&valley).steps(|_, d| d.abs() > 0.1).is_empty());
        let mut dip = vec![1.0; 20];
        dip[8..11].fill(0.8);
        let found = series(&dip).steps(|_, d| d.abs() > 0.05);
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [8, 9, 10]);
        assert!(found.iter().all(|f| (f.1 + 0.2).abs() < 1e-12));
        assert!(series(&[1.0, 1.0, 0.2, 1.0]).steps(|_, d| d.abs() > 0.05).is_empty(), "too few neighbours");
    }

    #[test]
    fn the_robust_line_goes_through_a_straight_series_with_a_third_of_it_astray() {
        let points: Vec<(f64, f64)> =
            (0..9).map(|i| (f64::from(i), if i % 3 == 1 { 99.0 } else { 2.0 * f64::from(i) - 7.0 })).collect();
        assert!((line_at(&points, 20.0).unwrap() - 33.0).abs() < 1e-12);
        assert!(line_at(&[], 0.0).is_none());
    }
}
