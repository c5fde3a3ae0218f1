//! Time in and out as text: ISO 8601 with a fixed number of decimals, and MJD(UTC).

use hifitime::{Duration, Epoch, TimeScale, Unit};

use crate::base::error::{Error, Result};
use crate::base::instant;

/// `2025-06-09T10:33:02.500Z` with `decimals` (0 to 9), rounded half up.
#[must_use]
pub fn iso_utc(epoch: Epoch, decimals: usize) -> String {
    let step_ns = 10i64.pow(9 - decimals.min(9) as u32);
    let rounded = epoch + Duration::from_total_nanoseconds(i128::from(step_ns / 2));
    let (y, mo, d, h, mi, s, ns) = rounded.to_gregorian_utc();
    let date = format!("{y:04}-{mo:02}-{d:02}T{h:02}:{mi:02}:{s:02}");
    if decimals == 0 {
        return date + "Z";
    }
    format!("{date}.{:0width$}Z", i64::from(ns) / step_ns, width = decimals)
}

/// Modified Julian Date of UTC \[d\].
#[must_use]
pub fn mjd_utc(epoch: Epoch) -> f64 {
    epoch.to_mjd_utc_days()
}

/// Julian year of an epoch, 2000 + (MJD − 51544.5) / 365.25: what positions of stars are moved to.
#[must_use]
pub fn jyear(epoch: Epoch) -> f64 {
    2000.0 + (mjd_utc(epoch) - 51_544.5) / 365.25
}

/// The epoch of an MJD(UTC).
#[must_use]
pub fn from_mjd_utc(mjd_d: f64) -> Epoch {
    Epoch::from_mjd_utc(mjd_d)
}

/// Reads a time that a user or a table gives, as [`instant::read`]: UTC unless a zone stands behind it, a date alone is its
/// 0 h UTC.
///
/// # Errors
/// [`Error::Argument`] naming `key`, the text, what is wrong with it and what is accepted.
pub fn parse_utc(key: &str, text: &str) -> Result<Epoch> {
    instant::read(text).map(|t| t.epoch).map_err(|problem| not_a_time(key, text, &problem))
}

/// Reads a date of the calendar without a time of day: year, month, day.
///
/// # Errors
/// As [`parse_utc`].
pub fn parse_date(key: &str, text: &str) -> Result<(i32, u8, u8)> {
    instant::read_date(text).map_err(|problem| Error::Argument {
        name: key.into(),
        problem: format!("\"{text}\" is not a date: {problem}; accepted is a date such as 2025-06-11"),
    })
}

fn not_a_time(key: &str, text: &str, problem: &str) -> Error {
    Error::Argument { name: key.into(), problem: format!("\"{text}\" is not a time: {problem}; {}", instant::ACCEPTED) }
}

/// Seconds from `a` to `b`.
#[must_use]
pub fn seconds_between(a: Epoch, b: Epoch) -> f64 {
    (b - a).to_seconds()
}

/// `epoch` moved by `seconds`.
#[must_use]
pub fn shifted(epoch: Epoch, seconds: f64) -> Epoch {
    (epoch + seconds * Unit::Second).to_time_scale(TimeScale::UTC)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_goes_out_and_comes_back() {
        let e = parse_utc("t", "2025-06-09T10:33:02.4996Z").unwrap();
        assert_eq!(iso_utc(e, 3), "2025-06-09T10:33:02.500Z");
        assert_eq!(iso_utc(e, 0), "2025-06-09T10:33:02Z");
        assert!((mjd_utc(e) - 60_835.439_612_26).abs() < 1e-7, "{}", mjd_utc(e));
        assert!(parse_utc("t", "yesterday").is_err());
    }

    #[test]
    fn rounding_carries_over_the_end_of_a_year() {
        let e = parse_utc("t", "2025-12-31T23:59:59.9997").unwrap();
        assert_eq!(iso_utc(e, 3), "2026-01-01T00:00:00.000Z");
    }
}
