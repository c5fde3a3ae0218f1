//! A frame from disk to its place on the sky, outside of a night's reduction: no gain table, no flat, no time needed.
//!
//! Raw counts serve as electrons: only the order of the brightnesses matters. It does not cover what a night knows
//! better.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::astrometry::catalogue::Catalogue;
use crate::astrometry::initial_pointing::{InitialPointing, initial_pointings};
use crate::astrometry::plate::{SkyStar, Solution};
use crate::astrometry::wcs::Wcs;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::config::{self, Config};
use crate::fits::{Header, guarded};
use crate::frames::header::{Aliases, binning, exposure_time};
use crate::frames::{Buffers, ElectronsPerAdu, Exposure, Gain, Role, mid_time, pixel_scale_arcsec, read};
use crate::orbit::{EarthOrientation, Site};
use crate::photometry::background::background;
use crate::photometry::detect::{Source, detect};
use crate::pipeline::prepared::catalogue_is_there;
use crate::pipeline::stars::solve::{Search, catalogue_stars, solve_from};

/// What is known of the frames.
#[derive(Debug)]
pub struct FrameSolver {
    /// The stars.
    pub stars: Vec<SkyStar>,
    /// Where the frames point \[deg\]; from each header if absent.
    pub position_deg: Option<(f64, f64)>,
    /// Pixel scale \[arcsec/px\]; from the optics if absent.
    pub scale_arcsec: Option<f64>,
    /// How far a frame may be from the approximate position \[deg\].
    pub radius_deg: f64,
    /// How far the scale may be off, as a share.
    pub scale_search_frac: f64,
    /// Whether the sky is mirrored on the frame; `None` = either.
    pub mirrored: Option<bool>,
    /// Pixel pitch \[µm\] and focal length \[mm\], unbinned.
    optics: Option<(f64, f64)>,
    site: Option<Site>,
    fields: BTreeMap<String, [f64; 2]>,
    time: config::Time,
    aliases: Aliases,
    photometry: config::Photometry,
}

/// A frame that was solved.
#[derive(Debug, Clone)]
pub struct SolvedFrame {
    /// (nx, ny) \[px\].
    pub size_px: (usize, usize),
    /// Its place on the sky.
    pub solution: Solution,
    /// The approximate position it was found from.
    pub source: String,
    /// Detections.
    pub n_detected: usize,
}

impl FrameSolver {
    /// From a table of stars alone; the rest from the headers or set afterwards.
    ///
    /// # Errors
    /// [`Error::Catalogue`] if it is not there, with the line that fetches one; as [`Catalogue::read`].
    pub fn from_catalogue(path: &Path, columns: &BTreeMap<String, String>) -> Result<Self> {
        let line = format!("satphot fetch stars --ra-deg RA --dec-deg DEC --radius-deg 1 -o {}", path.display());
        catalogue_is_there(path, &line, "")?;
        Ok(Self {
            stars: catalogue_stars(&Catalogue::read(path, columns)?),
            position_deg: None,
            scale_arcsec: None,
            radius_deg: 1.0,
            scale_search_frac: 0.2,
            mirrored: None,
            optics: None,
            site: None,
            fields: BTreeMap::new(),
            time: config::Time::default(),
            aliases: Aliases::new(),
            photometry: config::Photometry::default(),
        })
    }

    /// From the configuration of a night.
    ///
    /// # Errors
    /// [`Error::Config`] without `[stars]`; as [`Catalogue::read`].
    pub fn from_config(config: &Config) -> Result<Self> {
        let Some(stars) = &config.stars else {
            return Err(Error::Config { key: "stars".into(), problem: "is needed: it names the catalogue".into() });
        };
        catalogue_is_there(&stars.catalogue, &config.fetch_line("stars"), "")?;
        Ok(Self {
            radius_deg: stars.solve_radius_deg,
            scale_search_frac: stars.scale_search_frac,
            optics: Some((config.detector.pixel_um, config.telescope.focal_length_mm)),
            site: Some(Site::from_config(&config.site)?),
            fields: stars.fields.clone(),
            time: config.time.clone(),
            aliases: config.header.aliases.clone(),
            photometry: config.photometry.clone(),
            ..Self::from_catalogue(&stars.catalogue, &stars.columns)?
        })
    }

    /// Solves one frame.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Fits`] for a file that is not an image; [`Error::Header`] with everything that was tried.
    pub fn solve(&self, path: &Path) -> Result<SolvedFrame> {
        guarded(path, || self.solved(path))
    }

    fn solved(&self, path: &Path) -> Result<SolvedFrame> {
        let exposure = exposure(path, &self.time, &self.aliases)?;
        let scale_arcsec = self.scale(&exposure)?;
        let sources = detections(&exposure, &self.photometry)?;
        let positions = self.positions(&exposure);
        let refused =
            |problem: String| Error::Header { path: path.into(), keyword: "world coordinates".into(), problem };
        if positions.is_empty() {
            return Err(refused(
                "nothing says where the frame points: give argument `ra` and argument `dec`, or stars.fields".into(),
            ));
        }
        let search = Search {
            radius_deg: self.radius_deg,
            scale_arcsec,
            scale_search_frac: self.scale_search_frac,
            mirrored: self.mirrored,
        };
        let (solution, source) = solve_from(&positions, &sources, exposure.size_px, &self.stars, search)
            .map_err(|tried| refused(format!("no solution at {scale_arcsec:.3} arcsec/px: {tried}")))?;
        Ok(SolvedFrame { size_px: exposure.size_px, solution, source, n_detected: sources.len() })
    }

    fn positions(&self, exposure: &Exposure) -> Vec<InitialPointing> {
        if let Some((ra_deg, dec_deg)) = self.position_deg {
            return vec![InitialPointing {
                ra_deg,
                dec_deg,
                source: "arguments ra and dec".into(),
                is_reference: false,
            }];
        }
        let field = exposure.object.as_ref().and_then(|name| Some((name.as_str(), *self.fields.get(name)?)));
        let header = &exposure.header;
        let wcs = Wcs::of_header(header).ok().flatten();
        let eop = EarthOrientation::default();
        let site = self.site.as_ref().map(|site| (site, &eop));
        initial_pointings(exposure, field, wcs.as_ref(), site, &self.aliases)
    }

    /// The scale given; else of the optics; else of XPIXSZ (which counts the binning) and FOCALLEN.
    fn scale(&self, exposure: &Exposure) -> Result<f64> {
        if let Some(scale) = self.scale_arcsec {
            return Ok(scale);
        }
        if let Some((pixel_um, focal_mm)) = self.optics {
            return Ok(pixel_scale_arcsec(pixel_um, exposure.binning, focal_mm));
        }
        let number = |key: &str| exposure.header.number(key).filter(|v| *v > 0.0);
        match (number("XPIXSZ"), number("FOCALLEN")) {
            (Some(pixel_um), Some(focal_mm)) => Ok(pixel_scale_arcsec(pixel_um, 1, focal_mm)),
            _ => Err(Error::Header {
                path: exposure.path.clone(),
                keyword: "XPIXSZ/FOCALLEN".into(),
                problem: "do not state the pixel scale: give argument `scale` in arcsec/px".into(),
            }),
        }
    }
}

/// The detections on a frame of raw counts, brightest first.
pub(crate) fn detections(exposure: &Exposure, p: &config::Photometry) -> Result<Vec<Source>> {
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "raw counts".into(),
        read_noise_e: 0.0,
        pedestal_adu: 0.0,
        saturation_adu: f64::INFINITY,
    };
    let buffers = Buffers::default();
    let frame = read(exposure, gain, p.clip_radius_px, None, &buffers)?;
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    Ok(detect(&frame, &sky, p.detect_sigma, p.fwhm_px))
}

/// A light frame as far as matching needs it; a header without a time will do.
fn exposure(path: &Path, time: &config::Time, aliases: &Aliases) -> Result<Exposure> {
    let header = Header::read(path)?;
    let exptime_s = exposure_time(&header, aliases).0.map_or(0.0, |t| t.value).max(0.0);
    Ok(Exposure {
        path: PathBuf::from(path),
        name: file_name(path),
        role: Role::Stars,
        role_reason: "named".into(),
        object: header.text("OBJECT"),
        exptime_s,
        time: mid_time(&header, exptime_s, time, aliases, path).ok(),
        setting: None,
        header_e_per_adu: None,
        filter: None,
        size_px: header.size_px(),
        binning: binning(&header, aliases).0.value,
        warnings: Vec::new(),
        header,
    })
}
