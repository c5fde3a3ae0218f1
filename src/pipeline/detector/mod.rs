//! The detector as measured from the frames of a night, compared with its table and the headers.

pub mod checks;
pub mod gain_check;
pub mod report;
