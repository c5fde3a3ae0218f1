//! Tables and plots, drawn from results alone.
//!
//! Rows in, files out: ECSV tables by one schema ([`columns`]), SVG figures from the rows of those tables, the gallery of
//! cutouts, the text of the closing summary. Magnitudes, degrees and kilometres as in the files. Computes no photometry and no model.

pub mod gallery;
pub mod page;
pub mod summary;

pub use crate::base::file::{write_atomic, write_streamed};

pub use gallery::write_gallery;
