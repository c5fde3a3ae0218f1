//! `satphot predict table`: a table of observations or geometries in, the same table with the model's columns out.

use std::path::{Path, PathBuf};

use clap::Args;
use satphot::Error;
use satphot::base::threads::with_threads;
use satphot::brightness::{ModelSettings, Satellite};
use satphot::orbit::Site;
use satphot::tables::csv_of_cells;
use satphot::tables::save::{check_ending, write};
use satphot::tables::words::Status;
use satphot::visibility::forecast::prediction_meta;
use satphot::visibility::observation_table::{ObservationTable, Request, observation_table};

use super::super::orbit_args::{OrbitArgs, bad};
use super::super::zeropoint::column;
use super::super::{bar::Bars, print, signals, tell, threads};
use super::{ModelArgs, band_note};

const AFTER_HELP: &str = "\
A row is a time, a satellite and a site:
  time                     UTC as ISO 8601, MJD or JD; a start of exposure with exptime_s
  norad_cat_id             or object_name; else the one object of --elements. Or tle_line1, tle_line2
  site_lat_deg, site_lon_deg, site_alt_m      or --site
or a geometry on concentric spheres, as in `predict sky`, if no elements are given:
  sun_alt_deg, sun_az_deg, alt_deg, az_deg, height_km (or range_km); moon_alt_deg, moon_az_deg
Columns are known by these names and by those of SCORE, SatChecker, MMT-9, Pomenis and AAVSO-like
tables; --column KEY=NAME names others, or gives one number for all rows. Units in the header
(TUNIT, ECSV, VOTable, `alt [rad]`) are converted. A FITS file with several tables is read as
FILE[EXT].

Every row and column of the table is kept, in its order. A row that cannot be computed has
status failed and its reason; exit code 3 then. Without -o the table is printed as CSV.

Examples:
  satphot predict table observations.csv --elements active.tle --satellite starlink-v2 \\
      --site -33.77,151.11,70 -o predicted.fits
  satphot predict table geometry.fits --satellite starlink-v1.5 --column height_km=550";

/// Adds the model's magnitudes to a table of observations or of geometries.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Table {
    /// CSV, TSV, ECSV, VOTable, FITS or columns of text
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    #[command(flatten)]
    orbit: OrbitArgs,
    #[command(flatten)]
    model: ModelArgs,
    /// What a column is, e.g. --column height_km=h or --column height_km=550 (repeatable)
    #[arg(long = "column", value_name = "KEY=NAME", value_parser = column)]
    columns: Vec<(String, String)>,
    /// Azimuth in which the satellites of a geometry move [deg]
    #[arg(long, value_name = "DEG", default_value_t = 90.0, allow_hyphen_values = true)]
    track_az_deg: f64,
    /// Table to write: .ecsv, .csv, .fits, .vot or .parquet (repeatable)
    #[arg(short, long, value_name = "FILE")]
    out: Vec<PathBuf>,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Table {
    pub fn execute(self) -> anyhow::Result<()> {
        self.out.iter().try_for_each(|out| check_ending(out))?;
        self.out.iter().try_for_each(|out| not_over(&self.table, out))?;
        let config = self.orbit.configuration(self.model.missing().into_iter().collect())?;
        let model = self.model.over(config.as_ref(), &self.orbit.sets)?;
        let satellite = Satellite::from_config(&model)?;
        let settings = ModelSettings::try_from(&model)?;
        let orbit = self.orbit.orbit(config.as_ref())?;
        let given = self.orbit.place.given()?;
        let site = given.clone().or_else(|| config.as_ref().map(|c| c.site.clone()));
        let bar = Bars::new(!self.quiet);
        let request = Request {
            table: &self.table,
            columns: self.columns.iter().cloned().collect(),
            orbit: orbit.as_ref(),
            site: site.as_ref().map(Site::from_config).transpose()?,
            site_replaces: given.is_some(),
            satellite: &satellite,
            settings: &settings,
            track_az_rad: self.track_az_deg.to_radians(),
            magnitudes: None,
            stop: &signals::stop(),
        };
        let made = with_threads(self.jobs, || observation_table(&request, &bar))??;
        let mut meta = prediction_meta("satphot.predicted/1", &model, None);
        meta.push("table", self.table.display().to_string());
        if let Some(orbit) = &orbit {
            meta.push("orbit_source", orbit.elements.display().to_string());
        }
        let table = made.table(meta)?;
        if self.out.is_empty() {
            print(&csv_of_cells(&table.columns, &table.records)?);
        }
        self.out.iter().try_for_each(|out| write(out, &table))?;
        if let Some(band) = band_note(&model).filter(|_| !self.quiet) {
            tell(&format!("note: magnitudes are of {band}, also where a name or label says V"));
        }
        if !self.out.is_empty() {
            print(&columns_text(&self.table, &made));
            print(&satellite.standing_line());
        }
        finish(&made, &self.out, self.quiet)
    }
}

/// Refuses to write over the table that is read.
pub fn not_over(table: &Path, out: &Path) -> anyhow::Result<()> {
    match (table.canonicalize(), out.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => {
            Err(bad("--out", format!("{} is the table itself; name another file", out.display())))
        }
        _ => Ok(()),
    }
}

/// What was read, in two lines.
pub fn columns_text(path: &Path, made: &ObservationTable) -> String {
    let taken: Vec<String> = made.taken.iter().map(|(key, name)| format!("{key}: {name}")).collect();
    let failed = made.count(Status::Failed);
    format!(
        "Table      {}: {} rows, {failed} failed\nColumns    {}\n",
        path.display(),
        made.rows.len(),
        taken.join(", ")
    )
}

/// Notes and files on standard error; rows that could not be computed are exit code 3.
pub fn finish(made: &ObservationTable, out: &[PathBuf], quiet: bool) -> anyhow::Result<()> {
    for note in made.notes.iter().filter(|_| !quiet) {
        tell(&format!("note: {note}"));
    }
    for file in out.iter().filter(|_| !quiet) {
        tell(&format!("wrote {}", file.display()));
    }
    let failed = made.count(Status::Failed);
    if failed == 0 {
        return Ok(());
    }
    let first = made.rows.iter().find(|r| r.status == Status::Failed).map_or("", |r| r.reason.as_str());
    let problem = format!(
        "{failed} of {} rows could not be computed; the column reason says why, the first: {first}",
        made.rows.len()
    );
    Err(Error::PoorNight { problem }.into())
}
