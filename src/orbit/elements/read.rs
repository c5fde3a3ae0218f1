//! A file of elements, whatever its format and its dress: distinguished by how it begins.
//!
//! Text in UTF-8 or Latin-1, with or without a byte-order mark, lines ended as on Unix, Windows or old Macs. The
//! formats themselves are in [`crate::orbit::tle`], [`crate::orbit::omm`] and [`super::xml`].

use super::set::DamagedSet;
use super::set::ElementsFile;
use super::set::MOST_WARNINGS;
use std::path::Path;

use super::element_names;
use super::set::Elements;
use super::xml;
use crate::base::error::{Error, Result};
use crate::orbit::{omm, tle};

/// Reads the sets for one object: as [`read_elements`], but a damaged set of *another* object is a warning, not an
/// error. All readable sets are returned; which object is meant is `norad`, or the only one of the file.
///
/// # Errors
/// As [`read_elements`] for a damaged set that may be of the object; [`Error::Orbit`] for one of another object where
/// no number says which is meant.
pub fn read_elements_for(path: &Path, norad: Option<u64>) -> Result<(Vec<Elements>, Vec<String>)> {
    let file = parsed(std::fs::read(path).map_err(|e| Error::io(path, e))?, path)?;
    let Some(first) = file.damaged.first() else { return Ok((file.sets, Vec::new())) };
    let Some(number) = norad else {
        let mut known: Vec<String> = file.sets.iter().map(Elements::label).collect();
        known.sort();
        known.dedup();
        if file.sets.is_empty()
            || first.numbers.is_empty()
            || file.sets.iter().any(|s| first.numbers.contains(&s.norad_cat_id()))
        {
            return Err(strict(path, first));
        }
        let numbers: Vec<String> = first.numbers.iter().map(u64::to_string).collect();
        let problem = format!(
            "the file of elements holds several objects, {} and a damaged set of {}; set orbit.norad_cat_id to one of the \
             numbers",
            known.join(", "),
            numbers.join(" or ")
        );
        return Err(Error::Orbit { problem });
    };
    let own: Vec<Elements> = file.sets.iter().filter(|s| s.norad_cat_id() == number).cloned().collect();
    let names = element_names(&own);
    if let Some(ours) = file.damaged.iter().find(|d| d.may_be_of(number, &names)) {
        return Err(strict(path, ours));
    }
    let warning = |d: &DamagedSet| {
        let line = d.line.map(|l| format!(":{l}")).unwrap_or_default();
        format!("{}{line}: {}; it is of another object and is not used", path.display(), d.problem)
    };
    let mut warnings: Vec<String> = file.damaged.iter().take(MOST_WARNINGS).map(warning).collect();
    if file.damaged.len() > MOST_WARNINGS {
        warnings.push(format!("and {} more damaged sets of other objects", file.damaged.len() - MOST_WARNINGS));
    }
    Ok((file.sets, warnings))
}

/// The error of a damaged set.
fn strict(path: &Path, damaged: &DamagedSet) -> Error {
    Error::Table { path: path.to_owned(), line: damaged.line, problem: damaged.problem.clone() }
}

/// Reads every element set of a file: TLE, 3LE (name lines with or without `0 `), OMM JSON, KVN, CSV or XML.
///
/// Blank lines, comments (`#`) and trailing blanks are accepted in TLE files. A damaged set is an error, also among
/// good ones.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] with file, line and what was expected; [`Error::NoInput`] for a file without sets.
pub fn read_elements(path: &Path) -> Result<Vec<Elements>> {
    elements_from_bytes(std::fs::read(path).map_err(|e| Error::io(path, e))?, path)
}

/// Reads what can be read of a file of elements, for those who use every object in it.
///
/// # Errors
/// As [`read_elements`] for a file of which nothing can be read.
pub fn read_elements_file(path: &Path) -> Result<ElementsFile> {
    let file = parsed(std::fs::read(path).map_err(|e| Error::io(path, e))?, path)?;
    match file.damaged.first() {
        Some(damaged) if file.sets.is_empty() => Err(strict(path, damaged)),
        _ => Ok(file),
    }
}

/// As [`read_elements`], from the bytes of a file; `path` is named in errors.
///
/// # Errors
/// Those of [`read_elements`] but [`Error::Io`].
pub fn elements_from_bytes(bytes: Vec<u8>, path: &Path) -> Result<Vec<Elements>> {
    let file = parsed(bytes, path)?;
    match file.damaged.first() {
        Some(damaged) => Err(strict(path, damaged)),
        None => Ok(file.sets),
    }
}

/// The sets of a file, readable or not.
fn parsed(bytes: Vec<u8>, path: &Path) -> Result<ElementsFile> {
    let table = |line, problem| Error::Table { path: path.to_owned(), line, problem };
    let text = text(bytes).map_err(|problem| table(None, problem))?;
    let start = text.trim_start();
    let first = start.lines().find(|l| !l.trim().is_empty() && !l.trim_start().starts_with('#')).unwrap_or_default();
    let file = if start.starts_with(['{', '[']) {
        omm::parse_json(&text)
    } else if start.starts_with('<') {
        xml::parse(&text)
    } else if first.to_ascii_uppercase().contains("NORAD_CAT_ID") && first.contains(',') {
        omm::parse_csv(&text)
    } else if is_kvn(start) {
        omm::parse_kvn(&text)
    } else {
        tle::parse_file(&text)
    }
    .map_err(|(line, problem)| table(line, problem))?;
    if file.sets.is_empty() && file.damaged.is_empty() {
        return Err(Error::NoInput {
            path: path.to_owned(),
            problem: "no element sets in this file; expected TLE, 3LE or OMM JSON".to_owned(),
        });
    }
    Ok(file)
}

/// Whether the first line that is not a comment is a `KEY = value` of an OMM.
fn is_kvn(text: &str) -> bool {
    let said =
        |l: &&str| !l.trim().is_empty() && !l.trim_start().starts_with(['#']) && !l.trim_start().starts_with("COMMENT");
    let key = text.lines().find(said).and_then(|l| l.split_once('=')).map(|(key, _)| key.trim());
    key.is_some_and(|k| !k.is_empty() && k.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_'))
}

/// The text of a file with `\n` at the ends of its lines.
fn text(bytes: Vec<u8>) -> std::result::Result<String, String> {
    if bytes.contains(&0) {
        let what = "not a text file, or one in UTF-16; expected TLE, 3LE or OMM in ASCII or UTF-8: save it as such";
        return Err(what.to_owned());
    }
    // An accent in a name, of an old Windows: every byte is its letter. Lines of elements must be ASCII anyway.
    let text =
        String::from_utf8(bytes).unwrap_or_else(|e| e.as_bytes().iter().map(|b| char::from(*b)).collect::<String>());
    // DOS ends a text with 0x1a.
    let text = text.trim_start_matches('\u{feff}').trim_end_matches('\u{1a}');
    Ok(text.replace("\r\n", "\n").replace('\r', "\n"))
}
