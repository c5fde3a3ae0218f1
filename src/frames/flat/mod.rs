//! The master flat: levels, medians of stacks, the file it is kept in.

pub(crate) mod counting;
pub(crate) mod file;
pub(crate) mod kernel;
pub(crate) mod levels;
pub(crate) mod master;
pub(crate) mod median;
pub(crate) mod needed;
mod ratio;
pub(crate) mod stack;

pub(crate) use master::common_size;
pub use master::{BAND_BYTES, FlatMember, MasterFlat};
pub(crate) use median::{LANES, Lanes, Network, middle};
