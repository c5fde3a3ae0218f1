//! The place of a detection against the other frames of the pass: what one frame alone shows may be a cosmic ray, another
//! satellite or a star, and not the target.
//!
//! Pixels of the full frame. A tracked target stands still, or drifts along a line. A detection that any other of the pass agrees
//! with is not judged, unless frames between the two show the target elsewhere: of two sources one is not the target. None is where most
//! frames show a target that stands at no common place: the tracking wanders.

use super::Finding;
use super::neighbours::seconds_between;
use crate::photometry::Flags;
use crate::photometry::pass::place::{Detection, PassPlace};
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Fewest frames of a pass that say anything of one of them.
const FEWEST: usize = 5;
/// Detections no further apart than this are of one object \[FWHM\], or than the aperture reaches.
const APART_FWHM: f64 = 4.0;
/// Nor than so many times the jitter of the tracking.
const JITTERS: f64 = 5.0;
/// Share of the frames with a detection from which one without a companion is the target all the same, if the others agree on no place.
const MOST_LONE: f64 = 0.5;

/// A detection of a pass.
struct Seen {
    /// Its place among the rows.
    k: usize,
    detection: Detection,
    /// What is no further away is the same object \[px\].
    reach_px: f64,
    fwhm_px: f64,
    is_rejected: bool,
}

impl Seen {
    fn of(k: usize, row: &PhotometryRow, t_s: f64) -> Option<Self> {
        let (x_px, y_px, fwhm_px) = (row.x_px?, row.y_px?, row.fwhm_px?);
        let is_rejected = row.verdict == Verdict::Reject;
        let is_known = row.status == Status::Ok && x_px.is_finite() && y_px.is_finite() && fwhm_px > 0.0;
        let aper_px = row.aper_a_px.or(row.aper_r_px).unwrap_or(0.0);
        let detection = Detection { t_s, x_px, y_px, err_px: fwhm_px / row.snr?.max(1.0) };
        is_known.then_some(Self { k, detection, reach_px: aper_px.max(APART_FWHM * fwhm_px), fwhm_px, is_rejected })
    }

    fn distance_px(&self, (x, y): (f64, f64)) -> f64 {
        (self.detection.x_px - x).hypot(self.detection.y_px - y)
    }
}

/// Detections of a pass that stand alone. `rows` are in order of time.
pub(super) fn findings(rows: &[&PhotometryRow]) -> Vec<(usize, Finding)> {
    let looked_at = rows.iter().filter(|r| r.status == Status::Ok || r.status == Status::Nondetection).count();
    let Some(first) = rows.first().filter(|_| looked_at >= FEWEST) else { return Vec::new() };
    let seen: Vec<Seen> =
        rows.iter().enumerate().filter_map(|(k, r)| Seen::of(k, r, seconds_between(first, r))).collect();
    let detections: Vec<Detection> = seen.iter().filter(|s| !s.is_rejected).map(|s| s.detection).collect();
    let place = seen.first().and_then(|s| PassPlace::of_detections(&detections, s.fwhm_px));
    if place.is_none() && seen.len() as f64 >= MOST_LONE * looked_at as f64 {
        return Vec::new();
    }
    let is_at = |s: &Seen, place: &PassPlace| {
        s.distance_px(place.at(s.detection.t_s)) < s.reach_px.max(JITTERS * place.jitter_px)
    };
    let judge = |s: &Seen| {
        let is_here = |o: &&Seen| s.distance_px((o.detection.x_px, o.detection.y_px)) < s.reach_px;
        let here: Vec<usize> = seen.iter().filter(is_here).map(|o| o.k).collect();
        let (first, last) = (*here.first()?, *here.last()?);
        // the telescope may have been moved, but not to and fro
        let is_in_turn = |place: &PassPlace| seen.iter().any(|o| (first..last).contains(&o.k) && is_at(o, place));
        if here.len() > 1 && !place.as_ref().is_some_and(is_in_turn) {
            return None;
        }
        let words = match &place {
            Some(place) if is_at(s, place) => return None,
            Some(place) => {
                let away_px = s.distance_px(place.at(s.detection.t_s));
                let away_fwhm = away_px / s.fwhm_px;
                format!(
                    "stands {away_px:.0} px ({away_fwhm:.0} FWHM) from where the other frames of the pass show the target: perhaps another \
                     object (unconfirmed)"
                )
            }
            None => format!(
                "no other of the {looked_at} frames of the pass shows anything at this place: perhaps not the target (unconfirmed)"
            ),
        };
        Some((s.k, Finding::caution(Flags::UNCONFIRMED, words)))
    };
    seen.iter().filter_map(judge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(k: usize, place: Option<(f64, f64)>) -> PhotometryRow {
        PhotometryRow {
            mjd_mid_d: Some(60_000.0 + k as f64 / 86_400.0),
            status: if place.is_some() { Status::Ok } else { Status::Nondetection }.into(),
            x_px: place.map(|p| p.0),
            y_px: place.map(|p| p.1),
            snr: place.map(|_| 8.0),
            fwhm_px: Some(3.0),
            aper_r_px: place.map(|_| 6.0),
            ..PhotometryRow::default()
        }
    }

    fn found(places: &[Option<(f64, f64)>]) -> Vec<usize> {
        let rows: Vec<PhotometryRow> = places.iter().enumerate().map(|(k, p)| row(k, *p)).collect();
        let found = findings(&rows.iter().collect::<Vec<_>>());
        assert!(found.iter().all(|(_, f)| f.flags == Flags::UNCONFIRMED && f.words.ends_with("(unconfirmed)")));
        found.into_iter().map(|(k, _)| k).collect()
    }

    const NONE: [usize; 0] = [];

    #[test]
    fn what_stands_elsewhere_than_in_the_other_frames_is_unconfirmed() {
        let at = |x: f64| Some((100.0 + x, 100.0));
        assert_eq!(found(&[at(0.0), at(0.5), at(40.0), at(-0.5), None, at(0.2)]), [2]);
        assert_eq!(found(&[at(0.0), at(0.5), at(9.0), at(-0.5), None, at(0.2)]), NONE, "three FWHM: a gust");
        // the telescope was moved within the pass
        assert_eq!(found(&[at(0.0), at(0.5), at(0.3), at(-0.5), at(0.1), at(40.0), at(40.5)]), NONE);
        // moved, and moved back
        assert_eq!(found(&[at(0.0), at(0.5), at(40.3), at(39.5), at(0.1), at(0.2), at(0.5)]), NONE);
        // two sources, now one and now the other
        assert_eq!(found(&[at(0.0), at(40.5), at(0.3), at(39.5), at(0.1), at(0.2), at(0.5)]), [1, 3]);
        // a drift of 10 px from frame to frame, and one that is not on it
        let drifting: Vec<_> = (0..12).map(|k| at(10.0 * f64::from(k))).collect();
        assert_eq!(found(&drifting), NONE);
        let other: Vec<_> =
            (0..12).map(|k| if k == 5 { Some((150.0, 160.0)) } else { at(10.0 * f64::from(k)) }).collect();
        assert_eq!(found(&other), [5]);
    }

    #[test]
    fn a_detection_that_nothing_confirms_is_found_and_a_wandering_target_is_not() {
        let at = |k: i32| Some((100.0 + f64::from(k * 37 % 90), 100.0 + f64::from(k * 53 % 80)));
        assert_eq!(found(&[None, None, at(1), None, None, None]), [2]);
        assert_eq!(found(&[None, at(1), None, None, None, at(4), None, None]), [1, 5]);
        assert_eq!(found(&[None, at(1), None, at(1), None, None]), NONE, "twice at one place");
        assert_eq!(found(&[at(1), at(2), at(3), at(4), at(5), None, at(6)]), NONE);
        assert_eq!(found(&[None, at(1), None, None]), NONE, "too few frames to say");
        assert_eq!(found(&[]), NONE);
    }

    #[test]
    fn an_outline_that_reaches_the_place_is_the_target() {
        let at = |x: f64| Some((100.0 + x, 100.0));
        let mut rows: Vec<PhotometryRow> = (0..6).map(|k| row(k, at(if k == 3 { 40.0 } else { 0.0 }))).collect();
        (rows[3].aper_r_px, rows[3].aper_a_px) = (None, Some(50.0));
        assert!(findings(&rows.iter().collect::<Vec<_>>()).is_empty());
    }
}
