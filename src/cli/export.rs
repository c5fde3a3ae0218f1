//! `satphot export`: results in the formats of others.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use satphot::Error;
use satphot::base::file::{write_atomic, write_streamed};
use satphot::config::{Config, Reporter};
use satphot::export::{
    Choice, DataMode, Facts, Selected, TdmNames, UdlNames, check_score, iod_text, score_text, select, sound, tdm_text,
    udl_text,
};
use satphot::tables::formats::{Table, provenance, write_csv, write_fits, write_votable};
use satphot::tables::words::Verdict;
use satphot::tables::{PhotometryRow, read_table};

use super::orbit_args::{SiteArg, bad};
use super::{load, output, print, tell};

const AFTER_HELP: &str = "\
Tables (fits, votable, csv, parquet) hold every row and column of photometry.ecsv, stars.ecsv or residuals.ecsv.
Observations (score, tdm, udl, iod) are the rows of verdict `use`; --verdicts adds others. A non-detection is
never written as a magnitude: SCORE takes it as a limit, the others omit it. Simulated data are refused for
SCORE and IOD, and marked in the others.

The reporter is read from [reporter] of the run's configuration (effective.toml next to the table, or -c); the
options here override it.

Examples:
  satphot export satphot-out/2025-06-09 --to fits -o night.fits
  satphot export satphot-out/2025-06-09 --to score --email me@example.org \\
      --orcid 0000-0002-1825-0097 --observing-mode CMOS -o score.csv
  satphot export photometry.ecsv --to tdm --organisation MY_OBS --station MY_CDK24 -o night.tdm
  satphot export --check score.csv";

/// Writes the results of a run as tables for other programs, or as observations for archives.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Export {
    /// Folder of a run, or a table: photometry.ecsv, stars.ecsv, residuals.ecsv [default: the results of pipeline.toml]
    #[arg(value_name = "DIR|ECSV")]
    input: Option<PathBuf>,
    /// Format
    #[arg(long, value_name = "FORMAT", required_unless_present = "check")]
    to: Option<Format>,
    /// File to write; - is standard output
    #[arg(short, long, value_name = "FILE", required_unless_present = "check")]
    out: Option<PathBuf>,
    /// Check a CSV file by the rules of SCORE, row by row, and stop
    #[arg(long, value_name = "CSV", conflicts_with_all = ["input", "to", "out"])]
    check: Option<PathBuf>,
    /// Verdicts to write: use, caution, reject [default: use for observations, all for tables]
    #[arg(long, value_name = "LIST")]
    verdicts: Option<String>,
    /// Configuration with [reporter] and [site]; effective.toml next to the table if absent
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "config")]
    sets: Vec<String>,
    #[command(flatten)]
    place: SiteArg,
    #[command(flatten)]
    reporter: ReporterArgs,
    /// REAL, TEST or EXERCISE, where the table does not say SIMULATED
    #[arg(long, value_name = "MODE")]
    data_mode: Option<String>,
    /// COSPAR id of rows that have none, e.g. 1998-067A
    #[arg(long, value_name = "ID")]
    object_id: Option<String>,
    /// Catalogue number of rows that have none
    #[arg(long, value_name = "NUMBER")]
    norad_cat_id: Option<i64>,
    /// SCORE: leave satellite_name empty; the number is enough, and a name the server does not know is refused
    #[arg(long)]
    no_name: bool,
    /// TDM: CREATION_DATE, UTC [default: the newest observation, so that same input gives same bytes]
    #[arg(long, value_name = "UTC")]
    creation_date: Option<String>,
    /// TDM: MESSAGE_ID [default: from date and satellite]
    #[arg(long, value_name = "ID")]
    message_id: Option<String>,
    /// UDL: classification marking
    #[arg(long, value_name = "MARKING", default_value = "U")]
    classification: String,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

/// Formats of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// SCORE/SatHub CSV, 27 columns
    Score,
    /// CCSDS tracking data message 2.0, KVN
    Tdm,
    /// Unified Data Library EOObservation, JSON
    Udl,
    /// IOD lines of the visual observers
    Iod,
    /// FITS binary tables: PHOTOMETRY, ZEROPOINT, PROVENANCE
    Fits,
    /// VOTable 1.4
    Votable,
    /// Plain CSV
    Csv,
    /// Parquet (if satphot is built with the feature `parquet`)
    Parquet,
}

/// Who reports: [reporter] of the configuration.
#[derive(Debug, Clone, Args)]
struct ReporterArgs {
    /// TDM, UDL: who sends the file (reporter.organisation)
    #[arg(long, value_name = "NAME")]
    organisation: Option<String>,
    /// TDM, UDL: name of the station (reporter.station) [default: site.name]
    #[arg(long, value_name = "NAME")]
    station: Option<String>,
    /// SCORE: e-mail address (reporter.email)
    #[arg(long, value_name = "ADDRESS")]
    email: Option<String>,
    /// SCORE: ORCID of each observer, comma-separated (reporter.orcid)
    #[arg(long, value_name = "ORCID", value_delimiter = ',')]
    orcid: Vec<String>,
    /// SCORE: telescope and camera (reporter.instrument) [default: from the configuration]
    #[arg(long, value_name = "WORDS")]
    instrument: Option<String>,
    /// SCORE: VISUAL, BINOCULARS, CCD, CMOS or OTHER (reporter.observing_mode)
    #[arg(long, value_name = "MODE")]
    observing_mode: Option<String>,
    /// SCORE: filter in words (reporter.filter) [default: from header and band]
    #[arg(long, value_name = "WORDS")]
    filter: Option<String>,
    /// SCORE: observatory code of the Minor Planet Center (reporter.mpc_code)
    #[arg(long, value_name = "CODE")]
    mpc_code: Option<String>,
    /// SCORE: URL of the frames (reporter.data_archive_link)
    #[arg(long, value_name = "URL")]
    archive_link: Option<String>,
    /// IOD: four-digit station number (reporter.iod_station)
    #[arg(long, value_name = "NUMBER")]
    iod_station: Option<String>,
}

impl Export {
    pub fn execute(mut self) -> anyhow::Result<()> {
        if let Some(file) = &self.check {
            return check(file);
        }
        let (Some(format), Some(out)) = (self.to, self.out.take()) else {
            return Err(bad("--to", "give a format and a file (-o)".into()));
        };
        let input = self.table()?;
        if out.as_os_str() == "-" {
            // made as a file, because the writers of tables want one
            let folder = tempfile::tempdir().map_err(|e| Error::io(std::env::temp_dir(), e))?;
            let made = folder.path().join("standard_output");
            self.write(format, &input, &made)?;
            return Ok(output::copy(&made)?);
        }
        let same = |a: &Path, b: &Path| {
            std::fs::canonicalize(a).ok().is_some_and(|a| std::fs::canonicalize(b).ok() == Some(a))
        };
        if same(&input, &out) {
            return Err(bad("--out", format!("{} is the table itself; choose another file", out.display())));
        }
        self.write(format, &input, &out)?;
        if !self.quiet {
            tell(&format!("wrote {}", out.display()));
        }
        Ok(())
    }

    /// Writes the table at `input` as a file of a format.
    fn write(&self, format: Format, input: &Path, out: &Path) -> anyhow::Result<()> {
        let mut table = read_table(input)?;
        if !table.ignored.is_empty() {
            self.note(&format!("columns that satphot does not know were skipped: {}", table.ignored.join(", ")));
        }
        match format {
            Format::Fits | Format::Votable | Format::Csv | Format::Parquet => {
                self.filter(&mut table)?;
                self.note(&format!("{} rows of {}", table.records.len(), table.name));
                self.write_table(format, &table, input, out)
            }
            _ => self.write_observations(format, &table, input, out),
        }
    }

    /// The table that is meant: a file, the photometry of a folder, or that of the configuration.
    fn table(&self) -> anyhow::Result<PathBuf> {
        let folder = match &self.input {
            Some(path) if !path.exists() => {
                let problem =
                    "does not exist; name a table, or the folder of a finished night (`satphot run` writes it)";
                return Err(Error::NoInput { path: path.clone(), problem: problem.into() }.into());
            }
            Some(path) if !path.is_dir() => return Ok(path.clone()),
            Some(folder) => folder.clone(),
            None => {
                let file = self.config.clone().unwrap_or_else(|| "pipeline.toml".into());
                if !file.exists() {
                    let problem =
                        format!("no table is named and {} is not there; name a folder or table", file.display());
                    return Err(Error::NoInput { path: file, problem }.into());
                }
                let night = load(&file, &self.sets)?.night;
                night.output.join(night.name)
            }
        };
        let table = folder.join("photometry.ecsv");
        if table.exists() {
            return Ok(table);
        }
        let problem = "holds no photometry.ecsv; `satphot run` writes one, or name a table".into();
        Err(Error::NoInput { path: folder, problem }.into())
    }

    fn note(&self, text: &str) {
        if !self.quiet {
            tell(&format!("note: {text}"));
        }
    }

    /// Rows of the verdicts that are requested; all of them unless some are.
    fn filter(&self, table: &mut Table) -> anyhow::Result<()> {
        let Some(verdicts) = &self.verdicts else { return Ok(()) };
        let choice = Choice::named(verdicts)?;
        let Some(at) = table.columns.iter().position(|c| c.name == "verdict") else {
            return Err(bad("--verdicts", format!("a table of {} has no verdicts; leave the option out", table.name)));
        };
        table.records.retain(|record| match record.get(at).and_then(Verdict::from_cell) {
            Some(Verdict::Caution) => choice.caution,
            Some(Verdict::Reject) => choice.reject,
            _ => true,
        });
        Ok(())
    }

    fn write_table(&self, format: Format, table: &Table, input: &Path, out: &Path) -> anyhow::Result<()> {
        let sibling = |name: &str| input.with_file_name(name);
        match format {
            Format::Fits => {
                let stars = sibling("stars.ecsv");
                let stars = if table.name == "photometry" && stars.exists() { Some(read_table(&stars)?) } else { None };
                let text = |name: &str| std::fs::read_to_string(sibling(name)).ok();
                let provenance =
                    provenance(&table.meta, text("effective.toml").as_deref(), text("manifest.json").as_deref())?;
                write_fits(out, table, stars.as_ref(), &provenance)?;
            }
            Format::Votable => write_streamed(out, |file| write_votable(file, table))?,
            Format::Csv => write_streamed(out, |file| write_csv(file, table))?,
            _ => parquet(table, out)?,
        }
        Ok(())
    }

    fn write_observations(&self, format: Format, table: &Table, input: &Path, out: &Path) -> anyhow::Result<()> {
        if table.name != "photometry" {
            let problem = format!("{} holds {}; observations are in photometry.ecsv", input.display(), table.name);
            return Err(bad("--to", problem));
        }
        let broken = |e: csv::Error| Error::Table { path: input.into(), line: None, problem: e.to_string() };
        let mut rows: Vec<PhotometryRow> = table.rows().map_err(broken)?;
        for row in &mut rows {
            row.norad_cat_id = row.norad_cat_id.or(self.norad_cat_id);
            if let (true, Some(id)) = (row.object_id.is_empty(), &self.object_id) {
                row.object_id.clone_from(id);
            }
        }
        sound(input, &rows)?;
        let choice = self.verdicts.as_deref().map_or(Ok(Choice::default()), Choice::named)?;
        let facts = self.facts(table, input)?;
        let selected = select(&rows, choice, format == Format::Score);
        self.tell_selected(&selected, facts.data_mode);
        let text = match format {
            Format::Score => {
                let scored = score_text(input, &selected.kept, &facts, !self.no_name)?;
                scored.warnings.iter().for_each(|w| self.note(w));
                scored.text
            }
            Format::Tdm => {
                let names = TdmNames { creation_date: self.creation_date.clone(), message_id: self.message_id.clone() };
                tdm_text(input, &rows, &selected.kept, &facts, &names)?
            }
            Format::Udl => {
                let names = UdlNames { classification: self.classification.clone() };
                udl_text(input, &rows, &selected.kept, &facts, &names)?
            }
            _ => iod_text(input, &selected.kept, &facts)?,
        };
        Ok(write_atomic(out, text.as_bytes())?)
    }

    fn tell_selected(&self, selected: &Selected<'_>, mode: Option<DataMode>) {
        let simulated = if mode == Some(DataMode::Simulated) { " (SIMULATED)" } else { "" };
        self.note(&format!("{}{simulated}", selected.text()));
    }

    /// What the observations share: the table, the configuration, the options.
    fn facts(&self, table: &Table, input: &Path) -> anyhow::Result<Facts> {
        let config = self.configuration(input)?;
        let reporter = self.reporter.clone();
        let reporter = Reporter {
            organisation: reporter.organisation,
            station: reporter.station,
            email: reporter.email,
            orcid: reporter.orcid,
            instrument: reporter.instrument,
            observing_mode: reporter.observing_mode,
            filter: reporter.filter,
            mpc_code: reporter.mpc_code,
            data_archive_link: reporter.archive_link,
            iod_station: reporter.iod_station,
        };
        let mut facts = Facts::new(&table.meta, config.as_ref(), reporter)?;
        if let Some(site) = self.place.given()?
            && facts.place([site.lat_deg, site.lon_deg, site.alt_m])?
        {
            self.note("--site replaces the place that the table or the configuration names");
        }
        if let Some(name) = &self.data_mode {
            let mode = DataMode::named(&name.to_uppercase())
                .ok_or_else(|| bad("--data-mode", format!("`{name}` is not REAL, SIMULATED, TEST or EXERCISE")))?;
            if mode == DataMode::Real && facts.data_mode.is_some_and(|stated| stated != DataMode::Real) {
                return Err(bad(
                    "--data-mode",
                    "the table says that its data are not real; this cannot be overridden".into(),
                ));
            }
            facts.data_mode = Some(mode);
        }
        Ok(facts)
    }

    /// The configuration that is named, else that of the run next to the table, if it can be read.
    fn configuration(&self, input: &Path) -> anyhow::Result<Option<Config>> {
        if let Some(file) = &self.config {
            return load(file, &self.sets).map(Some);
        }
        let sibling = input.with_file_name("effective.toml");
        if !sibling.exists() {
            return Ok(None);
        }
        match load(&sibling, &[]) {
            Ok(config) => Ok(Some(config)),
            Err(error) => {
                self.note(&format!("{error}; going on without it"));
                Ok(None)
            }
        }
    }
}

#[cfg(feature = "parquet")]
fn parquet(table: &Table, out: &Path) -> anyhow::Result<()> {
    Ok(write_streamed(out, |file| satphot::tables::formats::write_parquet(file, table))?)
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &Table, _: &Path) -> anyhow::Result<()> {
    let problem = "parquet is not in this build of satphot; build it with `cargo build --release --features parquet`, or \
                   use fits, votable or csv";
    Err(bad("--to", problem.into()))
}

/// What SCORE would refuse, line by line.
fn check(file: &Path) -> anyhow::Result<()> {
    let bytes = std::fs::read(file).map_err(|e| Error::io(file, e))?;
    let refused = |problem: String| Error::Table { path: file.into(), line: None, problem };
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        Error::Table { path: file.into(), line: Some(line), problem: "is not UTF-8; save the file as UTF-8".into() }
    })?;
    let found = check_score(&text);
    for finding in &found {
        print(&format!("{}: {finding}\n", if finding.warning { "warning" } else { "error" }));
    }
    match found.iter().filter(|f| !f.warning).count() {
        0 => {
            print(&format!("{}: SCORE's rules hold, {} warnings\n", file.display(), found.len()));
            Ok(())
        }
        n => Err(refused(format!("SCORE would refuse this file, which has {n} errors")).into()),
    }
}
