//! `satphot verify`: whether a finished night is what its manifest says: every product there and unchanged, its schema, its
//! provenance, the configuration, the inputs.
//!
//! Hashes are those of [`crate::base::hash::sha256_16`]. Nothing is computed again: a product that was changed together with its
//! manifest is not found out. It does not cover the pixels.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use super::inputs::InputRole;
use super::inputs::SEED;
use super::inputs::TOOL;
use super::inputs::inputs_sha256;
use super::record::Output;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::hash::sha256_16;
use crate::config::Config;
use crate::config::digest::config_sha256;
use crate::fits::Header;
use crate::pipeline::products::manifest::NAME;
use crate::pipeline::products::provenance::KEYS;
use crate::pipeline::products::provenance::OF_FLAT;
use crate::pipeline::shards::plan_file::Plan;
use crate::tables::read::Table;
use crate::tables::{
    Column, KEYWORD_CHECKS, KeywordCheckRow, Meta, PASS_STACK, PHOTOMETRY, PassStackRow, RESIDUALS, STARS,
    check_rows_hash, read_photometry, read_residuals, read_rows, read_stars,
};

/// Files of a night that are not listed, because they hold times.
const UNLISTED: [&str; 3] = [NAME, "satphot.log", "satphot.log.jsonl"];

/// The entries of the manifest that are checked.
#[derive(Debug, Deserialize)]
struct Recorded {
    tool: String,
    config_sha256: String,
    input_manifest_sha256: String,
    provenance: BTreeMap<String, String>,
    files: Vec<NamedFile>,
    inputs: Vec<RecordedInput>,
    outputs: Vec<Output>,
}

/// One frame.
#[derive(Debug, Deserialize)]
struct RecordedInput {
    #[serde(with = "crate::base::path_text")]
    path: PathBuf,
    #[serde(with = "crate::base::path_text")]
    from_here: PathBuf,
    sha256: String,
    role: InputRole,
}

/// A file the configuration names.
#[derive(Debug, Deserialize)]
struct NamedFile {
    key: String,
    #[serde(with = "crate::base::path_text")]
    path: PathBuf,
    #[serde(with = "crate::base::path_text")]
    from_here: PathBuf,
    sha256: String,
}

/// The result.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Verified {
    /// Products compared.
    pub outputs: usize,
    /// Inputs and files of the configuration compared.
    pub inputs: usize,
    /// The differences; any of them makes the exit code 6.
    pub problems: Vec<String>,
    /// Notes for the observer: inputs that are gone, another version of the program.
    pub notes: Vec<String>,
}

impl Verified {
    /// Whether all is as recorded.
    ///
    /// # Errors
    /// [`Error::Mismatch`] (exit code 6) with the list of what is not.
    pub fn check(&self, what: &Path) -> Result<()> {
        if self.problems.is_empty() {
            return Ok(());
        }
        let n = self.problems.len();
        let s = if n == 1 { "" } else { "s" };
        Err(Error::Mismatch {
            problem: format!("{}: {n} problem{s}:\n  {}", what.display(), self.problems.join("\n  ")),
        })
    }
}

/// Verifies the folder of a night against its manifest.json; `need_inputs` makes inputs that are gone a problem.
///
/// # Errors
/// [`Error::NoInput`] without a manifest; [`Error::Table`] for one that cannot be read. What differs is in the answer.
pub fn verify_night(folder: &Path, need_inputs: bool) -> Result<Verified> {
    let path = folder.join(NAME);
    if !path.is_file() {
        let problem = "holds no manifest.json; name the folder of a finished night (`run` writes it)".into();
        return Err(Error::NoInput { path: folder.to_path_buf(), problem });
    }
    let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, e))?;
    let recorded: Recorded = serde_json::from_str(&text).map_err(|e| Error::Table {
        path: path.clone(),
        line: Some(e.line()),
        problem: format!("{e}: damaged, or of a version that kept no hashes; run the night again"),
    })?;
    let mut found = Verified::default();
    if recorded.tool != TOOL {
        found.notes.push(format!("made by {}, verified by {TOOL}", recorded.tool));
    }
    for output in &recorded.outputs {
        found.outputs += 1;
        match unchanged(folder, output) {
            Err(problem) => found.problems.push(format!("{}: {problem}", output.path.display())),
            Ok(file) => found.problems.extend(content(&file, &recorded)),
        }
    }
    rows_of_frames(folder, &recorded, &mut found);
    configuration(folder, &recorded, &mut found);
    inputs(folder, &recorded, need_inputs, &mut found);
    unlisted(folder, &recorded, &mut found);
    Ok(found)
}

/// Verifies the frames and files of a plan.json: each there and what it was when the plan was made.
///
/// # Errors
/// The errors of [`Plan::read`]; what differs is in the answer.
pub fn verify_plan(path: &Path, need_inputs: bool) -> Result<Verified> {
    let plan = Plan::read(path)?;
    let mut found = Verified::default();
    let frames = plan.frames.iter().map(|f| (f.role.name(), &f.path, &f.sha256));
    let files = plan.files.iter().map(|f| (f.role.as_str(), &f.path, &f.sha256));
    let all: Vec<_> = frames.chain(files).map(|(what, path, want)| (what, (path, path), want)).collect();
    compare_inputs(Path::new(""), all.into_iter(), need_inputs, &mut found);
    Ok(found)
}

/// Whether a table is the one that the manifest in its folder lists; also where there is none, or does not list it.
///
/// # Errors
/// [`Error::Mismatch`] for a table that was changed, or a manifest that is damaged.
pub(crate) fn check_against_manifest(table: &Path) -> Result<()> {
    #[derive(Deserialize)]
    struct Listed {
        outputs: Vec<Output>,
    }
    let folder = table.parent().unwrap_or(Path::new(""));
    let manifest = folder.join(NAME);
    let Ok(text) = std::fs::read_to_string(&manifest) else { return Ok(()) };
    let problem = |problem: String| Err(Error::Mismatch { problem });
    let Ok(Listed { outputs }) = serde_json::from_str(&text) else {
        return problem(format!("{}: is damaged; merge the shards of the night again", manifest.display()));
    };
    match outputs.iter().find(|output| Some(output.path.as_os_str()) == table.file_name()) {
        Some(output) => match unchanged(folder, output) {
            Ok(_) => Ok(()),
            Err(what) => problem(format!("{}: {what}; merge the shards of the night again", table.display())),
        },
        None => Ok(()),
    }
}

/// Verifies the table of a shard, or a sum of some, against the hash that it carries of its rows.
///
/// # Errors
/// [`Error::Io`]; that it was changed is in the answer.
pub fn verify_shard(path: &Path) -> Result<Verified> {
    let mut found = Verified { outputs: 1, ..Verified::default() };
    match check_rows_hash(path) {
        Err(Error::Mismatch { problem }) => found.problems.push(problem),
        other => other?,
    }
    Ok(found)
}

/// The path of a product that is what was recorded of it.
fn unchanged(folder: &Path, output: &Output) -> std::result::Result<PathBuf, String> {
    if !output.path.components().all(|c| matches!(c, Component::Normal(_))) {
        return Err("leads out of the folder of the night".into());
    }
    let path = folder.join(&output.path);
    let Ok(found) = Output::of(folder, &path) else { return Err("is missing, or cannot be read".into()) };
    if found.bytes != output.bytes {
        return Err(format!("{} bytes, but {} were written", found.bytes, output.bytes));
    }
    if found.sha256 != output.sha256 {
        return Err(format!("changed since it was written: SHA-256 {} instead of {}", found.sha256, output.sha256));
    }
    Ok(path)
}

/// Schema and provenance of one product.
fn content(path: &Path, recorded: &Recorded) -> Vec<String> {
    let name = file_name(path);
    let is_flat = path.extension().is_some_and(|e| e == "fits");
    let of_flat = of_flat(recorded);
    let wanted = if is_flat { &of_flat } else { &recorded.provenance };
    let mut problems = Vec::new();
    let mut compare = |recorded_value: &dyn Fn(&str) -> Option<String>| {
        for (key, want) in wanted {
            match recorded_value(key) {
                Some(got) if got == *want => {}
                Some(got) => problems.push(format!("{name}: {key} is {got}, but {want} in {NAME}")),
                None => problems.push(format!("{name}: does not state {key} ({want} in {NAME})")),
            }
        }
    };
    match path.extension().and_then(|e| e.to_str()) {
        Some("ecsv") => match table(path) {
            Ok(meta) => {
                let flat: BTreeMap<String, String> = meta.flat().into_iter().collect();
                compare(&|key| flat.get(key).cloned());
            }
            Err(error) => problems.push(error),
        },
        Some("fits") => match Header::read(path) {
            Ok(header) => {
                let keyword = |key: &str| KEYS.iter().find(|(k, _, _)| *k == key).map(|(_, keyword, _)| *keyword);
                compare(&|key| header.text(if key == SEED.0 { SEED.1 } else { keyword(key)? }));
            }
            Err(error) => problems.push(format!("{name}: {error}")),
        },
        Some("toml" | "svg" | "html") => {
            let text = std::fs::read_to_string(path).unwrap_or_default();
            let line = text.lines().rev().find_map(|l| l.split_once("provenance: ")).map_or("", |(_, pairs)| pairs);
            let line = line.trim_end_matches(" -->");
            let pairs: BTreeMap<&str, &str> = line.split("; ").filter_map(|pair| pair.split_once('=')).collect();
            compare(&|key| pairs.get(key).map(|value| (*value).to_string()));
        }
        _ => {}
    }
    problems
}

/// The provenance that a master flat should state: its inputs are the flats alone.
fn of_flat(recorded: &Recorded) -> BTreeMap<String, String> {
    let mut provenance = recorded.provenance.clone();
    provenance.retain(|key, _| OF_FLAT.contains(&key.as_str()));
    let flats = recorded.inputs.iter().filter(|i| i.role == InputRole::FLAT);
    let hash = inputs_sha256(flats.map(|i| (i.path.as_path(), i.sha256.as_str())));
    provenance.insert("input_manifest_sha256".into(), hash);
    provenance
}

/// Columns, units and cells of a table; its meta block.
fn table(path: &Path) -> std::result::Result<Meta, String> {
    let name = file_name(path);
    let words = |error: Error| format!("{name}: {error}");
    let schema: &[Column] = match name.as_str() {
        "photometry.ecsv" => PHOTOMETRY.columns,
        "stars.ecsv" => STARS.columns,
        "residuals.ecsv" => RESIDUALS.columns,
        "keyword_checks.ecsv" => KEYWORD_CHECKS.columns,
        "pass_stack.ecsv" => PASS_STACK.columns,
        _ => return Err(format!("{name}: is not one of the tables of a night")),
    };
    let header = Table::open(path).map_err(words)?;
    let found: Vec<(&str, &str)> = header.columns.iter().map(|c| (c.name.as_str(), c.unit.as_str())).collect();
    for (i, column) in schema.iter().enumerate() {
        match found.get(i) {
            Some((got, unit)) if *got == column.name && *unit == column.unit => {}
            Some((got, unit)) => {
                let (want, of) = (column.name, column.unit);
                return Err(format!("{name}: column {} is {got} [{unit}], not {want} [{of}]", i + 1));
            }
            None => return Err(format!("{name}: column {} is missing", column.name)),
        }
    }
    if let Some((extra, _)) = found.get(schema.len()) {
        return Err(format!("{name}: column {extra} is not of the schema"));
    }
    let meta = match name.as_str() {
        "photometry.ecsv" => read_photometry(path).map(|(_, meta)| meta),
        "stars.ecsv" => read_stars(path).map(|(_, meta)| meta),
        "keyword_checks.ecsv" => read_rows::<KeywordCheckRow>(path).map(|(_, meta)| meta),
        "pass_stack.ecsv" => read_rows::<PassStackRow>(path).map(|(_, meta)| meta),
        _ => read_residuals(path).map(|(_, meta)| meta),
    };
    meta.map_err(words)
}

/// Whether the table of the night has a row of such a file.
fn has_row(role: InputRole) -> bool {
    matches!(role, InputRole::TARGET | InputRole::Unreadable | InputRole::SetAside)
}

/// Reports the frames that should have a row and have none.
fn rows_of_frames(folder: &Path, recorded: &Recorded, found: &mut Verified) {
    let Ok((rows, _)) = read_photometry(&folder.join("photometry.ecsv")) else { return };
    let mut left: BTreeMap<String, isize> = BTreeMap::new();
    rows.iter().for_each(|row| *left.entry(row.frame.clone()).or_default() += 1);
    for input in recorded.inputs.iter().filter(|i| has_row(i.role)) {
        let n = left.entry(file_name(&input.path)).or_default();
        *n -= 1;
        if *n < 0 {
            found.problems.push(format!("photometry.ecsv: no row of {}", input.path.display()));
        }
    }
}

/// The configuration in force, and the hash over all inputs.
fn configuration(folder: &Path, recorded: &Recorded, found: &mut Verified) {
    match Config::load(&folder.join("effective.toml"), &[]).and_then(|config| config_sha256(&config)) {
        Ok(hash) if hash == recorded.config_sha256 => {}
        Ok(hash) => {
            let want = &recorded.config_sha256;
            found.problems.push(format!("effective.toml: its hash is {hash}, but {want} in {NAME}"));
        }
        Err(error) => found.problems.push(format!("effective.toml: {error}")),
    }
    let inputs = recorded.inputs.iter().map(|i| (i.path.as_path(), i.sha256.as_str()));
    if inputs_sha256(inputs) != recorded.input_manifest_sha256 {
        found.problems.push(format!("{NAME}: the hash over its inputs is not that of their list"));
    }
    for (key, value) in
        [("config_sha256", &recorded.config_sha256), ("input_manifest_sha256", &recorded.input_manifest_sha256)]
    {
        if recorded.provenance.get(key) != Some(value) {
            found.problems.push(format!("{NAME}: {key} differs within it"));
        }
    }
}

/// Frames and files of the configuration, where they are still there.
fn inputs(folder: &Path, recorded: &Recorded, needed: bool, found: &mut Verified) {
    let frames = recorded.inputs.iter().map(|i| (i.role.name(), (&i.path, &i.from_here), &i.sha256));
    let files = recorded.files.iter().map(|f| (f.key.as_str(), (&f.path, &f.from_here), &f.sha256));
    compare_inputs(folder, frames.chain(files), needed, found);
}

/// Compares files, each known by what it is for, its path as found and that from `folder`, and its hash.
fn compare_inputs<'a>(
    folder: &Path,
    files: impl Iterator<Item = (&'a str, (&'a PathBuf, &'a PathBuf), &'a String)>,
    needed: bool,
    found: &mut Verified,
) {
    let mut gone = Vec::new();
    for (what, (path, from_here), want) in files {
        found.inputs += 1;
        if want.is_empty() {
            continue; // what could not be read then has no hash
        }
        let there = [folder.join(from_here), path.clone()].into_iter().find(|p| p.exists());
        let Some(there) = there else {
            gone.push(format!("{what} {}: is gone", path.display()));
            continue;
        };
        match sha256_16(&there) {
            Ok(got) if got == *want => {}
            Ok(got) => {
                found
                    .problems
                    .push(format!("{what} {}: changed since the run: SHA-256 {got} instead of {want}", path.display()));
            }
            Err(error) => gone.push(format!("{what} {}: {error}", path.display())),
        }
    }
    if needed {
        found.problems.extend(gone);
    } else if let Some(first) = gone.first() {
        let n = gone.len();
        found.notes.push(format!(
            "{n} of {} inputs cannot be compared; the first: {first} (argument `inputs` makes that a problem)",
            found.inputs
        ));
    }
}

/// Files in the folder that the manifest does not know.
fn unlisted(folder: &Path, recorded: &Recorded, found: &mut Verified) {
    let known = |path: &Path| recorded.outputs.iter().any(|o| folder.join(&o.path) == path);
    let mut folders = vec![folder.to_path_buf(), folder.join("figures")];
    let mut others = Vec::new();
    while let Some(entries) = folders.pop().map(std::fs::read_dir) {
        for path in entries.into_iter().flatten().filter_map(|e| Some(e.ok()?.path())) {
            let name = file_name(&path);
            if path.is_file() && !name.starts_with('.') && !UNLISTED.contains(&name.as_str()) && !known(&path) {
                others.push(name);
            }
        }
    }
    if !others.is_empty() {
        others.sort();
        found.notes.push(format!("not of this run: {}", others.join(", ")));
    }
}
