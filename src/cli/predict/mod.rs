//! `satphot predict`: what the model expects, for a pass, a whole sky, or geometries stated number by number.

mod compliance;
mod constellation;
mod day;
pub(super) mod dome_args;
mod duty;
mod geometry;
mod light_sources;
mod month;
mod month_text;
mod pass;
mod sed;
mod sequence;
mod shards;
mod sky;
pub(super) mod table;
mod tally_table;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use cpu_time::ProcessTime;
use satphot::brightness::{Catalogue, catalogue_names};
use satphot::config::{self, Config};

use super::orbit_args::{bad, of_argument};

const EXAMPLES: &str = "\
Examples:
  satphot predict pass --start 2025-06-10T06:00:00 -o pass
  satphot predict sky --satellite iss --sun-alt-deg -45 --sun-az-deg 90 -o sky.svg
  satphot predict table observations.csv --elements active.tle --satellite starlink-v2 -o out.ecsv";

/// Predicts magnitudes and fluxes.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Predict {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Magnitudes along the passes of a satellite over a site
    Pass(pass::Pass),
    /// Magnitude of one type of satellite over the whole sky
    Sky(sky::Sky),
    /// Median magnitude of one type of satellite over the sky through 24 hours
    Day(day::Day),
    /// Surface brightness of satellites around local midnight for every night of a month, against limits
    Month(month::Month),
    /// Share of the time in which a satellite can be observed
    Duty(duty::Duty),
    /// How many satellites of a constellation are up, lit and bright, moment by moment
    Constellation(constellation::Constellation),
    /// Share of sky and time in which a satellite is brighter than the limits of rules, eye and surveys
    Compliance(Box<compliance::Compliance>),
    /// Magnitudes for every row of a table of observations or geometries
    Table(table::Table),
    /// Fluxes of explicit geometries, for cross-checks with other software
    Geometry(geometry::Geometry),
    /// Spectra of moonlight at phases of the Moon, and what a band collects of them
    Sed(sed::Sed),
}

impl Predict {
    pub fn execute(self) -> anyhow::Result<()> {
        match self.what {
            What::Pass(v) => v.execute(),
            What::Sky(v) => v.execute(),
            What::Day(v) => v.execute(),
            What::Month(v) => v.execute(),
            What::Duty(v) => v.execute(),
            What::Constellation(v) => v.execute(),
            What::Compliance(v) => v.execute(),
            What::Table(v) => v.execute(),
            What::Geometry(v) => v.execute(),
            What::Sed(v) => v.execute(),
        }
    }
}

/// Which satellite, and how the model is evaluated.
#[derive(Debug, Clone, Args)]
pub(super) struct ModelArgs {
    /// Satellite of the catalogue (`satphot satellites` lists them) instead of the configuration's
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// Own satellites, in the form of `satphot satellites NAME --toml` (model.satellites)
    #[arg(long, value_name = "FILE")]
    satellites: Option<PathBuf>,
    /// Reading of the published model: corrected or as_published
    #[arg(long, value_name = "MODE", value_parser = ["corrected", "as_published"])]
    mode: Option<String>,
    /// Relative tolerance of the Earth-reflected integrals
    #[arg(long, value_name = "T", value_parser = tolerance)]
    tolerance: Option<f64>,
}

impl ModelArgs {
    /// --satellite, where that is left to the configuration.
    pub(super) fn missing(&self) -> Option<&'static str> {
        self.satellite.is_none().then_some("--satellite")
    }

    /// The model of the configuration with these arguments on top; without a configuration that of the arguments and of
    /// `--set model.…`.
    pub(super) fn over(&self, config: Option<&Config>, sets: &[String]) -> anyhow::Result<config::Model> {
        let mut model = match (config.and_then(|c| c.model.clone()), &self.satellite) {
            (Some(model), _) => model,
            (None, Some(name)) => alone(name, if config.is_none() { sets } else { &[] })?,
            (None, None) => {
                let known = catalogue_names().join(", ");
                return Err(bad("--satellite", format!("no [model] in a configuration; name one of {known}")));
            }
        };
        if let Some(name) = self.satellite.as_ref().filter(|name| **name != model.satellite) {
            model.satellite.clone_from(name);
            model.surfaces.clear(); // those were the other satellite's
        }
        match self.mode.as_deref() {
            Some("as_published") => model.mode = config::Mode::AsPublished,
            Some(_) => model.mode = config::Mode::Corrected,
            None => {}
        }
        model.satellites = self.satellites.clone().or(model.satellites);
        if let Some(name) = &self.satellite {
            Catalogue::load(model.satellites.as_deref())?.find(name).map_err(|e| of_argument("--satellite", e))?;
        }
        model.tolerance = self.tolerance.unwrap_or(model.tolerance);
        Ok(model)
    }
}

/// A model without a configuration: everything at its default but what `--set model.…` changes.
fn alone(satellite: &str, sets: &[String]) -> anyhow::Result<config::Model> {
    const NIGHT: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"none\"\ninput = [\".\"]\noutput = \".\"\n";
    if let Some(other) = sets.iter().find(|s| !s.trim_start().starts_with("model.")) {
        let problem = format!("\"{other}\" has no effect without a configuration; only model.… has");
        return Err(bad("--set", problem));
    }
    let config = Config::from_text(&format!("{NIGHT}[model]\nsatellite = {satellite:?}\n"), sets)?;
    Ok(config.model.unwrap_or_else(|| config::Model::of(satellite)))
}

/// Where results go: a folder for everything, or single files distinguished by their ending.
#[derive(Debug, Clone, Args)]
pub struct OutArgs {
    /// Folder for table and figure, or a file: .ecsv is the table, .svg the figure (repeatable)
    #[arg(short, long, value_name = "DIR|FILE")]
    pub(super) out: Vec<PathBuf>,
}

impl OutArgs {
    /// The tables and the figures to write; folders are made.
    pub fn files(&self, stem: &str) -> anyhow::Result<(Vec<PathBuf>, Vec<PathBuf>)> {
        self.files_of(stem, &["svg"])
    }

    /// As [`OutArgs::files`], with the endings a figure may have.
    pub fn files_of(&self, stem: &str, endings: &[&str]) -> anyhow::Result<(Vec<PathBuf>, Vec<PathBuf>)> {
        let (mut tables, mut figures) = (Vec::new(), Vec::new());
        let made = |folder: &Path| satphot::base::file::make_folder(folder);
        for out in &self.out {
            let folder = out.parent().filter(|p| !p.as_os_str().is_empty());
            match out.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
                Some("ecsv") => tables.push(out.clone()),
                Some(ending) if endings.contains(&ending) => figures.push(out.clone()),
                Some(
                    "csv" | "txt" | "dat" | "svg" | "png" | "pdf" | "fits" | "gif" | "jpg" | "jpeg" | "tif" | "tiff"
                    | "eps" | "json" | "html" | "xml" | "md" | "xlsx" | "parquet",
                ) => {
                    let known: Vec<String> = endings.iter().map(|e| format!(".{e}")).collect();
                    let problem =
                        format!("{} is neither .ecsv nor {}; --csv prints CSV", out.display(), known.join(" nor "));
                    return Err(bad("--out", problem));
                }
                _ => {
                    made(out)?;
                    tables.push(out.join(format!("{stem}.ecsv")));
                    figures.push(out.join(format!("{stem}.svg")));
                    continue;
                }
            }
            folder.map_or(Ok(()), made)?;
        }
        Ok((tables, figures))
    }
}

/// CPU time of this process, for `--explain`.
struct Clock(ProcessTime);

impl Clock {
    fn start() -> Self {
        Self(ProcessTime::now())
    }

    /// Since the start \[s\].
    fn cpu_s(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// A relative tolerance on the command line.
pub(super) fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(t) if t > 0.0 && t <= 0.5 => Ok(t),
        _ => Err("not a number above 0, at most 0.5, e.g. 1e-4".into()),
    }
}

/// What must be said when the magnitudes are not V: columns and labels keep their names.
pub(super) fn band_note(model: &config::Model) -> Option<String> {
    let named = config::Model::BANDS.contains(&model.band.as_str()) && model.throughput.is_none();
    match (model.band.as_str(), named) {
        ("V", true) => None,
        (band, true) => Some(format!("band {band}, AB")),
        (band, false) => Some(format!("band of {band} and throughput, AB")),
    }
}
