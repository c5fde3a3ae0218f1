//! Binary tables of FITS: bytes to cells of text, and which table of a file is meant.
//!
//! FITS 4.0 sections 7.3 and 9. A column of a few numbers becomes as many columns (`FLUX_APER`, `FLUX_APER_1`, ...); a column of
//! times of two numbers (jd1, jd2), which astropy writes, becomes a text in UTC. TNULL, TSCAL and TZERO are applied; NaN is an
//! empty cell. Not supported, with a note: complex numbers, bits, arrays of variable length and long ones.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use hifitime::{Epoch, TimeScale, Unit};

use super::header::ecsv;
use super::{Column, Row, Rows, Table, bad, most_columns};
use crate::base::error::{Error, Result};
use crate::base::time::iso_utc;
use crate::fits::open as open_packed;
use crate::fits::tables::{BinaryTable, Field, RowBytes, binary_tables};
use crate::tables::schema::Datatype;

/// Most numbers of one cell that become columns.
const MOST_ELEMENTS: usize = 64;
/// MJD = JD − 2400000.5.
const MJD_OF_JD_D: f64 = 2_400_000.5;

/// `FILE[EXT]` as file and extension, where no file has the whole name.
pub fn extension_of(path: &Path) -> Option<(PathBuf, String)> {
    let text = path.to_str()?;
    let (file, extension) = text.strip_suffix(']')?.rsplit_once('[')?;
    (!path.exists() && !file.is_empty()).then(|| (file.into(), extension.trim().to_owned()))
}

/// Whether a file that begins with `head` is FITS, packed as a whole or not.
pub fn is_fits(path: &Path, head: &[u8]) -> bool {
    use std::io::Read as _;
    const MAGIC: &[u8] = b"SIMPLE  =";
    let packed = head.starts_with(b"\x1f\x8b") || head.starts_with(b"BZh");
    let mut start = [0; MAGIC.len()];
    // one that cannot be unpacked is refused by what it is
    let mut unpacked = || open_packed(path).is_ok_and(|mut f| f.read_exact(&mut start).is_ok() && start == *MAGIC);
    head.starts_with(MAGIC) || (packed && unpacked())
}

/// The rows of a binary table.
#[derive(Debug)]
pub struct FitsRows {
    bytes: RowBytes,
    fields: Vec<Cells>,
    number: usize,
}

/// How the bytes of a field become cells.
#[derive(Debug, Clone)]
struct Cells {
    field: Field,
    kind: Kind,
    scale: f64,
    zero: f64,
    null: Option<i64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Text,
    Logical,
    Whole,
    Real,
    /// A time of two numbers whose sum is a JD, or with the offset an MJD, in a time scale.
    Time {
        scale: TimeScale,
        /// Added to make it a JD \[d\].
        add_d: f64,
    },
}

/// Opens the table of a FITS file that is named, else the one that is wanted. `shown` is the path as the user gave it.
pub fn open(shown: &Path, file: &Path, extension: Option<&str>, wanted: &dyn Fn(&Table) -> bool) -> Result<Table> {
    let (bytes, tables, others) = binary_tables(file)?;
    let named = |t: &BinaryTable| match t.name.as_str() {
        "" => format!("{}[{}]", file.display(), t.index),
        name if tables.iter().filter(|o| o.name.eq_ignore_ascii_case(name)).count() > 1 => {
            format!("{}[{}]", file.display(), t.index)
        }
        name => format!("{}[{name}]", file.display()),
    };
    let all: Vec<String> = tables.iter().map(&named).collect();
    if tables.is_empty() {
        let what = if others.is_empty() { String::new() } else { format!(" ({})", others.join(", ")) };
        let problem = format!("is a FITS file without a binary table{what}; name the file that holds the table");
        return Err(bad(shown, None, problem));
    }
    let meant = |t: &&BinaryTable| match extension {
        Some(e) => t.name.eq_ignore_ascii_case(e) || e.parse() == Ok(t.index),
        None => true,
    };
    let mut found = Vec::new();
    for table in tables.iter().filter(meant) {
        found.push((named(table), table_of(shown, table, RowBytes::new(bytes.clone(), file, table))?));
    }
    let none = |problem: String| Err(bad(shown, None, problem));
    if found.is_empty() {
        return none(format!("holds no binary table of that name or number; it holds {}", all.join(", ")));
    }
    if found.len() > 1 {
        let columns: Vec<String> = found.iter().map(|(name, t)| format!("{name} ({})", few_names(t))).collect();
        found.retain(|(_, table)| wanted(table));
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        match names.as_slice() {
            [_] => {}
            [] => return none(format!("none of its tables has the columns that are needed: {}", columns.join("; "))),
            _ => return none(format!("several of its tables can be meant: name one, {}", names.join(" or "))),
        }
    }
    let several = all.len() > 1;
    match found.pop() {
        Some((name, mut table)) => {
            if several && extension.is_none() {
                table.notes.push(format!("of the tables {}, {name} is read", all.join(", ")));
            }
            Ok(table)
        }
        None => none("holds no binary table".into()),
    }
}

/// The first names of the columns of a table.
fn few_names(table: &Table) -> String {
    const FEW: usize = 12;
    let names: Vec<&str> = table.columns.iter().take(FEW).map(|c| c.name.as_str()).collect();
    let more = if table.columns.len() > FEW { ", ..." } else { "" };
    names.join(", ") + more
}

fn table_of(shown: &Path, table: &BinaryTable, bytes: RowBytes) -> Result<Table> {
    let wrong =
        |problem: String| Error::Fits { path: shown.to_owned(), problem: format!("HDU {}: {problem}", table.index) };
    let (mut columns, mut fields, mut skipped) = (Vec::<Column>::new(), Vec::new(), Vec::new());
    for field in &table.fields {
        let n = field.n;
        let text = |key: &str| table.header.text(&format!("{key}{n}")).unwrap_or_default();
        let name = Some(text("TTYPE")).filter(|t| !t.is_empty()).unwrap_or_else(|| format!("col{n}"));
        let number = |key: &str, absent: f64| match table.header.card(&format!("{key}{n}")) {
            None => Ok(absent),
            Some(card) => table
                .header
                .number(&format!("{key}{n}"))
                .ok_or_else(|| wrong(format!("{key}{n} = '{}' of column `{name}` is not a number", card.value))),
        };
        let (scale, zero) = (number("TSCAL", 1.0)?, number("TZERO", 0.0)?);
        if scale == 0.0 {
            return Err(wrong(format!("TSCAL{n} = 0 makes every number of column `{name}` the same")));
        }
        let is_time = !text("TCTYP").is_empty();
        let kind = match field.code {
            'A' => Kind::Text,
            'L' => Kind::Logical,
            'D' if field.repeat == 2 && is_time => time_of(table, &text("TCTYP")).map_err(|scale| {
                wrong(format!("column `{name}` is of times in the scale {scale}; UTC, TAI, TT and TDB are read"))
            })?,
            'B' | 'I' | 'J' | 'K' if scale == 1.0 && zero.fract() == 0.0 => Kind::Whole,
            'B' | 'I' | 'J' | 'K' | 'E' | 'D' => Kind::Real,
            _ => {
                skipped.push(format!("`{name}` ({})", text("TFORM")));
                continue;
            }
        };
        let one = matches!(kind, Kind::Text | Kind::Time { .. });
        if field.repeat == 0 || (!one && field.repeat > MOST_ELEMENTS) {
            skipped.push(format!("`{name}` ({})", text("TFORM")));
            continue;
        }
        let datatype = match kind {
            Kind::Whole => Datatype::Int64,
            Kind::Real => Datatype::Float64,
            Kind::Text | Kind::Logical | Kind::Time { .. } => Datatype::Text,
        };
        let is_instant = matches!(kind, Kind::Time { .. });
        let column = Column {
            unit: if is_instant { String::new() } else { text("TUNIT") },
            ucd: text("TUCD"),
            datatype: Some(datatype),
            time_scale: if is_time && !is_instant { text("TCTYP").to_ascii_lowercase() } else { String::new() },
            ..Column::named(&name)
        };
        for k in 0..if one { 1 } else { field.repeat } {
            let name = if k == 0 { name.clone() } else { format!("{name}_{k}") };
            columns.push(Column { name, ..column.clone() });
        }
        most_columns(columns.len()).map_err(|problem| bad(shown, None, problem))?;
        let null = table.header.integer(&format!("TNULL{n}"));
        fields.push(Cells { field: *field, kind, scale, zero, null });
    }
    // astropy keeps units that FITS does not know in comments of the form of ECSV
    let comments = table.header.cards().iter().filter(|c| c.keyword == "COMMENT").map(|c| format!("# {}", c.value));
    let remarks: Vec<String> = comments.skip_while(|c| !c.contains("--BEGIN-ASTROPY")).skip(1).collect();
    let described: HashMap<String, Column> = ecsv(&remarks).0.into_iter().map(|c| (c.name.clone(), c)).collect();
    for column in columns.iter_mut().filter(|c| c.unit.is_empty()) {
        if let Some(known) = described.get(&column.name) {
            column.unit.clone_from(&known.unit);
        }
    }
    let mut notes = Vec::new();
    if !skipped.is_empty() {
        notes.push(format!(
            "columns whose cells are not one text or a few numbers are not read: {}",
            skipped.join(", ")
        ));
    }
    let rows = Rows::Fits(Box::new(FitsRows { bytes, fields, number: 0 }));
    Ok(Table { path: shown.to_owned(), columns, notes, rows })
}

/// The times of a column of two numbers: JD, or MJD where the header says so (FITS 4.0 section 9.2.2).
fn time_of(table: &BinaryTable, scale: &str) -> std::result::Result<Kind, String> {
    let scale = match scale.to_ascii_uppercase().as_str() {
        "UTC" => TimeScale::UTC,
        "TAI" => TimeScale::TAI,
        "TT" | "TDT" | "ET" => TimeScale::TT,
        "TDB" => TimeScale::TDB,
        _ => return Err(scale.to_owned()),
    };
    let jd = table.header.number("JDREF");
    let mjd = table.header.number("MJDREF").map(|d| d + MJD_OF_JD_D);
    Ok(Kind::Time { scale, add_d: jd.or(mjd).unwrap_or(0.0) })
}

impl FitsRows {
    /// Reads the cells of the next row.
    pub fn read(&mut self, row: &mut Row) -> Result<bool> {
        let Some(bytes) = self.bytes.next()? else { return Ok(false) };
        for cells in &self.fields {
            cells.push(bytes, &mut row.cells);
        }
        self.number += 1;
        row.line = self.number;
        Ok(true)
    }
}

impl Cells {
    fn push(&self, row: &[u8], cells: &mut csv::StringRecord) {
        let Field { at, bytes, code, .. } = self.field;
        let bytes = row.get(at..at + bytes).unwrap_or_default();
        let size = match code {
            'I' => 2,
            'J' | 'E' => 4,
            'K' | 'D' => 8,
            _ => 1,
        };
        match self.kind {
            Kind::Text => {
                let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
                cells.push_field(String::from_utf8_lossy(&bytes[..end]).trim());
            }
            Kind::Time { scale, add_d } => {
                let text = match bytes.split_at_checked(size) {
                    Some((a, b)) => instant(real(a), real(b), scale, add_d),
                    None => None,
                };
                cells.push_field(&text.unwrap_or_default());
            }
            Kind::Logical => bytes.iter().for_each(|b| {
                cells.push_field(match b {
                    b'T' => "True",
                    b'F' => "False",
                    _ => "",
                });
            }),
            Kind::Whole => bytes.chunks_exact(size).for_each(|b| {
                let value = whole(b, code);
                // 2⁶³ and above is exact, as the numbers that are unsigned need it
                let shown = i128::from(value) + self.zero as i128;
                cells.push_field(&if self.null == Some(value) { String::new() } else { shown.to_string() });
            }),
            Kind::Real => bytes.chunks_exact(size).for_each(|b| cells.push_field(&self.real_text(b))),
        }
    }

    /// The shortest text that reads back to the number; empty for NaN and infinity.
    fn real_text(&self, b: &[u8]) -> String {
        let code = self.field.code;
        let plain = self.scale == 1.0 && self.zero == 0.0;
        if code == 'E' && plain {
            let value = f32::from_be_bytes(array(b));
            return if value.is_finite() { format!("{value:?}") } else { String::new() };
        }
        let stored = match code {
            'E' => f64::from(f32::from_be_bytes(array(b))),
            'D' => real(b),
            _ if self.null == Some(whole(b, code)) => f64::NAN,
            _ => whole(b, code) as f64,
        };
        let value = if plain { stored } else { self.zero + self.scale * stored };
        if value.is_finite() { format!("{value:?}") } else { String::new() }
    }
}

fn real(b: &[u8]) -> f64 {
    f64::from_be_bytes(array(b))
}

fn whole(b: &[u8], code: char) -> i64 {
    match code {
        'B' => i64::from(array::<1>(b)[0]),
        'I' => i64::from(i16::from_be_bytes(array(b))),
        'J' => i64::from(i32::from_be_bytes(array(b))),
        _ => i64::from_be_bytes(array(b)),
    }
}

fn array<const N: usize>(b: &[u8]) -> [u8; N] {
    let mut all = [0; N];
    all.iter_mut().zip(b).for_each(|(to, from)| *to = *from);
    all
}

/// The UTC of a JD in two parts; `None` for what is no time.
fn instant(a: f64, b: f64, scale: TimeScale, add_d: f64) -> Option<String> {
    // whole days apart from the rest, so that no digit is lost
    let (whole, rest) = (a.floor(), a - a.floor());
    let mjd = whole + add_d.floor() - 2_400_001.0;
    let day_d = rest + b + add_d.fract() + 0.5;
    let days = mjd + day_d.floor();
    if !(15_000.0..90_000.0).contains(&days) {
        return None;
    }
    let seconds = (day_d - day_d.floor()) * 86_400.0;
    let midnight = Epoch::from_mjd_in_time_scale(days, scale);
    Some(iso_utc((midnight + seconds * Unit::Second).to_time_scale(TimeScale::UTC), 9))
}
