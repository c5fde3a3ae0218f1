//! Tables of what is to be expected: a day, a month, the hours that can be used, a whole constellation.
//!
//! One struct per table, one public field per column, same name and order. Units are those of the column. `None` is an
//! empty cell: where nothing is lit there is no magnitude.

use serde::{Deserialize, Serialize};

use crate::tables::columns::{Column, integer, number, text};

/// Columns of `day.ecsv`: one row per moment.
pub const DAY: &[Column] = &[
    text("date_mid", "UTC, ISO 8601"),
    number("mjd_mid_d", "d", "MJD (UTC)"),
    number("sun_alt_deg", "deg", "altitude of the Sun at the observer"),
    number("sun_az_deg", "deg", "azimuth of the Sun from north through east"),
    number("moon_alt_deg", "deg", "altitude of the Moon at the observer"),
    number("moon_az_deg", "deg", "azimuth of the Moon from north through east"),
    number("moon_phase_deg", "deg", "phase angle of the Moon (0 = full)"),
    number("moon_illum_pct", "%", "illuminated fraction of the lunar disc"),
    integer("n_points", "directions of the sky that were asked"),
    number("lit_frac", "", "share of them in which the satellite has any light; the medians are over these"),
    number("model_v_mag", "mag", "median over the sky of the modelled V magnitude, all lights"),
    number("model_v_p16_mag", "mag", "16 % of the lit directions are brighter"),
    number("model_v_p84_mag", "mag", "84 % of the lit directions are brighter"),
    number("brightest_v_mag", "mag", "V magnitude of the brightest direction"),
    number("sun_v_mag", "mag", "median of direct sunlight alone, where 2 % of the directions have any"),
    number("earthshine_v_mag", "mag", "median of sunlight from the Earth alone, where 2 % of the directions have any"),
    number("moon_v_mag", "mag", "median of direct moonlight alone, where 2 % of the directions have any"),
    number(
        "lunar_earthshine_v_mag",
        "mag",
        "median of moonlight from the Earth alone, where 2 % of the directions have any",
    ),
    number("sun_frac", "", "share of the directions in which direct sunlight is the largest light"),
    number("earthshine_frac", "", "share in which sunlight from the Earth is the largest"),
    number("moon_frac", "", "share in which direct moonlight is the largest"),
    number("lunar_earthshine_frac", "", "share in which moonlight from the Earth is the largest"),
    number("mu_mean_mag_arcsec2", "mag / arcsec2", "median of the mean V surface brightness of the satellite"),
    number("mu_p16_mag_arcsec2", "mag / arcsec2", "16 % of the lit directions have a brighter one"),
    number("mu_p84_mag_arcsec2", "mag / arcsec2", "84 % of the lit directions have a brighter one"),
    number("model_err_mag", "mag", "largest numerical error of a direction (quadrature); not how wrong the model is"),
    text("skipped", "what was left out for the whole sky, and why"),
];

/// One moment of a day: a row of `day.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DayRow {
    /// UTC, ISO 8601.
    pub date_mid: String,
    /// MJD (UTC) \[d\].
    pub mjd_mid_d: f64,
    /// Altitude of the Sun \[deg\].
    pub sun_alt_deg: f64,
    /// Azimuth of the Sun \[deg\].
    pub sun_az_deg: f64,
    /// Altitude of the Moon \[deg\].
    pub moon_alt_deg: f64,
    /// Azimuth of the Moon \[deg\].
    pub moon_az_deg: f64,
    /// Phase angle of the Moon, 0 = full \[deg\].
    pub moon_phase_deg: f64,
    /// Illuminated fraction of the lunar disc \[%\].
    pub moon_illum_pct: f64,
    /// Directions of the sky.
    pub n_points: i64,
    /// Share of them with any light.
    pub lit_frac: f64,
    /// Median over the sky \[mag\].
    pub model_v_mag: Option<f64>,
    /// 16 % are brighter \[mag\].
    pub model_v_p16_mag: Option<f64>,
    /// 84 % are brighter \[mag\].
    pub model_v_p84_mag: Option<f64>,
    /// The brightest direction \[mag\].
    pub brightest_v_mag: Option<f64>,
    /// Median of direct sunlight \[mag\].
    pub sun_v_mag: Option<f64>,
    /// Median of sunlight from the Earth \[mag\].
    pub earthshine_v_mag: Option<f64>,
    /// Median of direct moonlight \[mag\].
    pub moon_v_mag: Option<f64>,
    /// Median of moonlight from the Earth \[mag\].
    pub lunar_earthshine_v_mag: Option<f64>,
    /// Share of the directions in which this light is the largest.
    pub sun_frac: f64,
    /// The same for sunlight from the Earth.
    pub earthshine_frac: f64,
    /// The same for direct moonlight.
    pub moon_frac: f64,
    /// The same for moonlight from the Earth.
    pub lunar_earthshine_frac: f64,
    /// Median mean surface brightness \[mag/arcsec²\].
    pub mu_mean_mag_arcsec2: Option<f64>,
    /// 16 % are brighter \[mag/arcsec²\].
    pub mu_p16_mag_arcsec2: Option<f64>,
    /// 84 % are brighter \[mag/arcsec²\].
    pub mu_p84_mag_arcsec2: Option<f64>,
    /// Largest numerical error \[mag\].
    pub model_err_mag: Option<f64>,
    /// What was left out for the whole sky, and why.
    pub skipped: String,
}

/// Columns of the observed passes of a day: one row per pass.
pub const OBSERVED: &[Column] = &[
    text("object_name", "name of the target"),
    text("date_mid", "UTC of the pass's median frame, ISO 8601"),
    integer("n", "frames with a usable magnitude"),
    number("v_mag", "mag", "median observed V magnitude"),
    number("v_p16_mag", "mag", "16 % of the frames are brighter"),
    number("v_p84_mag", "mag", "84 % of the frames are brighter"),
    number("model_v_mag", "mag", "median over the sky at that time of day"),
    number("model_v_p16_mag", "mag", "16 % of the lit directions are brighter"),
    number("model_v_p84_mag", "mag", "84 % of the lit directions are brighter"),
    text("within", "yes where the observed median lies between the two"),
];

/// One observed pass beside the day: a row of its table.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ObservedRow {
    /// Name of the target.
    pub object_name: String,
    /// UTC, ISO 8601.
    pub date_mid: String,
    /// Frames with a usable magnitude.
    pub n: i64,
    /// Median \[mag\].
    pub v_mag: f64,
    /// 16 % are brighter \[mag\].
    pub v_p16_mag: f64,
    /// 84 % are brighter \[mag\].
    pub v_p84_mag: f64,
    /// The model's median at that time of day \[mag\].
    pub model_v_mag: Option<f64>,
    /// 16 % are brighter \[mag\].
    pub model_v_p16_mag: Option<f64>,
    /// 84 % are brighter \[mag\].
    pub model_v_p84_mag: Option<f64>,
    /// `yes`, `no`, or empty without a model.
    pub within: String,
}

/// Columns of `month.ecsv`: one row per satellite, mode and night.
pub const MONTH: &[Column] = &[
    text("object_name", "satellite of the catalogue"),
    text("mode", "reading of the published model"),
    number("height_km", "km", "height of the orbit"),
    text("night", "local date of the evening before the midnight"),
    text("date_mid", "UTC of local midnight, ISO 8601"),
    number("mjd_mid_d", "d", "MJD (UTC) of local midnight"),
    number("sun_alt_deg", "deg", "altitude of the Sun at midnight"),
    number("moon_alt_deg", "deg", "altitude of the Moon at midnight"),
    number("moon_phase_deg", "deg", "phase angle of the Moon (0 = full) at midnight"),
    number("moon_illum_pct", "%", "illuminated fraction of the lunar disc at midnight"),
    number("lit_frac", "", "share of directions and moments in which the satellite has any light"),
    number("model_v_mag", "mag", "median over sky and moments of the modelled V magnitude, all lights"),
    number("mu_mean_mag_arcsec2", "mag / arcsec2", "median of the mean V surface brightness of the satellite"),
    number("mu_p16_mag_arcsec2", "mag / arcsec2", "16 % are brighter"),
    number("mu_p84_mag_arcsec2", "mag / arcsec2", "84 % are brighter"),
    number("sky_mag_arcsec2", "mag / arcsec2", "brightness of the night sky under this Moon"),
    number("limit_1sigma_mag_arcsec2", "mag / arcsec2", "1-sigma surface brightness limit of the tracked exposure"),
    number("limit_5sigma_mag_arcsec2", "mag / arcsec2", "5-sigma surface brightness limit of the tracked exposure"),
    integer("detected_1sigma", "1 = the median is brighter than the 1-sigma limit"),
    integer("detected_5sigma", "1 = the median is brighter than the 5-sigma limit"),
    number("model_err_mag", "mag", "largest numerical error of a direction (quadrature)"),
    text("note", "what must be known of this row"),
];

/// One satellite in one night: a row of `month.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MonthRow {
    /// Satellite of the catalogue.
    pub object_name: String,
    /// Reading of the published model.
    pub mode: String,
    /// Height of the orbit \[km\].
    pub height_km: f64,
    /// Local date of the evening before the midnight.
    pub night: String,
    /// UTC of local midnight.
    pub date_mid: String,
    /// MJD (UTC) of local midnight \[d\].
    pub mjd_mid_d: f64,
    /// Altitude of the Sun at midnight \[deg\].
    pub sun_alt_deg: f64,
    /// Altitude of the Moon at midnight \[deg\].
    pub moon_alt_deg: f64,
    /// Phase angle of the Moon \[deg\].
    pub moon_phase_deg: f64,
    /// Illuminated fraction of the lunar disc \[%\].
    pub moon_illum_pct: f64,
    /// Share of directions and moments with any light.
    pub lit_frac: f64,
    /// Median V \[mag\].
    pub model_v_mag: Option<f64>,
    /// Median mean surface brightness \[mag/arcsec²\].
    pub mu_mean_mag_arcsec2: Option<f64>,
    /// 16 % are brighter \[mag/arcsec²\].
    pub mu_p16_mag_arcsec2: Option<f64>,
    /// 84 % are brighter \[mag/arcsec²\].
    pub mu_p84_mag_arcsec2: Option<f64>,
    /// Night sky \[mag/arcsec²\].
    pub sky_mag_arcsec2: Option<f64>,
    /// 1-sigma limit \[mag/arcsec²\].
    pub limit_1sigma_mag_arcsec2: Option<f64>,
    /// 5-sigma limit \[mag/arcsec²\].
    pub limit_5sigma_mag_arcsec2: Option<f64>,
    /// 1 = the median is brighter than the 1-sigma limit.
    pub detected_1sigma: Option<i64>,
    /// 1 = the median is brighter than the 5-sigma limit.
    pub detected_5sigma: Option<i64>,
    /// Largest numerical error \[mag\].
    pub model_err_mag: Option<f64>,
    /// What must be known of this row.
    pub note: String,
    /// Whether the satellite is a mirror that is lit, so that its beam was looked for.
    #[serde(skip)]
    pub beam_looked_for: bool,
}

/// Columns of `duty.ecsv`: one row per way of observing.
pub const DUTY: &[Column] = &[
    text("observing", "when the satellite counts as observable"),
    text("threshold", "the rule"),
    number("duration_h", "h", "hours of the window in which it holds"),
    number("duty_pct", "%", "share of the window"),
    number("published_pct", "%", "Caddy et al., an observer in Sydney in June"),
];

/// One way of observing: a row of `duty.ecsv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DutyRow {
    /// When the satellite counts as observable.
    pub observing: String,
    /// The rule.
    pub threshold: String,
    /// Hours of the window in which it holds \[h\].
    pub duration_h: f64,
    /// Share of the window \[%\].
    pub duty_pct: f64,
    /// The published share \[%\].
    pub published_pct: Option<f64>,
}
