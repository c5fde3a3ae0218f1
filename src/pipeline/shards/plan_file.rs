//! plan.json: every file a night is made of, with its hash, and the shards its target frames are measured in.
//!
//! Bytes. The same files and configuration give the same plan; what a shard holds follows from the plan alone. Paths are
//! as the maker of the plan saw them: workers run in the same folder. It does not cover how frames got their roles
//! (`survey`).

use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::stages::bias_and_dark;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::products::{FrameCache, key};
use crate::bands::Light;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::file::make_folder_of;
use crate::base::file::write_atomic;
use crate::base::progress::Progress;
use crate::base::threads::with_threads;
use crate::config::Config;
use crate::config::digest::config_sha256;
use crate::export::DataMode;
use crate::frames::{Detector, Exposure, Role, classify};
use crate::pipeline::options::Options;
use crate::pipeline::products::inputs::InputRole;
use crate::pipeline::products::inputs::TOOL;
use crate::pipeline::products::inputs::data_mode;
use crate::pipeline::products::inputs::inputs_sha256;
use crate::pipeline::products::inputs::named_files;
use crate::pipeline::products::inputs::simulation_seed;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::preflight::preflight;
use crate::pipeline::target::pilots::{REACH, is_pilot, numbers};

/// Target frames of a shard by default: a few minutes of work, compared with seconds to start a worker.
pub const FRAMES_PER_SHARD: usize = 100;
/// The schema of a plan.
const SCHEMA: &str = "satphot.plan/2";

/// A night divided into shards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// `satphot.plan/2`.
    pub schema: String,
    /// The program that made it and must also measure its shards.
    pub tool: String,
    /// Hash of the configuration, as in the tables.
    pub config_sha256: String,
    /// Whether the frames are real.
    pub data_mode: DataMode,
    /// Seed of simulated frames.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub seed: Option<i64>,
    /// The filter that is reduced.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub light: Option<Light>,
    /// Files besides the frames: catalogue, elements, master flat, zeropoint of another night, satellites, band.
    pub files: Vec<PlannedFile>,
    /// Target frames of a shard, at most.
    pub frames_per_shard: usize,
    /// The shards, each the places of its frames in `frames`.
    pub shards: Vec<Vec<usize>>,
    /// Every frame, in the order of the night: flats, stars, target, others, unreadable ones.
    pub frames: Vec<PlannedFrame>,
    /// The whole configuration in force: a worker needs no other file of it.
    pub config_toml: String,
}

/// A file that is not a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedFile {
    /// The key of the configuration that names it.
    pub role: String,
    /// Where it is.
    #[serde(with = "crate::base::path_text")]
    pub path: PathBuf,
    /// First 16 hex digits of its SHA-256.
    pub sha256: String,
}

/// One frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedFrame {
    /// Where it is.
    #[serde(with = "crate::base::path_text")]
    pub path: PathBuf,
    /// Its role.
    pub role: InputRole,
    /// Why; of an unreadable file, what is wrong with it.
    pub reason: String,
    /// Number of its star pointing.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub pointing: Option<usize>,
    /// Number of a target frame in its night ([`crate::pipeline::target::pilots::numbers`]).
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub number: Option<usize>,
    /// Size \[bytes\].
    pub bytes: u64,
    /// Time of the last change, since 1970 \[s\]: a quick sign that the plan is old; the hash decides.
    pub mtime_s: Option<u64>,
    /// First 16 hex digits of the SHA-256 of its header cards; empty if there is no header.
    pub header_sha256: String,
    /// First 16 hex digits of the SHA-256 of the file; empty if it cannot be read, or is refused and larger than 4 GB.
    pub sha256: String,
}

/// Plans a night: every header read, every frame hashed; with what should be known of it.
///
/// # Errors
/// As a run, before its work begins.
pub fn make_plan(
    config: &Config,
    frames_per_shard: usize,
    options: &Options,
    progress: &dyn Progress,
) -> Result<(Plan, Vec<String>)> {
    let (_, mut survey, mut notes) = preflight(config, &options.files, &options.stop)?.ready()?;
    let n_zero = bias_and_dark(&survey, config).count();
    if n_zero > 0 {
        let problem = format!(
            "{n_zero} bias and dark frames would be subtracted, which the shards of a plan do not do; set it to true to \
             subtract detector.pedestal_adu alone, or reduce the night in one run"
        );
        return Err(Error::Config { key: "frames.skip_bias_dark".into(), problem });
    }
    let detector = Detector::from_config(&config.detector)?;
    let lights = survey.pointings.iter().flatten().chain(&survey.targets);
    if lights.take(1).any(|first| detector.overscan_adu(first).is_ok_and(|level| level.is_some())) {
        let problem = "the overscan of the frames (BIASSEC) would be subtracted, which the shards of a plan do not do; set it \
                       to false to subtract detector.pedestal_adu alone, or reduce the night in one run";
        return Err(Error::Config { key: "detector.use_overscan".into(), problem: problem.into() });
    }
    let products = FrameCache::default();
    let all: Vec<&Exposure> =
        survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets).collect();
    progress.stage("hashes", all.len());
    let hash = |exposure: &&Exposure| -> Result<()> {
        options.stop.check(|| "stopped before the plan was made".into())?;
        // a file that cannot be read is reported when it is measured
        let bytes = products.sha256(&exposure.path).ok().and_then(|_| std::fs::metadata(&exposure.path).ok());
        progress.read(bytes.map_or(0, |m| m.len()));
        progress.tick();
        Ok(())
    };
    with_threads(options.jobs, || all.par_iter().try_for_each(hash))??;
    progress.done();
    set_copies_aside(&mut survey, &products, &mut notes);
    let plan = with_threads(options.jobs, || Plan::of(&survey, config, &products, frames_per_shard))??;
    Ok((plan, notes))
}

impl Plan {
    /// The plan of a night, target frames in shards of `frames_per_shard`. Files whose hash is not known yet are read, by
    /// all threads of the pool.
    ///
    /// # Errors
    /// [`Error::Io`] for a file of the configuration; [`Error::Config`].
    pub fn of(survey: &Survey, config: &Config, products: &FrameCache, frames_per_shard: usize) -> Result<Self> {
        if frames_per_shard == 0 {
            let problem = "must be at least 1; 50 to 200 frames keep a worker busy for minutes".into();
            return Err(Error::Argument { name: "frames_per_shard".into(), problem });
        }
        let stars = survey.pointings.iter().enumerate().flat_map(|(n, p)| p.iter().map(move |e| (e, Some(n))));
        let mut exposures: Vec<(&Exposure, Option<usize>)> = survey.flats.iter().map(|e| (e, None)).collect();
        exposures.extend(stars);
        exposures.extend(survey.targets.iter().chain(&survey.others).map(|e| (e, None)));
        let mut frames: Vec<PlannedFrame> = exposures.par_iter().map(|(e, n)| planned(e, *n, products)).collect();
        let of_targets = frames.iter_mut().filter(|f| f.role == InputRole::TARGET);
        of_targets.zip(numbers(&survey.targets)).for_each(|(frame, number)| frame.number = number);
        frames.extend(survey.unreadable.iter().map(|u| {
            let problem = u.error.to_string().replace(&*u.path.to_string_lossy(), &file_name(&u.path));
            file(&u.path, InputRole::Unreadable, &problem, products)
        }));
        frames.extend(survey.set_aside.iter().map(|s| file(&s.path, InputRole::SetAside, &s.reason, products)));
        let targets: Vec<usize> = (0..frames.len()).filter(|i| frames[*i].role == InputRole::TARGET).collect();
        let mut shards: Vec<Vec<usize>> = targets.chunks(frames_per_shard).map(<[usize]>::to_vec).collect();
        if shards.is_empty() {
            shards.push(Vec::new()); // one without target frames, which reports the flats and the stars
        }
        Ok(Self {
            schema: SCHEMA.into(),
            tool: TOOL.into(),
            config_sha256: config_sha256(config)?,
            data_mode: data_mode(survey),
            seed: simulation_seed(survey),
            light: survey.light.clone(),
            files: files(config, products)?,
            frames_per_shard,
            shards,
            frames,
            config_toml: config.to_toml()?,
        })
    }

    /// Reads a plan of this version of the program.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] for a file that is not a plan; [`Error::Mismatch`] for one of another version.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let plan: Plan = serde_json::from_str(&text).map_err(|e| Error::Table {
            path: path.into(),
            line: Some(e.line()),
            problem: format!("not a plan of `plan`: {e}"),
        })?;
        if plan.schema != SCHEMA || plan.tool != TOOL {
            let problem = format!(
                "{}: a plan of {} ({}), this is {TOOL} ({SCHEMA}); plan again, and use one version for all shards",
                path.display(),
                plan.tool,
                plan.schema
            );
            return Err(Error::Mismatch { problem });
        }
        // every target frame is in one shard, once
        let mut shared: Vec<usize> = plan.shards.iter().flatten().copied().collect();
        shared.sort_unstable();
        let targets = (0..plan.frames.len()).filter(|i| plan.frames[*i].role == InputRole::TARGET);
        let whole = shared.into_iter().eq(targets) && !plan.shards.is_empty();
        if !whole || config_sha256(&plan.config()?)? != plan.config_sha256 {
            let problem = format!("{}: was changed by hand; plan again", path.display());
            return Err(Error::Mismatch { problem });
        }
        Ok(plan)
    }

    /// Writes it as JSON.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, path: &Path) -> Result<()> {
        let problem = |e: serde_json::Error| Error::Table { path: path.into(), line: None, problem: e.to_string() };
        let text = serde_json::to_string_pretty(self).map_err(problem)?;
        make_folder_of(path)?;
        write_atomic(path, (text + "\n").as_bytes())
    }

    /// The configuration in it.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn config(&self) -> Result<Config> {
        Config::from_text(&self.config_toml, &[])
    }

    /// Hash over names and hashes of all frames, as in the tables of the night.
    #[must_use]
    pub fn inputs_sha256(&self) -> String {
        inputs_sha256(self.frames.iter().map(|f| (f.path.as_path(), f.sha256.as_str())))
    }

    /// The frames of a role.
    pub fn of_role(&self, role: InputRole) -> impl Iterator<Item = &PlannedFrame> {
        self.frames.iter().filter(move |f| f.role == role)
    }

    /// The frames of a shard.
    ///
    /// # Errors
    /// [`Error::Config`] for a number that is none of its shards.
    pub fn shard(&self, number: usize) -> Result<Vec<&PlannedFrame>> {
        let places = self.shards.get(number).ok_or_else(|| Error::Argument {
            name: "shard".into(),
            problem: format!("{number}; this plan has the shards 0 to {}", self.shards.len().saturating_sub(1)),
        })?;
        Ok(places.iter().map(|i| &self.frames[*i]).collect())
    }

    /// The frames of a shard and the pilots beside them, in the order of the night; and which are its own.
    ///
    /// # Errors
    /// As [`Self::shard`].
    pub fn around_shard(&self, number: usize) -> Result<(Vec<&PlannedFrame>, Range<usize>)> {
        let own = self.shard(number)?;
        let numbers: Vec<usize> = own.iter().filter_map(|frame| frame.number).collect();
        let near = numbers
            .iter()
            .min()
            .zip(numbers.iter().max())
            .map(|(first, last)| first.saturating_sub(REACH)..=last + REACH);
        let is_pilot_near = |frame: &PlannedFrame| {
            frame.number.zip(near.as_ref()).is_some_and(|(n, near)| is_pilot(n) && near.contains(&n))
        };
        let before: usize = self.shards[..number].iter().map(Vec::len).sum();
        let places = before..before + own.len();
        let mut frames: Vec<(usize, &PlannedFrame)> = self.of_role(InputRole::TARGET).enumerate().collect();
        frames.retain(|(k, frame)| places.contains(k) || is_pilot_near(frame));
        let first = frames.iter().filter(|(k, _)| *k < before).count();
        let frames = frames.into_iter().map(|(_, frame)| frame).collect();
        Ok((frames, first..first + places.len()))
    }

    /// Checks that the files of the given roles are unchanged; frames are not among them.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Mismatch`] naming the file.
    pub fn check_files(&self, roles: &[&str], products: &FrameCache) -> Result<()> {
        for file in self.files.iter().filter(|f| roles.contains(&f.role.as_str())) {
            if products.sha256(&file.path)? != file.sha256 {
                return Err(changed(&file.path));
            }
        }
        Ok(())
    }

    /// The exposures of planned frames, their headers read again.
    ///
    /// # Errors
    /// [`Error::NoInput`] for a file that is gone, [`Error::Mismatch`] for one that is not what it was.
    pub fn exposures<'a>(
        &self,
        frames: impl Iterator<Item = &'a PlannedFrame>,
        config: &Config,
        target_names: &[String],
    ) -> Result<Vec<Exposure>> {
        let frames: Vec<&PlannedFrame> = frames.collect();
        let exposure = |frame: &&PlannedFrame| -> Result<Exposure> {
            let bytes = std::fs::metadata(&frame.path).map(|m| m.len()).map_err(|e| Error::NoInput {
                path: frame.path.clone(),
                problem: format!(
                    "is in the plan but cannot be read here ({e}); is the folder mounted on this machine?"
                ),
            })?;
            let now = classify(&frame.path, config, target_names).map_err(|e| match e {
                Error::Io { .. } => e,
                _ => changed(&frame.path),
            })?;
            if bytes != frame.bytes || header_sha256(&now) != frame.header_sha256 {
                return Err(changed(&frame.path));
            }
            Ok(now)
        };
        frames.par_iter().map(exposure).collect()
    }
}

/// A file is not the one of the plan.
pub(super) fn changed(path: &Path) -> Error {
    Error::Mismatch { problem: format!("{}: is not what it was when the plan was made; plan again", path.display()) }
}

/// Files of the configuration that results depend on.
fn files(config: &Config, products: &FrameCache) -> Result<Vec<PlannedFile>> {
    let file = |(role, path): (&str, PathBuf)| {
        let sha256 = products.sha256(&path)?;
        Ok(PlannedFile { role: role.into(), path, sha256 })
    };
    named_files(config).into_iter().map(file).collect()
}

fn planned(exposure: &Exposure, pointing: Option<usize>, products: &FrameCache) -> PlannedFrame {
    let frame = file(&exposure.path, InputRole::Frame(exposure.role), &exposure.role_reason, products);
    PlannedFrame { pointing, header_sha256: header_sha256(exposure), ..frame }
}

fn file(path: &Path, role: InputRole, reason: &str, products: &FrameCache) -> PlannedFrame {
    let meta = std::fs::metadata(path).ok();
    let mtime = meta.as_ref().and_then(|m| m.modified().ok()).and_then(|t| t.duration_since(UNIX_EPOCH).ok());
    PlannedFrame {
        path: path.to_path_buf(),
        role,
        reason: reason.into(),
        pointing: None,
        number: None,
        bytes: meta.map_or(0, |m| m.len()),
        mtime_s: mtime.map(|t| t.as_secs()),
        header_sha256: String::new(),
        sha256: products.sha256_of_refused(path),
    }
}

/// Hash of the cards of a header.
fn header_sha256(exposure: &Exposure) -> String {
    let cards: Vec<String> = exposure.header.cards().iter().map(|card| format!("{card:?}")).collect();
    let texts: Vec<&str> = cards.iter().map(String::as_str).collect();
    key(&texts)[..16].to_owned()
}

/// Sets target frames aside that are copies of others: an exposure counts once. Returns their places among the targets.
pub fn set_copies_aside(survey: &mut Survey, products: &FrameCache, notes: &mut Vec<String>) -> Vec<usize> {
    let mut first_of: BTreeMap<String, String> = BTreeMap::new();
    let mut copies = Vec::new();
    for (place, exposure) in survey.targets.iter().enumerate() {
        let Ok(hash) = products.sha256(&exposure.path) else { continue };
        match first_of.get(&hash) {
            Some(first) => copies.push((place, first.clone())),
            None => _ = first_of.insert(hash, exposure.name.clone()),
        }
    }
    for (place, first) in copies.iter().rev() {
        let mut copy = survey.targets.remove(*place);
        let reason = format!("a copy of {first}, which counts once");
        notes.push(format!("{}: {reason}", copy.name));
        (copy.role, copy.role_reason) = (Role::Ignored, reason);
        survey.others.push(copy);
    }
    copies.into_iter().map(|(place, _)| place).collect()
}

impl Provenance {
    /// The provenance of a plan and its configuration: the hashes of the files are those of the plan, whether they can
    /// be read here or not.
    ///
    /// # Errors
    /// The errors of [`Provenance::of`].
    pub fn of_plan(plan: &Plan, config: &Config) -> Result<Self> {
        let hash = |path: &Path| plan.files.iter().find(|f| f.path == path).map(|f| f.sha256.clone());
        Self::hashed(config, Some(&plan.inputs_sha256()), plan.seed, &hash)
    }
}
