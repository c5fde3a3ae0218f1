//! One target frame, from disk to a row of the light curve, and its picture.

pub mod frame;
pub mod outcome;
#[cfg(feature = "report")]
pub mod picture;
#[cfg(feature = "report")]
pub mod pictures;
pub mod window;
