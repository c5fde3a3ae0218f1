//! The sensor and one exposure of it.

use super::settings::SensorSettings;
use super::stamp::Stamp;
use crate::frames::Gain;
use ndarray::Array2;

/// A sensor, ready for exposures in one band.
#[derive(Debug, Clone)]
pub struct Sensor {
    pub(super) settings: SensorSettings,
    /// Side of a pixel \[arcsec\].
    pub pixel_arcsec: f64,
    /// The detector at its gain setting.
    pub gain: Gain,
    /// Magnitude of a source of the Sun's colours that makes 1 e⁻/s, of the light in the band alone; of the filter's
    /// band, or V without one.
    pub zp_mag: f64,
    /// Electrons per second of 1 W m⁻² (in the band, at the aperture) of the Sun's colours.
    pub e_s_per_w_m2: f64,
    /// Irradiance of the Sun at 1 au in the band \[W m⁻²\].
    pub sun_w_m2: f64,
    /// Band and system of `zp_mag`, e.g. `V, Vega`.
    pub zp_band: String,
}

/// One exposure before its noise.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Expected electrons of every pixel: satellite, sky, dark current. Shape (ny, nx).
    pub expected_e: Array2<f32>,
    /// The satellite's light on its piece of the frame.
    pub stamp: Stamp,
    /// Electrons of 1 W m⁻² in this exposure, after the air.
    pub e_per_w_m2: f64,
    /// Electrons of the sky in a pixel.
    pub sky_e_px: f64,
    /// Electrons of the dark current in a pixel.
    pub dark_e_px: f64,
    /// Share of the satellite's light that fell outside the frame.
    pub outside_frac: f64,
}
