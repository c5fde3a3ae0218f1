//! Where the header points against where the satellite stood: a frame whose OBJECT names another satellite.
//!
//! Degrees. The frames of one satellite are the measure: a header may give the position at the start of a slew, or that of a
//! mount whose model is off, but it does so for all of them. It does not cover nights whose headers give no position.

use super::Finding;
use crate::base::stats::median;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::Verdict;

/// Fewest frames with a position that are a measure.
const FEWEST: usize = 3;
/// A frame is astray from this distance on \[deg\] ...
const LEAST_DEG: f64 = 1.0;
/// ... and this many times the median of the others.
const TIMES: f64 = 10.0;

/// The distance of header and satellite \[deg\] above which a frame of these is astray: 1° and ten times the median. `None` where
/// fewer than three give a position, or where most of them are more than 1° off: then the headers say nothing.
pub(crate) fn astray<'a>(rows: impl Iterator<Item = &'a PhotometryRow>) -> Option<f64> {
    let mut seps_deg: Vec<f64> = rows.filter_map(|r| r.pointing_sep_deg).filter(|s| s.is_finite()).collect();
    if seps_deg.len() < FEWEST {
        return None;
    }
    median(&mut seps_deg).filter(|usual| *usual < LEAST_DEG).map(|usual| LEAST_DEG.max(TIMES * usual))
}

/// Frames of one satellite that point elsewhere than its others.
pub(super) fn findings(rows: &[&PhotometryRow]) -> Vec<(usize, Finding)> {
    let Some(limit_deg) = astray(rows.iter().copied()) else { return Vec::new() };
    let judge = |(k, row): (usize, &&PhotometryRow)| {
        let sep_deg = row.pointing_sep_deg.filter(|sep_deg| *sep_deg > limit_deg)?;
        let words = format!(
            "the header points {sep_deg:.1} deg from the satellite of its OBJECT, those of the other frames within {limit_deg:.1} deg: is \
             OBJECT or the time that of another frame?"
        );
        Some((k, Finding { verdict: Verdict::Reject, flags: Flags::default(), words }))
    };
    rows.iter().enumerate().filter_map(judge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(seps_deg: &[Option<f64>]) -> Vec<usize> {
        let rows: Vec<PhotometryRow> =
            seps_deg.iter().map(|s| PhotometryRow { pointing_sep_deg: *s, ..PhotometryRow::default() }).collect();
        findings(&rows.iter().collect::<Vec<_>>()).into_iter().map(|(k, _)| k).collect()
    }

    #[test]
    fn a_frame_that_points_elsewhere_than_the_others_is_found_and_a_header_that_never_follows_says_nothing() {
        assert_eq!(found(&[Some(0.01), Some(40.0), Some(0.02), None]), [1]);
        assert_eq!(found(&[Some(0.01), Some(0.9), Some(0.02)]), [0usize; 0]);
        assert_eq!(found(&[Some(0.5), Some(4.0), Some(0.5)]), [0usize; 0], "a mount that is half a degree off");
        assert_eq!(found(&[Some(20.0), Some(40.0), Some(60.0)]), [0usize; 0]);
        assert_eq!(found(&[Some(0.01), Some(40.0), None]), [0usize; 0], "two are no measure");
    }
}
