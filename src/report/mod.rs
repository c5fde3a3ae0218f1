//! The page of a night or a campaign, the gallery of its frames, and the text of the closing summary.
//!
//! Drawn from the rows of the tables alone: magnitudes, degrees and kilometres as in the files.

pub mod gallery;
pub mod page;
pub mod summary;

pub use gallery::write_gallery;
