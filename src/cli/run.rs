//! `satphot run`: the whole night.

use std::path::PathBuf;

use clap::Args;
use satphot::base::stop::Stop;
use satphot::config::Config;
use satphot::frames::{Exposure, Role};
use satphot::pipeline::groups::{Groups, Night, Split, run_night, split};
use satphot::pipeline::options::Options;
use satphot::pipeline::prepared::Prepared;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::shards::products::FrameCache;
use satphot::pipeline::survey::files::Survey;
use satphot::pipeline::survey::preflight::{Preflight, preflight};
use satphot::pipeline::survey::scale::check_stars;
use satphot::pipeline::target::frame::missing_parts;

use super::{Common, print, tell};

const AFTER_HELP: &str = "\
A run that was stopped or killed continues when the same command is run again: every measured frame is kept
in .satphot/ next to the results, with the hashes of all it depends on, and measured again only where one of them has changed
(frame, configuration, flat, catalogue, elements, version). --force recomputes everything. A second run of a finished night
takes seconds and gives the same bytes.

Examples:
  satphot run                                  the night of pipeline.toml
  satphot run night.toml -j 4 --max-memory 2GB
  satphot run night.toml --dry-run             what each file is taken for, and all that is missing, with lines to paste
  satphot run night.toml -o results --set photometry.aper_r_fwhm=2.5
  satphot run night.toml --json --quiet 2> run.jsonl
  satphot run night.toml --force               ignore earlier results

Exit code 2: the configuration contradicts the frames (another camera, a scale more than 2 % from that of the stars);
3: outputs are written, but too many frames failed or no star matched; 5: flat, catalogue or elements missing;
75: another run is at work in the folder; 130, 143: interrupted, finished frames are kept.";

/// Reduces the night of a pipeline.toml and writes tables, figures and a summary.
///
/// A night of several satellites, filters or cameras is reduced group by group, each into a folder of its own in that of
/// the night, with night.ecsv and report.html over all of them.
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
    /// Print the details of zeropoint, aperture and model, time and memory, and list the files written
    #[arg(short, long)]
    verbose: bool,
    /// Report on standard error what was skipped in each scene and frame, why, and the CPU time saved
    #[arg(long)]
    explain: bool,
    /// Report what each file is, what would be done and what is missing, and stop with the exit code of the run
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
        if let Some(out) = self.out.take() {
            config.night.output = out;
        }
        if self.dry_run {
            return dry_run_night(&config, self.common.jobs);
        }
        super::signals::end_while_reading();
        let options = Options {
            strict: self.strict,
            no_figures: self.no_figures,
            explain: self.explain,
            redo: self.common.force,
            ..self.common.options()
        };
        let progress = self.common.progress();
        NightPrinter { common: &self.common, verbose: self.verbose }.night(run_night(&config, &options, &progress)?)
    }
}

/// How a reduced night is printed.
pub struct NightPrinter<'a> {
    /// Quiet or not, text or JSON.
    pub common: &'a Common,
    /// With all details.
    pub verbose: bool,
}

impl NightPrinter<'_> {
    /// Prints a night and its notes.
    pub fn night(&self, night: Night) -> anyhow::Result<()> {
        match night {
            Night::Single(summary) => self.single(&summary),
            Night::Groups(night) => self.groups(night),
        }
    }

    fn single(&self, summary: &Summary) -> anyhow::Result<()> {
        if self.common.json {
            print(&format!("{}\n", summary.json()));
            return summary.poor_error().map_or(Ok(()), |error| Err(error.into()));
        }
        self.tell_notes(summary, "");
        print(&if self.verbose { summary.text() } else { summary.brief() });
        if self.verbose {
            let memory = satphot::pipeline::products::manifest::peak_memory_mb()
                .map(|mb| format!(", {mb:.0} MB peak memory"))
                .unwrap_or_default();
            print(&format!("\n{}{memory}\n", summary.speed()));
        }
        print(&format!("\nResults in {}\n", summary.folder.display()));
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

    /// Prints each group of a night of several satellites, filters or cameras.
    fn groups(&self, night: Groups) -> anyhow::Result<()> {
        if self.common.json {
            print(&format!("{}\n", night.json()));
            return night.error().map_or(Ok(()), |error| Err(error.into()));
        }
        if !self.common.quiet {
            night.notes.iter().for_each(|note| tell(&format!("note: {note}")));
            for summary in night.reduced.iter().filter_map(|r| r.summary.as_ref().ok()) {
                self.tell_notes(summary, &format!("{}: ", summary.night));
            }
        }
        print(&night.text(self.verbose));
        print(&format!(
            "\nResults in {}, a folder for each of {} groups\n",
            night.folder.display(),
            night.reduced.len()
        ));
        night.error().map_or(Ok(()), |error| Err(error.into()))
    }

    /// What should be known of a night, on standard error.
    fn tell_notes(&self, summary: &Summary, of: &str) {
        if self.common.quiet {
            return;
        }
        let details = summary.details.iter().filter(|_| self.verbose);
        for note in summary.notes.iter().chain(details).chain(&summary.kept_note()) {
            tell(&format!("note: {of}{note}"));
        }
        for note in &summary.empty_columns {
            tell(&format!("skipped: {of}{note}"));
        }
    }
}

/// CPU time of a frame by its role \[s per million pixels\]: docs/speed.md, with half as much again for slower
/// machines.
const CPU_S_PER_MPX: [(Role, f64); 3] = [(Role::Flat, 0.0018), (Role::Stars, 0.011), (Role::Target, 0.009)];

/// The dry run of each group of a night, or of the night where it is of one kind.
///
/// The error of the first group is that of the night, after all have been shown.
fn dry_run_night(config: &Config, jobs: usize) -> anyhow::Result<()> {
    let Split { groups, notes, ungrouped, .. } = split(config, &[], &Stop::default())?;
    notes.iter().for_each(|note| print(&format!("note       {note}\n")));
    if let [] | [_] = groups.as_slice() {
        return dry_run(groups.first().map_or(config, |group| &group.config), &[], jobs);
    }
    ungrouped.iter().for_each(|row| print(&format!("ungrouped  {}: {}\n", row.frame, row.reason)));
    let mut outcome = Ok(());
    for group in &groups {
        print(&format!("\n--- {}\n", group.config.night.name));
        outcome = outcome.and(dry_run(&group.config, &group.files, jobs));
    }
    outcome
}

/// What each file is and what the run would make of them, without touching their pixels, after every check that the run
/// makes before it reads any; only where headers contradict the configured scale, star frames are solved as in the run.
///
/// Everything that is missing is reported at the end, with the lines to paste, and ends as the run would.
fn dry_run(config: &Config, files: &[PathBuf], jobs: usize) -> anyhow::Result<()> {
    let mut preflight = preflight(config, files, &Stop::default())?;
    let Preflight { prepared, survey, findings, .. } = &mut preflight;
    if findings.scale_in_doubt && findings.errors.is_empty() {
        match check_stars(survey, prepared, &FrameCache::default(), jobs) {
            Ok(notes) => findings.notes.extend(notes),
            Err(error) => findings.errors.push(error),
        }
    }
    let line = |kind: &str, e: &Exposure| {
        let time = e.time.as_ref().map(|t| satphot::base::time::iso_utc(t.mid, 3)).unwrap_or_default();
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
    for s in &survey.set_aside {
        print(&format!("set aside  {}: {}\n", s.path.display(), s.reason));
    }
    print(&format!("\n{}", masters(config, survey, prepared)));
    // flats and zeropoint of this night are only made by the run
    let has_flat = config.flat.master.is_some() || !survey.flats.is_empty();
    let has_zeropoint = config.zeropoint.previous.is_some() || !survey.pointings.is_empty();
    for part in missing_parts(prepared, has_flat, has_zeropoint) {
        print(&format!("missing    {part}\n"));
    }
    print(&work(survey, jobs));
    print(&format!("results    would go to {}\n", config.night.output.join(&config.night.name).display()));
    for note in &findings.notes {
        print(&format!("note       {note}\n"));
    }
    for error in &findings.errors {
        print(&format!("missing    {error}\n"));
    }
    let paste = findings.paste();
    if !paste.is_empty() {
        print(&format!("\nlines to paste into pipeline.toml:\n{paste}"));
    }
    preflight.ready().map(|_| ()).map_err(Into::into)
}

/// How much there is to read, and how long that may take.
fn work(survey: &Survey, jobs: usize) -> String {
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
    format!(
        "work       {} frames, {:.0} MB to read, about {seconds:.0} s on {threads:.0} threads if the disk keeps up\n",
        frames.len(),
        bytes as f64 / 1e6
    )
}

/// Where master flat and zeropoint would be from.
fn masters(config: &Config, survey: &Survey, prepared: &Prepared) -> String {
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
    let elements = match &prepared.tracker {
        Some(_) => config.orbit.as_ref().map(|o| o.elements.display().to_string()).unwrap_or_default(),
        None if config.orbit.is_some() => "missing, see below".into(),
        None => "none".into(),
    };
    let model = config.model.as_ref().map_or("none", |m| m.satellite.as_str());
    format!("flat       {flat}\nzeropoint  {zeropoint}\nelements   {elements}\nmodel      {model}\n")
}
