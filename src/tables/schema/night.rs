//! The passes of a night of several satellites, filters or cameras, its files of no group, and the keywords of its frames.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    NIGHT = "night.ecsv", "One row per pass of a night of several satellites, filters or cameras, over all its groups.";
    /// A pass through one filter.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct NightRow {
        /// folder of the group with all its tables and its report
        group: String => ["meta.id"],
        /// name of the satellite
        object_name: String => ["meta.id;meta.main"],
        /// catalogue number of the satellite
        norad_cat_id: Option<i64> => ["meta.id"],
        /// camera
        instrument: String => ["meta.id;instr"],
        /// band of the magnitudes
        band: String => ["meta.id;instr.bandpass"],
        /// number of the pass in its group, from 1; empty where the group has none
        pass: Option<i64> => ["meta.id;obs"],
        /// UTC of the first frame, ISO 8601
        date_first: String => ["time.start;obs"],
        /// target frames
        frames: i64 => ["meta.number"],
        /// of these, magnitudes that are used
        used: i64 => ["meta.number"],
        /// median of the used magnitudes
        median_mag: Option<f64> => "mag" ["phot.mag;stat.median"],
        /// brightest of the used magnitudes
        brightest_mag: Option<f64> => "mag" ["phot.mag;stat.max"],
        /// median of the used residuals, observed minus modelled
        residual_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;arith.diff"],
        /// robust scatter of the used residuals
        sigma_mag: Option<f64> => "mag" ["stat.stdev;phot.mag"],
        /// median random error of the used magnitudes
        median_err_mag: Option<f64> => "mag" ["stat.error;phot.mag"],
        /// median systematic error of the used magnitudes
        median_err_sys_mag: Option<f64> => "mag" ["stat.error.sys;phot.mag"],
        /// zeropoint of the group
        zp_mag: Option<f64> => "mag" ["phot.calib;phot.mag"],
        /// its error
        zp_mag_err: Option<f64> => "mag" ["stat.error;phot.calib"],
        /// colour index of the colour term
        colour_index: String => ["meta.id"],
        /// colour of the satellite that the magnitudes are calibrated with, in that index
        target_colour_mag: Option<f64> => "mag" ["phot.mag;arith.diff"],
        /// its error
        target_colour_err_mag: Option<f64> => "mag" ["stat.error;phot.mag"],
        /// where that colour is from: measured, the configuration or the Sun
        target_colour_from: String => ["meta.note"],
        /// why the group could not be reduced, or what taints it; empty if nothing
        reason: String => ["meta.note"],
    }
}

table! {
    UNGROUPED = "ungrouped.ecsv", "One row per file of a night of several satellites, filters or cameras that belongs to none of its groups.";
    /// A file of no group.
    #[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
    pub struct UngroupedRow {
        /// source FITS file name
        frame: String => ["meta.id;meta.file"],
        /// what it would have been: flat, stars or target; empty where it cannot be read
        role: String => ["meta.code.class"],
        /// OBJECT of its header
        object_name: String => ["meta.id;meta.main"],
        /// FILTER of its header
        filter: String => ["meta.id;instr.filter"],
        /// `failed` where the file cannot be read, else `rejected`
        status: String => ["meta.code.status"],
        /// why it belongs to no group
        reason: String => ["meta.note"],
    }
}

table! {
    KEYWORD_CHECKS = "keyword_checks.ecsv", "One row per frame and keyword that assigns it to a group (FILTER, INSTRUME, OBJECT): whether the data agree with it.";
    /// What the data say of a keyword of a frame.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct KeywordCheckRow {
        /// source FITS file name
        frame: String => ["meta.id;meta.file"],
        /// flat, stars or target
        role: String => ["meta.code.class"],
        /// FILTER, INSTRUME or OBJECT
        keyword: String => ["meta.id"],
        /// its value
        value: String => ["meta.note"],
        /// `agrees`, `deviates` or `not_checkable`
        standing: String => ["meta.code.qual"],
        /// star frames: zeropoint of the frame minus that of the others at its airmass, positive = fainter
        zp_dev_mag: Option<f64> => "mag" ["phot.calib;arith.diff"],
        /// star frames: the difference above which the zeropoint deviates
        zp_limit_mag: Option<f64> => "mag" ["phot.calib;stat.max"],
        /// flats: scatter of the ratio to the master over blocks of the frame, a plane subtracted
        flat_scatter_frac: Option<f64> => ["stat.stdev;arith.ratio"],
        /// flats: the scatter above which the flat deviates
        flat_limit_frac: Option<f64> => ["stat.max;arith.ratio"],
        /// star frames: scale of the stars over that of the other frames, minus 1
        scale_dev_frac: Option<f64> => ["instr.scale;arith.ratio"],
        /// target frames: distance of the header's pointing from the satellite
        pointing_sep_deg: Option<f64> => "deg" ["pos.angDistance"],
        /// what contradicts the keyword, or why the data do not show it; empty where they agree
        reason: String => ["meta.note"],
    }
}
