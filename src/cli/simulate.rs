//! `satphot simulate`: a synthetic night.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::simulate::{Scenario, simulate};

use super::{bar::Bars, print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot simulate -o raw --seed 7                   a small night: flats, star pointings, a tracked ISS, the truth
  satphot simulate -o raw --set target.n=60 --set target.offset_mag=3
  satphot simulate --print-scenario                  every key that can be set";

/// Makes a night of FITS files with its truth: flats, star pointings, tracked target frames.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Simulate {
    /// Scenario, e.g. scripts/night.toml; the small built-in night if absent
    #[arg(value_name = "SIMULATE_TOML")]
    scenario: Option<PathBuf>,
    /// Folder to write to
    #[arg(short, long, value_name = "DIR", default_value = "simulated-night")]
    out: PathBuf,
    /// Seed of every random number (wins over the scenario's)
    #[arg(long)]
    seed: Option<u64>,
    /// Set a key of the scenario, e.g. --set target.n=10 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Number of threads; 0 = all cores
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = super::threads)]
    jobs: usize,
    /// Print no progress bar
    #[arg(short, long)]
    quiet: bool,
    /// Write into a folder that holds a night already
    #[arg(long)]
    force: bool,
    /// Print the scenario in force and stop
    #[arg(long)]
    print_scenario: bool,
}

impl Simulate {
    pub fn execute(mut self) -> anyhow::Result<()> {
        if let Some(seed) = self.seed {
            self.sets.push(format!("seed={seed}"));
        }
        let scenario = match &self.scenario {
            Some(path) => Scenario::load(path, &self.sets)?,
            None => Scenario::demo_night(&self.sets)?,
        };
        if self.print_scenario {
            print(&scenario.to_toml()?);
            return Ok(());
        }
        let pipeline = self.out.join("pipeline.toml");
        if pipeline.exists() && !self.force {
            return Err(Error::Argument {
                name: "--out".into(),
                problem: format!("{} exists already; --force overwrites it", pipeline.display()),
            }
            .into());
        }
        let progress = Bars::new(!self.quiet);
        let made = satphot::base::threads::with_threads(self.jobs, || simulate(&scenario, &self.out, &progress))??;
        for note in &made.notes {
            tell(&format!("note: {note}"));
        }
        print(&format!(
            "{} frames in {}\ntruth in {}\nreduce them: satphot run {}\n",
            made.frames.len(),
            self.out.display(),
            made.truth.display(),
            made.pipeline_toml.display()
        ));
        Ok(())
    }
}
