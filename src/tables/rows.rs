//! The rows of a run's tables: one public field per column of [`crate::tables::columns`], same name, same order.
//!
//! Units are those of the column. An empty text and `None` mean missing; zero is a value. Numbers are never NaN:
//! the writer refuses them.

use serde::{Deserialize, Serialize};

/// One target frame: a row of `photometry.ecsv`. A frame that failed is a row too, with its reason.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PhotometryRow {
    // --- id
    /// Source FITS file name.
    pub frame: String,
    /// First 16 hex digits of the SHA-256 of the source file.
    pub frame_sha256: String,
    /// Satellite catalogue number.
    pub norad_cat_id: Option<i64>,
    /// COSPAR international designator.
    pub object_id: String,
    /// Name of the target: of the elements, else OBJECT of the header.
    pub object_name: String,
    // --- time
    /// Mid-exposure UTC, ISO 8601.
    pub date_mid: String,
    /// Mid-exposure MJD (UTC) \[d\].
    pub mjd_mid_d: Option<f64>,
    /// Exposure time \[s\].
    pub exptime_s: Option<f64>,
    /// 1-sigma error of the mid-exposure time \[s\].
    pub time_err_s: Option<f64>,
    /// Header keywords the time is from.
    pub time_source: String,
    /// What the stamps of the time mark: start, middle, end or start_end (one of each).
    #[serde(default)]
    pub time_stamp: String,
    /// Time since the frame of this target before, from mid-exposure to mid-exposure \[s\].
    pub cadence_s: Option<f64>,
    /// Middle the header states itself (DATE-AVG or a synonym) minus (start + EXPTIME/2); missing without both stamps
    /// \[s\].
    #[serde(default)]
    pub date_avg_minus_mid_s: Option<f64>,
    // --- optics
    /// Filter name of the header.
    pub filter: String,
    /// Gain setting of the camera in units of 0.1 dB.
    pub gain_setting: Option<i64>,
    /// Electrons per ADU at this gain setting \[e⁻/ADU\].
    pub e_per_adu: Option<f64>,
    /// Where e_per_adu is from.
    pub e_per_adu_source: String,
    /// Read noise per pixel \[e⁻\].
    pub read_noise_e: Option<f64>,
    /// FWHM of the stars: photometry.fwhm_px, else the median of the star frames; missing where neither tells \[px\].
    pub fwhm_px: Option<f64>,
    /// Pixel scale \[arcsec/px\].
    pub pix_scale_arcsec: Option<f64>,
    // --- pixel
    /// Centre of the aperture along a row, 0-based from the centre of the first pixel; a non-detection's is the
    /// expected place \[px\].
    pub x_px: Option<f64>,
    /// Centre of the aperture over rows, 0-based from the centre of the first pixel; a non-detection's is the
    /// expected place \[px\].
    pub y_px: Option<f64>,
    /// Shape of the aperture: circle, ellipse, rectangle or pill.
    pub aper_shape: String,
    /// Aperture radius (circle) \[px\].
    pub aper_r_px: Option<f64>,
    /// Half the length of the aperture (semi-major axis of an ellipse) \[px\].
    pub aper_a_px: Option<f64>,
    /// Half the width of the aperture (semi-minor axis of an ellipse) \[px\].
    pub aper_b_px: Option<f64>,
    /// Angle of the major axis from +x towards +y \[deg\].
    pub aper_theta_deg: Option<f64>,
    /// Ratio of the axes of the target's light.
    pub elongation: Option<f64>,
    /// FWHM of the target along its major axis in units of fwhm_px.
    pub extent_fwhm: Option<f64>,
    /// Inner radius of the sky annulus \[px\].
    pub sky_in_px: Option<f64>,
    /// Outer radius of the sky annulus \[px\].
    pub sky_out_px: Option<f64>,
    // --- flux
    /// Net flux in the aperture, whole exposure; can be negative \[e⁻\].
    pub flux_e: Option<f64>,
    /// 1-sigma random error of flux_e \[e⁻\].
    pub flux_err_e: Option<f64>,
    /// Of a non-detection: flux in a circle of target.limit_r_fwhm at the expected place (target.x_px and y_px, else the
    /// middle of the frame), whatever is there; can be negative \[e⁻\].
    #[serde(default)]
    pub forced_flux_e: Option<f64>,
    /// 1-sigma random error of forced_flux_e \[e⁻\].
    #[serde(default)]
    pub forced_flux_err_e: Option<f64>,
    /// Sky level under the aperture, whole exposure; with the mean light of trails where the level is taken along
    /// them \[e⁻/px\].
    pub sky_e_px: Option<f64>,
    /// Background at the rim of the field over that at its centre.
    pub sky_corner_ratio: Option<f64>,
    /// flux_e / flux_err_e.
    pub snr: Option<f64>,
    /// Brightest aperture pixel, with the sky, as a fraction of the saturation level.
    pub peak_frac_sat: Option<f64>,
    /// Light of star trails and neighbours inside the aperture over flux_e (over flux_err_e where that is larger);
    /// that of trails is subtracted from flux_e.
    pub contam_frac: Option<f64>,
    /// Added to the magnitude for the light outside the aperture (growth curve) \[mag\].
    pub aper_corr_mag: Option<f64>,
    /// -2.5 log10 of the flux in electrons per second, aper_corr_mag included \[mag\].
    pub inst_mag: Option<f64>,
    /// Apparent V magnitude outside the atmosphere \[mag\].
    pub v_mag: Option<f64>,
    /// 1-sigma random error of v_mag and of inst_mag \[mag\].
    pub v_mag_err: Option<f64>,
    /// 1-sigma systematic error of v_mag: zeropoint, scatter of one pointing, colour of the target, gain table,
    /// aperture correction, another night's zeropoint \[mag\].
    pub v_mag_err_sys: Option<f64>,
    /// Time from the night of the zeropoint to this frame; missing if it is this night's own \[d\].
    pub zp_age_d: Option<f64>,
    /// Error of using another night's zeropoint, part of v_mag_err_sys \[mag\].
    pub zp_extra_err_mag: Option<f64>,
    /// V magnitude at which 95 % of targets are detected (target.detect_sigma); of a non-detection: of point sources
    /// anywhere in this frame's search region, scaled to the object's size in the frames that show it; of a detection: in
    /// its own aperture \[mag\].
    pub limit_v_mag: Option<f64>,
    /// Mean V surface brightness over the aperture \[mag/arcsec²\].
    pub mu_mean_mag_arcsec2: Option<f64>,
    /// V surface brightness of the brightest disc of one FWHM across \[mag/arcsec²\].
    pub mu_peak_mag_arcsec2: Option<f64>,
    // --- geometry
    /// Altitude above the horizon, without refraction \[deg\].
    pub alt_deg: Option<f64>,
    /// Azimuth from north through east \[deg\].
    pub az_deg: Option<f64>,
    /// Distance from the observer \[km\].
    pub range_km: Option<f64>,
    /// Angular rate against the stars \[deg/s\].
    pub rate_deg_s: Option<f64>,
    /// Rate of the azimuth, which a dome must follow \[deg/s\].
    pub az_rate_deg_s: Option<f64>,
    /// 1-sigma error of the place along the track by time_err_s: rate_deg_s * time_err_s \[deg\].
    pub alt_az_err_deg: Option<f64>,
    /// Airmass.
    pub airmass: Option<f64>,
    /// Angle Sun - satellite - observer \[deg\].
    pub phase_angle_deg: Option<f64>,
    /// Altitude of the Sun at the observer \[deg\].
    pub sun_alt_deg: Option<f64>,
    /// Altitude of the Moon at the observer \[deg\].
    pub moon_alt_deg: Option<f64>,
    /// Phase angle of the Moon (0 = full) \[deg\].
    pub moon_phase_deg: Option<f64>,
    /// Illuminated fraction of the lunar disc \[%\].
    pub moon_illum_pct: Option<f64>,
    /// Angle between the target and the Moon on the sky \[deg\].
    pub moon_sep_deg: Option<f64>,
    /// Largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none.
    pub illum: String,
    /// Where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night.
    #[serde(default)]
    pub sky_class: String,
    /// day, twilight (sunlight on the satellite or in the sky) or night, as Caddy et al. label it.
    #[serde(default)]
    pub paper_label: String,
    /// Mid-exposure minus epoch of the elements \[d\].
    pub tle_age_d: Option<f64>,
    // --- model
    /// Modelled V magnitude, all lights \[mag\].
    pub model_v_mag: Option<f64>,
    /// Modelled V magnitude by direct sunlight alone \[mag\].
    pub sun_v_mag: Option<f64>,
    /// Modelled V magnitude by sunlight from the Earth alone \[mag\].
    pub earthshine_v_mag: Option<f64>,
    /// Modelled V magnitude by direct moonlight alone \[mag\].
    pub moon_v_mag: Option<f64>,
    /// Modelled V magnitude by moonlight from the Earth alone \[mag\].
    pub lunar_earthshine_v_mag: Option<f64>,
    /// Numerical error of model_v_mag (quadrature); not how wrong the model is \[mag\].
    pub model_err_mag: Option<f64>,
    /// Observed minus modelled magnitude; positive = observed fainter \[mag\].
    pub residual_mag: Option<f64>,
    /// What the model left out, and why.
    pub skipped: String,
    // --- state
    /// ok, nondetection, rejected or failed.
    pub status: String,
    /// Use, caution or reject.
    pub verdict: String,
    /// Why, when status is not ok or verdict is not use; and what old elements spoil.
    pub reason: String,
    /// Quality bit mask; the bits are named in meta.
    pub flags: i32,
}

/// One measurement of one catalogue star: a row of `stars.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StarRow {
    /// Source FITS file name, the first member of a combination.
    pub frame: String,
    /// Number of exposures combined.
    pub n_members: Option<i64>,
    /// Number of the star pointing, from 0.
    pub pointing: Option<i64>,
    /// Name of the pointing.
    pub object_name: String,
    /// Identifier of the star in the catalogue.
    pub star_id: String,
    /// Right ascension of the catalogue (ICRS), moved to the night where it has proper motions \[deg\].
    pub ra_deg: Option<f64>,
    /// Declination of the catalogue (ICRS), moved to the night where it has proper motions \[deg\].
    pub dec_deg: Option<f64>,
    /// Mid-exposure UTC, ISO 8601; mean of the members.
    pub date_mid: String,
    /// Mid-exposure MJD (UTC); mean of the members \[d\].
    pub mjd_mid_d: Option<f64>,
    /// Exposure time; mean of the members \[s\].
    pub exptime_s: Option<f64>,
    /// Gain setting of the camera in units of 0.1 dB; missing where members differ.
    pub gain_setting: Option<i64>,
    /// Electrons per ADU at this gain setting; missing where members differ \[e⁻/ADU\].
    pub e_per_adu: Option<f64>,
    /// Centre of the aperture along a row in the first member, 0-based from the centre of the first pixel \[px\].
    pub x_px: Option<f64>,
    /// Centre of the aperture over rows in the first member, 0-based from the centre of the first pixel \[px\].
    pub y_px: Option<f64>,
    /// Aperture radius (circle); mean of the members \[px\].
    pub aper_r_px: Option<f64>,
    /// Inner radius of the sky annulus; mean of the members \[px\].
    pub sky_in_px: Option<f64>,
    /// Outer radius of the sky annulus; mean of the members \[px\].
    pub sky_out_px: Option<f64>,
    /// FWHM of the stars of the frame, or photometry.fwhm_px; mean of the members \[px\].
    pub fwhm_px: Option<f64>,
    /// Net flux in the aperture per exposure; combined: rate times exptime_s \[e⁻\].
    pub flux_e: Option<f64>,
    /// 1-sigma random error of flux_e \[e⁻\].
    pub flux_err_e: Option<f64>,
    /// Sky level under the aperture, whole exposure; mean of the members \[e⁻/px\].
    pub sky_e_px: Option<f64>,
    /// flux_e / flux_err_e.
    pub snr: Option<f64>,
    /// Brightest aperture pixel, with the sky, as a fraction of the saturation level; largest of the members.
    pub peak_frac_sat: Option<f64>,
    /// Added to the magnitude for the light outside the aperture (growth curve) \[mag\].
    pub aper_corr_mag: Option<f64>,
    /// -2.5 log10 of the flux in electrons per second, aper_corr_mag included \[mag\].
    pub inst_mag: Option<f64>,
    /// 1-sigma random error of inst_mag \[mag\].
    pub inst_mag_err: Option<f64>,
    /// Altitude above the horizon, without refraction; mean of the members \[deg\].
    pub alt_deg: Option<f64>,
    /// Azimuth from north through east; of the first member \[deg\].
    pub az_deg: Option<f64>,
    /// Airmass; mean of the members.
    pub airmass: Option<f64>,
    /// V magnitude of the catalogue \[mag\].
    pub catalogue_v_mag: Option<f64>,
    /// 1-sigma error of catalogue_v_mag \[mag\].
    pub catalogue_v_mag_err: Option<f64>,
    /// Colour B-V of the catalogue \[mag\].
    pub catalogue_b_v_mag: Option<f64>,
    /// 1-sigma error of catalogue_b_v_mag \[mag\].
    pub catalogue_b_v_mag_err: Option<f64>,
    /// Robust weight of this star in the zeropoint fit, 0 to 1; 0 = an outlier, missing = a cut kept it out.
    pub fit_weight: Option<f64>,
    /// V_inst - V minus the fit \[mag\].
    pub fit_residual_mag: Option<f64>,
    /// Share of its own residual this star takes up in the zeropoint fit, 0 to 1.
    pub fit_leverage: Option<f64>,
    /// Distance of the detection from the aligned place of the catalogue; mean of the members \[arcsec\].
    pub match_arcsec: Option<f64>,
    /// Ok or rejected; empty where no zeropoint was fitted.
    pub status: String,
    /// Why, when status is not ok.
    pub reason: String,
    /// Quality bit mask of all members; the bits are named in meta.
    pub flags: i32,
}

/// Observed minus modelled for one target frame: a row of `residuals.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ResidualRow {
    /// Source FITS file name.
    pub frame: String,
    /// Satellite catalogue number.
    pub norad_cat_id: Option<i64>,
    /// Name of the target.
    pub object_name: String,
    /// Number of the pass in the night, from 1.
    pub pass: Option<i64>,
    /// Mid-exposure UTC, ISO 8601.
    pub date_mid: String,
    /// Mid-exposure MJD (UTC) \[d\].
    pub mjd_mid_d: Option<f64>,
    /// Altitude above the horizon, without refraction \[deg\].
    pub alt_deg: Option<f64>,
    /// Azimuth from north through east \[deg\].
    pub az_deg: Option<f64>,
    /// Distance from the observer \[km\].
    pub range_km: Option<f64>,
    /// Angle Sun - satellite - observer \[deg\].
    pub phase_angle_deg: Option<f64>,
    /// Angle between the target and the Moon on the sky \[deg\].
    pub moon_sep_deg: Option<f64>,
    /// Largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none.
    pub illum: String,
    /// Where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night.
    #[serde(default)]
    pub sky_class: String,
    /// day, twilight (sunlight on the satellite or in the sky) or night, as Caddy et al. label it.
    #[serde(default)]
    pub paper_label: String,
    /// Apparent V magnitude outside the atmosphere \[mag\].
    pub v_mag: Option<f64>,
    /// 1-sigma random error of v_mag \[mag\].
    pub v_mag_err: Option<f64>,
    /// 1-sigma systematic error of v_mag: zeropoint, scatter of one pointing, colour of the target, gain table,
    /// aperture correction, another night's zeropoint \[mag\].
    pub v_mag_err_sys: Option<f64>,
    /// Modelled V magnitude, all lights \[mag\].
    pub model_v_mag: Option<f64>,
    /// Numerical error of model_v_mag (quadrature); not how wrong the model is \[mag\].
    pub model_err_mag: Option<f64>,
    /// Observed minus modelled magnitude; positive = observed fainter \[mag\].
    pub residual_mag: Option<f64>,
    /// Use, caution or reject, of the residual: caution at best where the elements are more than 2 d old.
    pub verdict: String,
    /// Quality bit mask; the bits are named in meta.
    pub flags: i32,
}

/// One direction of a map of the sky: a row of `sky.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SkyRow {
    /// Altitude above the horizon, without refraction \[deg\].
    pub alt_deg: f64,
    /// Azimuth from north through east \[deg\].
    pub az_deg: f64,
    /// Distance from the observer \[km\].
    pub range_km: f64,
    /// Largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none.
    pub illum: String,
    /// Share of the Sun's light that gets past the Earth to the satellite.
    pub sun_visible_frac: f64,
    /// Modelled V magnitude, all lights \[mag\].
    pub model_v_mag: Option<f64>,
    /// Modelled V magnitude by direct sunlight alone \[mag\].
    pub sun_v_mag: Option<f64>,
    /// Modelled V magnitude by sunlight from the Earth alone \[mag\].
    pub earthshine_v_mag: Option<f64>,
    /// Modelled V magnitude by direct moonlight alone \[mag\].
    pub moon_v_mag: Option<f64>,
    /// Modelled V magnitude by moonlight from the Earth alone \[mag\].
    pub lunar_earthshine_v_mag: Option<f64>,
    /// Numerical error of model_v_mag (quadrature); not how wrong the model is \[mag\].
    pub model_err_mag: Option<f64>,
    /// Irradiance at the observer by all lights, in units of the Sun's at 1 au as the model scales it.
    pub flux_per_e0: f64,
}

/// One setting of a knob: a row of `accuracy.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct AccuracyRow {
    /// What is computed.
    pub method: String,
    /// The situation.
    pub case: String,
    /// What is set.
    pub knob: String,
    /// Its value.
    pub setting: String,
    /// 1 = the default setting.
    pub is_default: i32,
    /// 1 = no other setting of this case has both a smaller err_p95 and less CPU time.
    pub on_front: i32,
    /// What the errors are: relative, or a unit.
    pub err_unit: String,
    /// Median error: half of the cases are better.
    pub err_median: Option<f64>,
    /// 95th percentile of the error: 95 of 100 cases are better.
    pub err_p95: Option<f64>,
    /// The worst case; missing if one case gave no number.
    pub err_worst: Option<f64>,
    /// Cases the errors are from.
    pub n: i64,
    /// What cpu_us is the time of.
    pub work: String,
    /// CPU time of one piece of work, user and system, one thread \[µs\].
    pub cpu_us: f64,
    /// Memory of one piece of work, where it depends on the setting \[kB\].
    pub memory_kb: Option<f64>,
    /// What the errors are measured against.
    pub reference: String,
}

/// One stiff or extreme case: a row of `extremes.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ExtremeRow {
    /// Part of the program.
    pub area: String,
    /// The case, with the unit of its numbers.
    pub case: String,
    /// What is expected: a number from a closed form or an independent computation, or a refusal.
    pub expected: String,
    /// What came out.
    pub got: String,
    /// How far off it is, relative or in the unit of the case; missing for refusals.
    pub error: Option<f64>,
    /// How far off it may be.
    pub limit: Option<f64>,
    /// ok, known limit or WRONG.
    pub verdict: String,
}
