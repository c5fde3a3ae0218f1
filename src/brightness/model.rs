//! The brightness of a satellite in one scene: four lights, their sum, what was excluded and why.
//!
//! Magnitudes in the band of the settings, irradiances relative to a star of magnitude 0. Two functions make the four
//! lights: `direct` and `earth_reflected`, each for a light source. No starlight, no self-shadowing.

use crate::base::constants::ARCSEC2_PER_SR;
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

use super::answer::{Brightness, Illum, assemble};
use super::brdf::EARTH_VEGETATION;
use super::catalogue::Satellite;
use super::flux_sum::FluxSum;
use super::ground::Ground;
use super::light_sources::flux_of_mag;
use super::lights::LightSource;
use super::lights::Lighting;
use super::lights::VisibleSurfaces;
use super::platform::Prepared;
use super::predictive::Predictive;
use super::scene::{Scene, geodetic_up, impossible, local_radius_km, source_alt_rad};
use super::settings::ModelSettings;
use super::skip::{SWITCHED_OFF, Skip};
use super::surface::Surface;
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::config::{self, EarthRadius, Effects, Empirical, Mode, MuArea, Shadow, Source};
use crate::orbit::airmass::{Atmosphere, airmass};
use crate::orbit::earth::geodetic_height_km;

/// A satellite under settings: checked once, then requested any number of scenes, from any number of threads.
///
/// A Lambertian plate that faces the Earth, in the zenith, with the Sun on the horizon, is dark to sunlight and shows
/// the Earth's light:
///
/// ```
/// use satphot::{Attitude, Brdf, Illum, Model, ModelSettings, Satellite, Scene, Surface, Vector};
///
/// let plate = Surface {
///     name: "plate".into(),
///     area_m2: 10.0,
///     attitude: Attitude::Nadir,
///     brdf: Brdf::Lambert { albedo: 0.5 },
///     back: None,
/// };
/// let model = Model::new(&Satellite::of("plate", vec![plate]), &ModelSettings::default())?;
/// let scene = Scene {
///     satellite_km: Vector::new(6928.0, 0.0, 0.0),
///     velocity_km_s: Vector::new(0.0, 7.6, 0.0),
///     observer_km: Vector::new(6378.2, 0.0, 0.0),
///     sun_km: Vector::new(1.0e7, 1.496e8, 0.0),
///     moon_km: Vector::new(-3.844e5, 0.0, 0.0),
///     sidereal_rad: 0.0,
/// };
/// let answer = model.brightness(&scene)?;
/// assert_eq!(answer.illum, Illum::Earthshine);
/// assert_eq!(answer.sun.v_mag, None);
/// assert!((answer.total_v_mag.unwrap() - answer.earthshine.v_mag.unwrap()).abs() < 1e-3);
/// # satphot::Result::Ok(())
/// ```
#[derive(Debug)]
pub struct Model {
    settings: ModelSettings,
    lighting: Lighting,
    surfaces: Vec<Prepared>,
    empirical: Option<Empirical>,
    predictive: Option<Predictive>,
    area_m2: f64,
}

impl Model {
    /// Checks surfaces, ground and settings.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for surfaces or ground that are no reflectors, and for settings out of range.
    pub fn new(satellite: &Satellite, settings: &ModelSettings) -> Result<Self> {
        settings.check()?;
        let effects = &settings.effects;
        satellite.surfaces.iter().try_for_each(Surface::check)?;
        let surfaces = satellite.clone().with_effects(effects).surfaces.into_iter().map(Prepared::new).collect();
        let area_m2 = satellite.surfaces.iter().map(|s| s.area_m2).sum();
        let lighting = Lighting::new(effects, settings.band.as_ref())?;
        let empirical = satellite.empirical.clone();
        empirical.iter().try_for_each(|law| law.check("satellite.empirical"))?;
        Ok(Self {
            settings: settings.clone(),
            lighting,
            surfaces,
            empirical,
            predictive: satellite.predictive.clone(),
            area_m2,
        })
    }

    /// The satellite and the settings of a configuration.
    ///
    /// # Errors
    /// Those of [`Satellite::from_config`] and [`Model::new`].
    #[doc(hidden)]
    pub fn from_config(model: &config::Model) -> Result<Self> {
        Self::new(&Satellite::from_config(model)?, &ModelSettings::try_from(model)?)
    }

    /// The brightness of the satellite in a scene.
    ///
    /// `E_obs/E_0 = Σ_sources E_source/E_0 · [direct + via Earth]`; ratios only, so no solar constant enters. A satellite
    /// below the observer's horizon is no error: every light is `None` and `skipped` says so.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for an impossible scene (satellite below the surface, vectors not finite).
    pub fn brightness(&self, scene: &Scene) -> Result<Brightness> {
        self.answer(scene, self.settings.leave_out)
    }

    /// The same with nothing excluded: dark ground, hidden light sources, surfaces turned away are computed too.
    ///
    /// # Errors
    /// As [`Model::brightness`].
    #[doc(hidden)]
    pub fn exhaustive_brightness(&self, scene: &Scene) -> Result<Brightness> {
        self.answer(scene, false)
    }

    fn answer(&self, scene: &Scene, leave_out: bool) -> Result<Brightness> {
        let settings = &self.settings;
        let radius_km = settings.radius_km(&scene.satellite_km);
        scene.check(radius_km)?;
        let mut skipped = Vec::new();
        let sun = LightSource::sun(scene, &self.lighting, radius_km);
        let up = above_horizon(scene, settings);
        if !up && leave_out {
            skipped.push(Skip::light("all", "satellite below the observer's horizon"));
            return Ok(assemble(&<[FluxSum; 4]>::default(), settings.tolerance, &sun, false, skipped));
        }
        let stage = VisibleSurfaces::new(scene, (&self.surfaces, &self.lighting), settings, !leave_out, &mut skipped)?;
        let mut lights = <[FluxSum; 4]>::default();
        let moon = settings.moon.then(|| LightSource::moon(scene, &self.lighting, radius_km));
        let sun_source = settings.sun.then_some(&sun);
        for (k, (light_source, name)) in [(sun_source, "sun"), (moon.as_ref(), "moon")].into_iter().enumerate() {
            match light_source {
                Some(light_source) => {
                    lights[2 * k] = match &self.empirical {
                        Some(empirical) => empirical.direct(scene, light_source, &mut skipped),
                        None => stage.direct(light_source, &mut skipped),
                    }
                }
                None => skipped.push(Skip::light(name, SWITCHED_OFF)),
            }
        }
        for (k, light_source) in [sun_source, moon.as_ref()].into_iter().enumerate() {
            let other_lights_flux = lights.iter().map(|l| l.flux).sum();
            if let Some(light_source) = light_source {
                if self.empirical.is_some() {
                    skipped.push(Skip::light(light_source.earth_name, "is part of the light of an empirical model"));
                    continue;
                }
                lights[2 * k + 1] = stage.earth_reflected(light_source, other_lights_flux, &mut skipped);
            }
        }
        let (dimming, airmass) = if up { self.extinction(scene)? } else { (0.0, 0.0) };
        for light in &mut lights {
            light.flux *= dimming;
            light.err *= dimming;
            light.skipped *= dimming;
        }
        let extrapolated = moon.is_some_and(|m| m.extrapolated) && lights[2].flux + lights[3].flux > 0.0;
        let mut answer = assemble(&lights, settings.tolerance, &sun, extrapolated, skipped);
        if let Some(predictive) = self.predictive.as_ref().filter(|_| answer.total_v_mag.is_some()) {
            let shares = self.shares(scene, predictive.surfaces(), lights.iter().map(|l| l.flux).sum(), dimming)?;
            let phase_rad = (scene.sun_km - scene.satellite_km).angle_to(&(scene.observer_km - scene.satellite_km));
            let sun_alt_sat_rad = source_alt_rad(&scene.satellite_km, &scene.sun_km);
            let extinction_err_mag = settings.k_mag_airmass_err * airmass;
            answer.v_pred_err_mag = Some(predictive.err_mag([phase_rad, sun_alt_sat_rad], &shares, extinction_err_mag));
        }
        answer.lit_array_cos = self.lit_array_cos(scene, sun.visible_frac);
        let area_m2 = match settings.effects.mu_area {
            MuArea::Total => self.area_m2,
            MuArea::Projected => stage.projected_area_m2(),
        };
        // μ = m + 2.5 lg Ω, Ω = A/d² in arcsec²
        let omega_arcsec2 = area_m2 / (scene.range_km() * 1e3).powi(2) * ARCSEC2_PER_SR;
        // of an empirical model no area is known
        let known = omega_arcsec2 > 0.0;
        answer.mu_mean_mag_arcsec2 = answer.total_v_mag.filter(|_| known).map(|v| v + 2.5 * omega_arcsec2.log10());
        Ok(answer)
    }

    /// The light that a piece which was excluded from a scene sends, computed all the same: the flux relative to a star of
    /// magnitude 0, before extinction. 0 unless it was excluded by choice.
    ///
    /// # Errors
    /// As [`Model::brightness`].
    #[doc(hidden)]
    pub fn skipped_flux(&self, scene: &Scene, skip: &Skip) -> Result<f64> {
        let radius_km = self.settings.radius_km(&scene.satellite_km);
        scene.check(radius_km)?;
        let mut stage =
            VisibleSurfaces::new(scene, (&self.surfaces, &self.lighting), &self.settings, true, &mut Vec::new())?;
        if let Some(name) = &skip.surface {
            stage.only(name);
        }
        let wanted = |name: &str| skip.light == "all" || skip.light == name;
        let mut flux = 0.0;
        for light_source in
            [LightSource::sun, LightSource::moon].map(|light_source| light_source(scene, &self.lighting, radius_km))
        {
            if wanted(light_source.name) {
                flux += stage.direct(&light_source, &mut Vec::new()).flux;
            }
            if wanted(light_source.earth_name) || (wanted(light_source.name) && skip.is_choice()) {
                flux += stage.earth_reflected(&light_source, 0.0, &mut Vec::new()).flux;
            }
        }
        Ok(if above_horizon(scene, &self.settings) { flux } else { 0.0 * flux })
    }

    /// Area of all surfaces \[m²\]; `None` of a model without any.
    #[must_use]
    pub fn area_m2(&self) -> Option<f64> {
        Some(self.area_m2).filter(|a| *a > 0.0)
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    /// n·o of the Sun-tracking front that the observer sees best, 0 where n·s or n·o is not above 0.
    fn lit_array_cos(&self, scene: &Scene, sun_visible_frac: f64) -> Option<f64> {
        let towards = |place: Vector<Itrs>| (place - scene.satellite_km).unit();
        let (observer, sun) = (towards(scene.observer_km)?, towards(scene.sun_km)?);
        let arrays = self.surfaces.iter().filter(|s| s.surface.attitude.tracks_sun());
        let cos = arrays.filter_map(|s| s.surface.attitude.normal(scene)).map(|normal| {
            let lit = sun_visible_frac > 0.0 && normal.dot(&sun) > 0.0;
            if lit { normal.dot(&observer).max(0.0) } else { 0.0 }
        });
        cos.reduce(f64::max)
    }

    /// The share of the light of all that each of these surfaces sends.
    fn shares(&self, scene: &Scene, surfaces: &[String], total_flux: f64, dimming: f64) -> Result<Vec<f64>> {
        let settings = &self.settings;
        let radius_km = settings.radius_km(&scene.satellite_km);
        let sources = [
            settings.sun.then(|| LightSource::sun(scene, &self.lighting, radius_km)),
            settings.moon.then(|| LightSource::moon(scene, &self.lighting, radius_km)),
        ];
        let of = |name: &String| -> Result<f64> {
            let skipped = &mut Vec::new();
            let mut stage = VisibleSurfaces::new(scene, (&self.surfaces, &self.lighting), settings, false, skipped)?;
            stage.only(name);
            let light = |source: &LightSource| {
                // the others' light bounds what matters of it
                let direct = stage.direct(source, &mut Vec::new()).flux;
                direct + stage.earth_reflected(source, total_flux / dimming, &mut Vec::new()).flux
            };
            Ok(sources.iter().flatten().map(light).sum::<f64>() * dimming / total_flux)
        };
        surfaces.iter().map(of).collect()
    }

    /// 10^(−0.4 k X), X the airmass of the satellite, and X; 1 and 0 unless the source is extincted.
    fn extinction(&self, scene: &Scene) -> Result<(f64, f64)> {
        if self.settings.effects.source != Source::Extincted {
            return Ok((1.0, 0.0));
        }
        let up = vertical(scene, &self.settings);
        let alt_rad = FRAC_PI_2 - up.angle_to(&(scene.satellite_km - scene.observer_km));
        let airmass = airmass(alt_rad, &atmosphere(scene, &self.settings))
            .ok_or_else(|| impossible("extinction below the horizon".into()))?;
        Ok((flux_of_mag(self.settings.k_mag_airmass * airmass), airmass))
    }
}

/// The brightness of a satellite in one scene; [`Model`] is for many.
///
/// # Errors
/// Those of [`Model::new`] and [`Model::brightness`].
pub fn brightness(scene: &Scene, satellite: &Satellite, settings: &ModelSettings) -> Result<Brightness> {
    Model::new(satellite, settings)?.brightness(scene)
}

/// Which light source reaches a satellite, from geometry alone in corrected mode: Sun, penumbra, Moon, moonlit ground,
/// none.
///
/// The order is that of the irradiance at the satellite; which light a given satellite sends to a given observer is
/// [`Brightness::illum`]. Outside the penumbra no sunlit ground is in view, so earthshine never comes first here.
///
/// # Errors
/// [`crate::Error::Model`] for an impossible scene.
pub fn light_class(scene: &Scene) -> Result<Illum> {
    let radius_km = local_radius_km(&scene.satellite_km);
    scene.check(radius_km)?;
    static LIGHTING: LazyLock<Result<Lighting>> =
        LazyLock::new(|| Lighting::new(&Effects { shadow: Shadow::Penumbra, ..Effects::of(Mode::Corrected) }, None));
    let lighting = LIGHTING.as_ref().map_err(|e| impossible(e.to_string()))?;
    let (sun, moon) = (LightSource::sun(scene, lighting, radius_km), LightSource::moon(scene, lighting, radius_km));
    let moonlit_ground = moon
        .over_ground(lighting, radius_km)
        .and_then(|moon| Ground::under_moon(&scene.satellite_km, radius_km, &moon, &EARTH_VEGETATION))
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
    (scene.satellite_km - scene.observer_km).dot(&vertical(scene, settings)) > 0.0
}

/// The standard atmosphere at the observer's height above the ellipsoid; a sphere has no heights: at sea level.
fn atmosphere(scene: &Scene, settings: &ModelSettings) -> Atmosphere {
    let sphere = settings.earth_radius_km.is_some() || settings.effects.earth_radius == EarthRadius::Published;
    let height_km = if sphere { None } else { geodetic_height_km(&scene.observer_km) };
    Atmosphere::at_height_m(1_000.0 * height_km.unwrap_or(0.0))
}

/// The observer's vertical: through the centre of a sphere, or the ellipsoid's.
fn vertical(scene: &Scene, settings: &ModelSettings) -> Vector<Itrs> {
    let sphere = settings.earth_radius_km.is_some() || settings.effects.earth_radius == EarthRadius::Published;
    if sphere { scene.observer_km } else { geodetic_up(&scene.observer_km) }
}
