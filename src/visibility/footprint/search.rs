//! When the beam of a mirror comes nearest to an observer, and when it covers them.
//!
//! Times in s after the start, km, rad. The angle between beam and observer is sampled, every minimum between samples
//! refined, and its two edges bracketed and halved: a beam that crosses in less than a second is not missed between
//! steps.

use super::beam::Beam;
use super::beam::Spot;
use super::beam::glint_mag;
use super::beam::reflected;
use crate::base::constants::{MOON_RADIUS_KM, SUN_RADIUS_KM};
use crate::base::error::{Error, Result};
use crate::base::search::{Until, bisect, golden_section};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::light_sources::{SourceSettings, mag_of_flux, moonlight, sunlight};
use crate::brightness::scene::{geodetic_up, local_radius_km};
use crate::brightness::shadow::penumbra;
use crate::brightness::{Attitude, Scene};

/// Minima and edges are refined to this \[s\]: 7 m of a beam at 7 km/s.
const TIME_TOLERANCE_S: f64 = 0.001;

/// The light source whose light is sent down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightSource {
    /// The Sun.
    Sun,
    /// The Moon.
    Moon,
}

/// A stay in the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inside {
    /// First moment \[s\].
    pub from_s: f64,
    /// Last moment \[s\].
    pub to_s: f64,
    /// Magnitude at the nearest approach; `None` with the light source behind the Earth.
    pub mag: Option<f64>,
}

/// A nearest approach of the beam to the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// When \[s\].
    pub t_s: f64,
    /// Angle at the mirror between the middle of the beam and the observer \[rad\].
    pub offset_rad: f64,
    /// Distance of the observer from the middle line of the beam \[km\].
    pub miss_km: f64,
    /// Mirror to observer \[km\].
    pub range_km: f64,
    /// Altitude of the mirror above the observer's horizon \[rad\].
    pub alt_rad: f64,
    /// Share of the light source's disc that the mirror sees past the Earth.
    pub lit_frac: f64,
    /// The spot on the ground; `None` where the beam passes by the Earth.
    pub spot: Option<Spot>,
    /// The stay in the beam, lit or not; `None` if the beam misses.
    pub inside: Option<Inside>,
}

/// A mirror and its search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirror {
    /// Area \[m²\].
    pub area_m2: f64,
    /// Reflectance, 0 to 1.
    pub reflectance: f64,
    /// How it is held.
    pub attitude: Attitude,
    /// Half the divergence of its beam \[rad\]: the radius of the light source's disc.
    pub half_rad: f64,
}

/// Every nearest approach above the observer's horizon within `length_s`, in order of time.
///
/// `scene` gives the places of all bodies at a time \[s\], `step_s` is the sampling: a tenth of the time in which the
/// direction to the observer turns by a radian is enough (10 s for low orbits). An approach at either end of the search
/// is counted where the beam covers the observer there.
///
/// # Errors
/// [`Error::Model`] for a length or step that is not above 0 or makes more than 5 million samples; those of `scene`.
pub fn approaches(
    scene: &dyn Fn(f64) -> Result<Scene>,
    (light_source, mirror): (LightSource, &Mirror),
    (length_s, step_s): (f64, f64),
    light_sources: &SourceSettings,
) -> Result<Vec<Approach>> {
    let n = (length_s / step_s).ceil();
    if !(length_s > 0.0 && step_s > 0.0 && n <= 5e6) {
        let problem = format!("a search of {length_s} s in steps of {step_s} s; accepted are 1 to 5 million steps");
        return Err(Error::Model { problem });
    }
    let search = Search { scene, light_source, mirror, light_sources, length_s };
    let n = (n as usize).max(2);
    let time = |i: usize| length_s * i as f64 / n as f64;
    let nodes = (0..=n).map(|i| search.offset(time(i))).collect::<Result<Vec<f64>>>()?;
    let mut found = Vec::new();
    for i in 0..=n {
        let before = i.checked_sub(1).map_or(f64::INFINITY, |k| nodes[k]);
        let after = nodes.get(i + 1).copied().unwrap_or(f64::INFINITY);
        if nodes[i] <= before && nodes[i] < after {
            let t_s = search.minimum(time(i.saturating_sub(1)), time((i + 1).min(n)))?;
            let approach = search.approach(t_s)?;
            let at_an_end = i == 0 || i == n;
            found.extend(approach.filter(|a| !at_an_end || a.inside.is_some()));
        }
    }
    Ok(found)
}

struct Search<'a> {
    scene: &'a dyn Fn(f64) -> Result<Scene>,
    light_source: LightSource,
    mirror: &'a Mirror,
    light_sources: &'a SourceSettings,
    length_s: f64,
}

impl Search<'_> {
    fn source_km(&self, scene: &Scene) -> (Vector<Itrs>, f64) {
        match self.light_source {
            LightSource::Sun => (scene.sun_km, SUN_RADIUS_KM),
            LightSource::Moon => (scene.moon_km, MOON_RADIUS_KM),
        }
    }

    /// Normal, direction to the light source and the beam; `None` where the light source is behind the mirror.
    fn beam(&self, scene: &Scene) -> Option<(Vector<Itrs>, Vector<Itrs>, Beam)> {
        let normal = self.mirror.attitude.normal(scene)?;
        let toward_source = (self.source_km(scene).0 - scene.satellite_km).unit()?;
        let axis = reflected(&normal, &toward_source)?;
        Some((normal, toward_source, Beam { origin_km: scene.satellite_km, axis, half_rad: self.mirror.half_rad }))
    }

    /// Angle between beam and observer; π without a beam.
    fn offset(&self, t_s: f64) -> Result<f64> {
        let scene = (self.scene)(t_s)?;
        Ok(self.beam(&scene).map_or(std::f64::consts::PI, |(.., beam)| beam.offset_rad(&scene.observer_km)))
    }

    /// Golden-section search of the least offset between two times.
    fn minimum(&self, lo: f64, hi: f64) -> Result<f64> {
        let nearness = |t_s: f64| Ok::<f64, Error>(-self.offset(t_s)?);
        Ok(golden_section(lo, hi, Until::Length(TIME_TOLERANCE_S), nearness)?.0)
    }

    fn approach(&self, t_s: f64) -> Result<Option<Approach>> {
        let scene = (self.scene)(t_s)?;
        let Some((normal, toward_source, beam)) = self.beam(&scene) else { return Ok(None) };
        let line = scene.satellite_km - scene.observer_km;
        let alt_rad = std::f64::consts::FRAC_PI_2 - geodetic_up(&scene.observer_km).angle_to(&line);
        let (range_km, offset_rad) = (line.norm(), beam.offset_rad(&scene.observer_km));
        if !(alt_rad > 0.0 && range_km > 0.0) {
            return Ok(None);
        }
        let (source_km, source_radius_km) = self.source_km(&scene);
        let lit_frac =
            penumbra(&scene.satellite_km, &source_km, source_radius_km, local_radius_km(&scene.satellite_km));
        let flux = lit_frac
            * match self.light_source {
                LightSource::Sun => sunlight((source_km - scene.satellite_km).norm(), self.light_sources).flux,
                LightSource::Moon => {
                    moonlight(&scene.satellite_km, &scene.moon_km, &scene.sun_km, self.light_sources).flux
                }
            };
        let observer = line * (-1.0 / range_km);
        let mag = mag_of_flux(flux).and_then(|source_mag| {
            let Mirror { area_m2, reflectance, half_rad, .. } = *self.mirror;
            glint_mag((area_m2, reflectance), (&normal, &toward_source, &observer), range_km, half_rad, source_mag)
        });
        let inside = if offset_rad <= self.mirror.half_rad {
            Some(Inside { from_s: self.edge(t_s, -1.0)?, to_s: self.edge(t_s, 1.0)?, mag })
        } else {
            None
        };
        let miss_km = range_km * offset_rad.min(std::f64::consts::FRAC_PI_2).sin();
        Ok(Some(Approach { t_s, offset_rad, miss_km, range_km, alt_rad, lit_frac, spot: beam.spot(), inside }))
    }

    /// The edge of the beam before (−1) or after (+1) a moment inside it, or the end of the search.
    fn edge(&self, inside_s: f64, sign: f64) -> Result<f64> {
        let end = if sign < 0.0 { 0.0 } else { self.length_s };
        let (mut inside, mut stride) = (inside_s, 0.05);
        let outside = loop {
            let next = if sign < 0.0 { (inside - stride).max(end) } else { (inside + stride).min(end) };
            if self.offset(next)? > self.mirror.half_rad {
                break next;
            }
            if next == end {
                return Ok(end);
            }
            // a quarter more each time: a beam that leaves and comes back within a stride is one stay
            (inside, stride) = (next, 1.25 * stride);
        };
        let within = |t_s: f64| Ok::<bool, Error>(!(self.offset(t_s)? > self.mirror.half_rad));
        Ok(bisect(inside, outside, Until::Length(TIME_TOLERANCE_S), within)?[0])
    }
}
