//! The tracked frames: when they are taken, how bright the satellite is, how the stars trail behind it.

use crate::base::constants::ARCSEC_PER_RAD;
use std::path::{Path, PathBuf};

use hifitime::Epoch;
use rand::Rng;

use super::field::{Star, Trail, draw_trails};
use super::flux::rate_e_s;
use super::frames::{FrameSimulator, mount_cards, scatter};
use super::noise::stream;
use super::render::{Body, PixelPsf, add_body, add_trail};
use super::resolved::RenderedSatellite;
use super::resolved::peak_share;
use super::resolved::rendered_satellite;
use super::satellites::named;
use super::scenario::Headers;
use super::truth::Truth;
use crate::astrometry::wcs::Wcs;
use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::time::{iso_utc, shifted};
use crate::brightness::Model;
use crate::brightness::scene::scene;
use crate::config;
use crate::fits::card;
use crate::orbit::{Geometry, Tracker, altaz_to_icrs, passes};
use crate::resolved::ComponentSatellite;
use crate::tables::{RenderedTruth, TargetTruth};

/// Share of the full well the brightest part of the target is exposed to.
const TARGET_WELL_FRAC: f64 = 0.3;
/// Time before and after mid-exposure over which the motion among the stars is taken \[s\].
const MOTION_S: f64 = 0.05;

/// Random streams of the clouds lie beyond those of the frames.
const CLOUD_STREAM: u64 = 8_000_000;

/// A star of a tracked frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct FieldStar {
    /// Right ascension \[deg\].
    pub ra_deg: f64,
    /// Declination \[deg\].
    pub dec_deg: f64,
    /// Electrons of the exposure.
    pub flux_e: f64,
}

/// A tracked frame before it is drawn.
#[derive(Debug, Clone, Copy)]
struct StarlessFrame {
    k: usize,
    mid: Epoch,
}

impl FrameSimulator<'_> {
    /// The tracked frames, spread evenly over the time the satellite is above `min_alt_deg`.
    pub(super) fn targets(
        &self,
        (start, end): (Epoch, Epoch),
        frames: &mut Vec<PathBuf>,
        truth: &mut Truth,
        notes: &mut Vec<String>,
        progress: &dyn Progress,
    ) -> Result<()> {
        let t = &self.scenario.target;
        let tracker = Tracker::from_config(&self.orbit_config(&t.elements), &self.scenario.site)?;
        let model = Model::from_config(&self.model_config())?;
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
            let (turn, of) = self.part.turn;
            let mut at = (k as f64 + (turn as f64 + 0.5) / of as f64) / t.n as f64 * total_s;
            let mut span = 0;
            while span + 1 < spans.len() && at > spans[span].1 {
                at -= spans[span].1;
                span += 1;
            }
            drawn.push(StarlessFrame { k, mid: shifted(spans[span].0, at) });
        }
        let components = t.resolved.as_deref().map(named).transpose()?;
        let name = tracker.elements_at(&start).map(|e| e.name().to_string()).unwrap_or_default();
        for frame in drawn {
            let geometry = tracker.at(&frame.mid)?;
            let of = (name.as_str(), &model, components.as_ref());
            frames.push(self.target(frame, (&tracker, &geometry), of, truth)?);
            progress.tick();
        }
        Ok(())
    }

    fn target(
        &self,
        frame: StarlessFrame,
        (tracker, geometry): (&Tracker, &Geometry),
        (name, model, components): (&str, &Model, Option<&ComponentSatellite>),
        truth: &mut Truth,
    ) -> Result<PathBuf> {
        let s = self.scenario;
        let t = &s.target;
        let id = 5_000_000 + frame.k as u64;
        let mut rng = stream(s.seed, self.id(id), None);
        let gain = self.gain("target.gain_settings", t.gain_settings[frame.k % t.gain_settings.len()])?;
        let modelled = model.brightness(&scene(geometry))?;
        let rendered_satellite = components.map(|satellite| rendered_satellite(satellite, geometry)).transpose()?;
        let shown_v_mag = rendered_satellite.as_ref().map_or(modelled.total_v_mag, |s| s.truth.rendered_v_mag);
        let [solar_b_v, _] = config::Zeropoint::default().target_colour(None);
        let b_v_mag = t.b_v_mag.unwrap_or(solar_b_v);
        // the model is of the band and of sunlight: another colour makes it brighter or fainter against V
        let coloured_mag = s.band_minus_v_mag(b_v_mag) - s.band_minus_v_mag(solar_b_v);
        let v_mag = shown_v_mag.map(|v| v + coloured_mag + t.offset_mag + scatter(&mut rng, t.scatter_mag));
        let airmass = geometry.airmass.unwrap_or(f64::INFINITY);
        let cloud_mag = self.cloud_mag(frame.k);
        let rate = v_mag.map_or(0.0, |v| rate_e_s(&s.photometric, v + cloud_mag, b_v_mag, airmass));

        let psf = PixelPsf::new(&s.psf, self.scale_arcsec, airmass, 1.0 + scatter(&mut rng, s.psf.seeing_scatter_frac));
        let px_per_m = ARCSEC_PER_RAD / (geometry.range_km * 1e3) / self.scale_arcsec;
        let size_px = (t.size_m[0] * px_per_m, t.size_m[1] * px_per_m);
        let still = |s: &RenderedSatellite| s.on_frame(&psf, self.scale_arcsec, (0.0, 0.0), (0.0, 0.0));
        let peak = rendered_satellite.as_ref().map(still).transpose()?.flatten().map(|on| peak_share(&on));
        let lit_px2 = peak.map_or(0.35 * size_px.0 * size_px.1 + 1.13 * psf.fwhm_px.powi(2), f64::recip);
        let sky_rate = self.sky_rate_e_s_px(frame.mid, geometry.alt_rad, geometry.az_rad)?;
        let wanted = TARGET_WELL_FRAC * self.full_well_e(&gain) / (rate / lit_px2 + sky_rate).max(1e-30);
        let exptime_s = (wanted.clamp(t.exptime_range_s[0], t.exptime_range_s[1]) * 1e6).round() / 1e6;

        let mut image = self.sky(frame.mid, geometry.alt_rad, geometry.az_rad, exptime_s)?;
        let trail_px = self.trail_px(tracker, frame.mid, exptime_s)?;
        let trails = draw_trails(s, &mut rng, trail_px);
        let trail_e = |trail: &Trail| {
            let mag = trail.v_mag + s.band_minus_v_mag(trail.b_v_mag) + cloud_mag;
            rate_e_s(&s.photometric, mag, trail.b_v_mag, airmass) * exptime_s
        };
        if !t.catalogue_trails {
            for trail in &trails {
                add_trail(&mut image, &psf, trail.centre_px, trail_px, trail_e(trail));
            }
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
        if t.catalogue_trails {
            let place = (body.x_px, body.y_px);
            let stars = self.stars_of_trails(&trails, &mut rng, (tracker, frame.mid, frame.k), place)?;
            let lit = |(star, trail): (&Star, &Trail)| FieldStar {
                ra_deg: star.ra_deg,
                dec_deg: star.dec_deg,
                flux_e: trail_e(trail),
            };
            let of_field: Vec<FieldStar> = stars.iter().zip(&trails).map(lit).collect();
            self.add_paths(&mut image, &psf, &of_field, (tracker, frame.mid, exptime_s), place)?;
            if self.part.lists_stars {
                truth.catalogue.extend(stars);
            }
        }
        let stem = format!("target_{:04}", frame.k);
        if let Some(rendered_satellite) = rendered_satellite {
            let on = rendered_satellite.on_frame(&psf, self.scale_arcsec, (body.x_px, body.y_px), body.smear_px)?;
            let beside_frac = on.map_or(0.0, |on| on.paint(&on.total(), body.flux_e, &mut image));
            let frame = self.file_name(&stem);
            truth.rendered.push(RenderedTruth { frame, beside_frac, ..rendered_satellite.truth });
        } else {
            add_body(&mut image, &psf, &body);
        }

        let begin = shifted(frame.mid, -0.5 * exptime_s + t.clock_err_s);
        let mut cards = self.cards(("Light Frame", "LIGHT"), name, begin, exptime_s, &gain);
        if s.headers == Headers::Nina {
            let (site, eop) = (tracker.site(), tracker.earth_orientation());
            let (ra_deg, dec_deg) = altaz_to_icrs(site, eop, &frame.mid, geometry.alt_rad, geometry.az_rad);
            cards.extend(mount_cards(ra_deg, dec_deg));
        }
        cards.push(card("CENTALT", geometry.alt_rad.to_degrees(), "[deg] altitude at mid-exposure"));
        cards.push(card("CENTAZ", geometry.az_rad.to_degrees(), "[deg] azimuth at mid-exposure"));
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
            model_v_mag: modelled.total_v_mag,
            sun_v_mag: modelled.sun.v_mag,
            earthshine_v_mag: modelled.earthshine.v_mag,
            moon_v_mag: modelled.moon.v_mag,
            lunar_earthshine_v_mag: modelled.lunar_earthshine.v_mag,
            illum: modelled.illum.to_string(),
            alt_deg: geometry.alt_rad.to_degrees(),
            az_deg: geometry.az_rad.to_degrees(),
            range_km: geometry.range_km,
            rate_deg_s: geometry.rate_rad_s.to_degrees(),
            airmass: geometry.airmass,
            trail_length_px: trail_px.0.hypot(trail_px.1),
            cloud_mag,
        });
        Ok(path)
    }

    /// Extinction by a cloud in a frame \[mag\], for stars and target alike.
    fn cloud_mag(&self, k: usize) -> f64 {
        let t = &self.scenario.target;
        if t.cloudy_frac <= 0.0 {
            return 0.0;
        }
        let mut rng = stream(self.scenario.seed, self.id(CLOUD_STREAM + k as u64), None);
        let [thin, thick] = t.cloud_range_mag;
        let cloudy = rng.random::<f64>() < t.cloudy_frac;
        let depth = thin + (thick - thin) * rng.random::<f64>();
        if cloudy { depth } else { 0.0 }
    }

    /// How far a star moves on the detector during the exposure \[px\]: against the satellite's motion among the stars,
    /// north being up and east left as in the star frames.
    fn trail_px(&self, tracker: &Tracker, mid: Epoch, exptime_s: f64) -> Result<(f64, f64)> {
        let place = |after_s: f64| -> Result<(f64, f64)> {
            let at = shifted(mid, after_s);
            let geometry = tracker.at(&at)?;
            Ok(altaz_to_icrs(tracker.site(), tracker.earth_orientation(), &at, geometry.alt_rad, geometry.az_rad))
        };
        let (ra_deg, dec_deg) = place(0.0)?;
        let north_up = Wcs::tan(ra_deg, dec_deg, 0.0, 0.0, self.scale_arcsec, 0.0, false);
        let pixel = |after_s: f64| {
            let (ra_deg, dec_deg) = place(after_s)?;
            north_up.sky_to_pixel(ra_deg, dec_deg).ok_or_else(|| Error::Orbit {
                problem: format!("the target moves more than 90 deg in {} s", 2.0 * after_s.abs()),
            })
        };
        let (before, after) = (pixel(-MOTION_S)?, pixel(MOTION_S)?);
        let per_half_step = 0.5 * exptime_s / MOTION_S;
        Ok((per_half_step * (before.0 - after.0), per_half_step * (before.1 - after.1)))
    }

    fn orbit_config(&self, elements: &Path) -> config::Orbit {
        config::Orbit {
            elements: elements.to_path_buf(),
            norad_cat_id: self.scenario.target.norad_cat_id,
            max_age_d: 14.0,
            force_age: false,
            ut1_utc_s: None,
            xp_arcsec: 0.0,
            yp_arcsec: 0.0,
        }
    }

    fn model_config(&self) -> config::Model {
        config::Model { band: self.scenario.band.clone(), ..config::Model::of(&self.scenario.target.satellite) }
    }
}
