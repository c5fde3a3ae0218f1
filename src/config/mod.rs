//! pipeline.toml -> [`Config`]: one file, one struct per room, units in the keys.
//!
//! An unknown key is an error that names the nearest known one; ranges are checked once, in [`Config::load`].
//! Paths in the file are relative to the file. Nothing here reads frames or knows physics.

mod check;
mod load;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

pub(crate) use check::range;
pub(crate) use load::read_layers;
pub use load::{ELEMENTS, PRESETS, preset_text};

/// The whole night's configuration.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Name of an embedded preset that fills what this file leaves out, e.g. `macquarie-cdk24`.
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
    /// How frames are told apart and which header keywords are read.
    #[serde(default)]
    pub frames: Frames,
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
    /// The elements of the target; without it no geometry and no model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orbit: Option<Orbit>,
    /// The model to compare with; without it no predicted magnitudes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<Model>,
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
}

/// The camera. A number given here wins over the table of the named camera.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Detector {
    /// A camera of the embedded table (`asi6200mm`), or any name when `e_per_adu` is given.
    pub camera: String,
    /// Pixel pitch, unbinned \[µm\].
    pub pixel_um: f64,
    /// Bias level of a raw frame \[ADU\].
    pub pedestal_adu: f64,
    /// Largest value the file can hold \[ADU\].
    #[serde(default = "adc_max")]
    pub adc_max_adu: f64,
    /// Take electrons per ADU from the header (EGAIN and synonyms) instead of the table.
    #[serde(default)]
    pub use_header_egain: bool,
    /// Systematic error of the gain table \[mag\]; the camera's own value if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_table_err_mag: Option<f64>,
    /// Gain setting (0.1 dB, as a string) -> electrons per ADU; extends or overrides the camera's table.
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
}

/// How frames are told apart. Patterns are file-name globs (`*`, `?`) and win over the header.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Frames {
    /// Files that are flats.
    pub flat: Vec<String>,
    /// Files that are star pointings.
    pub stars: Vec<String>,
    /// Files that are target frames.
    pub target: Vec<String>,
    /// Files to leave alone.
    pub ignore: Vec<String>,
    /// OBJECT values (case-insensitive, part of the text) that mark a target frame; the satellite's name and
    /// number from the elements are always recognised.
    pub target_objects: Vec<String>,
    /// Quantity -> own header keywords, tried first: `exptime`, `egain`, `gain`, `filter`, `object`, `imagetyp`, `date_obs`.
    pub aliases: BTreeMap<String, Vec<String>>,
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

/// The master flat.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Flat {
    /// A master flat made before, instead of making one from the night's flats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub master: Option<PathBuf>,
    /// Pixels of the normalised flat below this are masked, never divided by.
    pub min_response: f64,
    /// Flats whose median level is outside this share of full scale are rejected.
    pub level_range_frac: [f64; 2],
    /// Fewest flats a master is made of.
    pub min_flats: usize,
}

impl Default for Flat {
    fn default() -> Self {
        Self { master: None, min_response: 0.2, level_range_frac: [0.02, 0.95], min_flats: 3 }
    }
}

/// Background, detection and apertures. Radii are in units of the stars' FWHM.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Photometry {
    /// Circle kept around the detector centre \[px\]; absent = the whole frame. Caddy et al. use 2500.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_radius_px: Option<f64>,
    /// FWHM of a star \[px\]; measured on each frame if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fwhm_px: Option<f64>,
    /// Aperture radius \[FWHM\].
    pub aper_r_fwhm: f64,
    /// Inner radius of the sky annulus \[FWHM\].
    pub sky_in_fwhm: f64,
    /// Outer radius of the sky annulus \[FWHM\].
    pub sky_out_fwhm: f64,
    /// Box of the background mesh \[px\].
    pub mesh_px: usize,
    /// Detection threshold \[σ of the background\].
    pub detect_sigma: f64,
    /// Sigma clip of sky pixels \[σ\].
    pub clip_sigma: f64,
}

impl Default for Photometry {
    fn default() -> Self {
        Self {
            clip_radius_px: None,
            fwhm_px: None,
            aper_r_fwhm: 2.0,
            sky_in_fwhm: 3.0,
            sky_out_fwhm: 5.0,
            mesh_px: 64,
            detect_sigma: 5.0,
            clip_sigma: 3.0,
        }
    }
}

/// How the tracked target is found and measured.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Target {
    /// Where to look \[px\]; the centre of the frame if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_px: Option<f64>,
    /// Where to look \[px\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_px: Option<f64>,
    /// How far from there the target may be \[arcsec\]; Caddy et al. track to 15.5 arcsec rms, worse near zenith.
    pub search_radius_arcsec: f64,
    /// Detection threshold of the whole target \[σ\]; below it the frame is a non-detection with a limit.
    pub detect_sigma: f64,
    /// Added around the object's own outline \[FWHM\].
    pub margin_fwhm: f64,
    /// Aperture radius for a limit, when nothing is found \[FWHM\].
    pub limit_r_fwhm: f64,
}

impl Default for Target {
    fn default() -> Self {
        Self {
            x_px: None,
            y_px: None,
            search_radius_arcsec: 120.0,
            detect_sigma: 5.0,
            margin_fwhm: 1.5,
            limit_r_fwhm: 2.0,
        }
    }
}

/// How the frames of one pointing are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Combine {
    /// Members aligned, electrons per second of each star median combined.
    #[default]
    Median,
    /// Every member is measured and fitted by itself.
    None,
}

/// Star pointings and their catalogue.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Stars {
    /// CSV or ECSV with APASS DR9 columns as VizieR writes them (RAJ2000, DEJ2000, Vmag, e_Vmag, B-V, e_B-V).
    pub catalogue: PathBuf,
    /// Own column names: `ra_deg`, `dec_deg`, `v_mag`, `v_mag_err`, `b_v_mag`, `b_v_err_mag`, `id`.
    #[serde(default)]
    pub columns: BTreeMap<String, String>,
    /// B−V kept in the fit \[mag\]; Caddy et al. use 0.2 to 0.9.
    pub bv_range_mag: [f64; 2],
    /// V kept in the fit \[mag\].
    pub v_range_mag: [f64; 2],
    /// Airmass kept in the fit.
    #[serde(default = "airmass_range")]
    pub airmass_range: [f64; 2],
    /// Largest catalogue error kept \[mag\]; unknown errors pass.
    #[serde(default = "catalogue_err_max")]
    pub v_err_max_mag: f64,
    /// Fewest σ of a star's flux.
    #[serde(default = "min_snr")]
    pub min_snr: f64,
    /// Largest distance of a detection from its catalogue star \[arcsec\].
    #[serde(default = "match_radius")]
    pub match_radius_arcsec: f64,
    /// How far the header's pointing may be off \[arcsec\].
    #[serde(default = "pointing_err")]
    pub pointing_err_arcsec: f64,
    /// How the frames of one pointing are combined.
    #[serde(default)]
    pub combine: Combine,
    /// Frames of one pointing are at most this far apart in time \[s\]; a new OBJECT also starts a new pointing.
    #[serde(default = "pointing_gap")]
    pub pointing_gap_s: f64,
}

/// The estimator of the zeropoint fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Estimator {
    /// L1 start, then Tukey biweight to convergence.
    #[default]
    Robust,
    /// Ordinary least squares, equal weights.
    Ols,
}

/// A term held at a value, or pulled to it when an error is given.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// The value \[mag, or mag per airmass, or mag per mag\].
    pub value: f64,
    /// Its error; 0 or absent = fixed exactly.
    #[serde(default)]
    pub err: f64,
}

/// The zeropoint, extinction and colour fit: V = V_inst − ZP − k X − C (B−V).
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Zeropoint {
    /// Robust or ordinary least squares.
    pub estimator: Estimator,
    /// A zeropoint.toml of another night, used instead of fitting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub previous: Option<PathBuf>,
    /// Extinction held or pulled \[mag/airmass\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pin_k: Option<Pin>,
    /// Colour term held or pulled \[mag/mag\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pin_c: Option<Pin>,
    /// Weight stars by their errors (robust estimator; OLS never does).
    pub weighted: bool,
    /// Fewest stars of a fit.
    pub min_stars: usize,
    /// Largest share of stars the robust fit may reject before it fails.
    pub max_rejected_frac: f64,
    /// Colour of the target \[mag\]; 0.65 is the Sun's (Cox 2002, as Caddy et al.).
    pub target_b_v_mag: f64,
    /// Error of the target's colour \[mag\].
    pub target_b_v_err_mag: f64,
}

impl Default for Zeropoint {
    fn default() -> Self {
        Self {
            estimator: Estimator::Robust,
            previous: None,
            pin_k: None,
            pin_c: None,
            weighted: true,
            min_stars: 5,
            max_rejected_frac: 0.5,
            target_b_v_mag: 0.65,
            target_b_v_err_mag: 0.0,
        }
    }
}

/// The elements of the target.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// TLE, 3LE or OMM JSON; of several sets of one object the nearest in time is used.
    pub elements: PathBuf,
    /// Catalogue number, when the file holds several objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub norad_cat_id: Option<u64>,
    /// Elements older than this are refused \[d\].
    #[serde(default = "max_age")]
    pub max_age_d: f64,
    /// Use elements older than `max_age_d` all the same.
    #[serde(default)]
    pub force_age: bool,
    /// UT1−UTC \[s\] (IERS Bulletin A); 0 costs up to 10 arcsec on a LEO satellite near zenith.
    #[serde(default)]
    pub ut1_utc_s: f64,
    /// Polar motion x \[arcsec\].
    #[serde(default)]
    pub xp_arcsec: f64,
    /// Polar motion y \[arcsec\].
    #[serde(default)]
    pub yp_arcsec: f64,
}

/// Which reading of the paper: as printed, or with its errors put right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// As the paper prints it.
    AsPublished,
    /// As the physics asks.
    #[default]
    Corrected,
}

/// The model to compare with.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// A satellite of the catalogue (`iss`), or any name when `surfaces` are given.
    pub satellite: String,
    /// As published or corrected.
    #[serde(default)]
    pub mode: Mode,
    /// Own surfaces instead of the catalogue's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<Surface>,
    /// Relative tolerance of the Earth-reflected integral.
    #[serde(default = "tolerance")]
    pub tolerance: f64,
}

/// A flat surface of the satellite.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Name, e.g. `chassis`.
    pub name: String,
    /// Area \[m²\].
    pub area_m2: f64,
    /// How it is held.
    pub attitude: Attitude,
    /// How it scatters.
    pub brdf: Brdf,
}

/// How a surface is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Attitude {
    /// Normal to the centre of the Earth.
    Nadir,
    /// Normal to the geometric Sun, also in the shadow.
    Sun,
}

/// How a surface scatters.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Brdf {
    /// f = ρ/π.
    Lambert {
        /// Albedo ρ, 0 to 1.
        albedo: f64,
    },
    /// f = k_d/π + k_s (n+2)/2π max(0, r·o)ⁿ.
    Phong {
        /// Diffuse share.
        kd: f64,
        /// Specular share.
        ks: f64,
        /// Exponent.
        n: f64,
    },
}

fn half() -> f64 {
    0.5
}
fn adc_max() -> f64 {
    65_535.0
}
fn saturation_frac() -> f64 {
    0.95
}
fn airmass_range() -> [f64; 2] {
    [1.0, 2.5]
}
fn catalogue_err_max() -> f64 {
    0.15
}
fn min_snr() -> f64 {
    10.0
}
fn match_radius() -> f64 {
    5.0
}
fn pointing_err() -> f64 {
    120.0
}
fn pointing_gap() -> f64 {
    300.0
}
fn max_age() -> f64 {
    14.0
}
fn tolerance() -> f64 {
    1e-4
}
