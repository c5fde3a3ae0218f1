//! `satphot accuracy`: error against run time.

mod peers;

use std::path::{Path, PathBuf};

use clap::Args;
use cpu_time::ProcessTime;
use satphot::Error;
use satphot::accuracy::output::{
    CasesPage, EXTREMES_PAGE, PATHS_PAGE, accuracy_rows, write_accuracy_report, write_cases_report,
};
use satphot::accuracy::{Effort, Extreme, METHODS, Method, Stopwatch, Sweep, Verdict, extremes, paths};
use satphot::base::progress::Progress;
use satphot::base::threads::with_threads;
use satphot::tables::{AccuracyRow, Meta};

use super::{bar::Bars, print, tell};

const AFTER_HELP: &str = "\
Examples:
  satphot accuracy                                  every method, some minutes
  satphot accuracy earth-reflected apertures --full -o accuracy
  satphot accuracy --extremes
  satphot accuracy --paths
  satphot accuracy earth-reflected --python ~/lumos/bin/python
      draws lumos-sat's curve next to satphot's; sep and photutils for apertures and
      background-mesh. SATPHOT_PYTHON names interpreters too, with : between them.";

/// Varies the settings of numerical methods (--list names them) and measures error against a converged reference, and CPU
/// time.
///
/// Prints one line per setting and writes a table, a figure per method and a page. On one thread, so that CPU time is
/// run time; the time is the median of repeats, with half the interval that holds it in 95 of 100 cases. `*` is the default, `.` a
/// setting behind another that is as accurate and takes less time, beyond the errors of both times.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Accuracy {
    /// Methods to measure; all if none is named (--list shows them)
    #[arg(value_name = "METHOD", value_parser = method)]
    methods: Vec<Method>,
    /// Few cases; seconds for most methods, a minute or two for whole nights (the default)
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Enough cases for meaningful worst errors; takes many minutes with whole nights
    #[arg(long)]
    full: bool,
    /// Draws other cases: another number, other skies, nights and directions
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Folder of accuracy.ecsv, accuracy_METHOD.svg and accuracy.html; made if it does not exist
    #[arg(short, long, value_name = "DIR", default_value = "satphot-accuracy")]
    out: PathBuf,
    /// Run the stiff and extreme cases instead: expected, got, verdict
    #[arg(long, conflicts_with_all = ["methods", "quick", "full", "list", "paths"])]
    extremes: bool,
    /// Compare two independent paths to each quantity instead: the worst disagreement
    #[arg(long, conflicts_with_all = ["methods", "quick", "full", "list"])]
    paths: bool,
    /// Python with lumos-sat, sep or photutils, for their curves next to ours (repeatable)
    #[arg(long, value_name = "PYTHON")]
    python: Vec<PathBuf>,
    /// List the methods and stop
    #[arg(long)]
    list: bool,
    /// Print no progress bar
    #[arg(short, long)]
    quiet: bool,
}

impl Accuracy {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.list {
            METHODS.iter().for_each(|m| print(&format!("{:<18} {}\n", m.name, m.about)));
            return Ok(());
        }
        satphot::base::file::make_folder(&self.out)?;
        if self.extremes {
            return tell_cases(&self.out, &EXTREMES_PAGE, &extremes());
        }
        if self.paths {
            return tell_cases(&self.out, &PATHS_PAGE, &paths());
        }
        let effort = if self.full { Effort::Full } else { Effort::Quick };
        let chosen: Vec<Method> = if self.methods.is_empty() { METHODS.to_vec() } else { self.methods };
        let bar = Bars::new(!self.quiet);
        let mut sweeps: Vec<(Method, Sweep)> = with_threads(1, || {
            let start = ProcessTime::now();
            let cpu_s = || start.elapsed().as_secs_f64();
            let stopwatch = Stopwatch { cpu_s: &cpu_s, effort, seed: self.seed, progress: &bar };
            chosen
                .into_iter()
                .map(|method| {
                    bar.stage(method.name, 1);
                    let sweep = method.sweep(&stopwatch)?;
                    bar.tick();
                    bar.done();
                    Ok::<_, Error>((method, sweep))
                })
                .collect::<Result<_, _>>()
        })??;
        peers::add(&mut sweeps, &self.python, self.full, self.quiet)?;
        for (method, sweep) in &sweeps {
            print(&format!("{}: {}\n", method.name, method.about));
            print(&format!(
                "    {:<30}{:>22}{:>11}{:>10}{:>10}{:>13}\n",
                "", sweep.knob, "median", "95 %", "worst", "CPU us"
            ));
            accuracy_rows(method, sweep).iter().for_each(|row| print(&line(row)));
            print(&format!("    default: {}\n\n", sweep.standing()));
        }
        let mut meta = Meta::default();
        meta.push("schema", "satphot.accuracy/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("effort", if self.full { "full" } else { "quick" });
        meta.push("seed", self.seed.to_string());
        write_accuracy_report(&self.out, &sweeps, &meta)?;
        print(&format!("{}\n", self.out.join("accuracy.html").display()));
        Ok(())
    }
}

/// Prints every case, the wrong ones again at the end; exit code 1 if there is one.
fn tell_cases(folder: &Path, page: &CasesPage, cases: &[Extreme]) -> anyhow::Result<()> {
    let size = |e: Option<f64>| e.map_or("-".into(), |e| format!("{e:.1e}"));
    let of_paths = page.stem() == PATHS_PAGE.stem();
    for e in cases {
        let (verdict, error, limit) = (e.verdict.name(), size(e.error), size(e.limit));
        if of_paths {
            print(&format!("{verdict:<12}{:<62}{error:>9}  (limit {limit}, {})\n", e.area, e.case));
            print(&format!("            {}; {}\n", e.expected, e.got));
        } else {
            print(&format!("{verdict:<12}{:<10}{:<62}{error:>9}  (limit {limit})\n", e.area, e.case));
        }
    }
    let mut meta = Meta::default();
    meta.push("schema", "satphot.extremes/1");
    meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
    write_cases_report(folder, page, cases, &meta)?;
    let of = |verdict: Verdict| cases.iter().filter(move |e| e.verdict == verdict);
    for e in of(Verdict::KnownLimit) {
        tell(&format!("known limit: {}: {} off, {} wanted", e.case, size(e.error), size(e.limit)));
    }
    for e in of(Verdict::Wrong) {
        tell(&format!("WRONG: {}: expected {}, got {}", e.case, e.expected, e.got));
    }
    let (wrong, known) = (of(Verdict::Wrong).count(), of(Verdict::KnownLimit).count());
    let written = folder.join(format!("{}.html", page.stem()));
    print(&format!("{} cases, {known} known limits, {wrong} wrong\n{}\n", cases.len(), written.display()));
    if wrong == 0 { Ok(()) } else { anyhow::bail!("{wrong} cases are wrong on this machine") }
}

fn line(row: &AccuracyRow) -> String {
    let mark = match (row.is_default, row.place.as_str()) {
        (1, _) => '*',
        (_, "behind") => '.',
        _ => ' ',
    };
    let error = |e: Option<f64>| e.map_or("no number".into(), |e| format!("{e:.1e}"));
    let half = 50.0 * (row.cpu_us_high - row.cpu_us_low) / row.cpu_us;
    let quality = match (row.err_mean, row.err_sd, row.coverage_frac) {
        (Some(bias), Some(sd), Some(held)) => {
            format!("   bias {bias:+.4}, scatter {sd:.4}, {:.0} % within 1 sigma", 100.0 * held)
        }
        _ => String::new(),
    };
    format!(
        "  {mark} {:<30}{:>22}{:>11}{:>10}{:>10}{:>13.3} ±{half:>3.0} %{quality}\n",
        row.case,
        row.setting,
        error(row.err_median),
        error(row.err_p95),
        error(row.err_worst),
        row.cpu_us
    )
}

/// A method by its name.
fn method(name: &str) -> Result<Method, String> {
    METHODS.iter().find(|m| m.name == name).copied().ok_or_else(|| {
        let names: Vec<&str> = METHODS.iter().map(|m| m.name).collect();
        format!("no such method; there are {}", names.join(", "))
    })
}
