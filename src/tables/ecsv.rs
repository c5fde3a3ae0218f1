//! Tables on disk: ECSV 1.0, comma separated, missing cells as `""`, floats in the shortest text that reads back exactly.
//!
//! The header carries name, unit, type and meaning of each column and the meta block, so that astropy and TOPCAT read
//! the file without help. Same rows and meta, same bytes. Not supported: multi-dimensional and mixin columns.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::bands::description_in;
use super::formats::{KNOWN, Table, recognised};
use super::meta::{Meta, scalar};
use super::rows_hash::with_hash;
use super::schema::{
    Column, Datatype, Definition, PHOTOMETRY, PREDICTION, PhotometryRow, ResidualRow, Row, StarRow, is_listed,
};
use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;

/// Decimals an MJD keeps at least: 9 gave ±41 µs, 10 are the law of the format.
const MJD_DECIMALS: usize = 10;

/// Writes `photometry.ecsv`.
///
/// # Errors
/// As [`write_rows`].
pub fn write_photometry(path: &Path, rows: &[PhotometryRow], meta: &Meta) -> Result<()> {
    write_rows(path, rows, meta)
}

/// Writes `stars.ecsv`.
///
/// # Errors
/// As [`write_rows`].
pub fn write_stars(path: &Path, rows: &[StarRow], meta: &Meta) -> Result<()> {
    write_rows(path, rows, meta)
}

/// Writes `residuals.ecsv`.
///
/// # Errors
/// As [`write_rows`].
pub fn write_residuals(path: &Path, rows: &[ResidualRow], meta: &Meta) -> Result<()> {
    write_rows(path, rows, meta)
}

/// Writes the [`PREDICTION`] columns of rows.
///
/// # Errors
/// As [`write_rows`].
pub fn write_prediction(path: &Path, rows: &[PhotometryRow], meta: &Meta) -> Result<()> {
    let records = prediction_cells(rows).map_err(|e| unwritable(path, &e))?;
    write_cells(path, &records, PREDICTION.columns, meta)
}

/// The cells of [`PREDICTION`], row by row.
///
/// # Errors
/// Those of the writer of CSV; none is known for these rows.
pub fn prediction_cells(rows: &[PhotometryRow]) -> std::result::Result<Vec<csv::StringRecord>, csv::Error> {
    photometry_cells(PREDICTION.columns, rows)
}

/// The cells of some columns of [`PHOTOMETRY`], row by row.
///
/// # Errors
/// As [`prediction_cells`].
pub fn photometry_cells(
    columns: &[Column],
    rows: &[PhotometryRow],
) -> std::result::Result<Vec<csv::StringRecord>, csv::Error> {
    let place = |chosen: &Column| PHOTOMETRY.columns.iter().position(|c| c.name == chosen.name);
    let places: Vec<usize> = columns.iter().filter_map(place).collect();
    let cells_of = |row: csv::StringRecord| places.iter().map(|i| row.get(*i).unwrap_or_default()).collect();
    Ok(cells(rows)?.into_iter().map(cells_of).collect())
}

/// Writes the rows of a table; one that is not in the list of all tables does not compile.
///
/// # Errors
/// [`Error::Table`] naming row and column of a NaN or infinite number; [`Error::Io`].
pub fn write_rows<R: Row>(path: &Path, rows: &[R], meta: &Meta) -> Result<()> {
    const { assert!(is_listed(&R::TABLE), "list the table in tables/schema/all.rs") };
    write_cells(path, &cells(rows).map_err(|e| unwritable(path, &e))?, R::TABLE.columns, meta)
}

/// The rows of a table as comma-separated values under the names of its columns.
///
/// # Errors
/// Those of the writer of CSV; none is known for these rows.
pub fn csv_text<R: Row>(rows: &[R]) -> std::result::Result<String, csv::Error> {
    csv_of_cells(R::TABLE.columns, &cells(rows)?)
}

/// Cells made elsewhere as comma-separated values under the names of their columns.
///
/// # Errors
/// Those of the writer of CSV; none is known for these cells.
pub fn csv_of_cells(columns: &[Column], records: &[csv::StringRecord]) -> std::result::Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.iter().map(|c| c.name))?;
    records.iter().try_for_each(|record| writer.write_record(record))?;
    let bytes = writer.into_inner().map_err(|e| e.into_error())?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Reads `photometry.ecsv`: columns by name in any order, unknown ones ignored.
///
/// # Errors
/// As [`read_rows`].
pub fn read_photometry(path: &Path) -> Result<(Vec<PhotometryRow>, Meta)> {
    read_rows(path)
}

/// Reads `stars.ecsv`.
///
/// # Errors
/// As [`read_rows`].
pub fn read_stars(path: &Path) -> Result<(Vec<StarRow>, Meta)> {
    read_rows(path)
}

/// Reads `residuals.ecsv`.
///
/// # Errors
/// As [`read_rows`].
pub fn read_residuals(path: &Path) -> Result<(Vec<ResidualRow>, Meta)> {
    read_rows(path)
}

/// Reads the rows of a table: columns by name in any order, unknown ones ignored.
///
/// # Errors
/// [`Error::Table`] naming a missing column, or the line and column of a bad number; [`Error::Io`].
pub fn read_rows<R: Row + DeserializeOwned>(path: &Path) -> Result<(Vec<R>, Meta)> {
    let file = Opened::new(path)?;
    let columns = R::TABLE.columns;
    file.places(&file.names()?, columns)?;
    let mut rows = Vec::new();
    file.each(columns, |names, record, line| {
        rows.push(record.deserialize(Some(names)).map_err(|e| file.problem(line, e.to_string()))?);
        Ok(())
    })?;
    Ok((rows, file.meta()))
}

/// Reads the meta block of any table.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] for a file that is not ECSV.
pub fn read_meta(path: &Path) -> Result<Meta> {
    Ok(Opened::new(path)?.meta())
}

fn unwritable(path: &Path, e: &csv::Error) -> Error {
    Error::Table { path: path.into(), line: None, problem: e.to_string() }
}

/// Writes cells made elsewhere under their columns.
///
/// # Errors
/// As [`write_rows`].
pub fn write_cells(path: &Path, records: &[csv::StringRecord], columns: &[Column], meta: &Meta) -> Result<()> {
    let problem = |problem: String| Error::Table { path: path.into(), line: None, problem };
    if let Some(key) = meta.non_finite_key() {
        return Err(problem(format!("meta {key} is not a finite number; leave the key out")));
    }
    let mut text = header(columns, meta);
    for (number, record) in records.iter().enumerate() {
        for (i, (cell, column)) in record.iter().zip(columns).enumerate() {
            if i > 0 {
                text.push(',');
            }
            let cell = typed(cell, column).map_err(|what| {
                let frame = record.get(0).unwrap_or_default();
                problem(format!("row {} ({frame}): {} is {what}, not a number or missing", number + 1, column.name))
            })?;
            text.push_str(&quoted(&cell));
        }
        text.push('\n');
    }
    if meta.has_rows_hash() {
        text = with_hash(&text, meta);
    }
    write_atomic(path, text.as_bytes())
}

/// The commented YAML header and the row of names.
fn header(columns: &[Column], meta: &Meta) -> String {
    let mut text = String::from("# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n");
    for column in columns {
        let Column { name, unit, datatype, .. } = column;
        // names of foreign columns may hold what YAML reads otherwise
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let name = if plain { (*name).to_owned() } else { scalar(name) };
        let unit = if unit.is_empty() { String::new() } else { format!("unit: {}, ", scalar(unit)) };
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "# - {{name: {name}, {unit}datatype: {}, description: {}}}",
            datatype.ecsv(),
            scalar(&description_in(column, meta))
        );
    }
    if !meta.entries.is_empty() {
        text.push_str("# meta: !!omap\n");
        for line in meta.to_lines() {
            let _ = writeln!(text, "# {line}");
        }
    }
    text.push_str("# schema: astropy-2.0\n");
    let names: Vec<String> = columns.iter().map(|c| quoted(c.name)).collect();
    text.push_str(&names.join(","));
    text.push('\n');
    text
}

/// Each row as the texts of its fields, in field order.
fn cells<T: Serialize>(rows: &[T]) -> std::result::Result<Vec<csv::StringRecord>, csv::Error> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    let bytes = writer.into_inner().map_err(|e| e.into_error())?;
    csv::ReaderBuilder::new().has_headers(false).from_reader(bytes.as_slice()).into_records().collect()
}

/// The text of a cell by the type of its column; the offending text if it is not finite.
fn typed(cell: &str, column: &Column) -> std::result::Result<String, String> {
    match column.datatype {
        Datatype::Float64 if cell.parse::<f64>().is_ok_and(|v| !v.is_finite()) => Err(cell.to_owned()),
        Datatype::Float64 if column.name == "mjd_mid_d" && !cell.is_empty() && !cell.contains('e') => {
            let decimals = cell.split_once('.').map_or(0, |(_, d)| d.len());
            Ok(format!("{cell}{}", "0".repeat(MJD_DECIMALS.saturating_sub(decimals))))
        }
        // A row is a line: readers that split lines first must not lose one to a text.
        Datatype::Text => Ok(cell
            .replace("\r\n", " ")
            .replace(|c: char| c.is_control() || ('\u{2028}'..='\u{2029}').contains(&c), " ")),
        _ => Ok(cell.to_owned()),
    }
}

/// CSV quoting: missing as `""`; a `#` too, since a line that begins with one is a comment to ECSV readers.
fn quoted(cell: &str) -> String {
    if cell.is_empty() || cell.contains([',', '"', '#']) || cell.trim() != cell {
        return format!("\"{}\"", cell.replace('"', "\"\""));
    }
    cell.to_owned()
}

/// Reads any table of the schema as text cells: which one it is, its columns tell.
///
/// # Errors
/// As [`read_rows`]; [`Error::Table`] for a file that is none of the tables.
pub fn read_table(path: &Path) -> Result<Table> {
    let file = Opened::new(path)?;
    let names = file.names()?;
    let Some(table) = recognised(&names) else {
        let known: Vec<&str> = KNOWN.iter().map(Definition::name).collect();
        let problem = format!("its columns are none of satphot's tables; known: {}", known.join(", "));
        return Err(file.problem(Some(file.header.len() + 1), problem));
    };
    let columns = table.columns;
    let places = file.places(&names, columns)?;
    let mut records = Vec::new();
    file.each(columns, |_, record, _| {
        records.push(places.iter().map(|i| i.and_then(|i| record.get(i)).unwrap_or_default()).collect());
        Ok(())
    })?;
    let is_unknown = |n: &&str| !columns.iter().any(|c| c.name == *n);
    let ignored = names.iter().filter(is_unknown).map(str::to_owned).collect();
    Ok(Table { name: table.name(), records, ignored, meta: file.meta(), columns: columns.to_vec() })
}

/// The text of an ECSV file, split into its head and its body.
struct Opened<'a> {
    path: &'a Path,
    text: String,
    /// Lines that begin with `#`, each with its end in `text`.
    header: Vec<(usize, usize)>,
}

impl<'a> Opened<'a> {
    fn new(path: &'a Path) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|source| Error::io(path, source))?;
        if !text.starts_with("# %ECSV") {
            let problem = "not an ECSV file: its first line is not `# %ECSV 1.0`";
            return Err(Error::Table { path: path.into(), line: Some(1), problem: problem.into() });
        }
        let mut at = 0;
        let mut header = Vec::new();
        for line in text.split_inclusive('\n').take_while(|line| line.starts_with('#')) {
            header.push((at, at + line.len()));
            at += line.len();
        }
        Ok(Self { path, text, header })
    }

    fn problem(&self, line: Option<usize>, problem: String) -> Error {
        Error::Table { path: self.path.into(), line, problem }
    }

    fn head(&self) -> impl Iterator<Item = &str> {
        self.header.iter().map(|(from, to)| self.text[*from..*to].trim_end_matches(['\n', '\r']))
    }

    fn reader(&self) -> csv::Reader<&[u8]> {
        let comma = self.head().any(|line| line.contains("delimiter: ','"));
        let body = self.header.last().map_or(0, |(_, to)| *to);
        csv::ReaderBuilder::new()
            .delimiter(if comma { b',' } else { b' ' })
            .from_reader(self.text.as_bytes().get(body..).unwrap_or_default())
    }

    fn line_of(&self, e: &csv::Error) -> Option<usize> {
        e.position().map(|p| self.header.len() + p.line() as usize)
    }

    fn names(&self) -> Result<csv::StringRecord> {
        self.reader().headers().cloned().map_err(|e| self.problem(self.line_of(&e), e.to_string()))
    }

    /// Where each column is among the names; `None` for one that older tables do not have.
    fn places(&self, names: &csv::StringRecord, columns: &[Column]) -> Result<Vec<Option<usize>>> {
        let line = Some(self.header.len() + 1);
        let place = |c: &Column| {
            let at = names.iter().position(|n| n == c.name);
            if at.is_none() && !c.added_later {
                let problem = format!("column {} is missing; write the table again with this satphot", c.name);
                return Err(self.problem(line, problem));
            }
            Ok(at)
        };
        if let Some(twice) = columns.iter().find(|c| names.iter().filter(|n| *n == c.name).count() > 1) {
            return Err(self.problem(line, format!("column {} is there twice; keep one of them", twice.name)));
        }
        columns.iter().map(place).collect()
    }

    /// Each row after the types of its cells have been checked, with the names and its line.
    fn each(
        &self,
        columns: &[Column],
        mut take: impl FnMut(&csv::StringRecord, csv::StringRecord, Option<usize>) -> Result<()>,
    ) -> Result<()> {
        let names = self.names()?;
        for record in self.reader().records() {
            let record = record.map_err(|e| self.problem(self.line_of(&e), e.to_string()))?;
            let line = record.position().map(|p| self.header.len() + p.line() as usize);
            for (cell, name) in record.iter().zip(&names) {
                if let Some(column) = columns.iter().find(|c| c.name == name) {
                    check(cell, column).map_err(|what| self.problem(line, what))?;
                }
            }
            take(&names, record, line)?;
        }
        Ok(())
    }

    fn meta(&self) -> Meta {
        let lines: Vec<&str> = self.head().collect();
        Meta::from_lines(&meta_lines(&lines))
    }
}

/// Whether a cell holds what its column promises; if not, a sentence with the column and the text.
fn check(cell: &str, column: &Column) -> std::result::Result<(), String> {
    let good = match column.datatype {
        Datatype::Text => true,
        Datatype::Int64 => cell.is_empty() || cell.parse::<i64>().is_ok(),
        Datatype::Int32 => cell.parse::<i32>().is_ok(),
        Datatype::Float64 => cell.is_empty() || cell.parse::<f64>().is_ok_and(f64::is_finite),
    };
    if good {
        return Ok(());
    }
    Err(format!(
        "column {}: `{cell}` is not a finite {}; leave the cell empty if missing",
        column.name,
        column.datatype.ecsv()
    ))
}

/// The lines between `# meta: !!omap` and the next key, without `# `.
fn meta_lines<'a>(header: &[&'a str]) -> Vec<&'a str> {
    header
        .iter()
        .map(|line| line.strip_prefix("# ").unwrap_or(line))
        .skip_while(|line| !line.starts_with("meta:"))
        .skip(1)
        .take_while(|line| line.starts_with("- ") || line.starts_with(' '))
        .collect()
}
