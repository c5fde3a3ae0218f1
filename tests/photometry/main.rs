//! Apertures, sky, detection and the light of the target.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../photometry_scene/mod.rs"]
mod photometry_scene;

mod aperture;
mod artefacts;
mod background;
mod cosmic;
mod depth;
mod detect;
mod finder;
mod flags;
mod flux;
mod growth;
mod injection;
mod injection_station;
mod limit;
mod pass;
mod real_frame;
mod short_trails;
mod speed;
mod stats;
mod target;
mod target_light;
