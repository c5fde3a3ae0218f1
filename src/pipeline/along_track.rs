//! How far the targets of a night are ahead of their elements along the track, by the star trails: a wrong clock, or old elements.
//!
//! Seconds, positive = ahead: header times are then too early by as much, or the satellite has gained on its elements. It does
//! not cover frames without trail ends, which say nothing along the track.

use crate::base::stats;
use crate::tables::PhotometryRow;

/// Fewest frames.
const LEAST_FRAMES: usize = 3;
/// The offset is reported beyond this many of its errors.
const SIGNIFICANT_SIGMA: f64 = 4.0;
/// What a night's frames share in their places along the track \[s\]: the places of stars, UT1 - UTC, and the rest of the reduction of
/// elements to places; nights of a generator that shares nothing with satphot are off by 0.0013 s.
const SHARED_ERR_S: f64 = 0.002;
/// Offsets further from the median are excluded \[robust σ\].
const CLIP_SIGMA: f64 = 4.0;

/// Time by which the targets are ahead of their elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ahead {
    /// Weighted mean \[s\].
    pub ahead_s: f64,
    /// Its error: what the frames state and scatter by, and what they share \[s\].
    pub err_s: f64,
    /// Frames behind it.
    pub n_frames: usize,
}

/// The common offset along the track, Σ w Δt / Σ w with Δt = offset / rate; `None` with fewer than three frames that measure it.
#[must_use]
pub fn ahead_of_elements(rows: &[PhotometryRow]) -> Option<Ahead> {
    let of = |row: &PhotometryRow| {
        let rate_arcsec_s = row.rate_deg_s.filter(|r| *r > 0.0)? * 3600.0;
        Some((row.along_oc_arcsec? / rate_arcsec_s, row.along_oc_err_arcsec? / rate_arcsec_s))
    };
    let all: Vec<(f64, f64)> = rows.iter().filter_map(of).collect();
    let middle = stats::median(&mut all.iter().map(|a| a.0).collect::<Vec<_>>())?;
    let scatter = stats::mad_sigma(&mut all.iter().map(|a| a.0).collect::<Vec<_>>())?;
    let kept = all.iter().filter(|(dt, err)| (dt - middle).abs() <= CLIP_SIGMA * scatter.max(*err));
    let kept: Vec<&(f64, f64)> = kept.collect();
    if kept.len() < LEAST_FRAMES {
        return None;
    }
    let weight = |err: f64| 1.0 / (err * err + scatter * scatter).max(1e-18);
    let sum: f64 = kept.iter().map(|(_, err)| weight(*err)).sum();
    let ahead_s = kept.iter().map(|(dt, err)| dt * weight(*err)).sum::<f64>() / sum;
    Some(Ahead { ahead_s, err_s: sum.sqrt().recip().hypot(SHARED_ERR_S), n_frames: kept.len() })
}

/// A word on an offset along the track that is not chance.
#[must_use]
pub fn along_track_note(rows: &[PhotometryRow]) -> Option<String> {
    let Ahead { ahead_s, err_s, n_frames } = ahead_of_elements(rows)?;
    let (way, clock) = if ahead_s > 0.0 { ("ahead of", "early") } else { ("behind", "late") };
    (ahead_s.abs() > SIGNIFICANT_SIGMA * err_s).then(|| {
        format!(
            "warning: by the star trails of {n_frames} frames the target is {:.3} +- {err_s:.3} s {way} its elements \
             (along_oc_arcsec): the times of the headers are too {clock} by as much (time.offset_s), or the elements are old",
            ahead_s.abs()
        )
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn row(dt_s: f64, rate_deg_s: f64, err_arcsec: f64) -> PhotometryRow {
        PhotometryRow {
            rate_deg_s: Some(rate_deg_s),
            along_oc_arcsec: Some(dt_s * rate_deg_s * 3600.0),
            along_oc_err_arcsec: Some(err_arcsec),
            ..PhotometryRow::default()
        }
    }

    #[test]
    fn frames_of_any_rate_agree_on_the_time_and_a_wild_one_has_no_say() {
        let mut rows: Vec<PhotometryRow> =
            (0..9).map(|k| row(-0.25 + 0.001 * f64::from(k % 3 - 1), 0.2 + 0.1 * f64::from(k), 2.0)).collect();
        rows.push(row(3.0, 0.5, 2.0));
        rows.push(PhotometryRow::default());
        let found = ahead_of_elements(&rows).unwrap();
        assert!(
            (found.ahead_s + 0.25).abs() < 0.001
                && (found.err_s.powi(2) - SHARED_ERR_S.powi(2)).sqrt() < 0.002
                && found.n_frames == 9,
            "{found:?}"
        );
        assert!(along_track_note(&rows).unwrap().contains("behind its elements"));
        assert_eq!(ahead_of_elements(&rows[..2]), None);
        let none: Vec<PhotometryRow> = (0..9).map(|k| row(0.01 * f64::from(k - 4), 0.5, 20.0)).collect();
        assert_eq!(along_track_note(&none), None);
    }
}
