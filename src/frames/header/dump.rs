//! A header from wherever it is: a FITS file, one without an image, or text that was pasted.
//!
//! It does not cover what the keywords mean.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::fits::cards::Header;
use crate::fits::files::find_files;
use crate::fits::open;

/// Longest text or bare header that is read \[bytes\].
const MAX_BYTES: u64 = 4 << 20;
const CARD: usize = 80;
/// Folders within folders.
const MAX_DEPTH: usize = 20;

/// A header, what it is from, and why its image cannot be read.
#[derive(Debug)]
pub struct AnyHeader {
    /// The cards.
    pub header: Header,
    /// `FITS` or `header text`.
    pub kind: &'static str,
    /// The image cannot be read: truncated, not 2-D, absent.
    pub problem: Option<Error>,
}

/// Reads a FITS file's header, or cards as text: lines of up to 80 characters, one long line, or `KEY = value`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Fits`] for what is neither.
pub fn read_any(path: &Path) -> Result<AnyHeader> {
    let mut bytes = Vec::new();
    let file = open(path)?;
    file.take(MAX_BYTES).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    match Header::read(path) {
        Ok(header) => Ok(AnyHeader { header, kind: "FITS", problem: None }),
        Err(error @ Error::Io { .. }) => Err(error),
        Err(error) => {
            if let Some(header) = bare_header(&bytes) {
                return Ok(AnyHeader { header, kind: "FITS", problem: Some(error) });
            }
            match text_header(&bytes) {
                Some(header) => Ok(AnyHeader { header, kind: "header text", problem: None }),
                None if bytes.starts_with(b"SIMPLE  =") => Err(error),
                None => Err(Error::Fits {
                    path: path.to_path_buf(),
                    problem: "neither a FITS file nor the text of a header (KEYWORD = value)".into(),
                }),
            }
        }
    }
}

/// A file as it is; of a folder (recursively) its FITS files and the texts that are headers, sorted.
///
/// # Errors
/// [`Error::NoInput`] for a folder that holds neither. A single file is not looked at.
pub fn header_files(input: &Path) -> Result<Vec<PathBuf>> {
    if !input.is_dir() {
        return Ok(vec![input.to_path_buf()]);
    }
    let mut found = find_files(&[input.to_path_buf()]).unwrap_or_default();
    let mut folders = vec![(input.to_path_buf(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.filter_map(|e| Some(e.ok()?.path())) {
            let name = path.file_name().map(|n| n.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
            let text = [".txt", ".hdr", ".head", ".header"].iter().any(|e| name.ends_with(e));
            let link = path.symlink_metadata().is_ok_and(|m| m.is_symlink());
            if path.is_dir() && !link && depth < MAX_DEPTH && !name.starts_with('.') {
                folders.push((path, depth + 1));
            } else if text && !name.starts_with('.') && read_any(&path).is_ok() {
                found.push(path);
            }
        }
    }
    found.sort();
    if found.is_empty() {
        let problem = "no FITS file (*.fit, *.fits, *.fts, *.fits.fz) and no header as text (*.txt, *.hdr) here".into();
        return Err(Error::NoInput { path: input.to_path_buf(), problem });
    }
    Ok(found)
}

/// The first header of a FITS file, whatever follows it.
fn bare_header(bytes: &[u8]) -> Option<Header> {
    if !bytes.starts_with(b"SIMPLE  =") {
        return None;
    }
    let mut text = String::new();
    for card in bytes.chunks_exact(CARD) {
        if card.iter().any(|b| *b < 0x20) {
            return None; // line breaks: text
        }
        if card.trim_ascii_end() == b"END" {
            return Some(Header::from_text(&text));
        }
        text.extend(card.iter().map(|b| if b.is_ascii() { *b as char } else { '?' }));
    }
    None
}

/// Cards as text; `None` if fewer than three lines are cards.
fn text_header(bytes: &[u8]) -> Option<Header> {
    if bytes.contains(&0) {
        return None;
    }
    let text: String = String::from_utf8_lossy(bytes).chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    let mut lines = Vec::new();
    for line in text.lines() {
        let line = line.trim_end();
        if line.trim() == "END" {
            break;
        }
        if line.len() > CARD && line.as_bytes().get(CARD + 8) == Some(&b'=') {
            // cards without line breaks
            lines.extend(line.as_bytes().chunks(CARD).map(|c| String::from_utf8_lossy(c).into_owned()));
        } else {
            lines.push(fixed(line));
        }
    }
    let is_card = |l: &&String| l.as_bytes().get(8) == Some(&b'=') || l.starts_with("HIERARCH ");
    (lines.iter().filter(is_card).count() >= 3).then(|| Header::from_text(&lines.join("\n")))
}

/// `EXPTIME = 30 / s` as a card; a card as it is, 80 columns of it.
fn fixed(line: &str) -> String {
    let card = |l: &str| l.chars().take(CARD).collect::<String>();
    let word = line.get(..8).unwrap_or_default().trim_end();
    if line.as_bytes().get(8) == Some(&b'=') || matches!(word, "HIERARCH" | "COMMENT" | "HISTORY" | "CONTINUE") {
        return card(line);
    }
    let Some((key, value)) = line.split_once('=') else { return card(line) };
    let key = key.trim();
    let keyword = !key.is_empty() && key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_');
    match (keyword, key.len()) {
        (true, 1..=8) => card(&format!("{:<8}= {}", key.to_ascii_uppercase(), value.trim())),
        (true, _) => card(&format!("HIERARCH {key} = {}", value.trim())),
        _ => card(line),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pasted_headers_are_read_with_and_without_columns() {
        let columns = "SIMPLE  =                    T / x\nEXPTIME =                 30.0 / s\nGAIN    =  120\nEND\nOBJECT  = 'no'\n";
        let h = text_header(columns.as_bytes()).unwrap();
        assert_eq!((h.number("EXPTIME"), h.text("OBJECT")), (Some(30.0), None));
        let loose = "EXPTIME = 30.0 / s\r\nGAIN=120\r\nDATE-OBS='2025-06-09T10:33:00.5' / start\r\n";
        let h = text_header(loose.as_bytes()).unwrap();
        assert_eq!((h.number("EXPTIME"), h.integer("GAIN")), (Some(30.0), Some(120)));
        assert_eq!(h.text("DATE-OBS").as_deref(), Some("2025-06-09T10:33:00.5"));
        let one_line: String = columns.lines().map(|l| format!("{l:<80}")).collect();
        assert_eq!(text_header(one_line.as_bytes()).unwrap().number("EXPTIME"), Some(30.0));
        assert!(text_header(b"clouds all night\n").is_none() && text_header(b"\0\0=").is_none());
    }

    #[test]
    fn a_header_without_an_image_is_still_a_header() {
        let cards = [
            "SIMPLE  =                    T",
            "NAXIS   =                    0",
            "EXPTIME =                 2.0",
            "END",
        ];
        let block: String = cards.iter().map(|c| format!("{c:<80}")).collect();
        assert_eq!(bare_header(block.as_bytes()).unwrap().number("EXPTIME"), Some(2.0));
    }
}
