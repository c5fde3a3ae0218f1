//! The star pointings of a night: every frame measured, the profile of the stars, the rows of the zeropoint.
//!
//! Electrons and full-frame pixels in the members, magnitudes nowhere yet. It does not cover the fit
//! ([`crate::zeropoint::stars`]).

use std::borrow::Cow;

use crate::astrometry::catalogue::Catalogue;
use crate::astrometry::field_rotation::CameraTurn;
use crate::base::error::Result;
use crate::base::hash::sha256_16_text;
use crate::base::progress::Progress;
use crate::base::stats::median;
use crate::base::time::jyear;
use crate::config::{self, Combine};
use crate::frames::Exposure;
use crate::photometry::growth::{FrameGrowth, GrowthCurve, StarProfile, StarWidth};
use crate::pipeline::hot_pixels::hot_key;
use crate::pipeline::options::Options;
use crate::pipeline::ordered_map::in_order;
use crate::pipeline::prepared::{Flattened, Seeing};
use crate::pipeline::shards::products::FrameCache;
use crate::pipeline::stars::frame_check::{FrameCheck, check_frames};
use crate::pipeline::stars::pointing::{Member, combined_rows, measure_member, single_rows};
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::scale::{Evidence, MOST_FRAC, configured_arcsec, judged};
use crate::pipeline::target::frame::internal;
use crate::pipeline::target::row::{star_frame_row, without_folder};
use crate::tables::words::Status;
use crate::tables::{PhotometryRow, StarRow};

/// Kind of the products of star frames.
pub const STARS: &str = "stars";

/// The results of the star pointings.
#[derive(Debug, Default)]
pub struct StarStage {
    /// One row per star and pointing (or member).
    pub rows: Vec<StarRow>,
    /// Star frames that failed.
    pub failed: Vec<PhotometryRow>,
    /// The results of the stars that apply to every frame.
    pub seeing: Seeing,
    /// Star frames measured.
    pub n_members: usize,
    /// What each measured frame shows of its filter and camera.
    pub checks: Vec<FrameCheck>,
    /// What was measured on the way and needs no action.
    pub details: Vec<String>,
}

/// Measures every star pointing.
///
/// # Errors
/// Only what is wrong with the machine; a failed frame is a row.
pub fn star_stage(
    survey: &Survey,
    night: &Flattened,
    products: &FrameCache,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<StarStage> {
    let (Some(stars), Some(catalogue)) = (&night.config.stars, &night.catalogue) else {
        if survey.n_star_frames() > 0 {
            notes.push(format!(
                "{} star frames are not measured: there is no [stars] in the configuration",
                survey.n_star_frames()
            ));
        }
        return Ok(StarStage::default());
    };
    let exposures: Vec<&Exposure> = survey.pointings.iter().flatten().collect();
    let moved_to = moved_to(catalogue, &exposures);
    let catalogue = &of_date(catalogue, &exposures, stars.epoch_jyear, notes);
    progress.stage("star pointings", exposures.len());
    // gone since it was read, the stars that were read identify it
    let of_stars = |_| sha256_16_text(&format!("{:?}", catalogue.stars));
    let depends = [
        products.sha256(&stars.catalogue).unwrap_or_else(of_stars),
        night.flat_sha256.clone(),
        night.zero.key.clone(),
        hot_key(&night.hot),
        format!("{:?}", moved_to),
    ];
    let depends = depends.each_ref().map(String::as_str);
    let memory = options.memory();
    let measure = |exposure: &Exposure| {
        memory.holds_star_frame(night, exposure)?;
        let make = || measure_member(exposure, night, catalogue);
        let member = products.of_frame(STARS, exposure, &depends, make, |_| true).1?;
        // the time comes from the header, also for a member that was kept
        Ok(Member { mid: exposure.time.as_ref().map_or(member.mid, |t| t.mid), ..member })
    };
    let lost = |exposure: &Exposure| -> Result<Member> { Err(internal(exposure)) };
    let room = memory.star_frames(night, &exposures, options.threads());
    let kept = || {
        let n = products.count(STARS, &exposures);
        format!("{n} of {} star frames kept; run the same line again to go on", exposures.len())
    };
    let results: Vec<Result<Member>> = in_order(&exposures, room, (&options.stop, &kept), progress, measure, lost)?;
    night.buffers.clear();
    progress.done();

    let mut stage = StarStage::default();
    let scale = scale_of(&exposures, &results, night, notes)?;
    let mut results = results.into_iter();
    let mut measured: Vec<Vec<(&Exposure, Member)>> = Vec::new();
    for pointing in &survey.pointings {
        let mut members = Vec::new();
        for exposure in pointing {
            match results.next() {
                Some(Ok(member)) => members.push((exposure, member)),
                Some(Err(error)) => {
                    let reason = without_folder(&error, &exposure.path);
                    stage.failed.push(star_frame_row(exposure, Status::Failed, reason));
                }
                None => {}
            }
        }
        measured.push(members);
    }
    let mut pointings: Vec<Vec<Member>> = Vec::new();
    let checks = checks(&measured, night, catalogue);
    for (frames, checks) in measured.into_iter().zip(&checks) {
        let mut members = Vec::new();
        for ((exposure, member), check) in frames.into_iter().zip(checks) {
            if scale.is_some_and(|s| is_another(&member, exposure, s, night)) {
                let reason = format!(
                    "its stars solve to {:.4} arcsec/px, those of the other star frames to {:.4}: another telescope or \
                     binning; set aside",
                    member.solved_scale_arcsec(),
                    scale.unwrap_or(f64::NAN) * configured_arcsec(exposure, &night.config)
                );
                stage.failed.push(star_frame_row(exposure, Status::Rejected, reason));
            } else if let Some(reason) = check.contradiction() {
                stage.failed.push(star_frame_row(exposure, Status::Rejected, format!("{reason}; set aside")));
            } else {
                members.push(member);
            }
        }
        // a pointing of which no frame could be measured has no number: it is missing in the tables
        if !members.is_empty() {
            pointings.push(members);
        }
    }
    stage.checks = checks.into_iter().flatten().collect();
    if night.config.photometry.aper_correction {
        (stage.seeing.growth, stage.seeing.profile) =
            star_profile(&mut pointings, &night.config.photometry, notes, &mut stage.details);
    }
    let turns: Vec<CameraTurn> = pointings.iter().flatten().filter_map(|m| m.turn).collect();
    stage.seeing.camera_turn = CameraTurn::of_night(&turns);
    let mut fwhm: Vec<Vec<(f64, Option<f64>)>> = Vec::new();
    for (number, members) in pointings.iter().enumerate() {
        fwhm.push(members.iter().map(|m| (m.fwhm_px * m.scale_arcsec, m.airmass())).collect());
        notes.extend(members.iter().filter(|m| !m.note.is_empty()).map(|m| format!("{}: {}", m.frame, m.note)));
        stage.n_members += members.len();
        match stars.combine {
            Combine::Median => stage.rows.extend(combined_rows(members, number, catalogue)),
            Combine::None => stage.rows.extend(members.iter().flat_map(|m| single_rows(m, number, catalogue))),
        }
    }
    let exptime_s = median(&mut pointings.iter().flatten().map(|m| m.exptime_s).collect::<Vec<_>>());
    stage.seeing.width = StarWidth::of(&fwhm, exptime_s);
    stage.details.extend(stage.seeing.width.map(|width| width.explanation()));
    if catalogue.n_skipped > 0 {
        let why = catalogue.skipped.first().map(|s| format!(", e.g. {s}")).unwrap_or_default();
        notes.push(format!("catalogue: {} rows skipped{why}", catalogue.n_skipped));
    }
    notes.extend(catalogue.notes.iter().map(|note| format!("catalogue: {note}")));
    Ok(stage)
}

/// The scale of all star frames, as a share of the configured one; `None` if none was measured.
///
/// # Errors
/// [`Error::Config`](crate::Error::Config) where the stars solve to another scale than the configured one.
fn scale_of(
    exposures: &[&Exposure],
    results: &[Result<Member>],
    night: &Flattened,
    notes: &mut Vec<String>,
) -> Result<Option<f64>> {
    let config = &night.config;
    let measured = exposures.iter().zip(results).filter_map(|(e, r)| Some((*e, r.as_ref().ok()?)));
    let all: Vec<(&Exposure, f64)> = measured.map(|(e, member)| (e, member.solved_scale_arcsec())).collect();
    let mut ratios: Vec<f64> = all.iter().map(|(e, scale)| scale / configured_arcsec(e, config)).collect();
    let (Some(ratio), Some((first, _))) = (median(&mut ratios), all.first()) else { return Ok(None) };
    let source = format!("stars of {} frames", all.len());
    let found = Evidence { ratio, scale_arcsec: ratio * configured_arcsec(first, config), source };
    notes.extend(judged(&found, config)?);
    Ok(Some(ratio))
}

/// What every measured frame shows of its filter and camera.
fn checks(measured: &[Vec<(&Exposure, Member)>], night: &Flattened, catalogue: &Catalogue) -> Vec<Vec<FrameCheck>> {
    let ratio = |exposure: &Exposure, m: &Member| m.solved_scale_arcsec() / configured_arcsec(exposure, &night.config);
    let frames: Vec<Vec<(&Member, f64)>> =
        measured.iter().map(|p| p.iter().map(|(exposure, m)| (m, ratio(exposure, m))).collect()).collect();
    check_frames(&frames, catalogue)
}

/// Whether a frame's scale is not that of the others.
fn is_another(member: &Member, exposure: &Exposure, ratio: f64, night: &Flattened) -> bool {
    let own = member.solved_scale_arcsec() / configured_arcsec(exposure, &night.config);
    !((own / ratio - 1.0).abs() <= MOST_FRAC)
}

/// The catalogue with its stars where they stand at the first exposure; one without proper motions as it is.
fn of_date<'a>(
    catalogue: &'a Catalogue,
    exposures: &[&Exposure],
    epoch_jyear: f64,
    notes: &mut Vec<String>,
) -> Cow<'a, Catalogue> {
    let Some(jyear) = moved_to(catalogue, exposures) else { return Cow::Borrowed(catalogue) };
    notes.push(format!("catalogue: places moved to {jyear:.2} by their proper motions"));
    Cow::Owned(catalogue.moved_to(jyear, epoch_jyear))
}

/// The Julian year the stars of a catalogue are moved to: that of the first exposure.
fn moved_to(catalogue: &Catalogue, exposures: &[&Exposure]) -> Option<f64> {
    let mid = exposures.iter().find_map(|e| e.time.as_ref()).map(|t| t.mid)?;
    catalogue.has_motions().then(|| jyear(mid))
}

/// The profile of the night's stars, and that of every frame: as wide as its own stars, or else its pointing's, or else
/// the night's.
fn star_profile(
    pointings: &mut [Vec<Member>],
    photometry: &config::Photometry,
    notes: &mut Vec<String>,
    details: &mut Vec<String>,
) -> (Option<GrowthCurve>, Option<StarProfile>) {
    let curves: Vec<&FrameGrowth> = pointings.iter().flatten().filter_map(|m| m.growth.as_ref()).collect();
    // radii in units of the measured FWHM: the configured ones, unless the configuration gives a FWHM of its own
    let radius = |k: usize, configured: f64| {
        let of = |m: &Member| Some(m.radii_px[k] / m.growth.as_ref()?.fwhm_px);
        median(&mut pointings.iter().flatten().filter_map(of).collect::<Vec<_>>()).unwrap_or(configured)
    };
    let sky = (radius(1, photometry.sky_in_fwhm), radius(2, photometry.sky_out_fwhm));
    let Some(growth) = GrowthCurve::of_night(&curves, radius(0, photometry.aper_r_fwhm), sky) else {
        if pointings.iter().any(|p| !p.is_empty()) {
            let n: usize = curves.iter().map(|c| c.n_stars).sum();
            notes.push(format!(
                "no aperture correction: {n} bright, isolated, unsaturated stars are too few for a growth curve"
            ));
        }
        return (None, None);
    };
    let own: Vec<Vec<Option<StarProfile>>> = pointings
        .iter()
        .map(|p| p.iter().map(|m| m.growth.as_ref()?.profile(&growth.profile, m.fwhm_px)).collect())
        .collect();
    let ratio = |profiles: &mut dyn Iterator<Item = &Option<StarProfile>>| {
        median(&mut profiles.flatten().map(|p| p.fwhm_ratio).collect::<Vec<_>>())
    };
    let fwhm_ratio = ratio(&mut own.iter().flatten()).unwrap_or(growth.profile.fwhm_ratio);
    let night = StarProfile { fwhm_ratio, ..growth.profile };
    let mut lent = 0;
    for (members, own) in pointings.iter_mut().zip(&own) {
        let of_pointing = ratio(&mut own.iter()).map_or(night, |fwhm_ratio| StarProfile { fwhm_ratio, ..night });
        for (member, own) in members.iter_mut().zip(own) {
            lent += usize::from(own.is_none());
            member.profile = Some(own.unwrap_or(of_pointing));
        }
    }
    details.push(growth.explanation());
    if lent > 0 {
        details.push(format!(
            "{lent} star frames have too few bright stars to measure their seeing; that of their pointing or of the night \
             is used"
        ));
    }
    (Some(growth), Some(night))
}
