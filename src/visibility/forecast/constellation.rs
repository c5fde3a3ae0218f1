//! A constellation over one site, moment by moment: how many satellites are up, lit and brighter than given magnitudes.
//!
//! UTC, rad, km, magnitudes. Satellites stream through: memory grows neither with their number (closed-form orbits) nor with
//! the moments. A satellite below the horizon costs one product. The result is the same for any number of threads, and the
//! tallies of shards add up.

use std::io::Write;

use hifitime::Epoch;
use rayon::prelude::*;

use super::walker::Walker;
use crate::base::error::Result;
use crate::base::time::{iso_utc, seconds_between};
use crate::base::vector::{Itrs, Teme, Vector};
use crate::brightness::light_sources::mag_of_flux;
use crate::brightness::{Model, Scene, too_faint_text};
use crate::orbit::earth::{Rotation, Site, alt_az, sidereal_rad, teme_to_itrs};
use crate::orbit::{EarthOrientation, Propagator, bodies, moon_altaz, sun_altaz};

/// Groups that go through at a time: what is up of them is all that is held.
const BATCH: usize = 512;
/// Satellites of a file in one group.
const GROUP: usize = 256;

/// Where the satellites are from.
pub enum Source {
    /// Evenly placed.
    Walker(Walker),
    /// Elements of a file, with their catalogue numbers.
    Elements(Vec<(u64, Propagator)>),
}

/// What is computed of the constellation.
pub struct Watch<'a> {
    /// The observer.
    pub site: &'a Site,
    /// The type of satellite they all are.
    pub model: &'a Model,
    /// Moment of the pattern's nodes.
    pub start: Epoch,
    /// Satellites count as observable above this \[rad\].
    pub min_alt_rad: f64,
    /// Which of the satellites: number modulo the second is the first.
    pub shard: (usize, usize),
}

/// A satellite above the horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Its number in the pattern, or in the catalogue.
    pub number: u64,
    /// Altitude \[rad\].
    pub alt_rad: f64,
    /// Azimuth \[rad\].
    pub az_rad: f64,
    /// Distance \[km\].
    pub range_km: f64,
    /// Sun, earthshine, Moon, lunar earthshine, relative to a star of magnitude 0.
    pub lights: [f64; 4],
    /// Which of them are there and were not computed: they cannot change the sum by more than the tolerance.
    pub too_faint: [bool; 4],
    /// Numerical error \[mag\].
    pub err_mag: f64,
    /// 1-sigma error as a prediction \[mag\]; `None` where the model was not compared with observations.
    pub pred_err_mag: Option<f64>,
}

/// One moment of a constellation.
#[derive(Debug, Clone, Copy)]
pub struct SkyMoment {
    /// The moment.
    pub epoch: Epoch,
    /// Altitude of the Sun \[rad\].
    pub sun_alt_rad: f64,
    /// Altitude of the Moon \[rad\].
    pub moon_alt_rad: f64,
    turn: Rotation<Teme, Itrs>,
    scene: Scene,
    up: Vector<Itrs>,
}

impl Source {
    /// Satellites in all.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Source::Walker(walker) => walker.len(),
            Source::Elements(sets) => sets.len(),
        }
    }

    /// No satellite.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn groups(&self) -> usize {
        match self {
            Source::Walker(walker) => walker.planes(),
            Source::Elements(sets) => sets.len().div_ceil(GROUP),
        }
    }
}

impl Watch<'_> {
    /// Sun, Moon and the turn of the Earth at a moment.
    ///
    /// # Errors
    /// [`crate::Error::Orbit`] outside 1900-2100.
    pub fn moment(&self, epoch: &Epoch) -> Result<SkyMoment> {
        let eop = EarthOrientation::default();
        let sky = bodies(epoch, &eop)?;
        let observer_km = self.site.position();
        let scene = Scene {
            satellite_km: observer_km,
            velocity_km_s: observer_km,
            observer_km,
            sun_km: sky.sun_itrs_km,
            moon_km: sky.moon_itrs_km,
            sidereal_rad: sidereal_rad(epoch, &eop),
        };
        Ok(SkyMoment {
            epoch: *epoch,
            sun_alt_rad: sun_altaz(self.site, &sky).0,
            moon_alt_rad: moon_altaz(self.site, &sky).0,
            turn: teme_to_itrs(epoch, &eop),
            scene,
            up: self.site.from_enu(&Vector::new(0.0, 0.0, 1.0)),
        })
    }

    /// Hands every satellite above the horizon at a moment to `each`, in order; returns how many satellites were computed and
    /// how many have no place because their elements fail.
    ///
    /// # Errors
    /// As [`Model::brightness`], and those of `each`.
    pub fn for_each_above_horizon(
        &self,
        source: &Source,
        moment: &SkyMoment,
        each: &mut dyn FnMut(&Seen) -> Result<()>,
    ) -> Result<(usize, usize)> {
        let (mut n_satellites, mut failed) = (0, 0);
        for from in (0..source.groups()).step_by(BATCH) {
            let groups: Vec<Group> = (from..(from + BATCH).min(source.groups()))
                .into_par_iter()
                .with_max_len(1)
                .map(|group| self.group(source, group, moment))
                .collect::<Result<_>>()?;
            for group in groups {
                n_satellites += group.n_satellites;
                failed += group.failed;
                group.seen.iter().try_for_each(&mut *each)?;
            }
        }
        Ok((n_satellites, failed))
    }

    fn group(&self, source: &Source, number: usize, moment: &SkyMoment) -> Result<Group> {
        let mut group = Group::default();
        let (which, of) = self.shard;
        let mine = |index: usize| index % of == which;
        // (p − o)·up > 0
        let level = moment.scene.observer_km.dot(&moment.up);
        match source {
            Source::Walker(walker) => {
                let t_s = seconds_between(self.start, moment.epoch);
                let Some(plane) = walker.plane(number, t_s) else { return Ok(group) };
                let [p, q] = plane.axes.map(|axis| moment.turn.apply(&axis));
                let (p_up, q_up) = (plane.radius_km * p.dot(&moment.up), plane.radius_km * q.dot(&moment.up));
                for k in (0..plane.count).filter(|k| mine(plane.first + k)) {
                    group.n_satellites += 1;
                    let (sin_u, cos_u) = plane.argument(k);
                    if cos_u * p_up + sin_u * q_up <= level {
                        continue;
                    }
                    let place = (p * cos_u + q * sin_u) * plane.radius_km;
                    let velocity = (q * cos_u - p * sin_u) * plane.speed_km_s;
                    group.seen.push(self.seen((plane.first + k) as u64, place, velocity, moment)?);
                }
            }
            Source::Elements(sets) => {
                let from = number * GROUP;
                for (index, (norad, propagator)) in sets.iter().enumerate().skip(from).take(GROUP) {
                    if !mine(index) {
                        continue;
                    }
                    group.n_satellites += 1;
                    let Ok((place, velocity)) = propagator.state(&moment.epoch) else {
                        group.failed += 1;
                        continue;
                    };
                    let place = moment.turn.apply(&place);
                    if place.dot(&moment.up) > level {
                        group.seen.push(self.seen(*norad, place, moment.turn.apply(&velocity), moment)?);
                    }
                }
            }
        }
        Ok(group)
    }

    fn seen(&self, number: u64, place: Vector<Itrs>, velocity: Vector<Itrs>, moment: &SkyMoment) -> Result<Seen> {
        let scene = Scene { satellite_km: place, velocity_km_s: velocity, ..moment.scene };
        let line = place - moment.scene.observer_km;
        let (alt_rad, az_rad) = alt_az(&self.site.to_enu(&line));
        let mut seen = Seen {
            number,
            alt_rad,
            az_rad,
            range_km: line.norm(),
            lights: [0.0; 4],
            too_faint: [false; 4],
            err_mag: 0.0,
            pred_err_mag: None,
        };
        // what is not needed is not computed
        if alt_rad >= self.min_alt_rad {
            let b = self.model.brightness(&scene)?;
            seen.lights = b.lights().map(|light| light.flux_ratio);
            seen.too_faint = b.too_faint();
            seen.err_mag = b.err_mag;
            seen.pred_err_mag = b.v_pred_err_mag;
        }
        Ok(seen)
    }
}

/// What a group of satellites shows.
#[derive(Default)]
struct Group {
    seen: Vec<Seen>,
    n_satellites: usize,
    failed: usize,
}

impl Seen {
    /// V of all lights \[mag\].
    #[must_use]
    pub fn v_mag(&self) -> Option<f64> {
        mag_of_flux(self.lights.iter().sum())
    }

    /// Writes its line.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_csv(&self, epoch: &Epoch, out: &mut dyn Write) -> std::io::Result<()> {
        let cell = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
        let light = |k: usize| cell(mag_of_flux(self.lights[k]).filter(|_| !self.too_faint[k]));
        let [sun, earthshine, moon, lunar_earthshine] = [0, 1, 2, 3].map(light);
        let v_mag = self.v_mag();
        writeln!(
            out,
            "{},{},{:.4},{:.4},{:.3},{},{sun},{earthshine},{moon},{lunar_earthshine},{},{},{}",
            iso_utc(*epoch, 0),
            self.number,
            self.alt_rad.to_degrees(),
            self.az_rad.to_degrees(),
            self.range_km,
            cell(v_mag),
            v_mag.map_or(String::new(), |_| format!("{:.1e}", self.err_mag)),
            v_mag.and(self.pred_err_mag).map_or(String::new(), |err| format!("{err:.3}")),
            too_faint_text(&self.too_faint),
        )
    }
}
