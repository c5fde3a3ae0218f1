//! Whether the rows of a photometry table can be true: words of the schema, ranges, times that agree.
//!
//! The reader has checked that numbers are numbers; this looks at what they say. One message per table, the first row
//! that cannot be, with its column, its value and what to do.

use std::path::Path;

use crate::base::error::{Error, Result};
use crate::base::utc::Utc;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Largest difference between `date_mid` and `mjd_mid_d` \[s\]: the text has microseconds, the number 0.6 µs.
const TIME_TOLERANCE_S: f64 = 1e-3;

/// Passes if every row can be true.
///
/// # Errors
/// [`Error::Table`] naming row, frame, column, value and remedy.
pub fn sound(path: &Path, rows: &[PhotometryRow]) -> Result<()> {
    for (i, row) in rows.iter().enumerate() {
        if let Some((column, problem)) = first_wrong(row) {
            let problem = format!("row {} ({}): {column}: {problem}", i + 1, row.frame);
            return Err(Error::Table { path: path.into(), line: None, problem });
        }
    }
    Ok(())
}

fn first_wrong(row: &PhotometryRow) -> Option<(&'static str, String)> {
    let word = |column, value: &str, known: &[&'static str]| {
        (!known.contains(&value)).then(|| (column, format!("`{value}` is not one of {}", known.join(", "))))
    };
    let verdicts: Vec<&str> = Verdict::ALL.iter().map(|v| v.as_str()).chain([""]).collect();
    let range = |column, value: Option<f64>, low: f64, high: f64, unit: &str| {
        let outside = |v: &f64| !(low..=high).contains(v);
        value
            .filter(outside)
            .map(|v| (column, format!("{v} is outside {low} to {high} {unit}; correct it or empty it")))
    };
    let big = 1e12;
    word("status", &row.status, &Status::ALL.map(Status::as_str))
        .or_else(|| word("verdict", &row.verdict, &verdicts))
        .or_else(|| time(row))
        .or_else(|| range("exptime_s", row.exptime_s, 1e-6, 1e6, "s"))
        .or_else(|| range("time_err_s", row.time_err_s, 0.0, 86_400.0, "s"))
        .or_else(|| range("norad_cat_id", row.norad_cat_id.map(|n| n as f64), 1.0, 999_999_999.0, ""))
        .or_else(|| {
            let object = &row.object_id;
            (!object.is_empty() && cospar(object).is_none())
                .then(|| ("object_id", format!("`{object}` is not a COSPAR id such as 1998-067A")))
        })
        .or_else(|| range("v_mag", row.v_mag, -40.0, 60.0, "mag"))
        .or_else(|| range("v_mag_err", row.v_mag_err, 0.0, 100.0, "mag"))
        .or_else(|| range("v_mag_err_sys", row.v_mag_err_sys, 0.0, 100.0, "mag"))
        .or_else(|| range("limit_v_mag", row.limit_v_mag, -40.0, 60.0, "mag"))
        .or_else(|| {
            let undetected = row.status == Status::Nondetection && row.v_mag.is_some();
            undetected.then(|| ("v_mag", "a non-detection has no magnitude; empty it or correct the status".into()))
        })
        .or_else(|| range("alt_deg", row.alt_deg, -90.0, 90.0, "deg"))
        .or_else(|| range("az_deg", row.az_deg, -360.0, 360.0, "deg"))
        .or_else(|| range("range_km", row.range_km, 0.0, big, "km"))
        .or_else(|| range("phase_angle_deg", row.phase_angle_deg, 0.0, 180.0, "deg"))
        .or_else(|| {
            (row.flags < 0)
                .then(|| ("flags", format!("{} is not a bit mask of 31 bits; it must not be below 0", row.flags)))
        })
}

/// The two columns of time must tell the same moment.
fn time(row: &PhotometryRow) -> Option<(&'static str, String)> {
    if row.date_mid.is_empty() {
        return row.mjd_mid_d.map(|_| ("date_mid", "is missing where mjd_mid_d is not; write it as UTC".into()));
    }
    let Some(utc) = Utc::read(&row.date_mid) else {
        return Some(("date_mid", format!("`{}` is not a UTC time such as 2025-06-09T10:33:02.500Z", row.date_mid)));
    };
    let Some(mjd_d) = row.mjd_mid_d else {
        return Some(("mjd_mid_d", "is missing where date_mid is not; write it as MJD (UTC)".into()));
    };
    let apart_s = (mjd_d - utc.mjd_d()).abs() * 86_400.0;
    // a float64 cannot tell a leap second from the one before or after it
    let allowed_s = if utc.ns >= 86_399_000_000_000 { 1.0 } else { 0.0 } + TIME_TOLERANCE_S;
    (apart_s > allowed_s).then(|| {
        ("mjd_mid_d", format!("{mjd_d} is {apart_s:.4} s from date_mid {}; one of them is wrong", row.date_mid))
    })
}

/// Year, number and piece of a COSPAR id `1998-067A`.
pub(super) fn cospar(text: &str) -> Option<(&str, &str, &str)> {
    let (year, rest) = text.split_once('-')?;
    let (number, piece) = rest.split_at_checked(3)?;
    let digits = |t: &str| t.bytes().all(|c| c.is_ascii_digit());
    let good = year.len() == 4
        && digits(year)
        && digits(number)
        && (1..=3).contains(&piece.len())
        && piece.bytes().all(|c| c.is_ascii_uppercase());
    good.then_some((year, number, piece))
}
