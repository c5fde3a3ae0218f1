//! simulate.toml -> [`Scenario`]: what the synthetic night is made of, units in the keys.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::satellites::named as components;
use crate::bands::{Band, ColourIndex};
use crate::base::error::{Error, Result};
use crate::base::file::plain_name;
use crate::config::{self, range, read_layers};

/// A synthetic night.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Embedded preset that fills site, telescope and detector.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Name of the night.
    pub name: String,
    /// Seed of every random number.
    pub seed: u64,
    /// First moment of the night, UTC.
    pub start_utc: String,
    /// Last moment of the night, UTC.
    pub end_utc: String,
    /// The observatory.
    pub site: config::Site,
    /// The optics.
    pub telescope: config::Telescope,
    /// The camera.
    pub detector: config::Detector,
    /// Size of the frames.
    pub frame: FrameSize,
    /// The sky.
    pub sky: Sky,
    /// The point spread function.
    pub psf: Psf,
    /// Vignetting and pixel response.
    pub vignetting: Vignetting,
    /// Zeropoint, extinction and colour term to be found again.
    pub photometric: Photometric,
    /// The stars.
    pub field: Field,
    /// Flats; `n = 0` leaves them out.
    pub flats: Flats,
    /// Star pointings; `n = 0` leaves them out.
    pub pointings: Pointings,
    /// Tracked frames; `n = 0` leaves them out.
    pub target: Target,
    /// Goes into the pipeline.toml that is written next to the frames.
    #[serde(default)]
    pub photometry: config::Photometry,
    /// Write Rice-compressed `.fits.fz` files.
    #[serde(default)]
    pub compress: bool,
    /// FILTER of the frames; no card if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// Band of the magnitudes that zeropoint, extinction and colour term are of.
    #[serde(default = "band_v")]
    pub band: String,
    /// The program whose headers are written.
    #[serde(default)]
    pub headers: Headers,
    /// Bias and dark frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zeros: Option<Zeros>,
    /// Cameras: each a `label` and the keys that differ.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<toml::Table>,
    /// Filters: each a `label` and the keys that differ.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub filters: Vec<toml::Table>,
    /// Satellites: each a `label` and the keys that differ.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub satellites: Vec<toml::Table>,
}

/// The program whose headers are written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Headers {
    /// satphot's own: with world coordinates of star frames.
    #[default]
    Satphot,
    /// N.I.N.A.: positions of the mount, without world coordinates.
    Nina,
}

/// Bias and dark frames; the simulated sensor has no dark current.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Zeros {
    /// Bias frames.
    pub biases: usize,
    /// Dark frames.
    pub darks: usize,
    /// Exposure time of the darks \[s\].
    pub dark_exptime_s: f64,
    /// Gain setting \[0.1 dB\].
    pub gain_setting: i64,
}

/// Size of the frames.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FrameSize {
    /// Columns \[px\].
    pub nx_px: usize,
    /// Rows \[px\].
    pub ny_px: usize,
    /// Binning; the pixel pitch is `detector.pixel_um` times this.
    pub binning: u32,
}

/// The sky.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Sky {
    /// Without the Moon \[V mag/arcsec²\].
    pub dark_v_mag_arcsec2: f64,
    /// Add scattered moonlight (Krisciunas & Schaefer 1991).
    pub moonlight: bool,
    /// Add twilight (Patat et al. 2006); the Sun must then stay below −5°.
    #[serde(default)]
    pub twilight: bool,
    /// Difference of level across the frame, as a share of the level.
    pub gradient_frac: f64,
}

/// Form of the point spread function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PsfKind {
    /// Gaussian.
    Gaussian,
    /// Moffat with exponent `moffat_beta`.
    Moffat,
}

/// The point spread function.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Psf {
    /// Form.
    pub kind: PsfKind,
    /// FWHM \[arcsec\].
    pub fwhm_arcsec: f64,
    /// Scatter of the FWHM from frame to frame, as a share.
    #[serde(default)]
    pub seeing_scatter_frac: f64,
    /// Exponent of the airmass in the FWHM, which is that in the zenith: 0.6 of seeing, 0 of optics.
    #[serde(default)]
    pub airmass_exponent: f64,
    /// Exponent of the Moffat form.
    #[serde(default = "moffat_beta")]
    pub moffat_beta: f64,
}

/// Vignetting and pixel response.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vignetting {
    /// Light lost in the corner, as a share; falls with the square of the radius.
    pub corner_loss_frac: f64,
    /// Scatter of the pixel response, as a share.
    pub prnu_frac: f64,
}

/// V_inst = V + ZP + k X + C (B−V), V_inst of e⁻/s.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Photometric {
    /// Zeropoint \[mag\].
    pub zp_mag: f64,
    /// Extinction \[mag/airmass\].
    pub k_mag_airmass: f64,
    /// Colour term \[mag/mag\].
    pub c_mag_mag: f64,
    /// Scatter of the zeropoint from pointing to pointing \[mag\].
    #[serde(default)]
    pub pointing_scatter_mag: f64,
}

/// The stars.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Stars within `v_range_mag` \[1/deg²\].
    pub stars_per_deg2: f64,
    /// V of the stars \[mag\].
    pub v_range_mag: [f64; 2],
    /// d log₁₀ N / dV of the stars \[1/mag\].
    pub slope_per_mag: f64,
    /// B−V of the stars, uniform \[mag\].
    pub bv_range_mag: [f64; 2],
    /// Errors put on the catalogue's V and stated in it \[mag\].
    pub catalogue_err_mag: f64,
    /// Stars of the tracked frames reach down from this V \[mag\]; density and slope continue.
    pub trail_v_min_mag: f64,
    /// Density of the stars that trail through the tracked frames, within `v_range_mag`; `stars_per_deg2` if absent
    /// \[1/deg²\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trail_stars_per_deg2: Option<f64>,
}

/// Flats.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Flats {
    /// Number of flats.
    pub n: usize,
    /// Gain setting \[0.1 dB\].
    pub gain_setting: i64,
    /// Level of the first, above the pedestal \[ADU\].
    pub level_adu: f64,
    /// Change of level from flat to flat, as a share.
    #[serde(default)]
    pub level_drift_frac: f64,
}

/// Star pointings.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Pointings {
    /// Number of pointings.
    pub n: usize,
    /// Start of the first, UTC; `start_utc` of the night if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_utc: Option<String>,
    /// Frames of each.
    pub frames: usize,
    /// Gain settings, taken in turn from frame to frame \[0.1 dB\].
    pub gain_settings: Vec<i64>,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Time from frame to frame \[s\].
    pub cadence_s: f64,
    /// Airmasses, spread evenly.
    pub airmass_range: [f64; 2],
    /// Shift from frame to frame, scatter \[px\].
    pub dither_px: f64,
    /// Field rotation from frame to frame, scatter \[deg\].
    pub rotation_deg: f64,
    /// Error of the header's pointing, scatter \[arcsec\].
    pub pointing_err_arcsec: f64,
    /// A pointing under a cloud, counted from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cloudy: Option<usize>,
    /// Extinction of that cloud \[mag\].
    #[serde(default)]
    pub cloud_mag: f64,
}

/// Tracked frames.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Number of frames, spread over the passes of the night.
    pub n: usize,
    /// Elements of the satellite.
    pub elements: PathBuf,
    /// Catalogue number, when the file holds several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub norad_cat_id: Option<u64>,
    /// Satellite of the model whose magnitudes are drawn.
    pub satellite: String,
    /// Satellite of components that is rendered into each frame, as bright as it is rendered (and `offset_mag` and
    /// `scatter_mag`), instead of the sketch of a station with the model's magnitude: a name or a file of components;
    /// `size_m` and `turn_deg_s` are not used then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved: Option<String>,
    /// Passes are followed above this altitude \[deg\].
    pub min_alt_deg: f64,
    /// Gain settings, taken in turn \[0.1 dB\].
    pub gain_settings: Vec<i64>,
    /// Shortest and longest exposure \[s\]; chosen for a third of the full well.
    pub exptime_range_s: [f64; 2],
    /// Added to the model's magnitude \[mag\].
    #[serde(default)]
    pub offset_mag: f64,
    /// Scatter about the model \[mag\].
    #[serde(default)]
    pub scatter_mag: f64,
    /// B−V of the satellite \[mag\]; the Sun's if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub b_v_mag: Option<f64>,
    /// Length and width of the satellite \[m\].
    pub size_m: [f64; 2],
    /// How fast it turns in the frame \[deg/s\].
    pub turn_deg_s: f64,
    /// Tracking smear within one exposure \[arcsec\].
    pub smear_arcsec: f64,
    /// Distance from the frame's centre, scatter \[arcsec\].
    pub off_centre_arcsec: f64,
    /// The stars that trail through the frames are stars of the catalogue, on the paths that the satellite's own path makes.
    #[serde(default)]
    pub catalogue_trails: bool,
    /// Share of the frames that a cloud dims.
    #[serde(default)]
    pub cloudy_frac: f64,
    /// Thinnest and thickest cloud \[mag\].
    #[serde(default = "cloud_range_mag")]
    pub cloud_range_mag: [f64; 2],
    /// Time in the headers less the true time \[s\].
    #[serde(default)]
    pub clock_err_s: f64,
}

fn moffat_beta() -> f64 {
    3.5
}

fn cloud_range_mag() -> [f64; 2] {
    [0.1, 1.0]
}

fn band_v() -> String {
    Band::V.name().into()
}

impl Scenario {
    /// Reads a scenario; `--set` applies as in pipeline.toml; the elements' path is relative to the file.
    ///
    /// # Errors
    /// [`Error::Config`] with key, value and range; [`Error::Io`].
    pub fn load(path: &Path, sets: &[String]) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let mut scenario = Self::from_text(&text, sets)?;
        let built_in = scenario.target.elements.to_string_lossy().starts_with("builtin:");
        if scenario.target.elements.is_relative() && !built_in {
            scenario.target.elements = path.parent().unwrap_or(Path::new("")).join(&scenario.target.elements);
        }
        Ok(scenario)
    }

    /// As [`Scenario::load`], from text.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn from_text(text: &str, sets: &[String]) -> Result<Self> {
        let scenario: Scenario = read_layers(text, sets)?;
        scenario.check()?;
        Ok(scenario)
    }

    /// The built-in night of `fixtures/night`, a few seconds to reduce: three passes of the ISS over Macquarie on
    /// 2025-06-13, one in sunlight, one into the Earth's shadow and one in moonlight, in front of few stars.
    ///
    /// # Errors
    /// [`Error::Config`] when a setting is wrong.
    pub fn demo_night(sets: &[String]) -> Result<Self> {
        Self::from_text(include_str!("../presets/demo_night.toml"), sets)
    }

    /// The built-in crowded night: the ISS in moonlight over Macquarie on 2025-06-09, star trails in every frame.
    ///
    /// # Errors
    /// [`Error::Config`] when a setting is wrong.
    pub fn crowded_night(sets: &[String]) -> Result<Self> {
        Self::from_text(include_str!("../presets/crowded_night.toml"), sets)
    }

    /// The scenario as TOML; keys of the target that are not set stand there as comments.
    ///
    /// # Errors
    /// [`Error::Config`] if it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        let text = toml::to_string_pretty(self)
            .map_err(|e| Error::Config { key: "scenario".into(), problem: e.to_string() })?;
        let mut unset = String::from("[target]\n");
        if self.target.norad_cat_id.is_none() {
            unset.push_str("# norad_cat_id = 25544  # needed where the elements hold several objects\n");
        }
        if self.target.resolved.is_none() {
            unset.push_str(
                "# resolved = \"iss\"  # rendered from its components: a name that `render` lists, or a file\n",
            );
        }
        Ok(text.replacen("[target]\n", &unset, 1))
    }

    /// Pixel scale of the binned pixel \[arcsec/px\].
    #[must_use]
    pub fn scale_arcsec(&self) -> f64 {
        crate::frames::pixel_scale_arcsec(self.detector.pixel_um, self.frame.binning, self.telescope.focal_length_mm)
    }

    /// Magnitude in the band minus that in V of an object with this B−V \[mag\]: −(V−X)⊙ (B−V) / (B−V)⊙, so that one of the Sun's
    /// B−V has all its colours.
    #[must_use]
    pub fn band_minus_v_mag(&self, b_v_mag: f64) -> f64 {
        let sun = |band: Band| band.sun_mag().unwrap_or(f64::NAN);
        match Band::named(&self.band) {
            Some(Band::V) | None => 0.0,
            Some(band) => (sun(band) - sun(Band::V)) * b_v_mag / ColourIndex::B_V.sun_mag().unwrap_or(f64::NAN),
        }
    }

    /// Refuses values out of range.
    pub(super) fn check(&self) -> Result<()> {
        let known = config::Model::BANDS.iter().find(|band| **band == self.band && Band::named(band).is_some());
        if known.is_none() {
            return Err(Error::Config {
                key: "band".into(),
                problem: format!("\"{}\" is not one of {}", self.band, config::Model::BANDS.join(", ")),
            });
        }
        if let Some(zeros) = &self.zeros {
            range("zeros.biases", zeros.biases as f64, 0.0, 9_999.0, "frames")?;
            range("zeros.darks", zeros.darks as f64, 0.0, 9_999.0, "frames")?;
            range("zeros.dark_exptime_s", zeros.dark_exptime_s, 1e-5, 3_600.0, "s")?;
        }
        range("pointings.cloud_mag", self.pointings.cloud_mag, 0.0, 10.0, "mag")?;
        if let Some(b_v_mag) = self.target.b_v_mag {
            range("target.b_v_mag", b_v_mag, -1.0, 4.0, "mag")?;
        }
        plain_name("name", &self.name)?;
        range("frame.nx_px", self.frame.nx_px as f64, 32.0, 32_768.0, "px")?;
        range("frame.ny_px", self.frame.ny_px as f64, 32.0, 32_768.0, "px")?;
        range("frame.binning", f64::from(self.frame.binning), 1.0, 64.0, "")?;
        range("sky.dark_v_mag_arcsec2", self.sky.dark_v_mag_arcsec2, 0.0, 30.0, "mag/arcsec²")?;
        range("sky.gradient_frac", self.sky.gradient_frac, -1.0, 1.0, "")?;
        range("psf.fwhm_arcsec", self.psf.fwhm_arcsec, 0.01, 300.0, "arcsec")?;
        range("psf.seeing_scatter_frac", self.psf.seeing_scatter_frac, 0.0, 0.3, "")?;
        range("psf.airmass_exponent", self.psf.airmass_exponent, 0.0, 2.0, "")?;
        range("psf.moffat_beta", self.psf.moffat_beta, 1.5, 50.0, "")?;
        range("vignetting.corner_loss_frac", self.vignetting.corner_loss_frac, 0.0, 0.95, "")?;
        range("vignetting.prnu_frac", self.vignetting.prnu_frac, 0.0, 0.1, "")?;
        range("photometric.zp_mag", self.photometric.zp_mag, -40.0, 0.0, "mag")?;
        range("photometric.pointing_scatter_mag", self.photometric.pointing_scatter_mag, 0.0, 5.0, "mag")?;
        range("field.stars_per_deg2", self.field.stars_per_deg2, 0.0, 1e7, "1/deg²")?;
        if let Some(density) = self.field.trail_stars_per_deg2 {
            range("field.trail_stars_per_deg2", density, 0.0, 1e7, "1/deg²")?;
        }
        range("field.slope_per_mag", self.field.slope_per_mag, 0.01, 1.0, "1/mag")?;
        range("field.catalogue_err_mag", self.field.catalogue_err_mag, 0.0, 1.0, "mag")?;
        range("field.v_range_mag[0]", self.field.v_range_mag[0], -5.0, self.field.v_range_mag[1], "mag")?;
        for (key, n, most) in [
            ("flats.n", self.flats.n, 9_999.0),
            ("pointings.n", self.pointings.n, 1_000.0),
            ("pointings.frames", self.pointings.frames, 1_000.0),
            ("target.n", self.target.n, 1e6),
        ] {
            range(key, n as f64, 0.0, most, "frames")?;
        }
        range("flats.level_adu", self.flats.level_adu, 1.0, self.detector.adc_max_adu, "ADU")?;
        range("pointings.exptime_s", self.pointings.exptime_s, 1e-5, 3_600.0, "s")?;
        range(
            "pointings.cadence_s",
            self.pointings.cadence_s,
            self.pointings.exptime_s,
            86_400.0,
            "s, at least exptime_s",
        )?;
        range("pointings.airmass_range[0]", self.pointings.airmass_range[0], 1.0, self.pointings.airmass_range[1], "")?;
        range("pointings.airmass_range[1]", self.pointings.airmass_range[1], 1.0, 10.0, "")?;
        range("target.min_alt_deg", self.target.min_alt_deg, 1.0, 89.0, "deg")?;
        range("target.exptime_range_s[0]", self.target.exptime_range_s[0], 1e-6, self.target.exptime_range_s[1], "s")?;
        range("target.scatter_mag", self.target.scatter_mag, 0.0, 10.0, "mag")?;
        range("target.cloudy_frac", self.target.cloudy_frac, 0.0, 1.0, "")?;
        range("target.cloud_range_mag[0]", self.target.cloud_range_mag[0], 0.0, self.target.cloud_range_mag[1], "mag")?;
        range("target.cloud_range_mag[1]", self.target.cloud_range_mag[1], 0.0, 10.0, "mag")?;
        range("target.clock_err_s", self.target.clock_err_s, -3_600.0, 3_600.0, "s")?;
        range("target.size_m[0]", self.target.size_m[0], 0.001, 1e5, "m")?;
        range("target.size_m[1]", self.target.size_m[1], 0.001, 1e5, "m")?;
        for (key, list) in [("pointings", &self.pointings.gain_settings), ("target", &self.target.gain_settings)] {
            if list.is_empty() {
                return Err(Error::Config {
                    key: format!("{key}.gain_settings"),
                    problem: "is empty; give at least one, e.g. [200]".into(),
                });
            }
        }
        self.target.resolved.as_deref().map_or(Ok(()), |name| components(name).map(|_| ()))
    }
}
