//! `satphot accuracy`: error against run time.

use std::path::{Path, PathBuf};

use clap::Args;
use cpu_time::ProcessTime;
use satphot::Error;
use satphot::accuracy::{Effort, METHODS, Method, Stopwatch, Sweep, Verdict, extremes};
use satphot::night::progress::Progress;
use satphot::night::stages::with_threads;
use satphot::report::accuracy::{accuracy_rows, write_accuracy_report, write_extremes_report};
use satphot::report::{AccuracyRow, Meta};

use super::{bar::Bars, print, tell};

/// Turns the knobs of numerical methods (--list shows which) and measures error against a converged reference, and CPU time.
///
/// Prints one line per setting and writes a table, a figure per method and a page. On one thread, so that CPU time is
/// run time. `*` is the default, `.` a setting beaten by another in both error and time.
#[derive(Debug, Args)]
pub struct Accuracy {
    /// Methods to measure; all if none is named (--list shows them)
    #[arg(value_name = "METHOD", value_parser = method)]
    methods: Vec<Method>,
    /// Few cases, under a minute (the default)
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Enough cases for worst errors that mean something: some minutes
    #[arg(long)]
    full: bool,
    /// Folder of accuracy.ecsv, accuracy_METHOD.svg and accuracy.html; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "satphot-accuracy")]
    out: PathBuf,
    /// Run the stiff and extreme cases instead: expected, got, verdict
    #[arg(long, conflicts_with_all = ["methods", "quick", "full", "list"])]
    extremes: bool,
    /// List the methods and stop
    #[arg(long)]
    list: bool,
    /// No progress bar
    #[arg(short, long)]
    quiet: bool,
}

impl Accuracy {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.list {
            METHODS.iter().for_each(|m| print(&format!("{:<18} {}\n", m.name, m.about)));
            return Ok(());
        }
        std::fs::create_dir_all(&self.out).map_err(|e| Error::NoInput {
            path: self.out.clone(),
            problem: format!("the folder of the results cannot be made ({e}); choose another with -o"),
        })?;
        if self.extremes {
            return extreme_cases(&self.out);
        }
        let effort = if self.full { Effort::Full } else { Effort::Quick };
        let chosen: Vec<Method> = if self.methods.is_empty() { METHODS.to_vec() } else { self.methods };
        let bar = Bars::new(!self.quiet);
        bar.stage("accuracy", chosen.len());
        let sweeps: Vec<(Method, Sweep)> = with_threads(1, || {
            let start = ProcessTime::now();
            let cpu_s = || start.elapsed().as_secs_f64();
            let stopwatch = Stopwatch { cpu_s: &cpu_s, effort };
            chosen
                .into_iter()
                .map(|method| {
                    let sweep = method.sweep(&stopwatch)?;
                    bar.tick();
                    Ok::<_, Error>((method, sweep))
                })
                .collect::<Result<_, _>>()
        })??;
        bar.done();
        for (method, sweep) in &sweeps {
            print(&format!("{}: {}\n", method.name, method.about));
            print(&format!(
                "    {:<30}{:>22}{:>11}{:>10}{:>10}{:>13}\n",
                "", sweep.knob, "median", "95 %", "worst", "CPU us"
            ));
            accuracy_rows(method, sweep).iter().for_each(|row| print(&line(row)));
        }
        let mut meta = Meta::default();
        meta.push("schema", "satphot.accuracy/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("effort", if self.full { "full" } else { "quick" });
        write_accuracy_report(&self.out, &sweeps, &meta)?;
        print(&format!("{}\n", self.out.join("accuracy.html").display()));
        Ok(())
    }
}

/// Prints every case, the wrong ones again at the end; exit code 1 if there is one.
fn extreme_cases(folder: &Path) -> anyhow::Result<()> {
    let cases = extremes();
    let size = |e: Option<f64>| e.map_or("-".into(), |e| format!("{e:.1e}"));
    for e in &cases {
        let (verdict, error, limit) = (e.verdict.name(), size(e.error), size(e.limit));
        print(&format!("{verdict:<12}{:<10}{:<62}{error:>9}  (limit {limit})\n", e.area, e.case));
    }
    let mut meta = Meta::default();
    meta.push("schema", "satphot.extremes/1");
    meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
    write_extremes_report(folder, &cases, &meta)?;
    let wrong: Vec<_> = cases.iter().filter(|e| e.verdict == Verdict::Wrong).collect();
    for e in &wrong {
        tell(&format!("WRONG: {}: expected {}, got {}", e.case, e.expected, e.got));
    }
    print(&format!("{} cases, {} wrong\n{}\n", cases.len(), wrong.len(), folder.join("extremes.html").display()));
    if wrong.is_empty() { Ok(()) } else { anyhow::bail!("{} extreme cases are wrong on this machine", wrong.len()) }
}

fn line(row: &AccuracyRow) -> String {
    let mark = match (row.is_default, row.on_front) {
        (1, _) => '*',
        (_, 0) => '.',
        _ => ' ',
    };
    let error = |e: Option<f64>| e.map_or("no number".into(), |e| format!("{e:.1e}"));
    format!(
        "  {mark} {:<30}{:>22}{:>11}{:>10}{:>10}{:>13.3}\n",
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
