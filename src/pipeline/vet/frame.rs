//! What is wrong with one frame by itself.
//!
//! Flags come from the measurement, limits from `[vetting]`. Each sentence ends with the flag's name, by which the
//! table can be searched.

use super::Finding;
use crate::config::Vetting;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Everything wrong with this frame, in the order of the light path: pixels, aperture, time, orbit, dome.
pub(super) fn findings(row: &PhotometryRow, t: &Vetting) -> Vec<Finding> {
    let mut found = pixels(row, t);
    found.extend(contamination(row, t));
    found.extend(circumstances(row, t));
    found
}

/// Saturation, edges, masked and hit pixels, the sky.
fn pixels(row: &PhotometryRow, t: &Vetting) -> Vec<Finding> {
    let flags = Flags(row.flags);
    let findings: [(Flags, Verdict, &str); 8] = [
        (Flags::SATURATED, Verdict::Reject, "saturated pixels in the aperture: light is lost (saturated)"),
        (Flags::EDGE, Verdict::Reject, "the aperture reaches over the edge of the frame (edge)"),
        (Flags::CLIP_EDGE, Verdict::Caution, "the aperture or its annulus reaches outside the clip circle (clip_edge)"),
        (Flags::HIT, Verdict::Caution, "a cosmic ray or hot pixel in the aperture (hit)"),
        (Flags::NO_ANNULUS, Verdict::Caution, "no usable sky annulus, the background mesh was taken (no_annulus)"),
        (Flags::CROSSED, Verdict::Reject, "a satellite or an aircraft crosses the target (crossed)"),
        (Flags::BLOOMING, Verdict::Reject, "nothing but charge spilt from saturated pixels stands out (blooming)"),
        (Flags::NEGATIVE, Verdict::Caution, "the net flux is not positive (negative)"),
    ];
    let mut found: Vec<Finding> = findings
        .into_iter()
        .filter(|(flag, ..)| flags.has(*flag))
        .map(|(flags, verdict, words)| Finding { verdict, flags, words: words.into() })
        .collect();
    // a non-detection has no flux to compare with, tables of older versions no share
    let share = row.masked_frac.filter(|_| row.status == Status::Ok);
    if flags.has(Flags::MASKED) && share.is_none_or(|share| share > t.masked_caution_frac) {
        let words = match share {
            Some(share) => format!(
                "masked pixels hold {:.0} % of the flux, filled from the others (masked, vetting.masked_caution_frac {})",
                100.0 * share,
                t.masked_caution_frac
            ),
            None => "masked pixels in the aperture, filled from the others (masked)".into(),
        };
        found.push(Finding::caution(Flags::MASKED, words));
    }
    if let Some(peak) = row.peak_frac_sat.filter(|p| *p > t.peak_caution_frac && !flags.has(Flags::SATURATED)) {
        let words = format!(
            "brightest pixel at {:.0} % of saturation, where the detector may no longer be linear \
             (vetting.peak_caution_frac {})",
            100.0 * peak,
            t.peak_caution_frac
        );
        found.push(Finding::caution(Flags::default(), words));
    }
    found
}

/// Light of trails and neighbours over the flux. A non-detection has no flux to compare with: only its flag speaks.
fn contamination(row: &PhotometryRow, t: &Vetting) -> Option<Finding> {
    let flags = Flags(row.flags);
    let by = if flags.has(Flags::TRAIL) { "star trail" } else { "star or neighbour" };
    let share = row.contam_frac.filter(|_| row.status == Status::Ok);
    match share {
        Some(share) if share > t.contam_caution_frac || flags.has(Flags::CONTAMINATED) => {
            let verdict = if share > t.contam_reject_frac { Verdict::Reject } else { Verdict::Caution };
            let words = format!("{by} adds {:.0} % of the flux (contaminated)", 100.0 * share);
            Some(Finding { verdict, flags: Flags::CONTAMINATED, words })
        }
        None if flags.has(Flags::CONTAMINATED) => {
            Some(Finding::caution(Flags::CONTAMINATED, format!("{by} in the aperture (contaminated)")))
        }
        _ => None,
    }
}

/// Clock, elements, altitude, dome.
fn circumstances(row: &PhotometryRow, t: &Vetting) -> Vec<Finding> {
    let flags = Flags(row.flags);
    let mut found = Vec::new();
    if flags.has(Flags::TIME_UNCERTAIN) {
        let err_s = row.time_err_s.unwrap_or(f64::NAN);
        let moved = row.rate_deg_s.map(|r| format!(", in which the target moves {:.2} deg", r * err_s));
        let words = format!("mid-exposure known to {err_s:.1} s only{} (time_uncertain)", moved.unwrap_or_default());
        found.push(Finding::caution(Flags::TIME_UNCERTAIN, words));
    }
    if let (true, Some(offset), Some(err)) =
        (flags.has(Flags::CLOUD), row.frame_zp_offset_mag, row.frame_zp_offset_err_mag)
    {
        let words = format!(
            "the stars that trail through the frame are {offset:.2} +- {err:.2} mag fainter than the zeropoint: a cloud, which \
             frame_v_mag corrects (cloud)"
        );
        found.push(Finding::caution(Flags::CLOUD, words));
    }
    if flags.has(Flags::OLD_ELEMENTS) {
        let age = row.tle_age_d.map(|d| format!("{:.1} d ", d.abs())).unwrap_or_default();
        // the light was counted whatever the elements say; without light they alone say that the target was there
        let (verdict, taints) = match Status::from_cell(&row.status) {
            Some(Status::Nondetection) => (Verdict::Caution, "the target may have been outside the search region"),
            _ => (Verdict::Use, "their error affects the geometry and the residual, not the magnitude"),
        };
        let words = format!("elements {age}old: {taints} (old_elements)");
        found.push(Finding { verdict, flags: Flags::OLD_ELEMENTS, words });
    }
    if let Some(alt) = row.alt_deg.filter(|alt| *alt < t.min_alt_deg) {
        let words = format!(
            "altitude {alt:.1} deg, lower than the dome's {} (vetting.min_alt_deg): low_altitude",
            t.min_alt_deg
        );
        found.push(Finding::caution(Flags::LOW_ALTITUDE, words));
    }
    if let Some(rate) = row.az_rate_deg_s.filter(|rate| t.dome_rate_deg_s > 0.0 && *rate > t.dome_rate_deg_s) {
        let words = format!(
            "azimuth moves {rate:.1} deg/s, faster than the dome's {} (vetting.dome_rate_deg_s): lower_limit",
            t.dome_rate_deg_s
        );
        found.push(Finding::caution(Flags::LOWER_LIMIT, words));
    }
    found
}
