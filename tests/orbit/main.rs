//! Elements, propagation, passes, sky.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod elements;
mod formats;
mod passes;
mod rotation;
mod sgp4;
mod sky;
mod whole_passes;
