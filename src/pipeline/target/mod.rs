//! One target frame, from disk to a row of the light curve, and its picture.

pub mod frame;
pub mod outcome;
pub mod picture;
pub mod pictures;
pub mod window;
