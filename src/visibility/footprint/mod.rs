//! The beam of a flat mirror in orbit: how wide it is, where it meets the Earth, whether an observer stands in it.
//!
//! km and rad in Earth-fixed axes, m² for the mirror, magnitudes of the light source's band. The light source is a
//! uniform disc, the mirror flat and far smaller than its beam. Not included: slope errors of the foil, refraction,
//! terrain.

mod beam;
mod circle;
mod search;

pub use beam::{Beam, PUBLISHED_DIVERGENCE_DEG, Spot, beam_diameter_km, glint_mag, reflected};

pub use circle::{CircularOrbit, crossings_per_day};
pub use search::{Approach, Inside, LightSource, Mirror, approaches};
