//! Model magnitudes: surfaces, lights, and the light that comes by way of the Earth.
//!
//! Positions in km in one Earth-fixed frame, areas in m², angles in rad, irradiances as ratios to a star of magnitude
//! 0. Not included: self-shadowing between surfaces, light from one surface to another, twilight glow.

pub mod answer;
pub mod attitude;
pub mod brdf;
pub mod catalogue;
pub mod columns;
pub mod earth_view;
pub mod earthshine;
mod empirical;
pub mod explicit;
mod flux_sum;
mod ground;
pub mod light_class;
pub mod light_sources;
mod lights;
pub mod model;
mod platform;
mod polynomial;
pub mod predictive;
pub mod scene;
pub mod settings;
pub mod shadow;
mod skip;
pub mod sky;
pub mod sky_points;
pub mod spectrum;
pub mod surface;

pub(crate) use answer::too_faint_text;
pub use answer::{Brightness, Illum, Light, Quadratures};
pub use attitude::Attitude;
pub use brdf::{Binomial, Brdf, direct_reflection};
pub use catalogue::{Catalogue, Entry, Satellite, catalogue_names, catalogue_toml};
pub(crate) use earthshine::plain_rule;
pub use earthshine::{Accuracy, PreparedBrdf, ReflectedLight, reflected_by_earth};
pub use ground::Ground;
pub use light_sources::NearMoon;
pub use model::{Model, brightness, light_class};
pub use scene::Scene;
pub use settings::{ModelSettings, ToleranceOf};
pub use skip::{Skip, skipped_text};
pub use spectrum::Band;
pub use surface::Surface;
