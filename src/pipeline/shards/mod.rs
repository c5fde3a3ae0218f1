//! A night in shards: what is to be done, what is done already, shards measured anywhere, and their sum.
//!
//! The plan names every file with its hash; shards of target frames are measured by themselves, with products that are
//! kept; what takes all frames is done once, in the merge. A night on one machine goes the same way.

pub mod manifest;
pub mod merge;
pub mod plan_file;
pub mod products;
pub mod reduce;
pub mod shard;
pub mod stack;
pub mod whole;
