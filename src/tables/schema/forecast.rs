//! What is to be expected: a day, a month, the hours that can be used.
//!
//! `None` is an empty cell: where nothing is lit there is no magnitude.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    DAY = "day.ecsv", "One row per moment of `predict day`.";
    /// One moment of a day: a row of `day.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct DayRow {
        /// UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// MJD (UTC)
        mjd_mid_d: f64 => "d" ["time.epoch;obs"],
        /// altitude of the Sun at the observer
        sun_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// azimuth of the Sun from north through east
        sun_az_deg: f64 => "deg",
        /// altitude of the Moon at the observer
        moon_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// azimuth of the Moon from north through east
        moon_az_deg: f64 => "deg",
        /// phase angle of the Moon (0 = full)
        moon_phase_deg: f64 => "deg" ["pos.phaseAng"],
        /// illuminated fraction of the lunar disc
        moon_illum_pct: f64 => "%" ["phys.area;arith.ratio"],
        /// directions of the sky that were computed
        n_points: i64,
        /// share of them in which the satellite has any light; the medians are over these
        lit_frac: f64,
        /// median over the sky of the modelled V magnitude, all lights
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// 16 % of the lit directions are brighter
        model_v_p16_mag: Option<f64> => "mag",
        /// 84 % of the lit directions are brighter
        model_v_p84_mag: Option<f64> => "mag",
        /// V magnitude of the brightest direction
        brightest_v_mag: Option<f64> => "mag",
        /// median of direct sunlight alone, where 2 % of the directions have any
        sun_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// median of sunlight from the Earth alone, where 2 % of the directions have any
        earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// median of direct moonlight alone, where 2 % of the directions have any
        moon_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// median of moonlight from the Earth alone, where 2 % of the directions have any
        lunar_earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// share of the directions in which direct sunlight is the largest light
        sun_frac: f64,
        /// share in which sunlight from the Earth is the largest
        earthshine_frac: f64,
        /// share in which direct moonlight is the largest
        moon_frac: f64,
        /// share in which moonlight from the Earth is the largest
        lunar_earthshine_frac: f64,
        /// median of the mean V surface brightness of the satellite
        mu_mean_mag_arcsec2: Option<f64> => "mag / arcsec2" ["phot.mag.sb;em.opt.V"],
        /// 16 % of the lit directions have a brighter one
        mu_p16_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// 84 % of the lit directions have a brighter one
        mu_p84_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// largest numerical error of a direction (quadrature); not how wrong the model is
        model_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// largest 1-sigma error of a direction as a prediction; missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// what was skipped for the whole sky, and why
        skipped: String => ["meta.note"],
        /// lights that were not computed in some directions because they cannot change the sum there by more than a quarter of the
        /// tolerance, names with "; " between; their medians are missing
        too_faint: String => ["meta.note"] added_later,
    }
}

table! {
    OBSERVED = "day_passes.ecsv", "One row per observed pass, for comparison with `predict day`.";
    /// One observed pass, compared with the day: a row of its table.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct ObservedRow {
        /// name of the target
        object_name: String => ["meta.id;meta.main"],
        /// UTC of the pass's median frame, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// frames with a usable magnitude
        n: i64,
        /// median observed V magnitude
        v_mag: f64 => "mag" ["phot.mag;em.opt.V"],
        /// 16 % of the frames are brighter
        v_p16_mag: f64 => "mag",
        /// 84 % of the frames are brighter
        v_p84_mag: f64 => "mag",
        /// median over the sky at that time of day
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// 16 % of the lit directions are brighter
        model_v_p16_mag: Option<f64> => "mag",
        /// 84 % of the lit directions are brighter
        model_v_p84_mag: Option<f64> => "mag",
        /// yes where the observed median lies between the two
        within: String,
    }
}

table! {
    MONTH = "month.ecsv", "One row per satellite, mode and night of `predict month`.";
    /// One satellite in one night: a row of `month.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct MonthRow {
        /// satellite of the catalogue
        object_name: String => ["meta.id;meta.main"],
        /// reading of the published model
        mode: String,
        /// height of the orbit
        height_km: f64 => "km",
        /// local date of the evening before the midnight
        night: String,
        /// UTC of local midnight, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// MJD (UTC) of local midnight
        mjd_mid_d: f64 => "d" ["time.epoch;obs"],
        /// altitude of the Sun at midnight
        sun_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// altitude of the Moon at midnight
        moon_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// phase angle of the Moon (0 = full) at midnight
        moon_phase_deg: f64 => "deg" ["pos.phaseAng"],
        /// illuminated fraction of the lunar disc at midnight
        moon_illum_pct: f64 => "%" ["phys.area;arith.ratio"],
        /// share of directions and moments in which the satellite has any light
        lit_frac: f64,
        /// median over sky and moments of the modelled V magnitude, all lights
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// median of the mean V surface brightness of the satellite
        mu_mean_mag_arcsec2: Option<f64> => "mag / arcsec2" ["phot.mag.sb;em.opt.V"],
        /// 16 % are brighter
        mu_p16_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// 84 % are brighter
        mu_p84_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// brightness of the night sky under this Moon
        sky_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// 1-sigma surface brightness limit of the tracked exposure
        limit_1sigma_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// 5-sigma surface brightness limit of the tracked exposure
        limit_5sigma_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// 1 = the median is brighter than the 1-sigma limit
        detected_1sigma: Option<i64>,
        /// 1 = the median is brighter than the 5-sigma limit
        detected_5sigma: Option<i64>,
        /// largest numerical error of a direction (quadrature)
        model_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// largest 1-sigma error of a direction as a prediction; missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// what must be known of this row
        note: String,
    }
    not written {
        /// Whether the satellite is a mirror that is lit, so that its beam was looked for.
        beam_looked_for: bool,
    }
}

table! {
    DUTY = "duty.ecsv", "One row per way of observing of `predict duty`.";
    /// One way of observing: a row of `duty.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct DutyRow {
        /// when the satellite counts as observable
        observing: String,
        /// the rule
        threshold: String,
        /// hours of the window in which it holds
        duration_h: f64 => "h",
        /// share of the window
        duty_pct: f64 => "%",
        /// Caddy et al., an observer in Sydney in June
        published_pct: Option<f64> => "%",
    }
}
