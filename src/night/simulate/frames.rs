//! The frames of the synthetic night: what is exposed when, drawn, made noisy and written.

use std::path::{Path, PathBuf};

use hifitime::Epoch;
use ndarray::Array2;
use rand::Rng;
use rand_distr::{Distribution, Normal};

use super::field::{Star, draw_field, draw_trails};
use super::flux::{MoonInSky, rate_e_s, sky_v_mag_arcsec2};
use super::noise::{Camera, Response, expose, stream};
use super::render::{Body, PixelPsf, add_body, add_star, add_trail};
use super::scenario::Scenario;
use super::truth::{StarTruth, TargetTruth, Truth};
use crate::brightness::{ModelSettings, Satellite, brightness};
use crate::config::{self, Mode};
use crate::error::{Error, Result};
use crate::frames::{CardValue, Detector, Gain, write_u16};
use crate::night::clock::{iso_utc, parse_utc, shifted};
use crate::night::compare::scene;
use crate::night::progress::Progress;
use crate::orbit::{
    EarthOrientation, Geometry, Site, Tracker, airmass::airmass, altaz_to_icrs, bodies, icrs_to_altaz, moon_altaz,
    passes, sun_altaz,
};
use crate::photometry::wcs::{Wcs, WcsValue};

/// Streams of the star fields lie beyond those of the frames.
pub const FIELD_STREAM: u64 = 1 << 24;
/// Share of the full well the brightest part of the target is exposed to.
const TARGET_WELL_FRAC: f64 = 0.3;

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

/// Everything the frames share.
struct Studio<'a> {
    scenario: &'a Scenario,
    folder: &'a Path,
    detector: Detector,
    site: Site,
    eop: EarthOrientation,
    scale_arcsec: f64,
    response: Response,
}

/// Writes the night of `scenario` to `folder`: frames, catalogue.csv, elements, pipeline.toml and truth/.
///
/// # Errors
/// [`Error::Config`] for a gain setting outside the camera table, [`Error::Orbit`], [`Error::Io`].
pub fn simulate(scenario: &Scenario, folder: &Path, progress: &dyn Progress) -> Result<Simulated> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    let scenario = &with_elements(scenario, folder)?;
    let studio = Studio {
        scenario,
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
    };
    let (start, end) = (parse_utc("start_utc", &scenario.start_utc)?, parse_utc("end_utc", &scenario.end_utc)?);
    if end <= start {
        return Err(Error::Config { key: "end_utc".into(), problem: "must be later than start_utc".into() });
    }
    let mut truth = Truth::default();
    let mut frames = Vec::new();
    let mut notes = Vec::new();
    let (n_flats, n_stars) = (scenario.flats.n, scenario.pointings.n * scenario.pointings.frames);
    progress.stage("simulate", n_flats + n_stars + scenario.target.n);
    for k in 0..n_flats {
        frames.push(studio.flat(k, end)?);
        progress.tick();
    }
    for pointing in 0..scenario.pointings.n {
        let stars = studio.pointing(pointing, start, &mut frames, &mut truth, progress)?;
        truth.catalogue.extend(stars);
    }
    if scenario.target.n > 0 {
        studio.targets((start, end), &mut frames, &mut truth, &mut notes, progress)?;
    }
    progress.done();
    let pipeline_toml = truth.write(scenario, folder)?;
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
        std::fs::write(&scenario.target.elements, text).map_err(|e| Error::io(&scenario.target.elements, e))?;
    }
    if scenario.target.n > 0 && !scenario.target.elements.exists() {
        return Err(Error::Orbit {
            problem: format!("target.elements: no file at {}", scenario.target.elements.display()),
        });
    }
    Ok(scenario)
}

impl Studio<'_> {
    fn gain(&self, key: &str, setting: i64) -> Result<Gain> {
        self.detector.gain_for_setting(setting).ok_or_else(|| Error::Config {
            key: key.into(),
            problem: format!("{setting} (0.1 dB) is not in the table of camera {}", self.scenario.detector.camera),
        })
    }

    fn blank(&self) -> Array2<f32> {
        Array2::zeros((self.scenario.frame.ny_px, self.scenario.frame.nx_px))
    }

    fn path(&self, stem: &str) -> PathBuf {
        self.folder.join(format!("{stem}.fits{}", if self.scenario.compress { ".fz" } else { "" }))
    }

    /// Full well behind the saturation level the reduction will use \[e⁻\].
    fn full_well_e(&self, gain: &Gain) -> f64 {
        let top_adu = gain.saturation_adu / self.scenario.detector.saturation_frac;
        (top_adu - gain.pedestal_adu) * gain.e_per_adu.0
    }

    fn write(&self, stem: &str, id: u64, expected_e: Array2<f32>, gain: &Gain, cards: Vec<Card>) -> Result<PathBuf> {
        let camera =
            Camera { gain, full_well_e: self.full_well_e(gain), adc_max_adu: self.scenario.detector.adc_max_adu };
        let counts = expose(expected_e, camera, &self.response, self.scenario.seed, id);
        let path = self.path(stem);
        write_u16(&path, &counts, &cards, self.scenario.compress)?;
        Ok(path)
    }

    fn cards(&self, kind: &str, object: &str, start: Epoch, exptime_s: f64, gain: &Gain) -> Vec<Card> {
        let s = self.scenario;
        let date = iso_utc(start, 6).trim_end_matches('Z').to_string();
        let binned_um = s.detector.pixel_um * f64::from(s.frame.binning);
        vec![
            text("IMAGETYP", kind, "type of exposure"),
            text("OBJECT", object, "target of the exposure"),
            real("EXPTIME", exptime_s, "[s] exposure time"),
            text("DATE-OBS", &date, "UTC start of exposure"),
            text("TIMESYS", "UTC", "time scale"),
            integer("GAIN", gain.setting.map_or(0, |g| g.0), "[0.1 dB] camera gain setting"),
            real("EGAIN", gain.e_per_adu.0, "[e-/ADU] electrons per ADU"),
            text("INSTRUME", &s.detector.camera, "camera"),
            text("TELESCOP", &s.telescope.name, "telescope"),
            integer("XBINNING", i64::from(s.frame.binning), "binning in x"),
            integer("YBINNING", i64::from(s.frame.binning), "binning in y"),
            real("XPIXSZ", binned_um, "[um] pixel size, binned"),
            real("FOCALLEN", s.telescope.focal_length_mm, "[mm] focal length"),
            real("SITELAT", s.site.lat_deg, "[deg] latitude, north positive"),
            real("SITELONG", s.site.lon_deg, "[deg] longitude, east positive"),
            real("SITEELEV", s.site.alt_m, "[m] elevation"),
            text("SWCREATE", concat!("satphot ", env!("CARGO_PKG_VERSION"), " simulate"), "simulated data"),
            integer("SIMSEED", s.seed as i64, "seed of the simulation"),
        ]
    }

    fn flat(&self, k: usize, night_end: Epoch) -> Result<PathBuf> {
        let flats = &self.scenario.flats;
        let gain = self.gain("flats.gain_setting", flats.gain_setting)?;
        let level_e = flats.level_adu * gain.e_per_adu.0 * (1.0 + flats.level_drift_frac * k as f64);
        let mut image = self.blank();
        image.fill(level_e as f32);
        let start = shifted(night_end, 600.0 + 10.0 * k as f64);
        let cards = self.cards("Flat Frame", "flat", start, 1.0, &gain);
        self.write(&format!("flat_{k:03}"), 1 + k as u64, image, &gain, cards)
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
        let mut rng = stream(s.seed, FIELD_STREAM + (1 << 20) + pointing as u64, None);
        let share = if p.n > 1 { pointing as f64 / (p.n - 1) as f64 } else { 0.0 };
        let wanted_airmass = p.airmass_range[0] + share * (p.airmass_range[1] - p.airmass_range[0]);
        // plane-parallel is close enough to choose a direction; the truth uses the real airmass
        let alt_rad = (1.0 / wanted_airmass).clamp(0.0, 1.0).asin();
        // the golden angle keeps fields of equal airmass apart
        let az_rad = (2.399_963_229_728_653 * pointing as f64 + 0.4) % (2.0 * std::f64::consts::PI);
        let first = shifted(start, pointing as f64 * (p.frames as f64 * p.cadence_s + 330.0));
        let (ra_deg, dec_deg) = altaz_to_icrs(&self.site, &self.eop, &first, alt_rad, az_rad);
        let stars = draw_field(s, pointing, ra_deg, dec_deg);
        let cloud = scatter(&mut rng, s.photometric.pointing_scatter_mag);
        for member in 0..p.frames {
            let id = 10_000 + (pointing * 1_000 + member) as u64;
            let mut rng = stream(s.seed, id, None);
            let gain = self.gain("pointings.gain_settings", p.gain_settings[member % p.gain_settings.len()])?;
            let begin = shifted(first, member as f64 * p.cadence_s);
            let mid = shifted(begin, 0.5 * p.exptime_s);
            let centre = ((s.frame.nx_px as f64 - 1.0) / 2.0, (s.frame.ny_px as f64 - 1.0) / 2.0);
            let shift = (scatter(&mut rng, p.dither_px), scatter(&mut rng, p.dither_px));
            let rotation_deg = scatter(&mut rng, p.rotation_deg);
            let (x0, y0) = (centre.0 + shift.0, centre.1 + shift.1);
            let true_wcs = Wcs::tan(ra_deg, dec_deg, x0, y0, self.scale_arcsec, rotation_deg, false);
            let err = p.pointing_err_arcsec / self.scale_arcsec;
            let told = (x0 + scatter(&mut rng, err), y0 + scatter(&mut rng, err));
            let header_wcs = Wcs::tan(ra_deg, dec_deg, told.0, told.1, self.scale_arcsec, 0.0, false);
            let psf = PixelPsf::new(&s.psf, self.scale_arcsec, 1.0 + scatter(&mut rng, s.psf.seeing_scatter_frac));
            let stem = format!("field{pointing:02}_{member:02}");
            let frame_name = self.path(&stem).file_name().map_or(stem.clone(), |n| n.to_string_lossy().into_owned());
            let mut image = self.sky(mid, alt_rad, az_rad, p.exptime_s)?;
            for star in &stars {
                let Some((x_px, y_px)) = true_wcs.sky_to_pixel(star.ra_deg, star.dec_deg) else { continue };
                let (alt, _) = icrs_to_altaz(&self.site, &self.eop, &mid, star.ra_deg, star.dec_deg);
                let Some(airmass) = airmass(alt) else { continue };
                let rate = rate_e_s(&s.photometric, star.v_mag + cloud, star.b_v_mag, airmass);
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
            let mut cards = self.cards("Light Frame", &format!("FIELD {pointing:02}"), begin, p.exptime_s, &gain);
            cards.extend(header_wcs.cards().into_iter().map(|(key, value, comment)| match value {
                WcsValue::Text(t) => text(&key, &t, &comment),
                WcsValue::Real(v) => real(&key, v, &comment),
            }));
            frames.push(self.write(&stem, id, image, &gain, cards)?);
            progress.tick();
        }
        Ok(stars)
    }

    /// The tracked frames, spread evenly over the time the satellite is above `min_alt_deg`.
    fn targets(
        &self,
        (start, end): (Epoch, Epoch),
        frames: &mut Vec<PathBuf>,
        truth: &mut Truth,
        notes: &mut Vec<String>,
        progress: &dyn Progress,
    ) -> Result<()> {
        let t = &self.scenario.target;
        let tracker = Tracker::from_config(&self.orbit_config(&t.elements), &self.scenario.site)?;
        let satellite = Satellite::from_config(&self.model_config())?;
        let found = passes(&tracker, &start, &end, t.min_alt_deg.to_radians())?;
        let spans: Vec<(Epoch, f64)> =
            found.iter().map(|p| (p.rise.epoch, (p.set.epoch - p.rise.epoch).to_seconds())).collect();
        let total_s: f64 = spans.iter().map(|s| s.1).sum();
        if spans.is_empty() || total_s <= 0.0 {
            return Err(Error::Config {
                key: "target".into(),
                problem: format!("no pass above {} deg between start_utc and end_utc", t.min_alt_deg),
            });
        }
        notes.push(format!("{} passes above {} deg, {total_s:.0} s", spans.len(), t.min_alt_deg));
        let mut drawn: Vec<StarlessFrame> = Vec::new();
        for k in 0..t.n {
            let mut at = (k as f64 + 0.5) / t.n as f64 * total_s;
            let mut span = 0;
            while span + 1 < spans.len() && at > spans[span].1 {
                at -= spans[span].1;
                span += 1;
            }
            drawn.push(StarlessFrame { k, mid: shifted(spans[span].0, at) });
        }
        let name = tracker.elements_at(&start).map(|e| e.name().to_string()).unwrap_or_default();
        for frame in drawn {
            let geometry = tracker.at(&frame.mid)?;
            frames.push(self.target(frame, &geometry, &name, &satellite, truth)?);
            progress.tick();
        }
        Ok(())
    }

    fn target(
        &self,
        frame: StarlessFrame,
        geometry: &Geometry,
        name: &str,
        satellite: &Satellite,
        truth: &mut Truth,
    ) -> Result<PathBuf> {
        let s = self.scenario;
        let t = &s.target;
        let id = 5_000_000 + frame.k as u64;
        let mut rng = stream(s.seed, id, None);
        let gain = self.gain("target.gain_settings", t.gain_settings[frame.k % t.gain_settings.len()])?;
        let model = brightness(&scene(geometry), satellite, &ModelSettings::default())?;
        let v_mag = model.total_v_mag.map(|v| v + t.offset_mag + scatter(&mut rng, t.scatter_mag));
        let airmass = geometry.airmass.unwrap_or(f64::INFINITY);
        let solar_b_v = config::Zeropoint::default().target_b_v_mag;
        let rate = v_mag.map_or(0.0, |v| rate_e_s(&s.photometric, v, solar_b_v, airmass));

        let psf = PixelPsf::new(&s.psf, self.scale_arcsec, 1.0 + scatter(&mut rng, s.psf.seeing_scatter_frac));
        let px_per_m = 206_264.806 / (geometry.range_km * 1e3) / self.scale_arcsec;
        let size_px = (t.size_m[0] * px_per_m, t.size_m[1] * px_per_m);
        let lit_px2 = 0.35 * size_px.0 * size_px.1 + 1.13 * psf.fwhm_px.powi(2);
        let sky_rate = self.sky_rate_e_s_px(frame.mid, geometry.alt_rad, geometry.az_rad)?;
        let wanted = TARGET_WELL_FRAC * self.full_well_e(&gain) / (rate / lit_px2 + sky_rate).max(1e-30);
        let exptime_s = (wanted.clamp(t.exptime_range_s[0], t.exptime_range_s[1]) * 1e6).round() / 1e6;

        let mut image = self.sky(frame.mid, geometry.alt_rad, geometry.az_rad, exptime_s)?;
        let trail_px = self.trail_px(geometry, exptime_s);
        for trail in draw_trails(s, &mut rng, trail_px) {
            let flux_e = rate_e_s(&s.photometric, trail.v_mag, trail.b_v_mag, airmass) * exptime_s;
            add_trail(&mut image, &psf, trail.centre_px, trail_px, flux_e);
        }
        let off = t.off_centre_arcsec / self.scale_arcsec;
        let smear = t.smear_arcsec / self.scale_arcsec * exptime_s.min(1.0);
        let smear_angle = rng.random::<f64>() * std::f64::consts::TAU;
        let body = Body {
            x_px: (s.frame.nx_px as f64 - 1.0) / 2.0 + scatter(&mut rng, off),
            y_px: (s.frame.ny_px as f64 - 1.0) / 2.0 + scatter(&mut rng, off),
            size_px,
            angle_rad: geometry.az_rad + t.turn_deg_s.to_radians() * frame.k as f64,
            turn_rad: t.turn_deg_s.to_radians() * exptime_s,
            smear_px: (smear * smear_angle.cos(), smear * smear_angle.sin()),
            flux_e: rate * exptime_s,
        };
        add_body(&mut image, &psf, &body);

        let begin = shifted(frame.mid, -0.5 * exptime_s);
        let mut cards = self.cards("Light Frame", name, begin, exptime_s, &gain);
        cards.push(real("CENTALT", geometry.alt_rad.to_degrees(), "[deg] altitude at mid-exposure"));
        cards.push(real("CENTAZ", geometry.az_rad.to_degrees(), "[deg] azimuth at mid-exposure"));
        let stem = format!("target_{:04}", frame.k);
        let path = self.write(&stem, id, image, &gain, cards)?;
        truth.targets.push(TargetTruth {
            frame: path.file_name().map_or(stem, |n| n.to_string_lossy().into_owned()),
            date_mid: iso_utc(frame.mid, 6),
            exptime_s,
            gain_setting: gain.setting.map_or(0, |g| g.0),
            x_px: body.x_px,
            y_px: body.y_px,
            flux_e: body.flux_e,
            v_mag,
            model_v_mag: model.total_v_mag,
            sun_v_mag: model.sun.v_mag,
            earthshine_v_mag: model.earthshine.v_mag,
            moon_v_mag: model.moon.v_mag,
            lunar_earthshine_v_mag: model.lunar_earthshine.v_mag,
            illum: model.illum.to_string(),
            alt_deg: geometry.alt_rad.to_degrees(),
            az_deg: geometry.az_rad.to_degrees(),
            range_km: geometry.range_km,
            rate_deg_s: geometry.rate_rad_s.to_degrees(),
            airmass: geometry.airmass,
            trail_length_px: trail_px.0.hypot(trail_px.1),
        });
        Ok(path)
    }

    /// How far a star moves on the detector during the exposure \[px\]: against the satellite's motion among the stars.
    /// Columns run with azimuth, rows with altitude.
    fn trail_px(&self, geometry: &Geometry, exptime_s: f64) -> (f64, f64) {
        let (sin_az, cos_az) = geometry.az_rad.sin_cos();
        let (sin_alt, cos_alt) = geometry.alt_rad.sin_cos();
        let m = &geometry.motion_enu;
        let along_az = m.x() * cos_az - m.y() * sin_az;
        let along_alt = -m.x() * sin_az * sin_alt - m.y() * cos_az * sin_alt + m.z() * cos_alt;
        let px = geometry.rate_rad_s * exptime_s * 206_264.806 / self.scale_arcsec;
        (-along_az * px, -along_alt * px)
    }

    /// Electrons of sky per pixel and second.
    fn sky_rate_e_s_px(&self, mid: Epoch, alt_rad: f64, az_rad: f64) -> Result<f64> {
        let sky = bodies(&mid, &self.eop)?;
        let moon = moon_altaz(&self.site, &sky);
        let sun = sun_altaz(&self.site, &sky);
        let direction = |alt: f64, az: f64| {
            crate::vector::Vector::<crate::vector::Enu>::new(alt.cos() * az.sin(), alt.cos() * az.cos(), alt.sin())
        };
        let towards_moon = direction(moon.0, moon.1);
        let moon_in_sky = MoonInSky {
            alt_rad: moon.0,
            // Sun-Moon elongation seen from here; the phase angle is its supplement to half a degree
            phase_rad: std::f64::consts::PI - towards_moon.angle_to(&direction(sun.0, sun.1)),
            sep_rad: towards_moon.angle_to(&direction(alt_rad, az_rad)),
        };
        let p = &self.scenario.photometric;
        let mu = sky_v_mag_arcsec2(&self.scenario.sky, p.k_mag_airmass, alt_rad, Some(moon_in_sky));
        Ok(10f64.powf(-0.4 * (mu + p.zp_mag)) * self.scale_arcsec.powi(2))
    }

    /// A frame of sky, with its gradient along the rows.
    fn sky(&self, mid: Epoch, alt_rad: f64, az_rad: f64, exptime_s: f64) -> Result<Array2<f32>> {
        let level_e = self.sky_rate_e_s_px(mid, alt_rad, az_rad)? * exptime_s;
        let nx = self.scenario.frame.nx_px as f64;
        let mut image = self.blank();
        for ((_, i), pixel) in image.indexed_iter_mut() {
            let gradient = 1.0 + self.scenario.sky.gradient_frac * ((i as f64 + 0.5) / nx - 0.5);
            *pixel = (level_e * gradient) as f32;
        }
        Ok(image)
    }

    fn orbit_config(&self, elements: &Path) -> config::Orbit {
        config::Orbit {
            elements: elements.to_path_buf(),
            norad_cat_id: self.scenario.target.norad_cat_id,
            max_age_d: 14.0,
            force_age: false,
            ut1_utc_s: 0.0,
            xp_arcsec: 0.0,
            yp_arcsec: 0.0,
        }
    }

    fn model_config(&self) -> config::Model {
        config::Model {
            satellite: self.scenario.target.satellite.clone(),
            mode: Mode::Corrected,
            surfaces: Vec::new(),
            tolerance: 1e-4,
        }
    }
}

/// A tracked frame before it is drawn.
#[derive(Debug, Clone, Copy)]
struct StarlessFrame {
    k: usize,
    mid: Epoch,
}

type Card = (String, CardValue, String);

fn text(key: &str, value: &str, comment: &str) -> Card {
    (key.into(), CardValue::Text(value.into()), comment.into())
}
fn real(key: &str, value: f64, comment: &str) -> Card {
    (key.into(), CardValue::Real(value), comment.into())
}
fn integer(key: &str, value: i64, comment: &str) -> Card {
    (key.into(), CardValue::Integer(value), comment.into())
}

/// A Gaussian deviate of the given scatter; 0 for scatter 0.
fn scatter(rng: &mut impl Rng, sigma: f64) -> f64 {
    Normal::new(0.0, sigma).map_or(0.0, |n| n.sample(rng))
}
