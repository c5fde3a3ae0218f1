//! Magnitudes as IOD lines, the 80 columns of the visual observers.
//!
//! Catalogue number, COSPAR id, station, UTC, its uncertainty, magnitude and its uncertainty in tenths. The columns of
//! the position stay blank, as the format allows: none is measured. Source: G. Lewis, "IOD Observation Format
//! Description" (1998, clarified 2002), satobs.org. It does not cover flash periods and station reports.

use std::fmt::Write as _;
use std::path::Path;

use super::facts::{Facts, argument, needed, said, wrong};
use super::select::{ExportedRow, rounded, total_err_mag};
use super::sound::cospar;
use crate::base::error::{Error, Result};
use crate::base::utc::Utc;

/// The largest catalogue number five columns hold.
const LARGEST: i64 = 99_999;

/// One line per magnitude.
///
/// # Errors
/// [`Error::Config`] without a station or for simulated data; [`Error::Table`] for a satellite beyond 99999 or without
/// its ids.
pub fn iod_text(path: &Path, kept: &[ExportedRow<'_>], facts: &Facts) -> Result<String> {
    if facts.data_mode()? != super::DataMode::Real {
        let problem = format!(
            "the data of {} are {}: IOD lines have no mark for that, so they take real observations alone",
            path.display(),
            facts.data_mode()?.name()
        );
        return Err(wrong("data_mode", problem));
    }
    let station = said(&facts.reporter.iod_station)
        .ok_or_else(|| needed("the four-digit station number", "iod_station", "reporter.iod_station"))?;
    if station.len() != 4 || !station.bytes().all(|c| c.is_ascii_digit()) {
        return Err(argument("iod_station", format!("`{station}` is not a station number of four digits")));
    }
    let mut text = String::new();
    for kept in kept {
        let ExportedRow::Magnitude(row) = kept else { continue };
        let bad = |problem: String| Error::Table {
            path: path.into(),
            line: None,
            problem: format!("{}: {problem}", row.frame),
        };
        let number =
            row.norad_cat_id.ok_or_else(|| bad("IOD needs norad_cat_id; give argument `norad_cat_id`".into()))?;
        if number > LARGEST {
            return Err(bad(format!(
                "norad_cat_id {number} does not fit the five columns of IOD (at most {LARGEST}); use argument `to` tdm, udl or score"
            )));
        }
        let (year, launch, piece) = cospar(&row.object_id).ok_or_else(|| {
            bad(format!(
                "IOD needs the COSPAR id, and object_id is `{}`; give argument `object_id 1998-067A`",
                row.object_id
            ))
        })?;
        let utc = Utc::read(&row.date_mid).ok_or_else(|| bad(format!("date_mid `{}` is not UTC", row.date_mid)))?;
        let [y, mo, d, h, mi, s, ms] = utc.fields(3);
        let time_err_s = row.time_err_s.ok_or_else(|| bad("IOD needs time_err_s; set time.err_s".into()))?;
        let (Some(mag), Some(err)) = (row.v_mag, total_err_mag(row)) else { continue };
        if !(-99.9..=99.9).contains(&mag) {
            return Err(bad(format!("v_mag {mag} does not fit IOD (-99.9 to 99.9)")));
        }
        let tenths = (rounded(mag, 1) * 10.0).round() as i64;
        let err_tenths = ((err * 10.0).round() as i64).clamp(1, 99);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{number:05} {} {launch}{piece:<3} {station}   {y:04}{mo:02}{d:02}{h:02}{mi:02}{s:02}{ms:03} {}{:23}{}{:03} {err_tenths:02}",
            &year[2..],
            time_code(time_err_s),
            "",
            if tenths < 0 { '-' } else { '+' },
            tenths.abs(),
        );
    }
    Ok(text)
}

/// An uncertainty as `MX`: M · 10^(X−8) seconds, rounded up so that it never looks better than it is.
fn time_code(err_s: f64) -> String {
    if err_s <= 1e-8 {
        return "10".into();
    }
    let mut exponent = (err_s * (1.0 - 1e-12)).log10().floor();
    let mut mantissa = (err_s / 10f64.powf(exponent) - 1e-9).ceil();
    if mantissa > 9.0 {
        (mantissa, exponent) = (1.0, exponent + 1.0);
    }
    let power = exponent + 8.0;
    if power > 9.0 { "99".into() } else { format!("{mantissa:.0}{power:.0}") }
}

#[cfg(test)]
mod tests {
    use super::time_code;

    #[test]
    fn an_uncertainty_has_one_digit_and_a_power() {
        // the format's own examples: 56 is 0.05 s, 18 is 1 s, 27 is 0.2 s
        for (err_s, code) in
            [(0.05, "56"), (1.0, "18"), (0.2, "27"), (0.5, "57"), (0.001, "15"), (0.51, "67"), (0.95, "18")]
        {
            assert_eq!(time_code(err_s), code, "{err_s}");
        }
    }
}
