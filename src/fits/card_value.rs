//! A header card that is written: keyword, value, comment.

use std::fmt::Write as _;

/// The value of a card to be written. A `Text` under the keyword HISTORY or COMMENT becomes such lines.
#[derive(Debug, Clone, PartialEq)]
pub enum CardValue {
    /// A string, of any length.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A finite real number, written so that it reads back exactly.
    Real(f64),
    /// T or F.
    Logical(bool),
}

impl From<&str> for CardValue {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<&String> for CardValue {
    fn from(text: &String) -> Self {
        Self::Text(text.clone())
    }
}

impl From<f64> for CardValue {
    fn from(value: f64) -> Self {
        Self::Real(value)
    }
}

impl From<i64> for CardValue {
    fn from(value: i64) -> Self {
        Self::Integer(value)
    }
}

impl From<bool> for CardValue {
    fn from(value: bool) -> Self {
        Self::Logical(value)
    }
}

/// Keyword, value and comment of a card.
pub type CardLine = (String, CardValue, String);

/// A card from its parts.
pub fn card(key: &str, value: impl Into<CardValue>, comment: &str) -> CardLine {
    (key.into(), value.into(), comment.into())
}

/// Text as the printable ASCII of a FITS file: every other character, and the backslash, as its JSON escape (`\u00e9`, `\\`).
#[must_use]
pub fn ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            c => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    // Writing to a String cannot fail.
                    let _ = write!(out, "\\u{unit:04x}");
                }
            }
        }
    }
    out
}
