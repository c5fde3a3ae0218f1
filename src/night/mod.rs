//! Where the halves meet: the pipeline of a night, the comparison with the model, the simulation.
//!
//! `photometry` and `brightness` do not know each other; what they say of one satellite meets here.

pub mod bench;
pub mod camera_turn;
pub mod clock;
pub mod compare;
pub mod corner;
pub mod cutout;
mod damage;
pub mod detector_checks;
pub mod detector_measure;
pub mod detector_report;
pub mod explain;
pub mod header_checks;
pub mod inspect;
mod inspect_wcs;
pub mod light_class;
pub mod manifest;
pub mod matched;
pub mod memory;
pub mod meta;
pub mod outputs;
pub mod pictures;
pub mod pipeline;
pub mod pointing;
pub mod predict;
pub mod previous;
pub mod progress;
pub mod queue;
pub mod report;
pub mod rough;
pub mod simulate;
pub mod solve;
pub mod solve_file;
pub mod stage;
pub mod stages;
pub mod star_stage;
pub mod streak;
pub mod summary;
pub mod surroundings;
pub mod survey;
pub mod target;
pub mod telescope;
pub mod vet;
pub mod zeropoint;
