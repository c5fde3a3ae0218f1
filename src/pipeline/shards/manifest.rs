//! The manifest of a night measured in shards, in the form of a night measured at once.
//!
//! From the plan, the tables and the files next to them. It does not cover what the shards took: the `.json` next to
//! each shard states that.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::plan_file::{Plan, PlannedFrame};
use super::reduce::flats_next_to;
use crate::base::error::{Error, Result};
use crate::base::file::save;
use crate::pipeline::products::inputs::TOOL;
use crate::pipeline::products::manifest::Input;
use crate::pipeline::products::manifest::NAME;
use crate::pipeline::products::manifest::file_json;
use crate::pipeline::products::manifest::input_json;
use crate::pipeline::products::manifest::provenance_json;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::products::record::Output;

/// Products of the steps before, if they are next to the table.
const EARLIER_PRODUCTS: [&str; 3] = ["stars.ecsv", "zeropoint.toml", "master_flat.fits"];

/// Writes `manifest.json` into `folder`, for the night of a plan of which `files` were just written there.
///
/// # Errors
/// [`Error::Io`]; [`Error::Config`].
pub fn write_manifest(
    plan: &Plan,
    folder: &Path,
    files: &[PathBuf],
    provenance: &Provenance,
    notes: &[String],
) -> Result<PathBuf> {
    let config = plan.config()?;
    let earlier = EARLIER_PRODUCTS.iter().map(|name| folder.join(name)).filter(|path| path.is_file());
    let outputs: Vec<Output> =
        files.iter().cloned().chain(earlier).map(|path| Output::of(folder, &path)).collect::<Result<_>>()?;
    let flats = flats_next_to(&folder.join("master_flat.fits"))?;
    let input = |frame: &PlannedFrame| Input {
        path: frame.path.clone(),
        bytes: frame.bytes,
        sha256: frame.sha256.clone(),
        role: frame.role.name().into(),
        reason: frame.reason.clone(),
    };
    let inputs = plan.frames.iter().map(|frame| input_json(folder, &input(frame)));
    let named = plan.files.iter().map(|file| file_json(folder, &file.role, &file.path, &file.sha256));
    let value = json!({
        "schema": "satphot.manifest/2",
        "tool": TOOL,
        "night": config.night.name,
        "config_sha256": plan.config_sha256,
        "provenance": provenance_json(provenance),
        "files": named.collect::<Vec<_>>(),
        "inputs": inputs.collect::<Vec<_>>(),
        "input_manifest_sha256": plan.inputs_sha256(),
        "flats": flats.as_ref().map(|(members, _)| members),
        "flat_masked_frac": flats.as_ref().map(|(_, masked_frac)| masked_frac),
        "shards": plan.shards.len(),
        "notes": notes,
        "outputs": outputs,
    });
    let path = folder.join(NAME);
    let text = serde_json::to_string_pretty(&value).map_err(|e| Error::Table {
        path: path.clone(),
        line: None,
        problem: e.to_string(),
    })?;
    save(&path, &(text + "\n"))?;
    Ok(path)
}
