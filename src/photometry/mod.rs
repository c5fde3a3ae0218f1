//! From electrons to fluxes, stars and the zeropoint.
//!
//! Positions in full-frame pixels, 0-based, centre of the first pixel = 0. Fluxes in electrons. Knows no orbit, no model.

pub mod align;
pub mod catalogue;
pub mod flags;
pub mod wcs;
pub mod zeropoint;

pub use flags::Flags;
