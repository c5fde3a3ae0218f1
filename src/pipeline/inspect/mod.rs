//! One file as it was understood.

pub mod file;
pub mod inspector;
pub mod record;
pub(crate) mod wcs;
