//! Figures as SVG, for files and for pages, drawn from the rows of the tables and the growth curve alone.
//!
//! Shapes and text are written by `svg`, marks and legends by `canvas`, axes and everything placed by value by
//! `panel`, one panel as a chart of its own by `chart`. A file is 174 mm wide, colour-blind-safe colours (Okabe & Ito 2008), brightness upwards. A figure without data says why.

pub(crate) mod axis;
mod brdf;
pub(crate) mod canvas;
pub(crate) mod chart;
pub(crate) mod coast;
mod day;
pub(crate) mod density;
mod earth;
mod four_lights;
mod ground;
mod growth;
pub(crate) mod interaction;
mod labels;
mod light_curve;
mod limits;
mod model_sky;
mod month;
mod moon;
pub(crate) mod panel;
mod pictures;
#[cfg(feature = "resolved")]
pub mod radiance;
pub(crate) mod raster;
mod residuals;
mod sed;
mod sky_map;
mod sky_sequence;
mod streak;
pub(crate) mod svg;
pub mod thumb;
mod transfer;
mod zeropoint;

pub use brdf::{FittedRow, brdf_curves, brdf_fit};
pub use day::{Violin, day};
pub use earth::{EarthMark, earth, earth_raster};
pub use four_lights::four_lights;
pub use ground::{GroundMap, ground_map};
pub use growth::growth_curve;
pub use labels::{LabelSample, label_histogram};
pub(crate) use light_curve::{LIGHTS, MODEL, altitude_colour, limit, pass_chart};
pub use light_curve::{light_curve, light_curve_pages, light_curves};
pub use limits::{LimitCurve, LimitPanel, limit_panels};
pub use model_sky::{ModelSky, model_sky};
pub use month::month;
pub use moon::moon_laws;
pub use pictures::{Picture, PictureRow, pictures};
pub use residuals::residuals_altitude;
pub use sed::{SedCurve, sed};
pub(crate) use sky_map::{Levels, PassDisc, viridis};
pub use sky_map::{SkyMark, sky_map};
pub use sky_sequence::{SkyPanel, sky_sequence, sky_sequence_on};
pub use streak::{StreakBand, streak};
pub use thumb::Thumb;
pub use transfer::{TransferCurve, photon_transfer};
pub(crate) use zeropoint::zeropoint_charts;
pub use zeropoint::zeropoint_diagnostics;
