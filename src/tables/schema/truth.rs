//! The truth of a synthetic night, as CSV.

use serde::Serialize;

use super::define::table;

table! {
    STAR_TRUTH = "truth/stars.csv", "One row per star and frame of `simulate`.";
    /// One star in one frame.
    #[derive(Debug, Clone, Serialize)]
    pub struct StarTruth {
        /// file name of the frame
        frame: String => ["meta.id;meta.file"],
        /// identifier of the star in the catalogue
        star_id: String => ["meta.id"],
        /// place of the star along a row, 0-based from the centre of the first pixel
        x_px: f64 => "pix" ["pos.cartesian.x;instr.det"],
        /// place of the star over rows, 0-based from the centre of the first pixel
        y_px: f64 => "pix" ["pos.cartesian.y;instr.det"],
        /// V magnitude outside the atmosphere
        v_mag: f64 => "mag" ["phot.mag;em.opt.V"],
        /// colour B-V
        b_v_mag: f64 => "mag" ["phot.color;em.opt.B;em.opt.V"],
        /// airmass
        airmass: f64 => ["obs.airMass"],
        /// electrons of the whole star, before vignetting
        flux_e: f64 => "electron" ["phot.count"],
        /// exposure time
        exptime_s: f64 => "s" ["time.duration;obs.exposure"],
        /// FWHM of the stars of the frame
        fwhm_px: f64 => "pix" ["instr.det.psf"],
    }
}

table! {
    TARGET_TRUTH = "truth/target.csv", "One row per target frame of `simulate`.";
    /// The target in one frame.
    #[derive(Debug, Clone, Serialize)]
    pub struct TargetTruth {
        /// file name of the frame
        frame: String => ["meta.id;meta.file"],
        /// mid-exposure UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// exposure time
        exptime_s: f64 => "s" ["time.duration;obs.exposure"],
        /// gain setting of the camera in units of 0.1 dB
        gain_setting: i64 => ["instr.setup"],
        /// place of the target along a row, 0-based from the centre of the first pixel
        x_px: f64 => "pix" ["pos.cartesian.x;instr.det"],
        /// place of the target over rows, 0-based from the centre of the first pixel
        y_px: f64 => "pix" ["pos.cartesian.y;instr.det"],
        /// electrons of the whole target, before vignetting
        flux_e: f64 => "electron" ["phot.count"],
        /// V magnitude outside the atmosphere
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// modelled V magnitude, all lights
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by direct sunlight alone
        sun_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by sunlight from the Earth alone
        earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by direct moonlight alone
        moon_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by moonlight from the Earth alone
        lunar_earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none
        illum: String => ["meta.code"],
        /// altitude above the horizon, without refraction
        alt_deg: f64 => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: f64 => "deg" ["pos.az.azi"],
        /// distance from the observer
        range_km: f64 => "km" ["pos.distance"],
        /// angular rate against the stars
        rate_deg_s: f64 => "deg / s" ["phys.veloc.ang"],
        /// airmass
        airmass: Option<f64> => ["obs.airMass"],
        /// length of the star trails in the frame
        trail_length_px: f64 => "pix",
        /// extinction by a cloud in this frame, which v_mag does not hold
        cloud_mag: f64 => "mag" ["phot.mag;arith.diff"] added_later,
    }
}

table! {
    RENDERED_TRUTH = "truth/resolved.csv", "One row per target frame of `simulate` with a rendered satellite.";
    /// What was rendered for one frame.
    #[derive(Debug, Clone, Serialize)]
    pub struct RenderedTruth {
        /// file name of the frame
        frame: String => ["meta.id;meta.file"],
        /// V magnitude of the picture, before the scenario's offset and scatter
        rendered_v_mag: Option<f64> => "mag",
        /// V magnitude of the picture by direct sunlight alone
        sunlight_v_mag: Option<f64> => "mag",
        /// V magnitude of the picture by sunlight from the Earth alone
        earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// V magnitude of the picture by direct moonlight alone
        moonlight_v_mag: Option<f64> => "mag",
        /// V magnitude of the picture by moonlight from the Earth alone
        lunar_earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// V magnitude of the picture by starlight alone
        starlight_v_mag: Option<f64> => "mag",
        /// area of the satellite that is seen
        seen_area_m2: f64 => "m2",
        /// pixel scale of the picture
        pixel_arcsec: f64 => "arcsec",
        /// share of the light that fell outside the frame
        beside_frac: f64,
    }
}
