//! What an answer holds, reported by satphot's own readers: data, nothing, "not updated", or rubbish with a word about
//! it.
//!
//! It does not cover the stars, whose tables are in [`super::apass`].

use std::path::Path;

use serde_json::Value;

use crate::orbit::{Elements, elements_from_bytes};

/// What a reply with status 200 holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content {
    /// What was requested.
    Data,
    /// The service has nothing; its words.
    Nothing(String),
    /// The service has nothing newer than what it gave before.
    NotUpdated,
}

impl Content {
    /// CelesTrak's answer to a repeated question within its update period.
    pub fn not_updated(body: &[u8]) -> bool {
        String::from_utf8_lossy(&body[..body.len().min(400)]).contains("has not updated since your last")
    }
}

/// The first words of an answer, for messages: what came instead of what was requested.
#[must_use]
pub fn words(body: &[u8]) -> String {
    let start = String::from_utf8_lossy(&body[..body.len().min(2_000)]);
    let low = start.trim_start().to_ascii_lowercase();
    if body.iter().all(u8::is_ascii_whitespace) {
        return "an empty answer".into();
    }
    if low.starts_with("<!doctype html") || low.starts_with("<html") {
        let title = low.find("<title>").and_then(|a| {
            let rest = &start.trim_start()[a + 7..];
            Some(shown(rest.split('<').next()?))
        });
        return format!("a page in HTML{}", title.map(|t| format!(" ({t})")).unwrap_or_default());
    }
    if body.contains(&0) || start.matches('\u{fffd}').count() > 3 {
        return format!("{} bytes that are not text", body.len());
    }
    format!("\"{}\"", shown(&start))
}

/// A text on one line, 120 letters of it, without what a terminal would obey.
fn shown(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let plain: String = line.chars().filter(|c| !c.is_control()).collect();
    let short: String = plain.chars().take(120).collect();
    if short.len() < plain.len() { format!("{short}…") } else { short }
}

/// Elements of CelesTrak: OMM in JSON, or TLE.
pub fn check_gp(body: &[u8]) -> std::result::Result<Content, String> {
    if Content::not_updated(body) {
        return Ok(Content::NotUpdated);
    }
    let text = String::from_utf8_lossy(body);
    let bare = text.trim();
    if bare.starts_with("No GP data found") || bare == "[]" {
        return Ok(Content::Nothing(words(body)));
    }
    gp_sets(body).map(|_| Content::Data)
}

/// The sets of a CelesTrak answer.
pub fn gp_sets(body: &[u8]) -> std::result::Result<Vec<Elements>, String> {
    let known = body.iter().find(|b| !b.is_ascii_whitespace()).is_some_and(|b| !matches!(b, b'<'));
    if !known {
        return Err(format!("not elements but {}", words(body)));
    }
    elements_from_bytes(body.to_vec(), Path::new("answer"))
        .map_err(|e| format!("not elements ({e}) but {}", words(body)))
}

/// Elements of SatChecker.
pub fn check_nearest(body: &[u8]) -> std::result::Result<Content, String> {
    match nearest_sets(body)? {
        sets if sets.is_empty() => Ok(Content::Nothing("no orbital data".into())),
        _ => Ok(Content::Data),
    }
}

/// A set of SatChecker with the text of a file that holds it alone.
#[derive(Debug, Clone)]
pub struct NearestSet {
    /// The set.
    pub elements: Elements,
    /// Its file: three lines, or OMM in JSON.
    pub text: String,
}

/// The sets of a SatChecker answer: `[{"orbital_data": [{"satellite_name", "tle_line1", "tle_line2"}]}]`, or
/// `"orbital_elements"` with the keys of an OMM; before version 1.7 the list was called `tle_data`.
///
/// # Source
/// SatChecker, "Orbital Data Access".
pub fn nearest_sets(body: &[u8]) -> std::result::Result<Vec<NearestSet>, String> {
    let wrong = |what: &str| format!("not elements ({what}) but {}", words(body));
    let value: Value = serde_json::from_slice(body).map_err(|e| wrong(&e.to_string()))?;
    let outer = match value {
        Value::Array(outer) => outer,
        object @ Value::Object(_) => vec![object],
        _ => return Err(wrong("expected a list")),
    };
    let mut sets = Vec::new();
    for item in &outer {
        let records = ["orbital_data", "tle_data", "data"].iter().find_map(|key| item.get(key));
        let records = records.and_then(Value::as_array).ok_or_else(|| wrong("orbital_data is missing"))?;
        for record in records {
            sets.push(nearest_set(record).map_err(|problem| wrong(&problem))?);
        }
    }
    Ok(sets)
}

fn nearest_set(record: &Value) -> std::result::Result<NearestSet, String> {
    let text = |key: &str| record.get(key).and_then(Value::as_str).map(str::trim);
    let file = match (text("tle_line1"), text("tle_line2"), record.get("orbital_elements")) {
        (Some(line1), Some(line2), _) => {
            let name = text("satellite_name").map(|n| format!("{n}\n")).unwrap_or_default();
            format!("{name}{line1}\n{line2}\n")
        }
        (_, _, Some(elements @ Value::Object(_))) => format!("[{elements}]\n"),
        _ => return Err("neither tle_line1 and tle_line2 nor orbital_elements".into()),
    };
    let sets = elements_from_bytes(file.clone().into_bytes(), Path::new("answer")).map_err(|e| e.to_string())?;
    match sets.as_slice() {
        [elements] => Ok(NearestSet { elements: elements.clone(), text: file }),
        _ => Err(format!("{} sets in one record", sets.len())),
    }
}
