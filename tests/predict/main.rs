//! Predictions of passes, skies, constellations; limits of detection.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../observed/mod.rs"]
mod observed;
#[path = "../support/mod.rs"]
mod support;

mod compliance;
mod constellation;
mod day;
mod fit;
mod fit_attitude;
mod geometry;
mod limits_footprint;
mod limits_simple;
mod limits_streak;
mod limits_tracked;
mod month;
mod pass;
mod plan_night;
mod predictive;
mod published_magnitudes;
mod sky;
mod standing;
mod table;
