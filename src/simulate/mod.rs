//! `satphot simulate`: a synthetic night with flats, star pointings, tracked target frames and the truth.
//!
//! Every random number comes from a stream of the scenario's seed that belongs to one frame and one row, so the bytes
//! do not depend on the number of threads. It does not cover optical distortion, charge transfer, dark current, clouds.

mod catalogue_trails;
mod field;
mod flux;
mod frames;
mod noise;
mod parts;
mod render;
mod resolved;
mod satellites;
mod scenario;
mod tracked;
mod truth;

pub use frames::{Simulated, simulate};
pub use scenario::{PsfKind, Scenario};
