//! What is done to pixels and stars: flat, background, apertures, target, star pointings, zeropoint.
//!
//! Radii in units of the stars' FWHM, magnitudes in mag, units in the keys.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::bands::{Band, ColourIndex};

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
    /// What each flat is divided by before the median is taken.
    pub scale: FlatScale,
    /// Noise of a pixel of the master that is accepted, as a share of the light: no more flats are combined than that takes (five
    /// at least). A magnitude of a point changes by at most 1.09 of it, usually by a fifth; absent = all flats are combined.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_frac: Option<f64>,
}

/// What a flat is divided by before the median is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FlatScale {
    /// Its own level: skies and lamps that drift.
    #[default]
    Level,
    /// Nothing: a lamp that does not drift. Less work on 16-bit files.
    None,
}

impl Default for Flat {
    fn default() -> Self {
        Self {
            master: None,
            min_response: 0.2,
            level_range_frac: [0.02, 0.95],
            min_flats: 3,
            scale: FlatScale::Level,
            noise_frac: None,
        }
    }
}

/// Background, detection and apertures. Radii are in units of the stars' FWHM.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Photometry {
    /// Band of the calibrated magnitudes, if filter and catalogue do not determine it or contradict each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band: Option<Band>,
    /// Circle kept around the detector centre \[px\]; absent = the whole frame. Caddy et al. use 2500.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_radius_px: Option<f64>,
    /// FWHM of a star \[px\]; if absent, measured on each star frame, and their median taken for target frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fwhm_px: Option<f64>,
    /// Aperture radius \[FWHM\].
    pub aper_r_fwhm: f64,
    /// Inner radius of the sky annulus \[FWHM\].
    pub sky_in_fwhm: f64,
    /// Outer radius of the sky annulus \[FWHM\].
    pub sky_out_fwhm: f64,
    /// Box of the background mesh \[px\]. 64 is off by 0.05 σ of the sky in 95 of 100 places; 32 by 0.07, 256 by 0.2,
    /// and time differs little (`satphot accuracy background-mesh`).
    pub mesh_px: usize,
    /// Detection threshold \[σ of the background\].
    pub detect_sigma: f64,
    /// Sigma clip of sky pixels \[σ\].
    pub clip_sigma: f64,
    /// Correct every flux to the whole light of a star with the growth curve of the star frames.
    pub aper_correction: bool,
}

impl Default for Photometry {
    fn default() -> Self {
        Self {
            band: None,
            clip_radius_px: None,
            fwhm_px: None,
            aper_r_fwhm: 2.0,
            sky_in_fwhm: 3.0,
            sky_out_fwhm: 5.0,
            mesh_px: 64,
            detect_sigma: 5.0,
            clip_sigma: 3.0,
            aper_correction: true,
        }
    }
}

/// The shape of the target's aperture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ApertureShape {
    /// The one of the others that holds the target in the smallest area.
    #[default]
    Auto,
    /// A circle.
    Circle,
    /// An ellipse.
    Ellipse,
    /// A rotated rectangle.
    Rectangle,
    /// A rectangle with half a disc at both ends.
    Pill,
}

/// How the tracked target is found and measured.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Target {
    /// Column where the target is searched \[px\]; the centre of the frame if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_px: Option<f64>,
    /// Row where the target is searched \[px\]; the centre of the frame if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_px: Option<f64>,
    /// How far from there the target may be \[arcsec\]; Caddy et al. track to 15.5 arcsec rms, worse near zenith.
    pub search_radius_arcsec: f64,
    /// Detection threshold of the whole target \[σ\]; below it the frame is a non-detection with a limit.
    pub detect_sigma: f64,
    /// Added around the object's own outline \[FWHM\].
    pub margin_fwhm: f64,
    /// Radius of the circle a limit is measured in when nothing is found \[FWHM\]; the limit is then scaled to the size
    /// of the object in the frames that show it.
    pub limit_r_fwhm: f64,
    /// Shape of the aperture around the target.
    pub shape: ApertureShape,
    /// Stack the frames of each pass at the place of the target: pass_stack.ecsv, and forced_flux_e of photometry.ecsv.
    pub stack_passes: bool,
    /// Signal-to-noise of the bins of the light curve of a pass.
    pub pass_bin_snr: f64,
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
            shape: ApertureShape::Auto,
            stack_passes: true,
            pass_bin_snr: 10.0,
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

/// When star frames are matched to the catalogue without their header's world coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Solve {
    /// Where the header has none, or wrong ones.
    #[default]
    Auto,
    /// Never: frames without good world coordinates fail.
    Never,
    /// Always: those of the header are not used.
    Always,
}

/// Star pointings and their catalogue.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Stars {
    /// CSV, TSV, ECSV or VOTable with APASS DR9 columns as VizieR writes them (RAJ2000, DEJ2000, Vmag, e_Vmag, B-V,
    /// e_B-V).
    pub catalogue: PathBuf,
    /// Own column names: `ra_deg`, `dec_deg`, `v_mag`, `v_mag_err`, `b_v_mag`, `b_v_err_mag`, `id`, `pm_ra_mas_yr`,
    /// `pm_dec_mas_yr`, `epoch_jyear`.
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
    /// Smallest signal-to-noise ratio of a star's flux.
    #[serde(default = "min_snr")]
    pub min_snr: f64,
    /// Largest distance of a detection from its catalogue star \[arcsec\].
    #[serde(default = "match_radius")]
    pub match_radius_arcsec: f64,
    /// How far the header's pointing may be off \[arcsec\].
    #[serde(default = "pointing_err")]
    pub pointing_err_arcsec: f64,
    /// Epoch of the positions of a catalogue that has proper motions but no column of epochs \[Julian year\].
    #[serde(default = "catalogue_epoch")]
    pub epoch_jyear: f64,
    /// Whether fields are matched without the header's world coordinates.
    #[serde(default)]
    pub solve: Solve,
    /// How far an approximate pointing may be off when a field is matched without world coordinates \[deg\].
    #[serde(default = "solve_radius")]
    pub solve_radius_deg: f64,
    /// How far the pixel scale of the optics may be off then, as a share.
    #[serde(default = "scale_search")]
    pub scale_search_frac: f64,
    /// OBJECT -> (RA, Dec) \[deg\] of star pointings whose header does not say where they point.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub fields: BTreeMap<String, [f64; 2]>,
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
    /// A start from the third to the half of the stars that agree best, then Tukey's biweight to convergence.
    #[default]
    Robust,
    /// Median start, then least squares with a 3 σ clip to convergence.
    Clip,
    /// Huber's weights; biased by one-sided outliers such as blends.
    Huber,
    /// Ordinary least squares, equal weights.
    Ols,
}

/// A term held at a value, or pulled to it when an error is given.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
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
    /// Robust or ordinary least squares. The default `robust` and `clip` hold with 30 % of the stars spoilt, the others
    /// do not; `robust` needs no cut (`satphot accuracy zeropoint-fit`).
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
    /// Extinction and its error where the stars do not determine it \[mag/airmass\]: V on La Palma is 0.10 on a very clear
    /// night, 0.15 typically and above 0.18 with dust (ING, WHT manual), 0.11 at Paranal (Patat 2003, A&A 400, 1183).
    pub k_prior: Pin,
    /// Colour term and its error where the stars do not determine it \[mag/mag\]: a convention, wide enough for an
    /// unfiltered camera.
    pub c_prior: Pin,
    /// Scatter of the pointings of this site, rms \[mag\]: used where there are fewer than ten pointings. The default is a
    /// convention; measure it for your own site.
    pub pointing_scatter_prior_mag: f64,
    /// Error of a magnitude by the vignetting of frames without flats \[mag\]: 0.02 measured within the clip circle.
    pub no_flat_err_mag: f64,
    /// Fit the second-order term k'' X (B-V) as well.
    pub second_order: bool,
    /// Error added when the zeropoint is that of another night: how much photometric nights differ \[mag\].
    pub previous_err_mag: f64,
    /// Measure the star trails of the target frames: the offset of each frame from the zeropoint, and where the target stands
    /// among the stars.
    pub star_trails: bool,
    /// Weight stars by their errors (robust estimator; OLS never does).
    pub weighted: bool,
    /// Fewest stars of a fit.
    pub min_stars: usize,
    /// Largest share of stars the robust fit may reject before it fails.
    pub max_rejected_frac: f64,
    /// Colour of the target in the colour index of the stars \[mag\]; default: the Sun's, 0.65 in B-V (Cox 2002, as Caddy et
    /// al.), 0.46 in g-r, 0.12 in r-i, 0.81 in BP-RP.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_b_v_mag: Option<f64>,
    /// Error of the target's colour \[mag\]; default: 0.1 where the Sun's colour is assumed, for surfaces are not grey, and
    /// 0 where target_b_v_mag is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_b_v_err_mag: Option<f64>,
    /// Where target_b_v_mag is from, for the tables; written by a run that measured it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_b_v_from: Option<String>,
    /// Rounds after which a robust fit stops; no key of a file, for measuring how many it needs.
    #[serde(skip, default = "max_rounds")]
    pub max_rounds: usize,
}

impl Zeropoint {
    /// Rounds after which a robust fit stops: ten times what the slowest nights need (`satphot accuracy fit-rounds`).
    pub const MAX_ROUNDS: usize = 300;

    /// Colour of the target in an index (B−V if that is not known) and its error \[mag\]: the configured one, else the Sun's with
    /// 0.1.
    #[must_use]
    pub fn target_colour(&self, index: Option<ColourIndex>) -> [f64; 2] {
        let sun = || index.and_then(ColourIndex::sun_mag).or(ColourIndex::B_V.sun_mag()).unwrap_or(f64::NAN);
        match self.target_b_v_mag {
            Some(own) => [own, self.target_b_v_err_mag.unwrap_or(0.0)],
            None => [sun(), self.target_b_v_err_mag.unwrap_or(ASSUMED_COLOUR_ERR_MAG)],
        }
    }
}

impl Zeropoint {
    /// Where the colour of the target is from, in words.
    #[must_use]
    pub fn target_colour_from(&self) -> String {
        match (&self.target_b_v_from, self.target_b_v_mag) {
            (Some(from), _) => from.clone(),
            (None, Some(_)) => "zeropoint.target_b_v_mag of the configuration".into(),
            (None, None) => "assumed: the Sun's".into(),
        }
    }
}

/// Error of the colour of a target that is assumed to have the Sun's \[mag\]: a convention.
const ASSUMED_COLOUR_ERR_MAG: f64 = 0.1;

fn max_rounds() -> usize {
    Zeropoint::MAX_ROUNDS
}

impl Default for Zeropoint {
    fn default() -> Self {
        Self {
            estimator: Estimator::Robust,
            previous: None,
            pin_k: None,
            pin_c: None,
            k_prior: Pin { value: 0.15, err: 0.05 },
            c_prior: Pin { value: 0.0, err: 0.2 },
            pointing_scatter_prior_mag: 0.03,
            no_flat_err_mag: 0.02,
            second_order: false,
            previous_err_mag: 0.03,
            star_trails: false,
            weighted: true,
            min_stars: 5,
            max_rejected_frac: 0.5,
            target_b_v_mag: None,
            target_b_v_err_mag: None,
            target_b_v_from: None,
            max_rounds: Self::MAX_ROUNDS,
        }
    }
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
fn catalogue_epoch() -> f64 {
    2000.0
}
fn solve_radius() -> f64 {
    1.0
}
fn scale_search() -> f64 {
    0.2
}
fn pointing_gap() -> f64 {
    300.0
}
