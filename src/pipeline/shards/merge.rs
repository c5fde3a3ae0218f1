//! Shards to the table of the night: each frame once, in the order of the plan, then what takes all of them.
//!
//! The sum is the same in whatever order and grouping tables come. A sum that lacks frames holds the cells that more
//! frames would change as they were, in columns `raw_…`, so that it can be merged again; a complete one is final. It
//! does not cover the measuring ([`super::shard`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::manifest::write_manifest;
use super::plan_file::{Plan, PlannedFrame};
use super::products::FOLDER;
use super::shard::SHARD_SCHEMA;
use super::whole::judge_whole_night;
use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::file::make_folder_of;
use crate::base::file::save;
use crate::pipeline::compare::residual_rows;
use crate::pipeline::products::effective::effective_toml;
use crate::pipeline::products::inputs::InputRole;
use crate::pipeline::products::inputs::TOOL;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::products::verify::check_against_manifest;
use crate::pipeline::target::outcome::TargetFrame;
use crate::pipeline::target::row::{set_aside_row, unmeasured_row};
use crate::report::summary::{pass_table, stack_table};
use crate::tables::words::Status;
use crate::tables::{
    Meta, MetaValue, PartialRow, PassStackRow, PhotometryRow, RawRow, check_rows_hash, names_rows_hash,
    read_photometry, read_rows, write_photometry, write_residuals, write_rows,
};

/// The schema in the meta block of a whole night.
const NIGHT_SCHEMA: &str = "satphot.photometry/1";
/// Key of the meta block of a sum that lacks frames: how many.
const MISSING: &str = "missing_frames";
/// Shards and frames that are named one by one in a message.
const NAMED: usize = 10;

impl RawRow {
    fn of(row: &PhotometryRow) -> Self {
        Self {
            raw_limit_v_mag: row.limit_v_mag,
            raw_verdict: row.verdict.clone(),
            raw_reason: row.reason.clone(),
            raw_flags: row.flags,
        }
    }

    fn put_back(self, row: &mut PhotometryRow) {
        row.cadence_s = None;
        row.limit_v_mag = self.raw_limit_v_mag;
        (row.verdict, row.reason, row.flags) = (self.raw_verdict, self.raw_reason, self.raw_flags);
    }
}

/// The table of a night.
#[derive(Debug)]
pub struct Merged {
    /// Its rows, in the order of the night.
    pub rows: Vec<PhotometryRow>,
    /// As they were, where frames are missing.
    raw: Vec<RawRow>,
    meta: Meta,
    /// Whether the night has a model.
    modelled: bool,
    /// Missing shards, each with its missing frames.
    pub missing: BTreeMap<usize, Vec<String>>,
    /// Rows that were there more than once.
    pub n_twice: usize,
    /// The passes stacked, if that was requested ([`super::stack`]).
    pub stacks: Vec<PassStackRow>,
    /// Share of the night's frames that failed is above what the configuration allows.
    pub poor: Option<String>,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

/// One table, its rows as they were before the whole night was known.
struct Part {
    path: PathBuf,
    rows: Vec<PhotometryRow>,
    meta: Meta,
    /// The whole night, with nothing left to do.
    is_final: bool,
}

/// Brings tables of one plan together: shards, and sums of shards.
///
/// # Errors
/// [`Error::Mismatch`] for a table of another plan, zeropoint or version; [`Error::Table`]; [`Error::PoorNight`] naming
/// missing shards and frames, unless `allow_missing`.
pub fn merge(plan: &Plan, tables: &[PathBuf], allow_missing: bool) -> Result<Merged> {
    let mut parts = Vec::new();
    for path in tables {
        parts.push(part(plan, path)?);
    }
    for (part, path) in parts.iter().zip(tables) {
        if bare(&part.meta) != bare(&parts[0].meta) {
            let problem = format!(
                "{} and {} were not made with one zeropoint and configuration; measure the older one again",
                tables[0].display(),
                path.display()
            );
            return Err(Error::Mismatch { problem });
        }
    }
    // a whole night among them is the whole night already
    if let Some(whole) = parts.iter().position(|p| p.is_final) {
        parts = vec![parts.swap_remove(whole)];
    }
    let is_final = parts.iter().any(|p| p.is_final);
    let meta = parts.first().map(|p| p.meta.clone()).unwrap_or_default();
    let mut sum = MergedRows::new(plan);
    for part in parts {
        sum.take(part)?;
    }
    let missing = sum.missing();
    if !missing.is_empty() && !allow_missing {
        return Err(Error::PoorNight { problem: missing_note(&missing, plan) });
    }
    let config = plan.config()?;
    let mut notes = Vec::new();
    let n_twice = sum.n_twice;
    let (mut frames, others) = sum.into_rows();
    let mut raw: Vec<RawRow> = Vec::new();
    if !is_final || !missing.is_empty() {
        raw.extend(frames.iter().map(|f| RawRow::of(&f.row)).chain(others.iter().map(RawRow::of)));
    }
    if !is_final {
        judge_whole_night(&mut frames, &config, &mut notes);
    }
    let mut rows: Vec<PhotometryRow> = frames.into_iter().map(|f| f.row).collect();
    rows.extend(others);
    let n_missing: usize = missing.values().map(Vec::len).sum();
    let mut meta = bare(&meta);
    meta.set("schema", NIGHT_SCHEMA);
    if n_missing > 0 {
        meta.push(MISSING, n_missing as f64);
        meta.with_rows_hash();
        notes.push(missing_note(&missing, plan));
    }
    let science = plan
        .frames
        .iter()
        .filter(|f| matches!(f.role, InputRole::TARGET | InputRole::STARS | InputRole::Unreadable))
        .count();
    let failed = rows.iter().filter(|r| r.status == Status::Failed).count();
    let limit = config.night.max_failed_frac;
    let poor = (failed as f64 > limit * science.max(1) as f64).then(|| {
        format!("{failed} of {science} frames failed, more than the allowed share of {limit} (night.max_failed_frac)")
    });
    let (modelled, stacks) = (config.model.is_some(), Vec::new());
    Ok(Merged { rows, raw, meta, modelled, missing, n_twice, stacks, poor, notes })
}

/// Reads a table of this plan and puts its rows back to what they were.
fn part(plan: &Plan, path: &Path) -> Result<Part> {
    let (mut rows, mut meta) = read_photometry(path)?;
    let text = |key: &str| match meta.get(key) {
        Some(MetaValue::Text(text)) => text.clone(),
        _ => String::new(),
    };
    let inputs = plan.inputs_sha256();
    for (key, wanted) in
        [("tool", TOOL), ("config_sha256", &plan.config_sha256), ("input_manifest_sha256", inputs.as_str())]
    {
        if text(key) != wanted {
            let problem = format!(
                "{}: {key} is \"{}\", that of the plan \"{wanted}\"; measure the shard again by this plan",
                path.display(),
                text(key)
            );
            return Err(Error::Mismatch { problem });
        }
    }
    let schema = text("schema");
    let partial = meta.get(MISSING).is_some();
    if partial {
        let raw: Vec<RawRow> = read_rows(path)?.0;
        rows.iter_mut().zip(raw).for_each(|(row, raw)| raw.put_back(row));
    }
    if schema != SHARD_SCHEMA && schema != NIGHT_SCHEMA {
        let problem = format!("{}: schema \"{schema}\" is neither a shard nor a night", path.display());
        return Err(Error::Mismatch { problem });
    }
    match schema == SHARD_SCHEMA || partial || names_rows_hash(path)? {
        true => check_rows_hash(path)?,
        // a whole night has its hash in the manifest
        false => check_against_manifest(path)?,
    }
    meta.without_rows_hash();
    Ok(Part { path: path.to_path_buf(), rows, meta, is_final: schema == NIGHT_SCHEMA && !partial })
}

/// The meta block without the entries in which the shards and their sum differ.
fn bare(meta: &Meta) -> Meta {
    let is_of_one_file = |key: &str| matches!(key, "schema" | "made_of" | MISSING);
    let mut bare = Meta::default();
    bare.push("schema", "");
    bare.entries.extend(meta.entries.iter().filter(|(key, _)| !is_of_one_file(key)).cloned());
    bare
}

/// Rows by their place in the plan.
struct MergedRows<'a> {
    plan: &'a Plan,
    /// Places of target frames by name and hash.
    places: BTreeMap<(String, &'a str), usize>,
    /// Row and the table it is from.
    targets: BTreeMap<usize, (PhotometryRow, PathBuf)>,
    /// The rows of stars, flats and files that cannot be read: every table brings all of them along.
    others: Vec<PhotometryRow>,
    n_twice: usize,
}

impl<'a> MergedRows<'a> {
    fn new(plan: &'a Plan) -> Self {
        let place = |i: &usize| ((file_name(&plan.frames[*i].path), plan.frames[*i].sha256.as_str()), *i);
        let places = plan.shards.iter().flatten().map(place).collect();
        Self { plan, places, targets: BTreeMap::new(), others: Vec::new(), n_twice: 0 }
    }

    fn take(&mut self, part: Part) -> Result<()> {
        let mut others = Vec::new();
        for row in part.rows {
            let Some(place) = self.places.get(&(row.frame.clone(), row.frame_sha256.as_str())) else {
                let is_its_frame = |f: &PlannedFrame| f.role != InputRole::TARGET && file_name(&f.path) == row.frame;
                if !self.plan.frames.iter().any(is_its_frame) {
                    let problem = format!(
                        "{}: {} is not a frame of the plan, or it has changed: the table was edited; measure its shard again \
                         with argument `force`",
                        part.path.display(),
                        row.frame
                    );
                    return Err(Error::Mismatch { problem });
                }
                others.push(row);
                continue;
            };
            match self.targets.get(place) {
                None => _ = self.targets.insert(*place, (row, part.path.clone())),
                Some((first, _)) if *first == row => self.n_twice += 1,
                Some((_, other)) => {
                    let problem = format!(
                        "{}: {} and {} do not agree on it: one of them was changed; measure its shard again with argument `force`",
                        row.frame,
                        other.display(),
                        part.path.display()
                    );
                    return Err(Error::Mismatch { problem });
                }
            }
        }
        add_others(&mut self.others, others);
        Ok(())
    }

    /// Shards whose frames are not all there, each with its missing frames.
    fn missing(&self) -> BTreeMap<usize, Vec<String>> {
        let lacks = |shard: &Vec<usize>| -> Vec<String> {
            let gone = shard.iter().filter(|place| !self.targets.contains_key(place));
            gone.map(|place| file_name(&self.plan.frames[*place].path)).collect()
        };
        let shards = self.plan.shards.iter().map(lacks).enumerate();
        shards.filter(|(_, lacks)| !lacks.is_empty()).collect()
    }

    /// Target frames and the others, each in the order of the night.
    fn into_rows(self) -> (Vec<TargetFrame>, Vec<PhotometryRow>) {
        let frame = |(row, _)| TargetFrame { row, geometry: None, thumb: None };
        let mut others = self.others;
        let aside = self.plan.of_role(InputRole::SetAside).map(|frame| set_aside_row(&frame.path, &frame.reason));
        add_others(&mut others, self.plan.of_role(InputRole::Unreadable).map(unreadable_row).chain(aside).collect());
        (self.targets.into_values().map(frame).collect(), others)
    }
}

/// Adds the rows that are not there yet. Files of one name in two folders may have rows that are the same: as many of
/// them stay as one table has. Stars and flats come first, in the order every table has them.
fn add_others(all: &mut Vec<PhotometryRow>, more: Vec<PhotometryRow>) {
    let mut left: Vec<PhotometryRow> = all.clone();
    for row in more {
        match left.iter().position(|r| *r == row) {
            Some(known) => _ = left.remove(known),
            None => all.push(row),
        }
    }
}

/// The row of a file that could not be read when the plan was made.
fn unreadable_row(frame: &PlannedFrame) -> PhotometryRow {
    unmeasured_row(&file_name(&frame.path), Status::Failed, frame.reason.clone())
}

fn missing_note(missing: &BTreeMap<usize, Vec<String>>, plan: &Plan) -> String {
    let n: usize = missing.values().map(Vec::len).sum();
    let of_shard = |(number, frames): (&usize, &Vec<String>)| {
        let first = frames.first().cloned().unwrap_or_default();
        let more = if frames.len() > 1 { format!(" and {} more", frames.len() - 1) } else { String::new() };
        format!("shard {number}: {first}{more}")
    };
    let mut named: Vec<String> = missing.iter().take(NAMED).map(of_shard).collect();
    if missing.len() > NAMED {
        named.push(format!("{} more shards", missing.len() - NAMED));
    }
    format!(
        "{n} frames of {} of {} shards are missing ({}); measure them, or merge the rest with argument `allow_missing`",
        missing.len(),
        plan.shards.len(),
        named.join("; ")
    )
}

impl Merged {
    /// Writes the table of the night of a plan, and next to it residuals.ecsv, the configuration and, of a whole night
    /// in its folder, manifest.json; returns the files.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, plan: &Plan, path: &Path) -> Result<Vec<PathBuf>> {
        make_folder_of(path)?;
        let mut files = vec![path.to_path_buf()];
        if self.missing.is_empty() {
            write_photometry(path, &self.rows, &self.meta)?;
        } else {
            let rows: Vec<PartialRow<'_>> = self.rows.iter().zip(&self.raw).collect();
            write_rows(path, &rows, &self.meta)?;
        }
        // another sum in the same folder has residuals of its own, and no manifest
        let whole = path.file_name().is_some_and(|n| n == "photometry.ecsv");
        if self.modelled {
            let residuals =
                if whole { path.with_file_name("residuals.ecsv") } else { path.with_extension("residuals.ecsv") };
            write_residuals(&residuals, &residual_rows(&self.rows), &self.meta)?;
            files.push(residuals);
        }
        if !self.stacks.is_empty() {
            let stacks =
                if whole { path.with_file_name("pass_stack.ecsv") } else { path.with_extension("pass_stack.ecsv") };
            write_rows(&stacks, &self.stacks, &self.meta)?;
            files.push(stacks);
        }
        let effective = path.with_file_name("effective.toml");
        let config = plan.config()?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let provenance = Provenance::of_meta(&self.meta);
        save(&effective, &(effective_toml(&config, folder)? + &provenance.toml_comment()))?;
        files.push(effective);
        if whole && self.missing.is_empty() {
            files.push(write_manifest(plan, folder, &files, &provenance, &self.notes)?);
        }
        Ok(files)
    }

    /// Counts and passes in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        let n = |status: Status| self.rows.iter().filter(|r| r.status == status).count();
        let counts = Status::ALL.map(|s| format!("{} {s}", n(s))).join(", ");
        let band = self.meta.band().unwrap_or(Band::or_v(None).name());
        format!("{counts}\n{}{}", pass_table(&self.rows, band), stack_table(&self.stacks, band))
    }
}

/// Removes what workers left next to finished tables: half-written files of workers that were killed, frames kept for
/// another try. What another worker is writing at this moment is the same again.
pub fn clean(tables: &[PathBuf]) {
    for table in tables {
        let folder = match table.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let begins = format!(".{}.tmp.", file_name(table));
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        for entry in entries.filter(|e| e.file_name().to_string_lossy().starts_with(&begins)) {
            let _ = std::fs::remove_file(entry.path()); // gone already, or not ours to remove
        }
    }
    let _ = tables.first().and_then(|t| t.parent()).map(|folder| std::fs::remove_dir(folder.join(FOLDER)));
}
