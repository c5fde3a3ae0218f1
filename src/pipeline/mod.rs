//! Where the halves meet: the pipeline of a night, the comparison with the model, the simulation.
//!
//! `photometry` and `brightness` do not know each other; what they say of one satellite meets here.

pub mod along_track;
pub mod arrivals;
pub mod compare;
pub mod detector;
pub mod explain;
pub mod groups;
pub mod hot_pixels;
pub mod inspect;
pub mod keyword_checks;
pub mod matched;
pub mod memory;
pub mod options;
pub mod ordered_map;
pub mod passes;
pub mod prepared;
pub mod products;
pub mod reduce;
pub mod run;
pub mod shards;
pub mod single_stages;
pub mod stages;
pub mod stars;
pub mod survey;
pub mod target;
pub mod vet;
