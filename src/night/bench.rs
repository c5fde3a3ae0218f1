//! What every frame of the night shares: detector, master flat, orbit, model, zeropoint; and one frame's reduction.

use std::path::Path;

use sha2::{Digest, Sha256};

use super::compare::comparable;
use crate::brightness::Model;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::frames::{Detector, Electrons, Exposure, Frame, MasterFlat, pixel_scale_arcsec, read};
use crate::orbit::{EarthOrientation, Site, Tracker};
use crate::photometry::catalogue::Catalogue;
use crate::photometry::growth::{GrowthCurve, StarProfile};
use crate::photometry::zeropoint::Zeropoint;

/// What every frame of the night shares.
#[derive(Debug)]
pub struct Bench {
    /// The configuration.
    pub config: Config,
    /// The camera.
    pub detector: Detector,
    /// The observatory.
    pub site: Site,
    /// Earth orientation of the configuration.
    pub eop: EarthOrientation,
    /// The orbit, if elements are configured.
    pub tracker: Option<Tracker>,
    /// The model, if one is configured.
    pub model: Option<Model>,
    /// The star catalogue, if star pointings are configured.
    pub catalogue: Option<Catalogue>,
    /// The master flat, once it is made or read.
    pub flat: Option<MasterFlat>,
    /// The zeropoint, once it is fitted or read.
    pub zeropoint: Option<Zeropoint>,
    /// FWHM of the stars \[arcsec\], once star pointings were measured.
    pub fwhm_arcsec: Option<f64>,
    /// Profile of the stars, once star pointings were measured.
    pub profile: Option<StarProfile>,
    /// Growth curve of the stars, once star pointings were measured.
    pub growth: Option<GrowthCurve>,
}

impl Bench {
    /// Reads everything that must be there before work begins.
    ///
    /// # Errors
    /// [`Error::Orbit`], [`Error::Catalogue`] (exit code 5) or [`Error::Config`] when something configured is missing.
    pub fn prepare(config: &Config) -> Result<Self> {
        let detector = Detector::from_config(&config.detector)?;
        let site = Site::from_config(&config.site)?;
        let tracker = match &config.orbit {
            None => None,
            Some(orbit) => {
                if !orbit.elements.exists() {
                    return Err(Error::Orbit {
                        problem: format!(
                            "no elements at {}; get them for the night (e.g. from CelesTrak, FORMAT=JSON or TLE), \
                             or remove [orbit] to measure without geometry",
                            orbit.elements.display()
                        ),
                    });
                }
                Some(Tracker::from_config(orbit, &config.site)?)
            }
        };
        let eop = tracker.as_ref().map(|t| *t.earth_orientation()).unwrap_or_default();
        let model = match &config.model {
            None => None,
            Some(model) => {
                comparable(model)?;
                Some(Model::from_config(model)?)
            }
        };
        let catalogue = match &config.stars {
            None => None,
            Some(stars) => {
                if !stars.catalogue.exists() {
                    return Err(Error::Catalogue {
                        path: stars.catalogue.clone(),
                        problem: "is not there; get APASS DR9 (VizieR II/336/apass9) for your fields as CSV, \
                                  or remove [stars] and give zeropoint.previous"
                            .into(),
                    });
                }
                let mut catalogue = Catalogue::read(&stars.catalogue, &stars.columns)?;
                catalogue.mark_ambiguous(stars.match_radius_arcsec);
                Some(catalogue)
            }
        };
        Ok(Self {
            config: config.clone(),
            detector,
            site,
            eop,
            tracker,
            model,
            catalogue,
            flat: None,
            zeropoint: None,
            fwhm_arcsec: None,
            profile: None,
            growth: None,
        })
    }

    /// Names by which OBJECT recognises the target.
    #[must_use]
    pub fn target_names(&self) -> Vec<String> {
        self.tracker.as_ref().map(Tracker::names).unwrap_or_default()
    }

    /// Pixel scale of one exposure \[arcsec/px\].
    #[must_use]
    pub fn scale_arcsec(&self, exposure: &Exposure) -> f64 {
        pixel_scale_arcsec(self.config.detector.pixel_um, exposure.binning, self.config.telescope.focal_length_mm)
    }

    /// One exposure from disk to flattened, clipped electrons.
    ///
    /// # Errors
    /// Whatever is wrong with this frame: [`Error::Fits`], [`Error::GainNotTabulated`], [`Error::Flat`].
    pub fn reduce(&self, exposure: &Exposure) -> Result<Frame<Electrons>> {
        let clip_radius_px = self.config.photometry.clip_radius_px;
        let gain = self.detector.gain(exposure)?;
        let mut frame = read(exposure, gain, clip_radius_px)? // Frame<Adu>
            .into_electrons(); // pedestal gone, so dividing by the flat is now lawful
        if let Some(flat) = &self.flat {
            frame = frame.flattened(flat)?;
        }
        if let Some(radius_px) = clip_radius_px {
            frame = frame.clipped(radius_px);
        }
        if frame.all_bad() {
            return Err(Error::Fits {
                path: exposure.path.clone(),
                problem: "no usable pixel: all are NaN, masked by the flat or outside the clip circle".into(),
            });
        }
        Ok(frame)
    }

    /// How many frames fit into memory at once, at most `jobs`.
    ///
    /// A frame in work costs about 20 bytes per pixel of the clip box (pixels, mask, detection); 600 MB are spent.
    #[must_use]
    pub fn frames_at_once(&self, exposures: &[&Exposure], jobs: usize) -> usize {
        const BUDGET_BYTES: usize = 600 << 20;
        const BYTES_PER_PX: usize = 20;
        let side = self.config.photometry.clip_radius_px.map_or(usize::MAX, |r| 2 * r.ceil() as usize + 1);
        let largest = exposures.iter().map(|e| e.size_px.0.min(side) * e.size_px.1.min(side)).max().unwrap_or(1);
        (BUDGET_BYTES / (largest * BYTES_PER_PX).max(1)).clamp(1, jobs.max(1))
    }
}

/// First 16 hex digits of the SHA-256 of a file.
///
/// # Errors
/// [`Error::Io`].
pub fn sha256_16(path: &Path) -> Result<String> {
    let mut file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    let mut hasher = Sha256::new();
    std::io::copy(&mut file, &mut hasher).map_err(|e| Error::io(path, e))?;
    Ok(hex16(&hasher.finalize()))
}

/// Hash of everything in the configuration that can change a result: not the folder the results go to.
///
/// # Errors
/// [`Error::Config`] if the configuration cannot be written as text.
pub fn config_sha256(config: &Config) -> Result<String> {
    let mut config = config.clone();
    config.night.output = std::path::PathBuf::new();
    Ok(sha256_16_text(&config.to_toml()?))
}

/// First 16 hex digits of the SHA-256 of a text.
#[must_use]
pub fn sha256_16_text(text: &str) -> String {
    hex16(&Sha256::digest(text.as_bytes()))
}

fn hex16(digest: &[u8]) -> String {
    digest.iter().take(8).map(|b| format!("{b:02x}")).collect()
}
