//! Tables of observations of others: what the model expects for every row, and how the magnitudes differ from it.
//!
//! A row is a time, a satellite and a site, or a geometry: altitude and azimuth of Sun and satellite, and its height. Every row
//! of the table stays, in its order and with its cells; one that cannot be computed has a reason. km, degrees, magnitudes
//! outside the atmosphere. The table is held in memory. It does not cover photometry tables of satphot's own nights, which hold
//! frames ([`crate::pipeline`]).

mod checks;
mod columns;
mod magnitudes;
mod satellites;
mod statistics;
mod time;

use std::collections::BTreeMap;
use std::path::Path;

use hifitime::Epoch;
use rayon::prelude::*;

use super::forecast::predicted;
use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::stop::Stop;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::columns::fill_model;
use crate::brightness::scene::Scene;
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::sky::{Body, Sky, parallel_light};
use crate::brightness::{Attitude, Model, ModelSettings, Satellite};
use crate::config;
use crate::orbit::propagate::DECAYED_BELOW_KM;
use crate::orbit::{Site, Tracker};
use crate::tables::formats::Table as OutTable;
use crate::tables::joined::appended;
use crate::tables::read::{Row, Table};
use crate::tables::words::{Status, Verdict};
use crate::tables::{COMPARED, Column, Meta, PREDICTED, PhotometryRow};

use columns::Columns;
use satellites::Satellites;
pub use statistics::{ResidualStatistics, by_satellite};

/// Rows computed before a request to stop is looked at.
const CHUNK: usize = 512;
/// Highest orbit \[km\].
const HIGHEST_KM: f64 = 200_000.0;

/// What is asked of a table of observations.
#[derive(Debug)]
pub struct Request<'a> {
    /// The table: CSV, ECSV, VOTable, FITS or what else [`Table`] reads.
    pub table: &'a Path,
    /// Names of columns, or numbers for all rows, by key: `alt_deg`, `height_km`, `v_mag`, ...
    pub columns: BTreeMap<String, String>,
    /// Elements of the satellites; rows may have their own.
    pub orbit: Option<&'a config::Orbit>,
    /// The site of rows that state none.
    pub site: Option<Site>,
    /// Whether that site is used whatever the rows state.
    pub site_replaces: bool,
    /// The type of satellite they all are.
    pub satellite: &'a Satellite,
    /// How the model is evaluated.
    pub settings: &'a ModelSettings,
    /// Azimuth in which satellites of a geometry move \[rad\].
    pub track_az_rad: f64,
    /// Compare magnitudes; `None` predicts alone.
    pub magnitudes: Option<Magnitudes>,
    /// A request to stop.
    pub stop: &'a Stop,
}

/// How the magnitudes of a table are meant.
#[derive(Debug, Clone, Copy)]
pub struct Magnitudes {
    /// The band of the model, which they must be of.
    pub band: Band,
    /// They are reduced to this range, which is undone: m = m_reduced + 5 lg(range / this) \[km\].
    pub reduced_to_km: Option<f64>,
}

/// How the rows of a table say where everything is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Places {
    /// Time, satellite, site.
    Orbit,
    /// Altitude and azimuth of Sun and satellite, and its height.
    Geometry,
}

/// A table of observations with what the model expects.
#[derive(Debug)]
pub struct ObservationTable {
    input: Vec<crate::tables::read::Column>,
    records: Vec<csv::StringRecord>,
    /// One row per row of the table, in its order: geometry, magnitudes, status, reason.
    pub rows: Vec<PhotometryRow>,
    /// How its rows state the places.
    pub places: Places,
    /// Quantity and column, for the reader.
    pub taken: Vec<(&'static str, String)>,
    /// Notes for the observer.
    pub notes: Vec<String>,
    compared: bool,
    name: String,
}

/// Computes every row of a table of observations.
///
/// `residual_mag` = observed − modelled where magnitudes are compared. The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::Table`] for a column that is missing, of another unit, or of which two can be meant; [`Error::Interrupted`] once a
/// stop is requested. A row that cannot be computed is no error: its status is `failed` and its reason says why.
pub fn observation_table(request: &Request, progress: &dyn Progress) -> Result<ObservationTable> {
    let band = request.magnitudes.map_or("V", |m| m.band.name());
    let usable = |table: &Table| {
        let columns = Columns::find(table, &request.columns, band);
        columns.is_ok_and(|c| request.places(&c, table).is_ok() && (request.magnitudes.is_none() || c.v_mag.is_some()))
    };
    let mut table = Table::open_where(request.table, &usable)?;
    let columns = Columns::find(&table, &request.columns, band)?;
    let places = request.places(&columns, &table)?;
    magnitudes::check_columns(request, &columns, &table)?;
    let mut notes = table.notes.clone();
    if places == Places::Geometry && request.orbit.is_some() {
        notes.push("the table has no times: its rows are geometries, and the elements are not used".into());
    }

    let mut read: Vec<(Row, std::result::Result<(), String>)> = Vec::new();
    let mut row = Row::default();
    while table.read(&mut row)? {
        read.push((row.clone(), table.check(&row)));
    }
    if read.is_empty() {
        return Err(wrong(&table, format!("has the columns {} and no rows", table.names())));
    }
    checks::no_radians(&table, &columns, &read, &mut notes)?;
    let mut satellites = Satellites::new(request.orbit.filter(|_| places == Places::Orbit))?;
    let models = Models::new(request, places)?;
    let which: Vec<satellites::Which> = read
        .iter()
        .map(|(row, fit)| match (places, fit) {
            (Places::Orbit, Ok(())) => satellites.of(row, &columns),
            _ => Err(String::new()),
        })
        .collect();
    let job = Job { request, table: &table, columns: &columns, satellites: &satellites, models: &models, places };
    progress.stage("rows", read.len());
    let mut rows: Vec<PhotometryRow> = Vec::with_capacity(read.len());
    for (chunk, which) in read.chunks(CHUNK).zip(which.chunks(CHUNK)) {
        request.stop.check(|| format!("stopped after {} of {} rows; nothing is written", rows.len(), read.len()))?;
        let made: Vec<PhotometryRow> = chunk
            .par_iter()
            .zip(which)
            .map(|((row, fit), which)| {
                let made = job.row(row, fit, which);
                progress.tick();
                made
            })
            .collect();
        rows.extend(made);
    }
    progress.done();
    notes.extend(satellites.notes.iter().cloned());
    notes.extend(checks::notes(&job, &read, &which, &rows));
    notes.extend(request.magnitudes.and_then(|_| magnitudes::unfiltered_note(&columns, &read)));
    Ok(ObservationTable {
        input: table.columns.clone(),
        records: read.into_iter().map(|(row, _)| row.cells().clone()).collect(),
        rows,
        places,
        taken: columns.taken,
        notes,
        compared: request.magnitudes.is_some(),
        name: request.table.file_name().unwrap_or_default().to_string_lossy().into_owned(),
    })
}

fn wrong(table: &Table, problem: String) -> Error {
    Error::Table { path: table.path.clone(), line: None, problem }
}

impl Request<'_> {
    /// How the rows say where everything is: by elements where there are any, else as a geometry.
    fn places(&self, columns: &Columns, table: &Table) -> Result<Places> {
        let has_elements = self.orbit.is_some() || columns.tle_lines.is_some();
        let has_site = self.site.is_some() || columns.site.is_some();
        if columns.time.is_some() && has_elements && has_site {
            return Ok(Places::Orbit);
        }
        let height = columns.height_km.or(columns.range_km);
        // elements of the configuration are no reason to refuse a table without times
        let orbit_is_meant = has_elements && columns.time.is_some();
        if columns.sun_alt_az_deg.is_some() && columns.alt_az_deg.is_some() && height.is_some() && !orbit_is_meant {
            return Ok(Places::Geometry);
        }
        let mut by_orbit = Vec::new();
        for (there, what) in [
            (columns.time.is_some(), "a column of times (argument `column time=NAME`)"),
            (has_elements, "elements (argument `elements`, or columns tle_line1 and tle_line2)"),
            (has_site, "a site (argument `site`, or columns site_lat_deg, site_lon_deg, site_alt_m)"),
        ] {
            by_orbit.extend((!there).then_some(what));
        }
        let mut by_geometry = Vec::new();
        for (there, what) in [
            (columns.sun_alt_az_deg.is_some(), "sun_alt_deg and sun_az_deg"),
            (columns.alt_az_deg.is_some(), "alt_deg and az_deg of the satellite"),
            (height.is_some(), "height_km or range_km"),
        ] {
            by_geometry.extend((!there).then_some(what));
        }
        let of_geometry = if has_elements {
            String::new()
        } else {
            format!(", or as a geometry for want of {}", by_geometry.join(", "))
        };
        Err(wrong(
            table,
            format!(
                "cannot be computed for want of {}{of_geometry}; present: {}; argument `column KEY=NAME` names a column",
                by_orbit.join(", "),
                table.names()
            ),
        ))
    }
}

/// The models of the rows: by elements, and of a geometry with and without a Moon.
struct Models {
    by_orbit: Model,
    geometry: Option<[Model; 2]>,
}

impl Models {
    fn new(request: &Request, places: Places) -> Result<Self> {
        let by_orbit = Model::new(request.satellite, request.settings)?;
        if places == Places::Geometry {
            let fixed = request.satellite.surfaces.iter().find(|s| matches!(s.attitude, Attitude::Inertial { .. }));
            if let Some(surface) = fixed {
                let problem = format!("{} is fixed among the stars: give times, elements and a site", surface.name);
                return Err(Error::Argument { name: "satellite".into(), problem });
            }
            let model = |moon: bool| {
                let settings = ModelSettings {
                    earth_radius_km: Some(PUBLISHED_EARTH_RADIUS_KM),
                    moon: moon && request.settings.moon,
                    ..request.settings.clone()
                };
                Model::new(request.satellite, &settings)
            };
            return Ok(Self { by_orbit, geometry: Some([model(false)?, model(true)?]) });
        }
        Ok(Self { by_orbit, geometry: None })
    }
}

/// What every row needs.
struct Job<'a> {
    request: &'a Request<'a>,
    table: &'a Table,
    columns: &'a Columns,
    satellites: &'a Satellites,
    models: &'a Models,
    places: Places,
}

impl Job<'_> {
    fn row(&self, row: &Row, fit: &std::result::Result<(), String>, which: &satellites::Which) -> PhotometryRow {
        let mut reasons = Vec::new();
        let computed = fit.clone().and_then(|()| match self.places {
            Places::Orbit => self.by_orbit(row, which, &mut reasons),
            Places::Geometry => self.by_geometry(row),
        });
        let mut made = match computed {
            Ok(made) => PhotometryRow { status: Status::Ok.into(), verdict: Verdict::Use.into(), ..made },
            Err(reason) => PhotometryRow {
                status: Status::Failed.into(),
                verdict: Verdict::Reject.into(),
                reason,
                ..PhotometryRow::default()
            },
        };
        if made.status == Status::Ok {
            made.reason = reasons.join("; ");
            if self.request.magnitudes.is_some() && checks::is_contradicted(&made) {
                (made.status, made.verdict) = (Status::Rejected.into(), Verdict::Reject.into());
            }
        }
        magnitudes::compare(self.request, self.columns, row, &mut made);
        made
    }

    /// The site of a row.
    fn site(&self, row: &Row) -> std::result::Result<Site, String> {
        match (&self.columns.site, &self.request.site) {
            (Some(_), Some(site)) if self.request.site_replaces => Ok(site.clone()),
            (Some([lat, lon, height]), _) => {
                let [lat, lon, height] =
                    [lat.needed(row, self.table)?, lon.needed(row, self.table)?, height.needed(row, self.table)?];
                Site::new(lat, lon, height).map_err(|e| e.to_string())
            }
            (None, Some(site)) => Ok(site.clone()),
            (None, None) => Err("no site".into()),
        }
    }

    /// Time, tracker and site of a row.
    fn place(&self, row: &Row, which: &satellites::Which) -> std::result::Result<(Epoch, &Tracker, Site), String> {
        let time = self.columns.time.as_ref().ok_or("no column of times")?;
        let epoch = time.of(row)?;
        let tracker = self.satellites.get(which.clone()?).ok_or("no tracker")?;
        Ok((epoch, tracker, self.site(row)?))
    }

    fn by_orbit(
        &self,
        row: &Row,
        which: &satellites::Which,
        reasons: &mut Vec<String>,
    ) -> std::result::Result<PhotometryRow, String> {
        let (epoch, tracker, site) = self.place(row, which)?;
        let made = predicted(tracker, &site, &self.models.by_orbit, &epoch).map_err(|e| e.to_string())?;
        reasons.extend(checks::contradictions(self, row, tracker, &made));
        reasons.extend(tracker.age_warning(&epoch));
        Ok(made)
    }

    /// A row of altitudes and azimuths, as a map of the sky has its directions: observer and orbits on concentric spheres.
    fn by_geometry(&self, row: &Row) -> std::result::Result<PhotometryRow, String> {
        let pair = |key: &str, of: Option<[columns::Number; 2]>| {
            let [alt, az] = of.ok_or_else(|| format!("no column of {key}"))?;
            let (alt, az) = (alt.needed(row, self.table)?, az.needed(row, self.table)?);
            if !(-90.0..=90.0).contains(&alt) || !(-360.0..=360.0).contains(&az) {
                return Err(format!("{key}: altitude {alt}, azimuth {az} deg; accepted are -90 to 90 and -360 to 360"));
            }
            Ok((alt, az))
        };
        let (alt, az) = pair("the satellite", self.columns.alt_az_deg)?;
        let (sun_alt, sun_az) = pair("the Sun", self.columns.sun_alt_az_deg)?;
        if alt < 0.0 {
            return Err(format!("the satellite is below the horizon, at altitude {alt} deg"));
        }
        let radius_km = PUBLISHED_EARTH_RADIUS_KM;
        let height_km = match (self.columns.height_km, self.columns.range_km) {
            (Some(height), _) => height.needed(row, self.table)?,
            (None, Some(range)) => {
                // r² = R² + d² + 2 R d sin a
                let d = range.needed(row, self.table)?;
                (radius_km * radius_km + d * d + 2.0 * radius_km * d * alt.to_radians().sin()).sqrt() - radius_km
            }
            (None, None) => return Err("no height".into()),
        };
        if !(DECAYED_BELOW_KM..=HIGHEST_KM).contains(&height_km) {
            let metres = height_km / 1e3;
            let hint = if (DECAYED_BELOW_KM..=HIGHEST_KM).contains(&metres) { "; is it in m?" } else { "" };
            return Err(format!(
                "the height is {height_km} km; accepted is {DECAYED_BELOW_KM} to {HIGHEST_KM} km{hint}"
            ));
        }
        let far = |body: Body| if parallel_light(&self.request.settings.effects) { body.at_infinity() } else { body };
        let rad = |az_deg: f64| az_deg.to_radians().rem_euclid(std::f64::consts::TAU);
        let moon = match self.columns.moon_alt_az_deg {
            Some([alt, az]) if alt.of(row).is_some() || az.of(row).is_some() => {
                Some(pair("the Moon", Some([alt, az]))?)
            }
            _ => None,
        };
        let moon = moon.map(|(alt, az)| far(Body::moon(alt.to_radians(), rad(az))));
        let axes = [Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0), Vector::new(1.0, 0.0, 0.0)];
        let sun = far(Body::sun(sun_alt.to_radians(), rad(sun_az)));
        let words = |e: Error| e.to_string();
        let sky = Sky::new(axes, (radius_km, height_km), self.request.track_az_rad, sun, moon).map_err(words)?;
        let scene = sky.scene(alt.to_radians(), (az % 360.0).to_radians());
        let [moonless, moonlit] = self.models.geometry.as_ref().ok_or("no model of a geometry")?;
        let model = if moon.is_some() { moonlit } else { moonless };
        let answer = model.brightness(&scene).map_err(words)?;
        let mut made = PhotometryRow {
            range_km: Some(scene.range_km()),
            phase_angle_deg: Some(phase_angle_deg(&scene)),
            ..PhotometryRow::default()
        };
        fill_model(&mut made, &answer, true);
        made.mu_mean_mag_arcsec2 = answer.mu_mean_mag_arcsec2;
        Ok(made)
    }
}

/// Angle Sun-satellite-observer \[deg\].
fn phase_angle_deg(scene: &Scene) -> f64 {
    let from = |place: Vector<Itrs>| place - scene.satellite_km;
    from(scene.sun_km).angle_to(&from(scene.observer_km)).to_degrees()
}

impl ObservationTable {
    /// The table as it was, and behind its columns those of satphot: one that has a name of the table is called
    /// `NAME_satphot`.
    ///
    /// # Errors
    /// [`Error::Table`] where the table has that name, too.
    pub fn table(&self, meta: Meta) -> Result<OutTable> {
        let definition = if self.compared { COMPARED } else { PREDICTED };
        let of_orbit = |c: &&Column| {
            let only = [
                "mjd_mid_d",
                "norad_cat_id",
                "object_name",
                "alt_deg",
                "az_deg",
                "rate_deg_s",
                "airmass",
                "sun_alt_deg",
                "moon_alt_deg",
                "moon_phase_deg",
                "moon_illum_pct",
                "moon_sep_deg",
                "sky_class",
                "paper_label",
                "tle_age_d",
            ];
            self.places == Places::Orbit || !only.contains(&c.name)
        };
        let added: Vec<Column> = definition.columns.iter().filter(of_orbit).copied().collect();
        appended(definition.name(), &self.name, (&self.input, &self.records), (&added, &self.rows), meta)
    }

    /// Rows of a status.
    #[must_use]
    pub fn count(&self, status: Status) -> usize {
        self.rows.iter().filter(|r| r.status == status).count()
    }

    /// The residuals of all rows that are not rejected; `None` without any.
    #[must_use]
    pub fn residuals(&self) -> Option<ResidualStatistics> {
        ResidualStatistics::of(self.rows.iter())
    }
}
