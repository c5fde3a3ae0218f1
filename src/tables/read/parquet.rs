//! Parquet, as pandas, polars, astropy and DuckDB write it: columns of plain values as cells of text.
//!
//! A moment with a zone is UTC in the file and read as such; one without is read as a text would be. Units and UCDs are taken
//! from the metadata of the fields, as satphot writes them, and from the header that astropy keeps in the file. Not supported,
//! with a note: columns of lists and records; astropy's `Time` of two numbers.

use std::fs::File;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use arrow_array::cast::AsArray;
use arrow_array::{Array, StringArray};
use arrow_cast::{can_cast_types, cast};
use arrow_schema::{DataType, Schema, TimeUnit};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};

use super::header::ecsv;
use super::{Column, Row, Rows, Table, bad, most_columns};
use crate::base::error::{Error, Result};
use crate::tables::schema::Datatype;

/// Rows decoded at a time.
const BATCH: usize = 4096;

/// The rows of a Parquet file.
pub struct ParquetRows {
    /// The decoder; the lock is never taken, it lets threads share the table while none reads.
    reader: Mutex<ParquetRecordBatchReader>,
    /// The cells of the rows in work, one array a column.
    batch: Vec<StringArray>,
    /// The next row of `batch`, and how many it has.
    next: usize,
    len: usize,
    number: usize,
}

impl std::fmt::Debug for ParquetRows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ParquetRows").field("number", &self.number).finish_non_exhaustive()
    }
}

/// Opens a Parquet file.
pub fn open(path: &Path, file: File) -> Result<Table> {
    let damaged = |e: &dyn std::fmt::Display| bad(path, None, format!("damaged Parquet file: {e}"));
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| damaged(&e))?;
    let schema = Arc::clone(builder.schema());
    most_columns(schema.fields().len()).map_err(|problem| bad(path, None, problem))?;
    let (mut kept, mut notes) = (Vec::new(), Vec::new());
    for (i, field) in schema.fields().iter().enumerate() {
        if field.data_type().is_nested() || !can_cast_types(&plain(field.data_type()), &DataType::Utf8) {
            notes.push(format!("column {} holds {} in each cell; left out", field.name(), field.data_type()));
        } else {
            kept.push(i);
        }
    }
    let columns = columns(&schema, &kept);
    let mask = ProjectionMask::roots(builder.parquet_schema(), kept);
    let reader = builder.with_projection(mask).with_batch_size(BATCH).build().map_err(|e| damaged(&e))?;
    let rows = ParquetRows { reader: Mutex::new(reader), batch: Vec::new(), next: 0, len: 0, number: 0 };
    Ok(Table { path: path.to_owned(), columns, notes, rows: Rows::Parquet(Box::new(rows)) })
}

/// The kept fields, with what the file says of them.
fn columns(schema: &Schema, kept: &[usize]) -> Vec<Column> {
    let lines = |text: &String| text.lines().map(str::to_owned).collect::<Vec<String>>();
    let described = schema.metadata().get("table_meta_yaml").map(|text| ecsv(&lines(text)).0).unwrap_or_default();
    let column = |i: &usize| {
        let field = schema.field(*i);
        let said = described.iter().find(|c| c.name == *field.name());
        let stated = |key: &str| field.metadata().get(key).cloned().filter(|text| !text.is_empty());
        let mut column = Column::named(field.name());
        if let Some(unit) = stated("unit").or_else(|| said.map(|c| c.unit.clone()).filter(|u| !u.is_empty())) {
            column.unit = unit;
        }
        column.ucd = stated("ucd").or_else(|| said.map(|c| c.ucd.clone())).unwrap_or_default();
        column.time_scale = said.map(|c| c.time_scale.clone()).unwrap_or_default();
        if matches!(field.data_type(), DataType::Timestamp(_, Some(_))) {
            column.time_scale = "utc".to_owned();
        }
        column.datatype = match field.data_type() {
            t if t.is_integer() => Some(Datatype::Int64),
            t if t.is_floating() => Some(Datatype::Float64),
            _ => Some(Datatype::Text),
        };
        column
    };
    kept.iter().map(column).collect()
}

/// The type of the values where a zone, which is only how they are shown, is taken off a moment.
fn plain(datatype: &DataType) -> DataType {
    match datatype {
        DataType::Timestamp(unit, Some(_)) => DataType::Timestamp(*unit, None),
        other => other.clone(),
    }
}

/// A moment without its zone: the numbers are UTC whatever the zone.
fn without_zone(array: &dyn Array) -> Option<arrow_array::ArrayRef> {
    use arrow_array::types::{
        TimestampMicrosecondType as Us, TimestampMillisecondType as Ms, TimestampNanosecondType as Ns,
        TimestampSecondType as S,
    };
    let DataType::Timestamp(unit, Some(_)) = array.data_type() else { return None };
    Some(match unit {
        TimeUnit::Second => Arc::new(array.as_primitive::<S>().clone().with_timezone_opt(None::<Arc<str>>)),
        TimeUnit::Millisecond => Arc::new(array.as_primitive::<Ms>().clone().with_timezone_opt(None::<Arc<str>>)),
        TimeUnit::Microsecond => Arc::new(array.as_primitive::<Us>().clone().with_timezone_opt(None::<Arc<str>>)),
        TimeUnit::Nanosecond => Arc::new(array.as_primitive::<Ns>().clone().with_timezone_opt(None::<Arc<str>>)),
    })
}

impl ParquetRows {
    /// The next row; `false` at the end.
    pub fn read(&mut self, path: &Path, row: &mut Row) -> Result<bool> {
        while self.next == self.len {
            if !self.decode(path)? {
                return Ok(false);
            }
        }
        for column in &self.batch {
            row.cells.push_field(if column.is_null(self.next) { "" } else { column.value(self.next).trim() });
        }
        self.next += 1;
        self.number += 1;
        row.line = self.number;
        Ok(true)
    }

    /// The next rows as texts; `false` where there are none.
    fn decode(&mut self, path: &Path) -> Result<bool> {
        let at = self.number + 1;
        let damaged = |e: &dyn std::fmt::Display| Error::Table {
            path: path.to_owned(),
            line: None,
            problem: format!("damaged Parquet file from row {at} on: {e}"),
        };
        let reader = self.reader.get_mut().unwrap_or_else(PoisonError::into_inner);
        let Some(batch) = reader.next() else { return Ok(false) };
        let batch = batch.map_err(|e| damaged(&e))?;
        self.batch.clear();
        for array in batch.columns() {
            let array = without_zone(array).unwrap_or_else(|| Arc::clone(array));
            let texts = cast(&array, &DataType::Utf8).map_err(|e| damaged(&e))?;
            self.batch.push(texts.as_string::<i32>().clone());
        }
        (self.next, self.len) = (0, batch.num_rows());
        Ok(true)
    }
}
