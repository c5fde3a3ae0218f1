//! The command line: one file per verb that parses, calls the library and prints. No science here.
//!
//! Results go to standard output, progress and messages to standard error.

mod accuracy;
mod bar;
mod brdf;
mod check_table;
mod compare;
mod detector;
#[cfg(test)]
mod examples;
mod export;
mod fetch;
pub mod finite;
mod fit;
mod flat;
mod implied;
mod init;
mod inspect;
mod limits;
mod log;
mod manual;
mod measure;
mod merge;
mod orbit_args;
pub mod output;
mod passes;
mod plan;
mod plan_night;
mod plot;
mod predict;
mod published;
mod render;
mod report;
mod run;
mod satellites;
pub mod signals;
mod simulate;
mod solve;
pub mod usage;
mod verify;
mod watch;
mod zeropoint;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use satphot::Error;
use satphot::config::Config;
use satphot::pipeline::options::Options;

const AFTER_HELP: &str = "\
To begin, `satphot simulate` makes a test night, `satphot init` a pipeline.toml for your own, and `satphot run` reduces it.
Examples of a verb are at the end of `satphot VERB --help`.

Results go to standard output, progress, notes and errors to standard error.

Exit codes:
    0  outputs complete; some frames may have failed, up to --max-failed-frac
    1  internal error
    2  usage or configuration
    3  outputs written, but too many frames failed (any with --strict), or no star matched
    4  input missing or unreadable
    5  usable flat, gain setting, star catalogue or elements missing
    6  verify, merge: something is not what was recorded
   75  temporary failure (another run in the folder, the network): try again
  130  interrupted (143: terminated); finished frames are kept, and a new run continues from them";

/// Photometry of tracked satellites: a night's raw FITS files to calibrated magnitudes, orbit and geometry to
/// predicted magnitudes, and the residuals between them.
#[derive(Debug, Parser)]
#[command(name = "satphot", version, about, after_help = AFTER_HELP)]
pub struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Reduce a whole night: calibrate, measure, compare with the model
    Run(run::Run),
    /// Reduce a night while its frames arrive
    Watch(watch::Watch),
    /// Write a commented pipeline.toml to start from
    Init(init::Init),
    /// Print what is understood from headers, and why
    Inspect(inspect::Inspect),
    /// Divide a night into shards, for a cluster
    Plan(plan::PlanVerb),
    /// Plan a night: which satellites, when, with which exposure
    PlanNight(Box<plan_night::PlanNight>),
    /// Merge the tables of the shards of a plan
    Merge(merge::MergeVerb),
    /// Make a master flat
    Flat(flat::Flat),
    /// Check gain, read noise and saturation on flats and biases
    Detector(detector::DetectorVerb),
    /// Fit zeropoint, extinction and colour term to star frames
    Zeropoint(zeropoint::ZeropointVerb),
    /// Find where frames are on the sky
    Solve(solve::Solve),
    /// Measure the target in frames
    Measure(measure::Measure),
    /// Write the report of a night, or of several, as one HTML file
    Report(report::Report),
    /// Compare a photometry table with the model
    Compare(compare::Compare),
    /// Fit a model of a satellite to observed magnitudes
    Fit(fit::Fit),
    /// List passes of a satellite over a site
    Passes(passes::Passes),
    /// Predict magnitudes: a pass, a sky, a day, a constellation
    Predict(predict::Predict),
    /// Compute the faintest magnitudes of a telescope or a survey
    Limits(limits::Limits),
    /// Draw what goes into the model: Moon, Earth, ground tracks
    Plot(plot::Plot),
    /// Export tables and observations for archives and other programs
    Export(export::Export),
    /// Fetch elements and stars from the network
    Fetch(fetch::Fetch),
    /// Render a satellite of many components
    Render(render::Render),
    /// Make a synthetic night with its truth
    Simulate(simulate::Simulate),
    /// Fit scattering laws to measurements, and draw them
    Brdf(brdf::BrdfVerb),
    /// Compare the numbers of the paper with ours
    Published(published::PublishedVerb),
    /// Check a table of passes against Sun, Moon and elements
    CheckTable(check_table::CheckTable),
    /// Measure error against run time of numerical methods
    Accuracy(accuracy::Accuracy),
    /// List the satellites the model knows
    Satellites(satellites::Satellites),
    /// Check finished nights against their manifests
    Verify(verify::Verify),
    /// Print the completions of a shell
    Completions(manual::Completions),
    /// Print or write the manual pages
    Man(manual::Man),
}

/// How progress is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressHow {
    /// Bars, on a terminal.
    Bar,
    /// One JSON object a line: stage, progress, done, note, warning, error.
    Json,
    /// Nothing; notes are reported all the same.
    None,
}

/// Options every verb has that reads pipeline.toml.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Configuration of the night
    #[arg(short, long, value_name = "FILE", default_value = "pipeline.toml")]
    pub config: PathBuf,
    /// Set a key of the configuration, e.g. --set photometry.aper_r_fwhm=2.5 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Number of threads; 0 = all cores
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    pub jobs: usize,
    /// Memory to work in, e.g. 600MB, 2GB, 1GiB [default: 600MB and 400MB more for each further thread, or what one frame takes]
    #[arg(long, value_name = "SIZE", value_parser = memory_bytes)]
    pub max_memory: Option<usize>,
    /// Print no progress bars and no notes
    #[arg(short, long)]
    pub quiet: bool,
    /// For programs: progress, notes and errors as lines of JSON on standard error; `run` prints its summary as JSON
    #[arg(long)]
    pub json: bool,
    /// How progress is reported on standard error: bars on a terminal, lines of JSON (as --json), or not at all
    #[arg(long, value_enum, value_name = "HOW", default_value = "bar")]
    pub progress: ProgressHow,
    /// Do everything again: nothing kept from an earlier run is trusted
    #[arg(long)]
    pub force: bool,
    /// Use elements older than orbit.max_age_d, or contradicted by others, all the same (orbit.force_age)
    #[arg(long)]
    pub force_age: bool,
}

impl Common {
    /// Reads the configuration; a missing file says how to get one.
    pub fn load(&self) -> anyhow::Result<Config> {
        if self.json || self.progress == ProgressHow::Json {
            log::as_json();
        }
        if !self.config.exists() {
            return Err(Error::NoInput {
                path: self.config.clone(),
                problem: "no such configuration; `satphot init` writes one to start from, -c names another".into(),
            }
            .into());
        }
        if self.config.is_dir() {
            let inside = self.config.join("pipeline.toml");
            let hint = if inside.exists() {
                format!("give `{}`", inside.display())
            } else {
                format!("`satphot init night.toml --input {}` writes one for its frames", self.config.display())
            };
            let problem = format!("is a folder, not a configuration; {hint}");
            return Err(Error::NoInput { path: self.config.clone(), problem }.into());
        }
        let mut config = load(&self.config, &self.sets)?;
        if let Some(orbit) = &mut config.orbit {
            orbit.force_age |= self.force_age;
        }
        Ok(config)
    }

    /// How the work is done: threads and memory; a signal requests a stop.
    pub fn options(&self) -> Options {
        Options { jobs: self.jobs, max_memory_bytes: self.max_memory, stop: signals::stop(), ..Options::default() }
    }

    /// How a step of a plan is done: --force does it again.
    pub fn plan_options(&self) -> Options {
        if self.json {
            log::as_json();
        }
        Options { redo: self.force, ..self.options() }
    }

    /// The listener to progress: bars on a terminal, silence otherwise.
    pub fn progress(&self) -> bar::Bars {
        bar::Bars::new(!self.quiet && self.progress != ProgressHow::None)
    }
}

impl Cli {
    /// Runs the verb.
    pub fn execute(self) -> anyhow::Result<()> {
        match self.verb {
            Verb::Run(v) => v.execute(),
            Verb::Watch(v) => v.execute(),
            Verb::Init(v) => v.execute(),
            Verb::Inspect(v) => v.execute(),
            Verb::Plan(v) => v.execute(),
            Verb::PlanNight(v) => v.execute(),
            Verb::Merge(v) => v.execute(),
            Verb::Flat(v) => v.execute(),
            Verb::Detector(v) => v.execute(),
            Verb::Zeropoint(v) => v.execute(),
            Verb::Solve(v) => v.execute(),
            Verb::Measure(v) => v.execute(),
            Verb::Report(v) => v.execute(),
            Verb::Compare(v) => v.execute(),
            Verb::Fit(v) => v.execute(),
            Verb::Passes(v) => v.execute(),
            Verb::Predict(v) => v.execute(),
            Verb::Limits(v) => v.execute(),
            Verb::Plot(v) => v.execute(),
            Verb::Export(v) => v.execute(),
            Verb::Fetch(v) => v.execute(),
            Verb::Render(v) => v.execute(),
            Verb::Simulate(v) => v.execute(),
            Verb::Brdf(v) => v.execute(),
            Verb::Published(v) => v.execute(),
            Verb::CheckTable(v) => v.execute(),
            Verb::Accuracy(v) => v.execute(),
            Verb::Satellites(v) => v.execute(),
            Verb::Verify(v) => v.execute(),
            Verb::Completions(v) => v.execute(),
            Verb::Man(v) => v.execute(),
        }
    }
}

/// Reads a configuration; an error in it names the file, and --set where that was given.
pub fn load(path: &Path, sets: &[String]) -> anyhow::Result<Config> {
    Config::load(path, sets).map_err(|error| match error {
        Error::Config { key, problem } => {
            let also = if sets.is_empty() { "" } else { " and --set" };
            Error::Config { key, problem: format!("{} (in {}{also})", problem.trim_end(), path.display()) }.into()
        }
        other => other.into(),
    })
}

/// A number of threads: more than a thousand is a typing error, and starting them would take minutes.
fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= 1024 => Ok(n),
        _ => Err("must be a whole number from 0 (all cores) to 1024".into()),
    }
}

/// An amount of memory: a number and its unit, decimal (MB, GB) or binary (MiB, GiB).
fn memory_bytes(text: &str) -> Result<usize, String> {
    let wrong = || "must be a number with its unit, MB, GB, TB, MiB, GiB or TiB, such as 600MB or 2GB".to_string();
    let text = text.trim();
    let (number, unit) = text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?);
    let scale = match unit.to_ascii_lowercase().as_str() {
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        "mib" => 1_048_576.0,
        "gib" => 1_073_741_824.0,
        "tib" => 1_099_511_627_776.0,
        _ => return Err(wrong()),
    };
    let number: f64 = number.trim().parse().map_err(|_| wrong())?;
    let bytes = number * scale;
    if (1.0..1e18).contains(&bytes) { Ok(bytes as usize) } else { Err(wrong()) }
}

/// The exit code of the program, and what went wrong on standard error.
pub fn answer(done: anyhow::Result<()>) -> ExitCode {
    let mut code = 0;
    if let Err(error) = done.or_else(|error| if output::is_closed_pipe(&error) { Ok(()) } else { Err(error) }) {
        tell(&format!("error: {error}"));
        code = error.downcast_ref::<Error>().map_or(1, Error::exit_code);
    }
    if let Err(error) = output::finish() {
        tell(&format!("error: {error}"));
        code = error.exit_code();
    }
    ExitCode::from(code)
}

/// A figure's file: SVG is all that is drawn.
pub fn svg_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_svg = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    if is_svg { Ok(path) } else { Err("figures are SVG: the name must end in .svg".into()) }
}

pub use log::tell;
pub use output::print;
