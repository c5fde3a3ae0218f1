//! A table as plain CSV: one line of names, one line per row, nothing for missing.
//!
//! Units are in the names of the columns. A text that a spreadsheet would compute (`=1+1`) gets an apostrophe in front. The metadata of the table
//! are not written.

use std::io::{self, Write};

use ::csv::{QuoteStyle, WriterBuilder};

use super::table::Table;
use crate::base::foreign::cell;
use crate::tables::schema::Datatype;

/// Writes `table` as comma-separated values, RFC 4180 with lines that end in LF.
///
/// # Errors
/// Those of `out`.
pub fn write_csv(out: &mut impl Write, table: &Table) -> io::Result<()> {
    let mut writer = WriterBuilder::new().quote_style(QuoteStyle::Necessary).from_writer(out);
    writer.write_record(table.columns.iter().map(|c| c.name)).map_err(io::Error::other)?;
    for record in &table.records {
        let cells = table.columns.iter().zip(record).map(|(column, text)| match column.datatype {
            Datatype::Text => cell(text),
            _ => text.into(),
        });
        for text in cells {
            writer.write_field(&*text).map_err(io::Error::other)?;
        }
        writer.write_record(None::<&[u8]>).map_err(io::Error::other)?;
    }
    writer.flush()
}
