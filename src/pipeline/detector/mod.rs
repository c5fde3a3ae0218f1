//! What the frames of a night say of the detector, against its table and the headers.

pub mod checks;
pub mod gain_check;
pub mod report;
