//! Which file is what, and whether the files belong together: roles, filter, camera, satellite, pixel scale.

pub(crate) mod damage;
pub mod files;
pub mod filters;
pub mod findings;
pub mod header_checks;
pub mod header_warnings;
pub(crate) mod instrument;
pub mod preflight;
pub mod read;
pub mod satellite;
pub mod scale;
