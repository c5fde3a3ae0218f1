//! What header keywords mean: the synonyms of every camera program, their units, signs and traps.
//!
//! One function per quantity; each gives the value with the keyword it is from and words on anything odd. Units in the
//! names. It does not cover times (`clock`) and the decision what a frame is for (`exposure`).

mod angle;
mod camera;
mod dump;
mod exposure_time;
mod gain;
mod image;
mod names;
pub(crate) mod optics;
mod site;
mod sourced;

pub use sourced::Sourced;

pub(crate) use angle::sexagesimal;
pub use camera::{CameraCheck, check_camera};
pub use dump::{AnyHeader, header_files, read_any};
pub use exposure_time::exposure_time;
pub use gain::{HeaderGain, header_gain};
pub use image::{Calibration, binning, calibration, colour, cube, green_pixels, row_order, stack};
pub use names::{Aliases, find, keywords};
pub use optics::{Optics, filter, optics};
pub use site::{HeaderSite, SiteCheck, check_site, header_site};
