//! A night as a FITS file: an empty primary HDU and three binary tables, PHOTOMETRY, ZEROPOINT, PROVENANCE.
//!
//! Columns as in the schema, in upper case. Strings `nA`, whole numbers `K` and `J` with TNULL, numbers `D` with NaN
//! for missing (FITS has no other mark for it). The column of times carries the keywords by which astropy makes it a
//! Time. Source: FITS Standard 4.0, sections 7.3 and 9. Leaves out variable-length columns.

use std::io::{self, Write};

use super::Provenance;
use super::table::Cell;
use super::table::Table;
use super::units::fits_unit;
use crate::fits::card_out::{BLOCK, Cards, Sum, ascii};
use crate::tables::bands::{description_in, ucd_in};
use crate::tables::meta::Meta;
use crate::tables::schema::Datatype;

/// Writes `table`, the star measurements behind its zeropoint (none: an HDU without rows) and its provenance.
///
/// # Errors
/// Those of `out`.
pub fn write_fits(
    out: &mut impl Write,
    table: &Table,
    stars: Option<&Table>,
    provenance: &Provenance,
) -> io::Result<()> {
    let mut primary = Cards::default();
    primary
        .value("SIMPLE", "T", "FITS 4.0")
        .value("BITPIX", "8", "")
        .value("NAXIS", "0", "no image")
        .value("EXTEND", "T", "tables follow")
        .text("ORIGIN", "satphot", "")
        .comment("Text that is not ASCII, and the backslash, are escaped as in JSON.")
        .comment("A number that is missing is NaN, a whole number TNULL, a text blank.");
    out.write_all(&primary.finished(0))?;
    hdu(out, &table.name.to_uppercase(), &Columns::of(table), &table.meta)?;
    let none = Table { name: "stars", columns: crate::tables::schema::STARS.columns.to_vec(), ..Table::default() };
    let stars = stars.unwrap_or(&none);
    hdu(out, "ZEROPOINT", &Columns::of(stars), &table.meta)?;
    hdu(out, "PROVENANCE", &Columns::of_pairs(provenance), &Meta::default())
}

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
            unit: fits_unit(column.unit),
            ucd: ucd_in(column, &table.meta),
            description: description_in(column, &table.meta),
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

    /// Calls `take` with the bytes of each row.
    fn each(&self, mut take: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        let mut bytes = Vec::new();
        match self.rows {
            Rows::Table(table) => {
                for record in &table.records {
                    bytes.clear();
                    for (cell, head) in table.cells(record).zip(&self.heads) {
                        push(&mut bytes, cell, head.width);
                    }
                    take(&bytes)?;
                }
            }
            Rows::Pairs(pairs) => {
                for (key, value) in pairs {
                    bytes.clear();
                    push(&mut bytes, Cell::Text(key), self.heads[0].width);
                    push(&mut bytes, Cell::Text(value), self.heads[1].width);
                    take(&bytes)?;
                }
            }
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

/// One binary table: header, rows, zeros up to the end of the block.
fn hdu(out: &mut impl Write, name: &str, columns: &Columns<'_>, meta: &Meta) -> io::Result<()> {
    let row_bytes: usize = columns.heads.iter().map(|h| h.width).sum();
    let mut sum = Sum::default();
    columns.each(|row| {
        sum.add(row);
        Ok(())
    })?;
    out.write_all(&header(name, columns, row_bytes, meta).finished(sum.total()))?;
    columns.each(|row| out.write_all(row))?;
    let data = row_bytes * columns.len();
    out.write_all(&vec![0; data.div_ceil(BLOCK) * BLOCK - data])
}

fn header(name: &str, columns: &Columns<'_>, row_bytes: usize, meta: &Meta) -> Cards {
    let mut cards = Cards::default();
    cards
        .text("XTENSION", "BINTABLE", "binary table")
        .value("BITPIX", "8", "bytes")
        .value("NAXIS", "2", "")
        .value("NAXIS1", &row_bytes.to_string(), "bytes of a row")
        .value("NAXIS2", &columns.len().to_string(), "rows")
        .value("PCOUNT", "0", "")
        .value("GCOUNT", "1", "")
        .value("TFIELDS", &columns.heads.len().to_string(), "columns")
        .text("EXTNAME", name, "");
    let timed = columns.heads.iter().any(|h| h.name == "MJD_MID_D");
    if timed {
        cards
            .text("TIMESYS", "UTC", "time scale")
            .value("MJDREF", "0.0", "[d] times are MJD")
            .text("TIMEUNIT", "d", "")
            .text("TREFPOS", "TOPOCENT", "times are those at the observatory");
    }
    for (key, value) in meta.flat() {
        let (card, comment) = match key.as_str() {
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
        match value.parse::<f64>() {
            Ok(number) if card.starts_with("OBSGEO") => cards.value(card, &format!("{number:?}"), comment),
            _ => cards.text(card, &value, comment),
        };
    }
    for (i, head) in columns.heads.iter().enumerate() {
        let n = i + 1;
        let key = |stem: &str| format!("{stem}{n}");
        cards.text(&key("TTYPE"), &head.name, "");
        let form = match head.datatype {
            Datatype::Text => format!("{}A", head.width),
            Datatype::Int64 => "K".into(),
            Datatype::Int32 => "J".into(),
            Datatype::Float64 => "D".into(),
        };
        cards.text(&key("TFORM"), &form, "");
        match head.datatype {
            Datatype::Int64 => cards.value(&key("TNULL"), &NULL_64.to_string(), "missing"),
            Datatype::Int32 => cards.value(&key("TNULL"), &NULL_32.to_string(), "missing"),
            _ => &mut cards,
        };
        if !head.unit.is_empty() {
            cards.text(&key("TUNIT"), head.unit, "");
        }
        if head.name == "MJD_MID_D" {
            cards.text(&key("TCTYP"), "UTC", "").text(&key("TCUNI"), "d", "").text(&key("TRPOS"), "TOPOCENT", "");
        }
        if !head.ucd.is_empty() {
            cards.text(&key("TUCD"), &head.ucd, "");
        }
        cards.text(&key("TCOMM"), &head.description, "");
    }
    cards
}
