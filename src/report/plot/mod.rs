//! Figures as SVG, drawn from the rows of the tables and the growth curve alone.
//!
//! Fixed sizes, colour-blind-safe colours (Okabe & Ito 2008), brightness upwards. A figure without data says why.

mod accuracy;
mod axis;
mod brdf;
mod canvas;
mod growth;
mod light_curve;
mod panel;
mod residuals;
mod sed;
mod sky_map;
mod transfer;
mod zeropoint;

pub use accuracy::error_against_time;
pub use brdf::{FittedRow, brdf_curves, brdf_fit};
pub use growth::growth_curve;
pub use light_curve::{light_curve, light_curves};
pub use residuals::residuals_altitude;
pub use sed::{SedCurve, sed};
pub use sky_map::{SkyMark, sky_map};
pub use transfer::{TransferCurve, photon_transfer};
pub use zeropoint::zeropoint_diagnostics;
