//! Counts of the satellites of a constellation over a site.

use super::define::{Column, table};

table! {
    CONSTELLATION = "constellation.ecsv", "One row per moment of `predict constellation`; n_brighter_ stands once for each requested magnitude, which ends its name.";
    columns {
        /// UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// MJD (UTC)
        mjd_mid_d: Option<f64> => "d" ["time.epoch;obs"],
        /// altitude of the Sun at the observer
        sun_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// altitude of the Moon at the observer
        moon_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// satellites computed
        n_satellites: Option<i64>,
        /// satellites whose elements give no place
        n_failed: Option<i64>,
        /// satellites above the horizon
        n_above_horizon: Option<i64>,
        /// satellites above min_alt_deg (meta); all that follows is of these
        n_above_min_alt: Option<i64>,
        /// satellites that any of the four lights reaches: n_sun, n_earthshine, n_moon, n_lunar_earthshine
        n_lit: Option<i64>,
        /// satellites with direct sunlight
        n_sun: Option<i64>,
        /// satellites with sunlight from the Earth
        n_earthshine: Option<i64>,
        /// satellites with direct moonlight
        n_moon: Option<i64>,
        /// satellites with moonlight from the Earth
        n_lunar_earthshine: Option<i64>,
        /// V magnitude of the brightest
        brightest_v_mag: Option<f64> => "mag",
        /// satellites brighter than the V magnitude in the name
        n_brighter_: Option<i64>,
        /// number of the brightest
        brightest_number: Option<i64>,
        /// median V magnitude of the lit, to 0.01 mag
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// 16 % of the lit are brighter
        model_v_p16_mag: Option<f64> => "mag",
        /// 84 % of the lit are brighter
        model_v_p84_mag: Option<f64> => "mag",
        /// largest numerical error of a satellite (quadrature)
        model_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// largest 1-sigma error of a satellite as a prediction; missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// counts of the lit by V: step:count, step k from -30 + 0.02 k mag on
        histogram: String,
    }
}

/// The columns of a table that counts what is brighter than these magnitudes. Their names live as long as the program: there
/// are at most twenty.
#[must_use]
pub fn constellation_columns(magnitudes: &[f64]) -> Vec<Column> {
    let mut columns = Vec::new();
    for column in CONSTELLATION.columns {
        if column.name == "n_brighter_" {
            let of = |m: &f64| Column { name: format!("{}{m}", column.name).leak(), ..*column };
            columns.extend(magnitudes.iter().map(of));
        } else {
            columns.push(*column);
        }
    }
    columns
}
