//! Tables and plots, drawn from results alone.
//!
//! Rows in, files out: ECSV tables by one schema ([`columns`]), SVG figures from the rows of those tables, the gallery of
//! cutouts, the text of the closing summary. Magnitudes, degrees and kilometres as in the files. Computes no photometry and no model.

pub mod accuracy;
mod coast;
pub mod columns;
mod density;
pub mod earth;
pub mod ecsv;
pub mod explain;
pub mod export;
pub mod footprint;
pub mod forecast;
pub mod gallery;
pub mod inspect;
pub mod limits;
pub mod meta;
pub mod moon_laws;
pub mod page;
pub mod plot;
pub mod published;
pub mod radiance;
mod raster;
pub mod rows;
pub mod streak;
pub mod summary;
pub mod tables;
pub mod thumb;
pub mod ucd;
pub mod words;

pub use crate::file::{write_atomic, write_streamed};
pub use columns::{Column, Datatype};
pub use ecsv::{
    csv_text, prediction_cells, read_meta, read_photometry, read_residuals, read_rows, read_stars, read_table,
    write_cells, write_photometry, write_prediction, write_residuals, write_rows, write_sky, write_stars,
};
pub use gallery::write_gallery;
pub use meta::{Meta, MetaValue};
pub use rows::{AccuracyRow, ExtremeRow, PhotometryRow, ResidualRow, SkyRow, StarRow};
pub use tables::Table;
pub use thumb::Thumb;
