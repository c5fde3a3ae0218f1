//! What only the whole night shows of a frame: its limit by the size of the object, its verdict among its neighbours.
//!
//! Frames measured elsewhere, in whatever order and number of shards, come together here; a night on one machine as well.
//! Magnitudes, arcsec². It does not cover where the frames are from ([`super::merge`]).

use crate::base::stats::robust;
use crate::config::Config;
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::pipeline::target::outcome::TargetFrame;
use crate::pipeline::vet::{Judgement, judge_neighbours};
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};
use crate::zeropoint::previous::age_note;

/// Everything that is said of frames once all of them are measured; to be done once, to all of a night.
pub fn judge_whole_night(frames: &mut [TargetFrame], config: &Config, notes: &mut Vec<String>) {
    let rows: Vec<&PhotometryRow> = frames.iter().map(|f| &f.row).collect();
    notes.extend(age_note(rows.iter().copied()));
    let judgements = judgements(&rows, config);
    for (frame, judgement) in frames.iter_mut().zip(judgements) {
        frame.row = judgement.into_row(std::mem::take(&mut frame.row));
    }
}

/// The results of the whole night for each of its rows.
fn judgements(rows: &[&PhotometryRow], config: &Config) -> Vec<Judgement> {
    let mut judgements: Vec<Judgement> = rows.iter().map(|row| Judgement::of(row)).collect();
    limits_for_the_size_of_the_object(rows, &mut judgements);
    judge_neighbours(rows, &mut judgements, config);
    judgements
}

/// An object is larger than a star where its image is this much longer \[FWHM\].
const RESOLVED_FWHM: f64 = 1.3;

/// What makes an aperture larger than the object, or that of another.
const NOT_OF_IT: Flags = Flags(Flags::CONTAMINATED.0 | Flags::CROSSED.0);

/// Makes the limits of non-detections those of an object as large as the detected ones, where these resolve it.
///
/// A limit is that of point sources; the noise of a larger aperture grows with the root of its area:
/// Δm = −1.25 log₁₀(A_object / A_measured), with A_object the median aperture of the frames of the same object, in
/// arcsec² and scaled by (range)⁻² where the ranges are known. The aperture of a bright point source is large by its
/// brightness, and says nothing of a faint one.
fn limits_for_the_size_of_the_object(rows: &[&PhotometryRow], judgements: &mut [Judgement]) {
    let size = |r: &PhotometryRow| -> Option<f64> {
        let scale = r.pix_scale_arcsec?;
        let shape = match (r.aper_r_px, r.aper_a_px, r.aper_b_px) {
            (Some(r_px), ..) => Shape::Circle { r_px },
            (None, Some(a_px), Some(b_px)) => Shape::named(&r.aper_shape, a_px, b_px),
            _ => return None,
        };
        Some(shape.area_px() * scale * scale)
    };
    let detected: Vec<(String, f64, Option<f64>)> = rows
        .iter()
        .filter(|r| r.status == Status::Ok && r.verdict != Verdict::Reject)
        .filter(|r| r.extent_fwhm.is_some_and(|e| e > RESOLVED_FWHM) && !Flags(r.flags).any(NOT_OF_IT))
        .filter_map(|r| Some((r.object_name.clone(), size(r)?, r.range_km)))
        .collect();
    for (row, judgement) in rows.iter().zip(judgements).filter(|(r, _)| r.status == Status::Nondetection) {
        let (Some(limit), Some(measured)) = (row.limit_v_mag, size(row)) else { continue };
        let of_object: Vec<f64> = detected
            .iter()
            .filter(|(name, ..)| *name == row.object_name)
            .map(|(_, area, range)| match (range, row.range_km) {
                (Some(there), Some(here)) => area * (there / here).powi(2),
                _ => *area,
            })
            .collect();
        if let Some((area, _)) = robust(&of_object)
            && area > measured
        {
            judgement.limit_v_mag = Some(limit - 1.25 * (area / measured).log10());
            judgement.reason += &format!("; limit for an object of {area:.0} arcsec2, as in the frames that show it");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(status: &str, range_km: f64, r_px: f64) -> PhotometryRow {
        PhotometryRow {
            object_name: "ISS".into(),
            status: status.into(),
            verdict: "use".into(),
            range_km: Some(range_km),
            aper_r_px: Some(r_px),
            extent_fwhm: (status == "ok").then_some(3.0),
            pix_scale_arcsec: Some(1.5),
            limit_v_mag: (status == "nondetection").then_some(15.0),
            ..PhotometryRow::default()
        }
    }

    fn limits(rows: &[PhotometryRow]) -> Vec<Option<f64>> {
        let rows: Vec<&PhotometryRow> = rows.iter().collect();
        let mut judgements: Vec<Judgement> = rows.iter().map(|row| Judgement::of(row)).collect();
        limits_for_the_size_of_the_object(&rows, &mut judgements);
        judgements.into_iter().map(|j| j.limit_v_mag).collect()
    }

    #[test]
    fn a_limit_is_that_of_the_object_at_its_range_and_of_a_point_where_nothing_is_known() {
        // three times the radius at the same range: 1.25 log10 9 = 1.193 mag; twice as far away: 1.25 log10 (9/4)
        let rows = [row("ok", 500.0, 21.0), row("nondetection", 500.0, 7.0), row("nondetection", 1000.0, 7.0)];
        let found = limits(&rows);
        assert!((found[1].unwrap() - (15.0 - 1.25 * 9f64.log10())).abs() < 1e-12);
        assert!((found[2].unwrap() - (15.0 - 1.25 * 2.25f64.log10())).abs() < 1e-12);
        assert_eq!(limits(&[row("nondetection", 500.0, 7.0)]), [Some(15.0)]);
        let mut of_a_point = [row("ok", 500.0, 21.0), row("nondetection", 500.0, 7.0)];
        of_a_point[0].extent_fwhm = Some(1.05);
        assert_eq!(limits(&of_a_point)[1], Some(15.0));
        // an aperture that holds other light, too, is not that of the object
        for flag in [Flags::CONTAMINATED, Flags::CROSSED] {
            let mut contaminated = [row("ok", 500.0, 100.0), row("nondetection", 500.0, 7.0)];
            contaminated[0].flags = flag.0;
            assert_eq!(limits(&contaminated)[1], Some(15.0));
        }
    }
}
