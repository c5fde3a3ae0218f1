//! Tables of observations of others: what the model expects for every row, and how the magnitudes differ from it.
//!
//! A row is a time, a satellite and a site, or a geometry: altitude and azimuth of Sun and satellite, and its height. Every row
//! of the table stays, in its order and with its cells; one that cannot be computed has a reason. km, degrees, magnitudes
//! outside the atmosphere. The table is held in memory. It does not cover photometry tables of satphot's own nights, which hold
//! frames ([`crate::pipeline`]).

mod checks;
mod columns;
mod job;
mod magnitudes;
mod number;
mod request;
mod row;
mod satellites;
mod stated;
mod statistics;
mod time;

use rayon::prelude::*;

use crate::base::error::Result;
use crate::base::progress::Progress;
use crate::tables::formats::Table as OutTable;
use crate::tables::joined::appended;
use crate::tables::read::{Row, Table};
use crate::tables::words::Status;
use crate::tables::{COMPARED, Column, Meta, PREDICTED, PhotometryRow};

use columns::Columns;
use job::{Job, Models};
use request::wrong;
use satellites::Satellites;

pub use request::{Magnitudes, Places, Request};
pub use stated::{magnitude_rows, stated_rows, states_range_and_phase};
pub use statistics::{ResidualStatistics, by_satellite};

/// Rows computed before a request to stop is looked at.
const CHUNK: usize = 512;

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
/// [`Error::Table`](crate::Error::Table) for a column that is missing, of another unit, or of which two can be meant; [`Error::Interrupted`](crate::Error::Interrupted) once a
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
