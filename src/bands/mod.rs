//! The pass bands of calibrated magnitudes: their names, magnitude systems and descriptors.
//!
//! What observers write under FILTER is in `filter`, what catalogues call their columns in `column`. Does not cover
//! transmission curves, which are the model's ([`crate::brightness::Band`]).

mod band;
mod calibrated;
mod colour;
mod column;
mod filter;
mod gaia;
mod sun;
#[cfg(test)]
mod tests;

pub use band::Band;
pub use calibrated::{CalibratedBand, How, Light};
pub use colour::ColourIndex;
pub use column::column_band;
pub use filter::{Meaning, filter_meaning};
pub use gaia::GaiaRelation;
