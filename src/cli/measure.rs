//! `satphot measure`: target frames to photometry rows, without the model.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::pipeline::options::Options;
use satphot::pipeline::shards::plan_file::Plan;
use satphot::pipeline::shards::shard::{Request, measure_shard};
use satphot::pipeline::single_stages::measure_targets;
use satphot::tables::words::Status;

use super::{Common, print, tell};

const AFTER_HELP: &str = "\
A shard of a plan (--plan, --shard) is measured with nothing but the files it names; its table is the same on every machine,
for every number of threads. A table that exists already, made of the same inputs, is left as it is; --force computes it again. Times,
memory and counts go to a .json file next to the table. A worker that was stopped continues where it stopped.

Examples:
  satphot measure -o photometry.ecsv --zeropoint zeropoint.toml
  satphot measure --plan plan.json --shard 7 --zeropoint night/zeropoint.toml --out night/shards/7.ecsv
  satphot measure --plan plan.json --shard 8/12 --zeropoint night/zeropoint.toml --out night/shards/7.ecsv   the same of 12";

/// Measures the target in the night's target frames or in named files, and tags each with its geometry.
///
/// With the zeropoint of a run the numbers are those of the run: flats and the stars' FWHM are the night's own. Limits
/// of non-detections take the size of the object from the frames measured together.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Measure {
    /// Target frames; the night's own if none are named
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Measure a shard of this plan, with the model; reads no pipeline.toml
    #[arg(long, value_name = "FILE", requires = "shard", conflicts_with_all = ["files", "config", "sets"])]
    plan: Option<PathBuf>,
    /// Which shard: its number from 0, or the I-th of all N as I/N
    #[arg(long, value_name = "NUMBER", requires = "plan", value_parser = shard)]
    shard: Option<(usize, Option<usize>)>,
    /// Zeropoint to calibrate with (zeropoint.previous); without one magnitudes stay instrumental
    #[arg(long, value_name = "TOML")]
    zeropoint: Option<PathBuf>,
    /// Master flat to divide by; made from the night's flats if absent
    #[arg(long, value_name = "FITS")]
    flat: Option<PathBuf>,
    /// Table to write
    #[arg(short, long, value_name = "FILE", default_value = "photometry.ecsv")]
    out: PathBuf,
}

impl Measure {
    pub fn execute(self) -> anyhow::Result<()> {
        if let (Some(plan), Some(shard)) = (&self.plan, self.shard) {
            return self.of_plan(&Plan::read(plan)?, shard);
        }
        if self.shard.is_some() {
            let problem = "there is no plan to take it from; give --plan FILE, which needs no -c and no --set".into();
            return Err(Error::Argument { name: "--shard".into(), problem }.into());
        }
        let mut config = self.common.load()?;
        if self.flat.is_some() {
            config.flat.master = self.flat;
        }
        if self.zeropoint.is_some() {
            config.zeropoint.previous = self.zeropoint;
        }
        let options = Options { files: self.files, ..self.common.options() };
        let progress = self.common.progress();
        let measured = measure_targets(&config, &options, &progress)?;
        measured.write(&config, &self.out)?;
        for note in measured.notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        print(&measured.text());
        print(&format!("{}\n", self.out.display()));
        match measured.poor {
            Some(error) => Err(error.into()),
            None => Ok(()),
        }
    }

    fn of_plan(&self, plan: &Plan, (number, of): (usize, Option<usize>)) -> anyhow::Result<()> {
        if let Some(of) = of.filter(|of| *of != plan.shards.len()) {
            let problem = format!("{}/{of}; this plan has {} shards", number + 1, plan.shards.len());
            return Err(Error::Argument { name: "--shard".into(), problem }.into());
        }
        let (zeropoint, flat) = (self.zeropoint.as_deref(), self.flat.as_deref());
        let request = Request { number, zeropoint, flat, out: &self.out };
        let (options, progress) = (self.common.plan_options(), self.common.progress());
        let measured = measure_shard(plan, &request, &options, &progress)?;
        measured.notes.iter().filter(|_| !self.common.quiet).for_each(|note| tell(&format!("note: {note}")));
        let n = |status: Status| measured.rows.iter().filter(|r| r.status == status).count();
        let counts = Status::ALL.map(|s| format!("{} {s}", n(s))).join(", ");
        let there = if measured.there_already { " (was there already)" } else { "" };
        print(&format!("shard {number}: {counts}\n{}{there}\n", self.out.display()));
        Ok(())
    }
}

/// `7`, or `8/12`: the number from 0, and of how many where that is reported.
fn shard(text: &str) -> Result<(usize, Option<usize>), String> {
    let wrong = || "not the number of a shard from 0, nor I/N with I from 1 to N".to_string();
    match text.split_once('/') {
        None => text.parse().map(|n| (n, None)).map_err(|_| wrong()),
        Some((i, n)) => match (i.parse::<usize>(), n.parse::<usize>()) {
            (Ok(i), Ok(n)) if (1..=n).contains(&i) => Ok((i - 1, Some(n))),
            _ => Err(wrong()),
        },
    }
}
