//! A table as VOTable 1.4 with TABLEDATA: units, UCDs, the time system, and the meta block as PARAMs.
//!
//! Missing cells are empty, as 1.3 and later allow for every type. Source: IVOA VOTable 1.4 (2019), VOUnits 1.0.
//! Not written: BINARY2, and more than one table per file.

use std::io::{self, Write};

use super::table::Table;
use super::units::vo_unit;
use crate::tables::bands::{description_in, ucd_in};
use crate::tables::schema::Datatype;

/// Writes `table` as VOTable.
///
/// # Errors
/// Those of `out`.
pub fn write_votable(out: &mut impl Write, table: &Table) -> io::Result<()> {
    out.write_all(
        b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
          <VOTABLE version=\"1.4\" xmlns=\"http://www.ivoa.net/xml/VOTable/v1.3\" \
          xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">\n\
          <RESOURCE type=\"results\">\n",
    )?;
    let timed = table.columns.iter().any(|c| c.name == "mjd_mid_d");
    if timed {
        // MJD-origin and TOPOCENTER are words of the standard
        out.write_all(
            b"<TIMESYS ID=\"mjd_utc\" timeorigin=\"MJD-origin\" timescale=\"UTC\" refposition=\"TOPOCENTER\"/>\n",
        )?;
    }
    writeln!(out, "<TABLE name=\"{}\" nrows=\"{}\">", escaped(table.name), table.records.len())?;
    for (key, value) in table.meta.flat() {
        writeln!(
            out,
            "<PARAM name=\"{}\" datatype=\"unicodeChar\" arraysize=\"*\" value=\"{}\"/>",
            escaped(&key),
            escaped(&value)
        )?;
    }
    for (i, column) in table.columns.iter().enumerate() {
        let (datatype, array) = match column.datatype {
            Datatype::Text => ("unicodeChar", " arraysize=\"*\""),
            Datatype::Int64 => ("long", ""),
            Datatype::Int32 => ("int", ""),
            Datatype::Float64 => ("double", ""),
        };
        // an ID is a name of XML, which those of foreign columns need not be
        let is_id = column.name.starts_with(|c: char| c.is_ascii_alphabetic())
            && column.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let id = if is_id { column.name.to_owned() } else { format!("column_{}", i + 1) };
        let name = escaped(column.name);
        write!(out, "<FIELD ID=\"{id}\" name=\"{name}\" datatype=\"{datatype}\"{array}")?;
        let ucd = ucd_in(column, &table.meta);
        for (attribute, value) in [("unit", vo_unit(column.unit)), ("ucd", ucd.as_str())] {
            if !value.is_empty() {
                write!(out, " {attribute}=\"{}\"", escaped(value))?;
            }
        }
        if column.name == "mjd_mid_d" {
            write!(out, " ref=\"mjd_utc\"")?;
        }
        writeln!(out, "><DESCRIPTION>{}</DESCRIPTION></FIELD>", escaped(&description_in(column, &table.meta)))?;
    }
    out.write_all(b"<DATA><TABLEDATA>\n")?;
    for record in &table.records {
        out.write_all(b"<TR>")?;
        for cell in record {
            write!(out, "<TD>{}</TD>", escaped(cell))?;
        }
        out.write_all(b"</TR>\n")?;
    }
    out.write_all(b"</TABLEDATA></DATA>\n</TABLE>\n</RESOURCE>\n</VOTABLE>\n")
}

/// Text for XML 1.0: the five characters it reserves, and a mark for those it cannot hold.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            // line ends would be changed to blanks inside an attribute
            '\t' => out.push_str("&#9;"),
            '\n' => out.push_str("&#10;"),
            '\r' => out.push_str("&#13;"),
            c if (c < ' ') || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}
