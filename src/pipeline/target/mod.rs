//! One target frame, from disk to a row of the light curve, and its picture.

pub mod frame;
pub mod measurement;
pub mod outcome;
#[cfg(feature = "report")]
pub mod picture;
#[cfg(feature = "report")]
pub mod pictures;
pub mod pilots;
pub mod place;
pub mod row;
pub mod star_trails;
pub mod window;
