//! A flat surface of a satellite: how large, how held, how it scatters.
//!
//! Area in m². Left out: joints, gimbal limits, and the shadow one surface throws on another.

use super::brdf::Brdf;
use super::scene::{Scene, impossible};
use crate::config;
use crate::error::{Error, Result};
use crate::vector::{Itrs, Vector};

/// How a surface is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Attitude {
    /// Normal to the centre of the Earth.
    Nadir,
    /// Normal to the geometric Sun, also in the shadow.
    Sun,
    /// Normal at right angles to nadir, towards the Sun's azimuth.
    SunAzimuth,
    /// Normal fixed in the Earth-fixed frame of the scene, for tests; any length but 0.
    Fixed(Vector<Itrs>),
}

/// A flat surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Name, e.g. `chassis`.
    pub name: String,
    /// Geometric area \[m²\].
    pub area_m2: f64,
    /// How it is held.
    pub attitude: Attitude,
    /// How its front scatters.
    pub brdf: Brdf,
    /// How its back scatters; `None` = black.
    pub back: Option<Brdf>,
}

impl Surface {
    /// The unit normal of the front; `None` where the attitude has no direction.
    #[must_use]
    pub fn normal(&self, scene: &Scene) -> Option<Vector<Itrs>> {
        match self.attitude {
            Attitude::Nadir => (-scene.satellite_km).unit(),
            Attitude::Sun => (scene.sun_km - scene.satellite_km).unit(),
            Attitude::SunAzimuth => {
                let up = scene.satellite_km.unit()?;
                (scene.sun_km - up * up.dot(&scene.sun_km)).unit()
            }
            Attitude::Fixed(v) => v.unit(),
        }
    }

    /// Refuses an area or coefficients that make no sense.
    ///
    /// # Errors
    /// [`crate::Error::Model`] naming the surface.
    pub fn check(&self) -> Result<()> {
        if !(self.area_m2 > 0.0 && self.area_m2.is_finite()) {
            return Err(impossible(format!("{}: area_m2 = {}; accepted is above 0", self.name, self.area_m2)));
        }
        self.brdf.check(&self.name)?;
        self.back.as_ref().map_or(Ok(()), |back| back.check(&format!("{} (back)", self.name)))
    }
}

impl TryFrom<&config::Surface> for Surface {
    type Error = Error;

    fn try_from(s: &config::Surface) -> Result<Self> {
        let attitude = match s.attitude {
            config::Attitude::Nadir => Attitude::Nadir,
            config::Attitude::Sun => Attitude::Sun,
            config::Attitude::SunAzimuth => Attitude::SunAzimuth,
            other => return Err(impossible(format!("{}: attitude {other:?} is not built yet", s.name))),
        };
        let back = s.back.as_ref().map(Brdf::try_from).transpose()?;
        Ok(Surface { name: s.name.clone(), area_m2: s.area_m2, attitude, brdf: Brdf::try_from(&s.brdf)?, back })
    }
}
