//! A pass of a tracked satellite as one measurement: its frames stacked at the place where the satellite stands.
//!
//! [`place`]: that place, by the detections of the pass or, where single frames show nothing, by [`stack`], the running sum
//! of their matched filters. [`width`]: how wide its images are. [`forced`]: the flux of a source of that width at a given place of one
//! frame. [`curve`]: the fluxes of all frames as one mean and as a light curve in bins of equal signal-to-noise. It knows neither files nor magnitudes.

pub mod curve;
pub mod forced;
pub mod place;
pub mod stack;
pub mod width;
