//! The tracked satellite in its frame: found, outlined, measured.

pub(crate) mod artefacts;
mod blocks;
pub(crate) mod bound;
mod bumps;
pub(crate) mod cells;
pub mod compact;
pub(crate) mod cosmic_rays;
pub(crate) mod cutout;
pub(crate) mod cutout_trails;
pub(crate) mod enclose;
pub(crate) mod flux;
pub(crate) mod images;
pub(crate) mod limit;
mod line_sums;
pub mod measure;
pub(crate) mod placed;
pub(crate) mod point;
pub(crate) mod psf;
pub(crate) mod search;
pub(crate) mod segment;
pub mod settings;
pub(crate) mod shape;
pub(crate) mod sharpness;
pub(crate) mod sky;
pub(crate) mod track;
