//! Observed minus modelled magnitudes: `residuals.ecsv`.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    RESIDUALS = "residuals.ecsv", "One row per target frame that has both magnitudes; residual = observed − modelled, positive = fainter.";
    /// Observed minus modelled for one target frame: a row of `residuals.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct ResidualRow {
        /// source FITS file name
        frame: String => ["meta.id;meta.file"],
        /// satellite catalogue number
        norad_cat_id: Option<i64> => ["meta.id"],
        /// name of the target
        object_name: String => ["meta.id;meta.main"],
        /// number of the pass in the night, from 1
        pass: Option<i64> => ["meta.id;obs"],
        /// mid-exposure UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// mid-exposure MJD (UTC)
        mjd_mid_d: Option<f64> => "d" ["time.epoch;obs"],
        /// altitude above the horizon, without refraction
        alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: Option<f64> => "deg" ["pos.az.azi"],
        /// distance from the observer
        range_km: Option<f64> => "km" ["pos.distance"],
        /// angle Sun - satellite - observer
        phase_angle_deg: Option<f64> => "deg" ["pos.phaseAng"],
        /// angle between the target and the Moon on the sky
        moon_sep_deg: Option<f64> => "deg" ["pos.angDistance"],
        /// largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none
        illum: String => ["meta.code"],
        /// where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night
        sky_class: String => ["meta.code"] added_later,
        /// day, twilight (sunlight on the satellite or in the sky) or night, as Caddy et al. label it
        paper_label: String => ["meta.code"] added_later,
        /// apparent V magnitude outside the atmosphere
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// 1-sigma random error of v_mag
        v_mag_err: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V"],
        /// 1-sigma systematic error of v_mag: zeropoint, scatter of one pointing, colour of the target, gain table, aperture
        /// correction, another night's zeropoint
        v_mag_err_sys: Option<f64> => "mag" ["stat.error.sys;phot.mag;em.opt.V"],
        /// modelled V magnitude, all lights
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// numerical error of model_v_mag (quadrature); not how wrong the model is
        model_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// 1-sigma error of model_v_mag as a prediction: scatter of observations about the model, its fitted parameters, extinction;
        /// missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"] added_later,
        /// observed minus modelled magnitude; positive = observed fainter
        residual_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;arith.diff"],
        /// use, caution or reject, of the residual: caution at best where the elements are more than 2 d old
        verdict: String => ["meta.code.qual"],
        /// quality bit mask; the bits are named in meta
        flags: i32 => ["meta.code.qual"],
    }
}
