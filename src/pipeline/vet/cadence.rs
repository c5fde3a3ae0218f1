//! The clock between frames: an exposure cannot begin before the one before it has ended.
//!
//! Seconds. The error of the stamps is allowed for, so that stamps of whole seconds raise no alarm by pair; over a run of
//! frames the same error weighs little. It does not cover read-out times, which only lengthen the cadence.

use std::ops::RangeInclusive;

use super::Finding;
use super::neighbours::seconds_between;
use crate::config::Vetting;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, TimeStamp};

/// Mid-exposure to mid-exposure since the frame of this target before, failed or not \[s\]; of frames that did not fail.
pub(super) fn cadences<'a>(rows: &'a [&PhotometryRow], target: &'a [usize]) -> impl Iterator<Item = (usize, f64)> + 'a {
    let spans = target.windows(2).map(|w| (w[1], seconds_between(rows[w[0]], rows[w[1]])));
    spans.filter(|(i, _)| rows[*i].status != Status::Failed)
}

/// Frames whose exposure time does not fit between them and the next.
pub(super) fn findings(rows: &[&PhotometryRow], t: &Vetting) -> Vec<(usize, Finding)> {
    let exptime = |k: usize| rows[k].exptime_s.filter(|e| e.is_finite() && *e > 0.0);
    let mut found: Vec<(usize, Finding)> = Vec::new();
    for k in 0..rows.len().saturating_sub(1) {
        let (Some(mine), Some(next)) = (exptime(k), exptime(k + 1)) else { continue };
        let spacing_s = start_to_start_s(rows, k..=k + 1);
        if spacing_s < t.cadence_min_frac * mine - clock_err_s(rows, k..=k + 1) {
            let doubted = doubted(rows[k], mine, next);
            let frame = if doubted == 0 { k } else { k + 1 };
            let words = format!(
                "{} s of exposure do not fit: {} began {spacing_s:.2} s after {} of {mine} s (exptime_doubted)",
                if doubted == 0 { mine } else { next },
                if doubted == 0 { "the next frame" } else { "it" },
                if doubted == 0 { "this one" } else { "the frame before" },
            );
            found.push((frame, Finding::caution(Flags::EXPTIME_DOUBTED, words)));
        }
    }
    for run in runs(rows) {
        let (first, last) = (*run.start(), *run.end());
        let (Some(exptime_s), true) = (exptime(first), last > first + 1) else { continue };
        let n = (last - first) as f64;
        let span_s = start_to_start_s(rows, run.clone());
        if span_s < t.cadence_min_frac * n * exptime_s - clock_err_s(rows, run.clone()) {
            let words = format!(
                "{n} exposures of {exptime_s} s would take {} s, this run of frames took {span_s:.1} s (exptime_doubted)",
                n * exptime_s
            );
            found.extend(run.map(|frame| (frame, Finding::caution(Flags::EXPTIME_DOUBTED, words.clone()))));
        }
    }
    // once per frame, the pair before the run
    found.sort_by_key(|(frame, _)| *frame); // stable
    found.dedup_by_key(|(frame, _)| *frame);
    found
}

/// From the start of the first exposure to the start of the last \[s\].
fn start_to_start_s(rows: &[&PhotometryRow], range: RangeInclusive<usize>) -> f64 {
    let (first, last) = (rows[*range.start()], rows[*range.end()]);
    let half = |r: &PhotometryRow| r.exptime_s.unwrap_or(0.0) / 2.0;
    seconds_between(first, last) + half(first) - half(last)
}

/// Error of the time between two stamps \[s\].
fn clock_err_s(rows: &[&PhotometryRow], range: RangeInclusive<usize>) -> f64 {
    let err = |r: &PhotometryRow| r.time_err_s.unwrap_or(0.0);
    err(rows[*range.start()]).hypot(err(rows[*range.end()]))
}

/// Which of two overlapping frames is wrong: 0 the earlier, 1 the later.
///
/// Where starts are stamped, the earlier one was not over; where ends are stamped, the later one began too early;
/// where neither is, the longer one.
fn doubted(earlier: &PhotometryRow, mine_s: f64, next_s: f64) -> usize {
    match TimeStamp::from_cell(&earlier.time_stamp) {
        Some(TimeStamp::Start) => 0,
        Some(TimeStamp::End) => 1,
        _ => usize::from(next_s > mine_s),
    }
}

/// Runs of frames with one exposure time.
fn runs(rows: &[&PhotometryRow]) -> Vec<RangeInclusive<usize>> {
    let mut runs: Vec<RangeInclusive<usize>> = Vec::new();
    for k in 0..rows.len() {
        match runs.last_mut() {
            Some(run) if rows[*run.end()].exptime_s == rows[k].exptime_s => *run = *run.start()..=k,
            _ => runs.push(k..=k),
        }
    }
    runs
}
