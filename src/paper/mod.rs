//! What the paper prints, next to what is computed here: Caddy et al., "The First Observations of Moonlit Satellites".
//!
//! One row per published number: as printed, as its own formula and inputs give it, as the physics gives it, a verdict
//! and the reason. Every value is computed by the library; none is stored. Units are in the row.

mod areas;
mod calendar;
mod context;
mod entry;
#[cfg(feature = "report")]
pub mod figures;
pub mod labels;
mod limits;
mod literature;
pub mod local_time;
mod magnitudes;
mod model;
mod moon;
pub mod pass_check;
pub mod pass_rows;
mod passes;
pub mod resolved_case;
mod rule;
mod scattering;
mod stk;
mod streaks;
pub mod table;
pub mod trackers;

pub use context::Context;
pub use entry::{Basis, Entry, Numbers, Published, Verdict};
pub use rule::Rule;

use rayon::prelude::*;

use crate::base::error::Result;

/// Every row, in the order of the paper.
#[must_use]
pub fn entries() -> Vec<Entry> {
    [
        magnitudes::ROWS,
        areas::ROWS,
        moon::ROWS,
        passes::ROWS,
        model::ROWS,
        calendar::ROWS,
        limits::ROWS,
        streaks::ROWS,
        stk::ROWS,
        scattering::ROWS,
        literature::ROWS,
    ]
    .concat()
}

/// Computes every row; `full` also those that take longer than a second, which are left empty otherwise.
///
/// # Errors
/// Those of the library.
pub fn published(full: bool) -> Result<Vec<Published>> {
    let context = Context::new()?;
    entries().par_iter().map(|entry| entry.computed(&context, full)).collect()
}
