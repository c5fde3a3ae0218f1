//! The hash a table of a shard carries of itself: `rows_sha256` in its meta block.
//!
//! SHA-256 over every byte of the file but the line of the hash, 16 hexadecimal digits. A table that was edited, cut off or
//! damaged is found out before its rows enter a sum. It does not protect against somebody who computes the hash again.

use std::path::Path;

use super::meta::Meta;
use crate::base::error::{Error, Result};
use crate::base::hash::sha256_16_of;

/// Key of the hash in the meta block.
pub(super) const KEY: &str = "rows_sha256";

impl Meta {
    /// Lets the table that is written with this meta block carry the hash of its rows.
    pub fn with_rows_hash(&mut self) {
        self.set(KEY, "");
    }

    /// Leaves the hash out: that of the rows these were read with says nothing of others.
    pub fn without_rows_hash(&mut self) {
        self.entries.retain(|(key, _)| key != KEY);
    }

    /// Whether the table carries the hash of its rows.
    #[must_use]
    pub fn has_rows_hash(&self) -> bool {
        self.get(KEY).is_some()
    }
}

/// The line of the meta block that holds the hash.
fn line(hash: &str) -> String {
    let mut meta = Meta::default();
    meta.push(KEY, hash);
    meta.to_lines().iter().map(|line| format!("# {line}\n")).collect()
}

/// The text of a table with the hash in its place, whatever hash its meta block was read with.
pub(super) fn with_hash(text: &str, meta: &Meta) -> String {
    let read = meta.entries.iter().find(|(key, _)| key == KEY).cloned();
    let read = Meta { entries: read.into_iter().collect() };
    let old: String = read.to_lines().iter().map(|line| format!("# {line}\n")).collect();
    let Some((before, after)) = text.split_once(&old).filter(|_| !old.is_empty()) else { return text.into() };
    let hash = sha256_16_of([before.as_bytes(), after.as_bytes()]);
    format!("{before}{}{after}", line(&hash))
}

/// Whether a line of the header names the hash, also where damage before it ends the meta block.
///
/// # Errors
/// [`Error::Io`].
pub fn names_rows_hash(path: &Path) -> Result<bool> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let mut header = bytes.split(|b| *b == b'\n').take_while(|line| line.starts_with(b"#"));
    Ok(header.any(|line| line.windows(KEY.len()).any(|word| word == KEY.as_bytes())))
}

/// Whether the rows of a table are those it was written with.
///
/// # Errors
/// [`Error::Mismatch`] for a table that was changed, or states no hash; [`Error::Io`].
pub fn check_rows_hash(path: &Path) -> Result<()> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let wrong = |what: &str| Error::Mismatch {
        problem: format!("{}: {what}; measure or compute its shard again with argument `force`", path.display()),
    };
    let begins = format!("# - {{{KEY}: ").into_bytes();
    let mut at = 0;
    for piece in bytes.split_inclusive(|b| *b == b'\n') {
        if piece.starts_with(&begins) {
            let hash = sha256_16_of([&bytes[..at], &bytes[at + piece.len()..]]);
            let unchanged = piece == line(&hash).as_bytes();
            return if unchanged { Ok(()) } else { Err(wrong("was changed after it was written (rows_sha256)")) };
        }
        if !piece.starts_with(b"#") {
            break;
        }
        at += piece.len();
    }
    Err(wrong("states no hash of its rows (rows_sha256): it was changed, or is of an older version"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_whose_bytes_are_changed_anywhere_is_found_out() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("shard.ecsv");
        let mut meta = Meta::default();
        meta.with_rows_hash();
        let bare = format!("# %ECSV 1.0\n# meta: !!omap\n# - {{schema: x}}\n{}a,b\n1,2\n3,4\n", line(""));
        let text = with_hash(&bare, &meta);
        // a table that is written with the meta block of another has the hash of its own rows
        let mut of_another = Meta::default();
        of_another.push(KEY, "0123456789012345");
        assert_eq!(with_hash(&bare.replace(&line(""), &line("0123456789012345")), &of_another), text);
        std::fs::write(&path, &text).unwrap();
        check_rows_hash(&path).unwrap();
        for k in 0..text.len() {
            let mut bytes = text.clone().into_bytes();
            bytes[k] ^= 1;
            std::fs::write(&path, &bytes).unwrap();
            let error = check_rows_hash(&path).unwrap_err().to_string();
            assert!(error.contains("rows_sha256") && error.contains("shard.ecsv"), "byte {k}: {error}");
            std::fs::write(&path, &text.as_bytes()[..k]).unwrap();
            assert!(check_rows_hash(&path).is_err(), "cut off at byte {k}");
        }
    }
}
