//! A file of elements, whatever its format and its dress: told apart by how it begins.
//!
//! Text in UTF-8 or Latin-1, with or without a byte-order mark, lines ended as on Unix, Windows or old Macs. The formats
//! themselves are in [`crate::orbit::tle`], [`crate::orbit::omm`] and [`super::xml`].

use std::path::Path;

use super::{Elements, xml};
use crate::error::{Error, Result};
use crate::orbit::{omm, tle};

/// Reads every element set of a file: TLE, 3LE (name lines with or without `0 `), OMM JSON, KVN, CSV or XML.
///
/// Blank lines, comments (`#`) and trailing blanks are accepted in TLE files. A damaged set is an error, also among good
/// ones.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] with file, line and what was expected; [`Error::NoInput`] for a file without sets.
pub fn read_elements(path: &Path) -> Result<Vec<Elements>> {
    elements_from_bytes(std::fs::read(path).map_err(|e| Error::io(path, e))?, path)
}

/// As [`read_elements`], from the bytes of a file; `path` is named in errors.
///
/// # Errors
/// Those of [`read_elements`] but [`Error::Io`].
pub fn elements_from_bytes(bytes: Vec<u8>, path: &Path) -> Result<Vec<Elements>> {
    let table = |line, problem| Error::Table { path: path.to_owned(), line, problem };
    let text = text(bytes).map_err(|problem| table(None, problem))?;
    let start = text.trim_start();
    let first = start.lines().find(|l| !l.trim().is_empty() && !l.trim_start().starts_with('#')).unwrap_or_default();
    let sets = if start.starts_with(['{', '[']) {
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
    if sets.is_empty() {
        return Err(Error::NoInput {
            path: path.to_owned(),
            problem: "no element sets in this file; expected TLE, 3LE or OMM JSON".to_owned(),
        });
    }
    Ok(sets)
}

/// Whether the first line that is no comment is a `KEY = value` of an OMM.
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
