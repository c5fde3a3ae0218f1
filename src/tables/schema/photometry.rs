//! Target frames: `photometry.ecsv`, and what a merge of part of a night adds to it.
//!
//! A field's comment is the description of its column; an empty text and `None` mean missing, zero is a value.

use serde::{Deserialize, Serialize};

use super::define::{Column, Definition, Row, joined, table};

table! {
    PHOTOMETRY = "photometry.ecsv", "One row per target frame, and per frame that failed, with its reason.";
    /// One target frame: a row of `photometry.ecsv`. A frame that failed is a row too, with its reason.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct PhotometryRow {
        // --- id
        /// source FITS file name
        frame: String => ["meta.id;meta.file"],
        /// first 16 hex digits of the SHA-256 of the source file
        frame_sha256: String => ["meta.checksum"],
        /// satellite catalogue number
        norad_cat_id: Option<i64> => ["meta.id"],
        /// COSPAR international designator
        object_id: String => ["meta.id"],
        /// name of the target: of the elements, else OBJECT of the header
        object_name: String => ["meta.id;meta.main"],
        // --- time
        /// mid-exposure UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// mid-exposure MJD (UTC)
        mjd_mid_d: Option<f64> => "d" ["time.epoch;obs"],
        /// exposure time
        exptime_s: Option<f64> => "s" ["time.duration;obs.exposure"],
        /// 1-sigma error of the mid-exposure time
        time_err_s: Option<f64> => "s" ["stat.error;time.epoch"],
        /// header keywords the time is from
        time_source: String => ["meta.note"],
        /// what the stamps of the time mark: start, middle, end or start_end (one of each)
        time_stamp: String => ["meta.code"] added_later,
        /// time since the frame of this target before, from mid-exposure to mid-exposure
        cadence_s: Option<f64> => "s" ["time.interval;obs"],
        /// middle the header states itself (DATE-AVG or a synonym) minus (start + EXPTIME/2); missing without both stamps
        date_avg_minus_mid_s: Option<f64> => "s" ["time.interval;arith.diff"] added_later,
        // --- optics
        /// filter name of the header
        filter: String => ["meta.id;instr.filter"],
        /// gain setting of the camera in units of 0.1 dB
        gain_setting: Option<i64> => ["instr.setup"],
        /// electrons per ADU at this gain setting
        e_per_adu: Option<f64> => "electron / adu" ["arith.factor;instr.det"],
        /// where e_per_adu is from
        e_per_adu_source: String => ["meta.note"],
        /// read noise per pixel
        read_noise_e: Option<f64> => "electron" ["instr.det.noise"],
        /// FWHM of the stars: photometry.fwhm_px, else the median of the star frames; missing where there is neither
        fwhm_px: Option<f64> => "pix" ["instr.det.psf"],
        /// pixel scale
        pix_scale_arcsec: Option<f64> => "arcsec / pix" ["phys.angSize;instr.pixel"],
        // --- pixel
        /// centre of the aperture along a row, 0-based from the centre of the first pixel; a non-detection's is the expected
        /// place
        x_px: Option<f64> => "pix" ["pos.cartesian.x;instr.det"],
        /// centre of the aperture over rows, 0-based from the centre of the first pixel; a non-detection's is the expected
        /// place
        y_px: Option<f64> => "pix" ["pos.cartesian.y;instr.det"],
        /// radius of the circle in which the target was looked for: target.search_radius_arcsec around the expected place, less
        /// around that where other frames of the pass show it
        search_radius_px: Option<f64> => "pix" ["phys.size.radius;instr.det"] added_later,
        /// shape of the aperture: circle, ellipse, rectangle or pill
        aper_shape: String => ["meta.code"],
        /// aperture radius (circle)
        aper_r_px: Option<f64> => "pix" ["phys.size.radius;instr.det"],
        /// half the length of the aperture (semi-major axis of an ellipse)
        aper_a_px: Option<f64> => "pix" ["phys.size.smajAxis;instr.det"],
        /// half the width of the aperture (semi-minor axis of an ellipse)
        aper_b_px: Option<f64> => "pix" ["phys.size.sminAxis;instr.det"],
        /// angle of the major axis from +x towards +y
        aper_theta_deg: Option<f64> => "deg" ["pos.posAng;instr.det"],
        /// ratio of the axes of the target's light
        elongation: Option<f64> => ["phys.size.axisRatio"],
        /// FWHM of the target along its major axis in units of fwhm_px
        extent_fwhm: Option<f64> => ["phys.size;arith.ratio"],
        /// what the pixels of a target found at the scale of a star tell: point (odds above 10), compact (a point or some FWHM
        /// wide: flux_e is that of a disc of any such size) or extended; the first two are weighed by the profile of the stars
        source_kind: String => ["meta.code"] added_later,
        /// decimal logarithm of the odds of a point against a wider disc, by the pixels, the model and the range
        point_log10_odds: Option<f64> => ["stat.likelihood"] added_later,
        /// square of the diameter of the disc that fits, in units of fwhm_px squared; negative where it is narrower than a star
        disc_fwhm2: Option<f64> => ["phys.angSize;arith.ratio"] added_later,
        /// 1-sigma error of disc_fwhm2, that of the width of the stars included
        disc_fwhm2_err: Option<f64> => ["stat.error;phys.angSize"] added_later,
        /// inner radius of the sky annulus
        sky_in_px: Option<f64> => "pix" ["phys.size.radius;instr.det"],
        /// outer radius of the sky annulus
        sky_out_px: Option<f64> => "pix" ["phys.size.radius;instr.det"],
        // --- flux
        /// net flux in the aperture, whole exposure; can be negative
        flux_e: Option<f64> => "electron" ["phot.count"],
        /// 1-sigma random error of flux_e
        flux_err_e: Option<f64> => "electron" ["stat.error;phot.count"],
        /// light of a point, weighed by the profile of the stars, at the place forced_at names, whatever is there; at that of
        /// the pass the profile is as wide as the detections of the pass; can be negative
        forced_flux_e: Option<f64> => "electron" ["phot.count"] added_later,
        /// 1-sigma random error of forced_flux_e, with that of the width of the stars or of the target's images
        forced_flux_err_e: Option<f64> => "electron" ["stat.error;phot.count"] added_later,
        /// where forced_flux_e is measured: detection (that of this frame; the whole light, flux_e and aper_corr_mag, of a compact
        /// target where that has the smaller error, and of an outline above S/N 25), pass (where the frames of the pass show it),
        /// expected (target.x_px and y_px, else the middle of the frame: too faint where the target stands elsewhere)
        forced_at: String => ["meta.code"] added_later,
        /// that place along a row
        forced_x_px: Option<f64> => "pix" ["pos.cartesian.x;instr.det"] added_later,
        /// that place over rows
        forced_y_px: Option<f64> => "pix" ["pos.cartesian.y;instr.det"] added_later,
        /// sky level under the aperture, whole exposure; with the mean light of trails where the level is taken along them
        sky_e_px: Option<f64> => "electron / pix" ["instr.background"],
        /// background at the edge of the field over that at its centre
        sky_corner_ratio: Option<f64> => ["instr.background;arith.ratio"],
        /// flux_e / flux_err_e; of a compact target (source_kind) the significance of a point by noise alone: flux_err_e holds the
        /// unknown size and the width of the stars, too
        snr: Option<f64> => ["stat.snr"],
        /// brightest aperture pixel, with the sky, as a fraction of the saturation level
        peak_frac_sat: Option<f64> => ["instr.saturation;arith.ratio"],
        /// share of flux_e in masked pixels, which their neighbours or the mean of the aperture replace
        masked_frac: Option<f64> => ["phot.count;arith.ratio"] added_later,
        /// light of star trails and neighbours inside the aperture over flux_e (over flux_err_e where that is larger); that
        /// of trails is subtracted from flux_e; empty where trails fill the frame beside the aperture so that theirs is unknown
        contam_frac: Option<f64> => ["phot.count;arith.ratio"],
        /// added to the magnitude for the light outside the aperture (growth curve)
        aper_corr_mag: Option<f64> => "mag" ["phot.mag;arith.diff"],
        /// -2.5 log10 of the flux in electrons per second, aper_corr_mag included
        inst_mag: Option<f64> => "mag" ["phot.mag;instr.det"],
        /// apparent V magnitude outside the atmosphere
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// 1-sigma random error of v_mag and of inst_mag
        v_mag_err: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V"],
        /// 1-sigma systematic error of v_mag: zeropoint, scatter of one pointing, colour of the target, gain table, aperture
        /// correction, another night's zeropoint
        v_mag_err_sys: Option<f64> => "mag" ["stat.error.sys;phot.mag;em.opt.V"],
        /// time from the night of the zeropoint to this frame; missing if it is this night's own
        zp_age_d: Option<f64> => "d" ["time.age"],
        /// error of using another night's zeropoint, part of v_mag_err_sys
        zp_extra_err_mag: Option<f64> => "mag" ["stat.error.sys;phot.mag;em.opt.V"],
        /// zeropoint that v_mag rests on: night, other_night or trails (the star trails of this frame, where the night has none)
        v_mag_zeropoint: String => ["meta.code"] added_later,
        /// how much fainter the stars that trail through this frame are than the zeropoint says; missing where the trails do
        /// not match the catalogue, see frame_zp_note
        frame_zp_offset_mag: Option<f64> => "mag" ["phot.mag;arith.diff"] added_later,
        /// 1-sigma error of frame_zp_offset_mag: trails, catalogue, scatter of the stars, zeropoint
        frame_zp_offset_err_mag: Option<f64> => "mag" ["stat.error;phot.mag"] added_later,
        /// stars behind frame_zp_offset_mag
        frame_zp_stars: Option<i64> => ["meta.number"] added_later,
        /// V magnitude by the star trails of this frame: v_mag - frame_zp_offset_mag; right through clouds, too
        frame_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"] added_later,
        /// 1-sigma systematic error of frame_v_mag: star trails, colour of the target, aperture correction
        frame_v_mag_err_sys: Option<f64> => "mag" ["stat.error.sys;phot.mag;em.opt.V"] added_later,
        /// why the star trails of this frame give no offset
        frame_zp_note: String => ["meta.note"] added_later,
        /// V magnitude at which 95 % of targets are detected (target.detect_sigma); of a non-detection: of point sources
        /// anywhere in this frame's search region, scaled to the object's size in the frames that show it; of a detection:
        /// in its own aperture
        limit_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;stat.max"],
        /// v_mag at a range of 550 km: v_mag - 5 lg(range_km / 550)
        v_mag_550km: Option<f64> => "mag" ["phot.mag;em.opt.V"] added_later,
        /// v_mag at a range of 1000 km
        v_mag_1000km: Option<f64> => "mag" ["phot.mag;em.opt.V"] added_later,
        /// standard magnitude: v_mag_1000km as if half lit (phase angle 90 deg), + 2.5 lg(1 + cos(phase_angle_deg))
        standard_v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"] added_later,
        /// mean V surface brightness over the aperture
        mu_mean_mag_arcsec2: Option<f64> => "mag / arcsec2" ["phot.mag.sb;em.opt.V"],
        /// V surface brightness of the brightest disc of one FWHM across
        mu_peak_mag_arcsec2: Option<f64> => "mag / arcsec2" ["phot.mag.sb;em.opt.V;stat.max"],
        // --- geometry
        /// altitude above the horizon, without refraction
        alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: Option<f64> => "deg" ["pos.az.azi"],
        /// distance from the observer
        range_km: Option<f64> => "km" ["pos.distance"],
        /// angular rate against the stars
        rate_deg_s: Option<f64> => "deg / s" ["phys.veloc.ang"],
        /// rate of the azimuth, which a dome must follow
        az_rate_deg_s: Option<f64> => "deg / s" ["phys.veloc.ang;pos.az.azi"],
        /// 1-sigma error of the place along the track by time_err_s: rate_deg_s * time_err_s
        alt_az_err_deg: Option<f64> => "deg" ["stat.error;pos.az"],
        /// right ascension at mid-exposure by the star trails, ICRS, topocentric; missing unless three of their ends lie in the
        /// frame
        ra_deg: Option<f64> => "deg" ["pos.eq.ra"] added_later,
        /// declination at mid-exposure by the star trails, ICRS, topocentric
        dec_deg: Option<f64> => "deg" ["pos.eq.dec"] added_later,
        /// 1-sigma error of ra_deg, times cos(dec_deg), without that of the time
        ra_err_arcsec: Option<f64> => "arcsec" ["stat.error;pos.eq.ra"] added_later,
        /// 1-sigma error of dec_deg, without that of the time
        dec_err_arcsec: Option<f64> => "arcsec" ["stat.error;pos.eq.dec"] added_later,
        /// observed minus computed place along the motion among the stars, positive = ahead of the elements
        along_oc_arcsec: Option<f64> => "arcsec" ["pos.angDistance;arith.diff"] added_later,
        /// 1-sigma error of along_oc_arcsec
        along_oc_err_arcsec: Option<f64> => "arcsec" ["stat.error;pos.angDistance"] added_later,
        /// observed minus computed place across the motion, positive = at the position angle of the motion + 90 deg
        cross_oc_arcsec: Option<f64> => "arcsec" ["pos.angDistance;arith.diff"] added_later,
        /// 1-sigma error of cross_oc_arcsec
        cross_oc_err_arcsec: Option<f64> => "arcsec" ["stat.error;pos.angDistance"] added_later,
        /// airmass
        airmass: Option<f64> => ["obs.airMass"],
        /// angle Sun - satellite - observer
        phase_angle_deg: Option<f64> => "deg" ["pos.phaseAng"],
        /// altitude of the Sun at the observer
        sun_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// altitude of the Sun at the satellite, above the plane at right angles to nadir; negative while its underside is lit
        sun_alt_sat_deg: Option<f64> => "deg" ["pos.az.alt"] added_later,
        /// altitude of the Moon at the observer
        moon_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// phase angle of the Moon (0 = full)
        moon_phase_deg: Option<f64> => "deg" ["pos.phaseAng"],
        /// illuminated fraction of the lunar disc
        moon_illum_pct: Option<f64> => "%" ["phys.area;arith.ratio"],
        /// angle between the target and the Moon on the sky
        moon_sep_deg: Option<f64> => "deg" ["pos.angDistance"],
        /// largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none
        illum: String => ["meta.code"],
        /// where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night
        sky_class: String => ["meta.code"] added_later,
        /// day, twilight (sunlight on the satellite or in the sky) or night, as Caddy et al. label it
        paper_label: String => ["meta.code"] added_later,
        /// mid-exposure minus epoch of the elements
        tle_age_d: Option<f64> => "d" ["time.age"],
        // --- model
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
        /// cosine of the angle under which the observer sees the sunlit side of the modelled solar array; 0 where it is not seen
        /// or not lit, missing without an array
        lit_array_cos: Option<f64> => ["pos.posAng;meta.modelled"] added_later,
        /// observed minus modelled magnitude; positive = observed fainter
        residual_mag: Option<f64> => "mag" ["phot.mag;em.opt.V;arith.diff"],
        /// what the model skipped, and why
        skipped: String => ["meta.note"],
        /// distance of the header's pointing from the predicted position of the satellite; missing where the header states none
        pointing_sep_deg: Option<f64> => "deg" ["pos.angDistance"],
        /// what was subtracted as the level without light: pedestal, overscan, or how many bias and dark frames; and of how many star fields the hot pixels are known
        zero_level: String => ["meta.note"],
        // --- state
        /// ok, nondetection, rejected or failed
        status: String => ["meta.code.status"],
        /// use, caution or reject
        verdict: String => ["meta.code.qual"],
        /// why, when status is not ok or verdict is not use; and what old elements spoil
        reason: String => ["meta.note"],
        /// quality bit mask; the bits are named in meta
        flags: i32 => ["meta.code.qual"],
    }
}

table! {
    RAW = "photometry.ecsv (shards missing)", "Further columns of photometry.ecsv where `merge` left missing shards out.";
    /// The cells of a row that more frames of the night would change, as they were before.
    #[derive(Debug, Clone, Default, Serialize, Deserialize)]
    pub struct RawRow {
        /// limit_v_mag before it was made that of the object as the other frames show it
        raw_limit_v_mag: Option<f64> => "mag",
        /// verdict of the frame by itself
        raw_verdict: String,
        /// reason of the frame by itself
        raw_reason: String,
        /// flags of the frame by itself
        raw_flags: i32,
    }
}

/// A row of part of a night: the target frame, and its cells before the rest of the night was known.
pub type PartialRow<'a> = (&'a PhotometryRow, &'a RawRow);

/// Part of a night: photometry with the columns of [`RAW`].
pub const PARTIAL: Definition = Definition {
    file: RAW.file,
    about: "Target frames where shards are missing, with further columns.",
    columns: &joined::<PARTIAL_COLUMNS>(PHOTOMETRY.columns, RAW.columns),
};
const PARTIAL_COLUMNS: usize = PHOTOMETRY.columns.len() + RAW.columns.len();

impl Row for PartialRow<'_> {
    const TABLE: Definition = PARTIAL;
}

/// A predicted pass: some columns of photometry, with what they say of a prediction.
pub const PREDICTION: Definition = Definition {
    file: "prediction.ecsv",
    about: "One row per moment of `predict pass`.",
    columns: &[
        of("date_mid").described("moment of the row, UTC, ISO 8601"),
        of("mjd_mid_d").described("moment of the row, MJD (UTC)"),
        of("alt_deg"),
        of("az_deg"),
        of("range_km"),
        of("rate_deg_s"),
        of("airmass"),
        of("phase_angle_deg"),
        of("sun_alt_deg"),
        of("sun_alt_sat_deg"),
        of("moon_alt_deg"),
        of("moon_phase_deg"),
        of("moon_illum_pct"),
        of("moon_sep_deg"),
        of("illum"),
        of("sky_class"),
        of("paper_label"),
        of("tle_age_d").described("moment of the row minus epoch of the elements"),
        of("model_v_mag"),
        of("sun_v_mag"),
        of("earthshine_v_mag"),
        of("moon_v_mag"),
        of("lunar_earthshine_v_mag"),
        of("model_err_mag"),
        of("v_pred_err_mag"),
        of("lit_array_cos"),
        of("mu_mean_mag_arcsec2").described(
            "mean V surface brightness of the model over the satellite's area, seen in projection (as_published: all of it)",
        ),
        of("norad_cat_id"),
        of("object_name"),
        of("skipped"),
        of("flags"),
    ],
};

/// What `predict table` adds to a table: some columns of photometry.
pub const PREDICTED: Definition = Definition {
    file: "predicted.ecsv",
    about: "Columns that `predict table` adds behind those of a table of observations; of a table of geometry those that it has.",
    columns: &joined::<PREDICTED_COLUMNS>(PLACED, STATED),
};
/// What `compare` adds to a table that is not satphot's.
pub const COMPARED: Definition = Definition {
    file: "compared.ecsv",
    about: "Columns that `compare` adds behind those of a table of observations.",
    columns: &joined::<COMPARED_COLUMNS>(&joined::<WITH_MAGNITUDES>(PLACED, MAGNITUDES), STATED),
};
const PREDICTED_COLUMNS: usize = PLACED.len() + STATED.len();
const WITH_MAGNITUDES: usize = PLACED.len() + MAGNITUDES.len();
const COMPARED_COLUMNS: usize = WITH_MAGNITUDES + STATED.len();

/// Where everything is, and the model.
const PLACED: &[Column] = &[
    of("mjd_mid_d").described("moment that the row is computed for, MJD (UTC)"),
    of("norad_cat_id"),
    of("object_name").described("name of the satellite in the elements"),
    of("alt_deg"),
    of("az_deg"),
    of("range_km"),
    of("rate_deg_s"),
    of("airmass"),
    of("phase_angle_deg"),
    of("sun_alt_deg"),
    of("sun_alt_sat_deg"),
    of("moon_alt_deg"),
    of("moon_phase_deg"),
    of("moon_illum_pct"),
    of("moon_sep_deg"),
    of("illum"),
    of("sky_class"),
    of("paper_label"),
    of("tle_age_d").described("moment of the row minus epoch of the elements"),
    of("model_v_mag"),
    of("sun_v_mag"),
    of("earthshine_v_mag"),
    of("moon_v_mag"),
    of("lunar_earthshine_v_mag"),
    of("model_err_mag"),
    of("v_pred_err_mag"),
    of("lit_array_cos"),
    of("mu_mean_mag_arcsec2").described(
        "mean V surface brightness of the model over the satellite's area, seen in projection (as_published: all of it)",
    ),
];
/// What is compared.
const MAGNITUDES: &[Column] = &[
    of("v_mag").described("V magnitude of the row as it is compared: apparent, outside the atmosphere"),
    of("v_mag_err").described("1-sigma error of v_mag that the table states"),
    of("v_mag_1000km"),
    of("standard_v_mag"),
    of("residual_mag"),
    of("verdict").described("use, caution or reject: rejected rows are in no statistics"),
];
/// What became of the row.
const STATED: &[Column] = &[
    of("skipped"),
    of("status").described("ok, nondetection (no magnitude), rejected (not of this model, place or time) or failed"),
    of("reason").described("why the row has no numbers or is rejected, and what is doubtful about it"),
    of("flags"),
];

const fn of(name: &str) -> Column {
    PHOTOMETRY.column(name)
}
