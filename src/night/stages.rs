//! The stages that go over many frames, each on its own threads: master flat, target frames, model.
//!
//! Star pointings are in [`super::star_stage`].

use std::sync::Mutex;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::frames::{BAND_BYTES, Exposure, MasterFlat};
use crate::night::bench::Bench;
use crate::night::compare::{add_model, comparable};
use crate::night::manifest::Quadratures;
use crate::night::pipeline::Options;
use crate::night::previous::age_note;
use crate::night::progress::Progress;
use crate::night::queue::in_order;
use crate::night::survey::Survey;
use crate::night::target::{ASSUMED_FWHM_ARCSEC, TargetFrame, failed_row, hash_and_measure, internal};
use crate::night::vet::judge_night;
use crate::photometry::aperture::Shape;
use crate::report::PhotometryRow;
use crate::report::summary::robust;

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
        .install(|| MasterFlat::make(&survey.flats, &bench.detector, &bench.config.flat, clip, BAND_BYTES))
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

/// A pool of `threads` threads.
///
/// # Errors
/// As [`with_threads`].
pub(super) fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Config { key: "--jobs".into(), problem: format!("cannot start {threads} threads: {e}") })
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
    let room = options.memory().target_frames(bench, &exposures, options.threads());
    let lost = |exposure: &Exposure| TargetFrame {
        row: failed_row(&exposure.name, &internal(exposure)),
        geometry: None,
        thumb: None,
    };
    let mut rows = in_order(&exposures, room, progress, |exposure| hash_and_measure(exposure, bench), lost)?;
    bench.buffers.clear();
    progress.done();
    limits_for_the_size_of_the_object(&mut rows);
    notes.extend(age_note(rows.iter().map(|f| &f.row)));
    judge_night(&mut rows, &bench.config);
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
