//! The satellites satphot knows by name, its own and the user's: areas, attitudes, scattering, and where each number is
//! from.
//!
//! Areas in m². The numbers themselves are in `presets/satellites.toml`; a file of the user has the same form.

mod entry;
mod list;
mod standing;

pub use list::Satellite;

pub use list::{Catalogue, catalogue_names, catalogue_toml};

pub use entry::{Component, ComponentSum, Counts, Entry, Fitted, Shell, Span};
pub use standing::{NOT_COMPARED, Standing};
