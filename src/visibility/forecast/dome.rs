//! A type of satellite all over one site's sky: the light sources of a moment, and the light in any direction.
//!
//! Angles in rad, km. The observer stands on the sphere of the Earth, the satellites on a concentric one. What a moment
//! does not need is decided before any direction is computed: a light source below everything is switched off for the
//! whole sky.

use hifitime::Epoch;

use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::scene::local_radius_km;
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::sky::{Body, Sky};
use crate::brightness::{Brightness, Model, ModelSettings, Satellite};
use crate::config::EarthRadius;
use crate::orbit::earth::{Site, alt_az, sidereal_rad};
use crate::orbit::propagate::DECAYED_BELOW_KM;
use crate::orbit::sky::topocentric;
use crate::orbit::{EarthOrientation, bodies};

/// How far past the geometric edge the air and the light sources' discs carry light, twice what they do \[rad\].
const EDGE_RAD: f64 = 0.035;
/// Highest orbits \[km\].
const HIGHEST_KM: f64 = 1e6;

/// Sun and Moon over a site at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Overhead {
    /// The moment.
    pub epoch: Epoch,
    /// The Sun.
    pub sun: Body,
    /// The Moon.
    pub moon: Body,
    /// Angle Sun-Moon-observer, 0 = full \[rad\].
    pub moon_phase_rad: f64,
    /// Sidereal time at Greenwich \[rad\].
    pub sidereal_rad: f64,
}

impl Overhead {
    /// By the ephemeris.
    ///
    /// # Errors
    /// [`Error::Orbit`] outside 1900-2100.
    pub fn at(site: &Site, epoch: &Epoch) -> Result<Self> {
        let eop = EarthOrientation::default();
        let seen = bodies(epoch, &eop)?;
        let body = |v: &Vector<Itrs>| {
            let from_site = topocentric(site, v);
            let (alt_rad, az_rad) = alt_az(&site.to_enu(&from_site));
            Body { alt_rad, az_rad, distance_km: from_site.norm() }
        };
        let to_sun = seen.sun_itrs_km - seen.moon_itrs_km;
        Ok(Self {
            epoch: *epoch,
            sun: body(&seen.sun_itrs_km),
            moon: body(&seen.moon_itrs_km),
            moon_phase_rad: to_sun.angle_to(&(site.position() - seen.moon_itrs_km)),
            sidereal_rad: sidereal_rad(epoch, &eop),
        })
    }
}

/// Satellites of one type at one height over one site.
#[derive(Debug)]
pub struct Dome {
    axes: [Vector<Itrs>; 3],
    radius_km: f64,
    height_km: f64,
    track_az_rad: f64,
    all: Model,
    sun_alone: Model,
    moon_alone: Model,
}

/// The dome at one moment.
#[derive(Debug)]
pub struct Moment<'a> {
    sky: Sky,
    model: Option<&'a Model>,
    /// What was excluded for the whole sky, and why.
    pub skipped: Vec<String>,
}

impl Dome {
    /// A satellite at a height; `track_az_rad` is the azimuth in which the satellites move.
    ///
    /// # Errors
    /// [`Error::Config`] for a height at which nothing stays in orbit; those of [`Model::new`].
    pub fn new(
        site: &Site,
        satellite: &Satellite,
        settings: &ModelSettings,
        height_km: f64,
        track_az_rad: f64,
    ) -> Result<Self> {
        if !(DECAYED_BELOW_KM..=HIGHEST_KM).contains(&height_km) {
            let problem = format!(
                "{height_km} km: accepted is {DECAYED_BELOW_KM} to {HIGHEST_KM} km; lower down nothing stays in orbit"
            );
            return Err(Error::Argument { name: "height_km".into(), problem });
        }
        let radius_km = match settings.effects.earth_radius {
            EarthRadius::Local => local_radius_km(&site.position()),
            EarthRadius::Published => PUBLISHED_EARTH_RADIUS_KM,
        };
        let model = |sun: bool, moon: bool| {
            let settings = ModelSettings {
                earth_radius_km: Some(radius_km),
                sun: sun && settings.sun,
                moon: moon && settings.moon,
                ..settings.clone()
            };
            Model::new(satellite, &settings)
        };
        let axes = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];
        Ok(Self {
            axes: axes.map(|e| site.from_enu(&e)),
            radius_km,
            height_km,
            track_az_rad,
            all: model(true, true)?,
            sun_alone: model(true, false)?,
            moon_alone: model(false, true)?,
        })
    }

    /// Height of the orbits above the sphere of the Earth \[km\].
    #[must_use]
    pub fn height_km(&self) -> f64 {
        self.height_km
    }

    /// The sky of a moment.
    ///
    /// # Errors
    /// As [`Sky::new`].
    pub fn under(&self, overhead: &Overhead) -> Result<Moment<'_>> {
        let size = (self.radius_km, self.height_km);
        let mut sky = Sky::new(self.axes, size, self.track_az_rad, overhead.sun, Some(overhead.moon))?;
        sky.sidereal_rad = overhead.sidereal_rad;
        let mut skipped = Vec::new();
        let mut reaches = |name: &str, body: &Body| {
            let reaches = self.is_reached_by(body);
            if !reaches {
                let alt_deg = body.alt_rad.to_degrees();
                skipped.push(format!(
                    "{name}: at {alt_deg:.1} deg it reaches no satellite in view and no ground they see"
                ));
            }
            reaches
        };
        let model = match (reaches("sun", &overhead.sun), reaches("moon", &overhead.moon)) {
            (true, true) => Some(&self.all),
            (true, false) => Some(&self.sun_alone),
            (false, true) => Some(&self.moon_alone),
            (false, false) => None,
        };
        Ok(Moment { sky, model, skipped })
    }

    /// A light source lights some satellite in view, or some ground that one sees.
    ///
    /// The satellites in view are within θ = arccos(R/r) of the observer, the ground they see within as much again: a
    /// light source lower than −2θ, seen from the Earth's centre, reaches neither.
    fn is_reached_by(&self, body: &Body) -> bool {
        let (sin_a, cos_a) = body.alt_rad.sin_cos();
        let elevation_rad = (self.radius_km + body.distance_km * sin_a).atan2(body.distance_km * cos_a);
        let theta_rad = (self.radius_km / (self.radius_km + self.height_km)).acos();
        elevation_rad > -2.0 * theta_rad - EDGE_RAD
    }
}

impl Moment<'_> {
    /// The light of a satellite in a direction \[rad\]; `None` where no light source reaches anything.
    ///
    /// # Errors
    /// As [`Model::brightness`].
    pub fn toward(&self, alt_rad: f64, az_rad: f64) -> Result<Option<Brightness>> {
        self.model.map(|model| model.brightness(&self.sky.scene(alt_rad, az_rad))).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::{parse_utc, shifted};
    use crate::brightness::sky_points::SkyPoints;
    use crate::config::{Mode, Sampling};

    #[test]
    fn a_light_source_switched_off_for_the_whole_sky_would_have_given_nothing() {
        let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
        let points = SkyPoints::new(60, Sampling::SolidAngle, None).unwrap();
        let (mut switched_off, mut compared) = (0, 0);
        for mode in [Mode::Corrected, Mode::AsPublished] {
            let settings = ModelSettings::new(mode, 1e-3);
            let dome = Dome::new(&site, &Satellite::named("bluebird-fm1").unwrap(), &settings, 520.0, 1.0).unwrap();
            // from full Moon to new Moon, at all hours
            for k in 0..24 {
                let epoch = shifted(parse_utc("t", "2025-06-11T00:00:00").unwrap(), 3600.0 * 13.3 * f64::from(k));
                let moment = dome.under(&Overhead::at(&site, &epoch).unwrap()).unwrap();
                switched_off += moment.skipped.len();
                for (alt, az) in &points.directions {
                    let whole = dome.all.brightness(&moment.sky.scene(*alt, *az)).unwrap();
                    let here = moment.toward(*alt, *az).unwrap().and_then(|b| b.total_v_mag);
                    assert_eq!(whole.total_v_mag, here, "{epoch} {alt} {az}");
                    compared += 1;
                }
            }
        }
        // not for want of light sources that are switched off
        assert!(switched_off > 10 && compared > 2000, "{switched_off} {compared}");
    }

    #[test]
    fn an_orbit_in_the_air_is_refused_with_its_height() {
        let site = Site::new(0.0, 0.0, 0.0).unwrap();
        let satellite = Satellite::named("iss").unwrap();
        for height_km in [99.0, f64::NAN, -1.0, 2e6] {
            let refusal = Dome::new(&site, &satellite, &ModelSettings::default(), height_km, 0.0).unwrap_err();
            assert!(refusal.to_string().contains("`height_km`"), "{refusal}");
        }
    }
}
