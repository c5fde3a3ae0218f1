//! `satphot run`: the whole night.

use std::path::PathBuf;

use clap::Args;
use satphot::config::Config;
use satphot::error::{Error, Result};
use satphot::frames::{Exposure, Role};
use satphot::night::bench::Bench;
use satphot::night::filters::{agree_on_band, reduce_one_filter};
use satphot::night::identity::{other_names, set_others_aside};
use satphot::night::pipeline::{Options, run};
use satphot::night::survey::{Survey, survey};
use satphot::night::target::empty_columns;

use super::{Common, print, tell};

const AFTER_HELP: &str = "\
A run that was stopped, killed or cut off goes on where it was when the same line is run again: every measured frame is kept
in .satphot/ beside the results, with the hashes of all it depends on, and measured again only where one of them has changed
(frame, configuration, flat, catalogue, elements, version). --force does everything anew. A second run of a finished night
takes seconds and gives the same bytes.

Examples:
  satphot run                                  the night of pipeline.toml
  satphot run night.toml -j 4 --max-memory 2GB
  satphot run night.toml --dry-run             what each file is taken for, and what is missing
  satphot run night.toml -o results --set photometry.aper_r_fwhm=2.5
  satphot run night.toml --json --quiet 2> run.jsonl
  satphot run night.toml --force               nothing kept earlier is believed

Exit code 3: outputs written, but too many frames failed or no star matched; 5: flat, catalogue or elements missing;
75: another run is at work in the folder; 130, 143: interrupted, finished frames are kept.";

/// Reduces the night of a pipeline.toml and writes tables, figures and a summary.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
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
            return dry_run(&config, self.common.jobs);
        }
        let options = Options {
            strict: self.strict,
            no_figures: self.no_figures,
            explain: self.explain,
            redo: self.common.force,
            ..self.common.options()
        };
        let progress = self.common.progress();
        let summary = run(&config, &options, &progress)?;
        if !self.common.quiet {
            for note in summary.notes.iter().chain(&summary.kept_note()) {
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

/// CPU time of a frame by its role \[s per million pixels\]: docs/speed.md, with half as much again for slower machines.
const CPU_S_PER_MPX: [(Role, f64); 3] = [(Role::Flat, 0.0018), (Role::Stars, 0.011), (Role::Target, 0.009)];

/// What each file is and what the run would make of them, without touching their pixels.
///
/// A piece that is not there is told at the end, with all others, and then is the error the run would stop with.
fn dry_run(config: &Config, jobs: usize) -> anyhow::Result<()> {
    let (mut bench, mut missing) = prepare_without_missing(config)?;
    let mut names = bench.target_names();
    if bench.tracker.is_none() {
        // elements would name the target; the model names the same satellite
        names.extend(config.model.iter().map(|m| m.satellite.clone()));
    }
    let mut survey = survey(config, &[], &names)?;
    let others = other_names(bench.tracker.as_ref(), config);
    set_others_aside(&mut survey, config, &names, &others);
    let mut notes = Vec::new();
    let previous_there = config.zeropoint.previous.as_ref().is_none_or(|path| path.is_file());
    match reduce_one_filter(&mut survey, config) {
        Ok(()) if previous_there => match agree_on_band(&survey, &mut bench, true) {
            Ok(told) => notes = told,
            Err(error) => missing.push(error),
        },
        Ok(()) => {}
        Err(error) => missing.push(error),
    }
    notes.extend(bench.model_note());
    let line = |kind: &str, e: &Exposure| {
        let time = e.time.as_ref().map(|t| satphot::night::clock::iso_utc(t.mid, 3)).unwrap_or_default();
        print(&format!("{kind:<10} {:<32} {time:<24} {:>9.4} s  {}\n", e.name, e.exptime_s, e.role_reason));
    };
    survey.flats.iter().for_each(|e| line("flat", e));
    for (number, pointing) in survey.pointings.iter().enumerate() {
        pointing.iter().for_each(|e| line(&format!("stars {number}"), e));
    }
    survey.targets.iter().for_each(|e| line("target", e));
    for e in &survey.others {
        let aside = matches!(e.role, Role::OtherTarget | Role::OtherFilter);
        line(if aside { e.role.name() } else { "left alone" }, e);
    }
    for u in &survey.unreadable {
        print(&format!("unreadable {}: {}\n", u.path.display(), u.error));
    }
    print(&format!("\n{}", masters(config, &survey, &bench)));
    notes.iter().for_each(|note| print(&format!("note       {note}\n")));
    for note in empty_columns(config, &bench) {
        // flats and zeropoint of this night are only made by the run
        let made = (note.starts_with("no flats") && !survey.flats.is_empty())
            || (note.starts_with("no zeropoint") && !survey.pointings.is_empty());
        if !made {
            print(&format!("missing    {note}\n"));
        }
    }
    let frames: Vec<&Exposure> =
        survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets).collect();
    let bytes: u64 = frames.iter().filter_map(|e| std::fs::metadata(&e.path).ok()).map(|m| m.len()).sum();
    let cpu_s = |e: &&Exposure| {
        let per_mpx = CPU_S_PER_MPX.iter().find(|(role, _)| *role == e.role).map_or(0.0, |(_, s)| *s);
        per_mpx * (e.size_px.0 * e.size_px.1) as f64 / 1e6
    };
    let threads = Options { jobs, ..Options::default() }.threads() as f64;
    // starting, plates, model and figures of the smallest night
    let seconds = 1.0 + frames.iter().map(cpu_s).sum::<f64>() / threads;
    print(&format!(
        "work       {} frames, {:.0} MB to read, about {seconds:.0} s on {threads:.0} threads if the disk keeps up\n",
        frames.len(),
        bytes as f64 / 1e6
    ));
    print(&format!("results    would go to {}\n", config.night.output.join(&config.night.name).display()));
    for error in &missing {
        print(&format!("missing    {error}\n"));
    }
    match missing.into_iter().next() {
        Some(first) => Err(first.into()),
        None => Ok(()),
    }
}

/// The bench of the pieces that are there, and an error for each that is not.
fn prepare_without_missing(config: &Config) -> Result<(Bench, Vec<Error>)> {
    let mut there = config.clone();
    let mut missing = Vec::new();
    for path in config.flat.master.iter().chain(&config.zeropoint.previous).filter(|p| !p.is_file()) {
        let problem = "no such file (flat.master, zeropoint.previous): name the one of a finished night".to_string();
        missing.push(Error::NoInput { path: path.clone(), problem });
    }
    loop {
        match Bench::prepare(&there) {
            Ok(bench) => return Ok((bench, missing)),
            Err(error @ Error::Orbit { .. }) if there.orbit.is_some() => {
                there.orbit = None;
                missing.push(error);
            }
            Err(error @ Error::Catalogue { .. }) if there.stars.is_some() => {
                there.stars = None;
                missing.push(error);
            }
            Err(error) => return Err(error),
        }
    }
}

/// Where master flat and zeropoint would be from.
fn masters(config: &Config, survey: &Survey, bench: &Bench) -> String {
    let flat = match &config.flat.master {
        Some(path) => format!("{}", path.display()),
        None if survey.flats.is_empty() => "none: frames are not flattened".into(),
        None => format!("of {} flats", survey.flats.len()),
    };
    let zeropoint = match &config.zeropoint.previous {
        Some(path) => format!("{}", path.display()),
        None if config.stars.is_none() => "none: no [stars] and no zeropoint.previous".into(),
        None => format!("of {} star frames in {} pointings", survey.n_star_frames(), survey.pointings.len()),
    };
    let elements = match &bench.tracker {
        Some(_) => config.orbit.as_ref().map(|o| o.elements.display().to_string()).unwrap_or_default(),
        None if config.orbit.is_some() => "missing, see below".into(),
        None => "none".into(),
    };
    let model = config.model.as_ref().map_or("none", |m| m.satellite.as_str());
    format!("flat       {flat}\nzeropoint  {zeropoint}\nelements   {elements}\nmodel      {model}\n")
}
