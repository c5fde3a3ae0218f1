//! Whole nights: recovery, damage, interruption, pieces.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod broken;
mod faults;
mod filters;
mod fixture;
mod groups;
mod huntsman;
mod instrument;
mod interrupts;
mod left_out;
mod mosaic;
mod observer_folder;
mod pieces;
mod previous;
mod reading;
mod recovery;
mod resume;
mod shards;
mod stars;
mod vetting;
mod watch;
mod zero_level;
