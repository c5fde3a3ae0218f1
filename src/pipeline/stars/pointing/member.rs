//! One frame of a star pointing, measured.

use crate::astrometry::align::Alignment;
use crate::astrometry::field_rotation::CameraTurn;
use crate::base::stats::median;
use crate::frames::Gain;
use crate::photometry::flux::Flux;
use crate::photometry::growth::FrameGrowth;
use crate::photometry::growth::StarProfile;
use hifitime::Epoch;
use serde::Deserialize;
use serde::Serialize;

/// One star in one member frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MemberStar {
    /// Index in the catalogue.
    pub index: usize,
    /// Position \[px\].
    pub x_px: f64,
    /// Position \[px\].
    pub y_px: f64,
    /// The measurement.
    pub flux: Flux,
    /// Distance of the detection from the aligned catalogue position \[px\]; `None` = not detected.
    pub match_px: Option<f64>,
    /// Altitude \[rad\].
    pub alt_rad: f64,
    /// Azimuth \[rad\].
    pub az_rad: f64,
    /// Airmass.
    pub airmass: Option<f64>,
}

/// One member frame with its stars.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Member {
    /// File name.
    pub frame: String,
    /// OBJECT.
    pub object: String,
    /// Mid-exposure; read from the header each time, not kept with the measurements.
    #[serde(skip)]
    pub mid: Epoch,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// The detector at this frame's gain.
    pub gain: Gain,
    /// FWHM of the stars \[px\].
    pub fwhm_px: f64,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// The rotation of the camera on the sky.
    pub turn: Option<CameraTurn>,
    /// Radii of aperture and annulus \[px\].
    pub radii_px: [f64; 3],
    /// Whether a flat was applied.
    pub flat: bool,
    /// Detections in the frame.
    pub n_detected: usize,
    /// The alignment of the catalogue to the frame.
    pub alignment: Alignment,
    /// The growth curve of its stars, if it has any bright enough.
    pub growth: Option<FrameGrowth>,
    /// The profile that corrects its stars to their whole light, once that of the night is known.
    pub profile: Option<StarProfile>,
    /// Notes about it: how its world coordinates were found.
    pub note: String,
    /// Its stars, in the order of the catalogue.
    pub stars: Vec<MemberStar>,
}

impl Member {
    /// Median airmass of its stars.
    #[must_use]
    pub fn airmass(&self) -> Option<f64> {
        median(&mut self.stars.iter().filter_map(|s| s.airmass).collect::<Vec<_>>())
    }

    /// Scale of its stars \[arcsec/px\]: that of its world coordinates, as the alignment corrects it.
    #[must_use]
    pub fn solved_scale_arcsec(&self) -> f64 {
        // places on the frame that lie further apart mean a finer scale
        self.scale_arcsec / self.alignment.scale
    }
}
