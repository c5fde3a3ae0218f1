//! Resolved satellites: many components, their shadows, the picture at the telescope's entrance and on its sensor.
//!
//! km and radians, W m⁻² sr⁻¹. Imports brightness, orbit, frames (the detector), detect (throughput) and the hall only.

pub mod body;
pub mod directions;
pub mod image;
pub mod joint;
pub mod light_source;
pub mod mesh;
pub mod points;
pub mod projected;
pub mod rays;
pub mod render;
pub mod satellite;
pub mod sensor;
pub mod settings;
pub mod shape;
pub mod shine;
pub mod surface;
pub mod triangle;
pub mod view;

pub use image::{Light, RadianceImage};
pub use render::{RayCounts, Rendered, Renderer, ResolvedScene, render};
pub use satellite::ComponentSatellite;
pub use settings::RenderSettings;
