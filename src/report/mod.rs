//! Tables and plots, drawn from results alone.
//!
//! Rows in, files out: ECSV tables by one schema ([`columns`]), SVG figures from the rows of those tables, the gallery of
//! cutouts, the text of the closing summary. Magnitudes, degrees and kilometres as in the files. Computes no photometry and no model.

pub mod accuracy;
pub mod columns;
pub mod ecsv;
pub mod explain;
mod file;
pub mod gallery;
pub mod inspect;
pub mod meta;
pub mod plot;
pub mod rows;
pub mod summary;
pub mod thumb;

pub use columns::{Column, Datatype};
pub use ecsv::{
    prediction_cells, read_photometry, read_residuals, read_stars, write_photometry, write_prediction, write_residuals,
    write_sky, write_stars,
};
pub use file::write_atomic;
pub use gallery::write_gallery;
pub use meta::{Meta, MetaValue};
pub use rows::{AccuracyRow, ExtremeRow, PhotometryRow, ResidualRow, SkyRow, StarRow};
pub use thumb::Thumb;
