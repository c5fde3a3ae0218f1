//! The thresholds from which a frame is used with caution or rejected, as an observer would judge it by eye.
//!
//! Shares are of the target's flux; angles in degrees. Each key says what switches its check off.

use serde::{Deserialize, Serialize};

/// Thresholds of the verdict.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vetting {
    /// Light of trails and neighbours over the flux from which a frame is used with caution; 1e6 = never.
    pub contam_caution_frac: f64,
    /// The same from which it is rejected; 1e6 = never.
    pub contam_reject_frac: f64,
    /// Share of the flux in masked pixels, filled from their neighbours, from which a frame is used with caution; 1e6 = never.
    pub masked_caution_frac: f64,
    /// Length of the target over the one expected from its median size in the pass, scaled to the range, from which a
    /// frame is used with caution; a station that turns within the pass stays below 1.5. 1e6 = never.
    pub smear_caution: f64,
    /// Length of the aperture over the one expected from its median in the pass and the range, from which a frame is used with
    /// caution: the end of a star trail or a neighbour is in it. 1e6 = never.
    pub aperture_caution: f64,
    /// Half the length of the outline over that of the light in it and a star, from which a frame is used with caution: a star
    /// trail or a neighbour is in the aperture, also where most frames of a pass have one. 1e6 = never.
    pub outline_caution: f64,
    /// Departure of `sky_corner_ratio` from the neighbouring frames from which a frame is used with caution; 0 = not
    /// checked.
    pub corner_ratio_dev: f64,
    /// Share of the sky level by which a frame may fall below its neighbours before something is in the beam; 0 = not
    /// checked.
    pub sky_drop_frac: f64,
    /// Altitude the dome allows \[deg\]; below it a frame is used with caution; -90 = everywhere. Caddy et al. section 2:
    /// not below 15 deg, to prevent vignetting.
    pub min_alt_deg: f64,
    /// Rate of the azimuth the dome can follow \[deg/s\]; above it the brightness is a lower limit; 0 = any. Domes
    /// turn at about 2 to 5 deg/s (an estimate without a source); measure yours: a full turn in two minutes is 3.
    pub dome_rate_deg_s: f64,
    /// Brightest pixel of the aperture as a share of saturation from which a frame is used with caution; 1e6 = never.
    pub peak_caution_frac: f64,
    /// A frame is used with caution if the next begins before this share of its EXPTIME has passed, with allowance for
    /// the error of the time stamps; 0 = never.
    pub cadence_min_frac: f64,
    /// Thumbnails of at most this many frames go into the gallery, worst first; 0 = no gallery.
    pub gallery_frames: usize,
}

impl Default for Vetting {
    fn default() -> Self {
        Self {
            contam_caution_frac: 0.05,
            contam_reject_frac: 1.0,
            masked_caution_frac: 0.05,
            smear_caution: 1.5,
            aperture_caution: 1.5,
            outline_caution: 3.0,
            corner_ratio_dev: 0.05,
            sky_drop_frac: 0.15,
            min_alt_deg: 15.0,
            dome_rate_deg_s: 3.0,
            peak_caution_frac: 0.95,
            cadence_min_frac: 1.0,
            gallery_frames: 500,
        }
    }
}
