//! The stages that go over many frames, each on its own threads: master flat, target frames with their model.
//!
//! Star pointings are in [`super::stars::stage`], what only the whole night shows in [`super::shards::whole`].

use crate::base::threads::pool;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use rayon::prelude::*;

use super::options::Options;
use super::products::inputs::named_files;
use super::target::outcome::TargetFrame;
use crate::base::error::{Error, Result};
use crate::base::hash::{sha256_16, sha256_16_text};
use crate::base::progress::{Progress, Silent};
use crate::config::Config;
use crate::frames::flat::{BAND_BYTES, FlatMember, MasterFlat};
use crate::frames::{Exposure, Role, ZeroLevels};
use crate::pipeline::compare::comparable;
use crate::pipeline::hot_pixels::hot_key;
use crate::pipeline::ordered_map::in_order;
use crate::pipeline::prepared::{Calibrated, Flattened, Prepared};
use crate::pipeline::products::manifest::Quadratures;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::shards::products::FrameCache;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::target::frame::ASSUMED_FWHM_ARCSEC;
use crate::pipeline::target::frame::{internal, measure_frame};
use crate::pipeline::target::pilots::TargetFrames;
use crate::pipeline::target::place::Place;
use crate::pipeline::target::row::{failed_row, flat_row};
use crate::pipeline::target::window::Region;
use crate::tables::PhotometryRow;
use crate::tables::words::Status;

/// Name of the product of the master flat.
const FLAT: &str = "flat";
/// Kind of the products of target frames.
pub const TARGET: &str = "target";
/// The same with a measured colour of the target: that without is kept too, since the colour is measured with it.
const COLOURED: &str = "target_coloured";

/// The night with its master flat: read if one is configured, made if there are flats, none if there are none.
///
/// With `file` it is written there, and taken from there again where the flats, the program and the configuration are those
/// of an earlier run.
///
/// # Errors
/// [`Error::Flat`] when there are flats but too few can be used; [`Error::Io`] where `file` cannot be written.
pub fn master_flat(
    survey: &Survey,
    mut night: Prepared,
    (products, file): (&FrameCache, Option<&Path>),
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Flattened> {
    let clip = night.config.photometry.clip_radius_px;
    let zero = zero_levels(survey, &night, products, options, notes)?;
    notes.extend(check_overscan(survey, &mut night, &zero));
    if let Some(path) = &night.config.flat.master {
        let flat = Some(MasterFlat::read(path, clip, &night.config.flat)?);
        return Ok(Flattened { flat, flat_sha256: sha256_16(path)?, zero, hot: Vec::new(), prepared: night });
    }
    if survey.flats.is_empty() {
        notes.push("no flats in the night: frames are not flattened".into());
        return Ok(Flattened { flat: None, flat_sha256: String::new(), zero, hot: Vec::new(), prepared: night });
    }
    progress.stage("master flat", survey.flats.len());
    let threads = pool(options.threads())?;
    let key = match file {
        Some(_) => threads.install(|| flat_key(survey, products)),
        None => String::new(),
    };
    if let Some(path) = file
        && let Some((members, flat_sha256)) = products.load::<(Vec<FlatMember>, String)>(FLAT, &key)
        && sha256_16(path).is_ok_and(|now| now == flat_sha256)
        && let Ok(flat) = MasterFlat::read(path, clip, &night.config.flat)
    {
        progress.done();
        let flat = MasterFlat { members, ..flat };
        notes.extend(noise_note(&flat, night.config.flat.noise_frac));
        return Ok(Flattened { flat: Some(flat), flat_sha256, zero, hot: Vec::new(), prepared: night });
    }
    let flat = threads
        .install(|| MasterFlat::make(&survey.flats, &night.detector, &night.config.flat, clip, BAND_BYTES))
        .map_err(|error| match error {
            Error::Flat { problem } => Error::Flat {
                problem: format!(
                    "{problem}; take more flats, name a master of another night in flat.master, lower flat.min_flats, \
                     or leave the flats out with frames.ignore"
                ),
            },
            other => other,
        })?;
    notes.extend(noise_note(&flat, night.config.flat.noise_frac));
    let mut flat_sha256 = String::new();
    if let Some(path) = file {
        let provenance = Provenance::of_flat(&night.config, &survey.flats, &|p| products.sha256(p).ok())?;
        flat.write_with(path, &provenance.cards())?;
        flat_sha256 = sha256_16(path)?;
        products.store(FLAT, &key, &(&flat.members, &flat_sha256));
    }
    progress.done();
    Ok(Flattened { flat: Some(flat), flat_sha256, zero, hot: Vec::new(), prepared: night })
}

/// How many flats were enough for `flat.noise_frac`, or that all of them are not.
fn noise_note(flat: &MasterFlat, accepted: Option<f64>) -> Option<String> {
    let accepted = accepted?;
    let spared = flat.members.iter().filter(|m| m.not_needed);
    match (spared.clone().map(|m| &m.reason).next(), flat.noise_frac) {
        (Some(why), _) => Some(format!("{} flats are {why}", spared.count())),
        (None, Some(noise)) => (noise > accepted).then(|| {
            format!(
                "all usable flats are combined, and the noise of a pixel is {noise:.5}: more than flat.noise_frac = {accepted}"
            )
        }),
        (None, None) => Some(format!(
            "all usable flats are combined: the gain of one is not known, and so is its noise (flat.noise_frac = {accepted})"
        )),
    }
}

/// The biases and darks of the night, combined, unless the configuration leaves them out.
fn zero_levels(
    survey: &Survey,
    night: &Prepared,
    products: &FrameCache,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<ZeroLevels> {
    let frames: Vec<&Exposure> = bias_and_dark(survey, &night.config).collect();
    if frames.is_empty() {
        return Ok(ZeroLevels::default());
    }
    let lights: Vec<&Exposure> = survey.pointings.iter().flatten().chain(&survey.targets).collect();
    let clip = night.config.photometry.clip_radius_px;
    let threads = pool(options.threads())?;
    let (mut zero, hashes) = threads.install(|| {
        let of = |e: &&Exposure| format!("{} {}", e.name, products.sha256(&e.path).unwrap_or_default());
        (ZeroLevels::make(&frames, &lights, clip), frames.par_iter().map(of).collect::<Vec<_>>())
    });
    zero.key = sha256_16_text(&hashes.join("\n"));
    notes.append(&mut zero.notes.clone());
    Ok(zero)
}

/// What is to be said of the overscan, where frames without matching biases have one: that it is used, or that it is not, since
/// BIASSEC of a flat or of the first light names pixels that saw light. It is then used for no frame of the night.
fn check_overscan(survey: &Survey, night: &mut Prepared, zero: &ZeroLevels) -> Option<String> {
    let mut lights = survey.pointings.iter().flatten().chain(&survey.targets);
    let first = lights.find(|exposure| zero.of(exposure).is_none())?;
    let pedestal_adu = night.detector.pedestal_adu();
    let of = |exposure| (exposure, night.detector.overscan_adu(exposure));
    let flats: Vec<_> = survey.flats.par_iter().map(of).collect();
    let refused = flats.into_iter().chain([of(first)]).find_map(|(exposure, level)| Some((exposure, level.err()?)));
    if let Some((exposure, why)) = refused {
        night.detector.leave_overscan_out();
        return Some(format!(
            "warning: {}: {why}; detector.pedestal_adu = {pedestal_adu} is subtracted from all frames, \
             detector.use_overscan = false silences this",
            exposure.name
        ));
    }
    let level_adu = night.detector.overscan_adu(first).ok()??;
    Some(format!(
        "the bias level of each frame is that of its overscan ({level_adu:.1} ADU in {}), not detector.pedestal_adu = \
         {pedestal_adu}",
        first.name
    ))
}

/// The bias and dark frames that a run subtracts.
pub fn bias_and_dark<'a>(survey: &'a Survey, config: &Config) -> impl Iterator<Item = &'a Exposure> + use<'a> {
    let wanted = !config.frames.skip_bias_dark;
    survey.others.iter().filter(move |e| wanted && matches!(e.role, Role::Bias | Role::Dark))
}

/// What the master flat is made of: names and hashes of the flats.
fn flat_key(survey: &Survey, products: &FrameCache) -> String {
    let of = |e: &Exposure| format!("{} {}", e.path.display(), products.sha256(&e.path).unwrap_or_default());
    let flats: Vec<String> = survey.flats.par_iter().map(of).collect();
    products.key(&std::iter::once(FLAT).chain(flats.iter().map(String::as_str)).collect::<Vec<_>>())
}

/// Measures target frames and predicts their brightness: the row and the geometry of each, before anything that takes the
/// whole night; and the integrals that took. First the pilots, by which the target is looked for in the others.
///
/// # Errors
/// Only what is wrong with the machine, or a stop; a failed frame is a row.
pub fn target_stage(
    targets: &TargetFrames,
    night: &Calibrated,
    products: &FrameCache,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<(Vec<TargetFrame>, Quadratures)> {
    let exposures = &targets.exposures[targets.wanted.clone()];
    if night.seeing.width.is_none() && night.config.photometry.fwhm_px.is_none() && !exposures.is_empty() {
        notes.push(format!(
            "no FWHM from star pointings or photometry.fwhm_px: targets are measured in apertures around what is seen, not \
             with the weights of a point; limits and forced fluxes assume {ASSUMED_FWHM_ARCSEC} arcsec"
        ));
    }
    if night.config.photometry.aper_correction && night.seeing.profile.is_none() && night.zeropoint.is_some() {
        notes.push(
            "no aperture correction of the target: the profile of this night's stars is not known; where the wings of \
             the images are wide, magnitudes are faint by a few hundredths"
                .into(),
        );
    }
    if let Some(tracker) = &night.tracker {
        let warnings = exposures.iter().filter_map(|e| tracker.age_warning(&e.time.as_ref()?.mid));
        notes.extend(warnings.take(1));
    }
    if let (Some(_), Some(Ok(Some(note)))) = (&night.model, night.config.model.as_ref().map(comparable)) {
        notes.push(note);
    }
    let exposures: Vec<&Exposure> = exposures.iter().collect();
    let depends = depends(night, products);
    let depends: Vec<&str> = depends.iter().map(String::as_str).collect();
    let pilots = targets.pilots();
    let others: Vec<usize> = targets.wanted.clone().filter(|k| pilots.binary_search(k).is_err()).collect();
    progress.stage("target frames", pilots.len() + others.len());
    let memory = options.memory();
    let room = memory.target_frames(night, &exposures, options.threads());
    let work = |exposure: &Exposure, region: Option<&Region>| match memory.holds_target_frame(night, exposure) {
        Ok(()) => reduced(exposure, region, night, products, &depends),
        Err(error) => Reduced::of(failed_row(exposure, &error)),
    };
    let lost = |exposure: &Exposure| Reduced::of(failed_row(exposure, &internal(exposure)));
    let kept = || {
        format!(
            "{} of {} target frames kept; run the same line again to go on",
            products.count(TARGET, &exposures),
            exposures.len()
        )
    };
    let of = |places: &[usize]| places.iter().map(|k| &targets.exposures[*k]).collect::<Vec<_>>();
    let whole = |exposure: &Exposure| work(exposure, None);
    let of_pilots = in_order(&of(&pilots), room, (&options.stop, &kept), progress, whole, lost)?;
    let rows: Vec<(usize, PhotometryRow)> =
        pilots.iter().copied().zip(of_pilots.iter().map(|r| r.row.clone())).collect();
    let mut reduced: BTreeMap<usize, Reduced> = pilots.into_iter().zip(of_pilots).collect();
    reduced.retain(|k, _| targets.wanted.contains(k));
    let region = |k: usize| targets.region(k, &rows, night);
    // a pilot that shows more than the others do, or is compact and shows less of its size, is looked at once more, by them
    let by_others = |(k, r): (&usize, &Reduced)| {
        let at = region(*k)?;
        (at.is_joined_in(&r.row) || at.knows_more_than(&r.row, &night.seeing)).then_some((*k, at))
    };
    let of_again: Vec<(usize, Region)> = reduced.iter().filter_map(by_others).collect();
    let again: Vec<usize> = of_again.iter().map(|(k, _)| *k).collect();
    let of_region = others.iter().filter_map(|k| Some((*k, region(*k)?))).chain(of_again);
    let regions: HashMap<&Path, Region> = of_region.map(|(k, at)| (targets.exposures[k].path.as_path(), at)).collect();
    let part = |exposure: &Exposure| work(exposure, regions.get(exposure.path.as_path()));
    let of_others = in_order(&of(&others), room, (&options.stop, &kept), progress, part, lost)?;
    // these frames are counted already
    let of_again = in_order(&of(&again), room, (&options.stop, &kept), &Silent, part, lost)?;
    reduced.extend(others.into_iter().zip(of_others).chain(again.into_iter().zip(of_again)));
    let reduced = reduced.into_values();
    night.buffers.clear();
    progress.done();
    let mut quadratures = Quadratures::default();
    let mut problems = Vec::new();
    let mut frames = Vec::new();
    for (Reduced { row, integrals: [scenes, sun, moon], problem }, exposure) in reduced.zip(&exposures) {
        quadratures.scenes += scenes;
        quadratures.sun += sun;
        quadratures.moon += moon;
        problems.extend(problem);
        // cheap to find again, and needed only to explain a night
        let geometry = Place::of(exposure, night).seen().cloned();
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

/// What the row of a target frame depends on besides the frame: elements, satellite, flat, stars and
/// zeropoint, and the catalogue where its stars trail through the frames.
fn depends(night: &Calibrated, products: &FrameCache) -> Vec<String> {
    let files = named_files(&night.config).into_iter();
    let by_trails = night.config.zeropoint.star_trails;
    let of_rows =
        |key: &str| key.starts_with("orbit.") || key.starts_with("model.") || (by_trails && key.starts_with("stars."));
    let files = files.filter(|(key, _)| of_rows(key));
    let mut all: Vec<String> = files.map(|(_, path)| products.sha256(&path).unwrap_or_default()).collect();
    all.push(night.flat_sha256.clone());
    all.push(night.zero.key.clone());
    all.push(hot_key(&night.hot));
    all.push(format!("{:?} {:?} {:?}", night.seeing.width, night.seeing.profile, night.seeing.camera_turn));
    all.push(format!("{:?} {}", night.zeropoint, night.model.is_some()));
    all
}

/// One target frame, kept from an earlier run or measured and modelled.
fn reduced(
    exposure: &Exposure,
    region: Option<&Region>,
    night: &Calibrated,
    products: &FrameCache,
    depends: &[&str],
) -> Reduced {
    let of_region = region.map(|r| format!("{r:?}")).unwrap_or_default();
    let depends: Vec<&str> = depends.iter().copied().chain([of_region.as_str()]).collect();
    let make = || {
        let compared = measure_frame(exposure, region, night).compared(night);
        let mut reduced = Reduced::of(compared.row(night));
        match &compared.model {
            Some(Ok(model)) => reduced.integrals = [1, model.quadratures.sun, model.quadratures.moon],
            Some(Err(error)) => reduced.problem = Some(format!("{}: {error}", exposure.name)),
            None => {}
        }
        Ok(reduced)
    };
    // what failed may have failed by a disk or a network that will be there again
    let kind = if night.config.zeropoint.target_b_v_from.is_some() { COLOURED } else { TARGET };
    let (hash, reduced) =
        products.of_frame(kind, exposure, &depends, make, |r: &Reduced| r.row.status != Status::Failed);
    let reduced = reduced.unwrap_or_else(|error: Error| Reduced::of(failed_row(exposure, &error)));
    Reduced { row: PhotometryRow { frame_sha256: hash, ..reduced.row }, ..reduced }
}

/// Flats that did not enter the master, as rows.
pub(crate) fn rejected_flats(night: &Flattened) -> Vec<PhotometryRow> {
    let Some(flat) = &night.flat else { return Vec::new() };
    flat.members.iter().filter(|m| !m.used && !m.not_needed).map(|m| flat_row(&m.path, &m.reason)).collect()
}
