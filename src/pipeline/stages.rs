//! The stages that go over many frames, each on its own threads: master flat, target frames with their model.
//!
//! Star pointings are in [`super::stars::stage`], what only the whole night tells in [`super::shards::whole`].

use crate::base::threads::pool;
use std::path::Path;

use rayon::prelude::*;

use super::options::Options;
use super::products::inputs::named_files;
use super::target::outcome::TargetFrame;
use crate::base::error::{Error, Result};
use crate::base::hash::sha256_16;
use crate::base::progress::Progress;
use crate::brightness::columns::add_model;
use crate::frames::Exposure;
use crate::frames::flat::{BAND_BYTES, FlatMember, MasterFlat};
use crate::pipeline::compare::comparable;
use crate::pipeline::ordered_map::in_order;
use crate::pipeline::prepared::Bench;
use crate::pipeline::products::manifest::Quadratures;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::shards::products::Products;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::target::frame::ASSUMED_FWHM_ARCSEC;
use crate::pipeline::target::frame::failed_row;
use crate::pipeline::target::frame::geometry_columns;
use crate::pipeline::target::frame::internal;
use crate::pipeline::target::frame::measure_frame;
use crate::pipeline::target::frame::row_of_header;
use crate::tables::PhotometryRow;
use crate::tables::words::Status;

/// Name of the product of the master flat.
const FLAT: &str = "flat";
/// Kind of the products of target frames.
pub const TARGET: &str = "target";

/// Puts the master flat on the bench: read if configured, made if there are flats, left out if there are none.
///
/// With `file` it is written there, and taken from there again where the flats, the program and the configuration are those
/// of an earlier run.
///
/// # Errors
/// [`Error::Flat`] when there are flats but too few can be used; [`Error::Io`] where `file` cannot be written.
pub fn master_flat(
    survey: &Survey,
    bench: &mut Bench,
    (products, file): (&Products, Option<&Path>),
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<()> {
    let clip = bench.config.photometry.clip_radius_px;
    if let Some(path) = &bench.config.flat.master {
        bench.flat = Some(MasterFlat::read(path, clip, &bench.config.flat)?);
        bench.flat_sha256 = sha256_16(path)?;
        return Ok(());
    }
    if survey.flats.is_empty() {
        notes.push("no flats in the night: frames are not flattened".into());
        return Ok(());
    }
    progress.stage("master flat", survey.flats.len());
    let threads = pool(options.threads())?;
    let key = match file {
        Some(_) => threads.install(|| flat_key(survey, products)),
        None => String::new(),
    };
    if let Some(path) = file
        && let Some((members, hash)) = products.load::<(Vec<FlatMember>, String)>(FLAT, &key)
        && sha256_16(path).is_ok_and(|now| now == hash)
        && let Ok(flat) = MasterFlat::read(path, clip, &bench.config.flat)
    {
        (bench.flat, bench.flat_sha256) = (Some(MasterFlat { members, ..flat }), hash);
        progress.done();
        return Ok(());
    }
    let flat = threads
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
    if let Some(path) = file {
        let told = Provenance::of_flat(&bench.config, &survey.flats, &|p| products.sha256(p).ok())?;
        flat.write_with(path, &told.cards())?;
        bench.flat_sha256 = sha256_16(path)?;
        products.store(FLAT, &key, &(&flat.members, &bench.flat_sha256));
    }
    bench.flat = Some(flat);
    progress.done();
    Ok(())
}

/// What the master flat is made of: names and hashes of the flats.
fn flat_key(survey: &Survey, products: &Products) -> String {
    let of = |e: &Exposure| format!("{} {}", e.path.display(), products.sha256(&e.path).unwrap_or_default());
    let flats: Vec<String> = survey.flats.par_iter().map(of).collect();
    products.key(&std::iter::once(FLAT).chain(flats.iter().map(String::as_str)).collect::<Vec<_>>())
}

/// Measures target frames and predicts their brightness: the row and the geometry of each, before anything that takes the
/// whole night; and the integrals that took.
///
/// # Errors
/// Only what is wrong with the machine, or a stop; a failed frame is a row.
pub fn target_stage(
    exposures: &[Exposure],
    bench: &Bench,
    products: &Products,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<(Vec<TargetFrame>, Quadratures)> {
    if bench.fwhm_arcsec.is_none() && bench.config.photometry.fwhm_px.is_none() && !exposures.is_empty() {
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
        let warnings = exposures.iter().filter_map(|e| tracker.age_warning(&e.time.as_ref()?.mid));
        notes.extend(warnings.take(1));
    }
    if let (Some(_), Some(Ok(Some(note)))) = (&bench.model, bench.config.model.as_ref().map(comparable)) {
        notes.push(note);
    }
    let exposures: Vec<&Exposure> = exposures.iter().collect();
    let depends = depends(bench, products);
    let depends: Vec<&str> = depends.iter().map(String::as_str).collect();
    progress.stage("target frames", exposures.len());
    let room = options.memory().target_frames(bench, &exposures, options.threads());
    let work = |exposure: &Exposure| reduced(exposure, bench, products, &depends);
    let lost = |exposure: &Exposure| Reduced::of(failed_row(exposure, &internal(exposure)));
    let kept = || {
        format!(
            "{} of {} target frames kept; run the same line again to go on",
            products.count(TARGET, &exposures),
            exposures.len()
        )
    };
    let reduced = in_order(&exposures, room, (&options.stop, &kept), progress, work, lost)?;
    bench.buffers.clear();
    progress.done();
    let mut quadratures = Quadratures::default();
    let mut problems = Vec::new();
    let mut frames = Vec::new();
    for (Reduced { row, integrals: [scenes, sun, moon], problem }, exposure) in reduced.into_iter().zip(&exposures) {
        quadratures.scenes += scenes;
        quadratures.sun += sun;
        quadratures.moon += moon;
        problems.extend(problem);
        // cheap to find again, and only asked for by what explains a night
        let geometry = geometry_columns(&mut row_of_header(exposure, bench), exposure, bench).ok().flatten();
        frames.push(TargetFrame { row, geometry, thumb: None });
    }
    problems.sort();
    notes.extend(problems);
    Ok((frames, quadratures))
}

/// What is kept of one target frame.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct Reduced {
    row: PhotometryRow,
    /// Scenes modelled, integrals of sunlight and of moonlight by way of the Earth.
    integrals: [usize; 3],
    /// Why there is no model of it.
    problem: Option<String>,
}

impl Reduced {
    fn of(row: PhotometryRow) -> Self {
        Self { row, integrals: [0; 3], problem: None }
    }
}

/// What a target frame's row depends on beside the frame: elements, satellite, flat, stars and zeropoint.
fn depends(bench: &Bench, products: &Products) -> Vec<String> {
    let files = named_files(&bench.config).into_iter();
    let files = files.filter(|(key, _)| key.starts_with("orbit.") || key.starts_with("model."));
    let mut all: Vec<String> = files.map(|(_, path)| products.sha256(&path).unwrap_or_default()).collect();
    all.push(bench.flat_sha256.clone());
    all.push(format!("{:?} {:?} {:?}", bench.fwhm_arcsec, bench.profile, bench.camera_turn));
    all.push(format!("{:?} {}", bench.zeropoint, bench.model.is_some()));
    all
}

/// One target frame, kept from an earlier run or measured and modelled.
fn reduced(exposure: &Exposure, bench: &Bench, products: &Products, depends: &[&str]) -> Reduced {
    let make = || {
        let TargetFrame { row, geometry, .. } = measure_frame(exposure, bench);
        let mut reduced = Reduced::of(row);
        if let (Some(model), Some(geometry)) = (&bench.model, &geometry) {
            match add_model(&mut reduced.row, geometry, model, bench.residuals()) {
                Ok(model) => reduced.integrals = [1, model.quadratures.sun, model.quadratures.moon],
                Err(error) => {
                    reduced.problem = Some(format!("{}: {error}", reduced.row.frame));
                    reduced.row.skipped = error.to_string();
                }
            }
        }
        Ok(reduced)
    };
    // what failed may have failed by a disk or a network that will be there again
    let (hash, reduced) =
        products.of_frame(TARGET, exposure, depends, make, |r: &Reduced| r.row.status != Status::Failed);
    let mut reduced = reduced.unwrap_or_else(|error: Error| Reduced::of(failed_row(exposure, &error)));
    reduced.row.frame_sha256 = hash;
    reduced
}
