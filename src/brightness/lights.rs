//! The two ways of light, [`VisibleSurfaces::direct`] and [`VisibleSurfaces::earth_reflected`], and the two light sources
//! that go them.
//!
//! Irradiances relative to a star of magnitude 0, areas in m², range in m. What a scene does not need is not computed,
//! and the reason is written down. Not included: light scattered from one surface to another.

use super::flux_sum::FluxSum;
use std::f64::consts::PI;

use super::brdf::{Brdf, direct_reflection, mirror_reflection};
use super::earthshine::{Accuracy, plain};
use super::ground::Ground;
use super::light_sources::{NearMoon, SourceSettings, moonlight, sunlight};
use super::platform::{Prepared, Side, SurfaceElement, View};
use super::scene::Scene;
use super::settings::{ModelSettings, ToleranceOf};
use super::shadow::{Colour, lit_fraction};
use super::skip::{Skip, TOO_FAINT};
use super::spectrum::Band;
use crate::base::constants::{MOON_RADIUS_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::config::{Effects, Shadow, SourceDisc};

/// Share of the tolerance of a sum that what is skipped of one light may take.
const SKIPPED_SHARE: f64 = 0.25;

/// Sun or Moon in one scene.
pub(super) struct LightSource {
    pub name: &'static str,
    pub earth_name: &'static str,
    /// From the Earth's centre \[km\].
    pub position_km: Vector<Itrs>,
    /// Angular radius of its disc \[rad\].
    pub disc_rad: f64,
    /// Share of its light that reaches the satellite.
    pub visible_frac: f64,
    pub flux_at_satellite: f64,
    /// As at the Earth's centre.
    pub flux_at_ground: f64,
    /// The Sun, for a light source that every place on the ground sees for itself \[km\].
    sun_of_patches_km: Option<Vector<Itrs>>,
    pub extrapolated: bool,
    words: Words,
}

/// How the reasons are worded.
struct Words {
    hidden: &'static str,
    facing_away: &'static str,
    no_lit_ground: &'static str,
}

/// How the light sources shine and how the Earth's shadow takes them away.
#[derive(Debug)]
pub(super) struct Lighting {
    light_sources: SourceSettings,
    shadow: Shadow,
    colour: Colour,
}

/// One satellite before one observer: all that both ways of light have in common.
pub(super) struct VisibleSurfaces<'a> {
    settings: &'a ModelSettings,
    lighting: &'a Lighting,
    pub radius_km: f64,
    plates: Vec<SurfaceElement<'a>>,
    /// What contributes nothing is computed all the same.
    exhaustive: bool,
}

impl<'a> VisibleSurfaces<'a> {
    /// The surfaces that show the observer a side that scatters; the others go to `skipped`, unless `exhaustive` is
    /// wanted.
    pub fn new(
        scene: &Scene,
        (surfaces, lighting): (&'a [Prepared], &'a Lighting),
        settings: &'a ModelSettings,
        exhaustive: bool,
        skipped: &mut Vec<Skip>,
    ) -> Result<Self> {
        let radius_km = settings.radius_km(&scene.satellite_km);
        let mut plates = Vec::with_capacity(surfaces.len());
        for prepared in surfaces {
            let plate = SurfaceElement::new(scene, prepared, settings.effects.platform_size)?;
            if exhaustive || plate.shows_a_side() {
                plates.push(plate);
            } else {
                skipped.push(Skip::surface("all", &prepared.name, "faces away from the observer"));
            }
        }
        Ok(Self { settings, lighting, radius_km, plates, exhaustive })
    }

    /// Nothing but the surface of this name.
    pub fn only(&mut self, name: &str) {
        self.plates.retain(|plate| &**plate.name() == name);
    }

    /// The side of a plate that a view sees.
    fn side(&self, plate: &SurfaceElement<'a>, view: &View) -> Option<Side<'a>> {
        if self.exhaustive { Some(plate.any_side(view)) } else { plate.side(view) }
    }

    /// Area the observer sees, Σ A |n·o| \[m²\].
    pub fn projected_area_m2(&self) -> f64 {
        let shown = self.plates.iter().filter(|p| p.shows_a_side());
        shown.map(|p| p.area_m2() * p.centre.cos_observer.abs()).sum()
    }

    /// Light of a light source scattered once by the surfaces.
    ///
    /// `E_obs/E_source = ν Σ A ⟨f(s, n, o) (n·s)₊⟩ (n·o)₊ / d²`, ν the share of the light source's light that gets past
    /// the Earth, the mean ⟨⟩ over its disc.
    pub fn direct(&self, light_source: &LightSource, skipped: &mut Vec<Skip>) -> FluxSum {
        let mut sum = FluxSum::default();
        let shines = light_source.visible_frac > 0.0 && light_source.flux_at_satellite > 0.0;
        if !(self.exhaustive || shines) {
            let why = if light_source.flux_at_satellite > 0.0 { light_source.words.hidden } else { "gives no light" };
            skipped.push(Skip::light(light_source.name, why));
            return sum;
        }
        let source_disc = self.settings.effects.source_disc;
        for plate in &self.plates {
            // parallel light along the surface leaves rounding alone
            let least = if source_disc == SourceDisc::Point { 1e-12 } else { -light_source.disc_rad.sin() };
            let lit = |side: &Side| side.normal.dot(&light_source.toward(&plate.centre)) >= least;
            let whole = !self.exhaustive && !plate.is_divided();
            if whole && !plate.side(&plate.centre).as_ref().is_some_and(lit) {
                skipped.push(Skip::surface(light_source.name, plate.name(), light_source.words.facing_away));
                continue;
            }
            let part = plate.integrate(|view: &View| {
                let Some(side) = self.side(plate, view) else { return FluxSum::default() };
                let toward = light_source.toward(view);
                let f_cos = match side.brdf {
                    // at the edge of its beam a mirror is as wide as the observer sees it
                    Brdf::Mirror { reflectance } if source_disc == SourceDisc::Convolved => {
                        let mirror_rad = (side.spread / PI).sqrt();
                        let disc_rad = light_source.disc_rad;
                        mirror_reflection(*reflectance, &toward, &side.normal, &view.observer, disc_rad, mirror_rad)
                    }
                    law => direct_reflection(
                        law,
                        &toward,
                        &side.normal,
                        &view.observer,
                        light_source.disc_rad,
                        source_disc,
                    ),
                };
                FluxSum { flux: side.spread * f_cos, ..FluxSum::default() }
            });
            sum.add(&part, light_source.visible_frac * light_source.flux_at_satellite);
        }
        sum
    }

    /// Light of a light source scattered first by the ground, then by the surfaces.
    ///
    /// `E_obs/E_source = Σ A (n·o)₊ / d² · ∫ f_E (p·s)₊ f (n·w)₊ dω`. No integral is evaluated for a light source that
    /// lights no ground in view, nor for a surface that sees no ground. `other_lights_flux` is the flux of the lights already
    /// known, to which that of the surfaces before is added; where the tolerance is of the sum, surfaces and lights whose upper
    /// bounds together are below a quarter of it are skipped, and their bounds are part of the error.
    pub fn earth_reflected(
        &self,
        light_source: &LightSource,
        other_lights_flux: f64,
        skipped: &mut Vec<Skip>,
    ) -> FluxSum {
        let mut sum = FluxSum::default();
        let settings = self.settings;
        let Some(plate) = self.plates.first() else { return sum };
        let lights_ground = |g: &Ground| self.exhaustive || (g.lit_in_view() && light_source.flux_at_ground > 0.0);
        // parallel light reaches as far and farther: where it reaches nothing the Moon's phases are not requested
        let parallel =
            |place: &Vector<Itrs>| Ground::new(place, self.radius_km, &light_source.position_km, &settings.earth);
        let reached = parallel(&plate.centre.place_km).filter(lights_ground);
        let plates = self.by_size(light_source, reached.as_ref());
        let counts = |at_most: f64, sum: &FluxSum| {
            sum.skipped + at_most > SKIPPED_SHARE * settings.tolerance * (other_lights_flux + sum.flux)
        };
        let all = plates.iter().map(|(_, at_most)| at_most).sum::<f64>();
        if all > 0.0 && !counts(all, &sum) {
            skipped.push(Skip::light(light_source.earth_name, TOO_FAINT));
            return FluxSum { skipped: all, err: all, ..sum };
        }
        let near = if reached.is_some() { light_source.over_ground(self.lighting, self.radius_km) } else { None };
        let ground_at = |view: &View| match &near {
            Some(moon) => Ground::under_moon(&view.place_km, self.radius_km, moon, &settings.earth),
            None => parallel(&view.place_km),
        };
        let lit = ground_at(&plate.centre).filter(lights_ground);
        let Some(ground) = lit else {
            skipped.push(Skip::light(light_source.earth_name, light_source.words.no_lit_ground));
            return sum;
        };
        for (plate, at_most) in plates {
            let sees_ground = |side: &Side| ground.seen_by(&side.normal);
            let whole = !self.exhaustive && !plate.is_divided();
            if whole && !plate.side(&plate.centre).as_ref().is_some_and(sees_ground) {
                skipped.push(Skip::surface(light_source.earth_name, plate.name(), "sees no ground"));
                continue;
            }
            if !counts(at_most, &sum) {
                skipped.push(Skip::surface(light_source.earth_name, plate.name(), TOO_FAINT));
                sum.skipped += at_most;
                sum.err += at_most;
                continue;
            }
            let part = plate.integrate(|view: &View| {
                let Some(side) = self.side(plate, view) else { return FluxSum::default() };
                let here;
                let ground = if plate.is_divided() {
                    let Some(g) = ground_at(view) else { return FluxSum::default() };
                    here = g;
                    &here
                } else {
                    &ground
                };
                if !(ground.lit_in_view() && ground.seen_by(&side.normal)) {
                    let dark = || plain(ground, side.brdf, &side.normal, &view.observer);
                    let per_sr = if self.exhaustive { dark() } else { 0.0 };
                    return FluxSum { flux: side.spread * per_sr, ..FluxSum::default() };
                }
                let floor_per_sr = match settings.tolerance_of {
                    _ if self.exhaustive => 0.0,
                    ToleranceOf::EachLight => 0.0,
                    // a quarter each: two light sources, two surfaces
                    ToleranceOf::Total => {
                        let known = other_lights_flux + sum.flux;
                        0.25 * settings.tolerance * known
                            / (light_source.flux_at_ground * side.spread).max(f64::MIN_POSITIVE)
                    }
                };
                let at_most_per_sr = at_most / (light_source.flux_at_ground * side.spread);
                let Accuracy { tolerance, max_nodes, .. } = Accuracy::relative(settings.tolerance, settings.max_nodes);
                let accuracy = Accuracy { tolerance, floor_per_sr, at_most_per_sr, max_nodes };
                let light = side.from_ground.reflected(ground, &side.normal, &view.observer, &accuracy);
                FluxSum {
                    flux: side.spread * light.per_sr,
                    err: side.spread * light.err_per_sr,
                    quadratures: 1,
                    nodes: light.nodes,
                    ..FluxSum::default()
                }
            });
            sum.add(&part, light_source.flux_at_ground);
        }
        sum
    }

    /// The surfaces with the largest light they may reflect from the ground first; in their own order, and without a bound, where
    /// each light counts by itself. A divided surface has none.
    fn by_size(&self, light_source: &LightSource, ground: Option<&Ground>) -> Vec<(&SurfaceElement<'a>, f64)> {
        let mut plates: Vec<_> = self.plates.iter().map(|plate| (plate, f64::INFINITY)).collect();
        let of_sum = self.settings.tolerance_of == ToleranceOf::Total && !self.exhaustive;
        let Some(ground) = ground.filter(|_| of_sum) else { return plates };
        let irradiance = light_source.flux_at_ground_at_most(self.lighting, self.radius_km);
        for (plate, at_most) in plates.iter_mut().filter(|(plate, _)| !plate.is_divided()) {
            let seeing = plate.side(&plate.centre).filter(|side| ground.seen_by(&side.normal));
            *at_most = seeing
                .map_or(0.0, |side| side.spread * irradiance * ground.reflected_at_most(&side.normal, side.bound()));
        }
        plates.sort_by(|a, b| b.1.total_cmp(&a.1));
        plates
    }
}

impl LightSource {
    /// Why the satellite does not see it.
    pub fn hidden(&self) -> &'static str {
        self.words.hidden
    }

    /// The Sun in a scene.
    pub fn sun(scene: &Scene, lighting: &Lighting, radius_km: f64) -> LightSource {
        let distance_km = (scene.sun_km - scene.satellite_km).norm();
        LightSource {
            name: "sun",
            earth_name: "earthshine",
            position_km: scene.sun_km,
            disc_rad: (SUN_RADIUS_KM / distance_km).min(1.0).asin(),
            visible_frac: lighting.share(scene, &scene.sun_km, SUN_RADIUS_KM, radius_km),
            flux_at_satellite: sunlight(distance_km, &lighting.light_sources).flux,
            flux_at_ground: sunlight(scene.sun_km.norm(), &lighting.light_sources).flux,
            sun_of_patches_km: None,
            extrapolated: false,
            words: Words {
                hidden: "in umbra",
                facing_away: "faces away from the Sun",
                no_lit_ground: "no sunlit ground in view",
            },
        }
    }

    /// The Moon in a scene; its phase is that seen from the satellite, on the ground that seen from the Earth's centre,
    /// to which that of every place is a ratio.
    pub fn moon(scene: &Scene, lighting: &Lighting, radius_km: f64) -> LightSource {
        let distance_km = (scene.moon_km - scene.satellite_km).norm();
        let at_satellite = moonlight(&scene.satellite_km, &scene.moon_km, &scene.sun_km, &lighting.light_sources);
        let at_ground = moonlight(&Vector::new(0.0, 0.0, 0.0), &scene.moon_km, &scene.sun_km, &lighting.light_sources);
        LightSource {
            name: "moon",
            earth_name: "lunar_earthshine",
            position_km: scene.moon_km,
            disc_rad: (MOON_RADIUS_KM / distance_km).min(1.0).asin(),
            visible_frac: lighting.share(scene, &scene.moon_km, MOON_RADIUS_KM, radius_km),
            flux_at_satellite: at_satellite.flux,
            flux_at_ground: at_ground.flux,
            sun_of_patches_km: Some(scene.sun_km),
            extrapolated: at_satellite.extrapolated || at_ground.extrapolated,
            words: Words {
                hidden: "below the satellite's horizon",
                facing_away: "faces away from the Moon",
                no_lit_ground: "no moonlit ground in view",
            },
        }
    }

    /// The light source over the ground, place by place; `None` for parallel light.
    pub fn over_ground(&self, lighting: &Lighting, radius_km: f64) -> Option<NearMoon> {
        lighting.light_sources.moon_over_ground(&self.position_km, &self.sun_of_patches_km?, radius_km)
    }

    /// Upper bound of the irradiance at any place on the ground.
    fn flux_at_ground_at_most(&self, lighting: &Lighting, radius_km: f64) -> f64 {
        let sources = &lighting.light_sources;
        let nearest = self.sun_of_patches_km;
        let ratio = nearest.map(|sun_km| sources.moonlight_on_ground_at_most(&self.position_km, &sun_km, radius_km));
        self.flux_at_ground * ratio.unwrap_or(1.0)
    }

    /// From a place on the satellite, unit.
    fn toward(&self, view: &View) -> Vector<Itrs> {
        let v = self.position_km - view.place_km;
        v * (1.0 / v.norm())
    }
}

impl Lighting {
    /// What both light sources need to know.
    pub fn new(effects: &Effects, band: Option<&Band>) -> Result<Self> {
        let v = Band::of_config("V")?;
        let band = band.unwrap_or(&v);
        Ok(Self {
            light_sources: SourceSettings::new(effects, band)?,
            shadow: effects.shadow,
            colour: Colour::of(band)?,
        })
    }

    /// The share of a light source's light that reaches the satellite.
    fn share(&self, scene: &Scene, source_km: &Vector<Itrs>, source_radius_km: f64, radius_km: f64) -> f64 {
        lit_fraction(&scene.satellite_km, source_km, source_radius_km, radius_km, self.shadow, &self.colour)
    }
}
