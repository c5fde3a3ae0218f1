//! Brightness against limits: shares and margins, and the geometries that are worst.
//!
//! Magnitudes in the band of the meta block; `None` where nothing is lit.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    COMPLIANCE = "compliance.ecsv", "One row per limit and variant of `predict compliance`.";
    /// A limit, and how much of sky and time is brighter.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct ComplianceRow {
        /// model, or observations
        of: String,
        /// as listed, or what is changed in the model
        variant: String,
        /// what sets the limit
        rule: String,
        /// the limit at this height of the orbit: what is brighter breaks it
        limit_v_mag: f64 => "mag" ["phot.mag;em.opt.V;stat.max"],
        /// directions and moments in the dark; of observations magnitudes and limits
        n: i64,
        /// of them lit: brighter than V 15; of observations magnitudes
        n_lit: i64,
        /// passes of the observations
        n_passes: Option<i64>,
        /// share of sky and time that is brighter than the limit; of observations by Kaplan and Meier, with limits as censored
        brighter_frac: Option<f64>,
        /// lower end of its 68 % interval: of the model, if all magnitudes are fainter by the predictive error; of observations
        /// binomial, by passes (Wilson)
        brighter_p16_frac: Option<f64>,
        /// upper end of its 68 % interval
        brighter_p84_frac: Option<f64>,
        /// share that is expected if magnitudes scatter by the predictive error, each by itself
        expected_frac: Option<f64>,
        /// share of what is lit that is brighter
        lit_brighter_frac: Option<f64>,
        /// mean magnitude of what is lit
        mean_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;stat.mean"],
        /// 5 % of what is lit is brighter
        v_p05_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// the brightest
        brightest_v_mag: Option<f64> => "mag",
        /// v_p05_mag less the limit: below 0 is what 95 % of the lit sky lacks
        margin_mag: Option<f64> => "mag" ["phot.mag;arith.diff"],
        /// 1-sigma error of a magnitude as a prediction, median; missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// what must be known of the row
        note: String,
    }
}

table! {
    COMPLIANCE_WORST = "compliance_worst.ecsv", "One row per site and night of `predict compliance`: its brightest moment.";
    /// The brightest of a night.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct WorstRow {
        /// latitude of the site
        lat_deg: f64 => "deg" ["pos.earth.lat"],
        /// longitude of the site
        lon_deg: f64 => "deg" ["pos.earth.lon"],
        /// UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// altitude above the horizon, without refraction
        alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: Option<f64> => "deg" ["pos.az.azi"],
        /// modelled V magnitude, all lights
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// 1-sigma error of model_v_mag as a prediction; missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none
        illum: String => ["meta.code"],
        /// altitude of the Sun at the observer
        sun_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// angle between the satellite and the Sun's azimuth
        sun_az_sep_deg: Option<f64> => "deg",
        /// share of the night's sky and time in which it is brighter than V 15
        lit_frac: f64,
        /// share of it that is brighter than the first limit
        brighter_frac: Option<f64>,
    }
}
