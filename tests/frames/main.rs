//! Frames, headers and detectors, whole and damaged.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../frames_support/mod.rs"]
mod frames_support;
#[path = "../support/headers.rs"]
mod headers;
#[path = "../support/mod.rs"]
mod support;

mod bad;
mod detector_adc;
mod detector_cli;
mod detector_transfer;
mod flat;
mod fused;
mod header_clock;
mod header_traps;
mod header_wcs;
mod mutations;
mod read;
mod tiles;
