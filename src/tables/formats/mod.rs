//! A table of a run as text cells under the one schema, and the formats it can be written in.
//!
//! Cells are the texts of the ECSV file, so a number is written elsewhere with the digits it has there. An empty cell
//! is missing; none is NaN. Columns that the schema does not know are not written, and reported.

mod csv;
mod fits;
#[cfg(feature = "parquet")]
mod parquet;
mod provenance;
mod table;
mod units;
mod votable;

pub use table::{Cell, Table};

use ::csv::StringRecord;

use super::schema::{Datatype, Definition, PHOTOMETRY, PREDICTION, RESIDUALS, SKY, STARS};

pub use csv::write_csv;
pub use fits::{write_fits, write_fits_table};
#[cfg(feature = "parquet")]
pub use parquet::write_parquet;
pub use provenance::{Provenance, provenance};
pub use votable::write_votable;

/// The tables that can be recognised by their columns.
pub const KNOWN: [Definition; 5] = [PHOTOMETRY, STARS, RESIDUALS, PREDICTION, SKY];

/// The known table that has most of these column names, if it has at least half of them.
pub(crate) fn recognised(names: &StringRecord) -> Option<Definition> {
    let hits = |table: &Definition| table.columns.iter().filter(|c| names.iter().any(|n| n == c.name)).count();
    let missing = |table: &Definition| table.columns.len() - hits(table);
    KNOWN
        .into_iter()
        .max_by_key(|table| (hits(table), std::cmp::Reverse(missing(table))))
        .filter(|table| 2 * hits(table) >= table.columns.len())
}

impl Table {
    /// The cells of a row as values, in the order of the columns.
    pub fn cells<'a>(&'a self, record: &'a StringRecord) -> impl Iterator<Item = Cell<'a>> {
        self.columns.iter().enumerate().map(|(i, column)| {
            let text = record.get(i).unwrap_or_default();
            match column.datatype {
                Datatype::Text => Cell::Text(text),
                Datatype::Int64 => Cell::Int64(text.parse().ok()),
                Datatype::Int32 => Cell::Int32(text.parse().ok()),
                Datatype::Float64 => Cell::Float64(text.parse().ok().filter(|v: &f64| v.is_finite())),
            }
        })
    }

    /// The rows in typed form, by the names of the columns.
    ///
    /// # Errors
    /// Those of the reader of CSV; none for a table that was read under its schema.
    pub fn rows<T: serde::de::DeserializeOwned>(&self) -> Result<Vec<T>, ::csv::Error> {
        let names: StringRecord = self.columns.iter().map(|c| c.name).collect();
        self.records.iter().map(|record| record.deserialize(Some(&names))).collect()
    }
}
