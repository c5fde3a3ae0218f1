//! One gain setting, measured and compared.

use crate::detector::Transfer;
use serde::Serialize;

/// One gain setting: what the frames say, what the table and the headers say. The fields are those of detector.toml.
#[derive(Debug, Clone, Default, Serialize)]
pub struct GainCheck {
    /// Gain setting \[0.1 dB\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setting: Option<i64>,
    /// Binning.
    pub binning: u32,
    /// Flats of this setting.
    pub n_flats: usize,
    /// Bias frames, and darks of less than a second.
    pub n_biases: usize,
    /// Longer darks.
    pub n_darks: usize,
    /// Star and target frames.
    pub n_lights: usize,
    /// `agree`, `disagree` or `not measured`: the gain against the configured one, and the header's where there is one.
    pub verdict: String,
    /// Gain measured from pairs of flats \[e⁻/ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub measured_e_per_adu: Option<f64>,
    /// Its error \[e⁻/ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub measured_err_e_per_adu: Option<f64>,
    /// How: `read noise held` or `slope`; or why there is none.
    pub method: String,
    /// Pairs of flats used.
    pub n_pairs: usize,
    /// Lowest and highest level of the pairs above the pedestal \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels_adu: Option<[f64; 2]>,
    /// Gain in force \[e⁻/ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub configured_e_per_adu: Option<f64>,
    /// Where that is from.
    pub configured_source: String,
    /// Whether it is the header's EGAIN.
    #[serde(skip)]
    pub egain_in_use: bool,
    /// EGAIN of the headers \[e⁻/ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub header_e_per_adu: Option<f64>,
    /// Read noise from pairs of bias frames, digitisation included \[e⁻\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub read_noise_e: Option<f64>,
    /// Its error \[e⁻\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub read_noise_err_e: Option<f64>,
    /// Read noise in force \[e⁻\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub configured_read_noise_e: Option<f64>,
    /// Bias level measured, of bias frames or else of the overscan (BIASSEC) \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub pedestal_adu: Option<f64>,
    /// Its error \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub pedestal_err_adu: Option<f64>,
    /// Bias level in force \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub configured_pedestal_adu: Option<f64>,
    /// Median level of the darks \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub dark_level_adu: Option<f64>,
    /// Value below which 0.1 % of the pixels of star and target frames lie \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub lowest_adu: Option<f64>,
    /// Greatest common divisor of the differences of raw values \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_adu: Option<u32>,
    /// Mean distance of the values that occur \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub spacing_adu: Option<f64>,
    /// Bits of the converter, from the step or from where pixels pile up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converter_bits: Option<u32>,
    /// BITDEPTH of the headers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub header_bits: Option<i64>,
    /// Value at which pixels pile up \[ADU\]; absent if saturation was not reached.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub saturation_adu: Option<f64>,
    /// Pixels in the pile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturated_px: Option<u64>,
    /// Highest value seen \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub highest_adu: Option<f64>,
    /// Level from which pixels are flagged as saturated \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub configured_saturation_adu: Option<f64>,
    /// Saturation as the headers say \[ADU\].
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "six_digits")]
    pub header_saturation_adu: Option<f64>,
    /// The keyword that says so.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub header_saturation_key: String,
    /// The disagreements, and what to do.
    pub warnings: Vec<String>,
    /// Frames and pairs that could not be used, and why.
    pub problems: Vec<String>,
    /// Those of `problems` that concern the frames themselves, each a warning.
    #[serde(skip)]
    pub doubtful_frames: Vec<String>,
    /// The photon transfer, for its figure.
    #[serde(skip)]
    pub transfer: Option<Transfer>,
    /// Level and variance of its blocks, pair by pair \[ADU, ADU²\].
    #[serde(skip)]
    pub blocks: Vec<Vec<(f64, f64)>>,
    /// Pixels above the configured full scale.
    #[serde(skip)]
    pub n_above_full: u64,
    /// Full scale in force \[ADU\].
    #[serde(skip)]
    pub full_scale_adu: Option<f64>,
    /// Whether headers of one setting give different EGAIN.
    #[serde(skip)]
    pub header_differs: bool,
}

/// Six significant digits: more than any of these numbers has.
pub(crate) fn six_digits<S: serde::Serializer>(
    value: &Option<f64>,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    let v = value.unwrap_or(f64::NAN);
    serializer.serialize_f64(format!("{v:.5e}").parse().unwrap_or(v))
}
