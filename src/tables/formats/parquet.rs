//! A table as Parquet, for pandas and polars: units, UCDs and descriptions in the metadata of the fields.
//!
//! Snappy, row groups of 65536 rows; missing is null. The meta block is in the metadata of the file under its dotted
//! keys. Only with the feature `parquet`. Dictionaries of categories are not written.

use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int32Array, Int64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;

use super::table::Cell;
use super::table::Table;
use crate::tables::bands::{description_in, ucd_in};
use crate::tables::schema::Datatype;

/// Rows turned into columns at a time.
const BATCH: usize = 65_536;

/// Writes `table` as Parquet.
///
/// # Errors
/// Those of `out`.
pub fn write_parquet(out: &mut (impl Write + Send), table: &Table) -> io::Result<()> {
    let fields: Vec<Field> = table
        .columns
        .iter()
        .map(|column| {
            let datatype = match column.datatype {
                Datatype::Text => DataType::Utf8,
                Datatype::Int64 => DataType::Int64,
                Datatype::Int32 => DataType::Int32,
                Datatype::Float64 => DataType::Float64,
            };
            let ucd = ucd_in(column, &table.meta);
            let description = description_in(column, &table.meta);
            let metadata = [("unit", column.unit), ("ucd", ucd.as_str()), ("description", description.as_str())];
            let metadata =
                metadata.into_iter().filter(|(_, v)| !v.is_empty()).map(|(k, v)| (k.to_owned(), v.to_owned()));
            Field::new(column.name, datatype, true).with_metadata(HashMap::from_iter(metadata))
        })
        .collect();
    let schema = Arc::new(Schema::new(fields));
    let meta = table.meta.flat().into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("satphot ", env!("CARGO_PKG_VERSION")).into())
        .set_max_row_group_row_count(Some(BATCH))
        .set_key_value_metadata(Some(meta))
        .build();
    let mut writer = ArrowWriter::try_new(out, schema.clone(), Some(properties)).map_err(io::Error::other)?;
    for records in table.records.chunks(BATCH) {
        let rows: Vec<Vec<Cell<'_>>> = records.iter().map(|r| table.cells(r).collect()).collect();
        let columns = (0..table.columns.len()).map(|i| array(rows.iter().map(|r| r[i]), table.columns[i].datatype));
        let batch = RecordBatch::try_new(schema.clone(), columns.collect()).map_err(io::Error::other)?;
        writer.write(&batch).map_err(io::Error::other)?;
    }
    writer.close().map_err(io::Error::other)?;
    Ok(())
}

/// One column; what is missing is null.
fn array<'a>(cells: impl Iterator<Item = Cell<'a>>, datatype: Datatype) -> ArrayRef {
    match datatype {
        Datatype::Text => Arc::new(StringArray::from_iter(cells.map(|c| match c {
            Cell::Text(text) if !text.is_empty() => Some(text),
            _ => None,
        }))),
        Datatype::Int64 => Arc::new(Int64Array::from_iter(cells.map(|c| match c {
            Cell::Int64(value) => value,
            _ => None,
        }))),
        Datatype::Int32 => Arc::new(Int32Array::from_iter(cells.map(|c| match c {
            Cell::Int32(value) => value,
            _ => None,
        }))),
        Datatype::Float64 => Arc::new(Float64Array::from_iter(cells.map(|c| match c {
            Cell::Float64(value) => value,
            _ => None,
        }))),
    }
}
