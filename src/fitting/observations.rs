//! The magnitudes of a table as a fit needs them: reduced to 1000 km and the Sun at 1 au, with their passes.
//!
//! Magnitudes, km, degrees. It does not cover what the rows of a table mean ([`crate::visibility::observation_table`]).

use std::path::Path;

use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::brightness::{Illum, Satellite, Surface};
use crate::config::Empirical;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::{mjd, same_pass, target};
use crate::tables::words::Status;
use crate::visibility::observation_table::{Request, observation_table, stated_rows};

/// A satellite of magnitude 0 at 1000 km whatever the phase angle: what is observed less its magnitude is reduced.
fn unit_law() -> Satellite {
    let law = Empirical::polynomial(vec![0.0], [0.0, 180.0]);
    Satellite { empirical: Some(law), ..Satellite::of("unit", Vec::new()) }
}

/// One magnitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Number of its row in the table, from 0.
    pub row: usize,
    /// V at 1000 km and the Sun at 1 au, or the limit that it is fainter than.
    pub mag_1000km: f64,
    /// As observed.
    pub v_mag: f64,
    /// Its error; 0 where the table has none \[mag\].
    pub err_mag: f64,
    /// Whether it is a limit.
    pub is_limit: bool,
    /// Phase angle \[deg\].
    pub phase_deg: f64,
    /// Altitude of the Sun at the satellite \[deg\]; `None` where the table does not tell.
    pub sun_alt_sat_deg: Option<f64>,
    /// Range \[km\].
    pub range_km: f64,
    /// Middle of the exposure.
    pub mjd_d: Option<f64>,
    /// Number of its pass, from 0 without gaps.
    pub pass: usize,
    /// Number of its satellite, from 0 without gaps.
    pub satellite: usize,
    /// Number of its table.
    pub table: usize,
}

/// The magnitudes of a table.
#[derive(Debug, Clone, Default)]
pub struct Observations {
    /// Them.
    pub rows: Vec<Observation>,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

impl Observations {
    /// Those of one more table: its passes are others.
    pub fn append(&mut self, more: Observations) {
        let next = |of: &dyn Fn(&Observation) -> usize| self.rows.iter().map(|o| of(o) + 1).max().unwrap_or(0);
        let [pass, satellite, table] = [next(&|o| o.pass), next(&|o| o.satellite), next(&|o| o.table)];
        self.rows.extend(more.rows.into_iter().map(|o| Observation {
            pass: o.pass + pass,
            satellite: o.satellite + satellite,
            table: o.table + table,
            ..o
        }));
        self.notes.extend(more.notes);
    }
}

/// Of a table of times, satellites and sites, by elements: only rows in full sunlight.
///
/// # Errors
/// Those of [`observation_table`].
pub fn by_orbit(request: &Request, progress: &dyn Progress) -> Result<Observations> {
    let unit = unit_law();
    let made = observation_table(&Request { satellite: &unit, ..copied(request) }, progress)?;
    let reduced = |row: &PhotometryRow, v_mag: f64| Some(v_mag - row.model_v_mag?);
    let sunlit = |row: &PhotometryRow| row.illum == Illum::Sun.as_str();
    let shaded = made.rows.iter().filter(|r| r.status == Status::Ok && !sunlit(r)).count();
    let mut found = collected(request.table, &made.rows, &|row, v_mag| reduced(row, v_mag).filter(|_| sunlit(row)))?;
    found.notes.splice(0..0, made.notes);
    if shaded > 0 {
        found.notes.push(format!("{shaded} rows are not in full sunlight: not used"));
    }
    Ok(found)
}

/// The same of all rows in which the satellite has any light.
///
/// # Errors
/// Those of [`observation_table`].
pub fn in_light(request: &Request, progress: &dyn Progress) -> Result<Observations> {
    let whole = observation_table(&copied(request), progress)?;
    let in_light = |row: &PhotometryRow, v_mag: f64| row.model_v_mag.map(|_| v_mag - 5.0 * lg_range(row));
    let mut found = collected(request.table, &whole.rows, &in_light)?;
    found.notes.splice(0..0, whole.notes);
    Ok(found)
}

/// What a surface sends in observations of a table, relative to a star of magnitude 0.
///
/// # Errors
/// Those of [`observation_table`].
pub fn surface_flux<'a>(
    request: &Request,
    surface: Surface,
    observations: impl Iterator<Item = &'a Observation>,
    progress: &dyn Progress,
) -> Result<Vec<f64>> {
    let one = Satellite::of("one surface", vec![surface]);
    let made = observation_table(&Request { satellite: &one, ..copied(request) }, progress)?;
    let flux = |o: &Observation| {
        let v_mag = made.rows.get(o.row).and_then(|row| row.model_v_mag);
        v_mag.map_or(0.0, |v_mag| 10f64.powf(-0.4 * v_mag))
    };
    Ok(observations.map(flux).collect())
}

/// lg(range / 1000 km).
fn lg_range(row: &PhotometryRow) -> f64 {
    row.range_km.map_or(f64::NAN, |range_km| (range_km / 1000.0).log10())
}

/// Of a table whose rows state range and phase angle.
///
/// # Errors
/// Those of [`stated_rows`].
pub fn stated(request: &Request) -> Result<Observations> {
    let (rows, notes) = stated_rows(request)?;
    let mut found = collected(request.table, &rows, &|row, v_mag| Some(v_mag - 5.0 * lg_range(row)))?;
    found.notes.splice(0..0, notes);
    Ok(found)
}

/// The same request of another satellite.
fn copied<'a>(request: &Request<'a>) -> Request<'a> {
    Request { columns: request.columns.clone(), site: request.site.clone(), ..*request }
}

/// The usable rows with their passes; `reduced` is the magnitude at 1000 km.
fn collected(
    path: &Path,
    rows: &[PhotometryRow],
    reduced: &dyn Fn(&PhotometryRow, f64) -> Option<f64>,
) -> Result<Observations> {
    let mut out = Observations::default();
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&rows[*a], &rows[*b]);
        target(a).cmp(&target(b)).then(mjd(a).total_cmp(&mjd(b)))
    });
    let mut timeless = 0;
    let mut last: Option<&PhotometryRow> = None;
    let (mut pass, mut satellite) = (0, 0);
    for k in order {
        let row = &rows[k];
        let (v_mag, is_limit) = match (row.v_mag, row.limit_v_mag, &row.status) {
            (Some(v_mag), _, status) if *status == Status::Ok => (v_mag, false),
            (None, Some(limit), status) if *status == Status::Nondetection => (limit, true),
            _ => continue,
        };
        let (Some(mag_1000km), Some(phase_deg), Some(range_km)) =
            (reduced(row, v_mag), row.phase_angle_deg, row.range_km)
        else {
            continue;
        };
        timeless += usize::from(row.mjd_mid_d.is_none());
        // without times every row is a pass of its own
        if let Some(last) = last {
            let is_next = row.mjd_mid_d.is_none() || !same_pass(last, row);
            pass += usize::from(is_next);
            // a row that names no satellite may be of any
            satellite += usize::from(target(last) != target(row) || (is_next && target(row) == (None, "")));
        }
        last = Some(row);
        let err_mag = row.v_mag_err.unwrap_or(0.0);
        let mjd_d = row.mjd_mid_d;
        let (sun_alt_sat_deg, table) = (row.sun_alt_sat_deg, 0);
        out.rows.push(Observation {
            row: k,
            mag_1000km,
            v_mag,
            err_mag,
            is_limit,
            phase_deg,
            sun_alt_sat_deg,
            range_km,
            mjd_d,
            pass,
            satellite,
            table,
        });
    }
    let failed = rows.iter().filter(|r| r.status == Status::Failed).count();
    if let Some(first) = rows.iter().find(|r| r.status == Status::Failed) {
        out.notes.push(format!("{failed} of {} rows cannot be used, the first: {}", rows.len(), first.reason));
    }
    if timeless > 0 {
        out.notes.push(format!("{timeless} rows have no time: each is taken as a pass of its own"));
    }
    if out.rows.is_empty() {
        let why = rows.iter().find(|r| !r.reason.is_empty()).map_or(String::new(), |r| format!(": {}", r.reason));
        let problem = format!("none of its {} rows has a magnitude that can be fitted{why}", rows.len());
        return Err(Error::Table { path: path.to_owned(), line: None, problem });
    }
    Ok(out)
}
