//! The plan of a night: one row per pass.
//!
//! Missing numbers are `None`: a pass without light has no magnitude, an object without usable elements no place.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    PLAN = "plan_night.ecsv", "One row per pass of `plan-night`.";
    /// One pass of a night's plan.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct PlanRow {
        /// 1 = the shortest time to the signal-to-noise ratio asked for, of all observable passes; missing where the pass is not observable
        rank: Option<i64>,
        /// observable, faint, near_moon, too_fast, too_bright, no_light, no_model, not_up or failed
        status: String => ["meta.code.status"],
        /// 1 = in the schedule: no pass of better rank in the schedule overlaps
        scheduled: i64,
        /// rank of the best pass that overlaps this one, the time to slew included
        conflicts_with: Option<i64>,
        /// number of observable passes that overlap this one
        n_conflicts: i64,
        /// name of the satellite
        object_name: String => ["meta.id;meta.main"],
        /// catalogue number
        norad_cat_id: i64 => ["meta.id"],
        /// international designator
        object_id: String => ["meta.id"],
        /// model of the catalogue that predicts it
        model: String => ["meta.id"],
        /// UTC from which on it can be observed, ISO 8601; where it cannot, start of the pass in the dark
        date_beg: String => ["time.start;obs"],
        /// UTC of the best signal-to-noise ratio, ISO 8601; without light, of the highest altitude
        date_best: String => ["time.epoch;obs"],
        /// UTC to which it can be observed, ISO 8601; where it cannot, end of the pass in the dark
        date_end: String => ["time.end;obs"],
        /// MJD (UTC) of date_best
        mjd_best_d: Option<f64> => "d" ["time.epoch;obs"],
        /// altitude above the horizon, without refraction
        alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: Option<f64> => "deg" ["pos.az.azi"],
        /// largest altitude of the pass in the dark
        max_alt_deg: Option<f64> => "deg",
        /// distance from the observer
        range_km: Option<f64> => "km" ["pos.distance"],
        /// geodetic height of the satellite
        height_km: Option<f64> => "km",
        /// airmass
        airmass: Option<f64> => ["obs.airMass"],
        /// angular rate against the stars
        rate_deg_s: Option<f64> => "deg / s" ["phys.veloc.ang"],
        /// rate of the azimuth, which a dome must follow
        az_rate_deg_s: Option<f64> => "deg / s" ["phys.veloc.ang;pos.az.azi"],
        /// angle Sun - satellite - observer
        phase_angle_deg: Option<f64> => "deg" ["pos.phaseAng"],
        /// largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none
        illum: String => ["meta.code"],
        /// predicted magnitude outside the atmosphere, all lights, in the band of the meta block
        model_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// 1-sigma error of model_v_mag as a prediction; missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// numerical error of model_v_mag (quadrature); not how wrong the model is
        model_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// predicted magnitude by direct sunlight alone
        sun_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// predicted magnitude by sunlight from the Earth alone
        earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// predicted magnitude by direct moonlight alone
        moon_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// predicted magnitude by moonlight from the Earth alone
        lunar_earthshine_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// mean surface brightness of the satellite
        mu_mean_mag_arcsec2: Option<f64> => "mag / arcsec2" ["phot.mag.sb;em.opt.V"],
        /// altitude of the Sun at the observer
        sun_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// altitude of the Moon at the observer
        moon_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// illuminated fraction of the lunar disc
        moon_illum_pct: Option<f64> => "%" ["phys.area;arith.ratio"],
        /// angle between the target and the Moon on the sky
        moon_sep_deg: Option<f64> => "deg" ["pos.angDistance"],
        /// brightness of the sky next to the target, Moon and twilight included
        sky_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// one exposure: that asked for, or the longest that does not saturate
        exptime_s: Option<f64> => "s" ["time.duration;obs.exposure"],
        /// signal-to-noise ratio of one exposure, the target being tracked
        snr: Option<f64> => ["stat.snr"],
        /// time that gives the signal-to-noise ratio that is asked for, all exposures together
        needed_exptime_s: Option<f64> => "s" ["time.duration;obs.exposure"],
        /// exposures it is split into, none of them saturated
        needed_n_sub: Option<i64>,
        /// longest exposure that leaves the brightest pixel below saturation
        unsaturated_exptime_s: Option<f64> => "s" ["time.duration;obs.exposure"],
        /// date_best minus epoch of the elements
        tle_age_d: Option<f64> => "d" ["time.age"],
        /// why the pass is not observable, and what spoils it
        reason: String => ["meta.note"],
    }
}
