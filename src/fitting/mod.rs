//! Models of satellites from observed magnitudes: laws of the phase angle, and how known surfaces scatter and are held.
//!
//! Magnitudes, km, degrees. Rows of a pass share an offset, which is part of the model: they are not independent. The result is an entry
//! for a file of satellites, with its covariance, its data and where it holds. It does not cover periods, flares, and the choice
//! between models.

mod entry;
mod mixed;
mod observations;
mod parameters;
mod problem;
mod surfaces;

pub use entry::{fitted_phase_law, fitted_surfaces};
pub use mixed::{Fit, MixedFit, Row, fit};
pub use observations::{Observation, Observations, by_orbit, in_light, stated, surface_flux};
pub use parameters::{Free, surfaces_at};
pub use problem::{Problem, phase_law};
pub use surfaces::{FluxOf, fit_surfaces};
