//! Satellites of components and the sensor.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod laws;
mod pictures;
mod render_cli;
mod sensor;
mod simulate_resolved;
