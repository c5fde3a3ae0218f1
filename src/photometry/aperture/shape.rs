//! The outlines an aperture can have.

use serde::Deserialize;
use serde::Serialize;

/// The outline of an aperture.
///
/// ```
/// let ellipse = satphot::Aperture::Ellipse { a_px: 4.0, b_px: 2.0, theta_rad: 0.3 };
/// assert!((ellipse.area_px() - 8.0 * std::f64::consts::PI).abs() < 1e-12);
/// assert!((ellipse.pixel_fraction(0.0, 0.0) - 1.0).abs() < 1e-12);
/// ```
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
