//! Star trails of a tracked frame as its coordinates: where each catalogue star must trail, and how the frame lies on them.
//!
//! [`align`] puts the steps together: [`path`] predicts the trails from the satellite's path on the sky, [`search`] finds the offset of the frame, [`fit`] measures
//! offset, direction, width and the light of every trail at once. Pixels of the full frame; u runs along the trails, from
//! their start to their end, v across, from the pixel at which the satellite is expected. It does not cover distortion of
//! the optics.

pub mod align;
mod ends;
pub mod fit;
pub mod image;
pub mod line;
pub mod path;
pub mod search;

use crate::base::constants::ARCSEC_PER_RAD;

/// How the camera lies on the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraOnSky {
    /// North on the detector, from +x towards +y \[rad\].
    pub north_rad: f64,
    /// Whether east lies a quarter of a turn from +y towards +x of north.
    pub mirrored: bool,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
}

impl CameraOnSky {
    /// The place on the detector of tangent-plane coordinates (east, north) \[rad\], from the tangent point \[px\].
    #[must_use]
    pub fn px(&self, (xi, eta): (f64, f64)) -> (f64, f64) {
        let (sin, cos) = self.north_rad.sin_cos();
        let east = if self.mirrored { (sin, -cos) } else { (-sin, cos) };
        let k = ARCSEC_PER_RAD / self.scale_arcsec;
        (k * (xi * east.0 + eta * cos), k * (xi * east.1 + eta * sin))
    }

    /// Tangent-plane coordinates (east, north) \[rad\] of a place on the detector, from the tangent point \[px\]; undoes
    /// [`CameraOnSky::px`].
    #[must_use]
    pub fn tangent(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (sin, cos) = self.north_rad.sin_cos();
        let east = if self.mirrored { (sin, -cos) } else { (-sin, cos) };
        let k = self.scale_arcsec / ARCSEC_PER_RAD;
        (k * (x * east.0 + y * east.1), k * (x * cos + y * sin))
    }
}
