//! A table as plain CSV: one line of names, one line per row, nothing for missing.
//!
//! Units are in the names of the columns. Leaves out everything else the table says about itself.

use std::io::{self, Write};

use ::csv::{QuoteStyle, WriterBuilder};

use super::table::Table;

/// Writes `table` as comma-separated values, RFC 4180 with lines that end in LF.
///
/// # Errors
/// Those of `out`.
pub fn write_csv(out: &mut impl Write, table: &Table) -> io::Result<()> {
    let mut writer = WriterBuilder::new().quote_style(QuoteStyle::Necessary).from_writer(out);
    writer.write_record(table.columns.iter().map(|c| c.name)).map_err(io::Error::other)?;
    for record in &table.records {
        writer.write_record(record).map_err(io::Error::other)?;
    }
    writer.flush()
}
