//! How the model is evaluated: effects, accuracy, ground, band, which light sources shine.
//!
//! Relative tolerances, km, mag/airmass. Nothing here computes light.

use super::brdf::{Brdf, EARTH_VEGETATION};
use super::scene::{impossible, local_radius_km};
use super::spectrum::{Band, Curve};
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::config::{self, EarthRadius, Effects, Mode};

/// Radius of the spherical Earth of the published model \[km\] (lumos-sat).
pub const PUBLISHED_EARTH_RADIUS_KM: f64 = 6378.0;
/// What a tolerance is relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToleranceOf {
    /// Each light by itself, however faint compared with the others.
    #[default]
    EachLight,
    /// The sum: a faint light compared with a bright one is computed no better than the sum needs.
    Total,
}

/// How the model is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSettings {
    /// Every effect in which paper and physics differ.
    #[doc(hidden)]
    pub effects: Effects,
    /// Relative tolerance of each Earth-reflected integral, above 0 and at most 0.5.
    pub tolerance: f64,
    /// What it is relative to.
    #[doc(hidden)]
    pub tolerance_of: ToleranceOf,
    /// How the ground scatters.
    #[doc(hidden)]
    pub earth: Brdf,
    /// A sphere of this radius \[km\] instead of the effects' choice, with the observer's vertical through its centre.
    #[doc(hidden)]
    pub earth_radius_km: Option<f64>,
    /// Nodes after which one integral stops refining; its error is reported as it is then.
    #[doc(hidden)]
    pub max_nodes: usize,
    /// The pass band, and with it the magnitude system; `None` = V, Vega.
    #[doc(hidden)]
    pub band: Option<Band>,
    /// Extinction between satellite and observer \[mag/airmass\], with `effects.source = extincted`.
    pub k_mag_airmass: f64,
    /// 1-sigma error of it \[mag/airmass\], for the predictive error.
    pub k_mag_airmass_err: f64,
    /// Sunlight, direct and by way of the Earth.
    pub sun: bool,
    /// Moonlight, direct and by way of the Earth.
    pub moon: bool,
    /// Exclude what contributes nothing; `false` computes it all the same, which tests compare with and `--explain`
    /// times.
    #[doc(hidden)]
    pub leave_out: bool,
}

impl ModelSettings {
    /// The preset of a mode, a tolerance of each light, the ground vegetation, V.
    #[must_use]
    pub fn new(mode: Mode, tolerance: f64) -> Self {
        Self {
            effects: Effects::of(mode),
            tolerance,
            tolerance_of: ToleranceOf::EachLight,
            earth: EARTH_VEGETATION,
            earth_radius_km: None,
            max_nodes: 200_000,
            band: None,
            k_mag_airmass: 0.0,
            k_mag_airmass_err: 0.0,
            sun: true,
            moon: true,
            leave_out: true,
        }
    }

    /// Radius of the sphere a satellite is seen above \[km\]: published 6378 km, or the local geocentric radius under
    /// the satellite.
    #[doc(hidden)]
    #[must_use]
    pub fn radius_km(&self, satellite_km: &Vector<Itrs>) -> f64 {
        match (self.earth_radius_km, self.effects.earth_radius) {
            (Some(radius_km), _) => radius_km,
            (None, EarthRadius::Published) => PUBLISHED_EARTH_RADIUS_KM,
            (None, EarthRadius::Local) => local_radius_km(satellite_km),
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        if !(self.tolerance > 0.0 && self.tolerance <= 0.5) {
            return Err(impossible(format!("tolerance = {}; accepted is above 0, at most 0.5", self.tolerance)));
        }
        if self.earth_radius_km.is_some_and(|r| !(r > 0.0 && r.is_finite())) {
            return Err(impossible(format!("earth_radius_km = {:?}; accepted is above 0", self.earth_radius_km)));
        }
        for (name, value) in [("k_mag_airmass", self.k_mag_airmass), ("k_mag_airmass_err", self.k_mag_airmass_err)] {
            if !(0.0..=5.0).contains(&value) {
                return Err(impossible(format!("{name} = {value}; accepted is 0 to 5")));
            }
        }
        self.earth.check("earth")
    }
}

impl Default for ModelSettings {
    fn default() -> Self {
        Self::new(Mode::Corrected, 1e-4)
    }
}

impl TryFrom<&config::Model> for ModelSettings {
    type Error = Error;

    fn try_from(model: &config::Model) -> Result<Self> {
        let mut band = Band::of_config(&model.band)?;
        if let Some(path) = &model.throughput {
            if path.as_os_str().is_empty() {
                let problem = "is empty; name a file of wavelength_nm,transmission".into();
                return Err(Error::Config { key: "model.throughput".into(), problem });
            }
            band = band.through(&Curve::from_file(path)?)?;
        }
        Ok(Self {
            effects: model.resolved_effects(),
            earth: Brdf::try_from(&model.earth)?,
            band: Some(band),
            k_mag_airmass: model.k_mag_airmass.unwrap_or(0.0),
            k_mag_airmass_err: model.k_mag_airmass_err.unwrap_or(0.0),
            ..Self::new(model.mode, model.tolerance)
        })
    }
}
