//! satphot: photometry of tracked satellites, from a night's raw FITS files to calibrated magnitudes, and from
//! orbit and geometry to predicted magnitudes under Sunlight, Earthshine, Moonlight and Lunar-Earthshine.
//!
//! The library computes and returns; it never prints, never exits and never reads the clock.
//! Units are in the names; inside functions radians and km, at the edges (TOML, tables) degrees.

pub mod accuracy;
pub mod astrometry;
pub mod base;
pub mod brightness;
pub mod config;
pub mod detector;
pub mod export;
pub mod fetch;
pub mod figures;
pub mod fits;
pub mod frames;
pub mod orbit;
pub mod paper;
pub mod photometry;
pub mod pipeline;
pub mod report;
pub mod resolved;
pub mod simulate;
pub mod tables;
pub mod visibility;
pub mod zeropoint;

pub use base::error::{Error, Result};
