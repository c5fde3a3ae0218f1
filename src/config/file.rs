//! The tables of the configuration file: one struct each.

use super::fetch::Fetch;
use super::model::Model;
use super::model::Orbit;
use super::photometry::Flat;
use super::photometry::Photometry;
use super::photometry::Stars;
use super::photometry::Target;
use super::photometry::Zeropoint;
use super::reporter::Reporter;
use super::vetting::Vetting;
use serde::Deserialize;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The whole night's configuration: `pipeline.toml`.
///
/// ```
/// let text = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"raw\"]\noutput = \"out\"\n";
/// let config = satphot::Config::from_text(text, &["photometry.aper_r_fwhm=2.5".into()])?;
/// assert_eq!(config.photometry.aper_r_fwhm, 2.5);
///
/// let misspelt = satphot::Config::from_text(&text.replace("input", "inputs"), &[]);
/// assert!(misspelt.unwrap_err().to_string().contains("night.inputs"));
/// # satphot::Result::Ok(())
/// ```
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Name of an embedded preset that fills what this file omits, e.g. `macquarie-cdk24`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Where the frames are and where results go.
    pub night: Night,
    /// The observatory.
    pub site: Site,
    /// The optics.
    pub telescope: Telescope,
    /// The camera.
    pub detector: Detector,
    /// Which of the frames are reduced.
    #[serde(default, skip_serializing_if = "Input::is_default")]
    pub input: Input,
    /// How frames are distinguished.
    #[serde(default)]
    pub frames: Frames,
    /// Which header keywords are read.
    #[serde(default)]
    pub header: HeaderRules,
    /// What the time stamps mean.
    #[serde(default)]
    pub time: Time,
    /// The master flat.
    #[serde(default)]
    pub flat: Flat,
    /// Background, detection, apertures.
    #[serde(default)]
    pub photometry: Photometry,
    /// How the tracked target is found and measured.
    #[serde(default)]
    pub target: Target,
    /// Star pointings and their catalogue; without it a previous zeropoint is needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stars: Option<Stars>,
    /// The zeropoint, extinction and colour fit.
    #[serde(default)]
    pub zeropoint: Zeropoint,
    /// Thresholds from which a frame is used with caution or rejected.
    #[serde(default)]
    pub vetting: Vetting,
    /// The elements of the target; without it no geometry and no model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orbit: Option<Orbit>,
    /// The model to compare with; without it no predicted magnitudes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<Model>,
    /// Models of the satellites of a night that has several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub satellites: Vec<SatelliteEntry>,
    /// Further cameras of the night; `[instruments.detector]` (required) and `[instruments.telescope]` have the keys of
    /// `[detector]` and `[telescope]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instruments: Vec<Instrument>,
    /// Who reports, for exported files.
    #[serde(default, skip_serializing_if = "Reporter::is_silent")]
    pub reporter: Reporter,
    /// The services that `satphot fetch` uses, its cache and its timeouts.
    #[serde(default, skip_serializing_if = "Fetch::is_default")]
    pub fetch: Fetch,
    /// The file this was read from, for messages; empty for a text.
    #[serde(skip)]
    pub file: PathBuf,
}

/// Which model the frames of a satellite are compared with; the first entry that fits is used.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SatelliteEntry {
    /// Names, catalogue numbers or international designators as in OBJECT or in the elements; `*` stands for any text
    /// (`STARLINK-*`).
    pub objects: Vec<String>,
    /// Catalogue number of these objects, where OBJECT holds a name that the elements do not have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub norad_cat_id: Option<u64>,
    /// A satellite of the catalogue of models; absent: measured, without a residual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
}

/// A further camera of the night, with its own flats, gain table and zeropoint. Frames whose header names it are reduced
/// with it, all others with `[detector]` and `[telescope]`. Instruments with the same camera are distinguished by `binning`, and by the
/// focal length where the headers state it (FOCALLEN).
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    /// Its name in tables and folders.
    pub name: String,
    /// The binning of its frames (XBINNING), where the same camera is read out in several; absent: any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub binning: Option<u32>,
    /// The camera, as `[detector]`; `camera` is compared with INSTRUME.
    pub detector: Detector,
    /// The optics, as `[telescope]`; absent: those of the night.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub telescope: Option<Telescope>,
    /// Radius outside which nothing is used \[px\]; absent: that of `[photometry]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip_radius_px: Option<f64>,
}

/// Where the frames are and where results go.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Night {
    /// Name of the night; results go to `<output>/<name>/`.
    pub name: String,
    /// Folders (searched recursively) or files.
    pub input: Vec<PathBuf>,
    /// Folder of the results.
    pub output: PathBuf,
    /// Largest share of science frames that may fail before the exit code says so.
    #[serde(default = "half")]
    pub max_failed_frac: f64,
}

/// The observatory, WGS84.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Name, for titles.
    pub name: String,
    /// Geodetic latitude, north positive \[deg\].
    pub lat_deg: f64,
    /// Longitude, east positive \[deg\].
    pub lon_deg: f64,
    /// Height above the ellipsoid \[m\].
    pub alt_m: f64,
}

/// The optics.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Telescope {
    /// Name, for titles.
    pub name: String,
    /// Clear aperture \[m\].
    pub aperture_m: f64,
    /// Focal length \[mm\].
    pub focal_length_mm: f64,
    /// A pixel scale of the stars more than 2 % from that of focal length, pixel pitch and binning is an error; false:
    /// it is reported, and the configured scale used.
    #[serde(default = "yes", skip_serializing_if = "is_true")]
    pub check_scale: bool,
}

/// The camera. A number given here wins over the table of the named camera.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Detector {
    /// A camera of the embedded table (`asi6200mm`, `asi2600mm`, `asi533mm`, `asi294mc`, `asi1600mm`, `asi183mm`), or any name
    /// when `e_per_adu` is given.
    pub camera: String,
    /// Pixel pitch, unbinned \[µm\].
    pub pixel_um: f64,
    /// Bias level of a raw frame \[ADU\].
    pub pedestal_adu: f64,
    /// Largest value the file can hold \[ADU\].
    #[serde(default = "adc_max")]
    pub adc_max_adu: f64,
    /// Pattern of a colour sensor, as the file stores it (`RGGB`, `BGGR`, `GRBG`, `GBRG`; `none`: no colours); absent: BAYERPAT and
    /// synonyms of the header.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bayer_pattern: Option<String>,
    /// Take electrons per ADU from the header (EGAIN and synonyms) instead of the table.
    #[serde(default)]
    pub use_header_egain: bool,
    /// Systematic error of the gain table \[mag\]; the camera's own value if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_table_err_mag: Option<f64>,
    /// Gain setting (0.1 dB, as a string) -> electrons per ADU \[e⁻/ADU\]; extends or overrides the camera's table.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub e_per_adu: BTreeMap<String, f64>,
    /// Gain setting -> read noise \[e⁻\].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub read_noise_e: BTreeMap<String, f64>,
    /// Gain setting -> full well \[e⁻\].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub full_well_e: BTreeMap<String, f64>,
    /// Share of the saturation level above which a pixel is called saturated.
    #[serde(default = "saturation_frac")]
    pub saturation_frac: f64,
    /// Take the bias level of each frame from its overscan (BIASSEC) where it has one and no bias frames match.
    #[serde(default = "yes", skip_serializing_if = "is_true")]
    pub use_overscan: bool,
    /// Mask the pixels that stand out in the star frames of at least three fields, in frames without a matching dark.
    #[serde(default = "yes", skip_serializing_if = "is_true")]
    pub mask_hot_pixels: bool,
}

/// Which of the frames are reduced.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Input {
    /// The filter to reduce, in any spelling (`V`, `Johnson_V`, `none`), where a night has frames of several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// What texts of FILTER mean that satphot does not know, or takes for another filter: `"Slot 3" = "V"`; `""` is a frame without
    /// FILTER.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub filters: BTreeMap<String, String>,
}

impl Input {
    /// The filter that a text of FILTER means, by `input.filters`; else the text.
    #[must_use]
    pub fn filter_of(&self, text: Option<String>) -> Option<String> {
        let own = self.filters.get(text.as_deref().unwrap_or("").trim());
        own.cloned().or(text)
    }

    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// How frames are distinguished. Patterns are file-name globs (`*`, `?`) and win over the header.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Frames {
    /// Files that are flats.
    pub flat: Vec<String>,
    /// Files that are star pointings.
    pub stars: Vec<String>,
    /// Files that are target frames.
    pub target: Vec<String>,
    /// Files to ignore.
    pub ignore: Vec<String>,
    /// Leave the bias and dark frames of the night out: only `detector.pedestal_adu` is subtracted.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub skip_bias_dark: bool,
    /// OBJECT values (case-insensitive, part of the text) that mark a target frame; the satellite's name and
    /// number from the elements are always recognised.
    pub target_objects: Vec<String>,
    /// Older place of `header.aliases`; moved there when the file is read.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub aliases: BTreeMap<String, Vec<String>>,
}

/// Quantities that may have own keywords.
pub const QUANTITIES: [&str; 17] = [
    "exptime",
    "egain",
    "gain",
    "offset",
    "filter",
    "object",
    "imagetyp",
    "date_obs",
    "site_lat",
    "site_lon",
    "site_alt",
    "ra",
    "dec",
    "camera",
    "binning",
    "pix_scale",
    "read_noise",
];

/// Which header keywords are read, and what they are checked against.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeaderRules {
    /// Light frames whose header states a site more than 0.1 deg from the configured one fail; false: they are
    /// reported.
    pub check_site: bool,
    /// Frames whose header names another camera than `detector.camera` are set aside, and an error where most do;
    /// false: they are reported, and the configured camera is used.
    #[serde(skip_serializing_if = "is_true")]
    pub check_camera: bool,
    /// Quantity -> own header keywords, tried first; the quantities are [`QUANTITIES`].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub aliases: BTreeMap<String, Vec<String>>,
}

impl Default for HeaderRules {
    fn default() -> Self {
        Self { check_site: true, check_camera: true, aliases: BTreeMap::new() }
    }
}

/// What a bare DATE-OBS means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DateObsMeans {
    /// Decide from the header.
    #[default]
    Header,
    /// Start of the exposure.
    Start,
    /// Middle of the exposure.
    Mid,
    /// End of the exposure.
    End,
}

/// What the time stamps mean.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Time {
    /// What DATE-OBS means.
    pub date_obs_means: DateObsMeans,
    /// Added to every time stamp \[s\]: clock error and driver latency.
    pub offset_s: f64,
    /// Error of the mid-exposure time \[s\]; from the source of the time if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub err_s: Option<f64>,
}

pub(super) fn yes() -> bool {
    true
}

pub(super) fn is_true(value: &bool) -> bool {
    *value
}

pub(super) fn half() -> f64 {
    0.5
}

pub(super) fn adc_max() -> f64 {
    65_535.0
}

pub(super) fn saturation_frac() -> f64 {
    0.95
}
