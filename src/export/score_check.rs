//! Whether SCORE would take a file: its form, line by line, before the rules of each column ([`super::score_rules`]).
//!
//! Every finding names row, column, value and remedy. A warning is what the server takes but the observer may not mean.
//! Source: the server's upload task, models and forms (github.com/iausathub/score, 2025). It does not cover what needs
//! the network: whether name and number belong together, and whether the satellite was above the horizon.

use std::collections::HashSet;
use std::fmt;

use super::score_form::HEADER;
use super::score_rules::check_row;

/// One thing that is wrong, or odd.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Row below the header, from 1; none for the header and the file.
    pub row: Option<usize>,
    /// Line of the file, from 1.
    pub line: usize,
    /// Column, or nothing where it is about the whole line.
    pub column: String,
    /// What stands there.
    pub value: String,
    /// What is wrong and what to do.
    pub problem: String,
    /// The server takes it all the same.
    pub warning: bool,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.row {
            Some(row) => write!(f, "row {row} (line {})", self.line)?,
            None => write!(f, "line {}", self.line)?,
        }
        if !self.column.is_empty() {
            write!(f, ", {}", self.column)?;
        }
        write!(f, ": `{}`: {}", self.value, self.problem)
    }
}

/// Everything SCORE would refuse or that looks odd, in the order of the file.
#[must_use]
pub fn check_score(text: &str) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut lines = records(text).into_iter();
    let Some((_, first)) = lines.next() else {
        return vec![whole(1, "", "the file is empty; it must begin with the 27 column names")];
    };
    if !header(first, &mut found) {
        return found;
    }
    let mut seen = HashSet::new();
    for (k, (line, raw)) in lines.enumerate() {
        let row = Some(k + 1);
        if raw.trim().is_empty() {
            let problem = "a blank line counts as a row without columns, and the upload stops there; delete it";
            found.push(Finding { row, ..whole(line, raw, problem) });
            continue;
        }
        let cells = match split(raw) {
            Ok(cells) => cells,
            Err(problem) => {
                found.push(Finding { row, ..whole(line, &short(raw), &problem) });
                continue;
            }
        };
        if cells[0].contains("SATHUB-SATELLITE") {
            let problem = "the sample data of the server: a file with such a row is refused; delete the row";
            found.push(Finding { row, column: HEADER[0].into(), ..whole(line, &cells[0], problem) });
        }
        if cells.len() != HEADER.len() {
            let hint = if cells.len() > HEADER.len() { "quote fields that hold commas" } else { "leave blanks empty" };
            let problem = format!("{} columns where 27 are wanted; {hint}, but keep every comma", cells.len());
            found.push(Finding { row, ..whole(line, &short(raw), &problem) });
            continue;
        }
        check_row(&cells, &mut |column, value, problem, warning| {
            let column = column.to_owned();
            found.push(Finding { row, line, column, value: short(value), problem, warning });
        });
        if !seen.insert(raw) {
            let problem = "the same row stands above; the server keeps one of them";
            found.push(Finding { row, warning: true, ..whole(line, &short(raw), problem) });
        }
    }
    if seen.is_empty() && found.is_empty() {
        found.push(Finding { warning: true, ..whole(1, "", "no observations below the header") });
    }
    found
}

/// Whether the first line is the header; what is wrong with it goes to `found`.
fn header(raw: &str, found: &mut Vec<Finding>) -> bool {
    if let Some(rest) = raw.strip_prefix('\u{feff}') {
        found.push(whole(1, &short(rest), "a byte order mark stands before the header; save as UTF-8 without BOM"));
        return header(rest, found);
    }
    if !raw.starts_with("satellite_name") {
        let quoted = raw.starts_with("\"satellite_name");
        let problem = if quoted {
            "the header is quoted, so the server takes it for an observation; write satellite_name without quotes"
        } else {
            "the file must begin with satellite_name and 26 more column names, separated by commas"
        };
        found.push(whole(1, &short(raw), problem));
        return quoted;
    }
    let names = split(raw).unwrap_or_default();
    for (i, wanted) in HEADER.iter().enumerate() {
        match names.get(i) {
            Some(name) if name == wanted => {}
            Some(name) => {
                let problem = format!("column {} must be {wanted}", i + 1);
                found.push(Finding { column: (*wanted).into(), ..whole(1, name, &problem) });
            }
            None => {
                let problem =
                    format!("column {} is missing; the 27 names stand in one line, separated by commas", i + 1);
                found.push(Finding { column: (*wanted).into(), ..whole(1, "", &problem) });
            }
        }
    }
    if names.len() > HEADER.len() {
        let extra = names[HEADER.len()..].join(",");
        found.push(whole(1, &extra, "more than 27 columns; delete those at the end"));
    }
    found.is_empty() || names.len() == HEADER.len()
}

/// The records of a CSV text with their first line; a line end inside quotes is part of the record.
fn records(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let (mut from, mut line, mut start_line, mut quoted) = (0, 1, 1, false);
    for (i, c) in text.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '\n' => {
                line += 1;
                if !quoted {
                    found.push((start_line, text[from..i].trim_end_matches('\r')));
                    (from, start_line) = (i + 1, line);
                }
            }
            _ => {}
        }
    }
    if from < text.len() {
        found.push((start_line, &text[from..]));
    }
    found
}

/// The cells of one record.
fn split(raw: &str) -> Result<Vec<String>, String> {
    if !raw.matches('"').count().is_multiple_of(2) {
        return Err("a quote is opened and never closed; close it, or double a quote inside a field".into());
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(raw.as_bytes());
    match reader.records().next() {
        Some(Ok(record)) => Ok(record.iter().map(str::to_owned).collect()),
        Some(Err(e)) => Err(e.to_string()),
        None => Err("no columns".into()),
    }
}

fn whole(line: usize, value: &str, problem: &str) -> Finding {
    let (value, problem) = (value.to_owned(), problem.to_owned());
    Finding { row: None, line, column: String::new(), value, problem, warning: false }
}

/// The beginning of a long value.
fn short(value: &str) -> String {
    let mut text: String = value.chars().take(60).collect();
    if text.len() < value.len() {
        text.push('…');
    }
    text
}
