//! `satphot published`: what the paper prints next to what is computed here; its table of light classes from any
//! magnitudes.

use std::path::PathBuf;

use clap::Args;
use satphot::base::threads::with_threads;
use satphot::figures::{LabelSample, label_histogram};
use satphot::paper::figures::write_figures;
use satphot::paper::labels::{Labelled, read_labelled, summary};
use satphot::paper::{Published, Rule, published, table};
use satphot::report::summary::text_table;
use satphot::tables::{LabelRow, Meta, MetaValue, csv_text, write_rows};

use super::bar::Bars;
use super::orbit_args::bad;
use super::{print, tell, threads};

const AFTER_HELP: &str = "\
One row per number of Caddy et al., \"The First Observations of Moonlit Satellites\": as printed, by
the formula and the inputs of the paper (as published), by the corrected physics (corrected), a verdict
and the reason. The verdict follows from the rule of the row, a tolerance per kind of number; the rules
stand above the table. --csv, --markdown and -o carry the reasons; docs/paper.md is made of --markdown --full.

With --observed the paper's table and histogram of brightness by day, twilight and night instead,
from the tables of `satphot run` (photometry.ecsv) or `satphot predict pass -o`: observed magnitudes
where there are any, else modelled ones, each under the label of its pass.

With --figures the figures of the paper that can be computed, as published and as corrected in the
same colours for the same numbers: the four lights, the ISS under three lights, its pass of 9 June
with the sky, the skies of two days, the moonlit Earth, the resolved ISS (about a minute).

Examples:
  satphot published
  satphot published --full --csv > published.csv
  satphot published --figures figures
  satphot published --observed satphot-out/2025-06-09/photometry.ecsv -o classes.svg

Exit code 4 for a table that lacks a column, with what is needed.";

/// Compares the numbers of the paper with ours; with --observed its table of light classes from magnitudes.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct PublishedVerb {
    /// Compute the slow rows too (a month, a day: about a minute)
    #[arg(long, conflicts_with = "observed")]
    full: bool,
    /// Tables of magnitudes: brightness by light class instead of the list of numbers (repeatable)
    #[arg(long, value_name = "FILE", num_args = 1..)]
    observed: Vec<PathBuf>,
    /// Folder for the figures of the paper, instead of the list of numbers
    #[arg(long, value_name = "DIR", conflicts_with_all = ["full", "observed", "csv", "markdown", "out"])]
    figures: Option<PathBuf>,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Markdown instead of a table
    #[arg(long, conflicts_with_all = ["csv", "observed"])]
    markdown: bool,
    /// File to write: .ecsv is the table, .svg the histogram of --observed (repeatable)
    #[arg(short, long, value_name = "FILE")]
    out: Vec<PathBuf>,
    /// Number of threads; 0 = all cores
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl PublishedVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        if let Some(folder) = &self.figures {
            let bar = Bars::new(!self.quiet);
            for path in with_threads(self.jobs, || write_figures(folder, &bar))?? {
                print(&format!("{}\n", path.display()));
            }
            return Ok(());
        }
        let ends_with = |ending: &str| {
            let fits = move |p: &&PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
            self.out.iter().filter(fits).cloned().collect::<Vec<_>>()
        };
        let (tables, figures) = (ends_with("ecsv"), ends_with("svg"));
        if tables.len() + figures.len() < self.out.len() {
            return Err(bad("--out", "the name must end in .ecsv (table) or .svg (histogram of --observed)".into()));
        }
        for folder in self.out.iter().filter_map(|p| p.parent()).filter(|p| !p.as_os_str().is_empty()) {
            satphot::base::file::make_folder(folder)?;
        }
        if self.observed.is_empty() {
            if !figures.is_empty() {
                return Err(bad("--out", "the list of numbers has no figure; .svg goes with --observed".into()));
            }
            self.numbers(&tables)?;
        } else {
            self.classes(&tables, &figures)?;
        }
        for file in self.out.iter().filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    /// The list of numbers.
    fn numbers(&self, tables: &[PathBuf]) -> anyhow::Result<()> {
        let rows = with_threads(self.jobs, || published(self.full))??;
        let mut meta = meta("satphot.published/1");
        meta.push("rows", table::counts(&rows));
        let rules = Rule::ALL.map(|rule| (rule.name().to_owned(), rule.criterion().into()));
        meta.push("rules", MetaValue::Map(rules.to_vec()));
        let file_rows: Vec<_> = rows.iter().map(Published::file_row).collect();
        tables.iter().try_for_each(|path| write_rows(path, &file_rows, &meta))?;
        if self.csv {
            print(&csv_text(&file_rows)?);
        } else if self.markdown {
            print(&table::markdown(&rows));
        } else {
            print(&format!("{}\n{}\n{}\n", table::legend(), table::text(&rows), table::counts(&rows)));
        }
        let n_skipped = rows.iter().filter(|r| r.is_skipped).count();
        if n_skipped > 0 && !self.quiet {
            tell(&format!("note: {n_skipped} rows take longer and were skipped; --full computes them"));
        }
        Ok(())
    }

    /// The table and the histogram of light classes.
    fn classes(&self, tables: &[PathBuf], figures: &[PathBuf]) -> anyhow::Result<()> {
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for path in &self.observed {
            let read = read_labelled(path)?;
            if !self.quiet {
                let (n, file) = (read.rows.len(), path.display());
                tell(&format!("note: {file}: {n} magnitudes from {}, {} rows without", read.column, read.without));
            }
            columns.push(read.column);
            rows.extend(read.rows);
        }
        columns.sort_unstable();
        columns.dedup();
        let lines = summary(&rows);
        let mut meta = meta("satphot.labels/1");
        meta.push("magnitudes", columns.join(", "));
        tables.iter().try_for_each(|path| write_rows(path, &lines, &meta))?;
        let title = match columns.as_slice() {
            ["v_mag"] => "Observed brightness by light",
            ["model_v_mag"] => "Modelled brightness by light",
            _ => "Observed and modelled brightness by light",
        };
        for path in figures {
            label_histogram(path, title, &samples(&rows, &lines))?;
        }
        if self.csv {
            print(&csv_text(&lines)?);
        } else {
            print(&class_table(&lines));
        }
        Ok(())
    }
}

fn meta(schema: &str) -> Meta {
    let mut meta = Meta::default();
    meta.push("schema", schema);
    meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
    meta.push("paper", "Caddy et al., The First Observations of Moonlit Satellites");
    meta
}

/// The magnitudes of each class, as the figure wants them.
fn samples(rows: &[Labelled], lines: &[LabelRow]) -> Vec<LabelSample> {
    let of = |line: &LabelRow| LabelSample {
        name: format!("{}: {}", line.paper_label, line.light),
        v_mag: rows.iter().filter(|r| r.pass.to_string() == line.paper_label).map(|r| r.v_mag).collect(),
        median_v_mag: line.median_v_mag,
    };
    lines.iter().rev().map(of).collect()
}

fn class_table(lines: &[LabelRow]) -> String {
    let head = ["label", "light", "n", "median V", "std", "n by frame", "median V", "paper: n", "median V", "std"];
    let number = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.2}"));
    let line = |l: &LabelRow| {
        vec![
            l.paper_label.clone(),
            l.light.clone(),
            l.n.to_string(),
            number(l.median_v_mag),
            number(l.std_v_mag),
            l.n_by_frame.to_string(),
            number(l.median_by_frame_v_mag),
            l.published_n.to_string(),
            number(Some(l.published_median_v_mag)),
            number(Some(l.published_std_v_mag)),
        ]
    };
    text_table(&head, &lines.iter().map(line).collect::<Vec<_>>())
}
