//! `satphot compare`: a photometry table of a night, or any table of observations, against the model.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use satphot::base::threads::with_threads;
use satphot::brightness::{ModelSettings, Satellite};
use satphot::config::{self, Config};
use satphot::orbit::Site;
use satphot::pipeline::compare::band_of_observations;
use satphot::pipeline::single_stages::compare_table;
use satphot::report::summary::text_table;
use satphot::tables::read::Table;
use satphot::tables::save::{check_ending, write};
use satphot::tables::words::Status;
use satphot::tables::{Meta, MetaValue, PHOTOMETRY};
use satphot::visibility::forecast::prediction_meta;
use satphot::visibility::observation_table::{
    Magnitudes, ObservationTable, Request, ResidualStatistics, by_satellite, observation_table,
};

use super::orbit_args::{MAX_AGE_D, SiteArg, bad, elements_there};
use super::predict::table::{columns_text, finish, not_over};
use super::predict::{ModelArgs, band_note};
use super::zeropoint::column;
use super::{Common, print, signals, tell};

/// Satellites with a line of their own.
const MOST_LINES: usize = 40;

const AFTER_HELP: &str = "\
A photometry.ecsv of `run` or `measure` is compared frame by frame; -o gets the residuals.

Any other table (CSV, ECSV, VOTable, FITS) needs columns of time, satellite and apparent magnitude,
under the names of SCORE, SatChecker, MMT-9 or satphot, or named with --column KEY=NAME. The site is
that of the rows (SCORE), else --site, else the configuration's; a table of one satellite needs no
column of it. -o gets the table with satphot's columns behind its own. `satphot predict table --help`
lists the keys; v_mag, v_mag_err and filter are added here. Rows that cannot be compared have a
reason; exit code 3 if any could not be computed. Magnitudes that are reduced to a range are made
apparent with --reduced-to-km.

The error of the mean is that of the means of passes: the rows of a pass are not independent.

Examples:
  satphot compare satphot-out/2025-06-09/photometry.ecsv
  satphot compare photometry.ecsv --set model.mode=as_published -o residuals_as_published.ecsv
  satphot compare score.csv --elements starlink.tle --satellite starlink-v2 -o residuals.fits
  satphot compare mmt9.txt --elements 25544.tle --site 43.65,41.43,2030 --satellite iss";

/// Predicts the magnitude of every row of a table and writes the residuals, observed minus modelled.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Compare {
    /// photometry.ecsv of `run` or `measure`, or any table with time, satellite and magnitude
    #[arg(value_name = "TABLE")]
    photometry: PathBuf,
    #[command(flatten)]
    common: Common,
    /// Elements instead of those of the configuration: TLE, 3LE, or OMM in JSON, CSV, KVN or XML
    #[arg(long, visible_alias = "tle", value_name = "FILE")]
    elements: Option<PathBuf>,
    /// Catalogue number of the satellite, where the table names none
    #[arg(long, value_name = "NUMBER")]
    norad: Option<u64>,
    #[command(flatten)]
    place: SiteArg,
    #[command(flatten)]
    model: ModelArgs,
    /// What a column of a table of observations is, e.g. --column v_mag=Mag (repeatable)
    #[arg(long = "column", value_name = "KEY=NAME", value_parser = column)]
    columns: Vec<(String, String)>,
    /// The magnitudes are reduced to this range; undone with the range of each row [km]
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    reduced_to_km: Option<f64>,
    /// Table of residuals to write; of a table of observations .ecsv, .csv, .fits, .vot or .parquet
    #[arg(short, long, value_name = "FILE", default_value = "residuals.ecsv")]
    out: PathBuf,
    /// Also write the photometry table with its model columns filled
    #[arg(long, value_name = "FILE")]
    photometry_out: Option<PathBuf>,
}

impl Compare {
    pub fn execute(self) -> anyhow::Result<()> {
        let has_config = self.common.config.exists() || self.common.config != Path::new("pipeline.toml");
        let named = self.model.missing().is_none();
        let config = if has_config || !named { Some(self.common.load()?) } else { None };
        if is_photometry(&self.photometry) {
            return self.of_a_night(config);
        }
        self.of_observations(config.as_ref())
    }

    /// The photometry of a night, with what the arguments name instead of the configuration's.
    fn of_a_night(self, config: Option<Config>) -> anyhow::Result<()> {
        if let Some(option) = self.of_observations_alone() {
            return Err(bad(option, "is for tables of observations; this is the photometry of a night".into()));
        }
        let mut config = match config {
            Some(config) => config,
            None => self.common.load()?,
        };
        if self.elements.is_some() || self.norad.is_some() {
            config.orbit = orbit_of((self.elements.as_deref(), self.norad), &self.common, Some(&config))?;
        }
        if let Some(site) = self.place.given()? {
            config.site = site;
        }
        if config.model.is_some() || self.model.missing().is_none() {
            config.model = Some(self.model.over(Some(&config), &self.common.sets)?);
        }
        let compared = compare_table(&config, &self.photometry)?;
        compared.write(&config, &self.out, self.photometry_out.as_deref())?;
        for note in compared.notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        print(&compared.text());
        if let Some(model) = &config.model {
            print(&Satellite::from_config(model)?.standing_line());
        }
        print(&format!("{}\n", self.out.display()));
        Ok(())
    }

    /// An option that has no effect on the photometry of a night.
    fn of_observations_alone(&self) -> Option<&'static str> {
        match (self.columns.is_empty(), self.reduced_to_km) {
            (false, _) => Some("--column"),
            (true, Some(_)) => Some("--reduced-to-km"),
            (true, None) => None,
        }
    }

    fn of_observations(self, config: Option<&Config>) -> anyhow::Result<()> {
        check_ending(&self.out)?;
        if self.photometry_out.is_some() {
            return Err(bad(
                "--photometry-out",
                "is for the photometry of a night; -o has every column of the table".into(),
            ));
        }
        if self.reduced_to_km.is_some_and(|km| !(1.0..=1e6).contains(&km)) {
            return Err(bad("--reduced-to-km", "is outside 1 to 1000000 km".into()));
        }
        not_over(&self.photometry, &self.out)?;
        let model = self.model.over(config, &self.common.sets)?;
        let (band, note) = band_of_observations(&model)?;
        let satellite = Satellite::from_config(&model)?;
        let settings = ModelSettings::try_from(&model)?;
        let orbit = orbit_of((self.elements.as_deref(), self.norad), &self.common, config)?;
        let given = self.place.given()?;
        let site = given.clone().or_else(|| config.map(|c| c.site.clone()));
        let request = Request {
            table: &self.photometry,
            columns: self.columns.iter().cloned().collect(),
            orbit: orbit.as_ref(),
            site: site.as_ref().map(Site::from_config).transpose()?,
            site_replaces: given.is_some(),
            satellite: &satellite,
            settings: &settings,
            track_az_rad: std::f64::consts::FRAC_PI_2,
            magnitudes: Some(Magnitudes { band, reduced_to_km: self.reduced_to_km }),
            stop: &signals::stop(),
        };
        let progress = self.common.progress();
        let mut made = with_threads(self.common.jobs, || observation_table(&request, &progress))??;
        made.notes.extend(note);
        made.notes.extend(band_note(&model).map(|band| format!("magnitudes are of {band}, also where a name says V")));
        let statistics = made.residuals();
        let mut meta = prediction_meta("satphot.compared/1", &model, None);
        meta.push("table", self.photometry.display().to_string());
        if let Some(orbit) = &orbit {
            meta.push("orbit_source", orbit.elements.display().to_string());
        }
        push_statistics(&mut meta, statistics.as_ref());
        write(&self.out, &made.table(meta)?)?;
        print(&columns_text(&self.photometry, &made));
        print(&residuals_text(&made, statistics.as_ref(), band.name()));
        print(&satellite.standing_line());
        finish(&made, std::slice::from_ref(&self.out), self.common.quiet)
    }
}

/// Elements from the arguments, else from the configuration.
pub(super) fn orbit_of(
    (elements, norad): (Option<&Path>, Option<u64>),
    common: &Common,
    config: Option<&Config>,
) -> anyhow::Result<Option<config::Orbit>> {
    let own = config.and_then(|c| c.orbit.clone());
    let mut orbit = match (elements, own) {
        (Some(elements), own) => config::Orbit {
            elements: elements.to_owned(),
            norad_cat_id: None,
            max_age_d: own.as_ref().map_or(MAX_AGE_D, |o| o.max_age_d),
            force_age: own.as_ref().is_some_and(|o| o.force_age),
            ut1_utc_s: own.as_ref().and_then(|o| o.ut1_utc_s),
            xp_arcsec: own.as_ref().map_or(0.0, |o| o.xp_arcsec),
            yp_arcsec: own.as_ref().map_or(0.0, |o| o.yp_arcsec),
        },
        (None, Some(own)) => own,
        (None, None) => return Ok(None),
    };
    orbit.norad_cat_id = norad.or(orbit.norad_cat_id);
    orbit.force_age |= common.force_age;
    elements_there(&orbit.elements, orbit.norad_cat_id, config.filter(|_| elements.is_none()))?;
    Ok(Some(orbit))
}

/// Whether a file is a photometry table of satphot: an ECSV file with its columns.
fn is_photometry(path: &Path) -> bool {
    let is_ecsv = std::fs::File::open(path).is_ok_and(|mut file| {
        let mut start = [0; 7];
        std::io::Read::read_exact(&mut file, &mut start).is_ok() && start == *b"# %ECSV"
    });
    let has = |table: &Table, name: &str| table.columns.iter().any(|c| c.name == name);
    let frames = ["frame", "frame_sha256", "date_mid", "inst_mag", "v_mag"];
    is_ecsv
        && Table::open(path).is_ok_and(|t| {
            frames.iter().all(|name| has(&t, name) && PHOTOMETRY.columns.iter().any(|c| c.name == *name))
        })
}

fn push_statistics(meta: &mut Meta, statistics: Option<&ResidualStatistics>) {
    let Some(s) = statistics else { return };
    let numbers = [
        ("n", s.n as f64),
        ("n_passes", s.n_passes as f64),
        ("median_mag", s.median_mag),
        ("mean_mag", s.mean_mag),
        ("sigma_mag", s.sigma_mag),
        ("rms_mag", s.rms_mag),
        ("p16_mag", s.p16_mag),
        ("p84_mag", s.p84_mag),
    ];
    let mut pairs: Vec<(String, MetaValue)> = numbers.map(|(key, value)| (key.to_owned(), value.into())).to_vec();
    pairs.extend(s.mean_err_mag.map(|err| ("mean_err_mag".to_owned(), err.into())));
    meta.push("residuals", MetaValue::Map(pairs));
}

/// The residuals in numbers: of all rows, and of each satellite.
fn residuals_text(made: &ObservationTable, statistics: Option<&ResidualStatistics>, band: &str) -> String {
    let n = |status: Status| made.count(status);
    let counts = format!("{} without a magnitude, {} rejected", n(Status::Nondetection), n(Status::Rejected));
    let Some(s) = statistics else { return format!("Residuals  none: {counts}\n") };
    let mut text =
        format!("Residuals  {} of {} rows, {band} observed minus modelled; {counts}\n", s.n, made.rows.len());
    let err = s.mean_err_mag.map_or(String::new(), |err| format!(" +- {err:.3} (means of {} passes)", s.n_passes));
    let _ = writeln!(
        text,
        "           median {:+.3}, mean {:+.3}{err}, sigma (MAD) {:.3}, rms {:.3}, 16 to 84 %: {:+.3} to {:+.3} mag",
        s.median_mag, s.mean_mag, s.sigma_mag, s.rms_mag, s.p16_mag, s.p84_mag
    );
    let satellites = by_satellite(&made.rows);
    if satellites.len() > 1 {
        let line = |(name, s): &(String, ResidualStatistics)| {
            let mags = [s.median_mag, s.sigma_mag, s.rms_mag].map(|m| format!("{m:.3}"));
            [vec![name.clone(), s.n.to_string(), s.n_passes.to_string()], mags.to_vec()].concat()
        };
        let lines: Vec<Vec<String>> = satellites.iter().take(MOST_LINES).map(line).collect();
        text += &text_table(&["satellite", "n", "passes", "median", "sigma", "rms"], &lines);
        if satellites.len() > MOST_LINES {
            let _ = writeln!(text, "and {} more satellites", satellites.len() - MOST_LINES);
        }
    }
    text
}
