//! Model magnitudes: surfaces, lights, and the light that comes by way of the Earth.
//!
//! Positions in km in one Earth-fixed frame, areas in m², angles in rad, irradiances as ratios to a star of V = 0.
//! Left out: self-shadowing between surfaces, spectra, the atmosphere's own shadow, mirrors and laboratory lobes.

pub mod brdf;
pub mod catalogue;
pub mod earthshine;
mod ground;
pub mod lamps;
mod lights;
pub mod model;
mod quadrature;
pub mod scene;
pub mod shadow;
pub mod surface;

pub use brdf::{Binomial, Brdf};
pub use catalogue::{Satellite, catalogue_names};
pub use earthshine::{Accuracy, ReflectedLight, reflected_by_earth};
pub use ground::Ground;
pub use model::{Brightness, Illum, Light, ModelSettings, Quadratures, brightness, light_class};
pub use scene::Scene;
pub use surface::{Attitude, Surface};
