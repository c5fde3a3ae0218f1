//! Orbit mean-elements messages (CCSDS 502.0-B): JSON, KVN and CSV, all through one table of keys.
//!
//! Keys as CCSDS names them. Bookkeeping keys may be missing; those the orbit is made of may not. XML is in
//! [`super::elements`].

use serde_json::{Map, Value};

use super::elements::set::Problem;
use super::elements::{DamagedSet, Elements, ElementsFile};
use crate::base::instant;
use crate::base::instant::Instant;

/// Keys that do not enter the orbit, with what stands for a missing one.
const BOOKKEEPING: [(&str, &str); 6] = [
    ("CLASSIFICATION_TYPE", "U"),
    ("EPHEMERIS_TYPE", "0"),
    ("ELEMENT_SET_NO", "999"),
    ("REV_AT_EPOCH", "0"),
    ("MEAN_MOTION_DOT", "0"),
    ("MEAN_MOTION_DDOT", "0"),
];
/// Keys the orbit is made of.
const NEEDED: [&str; 9] = [
    "NORAD_CAT_ID",
    "EPOCH",
    "MEAN_MOTION",
    "ECCENTRICITY",
    "INCLINATION",
    "RA_OF_ASC_NODE",
    "ARG_OF_PERICENTER",
    "MEAN_ANOMALY",
    "BSTAR",
];
/// Statements about the orbit that must hold where they are made.
const STATED: [(&str, &[&str]); 4] = [
    ("CENTER_NAME", &["EARTH"]),
    ("REF_FRAME", &["TEME"]),
    ("TIME_SYSTEM", &["UTC"]),
    ("MEAN_ELEMENT_THEORY", &["SGP4", "SGP/SGP4", "SGP"]),
];

/// JSON: one object, an array of objects, or objects one after another.
pub(super) fn parse_json(text: &str) -> Result<ElementsFile, Problem> {
    let mut items = Vec::new();
    for value in serde_json::Deserializer::from_str(text).into_iter::<Value>() {
        match value.map_err(|e| (Some(e.line()), format!("not valid JSON: {e}")))? {
            Value::Array(more) => items.extend(more),
            other => items.push(other),
        }
    }
    let mut file = ElementsFile::default();
    for (i, item) in items.into_iter().enumerate() {
        let Value::Object(map) = item else {
            return Err((None, format!("element set {}: expected an object in braces", i + 1)));
        };
        let map = map.into_iter().map(|(k, v)| (k.to_ascii_uppercase(), v)).collect();
        add_set(&mut file, map, "OMM JSON", None, &format!("element set {}: ", i + 1));
    }
    Ok(file)
}

/// Adds one set from its keys, or what is wrong with it.
pub(super) fn add_set(
    file: &mut ElementsFile,
    map: Map<String, Value>,
    format: &'static str,
    line: Option<usize>,
    at: &str,
) {
    let text = |key: &str| map.get(key).map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned));
    let number =
        text("NORAD_CAT_ID").and_then(|t| t.trim().parse::<f64>().ok()).filter(|n| n.fract() == 0.0 && *n >= 0.0);
    let (numbers, name) = (number.map(|n| n as u64).into_iter().collect(), text("OBJECT_NAME").unwrap_or_default());
    match from_map(map, format) {
        Ok(set) => file.sets.push(set),
        Err(problem) => file.damaged.push(DamagedSet { line, problem: format!("{at}{problem}"), numbers, name }),
    }
}

/// KVN: `KEY = value` lines; each `CCSDS_OMM_VERS` begins a set, and so does a key that stood already.
pub(super) fn parse_kvn(text: &str) -> Result<ElementsFile, Problem> {
    let mut sets: Vec<(usize, Map<String, Value>)> = Vec::new();
    for (i, raw) in text.lines().enumerate() {
        let line = raw.trim();
        if line.is_empty() || line.starts_with("COMMENT") || line.starts_with('#') {
            continue;
        }
        let (key, value) =
            line.split_once('=').ok_or_else(|| (Some(i + 1), format!("expected KEY = value, found \"{line}\"")))?;
        let (key, value) = (key.trim().to_ascii_uppercase(), value.split('[').next().unwrap_or("").trim().to_owned());
        if key.starts_with("USER_DEFINED") {
            continue;
        }
        if key == "CCSDS_OMM_VERS" || sets.last().is_none_or(|(_, map)| map.contains_key(&key)) {
            sets.push((i + 1, Map::new()));
        }
        if let Some((_, map)) = sets.last_mut() {
            map.insert(key, Value::String(value));
        }
    }
    let mut file = ElementsFile::default();
    sets.into_iter().for_each(|(line, map)| add_set(&mut file, map, "OMM KVN", Some(line), ""));
    Ok(file)
}

/// CSV with a header row, as CelesTrak writes it.
pub(super) fn parse_csv(text: &str) -> Result<ElementsFile, Problem> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let at = |e: &csv::Error| e.position().map(|p| p.line() as usize);
    let header = reader.headers().map_err(|e| (at(&e), e.to_string()))?.clone();
    let mut file = ElementsFile::default();
    for record in reader.records() {
        let record = record.map_err(|e| (at(&e), e.to_string()))?;
        let line = record.position().map(|p| p.line() as usize);
        let map: Map<String, Value> =
            header.iter().zip(&record).map(|(k, v)| (k.to_ascii_uppercase(), Value::String(v.to_owned()))).collect();
        if record.len() != header.len() {
            let text = |key: &str| map.get(key).and_then(Value::as_str).unwrap_or_default();
            file.damaged.push(DamagedSet {
                line,
                problem: format!("the row has {} fields, the header {}: it was cut", record.len(), header.len()),
                numbers: text("NORAD_CAT_ID").parse().into_iter().collect(),
                name: text("OBJECT_NAME").to_owned(),
            });
            continue;
        }
        add_set(&mut file, map, "OMM CSV", line, "");
    }
    Ok(file)
}

/// One set from its keys.
fn from_map(mut map: Map<String, Value>, format: &'static str) -> Result<Elements, String> {
    for value in map.values_mut() {
        if let Value::String(s) = value {
            *s = s.trim().to_owned();
        }
    }
    map.retain(|_, v| !v.is_null() && v.as_str() != Some(""));
    let label =
        |key: &str| map.get(key).map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned)).unwrap_or_default();
    let who = format!("{} [{}]", label("OBJECT_NAME"), label("NORAD_CAT_ID"));
    if let Some(key) = NEEDED.iter().find(|k| !map.contains_key(**k)) {
        return Err(format!("{who}: {key} is missing"));
    }
    for (key, accepted) in STATED {
        let stated = label(key).to_uppercase();
        if !stated.is_empty() && !accepted.contains(&stated.as_str()) {
            return Err(format!("{who}: {key} is {stated}, expected {}", accepted.join(" or ")));
        }
    }
    let epoch = canonical_epoch(&label("EPOCH")).map_err(|p| format!("{who}: EPOCH: {p}"))?;
    map.insert("EPOCH".to_owned(), Value::String(epoch));
    for (key, stand_in) in BOOKKEEPING {
        map.entry(key).or_insert_with(|| Value::String(stand_in.to_owned()));
    }
    for key in ["ELEMENT_SET_NO", "REV_AT_EPOCH", "EPHEMERIS_TYPE", "NORAD_CAT_ID"] {
        whole(&mut map, key).map_err(|p| format!("{who}: {key}: {p}"))?;
    }
    let inner: sgp4::Elements = serde_json::from_value(Value::Object(map.clone())).map_err(|e| {
        let key = first_bad_number(&map).unwrap_or_default();
        format!("{who}: {key}{e}")
    })?;
    Elements::new(inner, format).map_err(|p| format!("{who}: {p}"))
}

/// A whole number written as `5.0` or `" 5"` becomes 5.
fn whole(map: &mut Map<String, Value>, key: &str) -> Result<(), String> {
    let Some(value) = map.get(key) else { return Ok(()) };
    let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let number: f64 = text.parse().map_err(|_| format!("\"{text}\" is not a whole number"))?;
    if !(number >= 0.0 && number.fract() == 0.0 && number < 1e15) {
        return Err(format!("{text} is not a whole number"));
    }
    map.insert(key.to_owned(), Value::from(number as u64));
    Ok(())
}

/// Names the first needed key whose value is not a number, for the message.
fn first_bad_number(map: &Map<String, Value>) -> Option<String> {
    NEEDED.iter().filter(|k| **k != "EPOCH").find_map(|k| {
        let value = map.get(*k)?;
        let good = value.is_number() || value.as_str().is_some_and(|s| s.parse::<f64>().is_ok());
        (!good).then(|| format!("{k} = {value}: "))
    })
}

/// `YYYY-MM-DDTHH:MM:SS.f` from any epoch CCSDS allows: trailing Z, blank for T, day of year, no fraction; and from one with
/// an offset from UTC.
fn canonical_epoch(text: &str) -> Result<String, String> {
    let bad = || format!("\"{text}\" is not an ISO date and time");
    let is_utc = text.ends_with(['Z', 'z']);
    if let Ok(Instant { epoch, has_zone: true, is_date_only: false }) = instant::read(text)
        && !is_utc
    {
        let (y, mo, d, h, mi, s, ns) = epoch.to_gregorian_utc();
        return Ok(format!("{y:04}-{mo:02}-{d:02}T{h:02}:{mi:02}:{s:02}.{ns:09}"));
    }
    let (date, clock) = text.trim_end_matches(['Z', 'z']).split_once(['T', ' ']).ok_or_else(bad)?;
    let fields: Vec<&str> = date.split('-').collect();
    let date = match fields[..] {
        [_, _, _] => date.to_owned(),
        [year, day_of_year] => {
            let (year, ordinal): (i32, u32) =
                (year.parse().map_err(|_| bad())?, day_of_year.parse().map_err(|_| bad())?);
            sgp4::chrono::NaiveDate::from_yo_opt(year, ordinal).ok_or_else(bad)?.to_string()
        }
        _ => return Err(bad()),
    };
    Ok(format!("{date}T{}", clock.trim()))
}
