//! The stages that go over many frames, each on its own threads: master flat, star pointings, target frames, model.

use std::borrow::Cow;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::config::{self, Combine};
use crate::error::{Error, Result};
use crate::frames::{Exposure, MasterFlat};
use crate::night::bench::Bench;
use crate::night::clock::mjd_utc;
use crate::night::compare::{add_model, comparable};
use crate::night::cutout::keep_worst;
use crate::night::manifest::Quadratures;
use crate::night::pipeline::Options;
use crate::night::pointing::{Member, combined_rows, measure_member, single_rows};
use crate::night::previous::age_note;
use crate::night::progress::Progress;
use crate::night::survey::Survey;
use crate::night::target::{ASSUMED_FWHM_ARCSEC, TargetFrame, failed_row, measure_frame};
use crate::night::vet::judge_night;
use crate::photometry::aperture::Shape;
use crate::photometry::catalogue::Catalogue;
use crate::photometry::growth::{FrameGrowth, GrowthCurve, StarProfile};
use crate::photometry::stats::median;
use crate::report::summary::robust;
use crate::report::{PhotometryRow, StarRow};

/// The master flat: read if configured, made if there are flats, left out if there are none.
///
/// # Errors
/// [`Error::Flat`] when there are flats but too few can be used.
pub fn master_flat(
    survey: &Survey,
    bench: &Bench,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Option<MasterFlat>> {
    let clip = bench.config.photometry.clip_radius_px;
    if let Some(path) = &bench.config.flat.master {
        return MasterFlat::read(path, clip, &bench.config.flat).map(Some);
    }
    if survey.flats.is_empty() {
        notes.push("no flats in the night: frames are not flattened".into());
        return Ok(None);
    }
    progress.stage("master flat", survey.flats.len());
    let flat = pool(options.threads())?
        .install(|| MasterFlat::make(&survey.flats, &bench.detector, &bench.config.flat, clip))
        .map_err(|error| match error {
            Error::Flat { problem } => Error::Flat {
                problem: format!(
                    "{problem}; take more flats, name a master of another night in flat.master, lower flat.min_flats, \
                     or leave the flats out with frames.ignore"
                ),
            },
            other => other,
        })?;
    progress.done();
    Ok(Some(flat))
}

/// Runs `work` on a pool of `jobs` threads; 0 = all cores.
///
/// # Errors
/// [`Error::Config`] when the threads cannot be started.
pub fn with_threads<T: Send>(jobs: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(pool(Options { jobs, ..Options::default() }.threads())?.install(work))
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Config { key: "--jobs".into(), problem: format!("cannot start {threads} threads: {e}") })
}

/// What the star pointings gave.
#[derive(Debug, Default)]
pub struct StarStage {
    /// One row per star and pointing (or member).
    pub rows: Vec<StarRow>,
    /// Star frames that failed.
    pub failed: Vec<PhotometryRow>,
    /// Median FWHM \[arcsec\].
    pub fwhm_arcsec: Option<f64>,
    /// Profile of the stars.
    pub profile: Option<StarProfile>,
    /// Their growth curve.
    pub growth: Option<GrowthCurve>,
    /// Star frames measured.
    pub n_members: usize,
}

/// Measures every star pointing.
///
/// # Errors
/// Only what is wrong with the machine; a failed frame is a row.
pub fn star_stage(
    survey: &Survey,
    bench: &Bench,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<StarStage> {
    let (Some(stars), Some(catalogue)) = (&bench.config.stars, &bench.catalogue) else {
        if survey.n_star_frames() > 0 {
            notes.push(format!("{} star frames left out: no [stars] in the configuration", survey.n_star_frames()));
        }
        return Ok(StarStage::default());
    };
    let exposures: Vec<&Exposure> = survey.pointings.iter().flatten().collect();
    let catalogue = &of_date(catalogue, &exposures, stars.epoch_jyear, notes);
    progress.stage("star pointings", exposures.len());
    let measure = |exposure: &&Exposure| -> Result<Member> {
        let exposure: &Exposure = exposure;
        let work = std::panic::AssertUnwindSafe(|| measure_member(exposure, bench, catalogue));
        let member = std::panic::catch_unwind(work).unwrap_or_else(|_| {
            Err(Error::Fits { path: exposure.path.clone(), problem: "internal error while reading this frame".into() })
        });
        progress.tick();
        member
    };
    let threads = bench.frames_at_once(&exposures, options.threads());
    let results: Vec<Result<Member>> = pool(threads)?.install(|| exposures.par_iter().map(measure).collect());
    progress.done();

    let mut stage = StarStage::default();
    let mut pointings: Vec<Vec<Member>> = Vec::new();
    let mut results = results.into_iter();
    for pointing in &survey.pointings {
        let mut members = Vec::new();
        for exposure in pointing {
            match results.next() {
                Some(Ok(member)) => members.push(member),
                Some(Err(error)) => {
                    let mut row = failed_row(&exposure.name, &error);
                    row.object_name = exposure.object.clone().unwrap_or_default();
                    row.exptime_s = Some(exposure.exptime_s);
                    stage.failed.push(row);
                }
                None => {}
            }
        }
        // a pointing of which no frame could be measured has no number: it is missing in the tables
        if !members.is_empty() {
            pointings.push(members);
        }
    }
    if bench.config.photometry.aper_correction {
        (stage.growth, stage.profile) = star_profile(&mut pointings, &bench.config.photometry, notes);
    }
    let mut fwhm: Vec<f64> = Vec::new();
    for (number, members) in pointings.iter().enumerate() {
        fwhm.extend(members.iter().map(|m| m.fwhm_px * m.scale_arcsec));
        notes.extend(members.iter().filter(|m| !m.note.is_empty()).map(|m| format!("{}: {}", m.frame, m.note)));
        stage.n_members += members.len();
        match stars.combine {
            Combine::Median => stage.rows.extend(combined_rows(members, number, catalogue)),
            Combine::None => stage.rows.extend(members.iter().flat_map(|m| single_rows(m, number, catalogue))),
        }
    }
    stage.fwhm_arcsec = robust(&fwhm).map(|(median, _)| median);
    if catalogue.n_skipped > 0 {
        let why = catalogue.skipped.first().map(|s| format!(", e.g. {s}")).unwrap_or_default();
        notes.push(format!("catalogue: {} rows skipped{why}", catalogue.n_skipped));
    }
    notes.extend(catalogue.notes.iter().map(|note| format!("catalogue: {note}")));
    Ok(stage)
}

/// The catalogue with its stars where they stand at the first exposure; one without proper motions as it is.
fn of_date<'a>(
    catalogue: &'a Catalogue,
    exposures: &[&Exposure],
    epoch_jyear: f64,
    notes: &mut Vec<String>,
) -> Cow<'a, Catalogue> {
    let Some(mid) = exposures.iter().find_map(|e| e.time.as_ref()).map(|t| t.mid) else {
        return Cow::Borrowed(catalogue);
    };
    if !catalogue.has_motions() {
        return Cow::Borrowed(catalogue);
    }
    // Julian year = 2000 + (MJD − 51544.5) / 365.25
    let jyear = 2000.0 + (mjd_utc(mid) - 51_544.5) / 365.25;
    notes.push(format!("catalogue: places moved to {jyear:.2} by their proper motions"));
    Cow::Owned(catalogue.moved_to(jyear, epoch_jyear))
}

/// The profile of the night's stars, and that of every frame: as wide as its own stars, or else its pointing's, or else
/// the night's.
fn star_profile(
    pointings: &mut [Vec<Member>],
    photometry: &config::Photometry,
    notes: &mut Vec<String>,
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
    notes.push(growth.explanation());
    if lent > 0 {
        notes.push(format!(
            "{lent} star frames have too few bright stars for the width of their own profile: it is their pointing's or \
             the night's"
        ));
    }
    (Some(growth), Some(night))
}

/// Measures every target frame; the row and the geometry of each.
///
/// # Errors
/// Only what is wrong with the machine; a failed frame is a row.
pub fn target_stage(
    survey: &Survey,
    bench: &Bench,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Vec<TargetFrame>> {
    if bench.fwhm_arcsec.is_none() && bench.config.photometry.fwhm_px.is_none() && !survey.targets.is_empty() {
        notes.push(format!(
            "no FWHM from star pointings or photometry.fwhm_px: target apertures assume {ASSUMED_FWHM_ARCSEC} arcsec"
        ));
    }
    if bench.config.photometry.aper_correction && bench.profile.is_none() && bench.zeropoint.is_some() {
        notes.push(
            "no aperture correction of the target: the profile of this night's stars is not known; where the wings of \
             the images are wide, magnitudes are faint by a few hundredths"
                .into(),
        );
    }
    if let Some(tracker) = &bench.tracker {
        let warnings = survey.targets.iter().filter_map(|e| tracker.age_warning(&e.time.as_ref()?.mid));
        notes.extend(warnings.take(1));
    }
    let exposures: Vec<&Exposure> = survey.targets.iter().collect();
    progress.stage("target frames", exposures.len());
    let threads = bench.frames_at_once(&exposures, options.threads());
    let rows = pool(threads)?.install(|| {
        exposures
            .par_iter()
            .map(|exposure| {
                let row = measure_frame(exposure, bench);
                progress.tick();
                row
            })
            .collect()
    });
    progress.done();
    let mut rows: Vec<TargetFrame> = rows;
    limits_for_the_size_of_the_object(&mut rows);
    notes.extend(age_note(rows.iter().map(|f| &f.row)));
    judge_night(&mut rows, &bench.config);
    keep_worst(&mut rows, bench.config.vetting.gallery_frames);
    Ok(rows)
}

/// Makes the limits of non-detections those of an object as large as the detected ones.
///
/// A limit is measured in a small circle; the noise of a larger aperture grows with the root of its area:
/// Δm = −1.25 log₁₀(A_object / A_measured), with A_object the median aperture of the frames of the same object, in
/// arcsec² and scaled by (range)⁻² where the ranges are known.
fn limits_for_the_size_of_the_object(rows: &mut [TargetFrame]) {
    let size = |r: &PhotometryRow| -> Option<f64> {
        let scale = r.pix_scale_arcsec?;
        let shape = match (r.aper_r_px, r.aper_a_px, r.aper_b_px) {
            (Some(r_px), ..) => Shape::Circle { r_px },
            (None, Some(a_px), Some(b_px)) => match r.aper_shape.as_str() {
                "rectangle" => Shape::Rectangle { a_px, b_px, theta_rad: 0.0 },
                "pill" => Shape::Pill { a_px, b_px, theta_rad: 0.0 },
                _ => Shape::Ellipse { a_px, b_px, theta_rad: 0.0 },
            },
            _ => return None,
        };
        Some(shape.area_px() * scale * scale)
    };
    let detected: Vec<(String, f64, Option<f64>)> = rows
        .iter()
        .map(|f| &f.row)
        .filter(|r| r.status == "ok" && r.verdict != "reject")
        .filter_map(|r| Some((r.object_name.clone(), size(r)?, r.range_km)))
        .collect();
    for row in rows.iter_mut().map(|f| &mut f.row).filter(|r| r.status == "nondetection") {
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
            row.limit_v_mag = Some(limit - 1.25 * (area / measured).log10());
            row.reason += &format!("; limit for an object of {area:.0} arcsec2, as in the frames that show it");
        }
    }
}

/// The model for every frame with a geometry; frames without one keep their columns empty.
pub fn model_stage(frames: &mut [TargetFrame], bench: &Bench, notes: &mut Vec<String>) -> Quadratures {
    let Some(model) = &bench.model else { return Quadratures::default() };
    if let Some(Ok(Some(note))) = bench.config.model.as_ref().map(comparable) {
        notes.push(note);
    }
    let errors = Mutex::new(Vec::new());
    let counts: Vec<Quadratures> = frames
        .par_iter_mut()
        .map(|TargetFrame { row, geometry, .. }| {
            let Some(geometry) = geometry else { return Quadratures::default() };
            match add_model(row, geometry, model) {
                Ok(model) => Quadratures { scenes: 1, sun: model.quadratures.sun, moon: model.quadratures.moon },
                Err(error) => {
                    if let Ok(mut errors) = errors.lock() {
                        errors.push(format!("{}: {error}", row.frame));
                    }
                    row.skipped = error.to_string();
                    Quadratures::default()
                }
            }
        })
        .collect();
    let mut errors = errors.into_inner().unwrap_or_default();
    errors.sort();
    notes.extend(errors);
    counts.into_iter().fold(Quadratures::default(), |a, b| Quadratures {
        scenes: a.scenes + b.scenes,
        sun: a.sun + b.sun,
        moon: a.moon + b.moon,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(status: &str, range_km: f64, r_px: f64) -> TargetFrame {
        let row = PhotometryRow {
            object_name: "ISS".into(),
            status: status.into(),
            verdict: "use".into(),
            range_km: Some(range_km),
            aper_r_px: Some(r_px),
            pix_scale_arcsec: Some(1.5),
            limit_v_mag: (status == "nondetection").then_some(15.0),
            ..PhotometryRow::default()
        };
        TargetFrame { row, geometry: None, thumb: None }
    }

    #[test]
    fn a_limit_is_that_of_the_object_at_its_range_and_of_a_point_where_nothing_is_known() {
        // three times the radius at the same range: 1.25 log10 9 = 1.193 mag; twice as far away: 1.25 log10 (9/4)
        let mut rows = vec![row("ok", 500.0, 21.0), row("nondetection", 500.0, 7.0), row("nondetection", 1000.0, 7.0)];
        limits_for_the_size_of_the_object(&mut rows);
        assert!((rows[1].row.limit_v_mag.unwrap() - (15.0 - 1.25 * 9f64.log10())).abs() < 1e-12);
        assert!((rows[2].row.limit_v_mag.unwrap() - (15.0 - 1.25 * 2.25f64.log10())).abs() < 1e-12);
        let mut alone = vec![row("nondetection", 500.0, 7.0)];
        limits_for_the_size_of_the_object(&mut alone);
        assert_eq!(alone[0].row.limit_v_mag, Some(15.0));
    }
}
