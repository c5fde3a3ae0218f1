//! A column of times to instants: ISO 8601, MJD or JD by their values, date and time of day in two columns.
//!
//! UTC unless the cell has a zone or the table another scale. A number that is neither an MJD nor a JD of the years 1900 to 2105
//! is no time; a local time without a zone is refused.

use hifitime::{Epoch, TimeScale, Unit};

use super::number::Number;
use crate::base::instant;
use crate::base::time::shifted;
use crate::tables::read::{Column, Row, number};

/// MJD = JD − 2400000.5.
const MJD_OF_JD_D: f64 = 2_400_000.5;
/// MJD of the years that Sun and Moon are known in.
const MJD_D: std::ops::Range<f64> = 15_020.0..89_000.0;

/// The times of a table.
#[derive(Debug, Clone)]
pub struct TimeColumn {
    name: String,
    at: usize,
    date: Option<usize>,
    /// Whether it is of the start of the exposure.
    pub is_start: bool,
    /// The exposure, where half of it is added.
    pub exptime_s: Option<Number>,
    is_local: bool,
    scale: TimeScale,
}

impl TimeColumn {
    pub(super) fn new(
        column: &Column,
        at: usize,
        date: Option<usize>,
        (is_start, exptime_s): (bool, Option<Number>),
        is_local: bool,
    ) -> Result<Self, String> {
        let scale = match column.time_scale.to_ascii_lowercase().as_str() {
            "" | "utc" => TimeScale::UTC,
            "tai" => TimeScale::TAI,
            // TDB is TT within 2 ms
            "tt" | "tdb" => TimeScale::TT,
            other => {
                return Err(format!(
                    "column `{}` is of times in the scale `{other}`; utc, tai, tt and tdb are read",
                    column.name
                ));
            }
        };
        let unit = column.unit.trim();
        if !matches!(unit, "" | "d" | "day" | "days" | "mjd" | "MJD" | "jd" | "JD" | "UTC" | "utc") {
            return Err(format!("column `{}` of times is in `{unit}`; ISO 8601, MJD and JD [d] are read", column.name));
        }
        Ok(Self { name: column.name.clone(), at, date, is_start, exptime_s, is_local, scale })
    }

    /// Mid-exposure of a row.
    ///
    /// # Errors
    /// The column, the cell and what is wrong with it, in words.
    pub fn of(&self, row: &Row) -> Result<Epoch, String> {
        let cell = row.get(self.at);
        let wrong = |problem: &str| format!("{}: \"{cell}\" {problem}", self.name);
        if cell.is_empty() {
            return Err(format!("{} is empty", self.name));
        }
        let epoch = match (number(cell), self.date) {
            (Some(value), None) => {
                let mjd = if MJD_D.contains(&(value - MJD_OF_JD_D)) { value - MJD_OF_JD_D } else { value };
                if !MJD_D.contains(&mjd) {
                    return Err(wrong("is neither an MJD nor a JD; write UTC such as 2025-06-09T20:20:00, MJD or JD"));
                }
                if self.is_local {
                    return Err(wrong("is a local time as a number; give UTC"));
                }
                Epoch::from_mjd_in_time_scale(mjd, self.scale)
            }
            (_, date) => {
                let text =
                    date.map_or_else(|| cell.to_owned(), |date| format!("{}T{cell}", row.get(date).replace('/', "-")));
                let read = instant::read(&text).map_err(|problem| wrong(&format!("is not a time: {problem}")))?;
                if read.is_date_only {
                    return Err(wrong("is a date without a time of day"));
                }
                if self.is_local && !read.has_zone {
                    return Err(wrong(
                        "is a local time without a zone; write the zone behind it (+10:00), or give UTC",
                    ));
                }
                match self.scale {
                    TimeScale::UTC => read.epoch,
                    // the same label in another scale
                    scale => Epoch::from_duration(read.epoch.to_utc_duration(), scale),
                }
            }
        };
        let half_s = self.exptime_s.and_then(|e| e.of(row)).map_or(0.0, |e| 0.5 * e);
        if !(0.0..=43_200.0).contains(&half_s) {
            return Err(format!("the exposure time is {} s", 2.0 * half_s));
        }
        let epoch = epoch.to_time_scale(TimeScale::UTC);
        Ok(if half_s > 0.0 { shifted(epoch, half_s) } else { epoch })
    }

    /// The epoch moved by half hours.
    pub(super) fn moved(epoch: Epoch, half_hours: i32) -> Epoch {
        epoch + f64::from(half_hours) * 1_800.0 * Unit::Second
    }
}
