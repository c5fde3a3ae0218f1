//! From electrons to fluxes, stars and the zeropoint.
//!
//! Positions in full-frame pixels, 0-based, centre of the first pixel = 0. Fluxes in electrons. Knows no orbit, no model.

pub mod align;
mod annulus;
pub mod aperture;
pub mod background;
pub mod bands;
pub mod catalogue;
pub mod centroid;
mod clip;
mod contamination;
pub mod detect;
pub mod flags;
pub mod flux;
pub mod growth;
mod label;
mod net;
pub mod plate;
mod smooth;
pub mod stats;
pub mod surface_brightness;
pub mod table;
pub mod target;
mod target_cells;
mod target_cutout;
mod target_enclose;
mod target_flux;
mod target_hit;
mod target_search;
mod target_segment;
mod target_shape;
mod target_sky;
mod threshold;
mod trail;
mod trail_bend;
mod trail_known;
mod trail_model;
mod trail_search;
mod trail_turn;
mod trail_under;
pub mod wcs;
pub mod zeropoint;

pub use flags::Flags;
