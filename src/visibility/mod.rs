//! Can it be seen? From a magnitude and a rate to a limit: exposure times, surface brightness, streaks, surveys, hours.
//!
//! Magnitudes in the band stated, angles in the unit of the name, times in s. Nothing here knows a frame or a pixel value.

pub mod compliance;
pub mod duty_cycle;
pub mod earth_tables;
pub mod footprint;
pub mod forecast;
pub mod night_plan;
pub mod observation_table;
pub mod published_streaks;
pub mod simple;
pub mod sky_brightness;
pub mod sky_brightness_table;
pub mod streak;
pub mod survey;
pub mod telescope;
pub mod tracked;
