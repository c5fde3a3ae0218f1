//! The brightness of a satellite in one scene: four lights, their sum, what was left out and why.
//!
//! Magnitudes in V, irradiances relative to a star of V = 0. Two functions make the four lights: [`direct`] and
//! [`via_earth`], each for a lamp. No atmosphere between satellite and observer, no starlight, no self-shadowing.

use std::fmt;

use super::brdf::{Brdf, EARTH_VEGETATION};
use super::catalogue::Satellite;
use super::earthshine::reflected_by_earth;
use super::ground::Ground;
use super::lamps::{mag_of_flux, moonlight, sunlight};
use super::scene::{Scene, geodetic_up, impossible, local_radius_km};
use super::shadow::{cylinder, penumbra};
use crate::config::{self, Mode};
use crate::constants::{MAG_PER_LN, MOON_RADIUS_KM, SUN_RADIUS_KM};
use crate::error::Result;
use crate::vector::{Itrs, Vector};

/// Radius of the spherical Earth of the published model \[km\] (lumos-sat).
pub const PUBLISHED_EARTH_RADIUS_KM: f64 = 6378.0;
/// Square arcseconds in a steradian.
const ARCSEC2_PER_SR: f64 = 206_264.806_247_096_36 * 206_264.806_247_096_36;

/// How the model is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelSettings {
    /// As published (cylinder shadow, sphere of 6378 km, no distances of Sun and Moon) or corrected.
    pub mode: Mode,
    /// Relative tolerance of each Earth-reflected integral, above 0 and at most 0.1.
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
        if !(self.tolerance > 0.0 && self.tolerance <= 0.1) {
            return Err(impossible(format!("tolerance = {}; accepted is above 0, at most 0.1", self.tolerance)));
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

/// A surface that shows the observer one of its sides.
struct Facet<'a> {
    name: &'a str,
    area_m2: f64,
    normal: Vector<Itrs>,
    brdf: Brdf,
    cos_observer: f64,
}

/// Sun or Moon in one scene.
struct Lamp {
    name: &'static str,
    earth_name: &'static str,
    body: &'static str,
    /// From the satellite, unit.
    toward: Vector<Itrs>,
    /// From the Earth's centre.
    geocentric: Vector<Itrs>,
    visible_frac: f64,
    unseen: &'static str,
    flux_at_satellite: f64,
    flux_at_ground: f64,
    extrapolated: bool,
}

/// Sum of a light over the surfaces, its numerical error, and the Earth integrals it took.
#[derive(Default)]
struct Sum {
    flux: f64,
    err: f64,
    quadratures: usize,
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
    let sun = sun(scene, settings.mode, radius_km)?;
    let mut skipped = Vec::new();
    if !above_horizon(scene, settings) {
        skipped.push("all: satellite below the observer's horizon".to_string());
        return Ok(assemble([0.0; 4], 0.0, &sun, Quadratures::default(), false, skipped));
    }
    let observer = unit(scene.observer_km - scene.satellite_km, "observer")?;
    let facets = facing(scene, satellite, &observer, &mut skipped)?;
    let moon = moon(scene, settings.mode, radius_km)?;
    let range_m = scene.range_km() * 1e3;
    let mut lights = Vec::with_capacity(4);
    for lamp in [&sun, &moon] {
        lights.push(direct(lamp, &facets, &observer, range_m, &mut skipped));
        lights.push(via_earth(lamp, &facets, &observer, scene, settings, range_m, &mut skipped));
    }
    let fluxes = [lights[0].flux, lights[1].flux, lights[2].flux, lights[3].flux];
    let quadratures = Quadratures { sun: lights[1].quadratures, moon: lights[3].quadratures };
    let err: f64 = lights.iter().map(|l| l.err).sum();
    let extrapolated = moon.extrapolated && fluxes[2] + fluxes[3] > 0.0;
    let mut answer = assemble(fluxes, err, &sun, quadratures, extrapolated, skipped);
    let projected_m2: f64 = match settings.mode {
        Mode::AsPublished => satellite.surfaces.iter().map(|s| s.area_m2).sum(),
        Mode::Corrected => facets.iter().map(|f| f.area_m2 * f.cos_observer).sum(),
    };
    // μ = V + 2.5 lg Ω, Ω = A/d² in arcsec²
    let omega_arcsec2 = projected_m2 / (range_m * range_m) * ARCSEC2_PER_SR;
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
    let (sun, moon) = (sun(scene, Mode::Corrected, radius_km)?, moon(scene, Mode::Corrected, radius_km)?);
    let moonlit_ground = Ground::new(&scene.satellite_km, radius_km, &moon.geocentric, EARTH_VEGETATION)
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

/// Light of a lamp scattered once by the surfaces.
///
/// `E_obs/E_lamp = ν Σ A f(s, n, o) (n·s)₊ (n·o)₊ / d²`, ν the visible share of the lamp's disc.
fn direct(lamp: &Lamp, facets: &[Facet], observer: &Vector<Itrs>, range_m: f64, skipped: &mut Vec<String>) -> Sum {
    let mut sum = Sum::default();
    if lamp.visible_frac <= 0.0 {
        skipped.push(format!("{}: {}", lamp.name, lamp.unseen));
        return sum;
    }
    for facet in facets {
        let cos_in = facet.normal.dot(&lamp.toward);
        if cos_in <= 0.0 {
            skipped.push(format!("{}: {} faces away from the {}", lamp.name, facet.name, lamp.body));
            continue;
        }
        let f_per_sr = facet.brdf.value(&lamp.toward, &facet.normal, observer);
        sum.flux += facet.area_m2 * f_per_sr * cos_in * facet.cos_observer / (range_m * range_m);
    }
    sum.flux *= lamp.visible_frac * lamp.flux_at_satellite;
    sum
}

/// Light of a lamp scattered first by the ground, then by the surfaces.
///
/// `E_obs/E_lamp = Σ A (n·o)₊ / d² · ∫ f_E (p·s)₊ f (n·w)₊ dω`. No integral is evaluated for a lamp that lights no
/// ground in view, nor for a surface that sees no ground.
fn via_earth(
    lamp: &Lamp,
    facets: &[Facet],
    observer: &Vector<Itrs>,
    scene: &Scene,
    settings: &ModelSettings,
    range_m: f64,
    skipped: &mut Vec<String>,
) -> Sum {
    let mut sum = Sum::default();
    let radius_km = settings.radius_km(&scene.satellite_km);
    let ground = Ground::new(&scene.satellite_km, radius_km, &lamp.geocentric, settings.earth);
    let Some(ground) = ground.filter(Ground::lit_in_view) else {
        skipped.push(format!("{}: no {}lit ground in view", lamp.earth_name, lamp.body.to_lowercase()));
        return sum;
    };
    for facet in facets {
        if !ground.seen_by(&facet.normal) {
            skipped.push(format!("{}: {} sees no ground", lamp.earth_name, facet.name));
            continue;
        }
        let (tolerance, max_nodes) = (settings.tolerance, settings.max_nodes);
        let light = reflected_by_earth(&ground, facet.brdf, &facet.normal, observer, tolerance, max_nodes);
        let flux = lamp.flux_at_ground * light.per_sr * facet.area_m2 * facet.cos_observer / (range_m * range_m);
        sum.flux += flux;
        sum.err += flux * light.err_rel;
        sum.quadratures += 1;
    }
    sum
}

/// The surfaces that show the observer a side that scatters.
fn facing<'a>(
    scene: &Scene,
    satellite: &'a Satellite,
    observer: &Vector<Itrs>,
    skipped: &mut Vec<String>,
) -> Result<Vec<Facet<'a>>> {
    let mut facets = Vec::with_capacity(satellite.surfaces.len());
    for s in &satellite.surfaces {
        let front = s
            .normal(scene)
            .ok_or_else(|| impossible(format!("{}: its attitude {:?} has no direction", s.name, s.attitude)))?;
        let cos_front = front.dot(observer);
        let side = if cos_front > 0.0 { Some((front, s.brdf)) } else { s.back.map(|brdf| (-front, brdf)) };
        match side.filter(|_| cos_front != 0.0) {
            Some((normal, brdf)) => {
                facets.push(Facet { name: &s.name, area_m2: s.area_m2, normal, brdf, cos_observer: cos_front.abs() });
            }
            None => skipped.push(format!("{}: faces away from the observer", s.name)),
        }
    }
    Ok(facets)
}

fn sun(scene: &Scene, mode: Mode, radius_km: f64) -> Result<Lamp> {
    let to_sun = scene.sun_km - scene.satellite_km;
    Ok(Lamp {
        name: "sun",
        earth_name: "earthshine",
        body: "Sun",
        toward: unit(to_sun, "Sun")?,
        geocentric: scene.sun_km,
        visible_frac: visible(scene, &scene.sun_km, SUN_RADIUS_KM, mode, radius_km),
        unseen: "in umbra",
        flux_at_satellite: sunlight(to_sun.norm(), mode).flux,
        flux_at_ground: sunlight(scene.sun_km.norm(), mode).flux,
        extrapolated: false,
    })
}

fn moon(scene: &Scene, mode: Mode, radius_km: f64) -> Result<Lamp> {
    let at_satellite = moonlight(&scene.satellite_km, &scene.moon_km, &scene.sun_km, mode);
    let at_ground = moonlight(&Vector::new(0.0, 0.0, 0.0), &scene.moon_km, &scene.sun_km, mode);
    Ok(Lamp {
        name: "moon",
        earth_name: "lunar_earthshine",
        body: "Moon",
        toward: unit(scene.moon_km - scene.satellite_km, "Moon")?,
        geocentric: scene.moon_km,
        visible_frac: visible(scene, &scene.moon_km, MOON_RADIUS_KM, mode, radius_km),
        unseen: "below the satellite's horizon",
        flux_at_satellite: at_satellite.flux,
        flux_at_ground: at_ground.flux,
        extrapolated: at_satellite.extrapolated || at_ground.extrapolated,
    })
}

fn visible(scene: &Scene, source_km: &Vector<Itrs>, source_radius_km: f64, mode: Mode, radius_km: f64) -> f64 {
    match mode {
        Mode::AsPublished => cylinder(&scene.satellite_km, source_km, radius_km),
        Mode::Corrected => penumbra(&scene.satellite_km, source_km, source_radius_km, radius_km),
    }
}

/// The satellite is above the plane of the observer's horizon: no refraction, no mountains.
fn above_horizon(scene: &Scene, settings: &ModelSettings) -> bool {
    let sphere = settings.earth_radius_km.is_some() || settings.mode == Mode::AsPublished;
    let up = if sphere { scene.observer_km } else { geodetic_up(&scene.observer_km) };
    (scene.satellite_km - scene.observer_km).dot(&up) > 0.0
}

fn unit(v: Vector<Itrs>, to: &str) -> Result<Vector<Itrs>> {
    v.unit().ok_or_else(|| impossible(format!("no direction from the satellite to the {to}: {:?} km", v.to_array())))
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
