//! A table in memory: columns, cells, meta.

use crate::tables::meta::Meta;
use crate::tables::schema::Column;
use ::csv::StringRecord;

/// One table: its columns, its rows as texts in the order of the columns, its meta block.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// `photometry`, `stars`, `residuals`, `prediction` or `sky`.
    pub name: &'static str,
    /// The columns, in order.
    pub columns: Vec<Column>,
    /// The rows: one text per column, checked against its type.
    pub records: Vec<StringRecord>,
    /// What the table says about itself.
    pub meta: Meta,
    /// Columns of the file that the schema does not know.
    pub ignored: Vec<String>,
}

/// One cell as a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// Text; empty = missing.
    Text(&'a str),
    /// A whole number of 64 bits, or missing.
    Int64(Option<i64>),
    /// A mask of 32 bits, or missing.
    Int32(Option<i32>),
    /// A finite number, or missing.
    Float64(Option<f64>),
}
