//! `satphot verify`: whether finished nights are what they say of themselves.

use std::path::{Path, PathBuf};

use clap::Args;
use satphot::Error;
use satphot::pipeline::products::verify::{Verified, verify_night, verify_plan, verify_shard};

use super::{print, tell};

const AFTER_HELP: &str = "\
Examples:
  satphot verify satphot-out/2025-06-11              each group of a night that has several
  satphot verify satphot-out/2025-06-11 --inputs     the frames too, which must be there
  satphot verify plan.json
  satphot verify shards/*.ecsv                       tables of shards, by the hash that each carries of its rows";

/// Checks folders of results against their manifest.json: every product there with the hash that was recorded, its columns
/// and units, its provenance, the configuration, the inputs.
///
/// Exit code 6 with the list of what differs.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Verify {
    /// Folders of results, plan.json files, or tables of shards
    #[arg(required = true, value_name = "DIR|PLAN|TABLE")]
    folders: Vec<PathBuf>,
    /// Inputs that are gone are a problem too, not only a note
    #[arg(long)]
    inputs: bool,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

/// The folders of the groups of a night of several satellites, filters or cameras; any other folder itself.
fn groups_of(folder: &PathBuf) -> Vec<PathBuf> {
    let is_night = |f: &PathBuf| f.join("manifest.json").is_file();
    let entries = std::fs::read_dir(folder).map(|entries| entries.flatten().map(|e| e.path()).collect::<Vec<_>>());
    let mut groups: Vec<PathBuf> = entries.unwrap_or_default().into_iter().filter(is_night).collect();
    groups.sort();
    if folder.join("night.ecsv").is_file() && !is_night(folder) && !groups.is_empty() {
        return groups;
    }
    vec![folder.clone()]
}

impl Verify {
    fn verify(&self, what: &Path) -> satphot::Result<Verified> {
        match what.extension().and_then(|e| e.to_str()) {
            Some("json") if what.is_file() => verify_plan(what, self.inputs),
            Some("ecsv") if what.is_file() => verify_shard(what),
            _ => verify_night(what, self.inputs),
        }
    }

    pub fn execute(self) -> anyhow::Result<()> {
        let mut wrong = Vec::new();
        for folder in self.folders.iter().flat_map(groups_of) {
            let folder = folder.as_path();
            let found = self.verify(folder)?;
            if !self.quiet {
                found.notes.iter().for_each(|note| tell(&format!("note: {}: {note}", folder.display())));
            }
            match found.check(folder) {
                Ok(()) => print(&format!(
                    "{}: {} products and {} inputs checked, all as recorded\n",
                    folder.display(),
                    found.outputs,
                    found.inputs
                )),
                Err(error) => wrong.push(error.to_string()),
            }
        }
        match wrong.is_empty() {
            true => Ok(()),
            false => Err(Error::Mismatch { problem: wrong.join("\n") }.into()),
        }
    }
}
