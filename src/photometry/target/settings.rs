//! The settings of the search for the target.

use crate::config::ApertureShape;
use crate::photometry::growth::StarProfile;
use crate::photometry::trails::known::KnownDirection;

/// An assumed FWHM of 2.5 arcsec may be 0.8 arcsec in the best nights and places.
const LEAST_OF_ASSUMED: f64 = 0.32;

/// Where and how to look for the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetSettings {
    /// Expected place \[px\].
    pub x_px: f64,
    /// Expected place \[px\].
    pub y_px: f64,
    /// How far from there the target may be \[px\].
    pub search_radius_px: f64,
    /// Threshold of the whole target \[σ\].
    pub detect_sigma: f64,
    /// Added around the object's own outline \[px\].
    pub margin_px: f64,
    /// Aperture radius of a limit \[px\].
    pub limit_r_px: f64,
    /// FWHM of a point source \[px\].
    pub fwhm_px: f64,
    /// Share of it by which the stars of this frame may differ from that, 1 σ.
    pub fwhm_err_frac: f64,
    /// Whether stars or the configuration give it. One that is assumed decides neither what is a hit nor what is a point.
    pub is_fwhm_known: bool,
    /// Profile of a point source of that FWHM; a Gaussian where no stars give one.
    pub profile: Option<StarProfile>,
    /// Largest size that the target can have, by its model and range \[FWHM\]; `None` if nothing tells.
    pub largest_fwhm: Option<f64>,
    /// Square of the diameter of the disc that fits it in other frames of its pass, and its error \[FWHM²\], where that is known.
    pub known_disc2: Option<(f64, f64)>,
    /// Inner radius of the annulus of an aperture of `limit_r_px` \[px\].
    pub sky_in_px: f64,
    /// Outer radius of that annulus \[px\]; the target's own annulus keeps its gap and at least its width.
    pub sky_out_px: f64,
    /// Clip of the sky pixels \[σ\].
    pub clip_sigma: f64,
    /// Shape of the aperture.
    pub shape: ApertureShape,
    /// Share of the flux from which light of trails and neighbours is flagged.
    pub contam_frac: f64,
    /// Direction of the star trails, where it is known beforehand.
    pub trail_direction: Option<KnownDirection>,
    /// Length of the star trails \[px\], where the target's motion and the exposure tell it.
    pub trail_length_px: Option<f64>,
    /// No part of the target is further than so many pixels from (`x_px`, `y_px`): what else joins it is a trail or a neighbour.
    pub bound_px: Option<f64>,
}

impl TargetSettings {
    /// Half the side of the square around the expected place that a measurement looks at \[px\].
    #[must_use]
    pub fn reach_px(&self) -> f64 {
        self.search_radius_px + 100.0 + 2.0 * self.sky_out_px
    }

    /// FWHM of the stars with which hits are compared \[px\]: the least that is likely, where it is not known.
    #[must_use]
    pub fn hits_fwhm_px(&self) -> f64 {
        if self.is_fwhm_known { self.fwhm_px } else { LEAST_OF_ASSUMED * self.fwhm_px }
    }
}
