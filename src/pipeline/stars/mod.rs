//! Star pointings: solved, measured, made into the rows of the zeropoint.

pub mod frame_check;
pub mod pointing;
pub mod solve;
pub mod solve_file;
pub mod stage;
pub mod vignetting;
pub(crate) mod zeropoint;
