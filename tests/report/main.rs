//! Tables, figures and pages.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod figures;
mod gallery;
mod ground;
mod page;
mod summary;
mod tables;
