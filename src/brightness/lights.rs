//! The two ways of light, [`Stage::direct`] and [`Stage::via_earth`], and the two lamps that go them.
//!
//! Irradiances relative to a star of V = 0, areas in m², range in m. What a scene does not need is not computed, and
//! the reason is written down. Left out: light scattered from one surface to another.

use super::brdf::Brdf;
use super::catalogue::Satellite;
use super::earthshine::{Accuracy, reflected_by_earth};
use super::ground::Ground;
use super::lamps::{moonlight, sunlight};
use super::model::ModelSettings;
use super::scene::{Scene, impossible};
use super::shadow::{cylinder, penumbra};
use crate::config::Mode;
use crate::constants::{MOON_RADIUS_KM, SUN_RADIUS_KM};
use crate::error::Result;
use crate::vector::{Itrs, Vector};

/// A surface that shows the observer one of its sides.
pub(super) struct Facet<'a> {
    pub name: &'a str,
    pub area_m2: f64,
    pub normal: Vector<Itrs>,
    pub brdf: &'a Brdf,
    pub cos_observer: f64,
}

/// Sun or Moon in one scene.
pub(super) struct Lamp {
    pub name: &'static str,
    pub earth_name: &'static str,
    pub body: &'static str,
    /// From the satellite, unit.
    pub toward: Vector<Itrs>,
    /// From the Earth's centre.
    pub geocentric: Vector<Itrs>,
    pub visible_frac: f64,
    pub unseen: &'static str,
    pub flux_at_satellite: f64,
    pub flux_at_ground: f64,
    pub extrapolated: bool,
}

/// Sum of a light over the surfaces, its numerical error, and the Earth integrals it took.
#[derive(Default)]
pub(super) struct Sum {
    pub flux: f64,
    pub err: f64,
    pub quadratures: usize,
}

/// One satellite before one observer: all that both ways of light have in common.
pub(super) struct Stage<'a> {
    settings: &'a ModelSettings,
    satellite_km: Vector<Itrs>,
    radius_km: f64,
    /// From the satellite to the observer, unit.
    observer: Vector<Itrs>,
    range_m: f64,
    pub facets: Vec<Facet<'a>>,
}

impl<'a> Stage<'a> {
    /// The surfaces that show the observer a side that scatters; the others go to `skipped`.
    pub fn new(
        scene: &Scene,
        satellite: &'a Satellite,
        settings: &'a ModelSettings,
        skipped: &mut Vec<String>,
    ) -> Result<Self> {
        let observer = unit(scene.observer_km - scene.satellite_km, "observer")?;
        let mut facets = Vec::with_capacity(satellite.surfaces.len());
        for s in &satellite.surfaces {
            let front = s
                .normal(scene)
                .ok_or_else(|| impossible(format!("{}: its attitude {:?} has no direction", s.name, s.attitude)))?;
            let cos_front = front.dot(&observer);
            let side =
                if cos_front > 0.0 { Some((front, &s.brdf)) } else { s.back.as_ref().map(|brdf| (-front, brdf)) };
            match side.filter(|_| cos_front != 0.0) {
                Some((normal, brdf)) => {
                    facets.push(Facet {
                        name: &s.name,
                        area_m2: s.area_m2,
                        normal,
                        brdf,
                        cos_observer: cos_front.abs(),
                    });
                }
                None => skipped.push(format!("{}: faces away from the observer", s.name)),
            }
        }
        Ok(Self {
            settings,
            satellite_km: scene.satellite_km,
            radius_km: settings.radius_km(&scene.satellite_km),
            observer,
            range_m: scene.range_km() * 1e3,
            facets,
        })
    }

    /// Light of a lamp scattered once by the surfaces.
    ///
    /// `E_obs/E_lamp = ν Σ A f(s, n, o) (n·s)₊ (n·o)₊ / d²`, ν the visible share of the lamp's disc.
    pub fn direct(&self, lamp: &Lamp, skipped: &mut Vec<String>) -> Sum {
        let mut sum = Sum::default();
        if lamp.visible_frac <= 0.0 {
            skipped.push(format!("{}: {}", lamp.name, lamp.unseen));
            return sum;
        }
        for facet in &self.facets {
            let cos_in = facet.normal.dot(&lamp.toward);
            if cos_in <= 0.0 {
                skipped.push(format!("{}: {} faces away from the {}", lamp.name, facet.name, lamp.body));
                continue;
            }
            let f_per_sr = facet.brdf.value(&lamp.toward, &facet.normal, &self.observer);
            sum.flux += self.spread(facet) * f_per_sr * cos_in;
        }
        sum.flux *= lamp.visible_frac * lamp.flux_at_satellite;
        sum
    }

    /// Light of a lamp scattered first by the ground, then by the surfaces.
    ///
    /// `E_obs/E_lamp = Σ A (n·o)₊ / d² · ∫ f_E (p·s)₊ f (n·w)₊ dω`. No integral is evaluated for a lamp that lights no
    /// ground in view, nor for a surface that sees no ground.
    pub fn via_earth(&self, lamp: &Lamp, skipped: &mut Vec<String>) -> Sum {
        let mut sum = Sum::default();
        let ground = Ground::new(&self.satellite_km, self.radius_km, &lamp.geocentric, &self.settings.earth);
        let Some(ground) = ground.filter(|g| g.lit_in_view() && lamp.flux_at_ground > 0.0) else {
            skipped.push(format!("{}: no {}lit ground in view", lamp.earth_name, lamp.body.to_lowercase()));
            return sum;
        };
        for facet in &self.facets {
            if !ground.seen_by(&facet.normal) {
                skipped.push(format!("{}: {} sees no ground", lamp.earth_name, facet.name));
                continue;
            }
            let ModelSettings { tolerance, max_nodes, .. } = *self.settings;
            let accuracy = Accuracy { tolerance, floor_per_sr: 0.0, max_nodes };
            let light = reflected_by_earth(&ground, facet.brdf, &facet.normal, &self.observer, &accuracy);
            let scale = lamp.flux_at_ground * self.spread(facet);
            sum.flux += scale * light.per_sr;
            sum.err += scale * light.err_per_sr;
            sum.quadratures += 1;
        }
        sum
    }

    /// A (n·o)/d².
    fn spread(&self, facet: &Facet) -> f64 {
        facet.area_m2 * facet.cos_observer / (self.range_m * self.range_m)
    }
}

impl Lamp {
    /// The Sun in a scene.
    pub fn sun(scene: &Scene, mode: Mode, radius_km: f64) -> Result<Lamp> {
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

    /// The Moon in a scene; its phase is that seen from the satellite, on the ground that seen from the Earth's centre.
    pub fn moon(scene: &Scene, mode: Mode, radius_km: f64) -> Result<Lamp> {
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
}

fn visible(scene: &Scene, source_km: &Vector<Itrs>, source_radius_km: f64, mode: Mode, radius_km: f64) -> f64 {
    match mode {
        Mode::AsPublished => cylinder(&scene.satellite_km, source_km, radius_km),
        Mode::Corrected => penumbra(&scene.satellite_km, source_km, source_radius_km, radius_km),
    }
}

pub(super) fn unit(v: Vector<Itrs>, to: &str) -> Result<Vector<Itrs>> {
    v.unit().ok_or_else(|| impossible(format!("no direction from the satellite to the {to}: {:?} km", v.to_array())))
}
