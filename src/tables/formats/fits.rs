//! A night as a FITS file: an empty primary HDU and three binary tables, PHOTOMETRY, ZEROPOINT, PROVENANCE.
//!
//! Columns as in the schema, in upper case. Strings `nA`, whole numbers `K` and `J` with TNULL, numbers `D` with NaN
//! for missing (FITS has no other mark for it). The column of times carries the keywords of the standard, and the comments by
//! which astropy makes it a Time. Source: FITS Standard 4.0, sections 7.3 and 9. Variable-length columns are not written.

use std::path::Path;

use super::Provenance;
use super::table::Cell;
use super::table::Table;
use super::units::{fits_description, fits_unit};
use crate::base::error::Result;
use crate::fits::card_value::{CardLine, ascii, card};
use crate::fits::raw::NewFits;
use crate::fits::write::write_hdus;
use crate::tables::bands::{description_in, ucd_in};
use crate::tables::meta::Meta;
use crate::tables::schema::Datatype;

/// Writes `table`, the star measurements behind its zeropoint (none: an HDU without rows) and its provenance.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Fits`].
pub fn write_fits(path: &Path, table: &Table, stars: Option<&Table>, provenance: &Provenance) -> Result<()> {
    let none = Table { name: "stars", columns: crate::tables::schema::STARS.columns.to_vec(), ..Table::default() };
    write_hdus(path, |file| {
        primary(file)?;
        append(file, &table.name.to_uppercase(), &Columns::of(table), &table.meta)?;
        append(file, "ZEROPOINT", &Columns::of(stars.unwrap_or(&none)), &table.meta)?;
        append(file, "PROVENANCE", &Columns::of_pairs(provenance), &Meta::default())
    })
}

/// Writes `table` and its provenance: a table that is not of a night has no zeropoint.
///
/// # Errors
/// As [`write_fits`].
pub fn write_fits_table(path: &Path, table: &Table, provenance: &Provenance) -> Result<()> {
    write_hdus(path, |file| {
        primary(file)?;
        append(file, &table.name.to_uppercase(), &Columns::of(table), &table.meta)?;
        append(file, "PROVENANCE", &Columns::of_pairs(provenance), &Meta::default())
    })
}

fn primary(file: &mut NewFits) -> Result<()> {
    file.empty(&[
        card("ORIGIN", "satphot", ""),
        card("COMMENT", "Text that is not ASCII, and the backslash, are escaped as in JSON.", ""),
        card("COMMENT", "A number that is missing is NaN, a whole number TNULL, a text blank.", ""),
    ])?;
    file.checksum()
}

/// The column of times.
const TIME: &str = "mjd_mid_d";
/// The comments by which astropy reads the column of times as a Time without an option
/// (`astropy.io.fits.connect._decode_mixins`).
const AS_TIME: [&str; 11] = [
    "--BEGIN-ASTROPY-SERIALIZED-COLUMNS--",
    "datatype: []",
    "meta: !!omap",
    "- __serialized_columns__:",
    "    MJD_MID_D:",
    "      __class__: astropy.time.core.Time",
    "      format: mjd",
    "      scale: utc",
    "      value: !astropy.table.SerializedColumn",
    "        name: MJD_MID_D",
    "--END-ASTROPY-SERIALIZED-COLUMNS--",
];

/// Missing whole numbers.
const NULL_64: i64 = i64::MIN;
const NULL_32: i32 = i32::MIN;

/// What a binary table is made of.
struct Columns<'a> {
    heads: Vec<Head<'a>>,
    rows: Rows<'a>,
}

struct Head<'a> {
    name: String,
    datatype: Datatype,
    /// Bytes of a cell.
    width: usize,
    unit: &'a str,
    ucd: String,
    description: String,
}

enum Rows<'a> {
    Table(&'a Table),
    Pairs(&'a Provenance),
}

impl<'a> Columns<'a> {
    fn of(table: &'a Table) -> Self {
        let mut widest = vec![1; table.columns.len()];
        for record in &table.records {
            for (widest, (cell, column)) in widest.iter_mut().zip(record.iter().zip(&table.columns)) {
                if column.datatype == Datatype::Text {
                    *widest = (*widest).max(ascii(cell).len());
                }
            }
        }
        let heads = table.columns.iter().zip(widest).map(|(column, widest)| Head {
            name: column.name.to_uppercase(),
            datatype: column.datatype,
            width: match column.datatype {
                Datatype::Text => widest,
                Datatype::Int32 => 4,
                Datatype::Int64 | Datatype::Float64 => 8,
            },
            // the unit of times is that of TCUNI and TIMEUNIT: with one of its own astropy makes no Time of a column
            unit: if column.name == TIME { "" } else { fits_unit(column.unit) },
            ucd: ucd_in(column, &table.meta),
            description: fits_description(description_in(column, &table.meta), column.unit),
        });
        Self { heads: heads.collect(), rows: Rows::Table(table) }
    }

    fn of_pairs(pairs: &'a Provenance) -> Self {
        let head = |name: &str, description: &str, ucd: &str, width: usize| Head {
            name: name.into(),
            datatype: Datatype::Text,
            width: width.max(1),
            unit: "",
            ucd: ucd.into(),
            description: description.into(),
        };
        let widest = |text: fn(&(String, String)) -> &String| pairs.iter().map(|p| ascii(text(p)).len()).max();
        Self {
            heads: vec![
                head("KEY", "meta: of the table; config: of the run; manifest: of the run", "meta.id", {
                    widest(|p| &p.0).unwrap_or(1)
                }),
                head("VALUE", "its value", "meta.note", widest(|p| &p.1).unwrap_or(1)),
            ],
            rows: Rows::Pairs(pairs),
        }
    }

    fn len(&self) -> usize {
        match self.rows {
            Rows::Table(table) => table.records.len(),
            Rows::Pairs(pairs) => pairs.len(),
        }
    }

    /// Calls `take` with the index and the bytes of each row.
    fn each(&self, mut take: impl FnMut(usize, &[u8]) -> Result<()>) -> Result<()> {
        let mut bytes = Vec::new();
        for index in 0..self.len() {
            bytes.clear();
            match self.rows {
                Rows::Table(table) => {
                    for (cell, head) in table.cells(&table.records[index]).zip(&self.heads) {
                        push(&mut bytes, cell, head.width);
                    }
                }
                Rows::Pairs(pairs) => {
                    push(&mut bytes, Cell::Text(&pairs[index].0), self.heads[0].width);
                    push(&mut bytes, Cell::Text(&pairs[index].1), self.heads[1].width);
                }
            }
            take(index, &bytes)?;
        }
        Ok(())
    }
}

/// Appends a cell, big-endian; texts are padded with blanks.
fn push(bytes: &mut Vec<u8>, cell: Cell<'_>, width: usize) {
    match cell {
        Cell::Text(text) => {
            let end = bytes.len() + width;
            bytes.extend(ascii(text).as_bytes());
            bytes.resize(end, b' ');
        }
        Cell::Int64(value) => bytes.extend(value.unwrap_or(NULL_64).to_be_bytes()),
        Cell::Int32(value) => bytes.extend(value.unwrap_or(NULL_32).to_be_bytes()),
        Cell::Float64(value) => bytes.extend(value.unwrap_or(f64::NAN).to_be_bytes()),
    }
}

fn append(file: &mut NewFits, name: &str, columns: &Columns<'_>, meta: &Meta) -> Result<()> {
    let forms: Vec<_> = columns.heads.iter().map(|head| (ascii(&head.name), head.form())).collect();
    file.table(name, &forms, columns.len(), &header(columns, meta))?;
    columns.each(|index, row| file.row(index, row))?;
    file.checksum()
}

impl Head<'_> {
    fn form(&self) -> String {
        match self.datatype {
            Datatype::Text => format!("{}A", self.width),
            Datatype::Int64 => "K".into(),
            Datatype::Int32 => "J".into(),
            Datatype::Float64 => "D".into(),
        }
    }

    /// The cards that describe column `n`, counted from 1, beyond its name and form.
    fn cards(&self, n: usize) -> Vec<CardLine> {
        let key = |stem: &str| format!("{stem}{n}");
        let mut cards = Vec::new();
        match self.datatype {
            Datatype::Int64 => cards.push(card(&key("TNULL"), NULL_64, "missing")),
            Datatype::Int32 => cards.push(card(&key("TNULL"), i64::from(NULL_32), "missing")),
            Datatype::Text | Datatype::Float64 => {}
        }
        if !self.unit.is_empty() {
            cards.push(card(&key("TUNIT"), self.unit, ""));
        }
        if self.name.eq_ignore_ascii_case(TIME) {
            cards.push(card(&key("TCTYP"), "UTC", ""));
            cards.push(card(&key("TCUNI"), "d", ""));
            cards.push(card(&key("TRPOS"), "TOPOCENT", ""));
        }
        if !self.ucd.is_empty() {
            cards.push(card(&key("TUCD"), self.ucd.as_str(), ""));
        }
        cards.push(card(&key("TCOMM"), self.description.as_str(), ""));
        cards
    }
}

fn header(columns: &Columns<'_>, meta: &Meta) -> Vec<CardLine> {
    let mut cards = Vec::new();
    let timed = columns.heads.iter().any(|h| h.name.eq_ignore_ascii_case(TIME));
    if timed {
        cards.push(card("TIMESYS", "UTC", "time scale"));
        cards.push(card("MJDREF", 0.0, "[d] times are MJD"));
        cards.push(card("TIMEUNIT", "d", ""));
        cards.push(card("TREFPOS", "TOPOCENT", "times are those at the observatory"));
    }
    for (key, value) in meta.flat() {
        let (keyword, comment) = match key.as_str() {
            "site.lat_deg" if timed => ("OBSGEO-B", "[deg] geodetic latitude, WGS84"),
            "site.lon_deg" if timed => ("OBSGEO-L", "[deg] longitude, east positive"),
            "site.alt_m" if timed => ("OBSGEO-H", "[m] height above the ellipsoid"),
            "schema" => ("SCHEMA", "names and meaning of the columns"),
            "tool" => ("CREATOR", ""),
            "telescope" => ("TELESCOP", ""),
            "data_mode" => ("DATAMODE", "REAL or SIMULATED"),
            "mag_system" => ("MAGSYS", "system of the magnitudes"),
            _ => continue,
        };
        cards.push(match value.parse::<f64>() {
            Ok(number) if keyword.starts_with("OBSGEO") => card(keyword, number, comment),
            _ => card(keyword, value.as_str(), comment),
        });
    }
    cards.extend(columns.heads.iter().enumerate().flat_map(|(i, head)| head.cards(i + 1)));
    if timed {
        cards.extend(AS_TIME.iter().map(|line| card("COMMENT", *line, "")));
    }
    cards
}
