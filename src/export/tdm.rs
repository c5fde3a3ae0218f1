//! Magnitudes as a CCSDS tracking data message, version 2.0, in keyword = value notation.
//!
//! One segment per satellite, pass and exposure time, because INTEGRATION_INTERVAL belongs to the segment; in order of
//! time. MAG is the apparent V magnitude, ANGLE_1 and ANGLE_2 are right ascension and declination where star trails measured them.
//! Uncertainties and the band have no keyword: COMMENT and the ECSV carry them. Source: CCSDS 503.0-B-2 (2020).

use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::Path;

use super::facts::{DataMode, Facts, argument};
use super::select::{ExportedRow, rounded};
use crate::base::error::{Error, Result};
use crate::base::utc::Utc;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::words::Verdict;

/// Longest line of the notation.
const LINE: usize = 254;

/// What the message calls itself.
#[derive(Debug, Clone, Default)]
pub struct TdmNames {
    /// CREATION_DATE, UTC; the newest observation of the message if absent, so that same input gives same bytes.
    pub creation_date: Option<String>,
    /// MESSAGE_ID; from date and satellite if absent.
    pub message_id: Option<String>,
}

/// The message. `rows` is the whole table, whose passes the segments follow.
///
/// # Errors
/// [`Error::Config`] for what nobody said; [`Error::NoInput`] if nothing is to be reported; [`Error::Table`] for a row
/// whose satellite has neither COSPAR id nor number.
pub fn tdm_text(
    path: &Path,
    rows: &[PhotometryRow],
    kept: &[ExportedRow<'_>],
    facts: &Facts,
    names: &TdmNames,
) -> Result<String> {
    let wanted: HashSet<*const PhotometryRow> = kept
        .iter()
        .filter_map(|k| match k {
            ExportedRow::Magnitude(row) => Some(std::ptr::from_ref(*row)),
            ExportedRow::Limit(_) => None,
        })
        .collect();
    let mut segments: Vec<Vec<&PhotometryRow>> = Vec::new();
    let mut pass_starts = Vec::new();
    for pass in passes(rows) {
        let Some(start) = pass.first().and_then(|r| Utc::read(&r.date_mid)) else { continue };
        let of_pass = pass.into_iter().filter(|r| wanted.contains(&std::ptr::from_ref::<PhotometryRow>(r)));
        let from = segments.len();
        for row in of_pass {
            match segments[from..].iter_mut().find(|s| s[0].exptime_s == row.exptime_s) {
                Some(segment) => segment.push(row),
                None => {
                    segments.push(vec![row]);
                    pass_starts.push(start);
                }
            }
        }
    }
    let newest = segments.iter().flatten().filter_map(|r| Utc::read(&r.date_mid)).max();
    let (Some(first), Some(newest)) = (pass_starts.first(), newest) else {
        return Err(Error::NoInput {
            path: path.into(),
            problem: "no magnitude to report: a tracking data message needs at least one; see what was skipped, and \
                      argument `verdicts`"
                .into(),
        });
    };
    let mut text = head(facts, names, newest, || message_id(*first, &segments))?;
    for (segment, start) in segments.iter().zip(&pass_starts) {
        text += &self::segment(path, segment, *start, facts)?;
    }
    Ok(text)
}

fn head(facts: &Facts, names: &TdmNames, newest: Utc, own_id: impl Fn() -> String) -> Result<String> {
    let mut text = String::from("CCSDS_TDM_VERS = 2.0\n");
    let mut say = |line: String| text += &kvn(&line);
    if facts.data_mode()? != DataMode::Real {
        say(format!("COMMENT {} DATA: not observations of a real object", facts.data_mode()?.name()));
    }
    say(format!(
        "COMMENT TOOL {}; photometric system {}, band {}; apparent magnitudes outside the atmosphere, no correction for \
         range",
        facts.tool, facts.mag_system, facts.calibration
    ));
    let created = match &names.creation_date {
        Some(given) => {
            let bare = format!("{}Z", given.trim().trim_end_matches('Z'));
            let utc = Utc::read(&bare).ok_or_else(|| Error::Argument {
                name: "creation_date".into(),
                problem: format!("`{given}` is not a UTC time such as 2026-11-21T10:05:00Z"),
            })?;
            iso(utc)
        }
        None => {
            say("COMMENT CREATION_DATE is that of the newest observation, so that the same input gives the same file"
                .into());
            iso(newest)
        }
    };
    say(format!("CREATION_DATE = {created}Z"));
    let organisation = facts.organisation()?;
    for (name, value) in [
        ("organisation", Some(organisation)),
        ("station", facts.station().ok()),
        ("message_id", names.message_id.as_deref()),
    ] {
        if let Some(value) = value.filter(|v| v.len() > LINE / 2 || !v.chars().all(|c| (' '..='~').contains(&c))) {
            let problem = format!(
                "`{value}`: a tracking data message takes printable ASCII alone, {} letters at most here",
                LINE / 2
            );
            return Err(argument(name, problem));
        }
    }
    say(format!("ORIGINATOR = {organisation}"));
    say(format!("MESSAGE_ID = {}", names.message_id.clone().unwrap_or_else(own_id)));
    Ok(text)
}

/// Day of the first observation and the satellite, or how many there are.
fn message_id(first: Utc, segments: &[Vec<&PhotometryRow>]) -> String {
    let mut targets: Vec<String> = segments.iter().filter_map(|s| target(s[0])).collect();
    targets.sort();
    targets.dedup();
    let day = iso(first).chars().take(10).filter(|c| *c != '-').collect::<String>();
    match targets.as_slice() {
        [one] => format!("{day}-{one}-0001"),
        several => format!("{day}-{}SATELLITES-0001", several.len()),
    }
}

/// The catalogue number, else the COSPAR id.
fn target(row: &PhotometryRow) -> Option<String> {
    row.norad_cat_id.map(|n| n.to_string()).or_else(|| (!row.object_id.is_empty()).then(|| row.object_id.clone()))
}

fn segment(path: &Path, rows: &[&PhotometryRow], pass: Utc, facts: &Facts) -> Result<String> {
    let row = rows[0];
    let target = target(row).ok_or_else(|| Error::Table {
        path: path.into(),
        line: None,
        problem: format!(
            "{}: the satellite has neither object_id nor norad_cat_id; give argument `object_id 1998-067A`, or [orbit] and measure \
             again",
            row.frame
        ),
    })?;
    let cospar = if row.object_id.is_empty() { target.clone() } else { row.object_id.clone() };
    let times: Vec<Utc> = rows.iter().filter_map(|r| Utc::read(&r.date_mid)).collect();
    let (Some(start), Some(stop)) = (times.iter().min(), times.iter().max()) else { return Ok(String::new()) };
    let [lat, lon, alt_m] = facts.site()?;
    let mut text = String::from("META_START\n");
    let mut say = |line: String| text += &kvn(&line);
    say(format!("COMMENT SITE_WGS84 LAT {lat:.6} deg LON {lon:.6} deg ALT {alt_m:.1} m"));
    say(format!("COMMENT MAG 1-sigma: {}; per point in the companion ECSV", errors(rows)));
    if let Some(age_d) = rows.iter().filter(|r| Flags(r.flags).has(Flags::OLD_ELEMENTS)).find_map(|r| r.tle_age_d) {
        say(format!("COMMENT orbital elements older than 2 d ({:.1} d): the magnitudes are not affected", age_d.abs()));
    }
    say(format!("TRACK_ID = {}-{target}", pass.compact()));
    let places = rows.iter().any(|r| place(r).is_some());
    say(format!("DATA_TYPES = {}", if places { "ANGLE_1,ANGLE_2,MAG" } else { "MAG" }));
    say("TIME_SYSTEM = UTC".into());
    say(format!("START_TIME = {}", iso(*start)));
    say(format!("STOP_TIME = {}", iso(*stop)));
    say(format!("PARTICIPANT_1 = {}", facts.station()?.replace(char::is_whitespace, "_")));
    say(format!("PARTICIPANT_2 = {cospar}"));
    say("MODE = SEQUENTIAL".into());
    say("PATH = 2,1".into());
    say(format!("RECEIVE_BAND = {}", facts.band));
    say("TIMETAG_REF = RECEIVE".into());
    if places {
        say("ANGLE_TYPE = RADEC".into());
        say("REFERENCE_FRAME = ICRF".into());
    }
    if let Some(exptime_s) = row.exptime_s {
        say(format!("INTEGRATION_INTERVAL = {exptime_s:?}"));
        say("INTEGRATION_REF = MIDDLE".into());
    }
    say(format!("DATA_QUALITY = {}", data_quality(rows, facts.declared)));
    say("META_STOP".into());
    say("DATA_START".into());
    for (row, utc) in rows.iter().zip(&times) {
        if let Some((ra_deg, dec_deg)) = place(row) {
            say(format!("ANGLE_1 = {} {ra_deg:.6}", iso(*utc)));
            say(format!("ANGLE_2 = {} {dec_deg:.6}", iso(*utc)));
        }
        if let Some(mag) = row.v_mag {
            say(format!("MAG = {} {:.3}", iso(*utc), rounded(mag, 3)));
        }
    }
    say("DATA_STOP".into());
    Ok(text)
}

/// Right ascension and declination \[deg\], where they were measured.
fn place(row: &PhotometryRow) -> Option<(f64, f64)> {
    row.ra_deg.zip(row.dec_deg)
}

/// `VALIDATED` if every row was judged to be used, `RAW` if nobody judged some of them, `DEGRADED` otherwise.
fn data_quality(rows: &[&PhotometryRow], declared: bool) -> &'static str {
    let judged = |r: &&PhotometryRow| Verdict::from_cell(&r.verdict);
    match rows.iter().map(judged).all(|v| v.is_none_or(|v| v == Verdict::Use)) {
        true if declared => "DEGRADED",
        true if rows.iter().all(|r| judged(r).is_some()) => "VALIDATED",
        true => "RAW",
        false => "DEGRADED",
    }
}

/// Range of the random and the systematic errors.
fn errors(rows: &[&PhotometryRow]) -> String {
    let span = |values: Vec<f64>| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (low <= high).then(|| format!("{low:.3} to {high:.3} mag"))
    };
    let unknown = || "unknown".to_owned();
    let random = span(rows.iter().filter_map(|r| r.v_mag_err).collect()).unwrap_or_else(unknown);
    let systematic = span(rows.iter().filter_map(|r| r.v_mag_err_sys).collect()).unwrap_or_else(unknown);
    format!("random {random}, systematic {systematic}")
}

/// A time to the microsecond, with three decimals at least.
fn iso(utc: Utc) -> String {
    let text = utc.iso(6);
    match text.strip_suffix("000") {
        Some(milliseconds) => milliseconds.to_owned(),
        None => text,
    }
}

/// One line: printable ASCII, no longer than the notation allows. What does not fit the one becomes a question mark,
/// what does not fit the other is cut.
fn kvn(line: &str) -> String {
    let mut text: String = line.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).take(LINE).collect();
    // Writing to a String cannot fail.
    let _ = writeln!(text);
    text
}
