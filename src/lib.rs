//! satphot: photometry of tracked satellites, from a night's raw FITS files to calibrated magnitudes, and from
//! orbit and geometry to predicted magnitudes under Sunlight, Earthshine, Moonlight and Lunar-Earthshine.
//!
//! The library computes and returns; it never prints, never exits and never reads the clock.
//! Units are in the names; inside functions radians and km, at the edges (TOML, tables) degrees.

pub mod accuracy;
pub mod brightness;
pub mod config;
pub mod constants;
pub mod detect;
pub mod error;
pub mod fetch;
pub mod file;
pub mod frames;
pub mod instant;
pub mod night;
pub mod orbit;
pub mod photometry;
pub mod published;
pub mod report;
pub mod resolved;
pub mod vector;

pub use error::{Error, Result};
