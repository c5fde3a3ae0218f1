//! What a column is stands in two places: in the schema, for the readers of the files, and at the field of its row, for the
//! readers of the code. Both say the same, in words and in units.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use satphot::tables::Column;
use satphot::tables::columns::{ACCURACY, EXTREMES, PHOTOMETRY, RESIDUALS, SKY, STARS};

const ROWS: &str = include_str!("../../src/tables/rows.rs");

/// The columns of each struct of `rows.rs`.
const TABLES: [(&str, &[Column]); 6] = [
    ("PhotometryRow", PHOTOMETRY),
    ("StarRow", STARS),
    ("ResidualRow", RESIDUALS),
    ("SkyRow", SKY),
    ("AccuracyRow", ACCURACY),
    ("ExtremeRow", EXTREMES),
];

/// Units as the schema spells them and as comments do, where these differ.
const UNITS: [(&str, &str); 9] = [
    ("pix", "px"),
    ("electron", "e⁻"),
    ("electron / adu", "e⁻/ADU"),
    ("electron / pix", "e⁻/px"),
    ("arcsec / pix", "arcsec/px"),
    ("mag / arcsec2", "mag/arcsec²"),
    ("deg / s", "deg/s"),
    ("us", "µs"),
    ("kbyte", "kB"),
];

/// Name and comment of every field of a struct.
fn fields(source: &str, name: &str) -> Vec<(String, String)> {
    let body = source.split_once(&format!("pub struct {name} {{\n")).expect(name).1.split_once("\n}").expect(name).0;
    let (mut found, mut comment) = (Vec::new(), Vec::new());
    for line in body.lines().map(str::trim) {
        if let Some(words) = line.strip_prefix("///") {
            comment.push(words.trim().to_owned());
        } else if let Some((field, _)) = line.strip_prefix("pub ").and_then(|rest| rest.split_once(':')) {
            found.push((field.to_owned(), std::mem::take(&mut comment).join(" ")));
        }
    }
    found
}

/// The comment that a column asks for: its description with a capital letter, its unit, a full stop.
fn comment_of(column: &Column) -> String {
    let unit = UNITS.iter().find(|(schema, _)| *schema == column.unit).map_or(column.unit, |(_, comment)| *comment);
    let unit = if unit.is_empty() { String::new() } else { format!(" \\[{unit}\\]") };
    format!("{}{unit}.", column.description)
}

/// The first letter of a sentence may be a capital or belong to a name: `flux_e / flux_err_e.`
fn same(comment: &str, wanted: &str) -> bool {
    let (mut a, mut b) = (comment.chars(), wanted.chars());
    let first = a.next().zip(b.next()).is_some_and(|(a, b)| a == b || a.eq_ignore_ascii_case(&b));
    first && a.as_str() == b.as_str()
}

/// What disagrees between the comments of a struct and its columns.
fn disagreements(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (name, columns) in TABLES {
        let fields = fields(source, name);
        assert_eq!(fields.len(), columns.len(), "{name}");
        for ((field, comment), column) in fields.iter().zip(columns) {
            assert_eq!(field, column.name, "{name}");
            let wanted = comment_of(column);
            if !same(comment, &wanted) {
                found.push(format!("{name}.{field}\n  rows.rs:    {comment}\n  columns.rs: {wanted}"));
            }
        }
    }
    found
}

#[test]
fn every_field_of_a_row_says_what_its_column_says_in_the_same_words_and_unit() {
    let found = disagreements(ROWS);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_word_or_a_unit_that_differs_is_found() {
    for (from, to) in [
        ("/// Number of the star pointing, from 0.", "/// Number of the star pointing, from 1."),
        ("/// Exposure time \\[s\\].", "/// Exposure time \\[ms\\]."),
        ("/// Distance from the observer \\[km\\].", "/// Distance from the observer."),
    ] {
        assert!(ROWS.contains(from), "{from}");
        assert!(!disagreements(&ROWS.replacen(from, to, 1)).is_empty(), "{to}");
    }
}

#[test]
fn a_name_has_one_unit_in_all_tables() {
    let all: Vec<&Column> = TABLES.iter().flat_map(|(_, columns)| columns.iter()).collect();
    for a in &all {
        for b in all.iter().filter(|b| b.name == a.name) {
            assert_eq!((a.unit, a.datatype), (b.unit, b.datatype), "{}", a.name);
        }
    }
}
