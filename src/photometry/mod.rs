//! From electrons to fluxes, stars and the zeropoint.
//!
//! Positions in full-frame pixels, 0-based, centre of the first pixel = 0. Fluxes in electrons. Knows no orbit, no model.

mod annulus;
pub mod aperture;
pub mod background;
pub mod center_of_light;
pub mod centroid;
mod clip;
pub mod detect;
pub mod flux;
pub mod growth;
mod label;
mod net;
pub mod pass;
mod rows;
mod smooth;
pub mod surface_brightness;
pub mod target;
mod threshold;
pub mod trails;

pub use crate::tables::flags::Flags;
