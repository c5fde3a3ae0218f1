//! The size of the target against its size in the other frames of the pass: smear by the mount or the rotator; and that of its
//! aperture, which against the light in it shows a star trail or a neighbour also where most frames of the pass have one.
//!
//! In units of the FWHM. A target of true size K at range R shows `e² = 1 + (K/R)²`; K is the median over the pass, so a
//! resolved station is its own measure. It does not cover a pass smeared in most of its frames, which looks like a large
//! target, and the turning of a body within a pass, for which the threshold leaves room.

use super::Finding;
use crate::base::stats::median;
use crate::config::Vetting;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Fewest frames of a pass that determine the size of its target.
const FEWEST: usize = 4;
/// Nothing in orbit is larger than this: three times the length of the ISS \[m\].
const LARGEST_M: f64 = 330.0;
/// A smear of a tracked target is taken to be no longer than this \[FWHM\].
const LONGEST_SMEAR_FWHM: f64 = 8.0;
/// Signal-to-noise from which the shape of the light is used: that of the moments.
const SHAPE_SNR: f64 = 15.0;
/// A target smaller than the FWHM has no shape of its own: longer than this it is smeared.
const POINT_ELONGATION: f64 = 1.5;

/// Frames of a pass in which the target, or its aperture, is longer than it should be; `margin_fwhm` is that of the apertures.
pub(super) fn findings(
    rows: &[&PhotometryRow],
    of_night: &[&PhotometryRow],
    t: &Vetting,
    margin_fwhm: f64,
) -> Vec<(usize, Finding)> {
    let mut found: Vec<(usize, Finding)> =
        rows.iter().enumerate().filter_map(|(k, r)| Some((k, no_satellite(r)?))).collect();
    for others in [smeared(rows, t), apertures(rows, of_night, t), outlines(rows, t, margin_fwhm)] {
        let of_others = others.into_iter().filter(|(k, _)| !found.iter().any(|(seen, _)| seen == k));
        found.extend(of_others.collect::<Vec<_>>());
    }
    found
}

/// Light that is longer than three times the largest satellite (the ISS, 109 m) would be at its range, and than a smear: a trail,
/// stray light or cloud.
fn no_satellite(r: &PhotometryRow) -> Option<Finding> {
    let extent = r.extent_fwhm.filter(|e| e.is_finite() && is_trusted(r) && *e > LONGEST_SMEAR_FWHM)?;
    let length_arcsec = (extent * extent - 1.0).sqrt() * r.fwhm_px? * r.pix_scale_arcsec?;
    let length_m = (length_arcsec / 3600.0).to_radians() * r.range_km? * 1e3;
    (length_m > LARGEST_M).then(|| Finding {
        verdict: Verdict::Reject,
        flags: Flags::CONTAMINATED,
        words: format!(
            "its light is {length_m:.0} m long at this range: no satellite, but a trail, stray light or cloud (contaminated)"
        ),
    })
}

/// Frames whose outline is much longer than the light of the target, whatever the other frames of the pass show.
///
/// `(a − m FWHM) / ((e + 1) FWHM)`: half the aperture's length without its margin m, over the length e of the light, which follows
/// the target, and a star.
fn outlines(rows: &[&PhotometryRow], t: &Vetting, margin_fwhm: f64) -> Vec<(usize, Finding)> {
    let judge = |(k, r): (usize, &&PhotometryRow)| -> Option<(usize, Finding)> {
        let extent = r.extent_fwhm.filter(|e| e.is_finite() && is_trusted(r) && is_outlined(r))?;
        let outline_fwhm = length(r)? / r.fwhm_px? - margin_fwhm;
        let ratio = outline_fwhm / (extent + 1.0);
        (ratio > t.outline_caution).then(|| {
            let words = format!(
                "the aperture reaches {:.0} FWHM, its light is {extent:.1} FWHM long: {ratio:.1} times a star more \
                 (vetting.outline_caution {}), a star trail or a neighbour is in it (contaminated)",
                outline_fwhm + margin_fwhm,
                t.outline_caution
            );
            (k, Finding::caution(Flags::CONTAMINATED, words))
        })
    };
    rows.iter().enumerate().filter_map(judge).collect()
}

/// Half the length of the aperture of a detection \[px\].
fn length(r: &PhotometryRow) -> Option<f64> {
    r.aper_a_px.or(r.aper_r_px).filter(|_| r.status == Status::Ok)
}

/// Whether its aperture is that of an outline, not the circle of a compact target.
fn is_outlined(r: &PhotometryRow) -> bool {
    !matches!(r.source_kind.as_str(), "point" | "compact")
}

/// Whether its shape is that of light, not of noise.
fn is_trusted(r: &PhotometryRow) -> bool {
    r.status == Status::Ok && r.snr.is_some_and(|snr| snr >= SHAPE_SNR)
}

/// Frames whose aperture is longer than in the pass, or than in all passes of the night where the pass has too few frames.
///
/// An aperture holds the target and a margin, so its length is at most that of the median frame times the ratio of the ranges.
/// The circle of a compact target, two FWHM, tells how long the others may be and is itself not judged.
fn apertures(rows: &[&PhotometryRow], of_night: &[&PhotometryRow], t: &Vetting) -> Vec<(usize, Finding)> {
    let enough = rows.iter().filter(|r| length(r).is_some()).count() >= FEWEST;
    let others = if enough { rows } else { of_night };
    let mut lengths: Vec<f64> = others.iter().filter_map(|r| length(r)).collect();
    let mut ranges: Vec<f64> = others.iter().filter(|r| length(r).is_some()).filter_map(|r| r.range_km).collect();
    if lengths.len() < FEWEST {
        return Vec::new();
    }
    let Some(usual_px) = median(&mut lengths) else { return Vec::new() };
    let usual_km = median(&mut ranges);
    let judge = |(k, r): (usize, &&PhotometryRow)| -> Option<(usize, Finding)> {
        let nearer = usual_km.zip(r.range_km).map_or(1.0, |(usual, own)| (usual / own).max(1.0));
        let (own_px, expected_px) = (length(r).filter(|_| is_outlined(r))?, usual_px * nearer);
        (own_px > t.aperture_caution * expected_px).then(|| {
            let words = format!(
                "the aperture reaches {own_px:.0} px where the other frames let expect {expected_px:.0} (vetting.aperture_caution {}): the end \
                 of a star trail or a neighbour is in it (contaminated)",
                t.aperture_caution
            );
            (k, Finding::caution(Flags::CONTAMINATED, words))
        })
    };
    rows.iter().enumerate().filter_map(judge).collect()
}

/// Frames in which the target is longer than it should be.
fn smeared(rows: &[&PhotometryRow], t: &Vetting) -> Vec<(usize, Finding)> {
    // ranges known for all, or the size taken as constant
    let by_range = rows.iter().all(|r| r.range_km.is_some());
    let range = |r: &PhotometryRow| r.range_km.filter(|_| by_range).unwrap_or(1.0);
    let extent = |r: &PhotometryRow| r.extent_fwhm.filter(|e| e.is_finite() && is_trusted(r));
    // K = R √(e² − 1)
    let mut sizes: Vec<f64> =
        rows.iter().filter_map(|r| Some(range(r) * (extent(r)?.powi(2) - 1.0).max(0.0).sqrt())).collect();
    if sizes.len() < FEWEST {
        return Vec::new();
    }
    let Some(size) = median(&mut sizes) else { return Vec::new() };
    let judge = |(k, r): (usize, &&PhotometryRow)| -> Option<(usize, Finding)> {
        let extent = extent(r)?;
        let own = size / range(r);
        let expected = 1.0f64.hypot(own);
        let words = if extent > t.smear_caution * expected {
            format!(
                "{extent:.1} FWHM long where the pass lets expect {expected:.1} (vetting.smear_caution {}): smeared",
                t.smear_caution
            )
        } else if own < 1.0 && r.elongation.is_some_and(|e| e > POINT_ELONGATION) {
            let ratio = r.elongation.unwrap_or(f64::NAN);
            format!("a target smaller than the seeing, yet its axes are {ratio:.1} to 1: smeared")
        } else {
            return None;
        };
        Some((k, Finding::caution(Flags::SMEARED, words)))
    };
    rows.iter().enumerate().filter_map(judge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_is_longer_than_any_satellite_is_rejected_and_a_station_or_a_smear_is_not() {
        let row = |extent: f64, range_km: f64| PhotometryRow {
            status: "ok".into(),
            snr: Some(100.0),
            extent_fwhm: Some(extent),
            fwhm_px: Some(3.3),
            pix_scale_arcsec: Some(1.94),
            range_km: Some(range_km),
            ..PhotometryRow::default()
        };
        // a halo of 4 arcmin at 1700 km: 2.1 km
        let halo = no_satellite(&row(40.0, 1700.0)).unwrap();
        assert!(halo.verdict == Verdict::Reject && halo.words.starts_with("its light is 2110 m"), "{}", halo.words);
        // 109 m at 420 km are 54 arcsec, of a geostationary one seven FWHM can only be smear
        for seen in [row(8.4, 420.0), row(7.0, 38_000.0), PhotometryRow { range_km: None, ..row(40.0, 1.0) }] {
            assert!(no_satellite(&seen).is_none(), "{seen:?}");
        }
        assert!(no_satellite(&PhotometryRow { snr: Some(10.0), ..row(40.0, 1700.0) }).is_none());
    }
}
