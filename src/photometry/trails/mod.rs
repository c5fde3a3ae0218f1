//! Star trails of a tracked frame: their direction, their light, what they add to the target.

pub(crate) mod bend;
pub(crate) mod bend_fit;
pub(crate) mod contamination;
pub(crate) mod crossing;
pub(crate) mod direction;
pub(crate) mod exclusion;
pub(crate) mod known;
pub(crate) mod level;
mod lines;
pub(crate) mod model;
pub(crate) mod rotate;
pub(crate) mod search;
pub(crate) mod segments;
