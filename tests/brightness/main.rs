//! The brightness engine: laws, vectors, observations.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../brdf_common/mod.rs"]
mod brdf_common;
#[path = "../observed/mod.rs"]
mod observed;
#[path = "../support/mod.rs"]
mod support;

mod attitude;
mod brdf;
mod brdf_cli;
mod brdf_disc;
mod brdf_fit;
mod catalogue;
mod daytime;
mod extremes;
mod laws;
mod light_classes;
mod light_sources;
mod moonlit_ground;
mod own_vectors;
mod plot_moon;
mod points;
mod pomenis;
mod quadrature;
mod shadow;
mod slingshot;
mod spectrum;
mod stated_error;
mod vectors;
