//! `satphot run`: the whole night.

use std::path::PathBuf;

use clap::Args;
use satphot::config::Config;
use satphot::night::bench::Bench;
use satphot::night::pipeline::{Options, run};
use satphot::night::survey::survey;

use super::{Common, print, tell};

/// Reduces the night of a pipeline.toml and writes tables, figures and a summary.
#[derive(Debug, Args)]
pub struct Run {
    /// Configuration of the night (instead of -c)
    #[arg(value_name = "PIPELINE_TOML")]
    night: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Folder of the results (night.output)
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Largest share of frames that may fail before the exit code is 3
    #[arg(long, value_name = "FRAC")]
    max_failed_frac: Option<f64>,
    /// Any failed frame makes the exit code 3
    #[arg(long)]
    strict: bool,
    /// Draw no figures
    #[arg(long)]
    no_figures: bool,
    /// List the files written
    #[arg(short, long)]
    verbose: bool,
    /// Say on standard error what was left out of each scene and frame, why, and the CPU time that saved
    #[arg(long)]
    explain: bool,
    /// Say what each file is and what would be done, and stop
    #[arg(long)]
    dry_run: bool,
}

impl Run {
    pub fn execute(mut self) -> anyhow::Result<()> {
        if let Some(night) = self.night.take() {
            self.common.config = night;
        }
        if let Some(frac) = self.max_failed_frac {
            self.common.sets.push(format!("night.max_failed_frac={frac:?}"));
        }
        let mut config = self.common.load()?;
        if let Some(out) = self.out {
            config.night.output = out;
        }
        if self.dry_run {
            return dry_run(&config);
        }
        let options = Options {
            strict: self.strict,
            no_figures: self.no_figures,
            explain: self.explain,
            ..self.common.options()
        };
        let progress = self.common.progress();
        let summary = run(&config, &options, &progress)?;
        if !self.common.quiet {
            for note in &summary.notes {
                tell(&format!("note: {note}"));
            }
            for note in &summary.empty_columns {
                tell(&format!("left out: {note}"));
            }
        }
        print(&summary.text());
        let memory = satphot::night::manifest::peak_memory_mb()
            .map(|mb| format!(", {mb:.0} MB peak memory"))
            .unwrap_or_default();
        print(&format!("\n{}{memory}\nResults in {}\n", summary.speed(), summary.folder.display()));
        if let Some(explained) = &summary.explained {
            tell(&explained.text());
        }
        if self.verbose {
            for file in &summary.files {
                print(&format!("  {}\n", file.display()));
            }
        }
        match summary.poor_error() {
            Some(error) => Err(error.into()),
            None => Ok(()),
        }
    }
}

/// What each file is, without touching its pixels.
fn dry_run(config: &Config) -> anyhow::Result<()> {
    let bench = Bench::prepare(config)?;
    let survey = survey(config, &[], &bench.target_names())?;
    let line = |kind: &str, e: &satphot::frames::Exposure| {
        let time = e.time.as_ref().map(|t| satphot::night::clock::iso_utc(t.mid, 3)).unwrap_or_default();
        print(&format!("{kind:<10} {:<32} {time:<24} {:>9.4} s  {}\n", e.name, e.exptime_s, e.role_reason));
    };
    survey.flats.iter().for_each(|e| line("flat", e));
    for (number, pointing) in survey.pointings.iter().enumerate() {
        pointing.iter().for_each(|e| line(&format!("stars {number}"), e));
    }
    survey.targets.iter().for_each(|e| line("target", e));
    survey.others.iter().for_each(|e| line("left alone", e));
    for u in &survey.unreadable {
        print(&format!("unreadable {}: {}\n", u.path.display(), u.error));
    }
    print(&format!("\nResults would go to {}\n", config.night.output.join(&config.night.name).display()));
    Ok(())
}
