//! What leaves for others and what comes from the network.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../export_support/mod.rs"]
mod export_support;
#[path = "../fetch_support/mod.rs"]
mod fetch_support;
#[path = "../support/mod.rs"]
mod support;

mod cli;
mod fetch;
mod fetch_policy;
mod observations;
mod score;
mod tables;
