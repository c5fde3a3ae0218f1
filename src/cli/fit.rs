//! `satphot fit`: a model of a satellite from a table of observed magnitudes.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use satphot::bands::Band;
use satphot::base::file::write_atomic;
use satphot::base::progress::Silent;
use satphot::base::threads::with_threads;
use satphot::brightness::{Catalogue, Entry, ModelSettings, Satellite, Surface, catalogue_toml};
use satphot::config::{self, Config};
use satphot::fitting::{
    Free, Observations, Problem, by_orbit, fit_surfaces, fitted_phase_law, fitted_surfaces, in_light, phase_law,
    stated, surface_flux,
};
use satphot::orbit::Site;
use satphot::report::summary::text_table;
use satphot::visibility::observation_table::{Magnitudes, Request, states_range_and_phase};

use super::compare::orbit_of;
use super::orbit_args::{SiteArg, bad};
use super::predict::ModelArgs;
use super::zeropoint::column;
use super::{Common, print, signals, tell};

const AFTER_HELP: &str = "\
Without --satellite, a law of the phase angle phi (Sun, satellite, observer) is fitted,
  V = c0 + c1 phi + ... + d1 h + ... + 5 lg(range / 1000 km),
to all rows in full sunlight; h, with --sun-degree, is the altitude of the Sun at the satellite,
which tells how its underside is lit. With --satellite its surfaces are: V = -2.5 lg of the sum of
a_s F_s, F_s the light of each surface of the model, a_s its strength. --free names what is fitted,
separated by commas; what it does not name is held:
  chassis                the strength of a surface; without --free that of each
  chassis.ks             a number of its law, as `satphot satellites NAME --toml` spells it
  chassis.pitch_deg      a surface that faces the Earth, turned forward
  array.sun_offset_deg   a surface that faces the Sun, turned away from nadir
  chassis+array          tied: one strength (or one number) for both

The tables are such as `satphot compare` takes: time, satellite, site and apparent magnitude (SCORE,
MMT-9, own), and elements or directions and ranges. For a law of the phase angle, columns range_km
and phase_angle_deg are enough. All tables but the first have an offset of their own: instruments
differ in band and zeropoint; the entry is in the magnitudes of the first. A row without magnitude and with limit_v_mag counts as a limit.

Rows of a pass are not independent: each pass has an offset of its own, whose scatter is fitted as
well as that within passes (a Student t, so that flares weigh little). What the data do not tell is
refused by name. The result is an entry for a file of satellites, with covariance, data and the
phase angles it holds for: give the file to --satellites, and its name to --satellite.

Examples:
  satphot fit score.csv --degree 2 --sun-degree 2 --name v2-mini -o own.toml
  satphot fit score.csv slingshot.csv --degree 3 --sun-degree 2 --name v2-mini -o own.toml
  satphot fit photometry.csv --elements starlink.tle --satellite starlink-v2 --free chassis -o own.toml
  satphot compare other.csv --elements starlink.tle --satellites own.toml --satellite v2-mini";

/// Fits a model of a satellite to tables of observed magnitudes.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Fit {
    /// Any tables with time, satellite and magnitude, or with range, phase angle and magnitude
    #[arg(value_name = "TABLE", required = true)]
    tables: Vec<PathBuf>,
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
    /// What a column of the table is, e.g. --column v_mag=Mag (repeatable)
    #[arg(long = "column", value_name = "KEY=NAME", value_parser = column)]
    columns: Vec<(String, String)>,
    /// The magnitudes are reduced to this range; undone with the range of each row [km]
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    reduced_to_km: Option<f64>,
    /// Degree of the polynomial of the phase angle
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=5))]
    degree: u8,
    /// Degree of the polynomial of the altitude of the Sun at the satellite; 0 leaves it out
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=4))]
    sun_degree: u8,
    /// What is fitted of the surfaces, e.g. chassis,array.sun_offset_deg [default: all strengths]
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    free: Vec<String>,
    /// Name of the new satellite: lower case, hyphens for blanks
    #[arg(long, value_name = "NAME", default_value = "fitted")]
    name: String,
    /// File of satellites to write; without it the entry is printed
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Fit {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.reduced_to_km.is_some_and(|km| !(1.0..=1e6).contains(&km)) {
            return Err(bad("--reduced-to-km", "is outside 1 to 1000000 km".into()));
        }
        let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-.".contains(c);
        if self.name.is_empty() || !self.name.chars().all(is_name) {
            return Err(bad(
                "--name",
                format!("\"{}\" is not a name: use lower case, and hyphens for blanks", self.name),
            ));
        }
        let has_config = self.common.config.exists() || self.common.config != Path::new("pipeline.toml");
        let config = if has_config { Some(self.common.load()?) } else { None };
        let surfaces = match self.model.missing() {
            Some(_) if !self.free.is_empty() => {
                return Err(bad("--free", "names surfaces of --satellite, which is not given".into()));
            }
            Some(_) => None,
            None => Some(self.model.over(config.as_ref(), &self.common.sets)?),
        };
        // a law needs no model; the settings are those of the lights of a unit satellite
        let model = surfaces.clone().unwrap_or_else(|| config::Model::of("iss"));
        let settings = ModelSettings::try_from(&model)?;
        let satellite = Satellite::from_config(&model)?;
        let orbit = orbit_of((self.elements.as_deref(), self.norad), &self.common, config.as_ref())?;
        let given = self.place.given()?;
        let site = given.clone().or_else(|| config.as_ref().map(|c: &Config| c.site.clone()));
        let site = site.as_ref().map(Site::from_config).transpose()?;
        let stop = signals::stop();
        let request = |table| Request {
            table,
            columns: self.columns.iter().cloned().collect(),
            orbit: orbit.as_ref(),
            site: site.clone(),
            site_replaces: given.is_some(),
            satellite: &satellite,
            settings: &settings,
            track_az_rad: std::f64::consts::FRAC_PI_2,
            magnitudes: Some(Magnitudes { band: Band::V, reduced_to_km: self.reduced_to_km }),
            stop: &stop,
        };
        let requests: Vec<Request> = self.tables.iter().map(|table| request(table)).collect();
        let (entry, observations, problem) = match &surfaces {
            None => self.phase_law(&requests)?,
            Some(model) => self.surfaces(model, &requests)?,
        };
        let text = catalogue_toml(std::slice::from_ref(&entry))?;
        match &self.out {
            Some(out) => write_atomic(out, text.as_bytes())?,
            None => print(&text),
        }
        for note in observations.notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        if let Some(out) = &self.out {
            print(&summary(&problem, &entry));
            if !self.common.quiet {
                tell(&format!(
                    "wrote {}; use it with --satellites {} --satellite {}",
                    out.display(),
                    out.display(),
                    self.name
                ));
            }
        }
        Ok(())
    }

    /// A polynomial of the phase angle.
    fn phase_law(&self, requests: &[Request]) -> anyhow::Result<(Entry, Observations, Problem)> {
        let progress = self.common.progress();
        let mut observations = Observations::default();
        for request in requests {
            let without_elements = request.orbit.is_none() && states_range_and_phase(request)?;
            let read = || if without_elements { stated(request) } else { by_orbit(request, &progress) };
            observations.append(with_threads(self.common.jobs, read)??);
        }
        let degrees = [self.degree.into(), self.sun_degree.into()];
        let problem = phase_law(&observations.rows, degrees, &self.table_names())?;
        let entry = fitted_phase_law(&self.name, &problem, &observations.rows, &self.table_names().join(", "));
        Ok((entry, observations, problem))
    }

    /// The scales of surfaces.
    fn surfaces(&self, model: &config::Model, requests: &[Request]) -> anyhow::Result<(Entry, Observations, Problem)> {
        if self.sun_degree > 0 {
            return Err(bad("--sun-degree", "is of a law of the phase angle, and --satellite has surfaces".into()));
        }
        let entry = match model.surfaces.is_empty() {
            true => Catalogue::load(model.satellites.as_deref())?.find(&model.satellite)?.clone(),
            false => Entry { surfaces: model.surfaces.clone(), ..Entry::named(&model.satellite) },
        };
        let names: Vec<String> = entry.surfaces.iter().map(|s| s.name.clone()).collect();
        if names.is_empty() {
            return Err(bad(
                "--satellite",
                format!("{} has no surfaces; leave it out to fit a law of the phase angle", entry.name),
            ));
        }
        let texts = if self.free.is_empty() { &names } else { &self.free };
        let free: Vec<Free> =
            texts.iter().map(|text| Free::parse(text, &entry.surfaces)).collect::<satphot::Result<_>>()?;
        let progress = self.common.progress();
        let mut observations = Observations::default();
        for request in requests {
            observations.append(with_threads(self.common.jobs, || in_light(request, &progress))??);
        }
        let rows = &observations.rows;
        let flux_of = |_: usize, surface: &config::Surface| {
            let surface = Surface::try_from(surface)?;
            let mut flux = Vec::with_capacity(rows.len());
            for (table, request) in requests.iter().enumerate() {
                let of_table = || rows.iter().filter(|o| o.table == table);
                let sent = || surface_flux(request, surface.clone(), of_table(), &Silent);
                flux.extend(with_threads(self.common.jobs, sent)??);
            }
            Ok(flux)
        };
        let tables = self.table_names();
        let problem = fit_surfaces(rows, &entry.surfaces, &free, &flux_of, &tables)?;
        let fitted = fitted_surfaces(&self.name, &entry, &free, &problem, rows, &tables.join(", "))?;
        Ok((fitted, observations, problem))
    }

    fn table_names(&self) -> Vec<String> {
        let name = |table: &PathBuf| table.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.tables.iter().map(name).collect()
    }
}

/// The fit in a few lines.
fn summary(problem: &Problem, entry: &Entry) -> String {
    let fit = &problem.fit;
    let limits = if fit.n_limits > 0 { format!(", of which {} limits", fit.n_limits) } else { String::new() };
    let mut text = format!("Fit        {}: {} magnitudes{limits}, {} passes\n", entry.name, fit.n, fit.n_passes);
    let rows: Vec<Vec<String>> = problem
        .names
        .iter()
        .zip(fit.theta.iter().zip(fit.errs()))
        .map(|(name, (value, err))| vec![name.clone(), format!("{value:.6}"), format!("{err:.2e}")])
        .collect();
    text += &text_table(&["parameter", "value", "error"], &rows);
    let _ = writeln!(
        text,
        "Scatter    {:.3} mag within passes (scale of a Student t), {:.3} mag between them; 68 % of new magnitudes within {:.3} mag",
        fit.within_mag,
        fit.between_mag,
        entry.scatter_mag.unwrap_or(f64::NAN)
    );
    if let Some(fitted) = &entry.fit {
        let [low, high] = fitted.phase_deg;
        let [near, far] = fitted.range_km;
        let sun_alt = entry.empirical.as_ref().map(|law| law.sun_alt_sat_deg()).filter(|range| *range != [-90.0, 90.0]);
        let sun_alt = sun_alt.map_or(String::new(), |[low, high]| {
            format!(", a Sun of {low:.1} to {high:.1} deg of altitude at the satellite")
        });
        let _ = writeln!(
            text,
            "Holds for  phase angles of {low:.1} to {high:.1} deg{sun_alt}, seen at {near:.0} to {far:.0} km"
        );
    }
    text
}
