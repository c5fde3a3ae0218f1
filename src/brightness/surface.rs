//! A flat surface of a satellite: how large, how held, how it scatters.
//!
//! Area in m². Not included: the shadow one surface throws on another, and light that goes from one to another.

use super::attitude::Attitude;
use super::brdf::Brdf;
use super::scene::{Scene, impossible};
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::config;

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
    /// The unit normal of the front; `None` where the attitude has no direction, see [`Attitude::normal`].
    #[must_use]
    pub fn normal(&self, scene: &Scene) -> Option<Vector<Itrs>> {
        self.attitude.normal(scene)
    }

    /// The surface under a choice for all arrays: one that tracks the Sun is held so, any other stays as it is.
    #[doc(hidden)]
    #[must_use]
    pub fn with_arrays(self, arrays: config::Arrays) -> Self {
        Surface { attitude: self.attitude.with_arrays(arrays), ..self }
    }

    /// The surface under a choice for all backs.
    #[doc(hidden)]
    #[must_use]
    pub fn with_backs(self, backs: config::Backs) -> Self {
        match backs {
            config::Backs::Black => Surface { back: None, ..self },
            config::Backs::AsListed => self,
        }
    }

    /// Refuses an area, an attitude or coefficients that make no sense.
    ///
    /// # Errors
    /// [`crate::Error::Model`] naming the surface.
    #[doc(hidden)]
    pub fn check(&self) -> Result<()> {
        if !(self.area_m2 > 0.0 && self.area_m2.is_finite()) {
            return Err(impossible(format!("{}: area_m2 = {}; accepted is above 0", self.name, self.area_m2)));
        }
        self.attitude.check(&self.name)?;
        self.brdf.check(&self.name)?;
        self.back.as_ref().map_or(Ok(()), |back| back.check(&format!("{} (back)", self.name)))
    }
}

impl TryFrom<&config::Surface> for Surface {
    type Error = Error;

    fn try_from(s: &config::Surface) -> Result<Self> {
        let back = s.back.as_ref().map(Brdf::try_from).transpose()?;
        Ok(Surface {
            name: s.name.clone(),
            area_m2: s.area_m2,
            attitude: (&s.attitude).into(),
            brdf: Brdf::try_from(&s.brdf)?,
            back,
        })
    }
}
