//! `satphot merge`: the shards of a plan to the tables of the night.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::base::progress::Silent;
use satphot::pipeline::options::Options;
use satphot::pipeline::shards::merge::{clean, merge};
use satphot::pipeline::shards::plan_file::Plan;
use satphot::pipeline::shards::stack::stack_merged;

use super::{print, tell};

const AFTER_HELP: &str = "\
The order of the tables does not matter, nor how often a shard is among them. A merged table of some shards (--allow-missing) can be
merged again with the others; the result is that of all at once. With --stack it is that of `satphot run`, byte for byte; without, and
with passes stacked there (target.stack_passes), forced_flux_e of frames without a detection remains at the expected place.

Exit code 3 names the shards and frames that are missing; nothing is written then.

Examples:
  satphot merge --plan plan.json shards/*.ecsv -o night/photometry.ecsv
  satphot merge --plan plan.json shards/*.ecsv -o night/photometry.ecsv --stack --zeropoint night/zeropoint.toml
  satphot merge --plan plan.json shards/0.ecsv shards/2.ecsv --allow-missing -o night/so_far.ecsv";

/// Merges the tables of the shards of a plan into photometry.ecsv, with residuals.ecsv and effective.toml next to it.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct MergeVerb {
    /// Tables of shards, or merged tables
    #[arg(value_name = "TABLE", required = true)]
    tables: Vec<PathBuf>,
    /// Plan the shards belong to
    #[arg(long, value_name = "FILE", default_value = "plan.json")]
    plan: PathBuf,
    /// Write the table although frames are missing
    #[arg(long)]
    allow_missing: bool,
    /// Table to write
    #[arg(short, long, value_name = "FILE", default_value = "photometry.ecsv")]
    out: PathBuf,
    /// Stack the passes as well, pass_stack.ecsv and forced_flux_e at their places: reads the target frames again
    #[arg(long, conflicts_with = "allow_missing")]
    stack: bool,
    /// Zeropoint that the shards were measured with, for --stack
    #[arg(long, value_name = "TOML", requires = "stack")]
    zeropoint: Option<PathBuf>,
    /// Master flat that they were measured with, for --stack; by default the one next to the zeropoint
    #[arg(long, value_name = "FITS", requires = "stack")]
    flat: Option<PathBuf>,
    /// Threads of --stack; 0 = all cores
    #[arg(short, long, value_name = "N", default_value_t = 0, requires = "stack")]
    jobs: usize,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl MergeVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        let plan = Plan::read(&self.plan)?;
        let (tables, absent): (Vec<PathBuf>, Vec<PathBuf>) = self.tables.into_iter().partition(|t| t.exists());
        for table in absent.iter().filter(|_| !self.quiet) {
            tell(&format!("note: {} does not exist", table.display()));
        }
        let mut merged = merge(&plan, &tables, self.allow_missing)?;
        if self.stack {
            let options = Options { jobs: self.jobs, ..Options::default() };
            let given = (self.zeropoint.as_deref(), self.flat.as_deref());
            stack_merged(&mut merged, &plan, given, &options, &Silent)?;
        }
        let files = merged.write(&plan, &self.out)?;
        if merged.missing.is_empty() {
            clean(&tables);
        }
        if !self.quiet {
            merged.notes.iter().for_each(|note| tell(&format!("note: {note}")));
            if merged.n_twice > 0 {
                tell(&format!("note: {} frames are in more than one table; each counts once", merged.n_twice));
            }
        }
        print(&merged.text());
        files.iter().for_each(|file| print(&format!("{}\n", file.display())));
        match merged.poor {
            Some(problem) => Err(Error::PoorNight { problem }.into()),
            None => Ok(()),
        }
    }
}
