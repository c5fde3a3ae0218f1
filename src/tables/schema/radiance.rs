//! Rendered satellites: radiances, and signal over noise of an exposed picture.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    RADIANCE = "render.ecsv", "One row per light of the satellite, and per light of each test point, of `render`.";
    /// One light of the whole satellite, or of a test point.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct RadianceRow {
        /// satellite (the whole of it); picture (the part in a picture that does not hold all of it); or the name of a test
        /// point
        place: String,
        /// component the test point is on
        component: String,
        /// test point: seen, hidden behind another part, or faces away from the observer
        view: String,
        /// sunlight, earthshine, moonlight, lunar_earthshine, starlight, or total
        light: String,
        /// radiance in band towards the observer; satellite, picture: mean over what is seen
        radiance_w_m2_sr: f64 => "W m-2 sr-1",
        /// irradiance in band at the observer, outside the atmosphere
        irradiance_w_m2: Option<f64> => "W m-2",
        /// V magnitude, Vega, outside the atmosphere
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// V surface brightness
        mu_v_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// share of the total
        share_frac: Option<f64>,
    }
}

table! {
    SNR = "render_sensor.ecsv", "One row per light or sum of lights of the sensor of `render`.";
    /// Signal over noise of some lights.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct SnrRow {
        /// the lights that shine
        lights: String,
        /// electrons of these lights, all of them
        signal_e: f64 => "electron",
        /// variance of a pixel without the satellite: sky, dark current, read noise
        variance_e2_px: f64 => "electron2",
        /// S/N of the brightest pixel
        snr_pixel: f64,
        /// S/N of n_px pixels summed
        snr_summed: f64,
        /// fewest pixels that hold 90 % of the light of all lights
        n_px: i64,
        /// S/N with the best weights
        snr_matched: f64,
        /// saturated pixels of the frame; above 0 every S/N of this table is too large
        saturated_px: i64,
    }
}
