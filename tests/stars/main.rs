//! Catalogues, world coordinates, plate solving and the zeropoint.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../plate_field/mod.rs"]
mod plate_field;
#[path = "../support/mod.rs"]
mod support;
#[path = "../zeropoint_nights/mod.rs"]
mod zeropoint_nights;

mod catalogue;
mod matched;
mod matched_fits;
mod matched_rows;
mod plate_cases;
mod plate_extremes;
mod plate_frames;
mod star_trails;
mod wcs;
mod zeropoint;
mod zeropoint_coverage;
mod zeropoint_designs;
mod zeropoint_extremes;
mod zeropoint_night;
mod zeropoint_terms;
