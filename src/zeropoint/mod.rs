//! From matched stars to zeropoint, extinction and colour term.

pub mod fit;
pub mod frame_offset;
pub mod matched;
pub mod previous;
pub mod star_identity;
pub mod stars;
