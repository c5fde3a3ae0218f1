//! Stated passes: rows of a table as an observer or a paper writes them, before anything is checked.
//!
//! Local or UTC times, percent, degrees, magnitudes. Lines that begin with `#` are comments. Nothing is computed here.

use std::path::Path;

use hifitime::Epoch;

use super::local_time::{ZONES, Zone};
use crate::base::error::{Error, Result};
use crate::brightness::light_class::PaperLabel;

/// The paper's own table of passes.
pub const PAPER_PASSES: &str = include_str!("paper_passes.csv");
/// Every column that is read; one of the first two, and the target, are needed.
pub const COLUMNS: [&str; 9] =
    ["time_utc", "time_local", "zone", "target", "moon_illum_pct", "sun_alt_deg", "label", "max_v_mag", "median_v_mag"];

/// One row as it is stated.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedPass {
    /// Its line in the file, from 1.
    pub line: usize,
    /// Date and time as written.
    pub time: String,
    /// The same as an instant.
    pub epoch: Epoch,
    /// What the clock of the row is ahead of UTC \[s\].
    pub clock_ahead_s: f64,
    /// Name or catalogue number.
    pub target: String,
    /// Share of the Moon's disc that is lit \[%\].
    pub moon_illum_pct: Option<f64>,
    /// Altitude of the Sun \[deg\].
    pub sun_alt_deg: Option<f64>,
    /// Light class.
    pub label: Option<PaperLabel>,
    /// Brightest V \[mag\].
    pub max_v_mag: Option<f64>,
    /// Median V \[mag\].
    pub median_v_mag: Option<f64>,
}

/// Reads a table; the names of columns that are not read come with it. `zone` is that of rows without one.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] with line, column, what is wrong and what is accepted.
pub fn read_passes(path: &Path, zone: Option<Zone>) -> Result<(Vec<StatedPass>, Vec<String>)> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    parse_passes(path, &text, zone)
}

/// As [`read_passes`], of a text; `path` is for messages.
///
/// # Errors
/// As [`read_passes`].
pub fn parse_passes(path: &Path, text: &str, zone: Option<Zone>) -> Result<(Vec<StatedPass>, Vec<String>)> {
    let fail = |line: Option<usize>, problem: String| Error::Table { path: path.into(), line, problem };
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let line_of = |p: Option<&csv::Position>| p.map(|p| p.line() as usize);
    let head = reader.headers().map_err(|e| fail(line_of(e.position()), e.to_string()))?.clone();
    let names: Vec<String> = head.iter().map(str::to_ascii_lowercase).collect();
    let needed = "a row of names is needed: time_utc, or time_local and zone; target; and what is stated of \
        moon_illum_pct, \
                  sun_alt_deg, label, max_v_mag, median_v_mag";
    if names.iter().all(String::is_empty) {
        return Err(fail(None, format!("the file is empty; {needed}")));
    }
    let head_line = line_of(head.position());
    if let Some(twice) = names.iter().enumerate().find(|(i, n)| names.iter().take(*i).any(|m| m == *n)) {
        return Err(fail(head_line, format!("column {} is there twice", twice.1)));
    }
    let column = |name: &str| names.iter().position(|n| n == name);
    let target = column("target").ok_or_else(|| fail(head_line, format!("column target is missing; {needed}")))?;
    let (utc, local) = (column("time_utc"), column("time_local"));
    let time = match (utc, local) {
        (Some(at), None) | (None, Some(at)) => at,
        (Some(_), Some(_)) => return Err(fail(head_line, "time_utc and time_local are both there; keep one".into())),
        (None, None) => return Err(fail(head_line, format!("column time_utc or time_local is missing; {needed}"))),
    };
    if local.is_some() && column("zone").is_none() && zone.is_none() {
        return Err(fail(head_line, "time_local needs a column zone, or argument `zone`".into()));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| fail(line_of(e.position()), e.to_string()))?;
        let line = line_of(record.position()).unwrap_or(0);
        let cell = |at: Option<usize>| at.and_then(|i| record.get(i)).filter(|c| !c.is_empty());
        let fail_at = |name: &str, problem: String| fail(Some(line), format!("column {name}: {problem}"));
        let number = |name: &str, low: f64, high: f64| -> Result<Option<f64>> {
            let Some(text) = cell(column(name)) else { return Ok(None) };
            match text.trim_end_matches(['%', '°']).trim().replace('−', "-").parse::<f64>() {
                Ok(v) if (low..=high).contains(&v) => Ok(Some(v)),
                _ => Err(fail_at(name, format!("\"{text}\" is not a number from {low} to {high}"))),
            }
        };
        let own = cell(column("zone")).map(Zone::from_text).transpose().map_err(|e| fail_at("zone", e))?;
        let zone = match (utc, own.or(zone)) {
            (Some(_), _) => Zone::Fixed(0),
            (None, Some(zone)) => zone,
            (None, None) => return Err(fail_at("zone", format!("is empty; accepted are {ZONES}"))),
        };
        let name = if utc.is_some() { "time_utc" } else { "time_local" };
        let stated = cell(Some(time)).ok_or_else(|| fail_at(name, "is empty".into()))?;
        let bare = if utc.is_some() { stated.trim_end_matches(['Z', 'z']) } else { stated };
        let epoch = zone.to_utc(bare).map_err(|e| fail_at(name, e))?;
        let as_utc = Zone::Fixed(0).to_utc(bare).map_err(|e| fail_at(name, e))?;
        let label = match cell(column("label")) {
            None => None,
            Some(text) => Some(
                PaperLabel::from_text(text)
                    .ok_or_else(|| fail_at("label", format!("\"{text}\" is not one of Day, Twilight, Night")))?,
            ),
        };
        rows.push(StatedPass {
            line,
            time: stated.to_owned(),
            epoch,
            clock_ahead_s: (as_utc - epoch).to_seconds(),
            target: cell(Some(target)).ok_or_else(|| fail_at("target", "is empty".into()))?.to_owned(),
            moon_illum_pct: number("moon_illum_pct", 0.0, 100.0)?,
            sun_alt_deg: number("sun_alt_deg", -90.0, 90.0)?,
            label,
            max_v_mag: number("max_v_mag", -30.0, 40.0)?,
            median_v_mag: number("median_v_mag", -30.0, 40.0)?,
        });
    }
    if rows.is_empty() {
        return Err(fail(None, "no rows below the names of the columns".into()));
    }
    let unread = |n: &&String| !COLUMNS.contains(&n.as_str());
    Ok((rows, names.iter().filter(unread).cloned().collect()))
}
