//! The one schema: every column of every table of a run, by name, unit, type and meaning, in file order.
//!
//! Units are spelled as ECSV readers (astropy) understand them; an empty unit is a pure number or a text.
//! The field of the same name in [`crate::tables::rows`] holds the value.

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datatype {
    /// UTF-8 text; empty = missing.
    Text,
    /// 64-bit integer or missing.
    Int64,
    /// 32-bit mask, never missing.
    Int32,
    /// 64-bit float or missing, never NaN.
    Float64,
}

impl Datatype {
    /// The name ECSV gives it.
    #[must_use]
    pub fn ecsv(self) -> &'static str {
        match self {
            Datatype::Text => "string",
            Datatype::Int64 => "int64",
            Datatype::Int32 => "int32",
            Datatype::Float64 => "float64",
        }
    }
}

/// One column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Name in the file and of the field of the row.
    pub name: &'static str,
    /// Unit as astropy spells it, or nothing.
    pub unit: &'static str,
    /// What the cells hold.
    pub datatype: Datatype,
    /// One line for the reader of the file.
    pub description: &'static str,
}

pub(crate) const fn text(name: &'static str, description: &'static str) -> Column {
    Column { name, unit: "", datatype: Datatype::Text, description }
}
pub(crate) const fn integer(name: &'static str, description: &'static str) -> Column {
    Column { name, unit: "", datatype: Datatype::Int64, description }
}
pub(crate) const fn bits(name: &'static str, description: &'static str) -> Column {
    Column { name, unit: "", datatype: Datatype::Int32, description }
}
pub(crate) const fn number(name: &'static str, unit: &'static str, description: &'static str) -> Column {
    Column { name, unit, datatype: Datatype::Float64, description }
}

/// Columns that tables of an older version lack; read as empty there.
pub const ADDED_LATER: [&str; 6] =
    ["sky_class", "paper_label", "date_avg_minus_mid_s", "time_stamp", "forced_flux_e", "forced_flux_err_e"];

/// Columns of `photometry.ecsv`: one row per target frame.
pub const PHOTOMETRY: &[Column] = &[
    // id
    text("frame", "source FITS file name"),
    text("frame_sha256", "first 16 hex digits of the SHA-256 of the source file"),
    integer("norad_cat_id", "satellite catalogue number"),
    text("object_id", "COSPAR international designator"),
    text("object_name", "name of the target: of the elements, else OBJECT of the header"),
    // time
    text("date_mid", "mid-exposure UTC, ISO 8601"),
    number("mjd_mid_d", "d", "mid-exposure MJD (UTC)"),
    number("exptime_s", "s", "exposure time"),
    number("time_err_s", "s", "1-sigma error of the mid-exposure time"),
    text("time_source", "header keywords the time is from"),
    text("time_stamp", "what the stamps of the time mark: start, middle, end or start_end (one of each)"),
    number("cadence_s", "s", "time since the frame of this target before, from mid-exposure to mid-exposure"),
    number(
        "date_avg_minus_mid_s",
        "s",
        "middle the header states itself (DATE-AVG or a synonym) minus (start + EXPTIME/2); missing without both stamps",
    ),
    // optics
    text("filter", "filter name of the header"),
    integer("gain_setting", "gain setting of the camera in units of 0.1 dB"),
    number("e_per_adu", "electron / adu", "electrons per ADU at this gain setting"),
    text("e_per_adu_source", "where e_per_adu is from"),
    number("read_noise_e", "electron", "read noise per pixel"),
    number(
        "fwhm_px",
        "pix",
        "FWHM of the stars: photometry.fwhm_px, else the median of the star frames; missing where neither tells",
    ),
    number("pix_scale_arcsec", "arcsec / pix", "pixel scale"),
    // pixel
    number(
        "x_px",
        "pix",
        "centre of the aperture along a row, 0-based from the centre of the first pixel; a non-detection's is the expected place",
    ),
    number(
        "y_px",
        "pix",
        "centre of the aperture over rows, 0-based from the centre of the first pixel; a non-detection's is the expected place",
    ),
    text("aper_shape", "shape of the aperture: circle, ellipse, rectangle or pill"),
    number("aper_r_px", "pix", "aperture radius (circle)"),
    number("aper_a_px", "pix", "half the length of the aperture (semi-major axis of an ellipse)"),
    number("aper_b_px", "pix", "half the width of the aperture (semi-minor axis of an ellipse)"),
    number("aper_theta_deg", "deg", "angle of the major axis from +x towards +y"),
    number("elongation", "", "ratio of the axes of the target's light"),
    number("extent_fwhm", "", "FWHM of the target along its major axis in units of fwhm_px"),
    number("sky_in_px", "pix", "inner radius of the sky annulus"),
    number("sky_out_px", "pix", "outer radius of the sky annulus"),
    // flux
    number("flux_e", "electron", "net flux in the aperture, whole exposure; can be negative"),
    number("flux_err_e", "electron", "1-sigma random error of flux_e"),
    number(
        "forced_flux_e",
        "electron",
        "of a non-detection: flux in a circle of target.limit_r_fwhm at the expected place (target.x_px and y_px, else the \
         middle of the frame), whatever is there; can be negative",
    ),
    number("forced_flux_err_e", "electron", "1-sigma random error of forced_flux_e"),
    number(
        "sky_e_px",
        "electron / pix",
        "sky level under the aperture, whole exposure; with the mean light of trails where the level is taken along them",
    ),
    number("sky_corner_ratio", "", "background at the rim of the field over that at its centre"),
    number("snr", "", "flux_e / flux_err_e"),
    number("peak_frac_sat", "", "brightest aperture pixel, with the sky, as a fraction of the saturation level"),
    number(
        "contam_frac",
        "",
        "light of star trails and neighbours inside the aperture over flux_e (over flux_err_e where that is larger); that of \
         trails is subtracted from flux_e",
    ),
    number("aper_corr_mag", "mag", "added to the magnitude for the light outside the aperture (growth curve)"),
    number("inst_mag", "mag", "-2.5 log10 of the flux in electrons per second, aper_corr_mag included"),
    number("v_mag", "mag", "apparent V magnitude outside the atmosphere"),
    number("v_mag_err", "mag", "1-sigma random error of v_mag and of inst_mag"),
    number(
        "v_mag_err_sys",
        "mag",
        "1-sigma systematic error of v_mag: zeropoint, scatter of one pointing, colour of the target, gain table, aperture \
         correction, another night's zeropoint",
    ),
    number("zp_age_d", "d", "time from the night of the zeropoint to this frame; missing if it is this night's own"),
    number("zp_extra_err_mag", "mag", "error of using another night's zeropoint, part of v_mag_err_sys"),
    number(
        "limit_v_mag",
        "mag",
        "V magnitude at which 95 % of targets are detected (target.detect_sigma); of a non-detection: of point sources \
         anywhere in this frame's search region, scaled to the object's size in the frames that show it; of a detection: in \
         its own aperture",
    ),
    number("mu_mean_mag_arcsec2", "mag / arcsec2", "mean V surface brightness over the aperture"),
    number("mu_peak_mag_arcsec2", "mag / arcsec2", "V surface brightness of the brightest disc of one FWHM across"),
    // geometry
    number("alt_deg", "deg", "altitude above the horizon, without refraction"),
    number("az_deg", "deg", "azimuth from north through east"),
    number("range_km", "km", "distance from the observer"),
    number("rate_deg_s", "deg / s", "angular rate against the stars"),
    number("az_rate_deg_s", "deg / s", "rate of the azimuth, which a dome must follow"),
    number(
        "alt_az_err_deg",
        "deg",
        "1-sigma error of the place along the track by time_err_s: rate_deg_s * time_err_s",
    ),
    number("airmass", "", "airmass"),
    number("phase_angle_deg", "deg", "angle Sun - satellite - observer"),
    number("sun_alt_deg", "deg", "altitude of the Sun at the observer"),
    number("moon_alt_deg", "deg", "altitude of the Moon at the observer"),
    number("moon_phase_deg", "deg", "phase angle of the Moon (0 = full)"),
    number("moon_illum_pct", "%", "illuminated fraction of the lunar disc"),
    number("moon_sep_deg", "deg", "angle between the target and the Moon on the sky"),
    text("illum", "largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none"),
    text("sky_class", "where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night"),
    text("paper_label", "day, twilight (sunlight on the satellite or in the sky) or night, as Caddy et al. label it"),
    number("tle_age_d", "d", "mid-exposure minus epoch of the elements"),
    // model
    number("model_v_mag", "mag", "modelled V magnitude, all lights"),
    number("sun_v_mag", "mag", "modelled V magnitude by direct sunlight alone"),
    number("earthshine_v_mag", "mag", "modelled V magnitude by sunlight from the Earth alone"),
    number("moon_v_mag", "mag", "modelled V magnitude by direct moonlight alone"),
    number("lunar_earthshine_v_mag", "mag", "modelled V magnitude by moonlight from the Earth alone"),
    number("model_err_mag", "mag", "numerical error of model_v_mag (quadrature); not how wrong the model is"),
    number("residual_mag", "mag", "observed minus modelled magnitude; positive = observed fainter"),
    text("skipped", "what the model left out, and why"),
    // state
    text("status", "ok, nondetection, rejected or failed"),
    text("verdict", "use, caution or reject"),
    text("reason", "why, when status is not ok or verdict is not use; and what old elements spoil"),
    bits("flags", "quality bit mask; the bits are named in meta"),
];

/// Columns of `stars.ecsv`: one row per star measurement.
pub const STARS: &[Column] = &[
    text("frame", "source FITS file name, the first member of a combination"),
    integer("n_members", "number of exposures combined"),
    integer("pointing", "number of the star pointing, from 0"),
    text("object_name", "name of the pointing"),
    text("star_id", "identifier of the star in the catalogue"),
    number("ra_deg", "deg", "right ascension of the catalogue (ICRS), moved to the night where it has proper motions"),
    number("dec_deg", "deg", "declination of the catalogue (ICRS), moved to the night where it has proper motions"),
    text("date_mid", "mid-exposure UTC, ISO 8601; mean of the members"),
    number("mjd_mid_d", "d", "mid-exposure MJD (UTC); mean of the members"),
    number("exptime_s", "s", "exposure time; mean of the members"),
    integer("gain_setting", "gain setting of the camera in units of 0.1 dB; missing where members differ"),
    number("e_per_adu", "electron / adu", "electrons per ADU at this gain setting; missing where members differ"),
    number(
        "x_px",
        "pix",
        "centre of the aperture along a row in the first member, 0-based from the centre of the first pixel",
    ),
    number(
        "y_px",
        "pix",
        "centre of the aperture over rows in the first member, 0-based from the centre of the first pixel",
    ),
    number("aper_r_px", "pix", "aperture radius (circle); mean of the members"),
    number("sky_in_px", "pix", "inner radius of the sky annulus; mean of the members"),
    number("sky_out_px", "pix", "outer radius of the sky annulus; mean of the members"),
    number("fwhm_px", "pix", "FWHM of the stars of the frame, or photometry.fwhm_px; mean of the members"),
    number("flux_e", "electron", "net flux in the aperture per exposure; combined: rate times exptime_s"),
    number("flux_err_e", "electron", "1-sigma random error of flux_e"),
    number("sky_e_px", "electron / pix", "sky level under the aperture, whole exposure; mean of the members"),
    number("snr", "", "flux_e / flux_err_e"),
    number(
        "peak_frac_sat",
        "",
        "brightest aperture pixel, with the sky, as a fraction of the saturation level; largest of the members",
    ),
    number("aper_corr_mag", "mag", "added to the magnitude for the light outside the aperture (growth curve)"),
    number("inst_mag", "mag", "-2.5 log10 of the flux in electrons per second, aper_corr_mag included"),
    number("inst_mag_err", "mag", "1-sigma random error of inst_mag"),
    number("alt_deg", "deg", "altitude above the horizon, without refraction; mean of the members"),
    number("az_deg", "deg", "azimuth from north through east; of the first member"),
    number("airmass", "", "airmass; mean of the members"),
    number("catalogue_v_mag", "mag", "V magnitude of the catalogue"),
    number("catalogue_v_mag_err", "mag", "1-sigma error of catalogue_v_mag"),
    number("catalogue_b_v_mag", "mag", "colour B-V of the catalogue"),
    number("catalogue_b_v_mag_err", "mag", "1-sigma error of catalogue_b_v_mag"),
    number(
        "fit_weight",
        "",
        "robust weight of this star in the zeropoint fit, 0 to 1; 0 = an outlier, missing = a cut kept it out",
    ),
    number("fit_residual_mag", "mag", "V_inst - V minus the fit"),
    number("fit_leverage", "", "share of its own residual this star takes up in the zeropoint fit, 0 to 1"),
    number(
        "match_arcsec",
        "arcsec",
        "distance of the detection from the aligned place of the catalogue; mean of the members",
    ),
    text("status", "ok or rejected; empty where no zeropoint was fitted"),
    text("reason", "why, when status is not ok"),
    bits("flags", "quality bit mask of all members; the bits are named in meta"),
];

/// Columns of `residuals.ecsv`: one row per target frame that has both a magnitude and a model.
pub const RESIDUALS: &[Column] = &[
    text("frame", "source FITS file name"),
    integer("norad_cat_id", "satellite catalogue number"),
    text("object_name", "name of the target"),
    integer("pass", "number of the pass in the night, from 1"),
    text("date_mid", "mid-exposure UTC, ISO 8601"),
    number("mjd_mid_d", "d", "mid-exposure MJD (UTC)"),
    number("alt_deg", "deg", "altitude above the horizon, without refraction"),
    number("az_deg", "deg", "azimuth from north through east"),
    number("range_km", "km", "distance from the observer"),
    number("phase_angle_deg", "deg", "angle Sun - satellite - observer"),
    number("moon_sep_deg", "deg", "angle between the target and the Moon on the sky"),
    text("illum", "largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none"),
    text("sky_class", "where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night"),
    text("paper_label", "day, twilight (sunlight on the satellite or in the sky) or night, as Caddy et al. label it"),
    number("v_mag", "mag", "apparent V magnitude outside the atmosphere"),
    number("v_mag_err", "mag", "1-sigma random error of v_mag"),
    number(
        "v_mag_err_sys",
        "mag",
        "1-sigma systematic error of v_mag: zeropoint, scatter of one pointing, colour of the target, gain table, aperture \
         correction, another night's zeropoint",
    ),
    number("model_v_mag", "mag", "modelled V magnitude, all lights"),
    number("model_err_mag", "mag", "numerical error of model_v_mag (quadrature); not how wrong the model is"),
    number("residual_mag", "mag", "observed minus modelled magnitude; positive = observed fainter"),
    text(
        "verdict",
        "use, caution or reject, of the residual: caution at best where the elements are more than 2 d old",
    ),
    bits("flags", "quality bit mask; the bits are named in meta"),
];

/// Columns of a predicted pass, by their names in [`PHOTOMETRY`].
pub const PREDICTION: [&str; 28] = [
    "date_mid",
    "mjd_mid_d",
    "alt_deg",
    "az_deg",
    "range_km",
    "rate_deg_s",
    "airmass",
    "phase_angle_deg",
    "sun_alt_deg",
    "moon_alt_deg",
    "moon_phase_deg",
    "moon_illum_pct",
    "moon_sep_deg",
    "illum",
    "sky_class",
    "paper_label",
    "tle_age_d",
    "model_v_mag",
    "sun_v_mag",
    "earthshine_v_mag",
    "moon_v_mag",
    "lunar_earthshine_v_mag",
    "model_err_mag",
    "mu_mean_mag_arcsec2",
    "norad_cat_id",
    "object_name",
    "skipped",
    "flags",
];

/// What `mu_mean_mag_arcsec2` is where nothing is measured.
const MODEL_MU: &str =
    "mean V surface brightness of the model over the satellite's area, seen in projection (as_published: all of it)";

/// The columns of [`PREDICTION`] with what they say of a prediction.
#[must_use]
pub fn prediction() -> Vec<Column> {
    let of = |name: &&str| PHOTOMETRY.iter().find(|c| c.name == *name).copied();
    let said = |column: Column| match column.name {
        "date_mid" => Column { description: "moment of the row, UTC, ISO 8601", ..column },
        "mjd_mid_d" => Column { description: "moment of the row, MJD (UTC)", ..column },
        "tle_age_d" => Column { description: "moment of the row minus epoch of the elements", ..column },
        "mu_mean_mag_arcsec2" => Column { description: MODEL_MU, ..column },
        _ => column,
    };
    PREDICTION.iter().filter_map(of).map(said).collect()
}

/// Columns of a map of the sky: one row per direction.
pub const SKY: &[Column] = &[
    number("alt_deg", "deg", "altitude above the horizon, without refraction"),
    number("az_deg", "deg", "azimuth from north through east"),
    number("range_km", "km", "distance from the observer"),
    text("illum", "largest light: sun, penumbra, moon, lunar_earthshine, earthshine or none"),
    number("sun_visible_frac", "", "share of the Sun's light that gets past the Earth to the satellite"),
    number("model_v_mag", "mag", "modelled V magnitude, all lights"),
    number("sun_v_mag", "mag", "modelled V magnitude by direct sunlight alone"),
    number("earthshine_v_mag", "mag", "modelled V magnitude by sunlight from the Earth alone"),
    number("moon_v_mag", "mag", "modelled V magnitude by direct moonlight alone"),
    number("lunar_earthshine_v_mag", "mag", "modelled V magnitude by moonlight from the Earth alone"),
    number("model_err_mag", "mag", "numerical error of model_v_mag (quadrature); not how wrong the model is"),
    number(
        "flux_per_e0",
        "",
        "irradiance at the observer by all lights, in units of the Sun's at 1 au as the model scales it",
    ),
];

/// Columns before those of [`SKY`] where a table holds maps of many moments.
pub const DAY_OF_SKY: &[Column] = &[text("date_mid", "UTC, ISO 8601"), number("mjd_mid_d", "d", "MJD (UTC)")];

/// Columns of `accuracy.ecsv`: one row per setting of a knob.
pub const ACCURACY: &[Column] = &[
    text("method", "what is computed"),
    text("case", "the situation"),
    text("knob", "what is set"),
    text("setting", "its value"),
    bits("is_default", "1 = the default setting"),
    bits("on_front", "1 = no other setting of this case has both a smaller err_p95 and less CPU time"),
    text("err_unit", "what the errors are: relative, or a unit"),
    number("err_median", "", "median error: half of the cases are better"),
    number("err_p95", "", "95th percentile of the error: 95 of 100 cases are better"),
    number("err_worst", "", "the worst case; missing if one case gave no number"),
    integer("n", "cases the errors are from"),
    text("work", "what cpu_us is the time of"),
    number("cpu_us", "us", "CPU time of one piece of work, user and system, one thread"),
    number("memory_kb", "kbyte", "memory of one piece of work, where it depends on the setting"),
    text("reference", "what the errors are measured against"),
];

/// Columns of `extremes.ecsv`: one row per stiff or extreme case.
pub const EXTREMES: &[Column] = &[
    text("area", "part of the program"),
    text("case", "the case, with the unit of its numbers"),
    text("expected", "what is expected: a number from a closed form or an independent computation, or a refusal"),
    text("got", "what came out"),
    number("error", "", "how far off it is, relative or in the unit of the case; missing for refusals"),
    number("limit", "", "how far off it may be"),
    text("verdict", "ok, known limit or WRONG"),
];
