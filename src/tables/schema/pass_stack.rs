//! Passes as one measurement each, and their light curves in bins: `pass_stack.ecsv`.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    PASS_STACK = "pass_stack.ecsv", "One row per pass of a tracked satellite, of all its frames stacked at the place where it stands, followed by one row per bin of equal signal-to-noise.";
    /// A pass, or a bin of its light curve: a row of `pass_stack.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct PassStackRow {
        /// number of the pass in the night, from 1
        pass: Option<i64> => ["meta.id;obs"],
        /// number of the bin in the pass, from 1; 0 is the whole pass
        bin: i64 => ["meta.id"],
        /// satellite catalogue number
        norad_cat_id: Option<i64> => ["meta.id"],
        /// name of the target
        object_name: String => ["meta.id;meta.main"],
        /// frames in the mean
        frames: i64 => ["meta.number"],
        /// frames of the pass that are not in it: saturated, crossed, of another size, or without the place
        frames_excluded: i64 => ["meta.number"],
        /// UTC of the first mid-exposure, ISO 8601
        date_first: String => ["time.start;obs"],
        /// UTC of the last mid-exposure, ISO 8601
        date_last: String => ["time.end;obs"],
        /// mean mid-exposure MJD (UTC) with the weights of the flux
        mjd_mid_d: Option<f64> => "d" ["time.epoch;obs"],
        /// sum of the exposure times
        exptime_s: Option<f64> => "s" ["time.duration;obs.exposure"],
        /// where the place is from: detections (of single frames), stack (found in the sum of the frames), frames (a target that is
        /// resolved, or, of a median S/N above 50, clear in all of them or at no common place, or
        /// seen in all of them and with a jitter above 0.4 FWHM: its detections are averaged), none
        place_from: String => ["meta.code"],
        /// column of the target at mjd_mid_d, full frame
        x_px: Option<f64> => "pix" ["pos.cartesian.x;instr.det"],
        /// row of the target at mjd_mid_d, full frame
        y_px: Option<f64> => "pix" ["pos.cartesian.y;instr.det"],
        /// drift of the place along columns
        drift_x_px_s: Option<f64> => "pix / s" ["pos.pm;instr.det"],
        /// drift of the place along rows
        drift_y_px_s: Option<f64> => "pix / s" ["pos.pm;instr.det"],
        /// scatter of the target about the place, per axis, beyond the error of the detections
        jitter_px: Option<f64> => "pix" ["stat.stdev;instr.det"],
        /// weighted mean flux, corrected for the extinction of each frame where there is a zeropoint; can be negative
        flux_e_s: Option<f64> => "electron / s" ["phot.count"],
        /// 1-sigma random error of flux_e_s
        flux_err_e_s: Option<f64> => "electron / s" ["stat.error;phot.count"],
        /// flux_e_s over its error
        snr: Option<f64> => ["stat.snr"],
        /// chi-square per degree of freedom of the frames about the mean: above 1 where the target changes
        chi2_dof: Option<f64> => ["stat.fit.chi2"],
        /// factor on the errors by which empty places around the target scatter more than their noise; 1 where they do not
        err_scale: Option<f64> => ["stat.fit.param"],
        /// signal-to-noise a target must have: target.detect_sigma at a known place; where the place is unknown, what one pass in
        /// 100 without a target exceeds
        threshold_sigma: Option<f64> => ["stat.snr;stat.min"],
        /// instrumental magnitude of the mean flux, -2.5 lg(flux_e_s); empty below target.detect_sigma
        inst_mag: Option<f64> => "mag" ["phot.mag;instr.det"],
        /// apparent V magnitude of the mean flux outside the atmosphere
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// 1-sigma error of inst_mag and v_mag: random, and that of the width of the target's images, which all frames share
        v_mag_err: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V"],
        /// 1-sigma systematic error of v_mag, the median of the frames
        v_mag_err_sys: Option<f64> => "mag" ["stat.error.sys;phot.mag;em.opt.V"],
        /// magnitude of a point source of which 95 % would exceed threshold_sigma
        limit_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;stat.max"],
        /// mean distance from the observer
        range_km: Option<f64> => "km" ["pos.distance"],
        /// mean angle Sun - satellite - observer
        phase_angle_deg: Option<f64> => "deg" ["pos.phaseAng"],
        /// quality bit mask of any of the frames; the bits are named in meta
        flags: i32 => ["meta.code.qual"],
        /// why there is no flux or no magnitude
        reason: String => ["meta.note"],
    }
}
