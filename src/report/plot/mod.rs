//! Figures as SVG, drawn from the rows of the tables alone.
//!
//! Fixed sizes, colour-blind-safe colours (Okabe & Ito 2008), brightness upwards. A figure without data says why.

mod axis;
mod canvas;
mod light_curve;
mod panel;
mod residuals;
mod zeropoint;

pub use light_curve::{light_curve, light_curves};
pub use residuals::residuals_altitude;
pub use zeropoint::zeropoint_diagnostics;
