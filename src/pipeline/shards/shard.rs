//! One shard: target frames of a plan to a table of rows, wherever and in whatever order shards are measured.
//!
//! The table (`satphot.shard/1`) holds the rows as they are before anything that takes the whole night, and the rows of
//! star frames and flats that were excluded, at full precision; nothing of when, where or by which worker it was made.
//! That is in the JSON file next to it. It does not cover the sum ([`super::merge`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::plan_file::{Plan, PlannedFrame, changed};
use super::products::{FOLDER, FrameCache, key};
use super::reduce::{StarFacts, flat_of_plan, pointings_of};
use crate::base::error::{Error, Result};
use crate::base::file::make_folder_of;
use crate::base::file::save;
use crate::base::progress::Progress;
use crate::config::Config;
use crate::pipeline::hot_pixels::with_hot_pixels;
use crate::pipeline::options::Options;
use crate::pipeline::prepared::{Calibrated, Prepared, Seeing};
use crate::pipeline::products::inputs::InputRole;
use crate::pipeline::products::inputs::TOOL;
use crate::pipeline::products::manifest::peak_memory_mb;
use crate::pipeline::products::meta::table_meta;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::stages::target_stage;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::target::pilots::TargetFrames;
use crate::tables::check_rows_hash;
use crate::tables::{Meta, MetaValue, PhotometryRow, read_photometry, write_photometry};
use crate::zeropoint::fit::Zeropoint;

/// The schema in the meta block of a shard.
pub const SHARD_SCHEMA: &str = "satphot.shard/1";

/// Which shard, with what, to which file.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Number of the shard, from 0.
    pub number: usize,
    /// zeropoint.toml of the plan, with the facts of the stars next to it; without one magnitudes stay instrumental.
    pub zeropoint: Option<&'a Path>,
    /// Master flat; by default the one next to the zeropoint.
    pub flat: Option<&'a Path>,
    /// Table to write.
    pub out: &'a Path,
}

/// The outcome of a shard.
#[derive(Debug)]
pub struct Measured {
    /// Rows written; those of the table that is there already where it is the same.
    pub rows: Vec<PhotometryRow>,
    /// The table was there already: nothing was done.
    pub there_already: bool,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

/// Measures one shard and writes its table, and `<out>.json` next to it.
///
/// A table of the same plan, configuration, version and calibration is left as it is.
///
/// # Errors
/// [`Error::Mismatch`] for a file that is not that of the plan, before anything is written; [`Error::Interrupted`] with
/// what is kept for another try; else what must be there before work begins.
pub fn measure_shard(plan: &Plan, request: &Request, options: &Options, progress: &dyn Progress) -> Result<Measured> {
    let frames = plan.shard(request.number)?;
    let config = plan.config()?;
    let mut notes = Vec::new();
    let (mut night, facts) = calibrated(plan, (request.zeropoint, request.flat), options, progress, &mut notes)?;
    let night_rows = facts.map(|f| f.rows).unwrap_or_default();
    let made_of = made_of(plan, request, &night)?;
    if let Some(rows) = (!options.redo).then(|| same_table(request.out, &made_of, &frames)).flatten() {
        return Ok(Measured { rows, there_already: true, notes });
    }
    // each shard keeps its frames in a folder of its own, so that no two workers write to one file
    let folder = request.out.parent().unwrap_or(Path::new("")).join(FOLDER).join(&made_of[..16]);
    let roles = ["orbit.elements", "model.satellites", "model.throughput", "model.band", "flat.master"];
    plan.check_files(&roles, &FrameCache::default())?;
    let products = FrameCache::in_folder(folder, &night, options.redo)?;
    night = masked(plan, night, &products, options, &mut notes)?;
    let (around, wanted) = plan.around_shard(request.number)?;
    let exposures = plan.exposures(around.iter().copied(), &config, &night.target_names())?;
    let survey = Survey { targets: exposures, ..Survey::default() };
    notes.extend(options.memory().check(&survey, &night)?);
    make_folder_of(request.out)?;
    let numbers = around.iter().map(|frame| frame.number).collect();
    let targets = TargetFrames { exposures: &survey.targets, numbers, wanted };
    let (measured, _) = target_stage(&targets, &night, &products, options, progress, &mut notes)?;
    let mut rows: Vec<PhotometryRow> = measured.into_iter().map(|f| f.row).collect();
    for (row, frame) in rows.iter_mut().zip(&frames) {
        if row.frame_sha256.is_empty() {
            row.frame_sha256.clone_from(&frame.sha256);
        } else if row.frame_sha256 != frame.sha256 {
            return Err(changed(&frame.path));
        }
    }
    rows.extend(night_rows);
    let mut meta = table_meta(&config, night.zeropoint.as_ref(), &Provenance::of_plan(plan, &config)?);
    meta.push("data_mode", plan.data_mode.name());
    meta.set("schema", SHARD_SCHEMA);
    meta.push("made_of", made_of.as_str());
    meta.with_rows_hash();
    write_photometry(request.out, &rows, &meta)?;
    let bytes: u64 = frames.iter().map(|f| f.bytes).sum();
    notes.extend(products.notes());
    let (kept, made) = products.counts();
    if kept > 0 {
        notes.push(format!("{kept} of {} frames kept from an earlier run", kept + made));
    }
    let side = json!({
        "shard": request.number,
        "table": request.out.file_name().map(|n| n.to_string_lossy()),
        "tool": TOOL,
        "made_of": made_of,
        "config_sha256": plan.config_sha256,
        "system": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        "threads": options.threads(),
        "frames": frames.len(),
        "frames_kept": kept,
        "bytes": bytes,
        "wall_s": progress.elapsed_s(),
        "cpu_s": progress.cpu_s(),
        "peak_memory_mb": peak_memory_mb(),
        "counts": counts(&rows[..frames.len()]),
        "notes": notes,
    });
    save(&sidecar(request.out), &format!("{side:#}\n"))?;
    products.clear();
    Ok(Measured { rows, there_already: false, notes })
}

/// The night of a plan as its target frames need it, from the zeropoint and the facts of the stars next to it, and the master
/// flat.
pub(super) fn night_of_plan(
    plan: &Plan,
    given: (Option<&Path>, Option<&Path>),
    products: &FrameCache,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<(Calibrated, Option<StarFacts>)> {
    let (night, facts) = calibrated(plan, given, options, progress, notes)?;
    Ok((masked(plan, night, products, options, notes)?, facts))
}

/// The same before the hot pixels.
fn calibrated(
    plan: &Plan,
    (path, flat): (Option<&Path>, Option<&Path>),
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<(Calibrated, Option<StarFacts>)> {
    // the zeropoint is fitted already: the star catalogue is not needed
    let prepared = Prepared::prepare(&Config { stars: None, ..plan.config()? })?;
    let facts = path.map(|path| StarFacts::read(path, plan)).transpose()?;
    let (mut zeropoint, mut seeing) = (None, Seeing::default());
    if let (Some(facts), Some(path)) = (&facts, path) {
        zeropoint = if facts.zeropoint { Some(Zeropoint::read(path)?) } else { None };
        let StarFacts { width, profile, camera_turn, .. } = *facts;
        seeing = Seeing { width, profile, camera_turn, growth: None };
    }
    let flattened = flat_of_plan(plan, (flat, path, false), prepared, options, progress, notes)?;
    let night = Calibrated { flattened, seeing, zeropoint };
    if let Some(facts) = facts.as_ref().filter(|f| f.flat_sha256 != night.flat_sha256) {
        let problem = format!(
            "the master flat ({}) is not the one the zeropoint was made with ({}); give that one with argument `flat`",
            night.flat_sha256, facts.flat_sha256
        );
        return Err(Error::Mismatch { problem });
    }
    Ok((night, facts))
}

/// The night with the hot pixels that its star frames show.
fn masked(
    plan: &Plan,
    mut night: Calibrated,
    products: &FrameCache,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Calibrated> {
    if night.config.detector.mask_hot_pixels {
        let stars = plan.exposures(plan.of_role(InputRole::STARS), &plan.config()?, &night.target_names())?;
        night.flattened = with_hot_pixels(night.flattened, &pointings_of(plan, stars), products, options, notes)?;
    }
    Ok(night)
}

/// The file with times and memory next to the table of a shard.
#[must_use]
pub fn sidecar(table: &Path) -> PathBuf {
    table.with_extension("json")
}

/// Frames by status.
fn counts(rows: &[PhotometryRow]) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    rows.iter().for_each(|r| *counts.entry(r.status.as_str()).or_default() += 1);
    counts
}

/// Hash over everything the table of a shard depends on: version, configuration, frames, calibration, elements.
fn made_of(plan: &Plan, request: &Request, night: &Calibrated) -> Result<String> {
    let text = |path: Option<PathBuf>| -> Result<String> {
        path.map_or(Ok(String::new()), |p| std::fs::read_to_string(&p).map_err(|e| Error::io(&p, e)))
    };
    let zeropoint = text(request.zeropoint.map(Path::to_path_buf))?;
    let facts = text(request.zeropoint.map(super::reduce::facts_path))?;
    let inputs = plan.inputs_sha256();
    let force_age = plan.config()?.orbit.is_some_and(|o| o.force_age).to_string();
    let mut parts =
        vec![SHARD_SCHEMA, TOOL, &plan.config_sha256, &inputs, &zeropoint, &facts, &night.flat_sha256, &force_age];
    parts.extend(plan.files.iter().flat_map(|f| [f.role.as_str(), f.sha256.as_str()]));
    let frames = plan.shard(request.number)?;
    parts.extend(frames.iter().map(|f| f.sha256.as_str()));
    Ok(key(&parts))
}

/// The rows of a table that is there already, if it is made of the same and nothing of it was changed since.
fn same_table(path: &Path, made_of: &str, frames: &[&PlannedFrame]) -> Option<Vec<PhotometryRow>> {
    let (rows, meta): (Vec<PhotometryRow>, Meta) = path.is_file().then(|| read_photometry(path).ok()).flatten()?;
    let same = meta.get("made_of") == Some(&MetaValue::Text(made_of.into()))
        && check_rows_hash(path).is_ok()
        && frames.iter().all(|frame| rows.iter().any(|row| row.frame_sha256 == frame.sha256));
    same.then_some(rows)
}
