//! Text that others wrote: file names, names of objects, values of headers and configurations, made safe to show.
//!
//! One function for each place it may do harm: a terminal, a spreadsheet, an address with a password. HTML is escaped
//! where it is written.

use std::borrow::Cow;

/// Whether a character does something to a terminal or to the order of letters instead of being one: controls but line
/// breaks and tabs, and the marks of writing from right to left.
fn commands(c: char) -> bool {
    let control = c.is_control() && !matches!(c, '\n' | '\t');
    control || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A text for a terminal or a log: what would command the terminal stands as its number, `\u001b`,
/// which JSON and TOML read as the same character.
#[must_use]
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(commands) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if commands(c) {
            out += &format!("\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
    }
    out.into()
}

/// A text as a cell of a table for spreadsheets: one that would be a formula there gets an apostrophe in front.
///
/// For texts alone: the number `-1.5` begins with a sign too.
#[must_use]
pub fn cell(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}").into() } else { text.into() }
}

/// An address without the name and the password of its user.
#[must_use]
pub fn without_user(url: &str) -> Cow<'_, str> {
    let Some((scheme, rest)) = url.split_once("://") else { return url.into() };
    let end = rest.find(['/', '?', '#']).unwrap_or(rest.len());
    match rest[..end].rfind('@') {
        Some(at) => format!("{scheme}://{}", &rest[at + 1..]).into(),
        None => url.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_and_marks_of_direction_are_numbers_and_letters_stay() {
        assert_eq!(shown("a\u{1b}]0;x\u{7}\u{9b}31m\u{202e}b\r"), r"a\u001b]0;x\u0007\u009b31m\u202eb\u000d");
        for text in ["Zürich\tδ 1998-067A\n", "שלום", "", "-1.5"] {
            assert!(matches!(shown(text), Cow::Borrowed(same) if same == text));
        }
    }

    #[test]
    fn formulas_are_texts_and_texts_stay() {
        for (text, wanted) in [("=1+1", "'=1+1"), ("@SUM(A1)", "'@SUM(A1)"), ("+x", "'+x"), ("ISS", "ISS"), ("", "")] {
            assert_eq!(cell(text), wanted);
        }
    }

    #[test]
    fn an_address_loses_its_user_and_nothing_else() {
        for (url, wanted) in [
            ("https://me:secret@example.org/a@b", "https://example.org/a@b"),
            ("https://token@example.org:8443", "https://example.org:8443"),
            ("http://a:b@c@example.org/", "http://example.org/"),
            ("https://example.org/~a@b/", "https://example.org/~a@b/"),
            ("no address", "no address"),
        ] {
            assert_eq!(without_user(url), wanted);
        }
    }
}
