//! What every frame of the night shares, stage by stage: [`Prepared`] before a pixel is read, [`Flattened`] with the master
//! flat, [`Calibrated`] with what the stars gave. Each stage has all of the one before and is made from it.

use std::ops::Deref;
use std::path::Path;

use super::compare::comparable;
use super::survey::files::Survey;
use super::survey::satellite::{model_notes, other_names, set_others_aside};
use crate::astrometry::catalogue::Catalogue;
use crate::astrometry::field_rotation::CameraTurn;
use crate::bands::Band;
use crate::bands::CalibratedBand;
use crate::base::error::{Error, Result};
use crate::brightness::{Model, ModelSettings, Satellite};
use crate::config::{self, Config};
use crate::frames::flat::MasterFlat;
use crate::frames::{Buffers, Detector, Exposure, FrameReader, HotPixels, PooledFrame, ZeroLevels};
use crate::frames::{never_filled, pixel_scale_arcsec};
use crate::orbit::{EarthOrientation, Site, Tracker};
use crate::photometry::growth::{FRAME_SCATTER, GrowthCurve, StarProfile, StarWidth};
use crate::zeropoint::fit::Zeropoint;

/// What every frame of the night shares before any pixel is read.
#[derive(Debug)]
pub struct Prepared {
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
    /// Area of all surfaces of the model, also where nothing is compared with it \[m²\].
    pub satellite_area_m2: Option<f64>,
    /// The star catalogue, if star pointings are configured.
    pub catalogue: Option<Catalogue>,
    /// The band of the calibrated magnitudes; `None` where filter, catalogue and configuration name none
    /// ([`crate::pipeline::survey::filters`]).
    pub band: Option<CalibratedBand>,
    /// Memory of the frames.
    pub buffers: Buffers,
    /// Exhaustive mode: nothing is skipped in frames and scenes, for tests that compare.
    pub exhaustive: bool,
}

/// A prepared night with its master flat.
#[derive(Debug)]
pub struct Flattened {
    /// What was prepared.
    pub prepared: Prepared,
    /// The master flat; `None` for a night without flats.
    pub flat: Option<MasterFlat>,
    /// Hash of the file of the master flat; empty where it has none.
    pub flat_sha256: String,
    /// Biases and darks, combined; empty for a night without.
    pub zero: ZeroLevels,
    /// Hot pixels by the night's star frames, one map for each size and binning ([`crate::pipeline::hot_pixels`]).
    pub hot: Vec<HotPixels>,
}

impl Deref for Flattened {
    type Target = Prepared;
    fn deref(&self) -> &Prepared {
        &self.prepared
    }
}

/// The results of the star pointings of a night that apply to all of its frames; all `None` for a night without stars.
#[derive(Debug, Clone, Default)]
pub struct Seeing {
    /// How wide the stars are.
    pub width: Option<StarWidth>,
    /// The rotation of the camera on the sky.
    pub camera_turn: Option<CameraTurn>,
    /// Profile of the stars.
    pub profile: Option<StarProfile>,
    /// Growth curve of the stars.
    pub growth: Option<GrowthCurve>,
}

impl Seeing {
    /// FWHM of the stars at an airmass \[arcsec\].
    #[must_use]
    pub fn fwhm_arcsec(&self, airmass: Option<f64>) -> Option<f64> {
        self.width.map(|width| width.at(airmass))
    }

    /// Share of it by which the stars of a frame of `exptime_s` differ from that.
    #[must_use]
    pub fn fwhm_err_frac(&self, exptime_s: f64) -> f64 {
        self.width.map_or(FRAME_SCATTER, |width| width.err_frac(exptime_s))
    }
}

/// A flattened night with what its stars gave: ready for target frames.
#[derive(Debug)]
pub struct Calibrated {
    /// The night before its stars.
    pub flattened: Flattened,
    /// The results of the stars that apply to every frame.
    pub seeing: Seeing,
    /// The zeropoint, fitted or read; `None` leaves magnitudes instrumental.
    pub zeropoint: Option<Zeropoint>,
}

impl Deref for Calibrated {
    type Target = Flattened;
    fn deref(&self) -> &Flattened {
        &self.flattened
    }
}

impl Calibrated {
    /// Whether observed and modelled magnitudes are of one band.
    #[must_use]
    pub fn model_is_of_band(&self) -> bool {
        let observed = self.zeropoint.as_ref().map(|z| z.band_name());
        self.config.model.as_ref().is_none_or(|m| observed.is_none_or(|band| band == m.band))
    }
}

impl Prepared {
    /// Reads everything that must be there before work begins.
    ///
    /// # Errors
    /// [`Error::Orbit`], [`Error::Catalogue`] (exit code 5) or [`Error::Config`] when something configured is missing.
    pub fn prepare(config: &Config) -> Result<Self> {
        let (prepared, missing) = Self::gather(config)?;
        missing.into_iter().next().map_or(Ok(prepared), Err)
    }

    /// As [`Prepared::prepare`], with everything that can be read, and an error for each piece that cannot: one with
    /// errors serves to look for more of them, and never to measure.
    ///
    /// # Errors
    /// [`Error::Config`] for a site that is none.
    pub fn gather(config: &Config) -> Result<(Self, Vec<Error>)> {
        let mut missing = Vec::new();
        let mut keep = |error: Error| missing.push(error);
        let detector = Detector::from_config(&config.detector).or_else(|error| {
            keep(error);
            Detector::of_any_camera(&config.detector)
        })?;
        let site = Site::from_config(&config.site)?;
        let tracker = config.orbit.as_ref().and_then(|orbit| tracker(orbit, config).map_err(&mut keep).ok());
        let eop = tracker.as_ref().map(|t| *t.earth_orientation()).unwrap_or_default();
        let model = config
            .model
            .as_ref()
            .and_then(|model| comparable(model).and_then(|_| Model::from_config(model)).map_err(&mut keep).ok());
        let satellite_area_m2 = model.as_ref().and_then(Model::area_m2);
        let catalogue = config.stars.as_ref().and_then(|stars| catalogue(stars, config).map_err(&mut keep).ok());
        let prepared = Self {
            config: config.clone(),
            detector,
            site,
            eop,
            tracker,
            model,
            satellite_area_m2,
            catalogue,
            band: None,
            buffers: Buffers::default(),
            exhaustive: false,
        };
        Ok((prepared, missing))
    }

    /// From now on nothing is skipped.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn make_exhaustive(&mut self) -> Result<()> {
        self.exhaustive = true;
        if let Some(model) = &self.config.model {
            let settings = ModelSettings { leave_out: false, ..ModelSettings::try_from(model)? };
            self.model = Some(Model::new(&Satellite::from_config(model)?, &settings)?);
        }
        Ok(())
    }

    /// Names by which OBJECT recognises the target.
    #[must_use]
    pub fn target_names(&self) -> Vec<String> {
        self.tracker.as_ref().map(Tracker::names).unwrap_or_default()
    }

    /// Sets the frames of other satellites aside.
    pub fn set_others_aside(&self, survey: &mut Survey) {
        let others = other_names(self.tracker.as_ref(), &self.config);
        set_others_aside(survey, &self.config, &self.target_names(), &others);
    }

    /// Which model the satellite is compared with, and what contradicts it.
    #[must_use]
    pub fn model_note(&self) -> Vec<String> {
        model_notes(self.tracker.as_ref(), &self.config)
    }

    /// Pixel scale of one exposure \[arcsec/px\].
    #[must_use]
    pub fn scale_arcsec(&self, exposure: &Exposure) -> f64 {
        pixel_scale_arcsec(self.config.detector.pixel_um, exposure.binning, self.config.telescope.focal_length_mm)
    }
}

impl Flattened {
    /// The map of hot pixels that serves a frame: none where a dark shows them.
    #[must_use]
    pub fn hot_pixels(&self, exposure: &Exposure) -> Option<&HotPixels> {
        let by_dark = self.zero.of(exposure).is_some_and(|zero| zero.shows_hot_pixels());
        self.hot.iter().find(|hot| !by_dark && hot.is_of(exposure))
    }

    /// One exposure, ready to be read as flattened electrons inside the clip circle.
    ///
    /// # Errors
    /// Whatever is wrong with this frame: [`Error::Io`], [`Error::GainNotTabulated`], [`Error::Flat`], [`Error::Fits`] for
    /// one that was never filled.
    pub fn open<'a>(&'a self, exposure: &'a Exposure) -> Result<FrameReader<'a>> {
        let mut gain = self.detector.gain(exposure)?;
        let clip_px = self.config.photometry.clip_radius_px;
        // one that is saturated all over says so by itself
        if let Some(adu) = never_filled(exposure, clip_px)?.filter(|adu| f64::from(*adu) < gain.saturation_adu) {
            let problem = format!("every pixel is {adu} ADU: the file was never filled");
            return Err(Error::Fits { path: exposure.path.clone(), problem });
        }
        let zero = self.zero.of(exposure);
        if zero.is_none()
            && let Ok(Some(level_adu)) = self.detector.overscan_adu(exposure)
        {
            gain.pedestal_adu = level_adu;
        }
        let hot = self.hot_pixels(exposure);
        Ok(FrameReader::open(exposure, gain, clip_px, self.flat.as_ref())?.less(zero).without(hot))
    }

    /// One exposure from disk to flattened, clipped electrons.
    ///
    /// # Errors
    /// The errors of [`Flattened::open`]; [`Error::Fits`] if the file is damaged or none of its pixels can be used.
    pub fn reduce(&self, exposure: &Exposure) -> Result<PooledFrame<'_>> {
        self.usable(self.open(exposure)?.whole(&self.buffers)?)
    }
}

impl Prepared {
    /// A frame of which at least one pixel can be used.
    ///
    /// # Errors
    /// [`Error::Fits`] if there is none.
    pub fn usable<'a>(&self, frame: PooledFrame<'a>) -> Result<PooledFrame<'a>> {
        if frame.all_bad() {
            return Err(Error::Fits {
                path: frame.path.clone(),
                problem: "no usable pixel: all are NaN, masked by the flat or outside the clip circle".into(),
            });
        }
        Ok(frame)
    }
}

/// The configured elements on the configured site.
fn tracker(orbit: &config::Orbit, config: &Config) -> Result<Tracker> {
    if !orbit.elements.exists() || orbit.elements.is_dir() {
        return Err(Error::Orbit {
            problem: format!(
                "no elements at {}; `{}` gets them, or remove [orbit] to measure without geometry",
                orbit.elements.display(),
                config.fetch_line("elements")
            ),
        });
    }
    Tracker::from_config(orbit, &config.site)
}

/// The configured star catalogue, its ambiguous entries marked.
fn catalogue(stars: &config::Stars, config: &Config) -> Result<Catalogue> {
    let otherwise = ", or remove [stars] and give zeropoint.previous";
    catalogue_is_there(&stars.catalogue, &config.fetch_line("stars"), otherwise)?;
    let mut catalogue = Catalogue::read_band(&stars.catalogue, &stars.columns, Band::or_v(config.photometry.band))?;
    catalogue.mark_ambiguous(stars.match_radius_arcsec);
    Ok(catalogue)
}

/// Refuses a star catalogue that is not there, with the line that fetches one and what else could be done.
///
/// # Errors
/// [`Error::Catalogue`].
pub fn catalogue_is_there(path: &Path, fetch_line: &str, otherwise: &str) -> Result<()> {
    if path.exists() && !path.is_dir() {
        return Ok(());
    }
    let problem = format!("is not there; `{fetch_line}` gets APASS DR9 for your fields{otherwise}");
    Err(Error::Catalogue { path: path.into(), problem })
}
