//! Whole nights: recovery, damage, interruption, shards.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod bright_passes;
mod broken;
mod faint_passes;
mod faults;
mod filters;
mod fixture;
mod groups;
mod huntsman;
mod instrument;
mod interrupts;
mod missing_parts;
mod mosaic;
mod observer_folder;
mod pilots;
mod previous;
mod reading;
mod recovery;
mod resume;
mod shard_faults;
mod shards;
mod star_trails;
mod stars;
mod vetting;
mod watch;
mod zero_level;
