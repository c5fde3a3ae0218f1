//! Measurements of catalogue stars: `stars.ecsv`.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    STARS = "stars.ecsv", "One row per measurement of a catalogue star.";
    /// One measurement of one catalogue star: a row of `stars.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct StarRow {
        /// source FITS file name, the first member of a combination
        frame: String => ["meta.id;meta.file"],
        /// number of exposures combined
        n_members: Option<i64> => ["meta.number;obs.image"],
        /// number of the star pointing, from 0
        pointing: Option<i64> => ["meta.id;obs"],
        /// name of the pointing
        object_name: String => ["meta.id;meta.main"],
        /// identifier of the star in the catalogue
        star_id: String => ["meta.id"],
        /// right ascension of the catalogue (ICRS), moved to the night where it has proper motions
        ra_deg: Option<f64> => "deg" ["pos.eq.ra"],
        /// declination of the catalogue (ICRS), moved to the night where it has proper motions
        dec_deg: Option<f64> => "deg" ["pos.eq.dec"],
        /// mid-exposure UTC, ISO 8601; mean of the members
        date_mid: String => ["time.epoch;obs"],
        /// mid-exposure MJD (UTC); mean of the members
        mjd_mid_d: Option<f64> => "d" ["time.epoch;obs"],
        /// exposure time; mean of the members
        exptime_s: Option<f64> => "s" ["time.duration;obs.exposure"],
        /// gain setting of the camera in units of 0.1 dB; missing where members differ
        gain_setting: Option<i64> => ["instr.setup"],
        /// electrons per ADU at this gain setting; missing where members differ
        e_per_adu: Option<f64> => "electron / adu" ["arith.factor;instr.det"],
        /// centre of the aperture along a row in the first member, 0-based from the centre of the first pixel
        x_px: Option<f64> => "pix" ["pos.cartesian.x;instr.det"],
        /// centre of the aperture over rows in the first member, 0-based from the centre of the first pixel
        y_px: Option<f64> => "pix" ["pos.cartesian.y;instr.det"],
        /// aperture radius (circle); mean of the members
        aper_r_px: Option<f64> => "pix" ["phys.size.radius;instr.det"],
        /// inner radius of the sky annulus; mean of the members
        sky_in_px: Option<f64> => "pix" ["phys.size.radius;instr.det"],
        /// outer radius of the sky annulus; mean of the members
        sky_out_px: Option<f64> => "pix" ["phys.size.radius;instr.det"],
        /// FWHM of the stars of the frame, or photometry.fwhm_px; mean of the members
        fwhm_px: Option<f64> => "pix" ["instr.det.psf"],
        /// net flux in the aperture per exposure; combined: rate times exptime_s
        flux_e: Option<f64> => "electron" ["phot.count"],
        /// 1-sigma random error of flux_e
        flux_err_e: Option<f64> => "electron" ["stat.error;phot.count"],
        /// sky level under the aperture, whole exposure; mean of the members
        sky_e_px: Option<f64> => "electron / pix" ["instr.background"],
        /// flux_e / flux_err_e
        snr: Option<f64> => ["stat.snr"],
        /// brightest aperture pixel, with the sky, as a fraction of the saturation level; largest of the members
        peak_frac_sat: Option<f64> => ["instr.saturation;arith.ratio"],
        /// added to the magnitude for the light outside the aperture (growth curve)
        aper_corr_mag: Option<f64> => "mag" ["phot.mag;arith.diff"],
        /// -2.5 log10 of the flux in electrons per second, aper_corr_mag included
        inst_mag: Option<f64> => "mag" ["phot.mag;instr.det"],
        /// 1-sigma random error of inst_mag
        inst_mag_err: Option<f64> => "mag" ["stat.error;phot.mag;instr.det"],
        /// altitude above the horizon, without refraction; mean of the members
        alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// azimuth from north through east; of the first member
        az_deg: Option<f64> => "deg" ["pos.az.azi"],
        /// airmass; mean of the members
        airmass: Option<f64> => ["obs.airMass"],
        /// V magnitude of the catalogue
        catalogue_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// 1-sigma error of catalogue_v_mag
        catalogue_v_mag_err: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V"],
        /// colour B-V of the catalogue
        catalogue_b_v_mag: Option<f64> => "mag" ["phot.color;em.opt.B;em.opt.V"],
        /// 1-sigma error of catalogue_b_v_mag
        catalogue_b_v_mag_err: Option<f64> => "mag" ["stat.error;phot.color;em.opt.B;em.opt.V"],
        /// robust weight of this star in the zeropoint fit, 0 to 1; 0 = an outlier, missing = a cut kept it out
        fit_weight: Option<f64> => ["stat.weight"],
        /// V_inst - V minus the fit
        fit_residual_mag: Option<f64> => "mag" ["stat.fit.residual"],
        /// share of its own residual this star takes up in the zeropoint fit, 0 to 1
        fit_leverage: Option<f64> => ["stat.fit.param"],
        /// distance of the detection from the aligned place of the catalogue; mean of the members
        match_arcsec: Option<f64> => "arcsec" ["pos.angDistance"],
        /// ok or rejected; empty where no zeropoint was fitted
        status: String => ["meta.code.status"],
        /// why, when status is not ok
        reason: String => ["meta.note"],
        /// quality bit mask of all members; the bits are named in meta
        flags: i32 => ["meta.code.qual"],
    }
}
