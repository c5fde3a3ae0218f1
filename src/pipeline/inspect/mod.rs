//! One file as satphot reads it.

pub mod file;
pub mod inspector;
pub mod record;
pub(crate) mod wcs;
