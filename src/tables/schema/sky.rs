//! Maps of the sky: one moment, or many.

use serde::{Deserialize, Serialize};

use super::define::{Definition, joined, table};

table! {
    SKY = "sky.ecsv", "One row per direction of `predict sky`.";
    /// One direction of a map of the sky: a row of `sky.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct SkyRow {
        /// altitude above the horizon, without refraction
        alt_deg: f64 => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: f64 => "deg" ["pos.az.azi"],
        /// distance from the observer
        range_km: f64 => "km" ["pos.distance"],
        /// largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none
        illum: String => ["meta.code"],
        /// share of the Sun's light that gets past the Earth to the satellite
        sun_visible_frac: f64 => ["phys.area;arith.ratio"],
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
        /// numerical error of model_v_mag (quadrature); not how wrong the model is
        model_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// 1-sigma error of model_v_mag as a prediction: scatter of observations about the model, its fitted parameters, extinction;
        /// missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"] added_later,
        /// irradiance at the observer by all lights, in units of the Sun's at 1 au as the model scales it
        flux_per_e0: f64 => ["phot.flux;arith.ratio"],
        /// lights that were not computed because they cannot change model_v_mag by more than a quarter of the tolerance, names with "; "
        /// between; their columns are empty
        too_faint: String => ["meta.note"] added_later,
    }
}

table! {
    MOMENT = "sky_sequence.ecsv", "The moment of a map.";
    columns {
        /// UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// MJD (UTC)
        mjd_mid_d: f64 => "d" ["time.epoch;obs"],
    }
}

/// Maps of many moments: the moment, then the columns of a map.
pub const SKY_SEQUENCE: Definition = Definition {
    file: "sky_sequence.ecsv",
    about: "One row per moment and direction of a sequence of `predict sky`.",
    columns: &joined::<SEQUENCE_COLUMNS>(MOMENT.columns, SKY.columns),
};
const SEQUENCE_COLUMNS: usize = MOMENT.columns.len() + SKY.columns.len();
