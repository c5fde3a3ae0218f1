//! What was skipped in scenes and frames, computed all the same on a sample and timed.
//!
//! CPU seconds from the caller's clock, magnitudes. The answers already given are not touched. An Earth-reflected
//! integral that was skipped is timed by a plain rule of 576 nodes over all ground in view.

mod cases;
mod frames;
mod scenes;
pub mod text;
mod timing;

pub use scenes::{explain_low_rows, explain_scenes};

pub use cases::CasesLeftOut;
pub use frames::explain_night;
