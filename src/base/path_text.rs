//! Paths as text that leads back to the same bytes: in tables, plans, manifests.
//!
//! A file name is bytes, of which few programs make anything but letters. Bytes that are no UTF-8, control characters (a
//! line break or a tab would end a row) and marks of writing direction stand as `%` and two hexadecimal digits each; so does
//! a `%` that two hexadecimal digits follow. Any other name is itself.

use std::borrow::Cow;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serializer};

use super::foreign::shown;

/// A path as text.
#[must_use]
pub fn path_text(path: &Path) -> String {
    let mut text = String::new();
    let escape = |text: &mut String, bytes: &[u8]| bytes.iter().for_each(|b| text.push_str(&format!("%{b:02X}")));
    for chunk in bytes_of(path.as_os_str()).utf8_chunks() {
        let valid = chunk.valid();
        for (at, c) in valid.char_indices() {
            let here = &valid[at..at + c.len_utf8()];
            let looks_escaped = c == '%' && is_escape(&valid.as_bytes()[at..]);
            if looks_escaped || c.is_control() || matches!(shown(here), Cow::Owned(_)) {
                escape(&mut text, here.as_bytes());
            } else {
                text.push(c);
            }
        }
        escape(&mut text, chunk.invalid());
    }
    text
}

/// The path of such a text.
#[must_use]
pub fn path_of(text: &str) -> PathBuf {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let escaped = bytes.get(at..at + 3).filter(|_| is_escape(&bytes[at..]));
        let byte = escaped.and_then(|e| u8::from_str_radix(std::str::from_utf8(&e[1..]).ok()?, 16).ok());
        out.push(byte.unwrap_or(bytes[at]));
        at += if byte.is_some() { 3 } else { 1 };
    }
    PathBuf::from(os_string(out))
}

/// For `#[serde(with = "path_text")]`.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path_text(path))
}

/// For `#[serde(with = "path_text")]`.
///
/// # Errors
/// Those of the deserializer.
pub fn deserialize<'a, D: Deserializer<'a>>(deserializer: D) -> Result<PathBuf, D::Error> {
    Ok(path_of(&String::deserialize(deserializer)?))
}

fn is_escape(bytes: &[u8]) -> bool {
    matches!(bytes, [b'%', a, b, ..] if a.is_ascii_hexdigit() && b.is_ascii_hexdigit())
}

#[cfg(unix)]
fn bytes_of(name: &OsStr) -> &[u8] {
    std::os::unix::ffi::OsStrExt::as_bytes(name)
}

#[cfg(not(unix))]
fn bytes_of(name: &OsStr) -> &[u8] {
    name.as_encoded_bytes()
}

#[cfg(unix)]
fn os_string(bytes: Vec<u8>) -> OsString {
    std::os::unix::ffi::OsStringExt::from_vec(bytes)
}

#[cfg(not(unix))]
fn os_string(bytes: Vec<u8>) -> OsString {
    String::from_utf8_lossy(&bytes).into_owned().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn any_bytes_come_back_and_the_text_is_one_line() {
        let names: [&[u8]; 8] = [
            b"night/frame 1+2=3.fits",
            "Z\u{fc}rich \u{3b4}.fits".as_bytes(),
            b"caf\xe9.fits",
            b"a\tb\nc\r.fits",
            b"100%.fits",
            b"%41%4.fits",
            b"\xff\xfe%FF",
            "\u{202e}stif".as_bytes(),
        ];
        for name in names {
            let path = PathBuf::from(os_string(name.to_vec()));
            let text = path_text(&path);
            assert_eq!(path_of(&text), path, "{text}");
            assert!(!text.contains(char::is_control), "{text}");
        }
        assert_eq!(path_text(Path::new("Z\u{fc}rich 100%.fits")), "Z\u{fc}rich 100%.fits");
        assert_eq!(path_text(Path::new("a\tb%41")), "a%09b%2541");
    }
}
