//! A shape at a place.

use crate::photometry::aperture::Shape;

/// A shape at a place of the cutout \[px\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    pub x: f64,
    pub y: f64,
    pub shape: Shape,
}

/// A shape scaled about its centre.
pub(crate) fn scaled(shape: Shape, by: f64) -> Shape {
    match shape {
        Shape::Circle { r_px } => Shape::Circle { r_px: by * r_px },
        Shape::Ellipse { a_px, b_px, theta_rad } => Shape::Ellipse { a_px: by * a_px, b_px: by * b_px, theta_rad },
        Shape::Rectangle { a_px, b_px, theta_rad } => Shape::Rectangle { a_px: by * a_px, b_px: by * b_px, theta_rad },
        Shape::Pill { a_px, b_px, theta_rad } => Shape::Pill { a_px: by * a_px, b_px: by * b_px, theta_rad },
    }
}
