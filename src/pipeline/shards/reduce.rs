//! The steps that take many frames and come before the shards: the master flat, and the stars with the zeropoint.
//!
//! Each leaves a file for people and tools (`master_flat.fits`, `zeropoint.toml`, `stars.ecsv`) and next to it one with
//! what the next step must know: `master_flat.flats.toml`, what became of each flat; `zeropoint.stars.toml`, what the
//! stars determine of camera and seeing, and the rows of frames that were excluded. It does not cover the shards
//! ([`super::shard`]).

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::plan_file::Plan;
use super::products::{FOLDER, FrameCache};
use crate::astrometry::field_rotation::CameraTurn;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::file::make_folder_of;
use crate::base::file::save;
use crate::base::hash::sha256_16;
use crate::base::progress::Progress;
use crate::config::Config;
use crate::frames::flat::{FlatMember, MasterFlat};
use crate::frames::{Exposure, ZeroLevels};
use crate::photometry::growth::{StarProfile, StarWidth};
use crate::pipeline::hot_pixels::with_hot_pixels;
use crate::pipeline::options::Options;
use crate::pipeline::prepared::{Flattened, Prepared};
use crate::pipeline::products::inputs::InputRole;
use crate::pipeline::products::inputs::TOOL;
use crate::pipeline::products::meta::{set_band, table_meta};
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::stages::master_flat;
use crate::pipeline::stages::rejected_flats;
use crate::pipeline::stars::stage::star_stage;
use crate::pipeline::stars::zeropoint::zeropoint_stage;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::filters::{agree_on_band, check_master};
use crate::pipeline::survey::scale::check_stars;
use crate::tables::{PhotometryRow, write_stars};
use crate::zeropoint::fit::NO_ZEROPOINT;
use crate::zeropoint::fit::Zeropoint;
use crate::zeropoint::previous::conditions;

/// What became of each flat: `master_flat.flats.toml` next to `master_flat.fits`.
#[derive(Debug, Serialize, Deserialize)]
struct Flats {
    tool: String,
    config_sha256: String,
    /// Hash of the master flat this is about.
    flat_sha256: String,
    /// Share of its pixels that are masked.
    masked_frac: f64,
    #[serde(default)]
    flats: Vec<FlatMember>,
}

/// The results of the stars that target frames need: `zeropoint.stars.toml` next to `zeropoint.toml`.
#[derive(Debug, Serialize, Deserialize)]
pub struct StarFacts {
    /// The program.
    pub tool: String,
    /// Hash of the configuration.
    pub config_sha256: String,
    /// Hash of the master flat of the star frames; empty without one.
    pub flat_sha256: String,
    /// Whether zeropoint.toml holds a zeropoint.
    pub zeropoint: bool,
    /// Why there is none, where there should be one.
    #[serde(default)]
    pub poor: Vec<String>,
    /// How wide the stars are.
    pub width: Option<StarWidth>,
    /// The rotation of the camera on the sky.
    pub camera_turn: Option<CameraTurn>,
    /// Profile of the stars.
    pub profile: Option<StarProfile>,
    /// Rows of star frames that failed, and of flats that were rejected.
    #[serde(default)]
    pub rows: Vec<PhotometryRow>,
}

/// Where the facts next to a zeropoint are.
#[must_use]
pub fn facts_path(zeropoint: &Path) -> PathBuf {
    zeropoint.with_extension("stars.toml")
}

impl StarFacts {
    /// Reads the facts next to a zeropoint of this plan.
    ///
    /// # Errors
    /// [`Error::NoInput`] without them; [`Error::Mismatch`] for those of another plan.
    pub fn read(zeropoint: &Path, plan: &Plan) -> Result<Self> {
        let path = facts_path(zeropoint);
        let text = std::fs::read_to_string(&path).map_err(|e| Error::NoInput {
            path: path.clone(),
            problem: format!("{e}; `zeropoint` with argument `plan` writes it next to {}", file_name(zeropoint)),
        })?;
        let facts: Self = toml::from_str(&text).map_err(|e| table(&path, e.to_string()))?;
        if (facts.tool.as_str(), facts.config_sha256.as_str()) != (TOOL, plan.config_sha256.as_str()) {
            return Err(of_another(&path, "`zeropoint` with argument `plan`"));
        }
        Ok(facts)
    }
}

fn table(path: &Path, problem: String) -> Error {
    Error::Table { path: path.into(), line: None, problem }
}

fn of_another(path: &Path, again: &str) -> Error {
    let problem = format!("{}: was made by another plan or version; run {again} of this plan again", path.display());
    Error::Mismatch { problem }
}

fn toml_text<T: Serialize>(path: &Path, comment: &str, value: &T) -> Result<String> {
    Ok(format!("# {comment}\n{}", toml::to_string(value).map_err(|e| table(path, e.to_string()))?))
}

/// Products next to a file.
fn products_next_to(file: &Path, night: &Prepared, options: &Options) -> Result<FrameCache> {
    let folder = file.parent().unwrap_or(Path::new("")).join(FOLDER);
    FrameCache::in_folder(folder, night, options.redo)
}

/// Makes the master flat of a plan.
///
/// # Errors
/// [`Error::Flat`]; [`Error::Mismatch`] where a flat is not that of the plan; [`Error::Io`].
pub fn plan_flat(
    plan: &Plan,
    out: &Path,
    options: &Options,
    progress: &dyn Progress,
) -> Result<(MasterFlat, Vec<String>)> {
    // neither catalogue nor elements need to be there; the provenance of the flat is that of the whole configuration
    let config = plan.config()?;
    let mut night = Prepared::prepare(&Config { stars: None, orbit: None, model: None, ..config.clone() })?;
    night.config = config.clone();
    if plan.of_role(InputRole::FLAT).next().is_none() || config.flat.master.is_some() {
        let problem = match &config.flat.master {
            Some(path) => format!("the plan takes the master flat {} (flat.master)", path.display()),
            None => "the plan has no flats (IMAGETYP, or patterns in [frames] flat)".into(),
        };
        return Err(Error::Flat { problem });
    }
    let mut notes = Vec::new();
    let flattened = make_flat(plan, out, night, options, progress, &mut notes)?;
    let flat = flattened.flat.ok_or_else(|| Error::Flat { problem: "none was made".into() })?;
    Ok((flat, notes))
}

/// The night with the master flat of the plan, made into `out` or found there.
fn make_flat(
    plan: &Plan,
    out: &Path,
    night: Prepared,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Flattened> {
    make_folder_of(out)?;
    let products = products_next_to(out, &night, options)?;
    let flats = plan.exposures(plan.of_role(InputRole::FLAT), &plan.config()?, &[])?;
    let survey = Survey { flats, ..Survey::default() };
    let night = master_flat(&survey, night, (&products, Some(out)), options, progress, notes)?;
    for frame in plan.of_role(InputRole::FLAT) {
        if products.sha256(&frame.path)? != frame.sha256 {
            return Err(super::plan_file::changed(&frame.path));
        }
    }
    let Some(flat) = &night.flat else { return Ok(night) };
    let flats = Flats {
        tool: TOOL.into(),
        config_sha256: plan.config_sha256.clone(),
        flat_sha256: night.flat_sha256.clone(),
        masked_frac: flat.masked_frac,
        flats: flat.members.iter().map(|m| FlatMember { path: file_name(&m.path).into(), ..m.clone() }).collect(),
    };
    let path = out.with_extension("flats.toml");
    save(&path, &toml_text(&path, "What became of each flat.", &flats)?)?;
    Ok(night)
}

/// What became of the flats of a master, and the share of it that is masked; `None` if no file next to it
/// says so.
///
/// # Errors
/// [`Error::Table`] for a file that cannot be read.
pub(super) fn flats_next_to(master: &Path) -> Result<Option<(Vec<FlatMember>, f64)>> {
    let of_flats = master.with_extension("flats.toml");
    let Ok(text) = std::fs::read_to_string(&of_flats) else { return Ok(None) };
    let flats: Flats = toml::from_str(&text).map_err(|e| table(&of_flats, e.to_string()))?;
    Ok(Some((flats.flats, flats.masked_frac)))
}

/// The night with its master flat: the configured one, `given`, that next to `near`, or (with `make`) one made there.
///
/// # Errors
/// [`Error::Flat`] where there is none; [`Error::Mismatch`] for one of another plan.
pub(super) fn flat_of_plan(
    plan: &Plan,
    (given, near, make): (Option<&Path>, Option<&Path>, bool),
    night: Prepared,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Flattened> {
    let clip = night.config.photometry.clip_radius_px;
    if given.is_none() && (night.config.flat.master.is_some() || plan.of_role(InputRole::FLAT).next().is_none()) {
        return master_flat(&Survey::default(), night, (&FrameCache::default(), None), options, progress, notes);
    }
    let master_near = near.map(|near| near.with_file_name("master_flat.fits"));
    let path = match (given.map(Path::to_path_buf), master_near) {
        (Some(path), _) => path,
        (None, Some(path)) if make => return make_flat(plan, &path, night, options, progress, notes),
        (None, Some(path)) if path.is_file() => path,
        _ => {
            let problem = "this night has flats: make the master as master_flat.fits (`flat` with argument `plan`) and \
                           name it with argument `flat`, or put it into the folder of the zeropoint";
            return Err(Error::Flat { problem: problem.into() });
        }
    };
    if let Some(light) = &plan.light {
        notes.extend(check_master(&path, light, &night.config)?);
    }
    let flat = MasterFlat::read(&path, clip, &night.config.flat)?;
    let flat_sha256 = sha256_16(&path)?;
    let of_flats = path.with_extension("flats.toml");
    let members = match std::fs::read_to_string(&of_flats) {
        Err(_) => Vec::new(), // a master of another program has none
        Ok(text) => {
            let flats: Flats = toml::from_str(&text).map_err(|e| table(&of_flats, e.to_string()))?;
            if flats.flat_sha256 != flat_sha256 || flats.config_sha256 != plan.config_sha256 {
                return Err(of_another(&of_flats, "`flat` with argument `plan`"));
            }
            flats.flats
        }
    };
    Ok(Flattened {
        flat: Some(MasterFlat { members, ..flat }),
        flat_sha256,
        zero: ZeroLevels::default(),
        hot: Vec::new(),
        prepared: night,
    })
}

/// The star frames of a plan by pointing.
pub(super) fn pointings_of(plan: &Plan, exposures: Vec<Exposure>) -> Vec<Vec<Exposure>> {
    let mut pointings: Vec<Vec<Exposure>> = Vec::new();
    for (exposure, frame) in exposures.into_iter().zip(plan.of_role(InputRole::STARS)) {
        let number = frame.pointing.unwrap_or(0);
        pointings.resize_with(pointings.len().max(number + 1), Vec::new);
        pointings[number].push(exposure);
    }
    pointings
}

/// The results of the stars of a plan.
#[derive(Debug)]
pub struct PlannedStars {
    /// The zeropoint in force.
    pub zeropoint: Option<Zeropoint>,
    /// Star measurements.
    pub n_rows: usize,
    /// Why the night is not good enough for exit code 0.
    pub poor: Vec<String>,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

/// Measures the star frames of a plan, fits the zeropoint (or takes the configured one) and writes `out`, `stars.ecsv` and
/// the facts next to it; a night without a zeropoint gets an `out` that says so.
///
/// # Errors
/// Anything that is missing before the work begins; [`Error::Mismatch`] if a frame is not that of the plan;
/// [`Error::Io`].
pub fn plan_zeropoint(
    plan: &Plan,
    (flat, out): (Option<&Path>, &Path),
    options: &Options,
    progress: &dyn Progress,
) -> Result<PlannedStars> {
    let config = plan.config()?;
    let mut night = Prepared::prepare(&config)?;
    let products = products_next_to(out, &night, options)?;
    plan.check_files(&["stars.catalogue", "flat.master", "zeropoint.previous"], &products)?;
    let mut notes = Vec::new();
    let mut poor = Vec::new();
    let mut survey = Survey { light: plan.light.clone(), ..Survey::default() };
    let exposures = plan.exposures(plan.of_role(InputRole::STARS), &config, &night.target_names())?;
    survey.pointings = pointings_of(plan, exposures);
    notes.extend(agree_on_band(&survey, &mut night, true)?);
    notes.extend(options.memory().check(&survey, &night)?);
    notes.extend(check_stars(&survey, &night, &products, options.jobs)?);
    let night = flat_of_plan(plan, (flat, Some(out), true), night, options, progress, &mut notes)?;
    let night = with_hot_pixels(night, &survey.pointings, &products, options, &mut notes)?;
    let mut stars = star_stage(&survey, &night, &products, options, progress, &mut notes)?;
    for frame in plan.of_role(InputRole::STARS) {
        if products.sha256(&frame.path).is_ok_and(|now| now != frame.sha256) {
            return Err(super::plan_file::changed(&frame.path));
        }
    }
    let mut rows = std::mem::take(&mut stars.rows);
    let zeropoint = zeropoint_stage(&mut rows, &stars.failed, &night, &mut poor, &mut notes)?;
    notes.extend(products.notes());
    let provenance = Provenance::of_plan(plan, &config)?;
    let mut meta = table_meta(&config, zeropoint.as_ref(), &provenance);
    if zeropoint.is_none() {
        set_band(&mut meta, night.band.as_ref());
    }
    let text = match &zeropoint {
        Some(zeropoint) => zeropoint.to_toml(&[conditions(&config, night.flat.is_some())]),
        None => format!("{NO_ZEROPOINT}: magnitudes stay instrumental.\n"),
    };
    let mut failed = std::mem::take(&mut stars.failed);
    failed.extend(rejected_flats(&night));
    let facts = StarFacts {
        tool: TOOL.into(),
        config_sha256: plan.config_sha256.clone(),
        flat_sha256: night.flat_sha256.clone(),
        zeropoint: zeropoint.is_some(),
        poor: poor.clone(),
        width: stars.seeing.width,
        camera_turn: stars.seeing.camera_turn,
        profile: stars.seeing.profile,
        rows: failed,
    };
    save(out, &(text + &provenance.toml_comment()))?;
    if config.stars.is_some() {
        write_stars(&out.with_file_name("stars.ecsv"), &rows, &meta)?;
    }
    let path = facts_path(out);
    save(
        &path,
        &toml_text(&path, "What target frames must know of the stars; read where shards are measured.", &facts)?,
    )?;
    Ok(PlannedStars { zeropoint, n_rows: rows.len(), poor, notes })
}
