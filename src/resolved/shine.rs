//! What every facet of a body sends to one observer, light by light, before anything of the body is in the way.
//!
//! Radiances W m⁻² sr⁻¹ in a band, directions along Earth-fixed axes. Facets share the brightness engine's exact
//! integrals; what the body hides of Earth and sky is reported by directions with weights. Not included: narrow lobes
//! in the starlight.

use std::f64::consts::{PI, TAU};

use super::body::PosedBody;
use super::directions::Directions;
use super::light_source::{LightSource, LightSources};
use super::settings::RenderSettings;
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::{Accuracy, Brdf, Ground, PreparedBrdf, Scene, direct_reflection};
use crate::config::SourceDisc;

/// Nodes of the plain rule over the Earth's disc: cosine, azimuth.
const DISC_NODES: (usize, usize) = (16, 48);

/// The light around a satellite, and the way to its observer.
#[derive(Debug)]
pub struct Surroundings {
    /// Sun and Moon.
    pub light_sources: LightSources,
    /// From the satellite to the observer, unit.
    pub observer: Vector<Itrs>,
    /// Directions over the Earth's disc, and over the sky next to it.
    pub earth: Directions,
    /// Directions over the sky next to the Earth.
    pub sky: Directions,
    /// Radiance of the Earth in each of its directions, under Sun and Moon \[W m⁻² sr⁻¹\].
    earth_radiance: [Vec<f64>; 2],
    grounds: [Option<Ground>; 2],
    uniform: [Option<f64>; 2],
    nadir: Vector<Itrs>,
    /// Cosine of the angular radius of the Earth.
    cos_limb: f64,
    /// Radiance of the sky and of the airglow below.
    star: [f64; 2],
    source_disc: SourceDisc,
    accuracy: Accuracy,
}

/// One side of a facet before the observer.
#[derive(Debug, Clone)]
pub struct Shine {
    /// Sun and Moon, direct.
    pub direct: [f64; 2],
    /// Sun and Moon by way of the Earth.
    pub earth: [f64; 2],
    /// Starlight from the sky, airglow from below.
    pub star: [f64; 2],
    /// f (n·w) of every direction over the Earth \[1/sr\]; empty for a mirror.
    pub over_earth: Vec<f64>,
    /// f (n·w) of every direction over the sky; empty for a mirror.
    pub over_sky: Vec<f64>,
    /// Where a mirror looks.
    pub mirror: Option<Vector<Itrs>>,
}

impl Surroundings {
    /// The light at a satellite in a scene.
    ///
    /// # Errors
    /// [`Error::Model`] for an impossible scene or band.
    pub fn new(scene: &Scene, settings: &RenderSettings) -> Result<Self> {
        let model = &settings.model;
        let light_sources = LightSources::new(scene, &settings.band, model)?;
        let radius_km = model.radius_km(&scene.satellite_km);
        let k = radius_km / scene.satellite_km.norm();
        let observer = (scene.observer_km - scene.satellite_km).unit();
        let (Some(observer), Some(nadir)) = (observer, (-scene.satellite_km).unit()) else {
            return Err(Error::Model { problem: "the satellite is at the observer or at the Earth's centre".into() });
        };
        if !(k > 0.0 && k < 1.0) {
            let problem = format!(
                "the satellite is below the surface: {:.3} km from the centre of an Earth of {radius_km:.3} km",
                scene.satellite_km.norm()
            );
            return Err(Error::Model { problem });
        }
        let cos_limb = (1.0 - k * k).sqrt();
        let earth = Directions::new(&nadir, (cos_limb, 1.0), settings.earth_rays);
        let sky = Directions::new(&nadir, (-1.0, cos_limb), settings.earth_rays);
        let width_um = light_sources.band_um.1 - light_sources.band_um.0;
        // W cm⁻² sr⁻¹ µm⁻¹ of the paper's uniform Earth; it stands for Lunar-Earthshine alone
        let uniform = [None, settings.uniform_earth_w_cm2_sr_um.map(|l| l * 1e4 * width_um)];
        let ground = |light_source: &LightSource| light_source.ground(&scene.satellite_km, radius_km, &model.earth);
        let grounds = [ground(&light_sources.sun), ground(&light_sources.moon)];
        let field = |light_source: &LightSource, ground: &Option<Ground>, uniform: Option<f64>| match (uniform, ground)
        {
            (Some(l), _) => vec![l; earth.unit.len()],
            (None, Some(g)) => earth.unit.iter().map(|w| light_source.at_ground_w_m2 * g.seen_in(w)).collect(),
            (None, None) => Vec::new(),
        };
        let earth_radiance =
            [field(&light_sources.sun, &grounds[0], uniform[0]), field(&light_sources.moon, &grounds[1], uniform[1])];
        let star =
            settings.starlight_mag_arcsec2.map_or([0.0; 2], |mags| mags.map(|m| light_sources.radiance_of_sky(m)));
        Ok(Self {
            observer,
            earth,
            sky,
            earth_radiance,
            grounds,
            uniform,
            nadir,
            cos_limb,
            star,
            source_disc: model.effects.source_disc,
            accuracy: Accuracy::relative(model.tolerance, model.max_nodes),
            light_sources,
        })
    }

    /// Towards the centre of the Earth, unit.
    #[must_use]
    pub fn nadir(&self) -> Vector<Itrs> {
        self.nadir
    }

    /// Radiance of the Earth in its k-th direction under Sun (0) or Moon (1); 0 where it is dark.
    #[must_use]
    pub fn earth_radiance(&self, light_source: usize, k: usize) -> f64 {
        self.earth_radiance[light_source].get(k).copied().unwrap_or(0.0)
    }

    /// What a side of this law and normal sends to the observer with nothing in the way; `None` when it faces away.
    #[must_use]
    pub fn shine(&self, law: &PreparedBrdf, brdf: &Brdf, normal: &Vector<Itrs>) -> Option<Shine> {
        let cos_out = normal.dot(&self.observer);
        if !(cos_out > 0.0) {
            return None;
        }
        let o = &self.observer;
        let direct = [&self.light_sources.sun, &self.light_sources.moon].map(|light_source| {
            if !(light_source.at_satellite_w_m2 > 0.0) {
                return 0.0;
            }
            light_source.at_satellite_w_m2
                * direct_reflection(brdf, &light_source.toward, normal, o, light_source.disc_rad, self.source_disc)
        });
        let over_disc = self.over_disc(brdf, normal);
        let light_sources = [&self.light_sources.sun, &self.light_sources.moon];
        let earth = [0, 1].map(|k| match (self.uniform[k], &self.grounds[k]) {
            (Some(radiance), _) => radiance * over_disc,
            (None, Some(ground)) => {
                light_sources[k].at_ground_w_m2 * law.reflected(ground, normal, o, &self.accuracy).per_sr
            }
            (None, None) => 0.0,
        });
        // ∫ f (n·w) dω over everything, by reciprocity
        let all = brdf.hemispherical_reflectance(cos_out.min(1.0).acos());
        let star = [self.star[0] * (all - over_disc).max(0.0), self.star[1] * over_disc];
        if let Brdf::Mirror { .. } = brdf {
            let mirror = Some(*normal * (2.0 * cos_out) - *o);
            return Some(Shine { direct, earth, star, over_earth: Vec::new(), over_sky: Vec::new(), mirror });
        }
        let weights = |directions: &Directions| -> Vec<f64> {
            let f_cos = |w: &Vector<Itrs>| {
                let cos = normal.dot(w);
                if cos > 0.0 { brdf.value(w, normal, o) * cos } else { 0.0 }
            };
            directions.unit.iter().map(f_cos).collect()
        };
        Some(Shine {
            direct,
            earth,
            star,
            over_earth: weights(&self.earth),
            over_sky: weights(&self.sky),
            mirror: None,
        })
    }

    /// ∫ f (n·w) dω over the whole disc of the Earth.
    fn over_disc(&self, brdf: &Brdf, normal: &Vector<Itrs>) -> f64 {
        let o = &self.observer;
        if let Brdf::Mirror { reflectance } = brdf {
            let mirror = *normal * (2.0 * normal.dot(o)) - *o;
            return if mirror.dot(&self.nadir) > self.cos_limb { *reflectance } else { 0.0 };
        }
        let u = self.nadir.any_perpendicular().unwrap_or(self.nadir);
        let v = self.nadir.cross(&u);
        let (n_cos, n_az) = DISC_NODES;
        let height = (1.0 - self.cos_limb) / n_cos as f64;
        let mut sum = 0.0;
        for i in 0..n_cos {
            let cos = self.cos_limb + (i as f64 + 0.5) * height;
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            for j in 0..n_az {
                let (s, c) = (TAU * (j as f64 + 0.5) / n_az as f64).sin_cos();
                let w = self.nadir * cos + u * (sin * c) + v * (sin * s);
                sum += brdf.value(&w, normal, o) * normal.dot(&w).max(0.0);
            }
        }
        sum * height * TAU / n_az as f64
    }

    /// Radiance of a side taken as diffuse, lit by Sun, Earth under the Sun, Moon, Earth under the Moon, stars, with
    /// nothing in the way: `ρ/π` of the irradiance, ρ the reflectance at normal incidence.
    #[must_use]
    pub fn diffuse(&self, brdf: &Brdf, normal: &Vector<Itrs>) -> [f64; 5] {
        let flat = Brdf::Lambert { albedo: brdf.hemispherical_reflectance(0.0).min(1.0) };
        let law = PreparedBrdf::new(&flat);
        let per_pi = brdf.hemispherical_reflectance(0.0) / PI;
        let light_sources = [&self.light_sources.sun, &self.light_sources.moon];
        let direct = light_sources
            .map(|light_source| per_pi * light_source.at_satellite_w_m2 * normal.dot(&light_source.toward).max(0.0));
        let earth_cos: f64 = self.earth.unit.iter().map(|w| normal.dot(w).max(0.0)).sum::<f64>() * self.earth.each_sr;
        let earth = [0, 1].map(|k| match (self.uniform[k], &self.grounds[k]) {
            (Some(radiance), _) => per_pi * radiance * earth_cos,
            (None, Some(g)) => {
                light_sources[k].at_ground_w_m2 * law.reflected(g, normal, normal, &self.accuracy).per_sr
            }
            (None, None) => 0.0,
        });
        let star = per_pi * (self.star[0] * (PI - earth_cos).max(0.0) + self.star[1] * earth_cos);
        [direct[0], earth[0], direct[1], earth[1], star]
    }
}

/// The shine of every side of every facet: front and back, `None` where it faces away or is black.
pub fn shines(body: &PosedBody, around: &Surroundings) -> Vec<[Option<Shine>; 2]> {
    use rayon::prelude::*;
    let prepared: Vec<[Option<PreparedBrdf>; 2]> = body
        .materials
        .iter()
        .map(|m| [Some(PreparedBrdf::new(&m.front)), m.back.as_ref().map(PreparedBrdf::new)])
        .collect();
    body.facets
        .par_iter()
        .map(|facet| {
            let material = &body.materials[facet.material];
            let laws = &prepared[facet.material];
            let front = laws[0].as_ref().and_then(|law| around.shine(law, &material.front, &facet.normal));
            let back = match (&laws[1], &material.back) {
                (Some(law), Some(brdf)) => around.shine(law, brdf, &-facet.normal),
                _ => None,
            };
            [front, back]
        })
        .collect()
}
