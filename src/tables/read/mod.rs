//! A table of text cells, read row by row whatever its dress: CSV, TSV, bars, blanks, VizieR's text, ECSV, the lists of
//! SExtractor and Starlink, VOTable, the binary tables of FITS, Parquet (with the feature `parquet`).
//!
//! Cells are texts; what they mean, and in which unit, is the caller's. One row is in memory at a time (but a VOTable with
//! binary rows as a whole). Not supported: compressed files but FITS, cells of several lines, arrays of variable length.

mod binary;
mod fits;
mod header;
#[cfg(feature = "parquet")]
mod parquet;
mod split;
mod text;
mod votable;

use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::schema::Datatype;
use super::unit::is_unit;
use crate::base::error::{Error, Result};

/// One column, as far as the header describes it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Unit as written; empty if none is given.
    pub unit: String,
    /// Unified content descriptor (`phot.mag;em.opt.V`); empty if none is given.
    pub ucd: String,
    /// The coordinate system a VOTable refers it to, e.g. `eq_FK4 B1950`; empty if none is given.
    pub system: String,
    /// The text that stands for a missing value, besides the usual ones.
    pub null: Option<String>,
    /// What the header says the cells hold; `None` where it does not say.
    pub datatype: Option<Datatype>,
    /// The time scale of a column of times (`utc`, `tai`, `tt`); empty if none is given.
    pub time_scale: String,
}

impl Column {
    fn named(name: &str) -> Column {
        let unit = bare_name(name).1.to_owned();
        Column { name: name.trim().to_owned(), unit, ..Column::default() }
    }
}

/// A name of a column without the unit in brackets behind it, and that unit: `Range (km)`, `alt [deg]`.
fn bare_name(name: &str) -> (&str, &str) {
    let name = name.trim();
    let inner = |open: char, close: char| {
        let (bare, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
        let known = is_unit(unit.trim()) || unit.trim().eq_ignore_ascii_case("utc");
        (!bare.trim().is_empty() && known).then(|| (bare.trim(), unit.trim()))
    };
    inner('[', ']').or_else(|| inner('(', ')')).unwrap_or((name, ""))
}

/// One row: its place in the file and its cells.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Line of the file, from 1; of a VOTable or a FITS table the row, from 1.
    pub line: usize,
    cells: csv::StringRecord,
    /// Why the line could not be split into cells.
    problem: Option<String>,
}

impl Row {
    /// The cell of column `i`, without blanks around it; empty if there is none.
    #[must_use]
    pub fn get(&self, i: usize) -> &str {
        self.cells.get(i).unwrap_or_default()
    }

    /// All cells, as many as the line has.
    #[must_use]
    pub fn cells(&self) -> &csv::StringRecord {
        &self.cells
    }

    /// The cell of column `i` as a number; `None` for a blank, a dash, NaN, infinity or a word.
    #[must_use]
    pub fn number(&self, i: usize) -> Option<f64> {
        number(self.get(i))
    }
}

/// A number; `None` for a blank, a dash, NaN, infinity or a word. Fortran's `1.5D+02` is read.
#[must_use]
pub fn number(text: &str) -> Option<f64> {
    let value = text.parse::<f64>().ok().or_else(|| {
        let fortran = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && text.contains(['D', 'd']);
        fortran.then(|| text.replace(['D', 'd'], "E").parse().ok()).flatten()
    });
    value.filter(|v: &f64| v.is_finite())
}

/// Refuses more columns than any table has: columns are looked up by name, one after the other.
fn most_columns(n: usize) -> std::result::Result<(), String> {
    const MOST: usize = 10_000;
    if n <= MOST { Ok(()) } else { Err(format!("has more than {MOST} columns: this is not a table")) }
}

/// A table being read.
#[derive(Debug)]
pub struct Table {
    /// The file.
    pub path: PathBuf,
    /// Its columns.
    pub columns: Vec<Column>,
    /// What should be known of it.
    pub notes: Vec<String>,
    rows: Rows,
}

#[derive(Debug)]
enum Rows {
    Fits(Box<fits::FitsRows>),
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet::ParquetRows>),
    Text(Box<text::TextRows>),
    Xml(Box<votable::XmlRows>),
}

/// Bytes looked at to tell what a file is.
const SNIFF_BYTES: u64 = 64 << 10;

impl Table {
    /// Opens a table and reads its header. `FILE[NAME]` and `FILE[N]` are a table of a FITS file, by EXTNAME or by the number
    /// of its HDU from 0; without it the file must hold one binary table alone.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] naming what the file is instead of a table, and what to do about it; [`Error::Fits`]
    /// for a damaged FITS file.
    pub fn open(path: &Path) -> Result<Table> {
        Self::open_where(path, &|_| true)
    }

    /// As [`Table::open`]; of several tables in a FITS file the one that is `wanted`.
    ///
    /// # Errors
    /// As [`Table::open`]; [`Error::Table`] with the names of the tables where several are wanted, or none of several.
    pub fn open_where(path: &Path, wanted: &dyn Fn(&Table) -> bool) -> Result<Table> {
        if let Some((file, extension)) = fits::extension_of(path) {
            return fits::open(path, &file, Some(&extension), wanted);
        }
        let mut file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
        let mut head = Vec::new();
        file.by_ref().take(SNIFF_BYTES).read_to_end(&mut head).map_err(|e| Error::io(path, e))?;
        file.seek(SeekFrom::Start(0)).map_err(|e| Error::io(path, e))?;
        if fits::is_fits(path, &head) {
            return fits::open(path, path, None, wanted);
        }
        #[cfg(feature = "parquet")]
        if head.starts_with(b"PAR1") {
            return parquet::open(path, file);
        }
        if let Some(problem) = no_table(&head) {
            return Err(bad(path, None, problem));
        }
        let start = String::from_utf8_lossy(&head);
        let reader = BufReader::with_capacity(SNIFF_BYTES as usize, file);
        if start.trim_start_matches(['\u{feff}', ' ', '\n', '\r', '\t']).starts_with('<') {
            votable::open(path, reader)
        } else {
            text::open(path, reader, &start)
        }
    }

    /// Reads the next row; `false` at the end.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] when nothing after this place can be read. A line with too few or too many cells is
    /// no error: [`Table::check`] reports it.
    pub fn read(&mut self, row: &mut Row) -> Result<bool> {
        row.cells.clear();
        row.problem = None;
        let more = match &mut self.rows {
            Rows::Fits(rows) => rows.read(row)?,
            #[cfg(feature = "parquet")]
            Rows::Parquet(rows) => rows.read(&self.path, row)?,
            Rows::Text(rows) => rows.read(&self.path, row)?,
            Rows::Xml(rows) => rows.read(&self.path, row)?,
        };
        let missing = |(i, cell): (usize, &str)| {
            self.columns.get(i).is_some_and(|c| c.null.as_deref().is_some_and(|null| !cell.is_empty() && cell == null))
        };
        if self.columns.iter().any(|c| c.null.is_some()) && row.cells.iter().enumerate().any(missing) {
            row.cells =
                row.cells.iter().enumerate().map(|(i, cell)| if missing((i, cell)) { "" } else { cell }).collect();
        }
        Ok(more)
    }

    /// Why a row cannot be taken: not as many cells as there are columns.
    ///
    /// # Errors
    /// The reason in words.
    pub fn check(&self, row: &Row) -> std::result::Result<(), String> {
        if let Some(problem) = &row.problem {
            return Err(problem.clone());
        }
        let (n, want) = (row.cells.len(), self.columns.len());
        // a separator at the end of each line adds an empty cell
        if n == want || (n > want && row.cells.iter().skip(want).all(str::is_empty)) {
            return Ok(());
        }
        Err(format!("{n} cells, but {want} column names"))
    }

    /// `line 12`, or `row 12` of a VOTable or a FITS table.
    #[must_use]
    pub fn place(&self, row: &Row) -> String {
        let word = if matches!(self.rows, Rows::Text(_)) { "line" } else { "row" };
        format!("{word} {}", row.line)
    }

    /// The column of this name: as written, else without regard to case, to a unit in brackets behind it and to blanks for `_`
    /// where that is one column alone. A name of one letter is only taken as written (V is a magnitude, v may be another).
    #[must_use]
    pub fn column(&self, name: &str) -> Option<usize> {
        let exact = self.columns.iter().position(|c| c.name == name);
        exact.or_else(|| {
            let plain = |b: u8| if b == b' ' { b'_' } else { b.to_ascii_lowercase() };
            let alike = |c: &Column| {
                let bare = bare_name(&c.name).0;
                name.chars().count() > 1 && bare.bytes().map(plain).eq(name.bytes().map(plain))
            };
            let mut found = (0..self.columns.len()).filter(|i| alike(&self.columns[*i]));
            found.next().filter(|_| found.next().is_none())
        })
    }

    /// The names of all columns, for a message.
    #[must_use]
    pub fn names(&self) -> String {
        let names: Vec<&str> = self.columns.iter().map(|c| c.name.as_str()).collect();
        names.join(", ")
    }
}

fn bad(path: &Path, line: Option<usize>, problem: impl Into<String>) -> Error {
    Error::Table { path: path.to_owned(), line, problem: problem.into() }
}

/// What a file is whose first bytes are not those of a table in text.
fn no_table(head: &[u8]) -> Option<String> {
    let remedy = "save it as CSV, TSV, ECSV, VOTable or FITS";
    let known: [(&[u8], &str); 6] = [
        (b"\x1f\x8b", "is compressed (gzip): unpack it first"),
        (b"BZh", "is compressed (bzip2): unpack it first"),
        (b"PK\x03\x04", "is a zip archive or a spreadsheet"),
        (b"\xff\xfe", "is text of two bytes per letter (UTF-16); save it as UTF-8"),
        (b"\xfe\xff", "is text of two bytes per letter (UTF-16); save it as UTF-8"),
        (
            b"PAR1",
            "is Parquet, which this build of satphot cannot read: build it with the feature `parquet` (docs/formats.md), or save \
             the table as CSV, ECSV, VOTable or FITS",
        ),
    ];
    if let Some((_, what)) = known.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Some(if what.contains(':') || what.contains(';') {
            (*what).to_owned()
        } else {
            format!("{what}; {remedy}")
        });
    }
    let start = String::from_utf8_lossy(&head[..head.len().min(2048)]).trim_start().to_ascii_lowercase();
    if start.starts_with("<!doctype html") || start.starts_with("<html") {
        return Some("is a web page, not a table: the download has failed; look at it in a browser".to_owned());
    }
    let control = |b: &u8| matches!(b, 0..=8 | 14..=25 | 28..=31);
    head.iter().any(control).then(|| format!("is not a text: it holds control characters; {remedy}"))
}
