//! The outlines an aperture can have.

use serde::Deserialize;
use serde::Serialize;

/// The outline of an aperture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// A circle.
    Circle {
        /// Radius \[px\].
        r_px: f64,
    },
    /// An ellipse.
    Ellipse {
        /// Semi-major axis \[px\].
        a_px: f64,
        /// Semi-minor axis \[px\].
        b_px: f64,
        /// Angle of the major axis from +x towards +y \[rad\].
        theta_rad: f64,
    },
    /// A rectangle.
    Rectangle {
        /// Half its length \[px\].
        a_px: f64,
        /// Half its width \[px\].
        b_px: f64,
        /// Angle of the length from +x towards +y \[rad\].
        theta_rad: f64,
    },
    /// A rectangle with half a disc at both ends: all points within `b_px` of a segment. Where it would be shorter
    /// than wide it is a circle of radius `a_px`.
    Pill {
        /// Half its length with the caps \[px\].
        a_px: f64,
        /// Half its width, the radius of the caps \[px\].
        b_px: f64,
        /// Angle of the length from +x towards +y \[rad\].
        theta_rad: f64,
    },
}
