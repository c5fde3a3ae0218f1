//! The frames of the synthetic night: what is exposed when, drawn, made noisy and written.

pub(crate) use super::field::FIELD_STREAM;

use std::path::{Path, PathBuf};

use hifitime::Epoch;
use ndarray::Array2;
use rand::Rng;
use rand_distr::{Distribution, Normal};

use super::field::{Star, draw_field};
use super::flux::{rate_e_s, sky_v_mag_arcsec2};
use super::noise::{Response, expose, stream};
use super::parts::{Part, parts};
use super::render::{PixelPsf, add_star};
use super::scenario::{Headers, Scenario, Zeros};
use super::truth::Truth;
use crate::astrometry::wcs::{Wcs, WcsValue};
use crate::base::error::{Error, Result};
use crate::base::file::{make_folder, write_atomic};
use crate::base::progress::Progress;
use crate::base::time::{iso_utc, parse_utc, shifted};
use crate::config::{self};
use crate::fits::{CardLine, card, write_u16};
use crate::frames::{Camera, Detector, Gain};
use crate::orbit::{
    EarthOrientation, Site, airmass::airmass, altaz_to_icrs, bodies, icrs_to_altaz, moon_altaz, sun_altaz,
};
use crate::tables::StarTruth;
use crate::visibility::sky_brightness::MoonInSky;

/// Random streams of the parts of a night lie this many bits apart, beyond those of the star fields.
const PART_SHIFT: u32 = 26;

/// What was written.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// The frames, in the order of the night.
    pub frames: Vec<PathBuf>,
    /// The configuration that reduces them.
    pub pipeline_toml: PathBuf,
    /// Folder of the truth tables.
    pub truth: PathBuf,
    /// What could not be done, e.g. fewer passes than hoped.
    pub notes: Vec<String>,
}

/// Everything the frames of a part share.
pub(super) struct FrameSimulator<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) part: &'a Part,
    folder: &'a Path,
    detector: Detector,
    site: Site,
    eop: EarthOrientation,
    pub(super) scale_arcsec: f64,
    response: Response,
}

/// Writes the night of `scenario` to `folder`: frames, catalogue.csv, elements, pipeline.toml and truth/.
///
/// # Errors
/// [`Error::Config`] for a gain setting outside the camera table, [`Error::Orbit`], [`Error::Io`].
pub fn simulate(scenario: &Scenario, folder: &Path, progress: &dyn Progress) -> Result<Simulated> {
    make_folder(folder)?;
    let scenario = &with_elements(scenario, folder)?;
    // keys of the scenario, not arguments
    let time = |key: &str, text: &str| {
        parse_utc(key, text).map_err(|error| match error {
            Error::Argument { name, problem } => Error::Config { key: name, problem },
            other => other,
        })
    };
    let (start, end) = (time("start_utc", &scenario.start_utc)?, time("end_utc", &scenario.end_utc)?);
    if end <= start {
        return Err(Error::Config { key: "end_utc".into(), problem: "must be later than start_utc".into() });
    }
    let parts = parts(scenario)?;
    let mut truth = Truth::default();
    let mut frames = Vec::new();
    let mut notes = Vec::new();
    let n_zeros = |s: &Scenario| s.zeros.map_or(0, |z| z.biases + z.darks);
    let n_frames = |s: &Scenario| s.flats.n + s.pointings.n * s.pointings.frames + s.target.n + n_zeros(s);
    progress.stage("simulate", parts.iter().map(|part| n_frames(&part.scenario)).sum());
    for part in &parts {
        let studio = FrameSimulator::of(part, folder)?;
        let scenario = &part.scenario;
        for k in 0..scenario.flats.n {
            frames.push(studio.flat(k, end)?);
            progress.tick();
        }
        if let Some(zeros) = &scenario.zeros {
            for k in 0..zeros.biases + zeros.darks {
                frames.push(studio.zero(k, zeros, end)?);
                progress.tick();
            }
        }
        let first_pointing = match &scenario.pointings.start_utc {
            Some(text) => time("pointings.start_utc", text)?,
            None => start,
        };
        for pointing in 0..scenario.pointings.n {
            let stars = studio.pointing(pointing, first_pointing, &mut frames, &mut truth, progress)?;
            truth.catalogue.extend(stars.into_iter().filter(|_| part.lists_stars));
        }
        if scenario.target.n > 0 {
            studio.targets((start, end), &mut frames, &mut truth, &mut notes, progress)?;
        }
    }
    progress.done();
    let pipeline_toml = truth.write(&parts, scenario, folder)?;
    Ok(Simulated { frames, pipeline_toml, truth: folder.join("truth"), notes })
}

/// The scenario with embedded elements written to `folder`.
fn with_elements(scenario: &Scenario, folder: &Path) -> Result<Scenario> {
    let mut scenario = scenario.clone();
    let name = scenario.target.elements.to_string_lossy().into_owned();
    if let Some(name) = name.strip_prefix("builtin:") {
        let (_, text) = config::ELEMENTS.iter().find(|(n, _)| *n == name).ok_or_else(|| Error::Config {
            key: "target.elements".into(),
            problem: format!(
                "no built-in elements \"{name}\"; known: {}",
                config::ELEMENTS.iter().map(|(n, _)| *n).collect::<Vec<_>>().join(", ")
            ),
        })?;
        scenario.target.elements = folder.join(format!("{name}.tle"));
        write_atomic(&scenario.target.elements, text.as_bytes())?;
    }
    if scenario.target.n > 0 && !scenario.target.elements.exists() {
        return Err(Error::Orbit {
            problem: format!("target.elements: no file at {}", scenario.target.elements.display()),
        });
    }
    Ok(scenario)
}

impl<'a> FrameSimulator<'a> {
    fn of(part: &'a Part, folder: &'a Path) -> Result<Self> {
        let scenario = &part.scenario;
        Ok(Self {
            scenario,
            part,
            folder,
            detector: Detector::from_config(&scenario.detector)?,
            site: Site::from_config(&scenario.site)?,
            eop: EarthOrientation::default(),
            scale_arcsec: scenario.scale_arcsec(),
            response: Response::new(
                (scenario.frame.nx_px, scenario.frame.ny_px),
                scenario.vignetting,
                scenario.photometry.clip_radius_px,
            ),
        })
    }

    /// The random streams of a frame: those of the parts lie apart.
    pub(super) fn id(&self, frame: u64) -> u64 {
        (self.part.number << PART_SHIFT) + frame
    }

    pub(super) fn gain(&self, key: &str, setting: i64) -> Result<Gain> {
        self.detector.gain_for_setting(setting).ok_or_else(|| Error::Config {
            key: key.into(),
            problem: format!("{setting} (0.1 dB) is not in the table of camera {}", self.scenario.detector.camera),
        })
    }

    fn blank(&self) -> Array2<f32> {
        Array2::zeros((self.scenario.frame.ny_px, self.scenario.frame.nx_px))
    }

    fn path(&self, stem: &str) -> PathBuf {
        let ending = if self.scenario.compress { ".fz" } else { "" };
        self.folder.join(format!("{}{stem}.fits{ending}", self.part.prefix))
    }

    /// Name of a frame's file.
    pub(super) fn file_name(&self, stem: &str) -> String {
        self.path(stem).file_name().map_or(stem.to_owned(), |n| n.to_string_lossy().into_owned())
    }

    /// Full well behind the saturation level the reduction will use \[e⁻\].
    pub(super) fn full_well_e(&self, gain: &Gain) -> f64 {
        Camera::at(gain, &self.scenario.detector).full_well_e
    }

    pub(super) fn write(
        &self,
        stem: &str,
        id: u64,
        expected_e: Array2<f32>,
        gain: &Gain,
        cards: Vec<CardLine>,
    ) -> Result<PathBuf> {
        let camera = Camera::at(gain, &self.scenario.detector);
        let counts = expose(expected_e, camera, &self.response, self.scenario.seed, self.id(id));
        let path = self.path(stem);
        write_u16(&path, &counts, &cards, self.scenario.compress)?;
        Ok(path)
    }

    /// The cards that all frames have; `kinds` are IMAGETYP as satphot and as N.I.N.A. write it.
    pub(super) fn cards(
        &self,
        kinds: (&str, &str),
        object: &str,
        start: Epoch,
        exptime_s: f64,
        gain: &Gain,
    ) -> Vec<CardLine> {
        let s = self.scenario;
        let date = |at: Epoch| iso_utc(at, 6).trim_end_matches('Z').to_string();
        let binned_um = s.detector.pixel_um * f64::from(s.frame.binning);
        let nina = s.headers == Headers::Nina;
        let mut cards = vec![
            card("IMAGETYP", if nina { kinds.1 } else { kinds.0 }, "type of exposure"),
            card("EXPTIME", exptime_s, "[s] exposure time"),
            card("DATE-OBS", &date(start), "UTC start of exposure"),
            card("TIMESYS", "UTC", "time scale"),
            card("GAIN", gain.setting.map_or(0, |g| g.0), "[0.1 dB] camera gain setting"),
            card("EGAIN", gain.e_per_adu.0, "[e-/ADU] electrons per ADU"),
            card("INSTRUME", &s.detector.camera, "camera"),
            card("TELESCOP", &s.telescope.name, "telescope"),
            card("XBINNING", i64::from(s.frame.binning), "binning in x"),
            card("YBINNING", i64::from(s.frame.binning), "binning in y"),
            card("XPIXSZ", binned_um, "[um] pixel size, binned"),
            card("FOCALLEN", s.telescope.focal_length_mm, "[mm] focal length"),
            card("SITELAT", s.site.lat_deg, "[deg] latitude, north positive"),
            card("SITELONG", s.site.lon_deg, "[deg] longitude, east positive"),
            card("SITEELEV", s.site.alt_m, "[m] elevation"),
            card("SWCREATE", concat!("satphot ", env!("CARGO_PKG_VERSION"), " simulate"), "simulated data"),
            card("SIMSEED", s.seed as i64, "seed of the simulation"),
        ];
        if kinds.1 == "LIGHT" || !nina {
            cards.insert(1, card("OBJECT", object, "target of the exposure"));
        }
        let unlit = kinds.0.starts_with("Bias") || kinds.0.starts_with("Dark");
        cards.extend(s.filter.as_ref().filter(|_| !unlit).map(|name| card("FILTER", name, "active filter name")));
        if nina {
            cards.extend([
                card("EXPOSURE", exptime_s, "[s] exposure duration"),
                card("DATE-AVG", &date(shifted(start, 0.5 * exptime_s)), "averaged midpoint time (UTC)"),
                card("OFFSET", 50_i64, "sensor gain offset"),
                card("SET-TEMP", -10.0, "[degC] CCD temperature setpoint"),
                card("CCD-TEMP", -10.0, "[degC] CCD temperature"),
                card("FWHEEL", "Filter wheel", "filter wheel name"),
                card("ROWORDER", "TOP-DOWN", "FITS image orientation"),
                card("EQUINOX", 2000.0, "equinox of celestial coordinate system"),
            ]);
        }
        cards
    }

    fn flat(&self, k: usize, night_end: Epoch) -> Result<PathBuf> {
        let flats = &self.scenario.flats;
        let gain = self.gain("flats.gain_setting", flats.gain_setting)?;
        let level_e = flats.level_adu * gain.e_per_adu.0 * (1.0 + flats.level_drift_frac * k as f64);
        let mut image = self.blank();
        image.fill(level_e as f32);
        // those of another filter after them
        let start = shifted(night_end, 600.0 + 10.0 * (k + self.part.turn.0 * flats.n) as f64);
        let cards = self.cards(("Flat Frame", "FLAT"), "flat", start, 1.0, &gain);
        self.write(&format!("flat_{k:03}"), 1 + k as u64, image, &gain, cards)
    }

    /// A bias frame, or a dark one after them.
    fn zero(&self, k: usize, zeros: &Zeros, night_end: Epoch) -> Result<PathBuf> {
        let gain = self.gain("zeros.gain_setting", zeros.gain_setting)?;
        let (kinds, stem, exptime_s) = match k.checked_sub(zeros.biases) {
            None => (("Bias Frame", "BIAS"), format!("bias_{k:03}"), 0.0),
            Some(dark) => (("Dark Frame", "DARK"), format!("dark_{dark:03}"), zeros.dark_exptime_s),
        };
        let start = shifted(night_end, 20_000.0 + (zeros.dark_exptime_s + 2.0) * k as f64);
        let cards = self.cards(kinds, "", start, exptime_s, &gain);
        self.write(&stem, 3_000_000 + k as u64, self.blank(), &gain, cards)
    }

    /// One star pointing: its field, its frames, their truth. Returns the field's catalogue stars.
    fn pointing(
        &self,
        pointing: usize,
        start: Epoch,
        frames: &mut Vec<PathBuf>,
        truth: &mut Truth,
        progress: &dyn Progress,
    ) -> Result<Vec<Star>> {
        let s = self.scenario;
        let p = &s.pointings;
        let number = self.part.first_field + pointing;
        let mut rng = stream(s.seed, FIELD_STREAM + (1 << 20) + number as u64, None);
        let share = if p.n > 1 { pointing as f64 / (p.n - 1) as f64 } else { 0.0 };
        let wanted_airmass = p.airmass_range[0] + share * (p.airmass_range[1] - p.airmass_range[0]);
        // plane-parallel is close enough to choose a direction; the truth uses the real airmass
        let alt_rad = (1.0 / wanted_airmass).clamp(0.0, 1.0).asin();
        // the golden angle keeps fields of equal airmass apart
        let az_rad = (2.399_963_229_728_653 * number as f64 + 0.4) % (2.0 * std::f64::consts::PI);
        let (turn, of) = self.part.turn;
        let first = shifted(start, pointing as f64 * ((p.frames * of) as f64 * p.cadence_s + 330.0));
        let (ra_deg, dec_deg) = altaz_to_icrs(&self.site, &self.eop, &first, alt_rad, az_rad);
        let stars = draw_field(s, number, ra_deg, dec_deg);
        let under = if p.cloudy == Some(pointing) { p.cloud_mag } else { 0.0 };
        let cloud = under + scatter(&mut rng, s.photometric.pointing_scatter_mag);
        let of_field = airmass(alt_rad, &self.site.atmosphere()).unwrap_or(1.0);
        for member in 0..p.frames {
            let id = 10_000 + (pointing * 1_000 + member) as u64;
            let mut rng = stream(s.seed, self.id(id), None);
            let gain = self.gain("pointings.gain_settings", p.gain_settings[member % p.gain_settings.len()])?;
            let begin = shifted(first, (member * of + turn) as f64 * p.cadence_s);
            let mid = shifted(begin, 0.5 * p.exptime_s);
            let centre = ((s.frame.nx_px as f64 - 1.0) / 2.0, (s.frame.ny_px as f64 - 1.0) / 2.0);
            let shift = (scatter(&mut rng, p.dither_px), scatter(&mut rng, p.dither_px));
            let rotation_deg = scatter(&mut rng, p.rotation_deg);
            let (x0, y0) = (centre.0 + shift.0, centre.1 + shift.1);
            let true_wcs = Wcs::tan(ra_deg, dec_deg, x0, y0, self.scale_arcsec, rotation_deg, false);
            let err = p.pointing_err_arcsec / self.scale_arcsec;
            let stated = (x0 + scatter(&mut rng, err), y0 + scatter(&mut rng, err));
            let header_wcs = Wcs::tan(ra_deg, dec_deg, stated.0, stated.1, self.scale_arcsec, 0.0, false);
            let psf =
                PixelPsf::new(&s.psf, self.scale_arcsec, of_field, 1.0 + scatter(&mut rng, s.psf.seeing_scatter_frac));
            let stem = format!("field{pointing:02}_{member:02}");
            let frame_name = self.file_name(&stem);
            let mut image = self.sky(mid, alt_rad, az_rad, p.exptime_s)?;
            for star in &stars {
                let Some((x_px, y_px)) = true_wcs.sky_to_pixel(star.ra_deg, star.dec_deg) else { continue };
                let (alt, _) = icrs_to_altaz(&self.site, &self.eop, &mid, star.ra_deg, star.dec_deg);
                let Some(airmass) = airmass(alt, &self.site.atmosphere()) else { continue };
                let mag = star.v_mag + s.band_minus_v_mag(star.b_v_mag) + cloud;
                let rate = rate_e_s(&s.photometric, mag, star.b_v_mag, airmass);
                add_star(&mut image, &psf, x_px, y_px, rate * p.exptime_s);
                let inside = x_px > -0.5
                    && y_px > -0.5
                    && x_px < s.frame.nx_px as f64 - 0.5
                    && y_px < s.frame.ny_px as f64 - 0.5;
                if inside {
                    truth.stars.push(StarTruth {
                        frame: frame_name.clone(),
                        star_id: star.id.clone(),
                        x_px,
                        y_px,
                        v_mag: star.v_mag,
                        b_v_mag: star.b_v_mag,
                        airmass,
                        flux_e: rate * p.exptime_s,
                        exptime_s: p.exptime_s,
                        fwhm_px: psf.fwhm_px,
                    });
                }
            }
            let object = format!("FIELD {number:02}");
            let mut cards = self.cards(("Light Frame", "LIGHT"), &object, begin, p.exptime_s, &gain);
            if s.headers == Headers::Nina {
                let (ra_deg, dec_deg) = header_wcs.pixel_to_sky(centre.0, centre.1);
                cards.extend(mount_cards(ra_deg, dec_deg));
            }
            let written = s.headers == Headers::Satphot;
            cards.extend(header_wcs.cards().into_iter().filter(|_| written).map(|(key, value, comment)| match value {
                WcsValue::Text(t) => card(&key, &t, &comment),
                WcsValue::Real(v) => card(&key, v, &comment),
            }));
            frames.push(self.write(&stem, id, image, &gain, cards)?);
            progress.tick();
        }
        Ok(stars)
    }

    /// Electrons of sky per pixel and second.
    pub(super) fn sky_rate_e_s_px(&self, mid: Epoch, alt_rad: f64, az_rad: f64) -> Result<f64> {
        let sky = bodies(&mid, &self.eop)?;
        let moon = moon_altaz(&self.site, &sky);
        let sun = sun_altaz(&self.site, &sky);
        let direction = |alt: f64, az: f64| {
            crate::base::vector::Vector::<crate::base::vector::Enu>::new(
                alt.cos() * az.sin(),
                alt.cos() * az.cos(),
                alt.sin(),
            )
        };
        let towards_moon = direction(moon.0, moon.1);
        let moon_in_sky = MoonInSky {
            alt_rad: moon.0,
            // Sun-Moon elongation seen from here; the phase angle is its supplement to half a degree
            phase_rad: std::f64::consts::PI - towards_moon.angle_to(&direction(sun.0, sun.1)),
            sep_rad: towards_moon.angle_to(&direction(alt_rad, az_rad)),
        };
        let p = &self.scenario.photometric;
        let mu = sky_v_mag_arcsec2(&self.scenario.sky, p.k_mag_airmass, alt_rad, Some(moon_in_sky), sun.0)?;
        Ok(10f64.powf(-0.4 * (mu + p.zp_mag)) * self.scale_arcsec.powi(2))
    }

    /// A frame of sky, with its gradient along the rows.
    pub(super) fn sky(&self, mid: Epoch, alt_rad: f64, az_rad: f64, exptime_s: f64) -> Result<Array2<f32>> {
        let level_e = self.sky_rate_e_s_px(mid, alt_rad, az_rad)? * exptime_s;
        let nx = self.scenario.frame.nx_px as f64;
        let mut image = self.blank();
        for ((_, i), pixel) in image.indexed_iter_mut() {
            let gradient = 1.0 + self.scenario.sky.gradient_frac * ((i as f64 + 0.5) / nx - 0.5);
            *pixel = (level_e * gradient) as f32;
        }
        Ok(image)
    }
}

/// Where the mount points, as N.I.N.A. writes it.
pub(super) fn mount_cards(ra_deg: f64, dec_deg: f64) -> [CardLine; 2] {
    [card("RA", ra_deg, "[deg] RA of telescope"), card("DEC", dec_deg, "[deg] Declination of telescope")]
}

/// A Gaussian deviate of the given scatter; 0 for scatter 0.
pub(super) fn scatter(rng: &mut impl Rng, sigma: f64) -> f64 {
    Normal::new(0.0, sigma).map_or(0.0, |n| n.sample(rng))
}
