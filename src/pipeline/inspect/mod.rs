//! One file as it was understood.

pub mod file;
pub mod record;
pub(crate) mod wcs;
