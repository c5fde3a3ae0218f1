//! Tables whose rows state range and phase angle themselves, or of which only magnitudes are wanted: no elements and no site are needed.
//!
//! km, degrees, magnitudes. Such rows have no lights: the satellite is taken as sunlit, and 1 au from the Sun. It does not cover
//! rows that are in the Earth's shadow.

use super::columns::Columns;
use super::magnitudes;
use super::request::{Request, wrong};
use crate::base::error::Result;
use crate::base::time::mjd_utc;
use crate::tables::PhotometryRow;
use crate::tables::read::{Row, Table};
use crate::tables::words::{Status, Verdict};

/// So many phase angles are not all next to 0 by chance.
const FEWEST_PHASES: usize = 5;

/// Whether range and phase angle are all that a table tells: it has columns of them, and not what geometry needs.
///
/// # Errors
/// As [`super::observation_table`] for the columns.
pub fn states_range_and_phase(request: &Request) -> Result<bool> {
    let band = request.magnitudes.map_or("V", |m| m.band.name());
    let table = Table::open(request.table)?;
    let columns = Columns::find(&table, &request.columns, band)?;
    let stated = columns.range_km.is_some() && columns.phase_angle_deg.is_some();
    Ok(stated && request.places(&columns, &table).is_err())
}

/// The rows of such a table, with magnitude, error, limit, time and identity, and notes; a row without range or phase angle is failed
/// with its reason.
///
/// # Errors
/// As [`super::observation_table`].
pub fn stated_rows(request: &Request) -> Result<(Vec<PhotometryRow>, Vec<String>)> {
    let (rows, mut notes) = rows_of(request, true)?;
    notes
        .push("range and phase angle are those of the table: satellites are taken as sunlit, 1 au from the Sun".into());
    Ok((rows, notes))
}

/// The rows of any table with magnitude, error, limit, time and identity, wherever the satellite was, and notes.
///
/// # Errors
/// As [`super::observation_table`].
pub fn magnitude_rows(request: &Request) -> Result<(Vec<PhotometryRow>, Vec<String>)> {
    rows_of(request, false)
}

/// Satellite and time of a row as the table has them.
pub(super) fn identify(made: &mut PhotometryRow, columns: &Columns, row: &Row) {
    made.norad_cat_id = columns.norad_cat_id.and_then(|i| row.get(i).trim().parse().ok());
    made.object_name = columns.object_name.map_or(String::new(), |i| row.get(i).trim().to_owned());
    made.mjd_mid_d = columns.time.as_ref().and_then(|time| time.of(row).ok()).map(mjd_utc);
}

fn rows_of(request: &Request, with_place: bool) -> Result<(Vec<PhotometryRow>, Vec<String>)> {
    let band = request.magnitudes.map_or("V", |m| m.band.name());
    let mut table = Table::open(request.table)?;
    let columns = Columns::find(&table, &request.columns, band)?;
    magnitudes::check_columns(request, &columns, &table)?;
    let stated = (columns.range_km, columns.phase_angle_deg);
    if with_place && (stated.0.is_none() || stated.1.is_none()) {
        let problem = format!("has no columns range_km and phase_angle_deg; present: {}", table.names());
        return Err(wrong(&table, problem));
    }
    let (mut rows, mut row) = (Vec::new(), Row::default());
    while table.read(&mut row)? {
        let number = |what: &str, value: Option<f64>, low: f64, high: f64| match value {
            Some(value) if (low..=high).contains(&value) => Ok(Some(value)),
            Some(value) => Err(format!("{what} is {value}; accepted is {low} to {high}")),
            None if with_place => Err(format!("no {what}")),
            None => Ok(None),
        };
        let place = table.check(&row).and_then(|()| {
            let range_km = number("range_km", stated.0.and_then(|c| c.of(&row)), 100.0, 100_000.0)?;
            Ok((range_km, number("phase_angle_deg", stated.1.and_then(|c| c.of(&row)), 0.0, 180.0)?))
        });
        let mut made = match place {
            Ok((range_km, phase_angle_deg)) => PhotometryRow {
                range_km,
                phase_angle_deg,
                status: Status::Ok.into(),
                verdict: Verdict::Use.into(),
                ..PhotometryRow::default()
            },
            Err(reason) => PhotometryRow {
                status: Status::Failed.into(),
                verdict: Verdict::Reject.into(),
                reason,
                ..PhotometryRow::default()
            },
        };
        made.sun_alt_sat_deg =
            columns.sun_alt_sat_deg.and_then(|c| c.of(&row)).filter(|deg| (-90.0..=90.0).contains(deg));
        identify(&mut made, &columns, &row);
        magnitudes::compare(request, &columns, &row, &mut made);
        rows.push(made);
    }
    let phases = || rows.iter().filter_map(|r: &PhotometryRow| r.phase_angle_deg);
    if phases().count() >= FEWEST_PHASES && phases().all(|deg| deg <= std::f64::consts::PI) {
        let problem = "all phase angles are below 3.15: they are radians, or of another quantity; state the unit in the header \
                       (`phase [rad]`), or name the right column with argument `column phase_angle_deg=NAME`";
        return Err(wrong(&table, problem.into()));
    }
    Ok((rows, table.notes.clone()))
}
