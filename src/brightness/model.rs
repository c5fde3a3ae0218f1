//! The brightness of a satellite in one scene: four lights, their sum, what was left out and why.
//!
//! Magnitudes in V, irradiances relative to a star of V = 0. Two functions make the four lights: `direct` and
//! `via_earth`, each for a lamp. No atmosphere between satellite and observer, no starlight, no self-shadowing.

use std::fmt;

use super::brdf::{Brdf, EARTH_VEGETATION};
use super::catalogue::Satellite;
use super::ground::Ground;
use super::lamps::mag_of_flux;
use super::lights::{Lamp, Stage};
use super::scene::{Scene, geodetic_up, impossible, local_radius_km};
use crate::config::{self, Mode};
use crate::constants::MAG_PER_LN;
use crate::error::Result;
use crate::vector::{Itrs, Vector};

/// Radius of the spherical Earth of the published model \[km\] (lumos-sat).
pub const PUBLISHED_EARTH_RADIUS_KM: f64 = 6378.0;
/// Square arcseconds in a steradian.
const ARCSEC2_PER_SR: f64 = 206_264.806_247_096_36 * 206_264.806_247_096_36;

/// How the model is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSettings {
    /// As published (cylinder shadow, sphere of 6378 km, no distances of Sun and Moon) or corrected.
    pub mode: Mode,
    /// Relative tolerance of each Earth-reflected integral, above 0 and at most 0.5.
    pub tolerance: f64,
    /// How the ground scatters.
    pub earth: Brdf,
    /// A sphere of this radius \[km\] instead of the mode's own choice, with the observer's vertical through its centre.
    pub earth_radius_km: Option<f64>,
    /// Nodes after which one integral stops refining; its error is reported as it is then.
    pub max_nodes: usize,
}

impl ModelSettings {
    /// A mode and a tolerance, the ground vegetation.
    #[must_use]
    pub fn new(mode: Mode, tolerance: f64) -> Self {
        Self { mode, tolerance, earth: EARTH_VEGETATION, earth_radius_km: None, max_nodes: 200_000 }
    }

    /// Radius of the sphere a satellite is seen above \[km\]: published 6378 km, corrected the local geocentric radius
    /// under the satellite.
    #[must_use]
    pub fn radius_km(&self, satellite_km: &Vector<Itrs>) -> f64 {
        match (self.earth_radius_km, self.mode) {
            (Some(radius_km), _) => radius_km,
            (None, Mode::AsPublished) => PUBLISHED_EARTH_RADIUS_KM,
            (None, Mode::Corrected) => local_radius_km(satellite_km),
        }
    }

    fn check(&self) -> Result<()> {
        if !(self.tolerance > 0.0 && self.tolerance <= 0.5) {
            return Err(impossible(format!("tolerance = {}; accepted is above 0, at most 0.5", self.tolerance)));
        }
        if self.earth_radius_km.is_some_and(|r| !(r > 0.0 && r.is_finite())) {
            return Err(impossible(format!("earth_radius_km = {:?}; accepted is above 0", self.earth_radius_km)));
        }
        self.earth.check("earth")
    }
}

impl Default for ModelSettings {
    fn default() -> Self {
        Self::new(Mode::Corrected, 1e-4)
    }
}

impl From<&config::Model> for ModelSettings {
    fn from(model: &config::Model) -> Self {
        Self::new(model.mode, model.tolerance)
    }
}

/// One of the four lights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Light {
    /// V; `None` = no light.
    pub v_mag: Option<f64>,
    /// Irradiance at the observer relative to a star of V = 0.
    pub flux_ratio: f64,
}

impl Light {
    fn of(flux_ratio: f64) -> Self {
        Self { v_mag: mag_of_flux(flux_ratio), flux_ratio }
    }
}

/// What lights a satellite most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Illum {
    /// The whole Sun.
    Sun,
    /// The Sun, partly behind the Earth.
    Penumbra,
    /// The Moon.
    Moon,
    /// Moonlight from the Earth.
    LunarEarthshine,
    /// Sunlight from the Earth.
    Earthshine,
    /// Nothing.
    None,
}

impl fmt::Display for Illum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Illum::Sun => "sun",
            Illum::Penumbra => "penumbra",
            Illum::Moon => "moon",
            Illum::LunarEarthshine => "lunar_earthshine",
            Illum::Earthshine => "earthshine",
            Illum::None => "none",
        })
    }
}

/// How many Earth integrals (one per surface) were really evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Quadratures {
    /// For sunlight.
    pub sun: usize,
    /// For moonlight.
    pub moon: usize,
}

/// The model's answer for one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Brightness {
    /// Sunlight.
    pub sun: Light,
    /// Sunlight by way of the Earth.
    pub earthshine: Light,
    /// Moonlight.
    pub moon: Light,
    /// Moonlight by way of the Earth.
    pub lunar_earthshine: Light,
    /// V of all four together; `None` = no light, or the observer cannot see the satellite.
    pub total_v_mag: Option<f64>,
    /// The largest light; [`Illum::Penumbra`] when that is a partly covered Sun.
    pub illum: Illum,
    /// Share of the Sun's disc the satellite sees.
    pub sun_visible_frac: f64,
    /// Estimated numerical error of the total \[mag\]; says nothing about the model's truth.
    pub err_mag: f64,
    /// What was left out, and why.
    pub skipped: Vec<String>,
    /// Earth integrals really evaluated.
    pub quadratures: Quadratures,
    /// Moonlight was asked for beyond 150° of phase.
    pub extrapolated: bool,
    /// Mean V surface brightness \[mag/arcsec²\] over the projected area (corrected) or the whole area (as published).
    pub mu_mean_mag_arcsec2: Option<f64>,
}

/// The brightness of a satellite.
///
/// `E_obs/E_V0 = Σ_lamps E_lamp/E_V0 · [direct + via Earth]`; ratios only, so no solar constant enters. A satellite
/// below the observer's horizon is no error: every light is `None` and `skipped` says so.
///
/// # Errors
/// [`crate::Error::Model`] for an impossible scene (satellite below the surface, vectors not finite), for surfaces or
/// ground that are no reflectors, and for settings out of range.
pub fn brightness(scene: &Scene, satellite: &Satellite, settings: &ModelSettings) -> Result<Brightness> {
    settings.check()?;
    satellite.surfaces.iter().try_for_each(super::surface::Surface::check)?;
    let radius_km = settings.radius_km(&scene.satellite_km);
    scene.check(radius_km)?;
    let sun = Lamp::sun(scene, settings.mode, radius_km)?;
    let mut skipped = Vec::new();
    if !above_horizon(scene, settings) {
        skipped.push("all: satellite below the observer's horizon".to_string());
        return Ok(assemble([0.0; 4], 0.0, &sun, Quadratures::default(), false, skipped));
    }
    let moon = Lamp::moon(scene, settings.mode, radius_km)?;
    let stage = Stage::new(scene, satellite, settings, &mut skipped)?;
    let lights = [
        stage.direct(&sun, &mut skipped),
        stage.via_earth(&sun, &mut skipped),
        stage.direct(&moon, &mut skipped),
        stage.via_earth(&moon, &mut skipped),
    ];
    let fluxes = lights.each_ref().map(|l| l.flux);
    let err: f64 = lights.iter().map(|l| l.err).sum();
    let quadratures = Quadratures { sun: lights[1].quadratures, moon: lights[3].quadratures };
    let extrapolated = moon.extrapolated && fluxes[2] + fluxes[3] > 0.0;
    let mut answer = assemble(fluxes, err, &sun, quadratures, extrapolated, skipped);
    let area_m2: f64 = match settings.mode {
        Mode::AsPublished => satellite.surfaces.iter().map(|s| s.area_m2).sum(),
        Mode::Corrected => stage.facets.iter().map(|f| f.area_m2 * f.cos_observer).sum(),
    };
    // μ = V + 2.5 lg Ω, Ω = A/d² in arcsec²
    let omega_arcsec2 = area_m2 / (scene.range_km() * 1e3).powi(2) * ARCSEC2_PER_SR;
    answer.mu_mean_mag_arcsec2 = answer.total_v_mag.map(|v| v + 2.5 * omega_arcsec2.log10());
    Ok(answer)
}

/// Which lamp reaches a satellite, from geometry alone in corrected mode: Sun, penumbra, Moon, moonlit ground, none.
///
/// The order is that of the irradiance at the satellite; which light a given satellite sends to a given observer is
/// [`Brightness::illum`]. Outside the penumbra no sunlit ground is in view, so earthshine never comes first here.
///
/// # Errors
/// [`crate::Error::Model`] for an impossible scene.
pub fn light_class(scene: &Scene) -> Result<Illum> {
    let radius_km = local_radius_km(&scene.satellite_km);
    scene.check(radius_km)?;
    let (sun, moon) = (Lamp::sun(scene, Mode::Corrected, radius_km)?, Lamp::moon(scene, Mode::Corrected, radius_km)?);
    let moonlit_ground = Ground::new(&scene.satellite_km, radius_km, &moon.geocentric, &EARTH_VEGETATION)
        .is_some_and(|ground| ground.lit_in_view());
    Ok(if sun.visible_frac >= 1.0 {
        Illum::Sun
    } else if sun.visible_frac > 0.0 {
        Illum::Penumbra
    } else if moon.visible_frac > 0.0 && moon.flux_at_satellite > 0.0 {
        Illum::Moon
    } else if moonlit_ground && moon.flux_at_ground > 0.0 {
        Illum::LunarEarthshine
    } else {
        Illum::None
    })
}

/// The satellite is above the plane of the observer's horizon: no refraction, no mountains.
fn above_horizon(scene: &Scene, settings: &ModelSettings) -> bool {
    let sphere = settings.earth_radius_km.is_some() || settings.mode == Mode::AsPublished;
    let up = if sphere { scene.observer_km } else { geodetic_up(&scene.observer_km) };
    (scene.satellite_km - scene.observer_km).dot(&up) > 0.0
}

/// The answer from the four fluxes: Sun, earthshine, Moon, lunar earthshine.
fn assemble(
    fluxes: [f64; 4],
    err: f64,
    sun: &Lamp,
    quadratures: Quadratures,
    extrapolated: bool,
    skipped: Vec<String>,
) -> Brightness {
    let total: f64 = fluxes.iter().sum();
    let direct_sun = if sun.visible_frac < 1.0 { Illum::Penumbra } else { Illum::Sun };
    let classes = [direct_sun, Illum::Earthshine, Illum::Moon, Illum::LunarEarthshine];
    let (illum, _) = classes
        .into_iter()
        .zip(fluxes)
        .fold((Illum::None, 0.0), |largest, light| if light.1 > largest.1 { light } else { largest });
    Brightness {
        sun: Light::of(fluxes[0]),
        earthshine: Light::of(fluxes[1]),
        moon: Light::of(fluxes[2]),
        lunar_earthshine: Light::of(fluxes[3]),
        total_v_mag: mag_of_flux(total),
        illum,
        sun_visible_frac: sun.visible_frac,
        err_mag: if total > 0.0 { MAG_PER_LN * err / total } else { 0.0 },
        skipped,
        quadratures,
        extrapolated,
        mu_mean_mag_arcsec2: None,
    }
}
