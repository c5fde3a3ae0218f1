//! Every table of satphot: its columns, its rows, and the formats it is read from and written in.

pub mod columns;
pub mod ecsv;
pub mod flags;
pub mod formats;
pub mod meta;
pub mod read;
pub mod row_passes;
pub mod rows;
pub mod selection;
pub mod ucd;
pub mod words;

pub use columns::{Column, Datatype};
pub use ecsv::{
    csv_text, prediction_cells, read_meta, read_photometry, read_residuals, read_rows, read_stars, read_table,
    write_cells, write_photometry, write_prediction, write_residuals, write_rows, write_sky, write_stars,
};
pub use formats::Table;
pub use meta::{Meta, MetaValue};
pub use rows::{AccuracyRow, ExtremeRow, PhotometryRow, ResidualRow, SkyRow, StarRow};
