//! The products of a run, their provenance, and whether they are complete.

#[cfg(feature = "report")]
pub mod curve;
pub mod effective;
pub mod inputs;
pub mod lock;
pub mod log;
pub mod manifest;
pub mod meta;
pub mod outputs;
#[cfg(feature = "report")]
pub mod page;
pub mod provenance;
pub mod record;
pub mod summary;
pub mod verify;
