//! From electrons to fluxes, stars and the zeropoint.
//!
//! Positions in full-frame pixels, 0-based, centre of the first pixel = 0. Fluxes in electrons. Knows no orbit, no model.

pub mod align;
pub mod aperture;
pub mod background;
pub mod catalogue;
pub mod centroid;
pub mod detect;
pub mod flags;
pub mod flux;
mod label;
mod smooth;
pub mod stats;
pub mod target;
mod target_flux;
mod target_search;
mod target_shape;
mod trail;
mod trail_model;
pub mod wcs;
pub mod zeropoint;

pub use flags::Flags;
