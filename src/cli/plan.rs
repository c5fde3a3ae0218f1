//! `satphot plan`: what is to be done of a night, in pieces that can be measured anywhere.

use std::path::PathBuf;

use clap::Args;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::inputs::InputRole;
use satphot::pipeline::shards::plan_file::{FRAMES_PER_SHARD, make_plan};

use super::{Common, print, tell};

const AFTER_HELP: &str = "\
The plan names every frame with its size, hash, role and star pointing, the files next to them, and the shards: runs of target
frames. The same files and configuration give the same plan. It holds the whole configuration: workers need the plan and the
files it names, by the same paths.

Examples:
  satphot plan -c pipeline.toml --frames-per-shard 100 -o plan.json
  satphot flat --plan plan.json -o night/master_flat.fits
  satphot zeropoint --plan plan.json -o night/zeropoint.toml
  satphot measure --plan plan.json --shard 0 --zeropoint night/zeropoint.toml --out night/shards/0.ecsv
  satphot merge --plan plan.json night/shards/*.ecsv -o night/photometry.ecsv
  satphot report night

scripts/snakemake runs these on one machine, on SLURM or on Kubernetes; docs/cluster.md gives the details.";

/// Plans a night: every frame with its role and hash, target frames in shards.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct PlanVerb {
    /// Folders or files of frames instead of night.input
    #[arg(value_name = "INPUT")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Target frames of a shard, at most
    #[arg(long, value_name = "N", default_value_t = FRAMES_PER_SHARD)]
    frames_per_shard: usize,
    /// Plan to write
    #[arg(short, long, value_name = "FILE", default_value = "plan.json")]
    out: PathBuf,
}

impl PlanVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut config = self.common.load()?;
        if !self.files.is_empty() {
            config.night.input.clone_from(&self.files);
        }
        super::signals::end_while_reading();
        let options = Options { ..self.common.options() };
        let (plan, notes) = make_plan(&config, self.frames_per_shard, &options, &self.common.progress())?;
        plan.write(&self.out)?;
        for note in notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        let n = |role: InputRole| plan.of_role(role).count();
        print(&format!(
            "{} frames: {} flats, {} star, {} target, {} unreadable\n{} shards of at most {} target frames\n{}\n",
            plan.frames.len(),
            n(InputRole::FLAT),
            n(InputRole::STARS),
            n(InputRole::TARGET),
            n(InputRole::Unreadable),
            plan.shards.len(),
            plan.frames_per_shard,
            self.out.display()
        ));
        Ok(())
    }
}
