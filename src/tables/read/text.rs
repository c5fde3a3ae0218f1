//! Tables of lines: the line of names, or what stands for it, then one row per line.
//!
//! Lines that begin with `#` are remarks. VizieR's lines of units and dashes under the names are read as such. A file without
//! a line of names has the columns `col1`, `col2`, ...

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use csv::StringRecord;

use super::header::{Remarks, ecsv, starlink};
use super::split::{Between, split};
use super::{Column, Row, Rows, Table, bad, most_columns};
use crate::base::error::{Error, Result};

/// A longer line is no line of a table.
const LONGEST_LINE: u64 = 1 << 20;

/// Lines with their numbers, ended by `\n`, `\r\n` or, in old files, `\r`.
#[derive(Debug)]
pub struct Lines {
    reader: BufReader<File>,
    end: u8,
    number: usize,
    bytes: Vec<u8>,
}

impl Lines {
    /// Reads the next line into `text`; `None` at the end, else its number from 1. What is no UTF-8 becomes U+FFFD.
    pub fn next(&mut self, path: &Path, text: &mut String) -> Result<Option<usize>> {
        self.bytes.clear();
        text.clear();
        let read = self.reader.by_ref().take(LONGEST_LINE).read_until(self.end, &mut self.bytes);
        let n = read.map_err(|e| Error::io(path, e))?;
        if n == 0 {
            return Ok(None);
        }
        self.number += 1;
        if n as u64 == LONGEST_LINE {
            return Err(bad(path, Some(self.number), "a line of more than a million letters: this is not a table"));
        }
        match std::str::from_utf8(&self.bytes) {
            Ok(line) => text.push_str(line),
            Err(_) => text.push_str(&String::from_utf8_lossy(&self.bytes)),
        }
        if self.number == 1 && text.starts_with('\u{feff}') {
            text.remove(0);
        }
        text.truncate(text.trim_end_matches(['\r', '\n']).len());
        Ok(Some(self.number))
    }
}

/// The rows of a table of lines.
#[derive(Debug)]
pub struct TextRows {
    lines: Lines,
    between: Between,
    remark: char,
    /// Lines read ahead.
    ahead: VecDeque<(usize, String)>,
    text: String,
}

impl TextRows {
    /// The next line that is neither blank nor a remark.
    fn line(&mut self, path: &Path) -> Result<Option<(usize, String)>> {
        if let Some(line) = self.ahead.pop_front() {
            return Ok(Some(line));
        }
        while let Some(number) = self.lines.next(path, &mut self.text)? {
            if !self.text.starts_with(self.remark) && !self.text.trim().is_empty() {
                return Ok(Some((number, std::mem::take(&mut self.text))));
            }
        }
        Ok(None)
    }

    /// Reads the cells of the next row.
    pub fn read(&mut self, path: &Path, row: &mut Row) -> Result<bool> {
        let Some((number, text)) = self.line(path)? else { return Ok(false) };
        row.line = number;
        row.problem = split(&text, self.between, &mut row.cells).err();
        self.text = text; // its memory serves the next line
        Ok(true)
    }
}

/// Opens a table of lines; `start` is its beginning.
pub fn open(path: &Path, reader: BufReader<File>, start: &str) -> Result<Table> {
    let end = if start.contains('\r') && !start.contains('\n') { b'\r' } else { b'\n' };
    let lines = Lines { reader, end, number: 0, bytes: Vec::new() };
    let mut rows =
        TextRows { lines, between: Between::Blanks, remark: '#', ahead: VecDeque::new(), text: String::new() };
    if start.lines().any(|l| l.trim_end() == "BEGINTABLE") {
        rows.remark = '!';
        let columns = starlink(&mut || rows.line(path)).and_then(|found| found.ok_or_else(|| empty(path)))?;
        return Ok(table(path, columns, Vec::new(), rows));
    }
    let mut remarks = Vec::new();
    let mut text = String::new();
    let (number, first) = loop {
        match rows.lines.next(path, &mut text)? {
            None => return Err(empty(path)),
            Some(_) if text.starts_with('#') => remarks.push(std::mem::take(&mut text)),
            Some(_) if text.trim().is_empty() => {}
            Some(number) => break (number, text),
        }
    };
    if remarks.first().is_some_and(|r| r.starts_with("# %ECSV")) {
        let (described, between) = ecsv(&remarks);
        rows.between = between;
        let mut columns = named(&first, between, path, number)?;
        // of two descriptions of a name the first counts
        let described: HashMap<String, Column> = described.into_iter().rev().map(|d| (d.name.clone(), d)).collect();
        for column in &mut columns {
            if let Some(known) = described.get(&column.name) {
                *column = known.clone();
            }
        }
        return Ok(table(path, columns, Vec::new(), rows));
    }
    rows.between = Between::guess(&first);
    let mut notes = Vec::new();
    let mut columns = named(&first, rows.between, path, number)?;
    let numbers = columns.iter().filter(|c| c.name.parse::<f64>().is_ok()).count();
    let remarks = Remarks(&remarks);
    if numbers > 0 && 2 * numbers >= columns.len() {
        // the first line is one of numbers: its names, if it has any, are in the remarks
        let n = columns.len();
        columns = match remarks.names(n, rows.between) {
            Some(columns) => columns,
            None => {
                notes.push(format!("has no line of column names: the columns are called col1 to col{n}"));
                (1..=n).map(|i| Column::named(&format!("col{i}"))).collect()
            }
        };
        rows.ahead.push_back((number, first));
    } else {
        remarks.describe(&mut columns);
        units_and_ruler(path, &mut rows, &mut columns)?;
    }
    Ok(table(path, columns, notes, rows))
}

fn table(path: &Path, columns: Vec<Column>, notes: Vec<String>, rows: TextRows) -> Table {
    Table { path: path.to_owned(), columns, notes, rows: Rows::Text(Box::new(rows)) }
}

fn empty(path: &Path) -> Error {
    bad(path, None, "is empty: a line of column names is needed")
}

fn named(line: &str, between: Between, path: &Path, number: usize) -> Result<Vec<Column>> {
    let mut cells = StringRecord::new();
    split(line, between, &mut cells).map_err(|problem| bad(path, Some(number), problem))?;
    most_columns(cells.len()).map_err(|problem| bad(path, Some(number), problem))?;
    Ok(cells.iter().map(Column::named).collect())
}

/// VizieR writes a line of units and one of dashes under the names; other files have rows there.
fn units_and_ruler(path: &Path, rows: &mut TextRows, columns: &mut [Column]) -> Result<()> {
    let ruler = |line: &str, between: Between| {
        let mut cells = StringRecord::new();
        let dashes = |cell: &str| !cell.is_empty() && cell.chars().all(|c| c == '-');
        split(line, between, &mut cells).is_ok() && !cells.is_empty() && cells.iter().all(dashes)
    };
    let Some(first) = rows.line(path)? else { return Ok(()) };
    if ruler(&first.1, rows.between) {
        return Ok(());
    }
    let Some(second) = rows.line(path)? else {
        rows.ahead.push_back(first);
        return Ok(());
    };
    if !ruler(&second.1, rows.between) {
        rows.ahead.extend([first, second]);
        return Ok(());
    }
    let mut cells = StringRecord::new();
    // units that cannot be read are units that are not given
    if split(&first.1, rows.between, &mut cells).is_ok() {
        for (column, unit) in columns.iter_mut().zip(cells.iter()) {
            column.unit = unit.to_owned();
        }
    }
    Ok(())
}
