//! The rules of SCORE, column by column.
//!
//! Degrees, metres, seconds, magnitudes, arcsec², km, km/s as the columns say. Source: the server's models and forms
//! (github.com/iausathub/score, 2025), its "Data format" page. It does not cover what needs the network.

use super::score_form::HEADER;
use super::score_form::refused_below_deg;
use crate::base::utc::Utc;

/// Where a finding goes: column, value, problem with its remedy, whether the server takes it all the same.
type ReportFinding<'a> = dyn FnMut(&str, &str, String, bool) + 'a;

/// The text of a column of the row.
type CellText<'a> = dyn Fn(&str) -> &'a str + 'a;

const MODES: [&str; 5] = ["VISUAL", "BINOCULARS", "CCD", "CMOS", "OTHER"];

/// Columns that may not be blank, apart from the magnitude and its uncertainty.
const REQUIRED: [&str; 12] = [
    "norad_cat_id",
    "observation_time_utc",
    "observation_time_uncertainty_sec",
    "observer_latitude_deg",
    "observer_longitude_deg",
    "observer_altitude_m",
    "limiting_magnitude",
    "instrument",
    "observing_mode",
    "observing_filter",
    "observer_email",
    "observer_orcid",
];

/// Words that stand for nothing and must be nothing.
const NOTHING: [&str; 10] = ["n/a", "na", "none", "null", "nan", "-", "--", "inf", "-inf", "unknown"];

/// Checks one row of 27 cells.
pub fn check_row<'a>(cells: &'a [String], report: &mut ReportFinding<'_>) {
    let cell = |column: &str| -> &'a str { HEADER.iter().position(|h| *h == column).map_or("", |i| cells[i].trim()) };
    for column in REQUIRED {
        if cell(column).is_empty() {
            report(column, "", "is required; fill it in".into(), false);
        }
    }
    // `none` is the sample file's own word for an instrument, and comments are free
    for (column, value) in HEADER.iter().zip(cells) {
        let free = ["satellite_name", "instrument", "observing_filter", "comments"].contains(column);
        if !free && NOTHING.contains(&value.trim().to_lowercase().as_str()) {
            report(column, value, "stands for nothing; leave the field empty, without a word for it".into(), false);
        } else if value.trim() != value && !value.trim().is_empty() {
            report(column, value, "has blanks around it; take them away".into(), true);
        }
    }
    satellite(&cell, report);
    time(&cell, report);
    brightness(&cell, report);
    place(&cell, report);
    observer(&cell, report);
    position(&cell, report);
}

fn satellite(cell: &CellText<'_>, report: &mut ReportFinding<'_>) {
    let name = cell("satellite_name");
    if name != name.to_uppercase() {
        report(
            "satellite_name",
            name,
            "the server knows names in upper case; write it so, or leave it empty".into(),
            true,
        );
    }
    let number = cell("norad_cat_id");
    let good = number.bytes().all(|c| c.is_ascii_digit()) && number.trim_start_matches('0').len() <= 6;
    if !number.is_empty() && (!good || number.trim_start_matches('0').is_empty()) {
        let problem = "must be the catalogue number, a whole number from 1 to 999999 (6 digits)";
        report("norad_cat_id", number, problem.into(), false);
    }
}

fn time(cell: &CellText<'_>, report: &mut ReportFinding<'_>) {
    let time = cell("observation_time_utc");
    if !time.is_empty() {
        match Utc::read(time) {
            None => {
                let problem = "is not a UTC mid-exposure time such as 2025-06-09T10:33:02.500Z";
                report("observation_time_utc", time, problem.into(), false);
            }
            Some(_) if time.get(17..19) == Some("60") => {
                let problem = "is within a leap second, which the server's clock does not have; leave the row out";
                report("observation_time_utc", time, problem.into(), false);
            }
            // the first artificial satellite
            Some(utc) if utc.mjd < 36_115 => {
                report(
                    "observation_time_utc",
                    time,
                    "is before the first satellite (1957-10-04); check the year".into(),
                    true,
                );
            }
            Some(_) => {}
        }
    }
    number(cell, report, "observation_time_uncertainty_sec", 0.0, f64::MAX, "seconds, 0 or more");
}

fn brightness(cell: &CellText<'_>, report: &mut ReportFinding<'_>) {
    let (mag, err) = (cell("apparent_magnitude"), cell("apparent_magnitude_uncertainty"));
    number(cell, report, "apparent_magnitude", f64::MIN, f64::MAX, "a magnitude, e.g. 11.934");
    number(cell, report, "apparent_magnitude_uncertainty", 0.0, f64::MAX, "magnitudes, 0 or more");
    number(cell, report, "limiting_magnitude", f64::MIN_POSITIVE, f64::MAX, "a magnitude above 0");
    match (mag.is_empty(), err.is_empty()) {
        (true, false) => {
            let problem = "an uncertainty without a magnitude; give both, or neither for a non-detection";
            report("apparent_magnitude_uncertainty", err, problem.into(), false);
        }
        (false, true) => {
            let problem = "a magnitude without its uncertainty; give both, or neither for a non-detection";
            report("apparent_magnitude", mag, problem.into(), false);
        }
        (true, true) if !cell("comments").to_lowercase().contains("non-detection") => {
            report(
                "comments",
                cell("comments"),
                "a row without a magnitude should say `non-detection` here".into(),
                true,
            );
        }
        _ => {}
    }
    if mag.parse::<f64>().is_ok_and(|m| !(-30.0..=30.0).contains(&m)) {
        report("apparent_magnitude", mag, "is far from any satellite's; check it".into(), true);
    }
}

fn place(cell: &CellText<'_>, report: &mut ReportFinding<'_>) {
    number(cell, report, "observer_latitude_deg", -90.0, 90.0, "degrees from -90 to 90, north positive (WGS84)");
    number(cell, report, "observer_longitude_deg", -180.0, 180.0, "degrees from -180 to 180, east positive (WGS84)");
    number(cell, report, "observer_altitude_m", -1e6, 1e6, "metres above the ellipsoid");
    if let Ok(alt_m) = cell("observer_altitude_m").parse::<f64>() {
        if !(-500.0..=9_000.0).contains(&alt_m) {
            report(
                "observer_altitude_m",
                cell("observer_altitude_m"),
                "no observatory is there; give metres".into(),
                true,
            );
        } else if refused_below_deg(alt_m) > 10.0 {
            let problem = format!(
                "SCORE seems to read these metres as km and may refuse what was seen below {:.0} deg; leave it as it is",
                refused_below_deg(alt_m)
            );
            report("observer_altitude_m", cell("observer_altitude_m"), problem, true);
        }
    }
}

fn observer(cell: &CellText<'_>, report: &mut ReportFinding<'_>) {
    let mode = cell("observing_mode");
    if !mode.is_empty() && !MODES.contains(&mode.to_uppercase().as_str()) {
        report("observing_mode", mode, format!("must be one of {}", MODES.join(", ")), false);
    }
    for column in ["instrument", "observing_filter", "satellite_name"] {
        if cell(column).chars().count() > 200 {
            report(column, cell(column), "is longer than 200 characters; shorten it".into(), false);
        }
    }
    let email = cell("observer_email");
    if !email.is_empty() && !is_email(email) {
        report("observer_email", email, "is not an e-mail address such as name@example.org".into(), false);
    }
    if !cell("observer_orcid").is_empty() {
        for orcid in cell("observer_orcid").split(',').map(str::trim) {
            match check_digit(orcid) {
                None => {
                    let problem = "is not an ORCID such as 0000-0002-1825-0097; several stand in one quoted field, \
                                   separated by commas";
                    report("observer_orcid", orcid, problem.into(), false);
                }
                Some(false) => {
                    report("observer_orcid", orcid, "its last digit does not fit the others; check it".into(), true);
                }
                Some(true) => {}
            }
        }
    }
    let link = cell("data_archive_link");
    let is_url = ["http://", "https://", "ftp://", "ftps://"]
        .iter()
        .any(|scheme| link.strip_prefix(scheme).is_some_and(|rest| rest.contains('.') && !rest.contains(' ')));
    if !link.is_empty() && (!is_url || link.len() > 200) {
        report("data_archive_link", link, "is not a URL of at most 200 characters; begin with https://".into(), false);
    }
    let code = cell("mpc_code");
    if code.len() > 10 {
        report(
            "mpc_code",
            code,
            "is longer than 10 characters; give the three of the Minor Planet Center".into(),
            false,
        );
    } else if !code.is_empty() && (code.len() != 3 || !code.bytes().all(|c| c.is_ascii_alphanumeric())) {
        report(
            "mpc_code",
            code,
            "codes of the Minor Planet Center have three letters or digits; check it".into(),
            true,
        );
    }
}

/// Measured positions, ranges and rates: optional, but with what belongs to them.
fn position(cell: &CellText<'_>, report: &mut ReportFinding<'_>) {
    let (ra, dec) = ("satellite_right_ascension_deg", "satellite_declination_deg");
    number(cell, report, ra, 0.0, 360.0, "degrees from 0 to 360 (ICRF)");
    number(cell, report, dec, -90.0, 90.0, "degrees from -90 to 90 (ICRF)");
    number(cell, report, "sigma_2_ra", 0.0, f64::MAX, "arcsec², 0 or more");
    number(cell, report, "sigma_2_dec", 0.0, f64::MAX, "arcsec², 0 or more");
    number(cell, report, "sigma_ra_sigma_dec", f64::MIN, f64::MAX, "arcsec²");
    number(cell, report, "range_to_satellite_km", 0.0, f64::MAX, "km, 0 or more");
    number(cell, report, "range_to_satellite_uncertainty_km", 0.0, f64::MAX, "km, 0 or more");
    number(cell, report, "range_rate_of_satellite_km_per_sec", f64::MIN, f64::MAX, "km/s");
    number(cell, report, "range_rate_of_satellite_uncertainty_km_per_sec", 0.0, f64::MAX, "km/s, 0 or more");
    let range_rate = "range_rate_of_satellite_km_per_sec";
    for (column, with) in [
        (ra, dec),
        (dec, ra),
        ("sigma_2_ra", ra),
        ("sigma_2_dec", dec),
        ("sigma_ra_sigma_dec", ra),
        ("range_to_satellite_uncertainty_km", "range_to_satellite_km"),
        ("range_rate_of_satellite_uncertainty_km_per_sec", range_rate),
    ] {
        if !cell(column).is_empty() && cell(with).is_empty() {
            report(column, cell(column), format!("needs {with}; give both or neither"), false);
        }
    }
}

/// A number of `low` to `high`, where there is one.
fn number(cell: &CellText<'_>, report: &mut ReportFinding<'_>, column: &str, low: f64, high: f64, what: &str) {
    let text = cell(column);
    if text.is_empty() || NOTHING.contains(&text.to_lowercase().as_str()) {
        return; // reported already
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= low && value <= high => {}
        Ok(value) if value.is_finite() => report(column, text, format!("is out of range; accepted: {what}"), false),
        _ => report(column, text, format!("is not a number; accepted: {what}"), false),
    }
}

/// As the server's own pattern: `name@host.domain`.
fn is_email(text: &str) -> bool {
    let Some((name, host)) = text.split_once('@') else { return false };
    let named = |t: &str, more: &str| !t.is_empty() && t.chars().all(|c| c.is_ascii_alphanumeric() || more.contains(c));
    let Some((first, rest)) = host.split_once('.') else { return false };
    named(name, "_.+-") && named(first, "-") && named(rest, ".-") && !rest.starts_with('.') && !rest.ends_with('.')
}

/// Whether the check digit of an ORCID fits (ISO 7064 MOD 11-2); `None` if it is not an ORCID at all.
fn check_digit(orcid: &str) -> Option<bool> {
    let bytes = orcid.as_bytes();
    if bytes.len() != 19 {
        return None;
    }
    let mut total = 0u32;
    for (i, c) in bytes[..18].iter().enumerate() {
        match (i % 5 == 4, c) {
            (true, b'-') => {}
            (false, b'0'..=b'9') => total = (total + u32::from(c - b'0')) * 2,
            _ => return None,
        }
    }
    let expected = (12 - total % 11) % 11;
    match bytes[18] {
        c @ b'0'..=b'9' => Some(u32::from(c - b'0') == expected),
        b'X' | b'x' => Some(expected == 10),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orcids_are_known_by_their_check_digit() {
        // the three of ORCID's own documentation
        for good in ["0000-0002-1825-0097", "0000-0001-5109-3700", "0000-0002-1694-233X"] {
            assert_eq!(check_digit(good), Some(true), "{good}");
        }
        assert_eq!(check_digit("0000-0002-1825-0098"), Some(false));
        for bad in ["", "0000-0002-1825-009", "0000-0002-1825-00977", "0000 0002 1825 0097", "000X-0002-1825-0097"] {
            assert_eq!(check_digit(bad), None, "{bad}");
        }
    }

    #[test]
    fn an_address_has_a_name_a_host_and_a_domain() {
        for good in ["obs@example.org", "a.b+c-d_e@x-y.co.uk"] {
            assert!(is_email(good), "{good}");
        }
        for bad in
            ["obs", "obs@", "@example.org", "obs@example", "o bs@example.org", "obs@example.", "obs@@example.org"]
        {
            assert!(!is_email(bad), "{bad}");
        }
    }
}
