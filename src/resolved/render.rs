//! The picture: for every pixel the part of the satellite it sees, and the light of that part that nothing hides.
//!
//! W m⁻² sr⁻¹ per light at the entrance aperture, metres, radians. Parallel projection at the true range and aspect.
//! The answer does not depend on the number of threads. Not included: the half shadow of the Sun's disc on the
//! satellite itself.

use hifitime::Epoch;
use ndarray::Array2;
use rayon::prelude::*;

use super::body::PosedBody;
use super::directions::{SETS, scramble};
use super::image::{Light, RadianceImage};
use super::satellite::ComponentSatellite;
use super::settings::RenderSettings;
use super::shine::{Shine, Surroundings, shines};
use super::view::View;
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::Scene;
use crate::orbit::{Geometry, Tracker};

/// The satellite is this much larger than a point for its range before rays are no longer parallel.
const PARALLEL: f64 = 1e-3;
/// Share of what is seen above which black backs are reported of.
const MOSTLY: f64 = 0.5;

/// A satellite of components at one instant before one observer.
#[derive(Debug, Clone)]
pub struct ResolvedScene {
    /// The satellite.
    pub satellite: ComponentSatellite,
    /// Where everything is.
    pub scene: Scene,
}

/// A scene made ready: the body posed, the light of every facet known.
#[derive(Debug)]
pub struct Renderer {
    /// The body.
    pub body: PosedBody,
    /// The light around it.
    pub around: Surroundings,
    /// Light of the facets' sides.
    shines: Vec<[Option<Shine>; 2]>,
    /// Diffuse light of the facets' sides, for the bounce.
    diffuse: Vec<[[f64; 5]; 2]>,
    settings: RenderSettings,
    range_km: f64,
    /// How the body lies on the sky.
    pub view: View,
}

/// Rays that were cast.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayCounts {
    /// From pixels.
    pub view: u64,
    /// Towards Sun and Moon.
    pub shadow: u64,
    /// Towards Earth and sky.
    pub earth_and_sky: u64,
}

/// A picture and what it took.
#[derive(Debug, Clone)]
pub struct Rendered {
    /// The picture.
    pub image: RadianceImage,
    /// V flux, relative to a star of magnitude 0, of each plane of the picture.
    pub v_flux: Vec<(Light, f64)>,
    /// Area the observer sees \[m²\], from the pixels.
    pub seen_area_m2: f64,
    /// The whole satellite lies in the picture; if not, area and light are those of the part that does.
    pub whole: bool,
    /// The body throws no shadow on itself: no shadow rays were needed.
    pub convex: bool,
    /// Rays.
    pub rays: RayCounts,
    /// Facets that face the observer.
    pub facets: usize,
    /// What a reader should know.
    pub warnings: Vec<String>,
}

impl ResolvedScene {
    /// A satellite where its elements put it at an instant, seen from the tracker's site.
    ///
    /// # Errors
    /// [`crate::Error::Orbit`] of the elements.
    pub fn at(satellite: &ComponentSatellite, tracker: &Tracker, epoch: &Epoch) -> Result<Self> {
        Ok(Self::of(satellite, &tracker.at(epoch)?))
    }

    /// A satellite in a geometry that is known.
    #[must_use]
    pub fn of(satellite: &ComponentSatellite, g: &Geometry) -> Self {
        let scene = Scene {
            satellite_km: g.satellite_itrs_km,
            velocity_km_s: g.satellite_velocity_itrs_km_s,
            observer_km: g.observer_itrs_km,
            sun_km: g.sun_itrs_km,
            moon_km: g.moon_itrs_km,
            sidereal_rad: g.sidereal_rad,
        };
        Self { satellite: satellite.clone(), scene }
    }
}

/// The picture of a scene.
///
/// # Errors
/// [`crate::Error::Config`] for settings out of range; [`crate::Error::Model`] for an impossible scene.
pub fn render(scene: &ResolvedScene, settings: &RenderSettings) -> Result<Rendered> {
    Ok(Renderer::new(scene, settings)?.picture())
}

impl Renderer {
    /// Poses the body and computes the light of every facet.
    ///
    /// # Errors
    /// As [`render`].
    pub fn new(of: &ResolvedScene, settings: &RenderSettings) -> Result<Self> {
        settings.check()?;
        let body = PosedBody::new(&of.satellite, &of.scene, settings.sides)?;
        let around = Surroundings::new(&of.scene, settings)?;
        let shines = shines(&body, &around);
        let diffuse = if settings.bounce && settings.shadows {
            let of = |facet: &super::body::Facet| {
                let material = &body.materials[facet.material];
                let back = material.back.as_ref().map_or([0.0; 5], |b| around.diffuse(b, &-facet.normal));
                [around.diffuse(&material.front, &facet.normal), back]
            };
            body.facets.par_iter().map(of).collect()
        } else {
            Vec::new()
        };
        let view = View::new(&body, &around.observer)?;
        Ok(Self { body, around, shines, diffuse, settings: settings.clone(), range_km: of.scene.range_km(), view })
    }

    /// Side of a pixel \[m\] at the satellite: as requested, or so that the satellite fills the picture.
    #[must_use]
    pub fn pixel_m(&self) -> f64 {
        match self.settings.pixel_rad {
            Some(rad) => rad * self.range_km * 1e3,
            None => self.view.filling_pixel_m(self.settings.pixels),
        }
    }

    /// The whole satellite lies in the picture.
    #[must_use]
    pub fn whole(&self) -> bool {
        self.view.fits(self.settings.pixels, self.pixel_m())
    }

    /// Casts the rays.
    #[must_use]
    pub fn picture(&self) -> Rendered {
        let n = self.settings.pixels;
        let pixel_m = self.pixel_m();
        let rows: Vec<ImageRow> = (0..n).into_par_iter().map(|y| self.row(y, pixel_m)).collect();
        let pixel_rad = pixel_m / (self.range_km * 1e3);
        let mut rays = RayCounts::default();
        let (mut covered, mut black) = (0.0, 0.0);
        for row in &rows {
            covered += row.covered;
            black += row.black;
            rays.view += row.rays.view;
            rays.shadow += row.rays.shadow;
            rays.earth_and_sky += row.rays.earth_and_sky;
        }
        let plane = |k: usize| (Light::ALL[k], Array2::from_shape_fn((n, n), |(y, x)| rows[y].pixels[x][k]));
        let image = RadianceImage {
            pixel_rad,
            range_km: self.range_km,
            planes: (0..5).filter(|k| self.shines_at_all(*k)).map(plane).collect(),
            wavelength_um: self.around.light_sources.wavelength_um,
            band_um: self.around.light_sources.band_um,
        };
        let v_flux = image.planes.iter().map(|(l, _)| (*l, self.v_per_w_m2(*l) * image.irradiance_w_m2(*l))).collect();
        Rendered {
            v_flux,
            image,
            seen_area_m2: covered * pixel_m * pixel_m,
            convex: self.body.is_convex(),
            rays,
            facets: self.shines.iter().flatten().flatten().count(),
            whole: self.whole(),
            warnings: self.warnings(if covered > 0.0 { black / covered } else { 0.0 }),
        }
    }

    /// V flux, relative to a star of magnitude 0, of 1 W m⁻² of a light in the band.
    #[must_use]
    pub fn v_per_w_m2(&self, light: Light) -> f64 {
        let light_sources = &self.around.light_sources;
        match light {
            Light::Sun | Light::Earthshine => light_sources.sun.v_per_w_m2,
            Light::Moon | Light::LunarEarthshine => light_sources.moon.v_per_w_m2,
            Light::Starlight => 1.0 / light_sources.v_zero_w_m2,
        }
    }

    /// Whether a light was requested.
    fn shines_at_all(&self, k: usize) -> bool {
        let s = &self.settings;
        match Light::ALL[k] {
            Light::Sun | Light::Earthshine => s.model.sun,
            Light::Moon => s.model.moon,
            Light::LunarEarthshine => s.model.moon || s.uniform_earth_w_cm2_sr_um.is_some(),
            Light::Starlight => s.starlight_mag_arcsec2.is_some(),
        }
    }

    /// What a reader should know of a picture of which this share is black backs.
    fn warnings(&self, black_frac: f64) -> Vec<String> {
        let mut warnings = Vec::new();
        let apparent = self.body.radius_m / (self.range_km * 1e3);
        if apparent > PARALLEL {
            warnings.push(format!(
                "the satellite is {:.1e} of its range across: parallel rays are off by about as much",
                2.0 * apparent
            ));
        }
        if !self.whole() {
            let [west, north] = self.view.half_m.map(|half| 2.0 * half);
            warnings.push(format!(
                "the satellite, {west:.2} m by {north:.2} m on the sky, reaches beyond the picture of {:.2} m: light, \
                 magnitude and area are those of the part in it",
                self.settings.pixels as f64 * self.pixel_m()
            ));
        }
        if black_frac > MOSTLY {
            warnings.push(format!(
                "{:.0} % of what is seen are black backs: turn the faces of a mesh around if they point inwards, give \
                 sheet = true for an open one, or the material a back",
                100.0 * black_frac
            ));
        }
        if self.around.light_sources.extrapolated {
            warnings.push("the Moon's phase is beyond what the lunar law was fitted to".into());
        }
        warnings
    }

    fn row(&self, y: usize, pixel_m: f64) -> ImageRow {
        let (n, k) = (self.settings.pixels, self.settings.samples);
        let (middle, share) = (0.5 * n as f64, 1.0 / (k * k) as f64);
        let mut rays = RayCounts::default();
        let (mut covered, mut black) = (0.0, 0.0);
        let pixels = (0..n)
            .map(|x| {
                let first = scramble(x, y, 0) as usize;
                let mut sum = [0.0; 5];
                for s in 0..k * k {
                    let bits = scramble(x, y, s + 1);
                    let jitter = [bits & 0xffff, bits >> 16].map(|b| (f64::from(b) + 0.5) / 65_536.0);
                    let at = |pixel: usize, cell: usize, j: f64| pixel as f64 + (cell as f64 + j) / k as f64 - middle;
                    // x grows to the west, y to the north
                    let place = self.view.place(at(x, s % k, jitter[0]) * pixel_m, at(y, s / k, jitter[1]) * pixel_m);
                    rays.view += 1;
                    let Some((face, met)) = self.body.seen_along(&place, &-self.around.observer) else { continue };
                    covered += share;
                    black += if self.is_black(face) { share } else { 0.0 };
                    let light = self.light(face, &met, &[first + s], &mut rays);
                    sum.iter_mut().zip(light).for_each(|(sum, l)| *sum += share * l);
                }
                sum
            })
            .collect();
        ImageRow { pixels, covered, black, rays }
    }

    /// The observer sees a back that scatters nothing.
    fn is_black(&self, face: usize) -> bool {
        let (side, _) = self.body.side_toward(face, &self.around.observer);
        let of = &self.body.faces[face];
        side == 1 && (!of.sheet || self.body.materials[self.body.facets[of.facet].material].back.is_none())
    }

    /// What a place on a triangle sends to the observer: Sun, Earthshine, Moon, Lunar-Earthshine, starlight
    /// \[W m⁻² sr⁻¹\]; `sets` are the sets of directions to trace.
    #[must_use]
    pub fn light(&self, face: usize, place: &Vector<Itrs>, sets: &[usize], counts: &mut RayCounts) -> [f64; 5] {
        let (side, normal) = self.body.side_toward(face, &self.around.observer);
        let of = &self.body.faces[face];
        if side == 1 && !of.sheet {
            return [0.0; 5];
        }
        let Some(shine) = &self.shines[of.facet][side] else { return [0.0; 5] };
        let light_sources = [&self.around.light_sources.sun, &self.around.light_sources.moon];
        if of.open[side] || !self.settings.shadows {
            let [direct, earth, star] = [shine.direct, shine.earth, shine.star];
            return [direct[0], earth[0], direct[1], earth[1], star[0] + star[1]];
        }
        let direct = [0, 1].map(|k| {
            if !(shine.direct[k] > 0.0) {
                return 0.0;
            }
            counts.shadow += 1;
            if self.body.shaded(place, &normal, &light_sources[k].toward) { 0.0 } else { shine.direct[k] }
        });
        if let Some(mirror) = &shine.mirror {
            counts.earth_and_sky += 1;
            let clear = f64::from(u8::from(!self.body.shaded(place, &normal, mirror)));
            let star = clear * (shine.star[0] + shine.star[1]);
            return [direct[0], clear * shine.earth[0], direct[1], clear * shine.earth[1], star];
        }
        let hidden = self.hidden(shine, place, &normal, sets, counts);
        let clear = |all: f64, part: [f64; 2]| if part[0] > 0.0 { all * part[1] / part[0] } else { all };
        let mut light = [
            direct[0],
            clear(shine.earth[0], hidden.earth[0]),
            direct[1],
            clear(shine.earth[1], hidden.earth[1]),
            clear(shine.star[0], hidden.sky) + clear(shine.star[1], hidden.air),
        ];
        light.iter_mut().zip(hidden.bounced).for_each(|(l, b)| *l += b);
        light
    }

    /// Asks the directions of some sets: which weight there is, and which of it nothing hides.
    fn hidden(
        &self,
        shine: &Shine,
        place: &Vector<Itrs>,
        normal: &Vector<Itrs>,
        sets: &[usize],
        counts: &mut RayCounts,
    ) -> Hidden {
        let around = &self.around;
        let mut sum = Hidden::default();
        let spread = 1.0 / sets.len().max(1) as f64 * SETS as f64;
        let needs_sky = shine.star[0] > 0.0 || self.settings.bounce;
        let needs_earth = shine.earth.iter().any(|e| *e > 0.0) || shine.star[1] > 0.0 || self.settings.bounce;
        for set in sets {
            for (directions, weights, is_earth) in
                [(&around.earth, &shine.over_earth, true), (&around.sky, &shine.over_sky, false)]
            {
                if !(if is_earth { needs_earth } else { needs_sky }) {
                    continue;
                }
                for k in directions.set(*set) {
                    let weight = weights[k];
                    if !(weight > 0.0) {
                        continue;
                    }
                    counts.earth_and_sky += 1;
                    let clear = if self.settings.bounce {
                        match self.body.met_from(place, normal, &directions.unit[k]) {
                            Some((face, met)) => {
                                let light = self.bounced(face, &met, &directions.unit[k], counts);
                                let each = weight * directions.each_sr * spread;
                                sum.bounced.iter_mut().zip(light).for_each(|(b, l)| *b += each * l);
                                0.0
                            }
                            None => 1.0,
                        }
                    } else {
                        f64::from(u8::from(!self.body.shaded(place, normal, &directions.unit[k])))
                    };
                    if is_earth {
                        for light_source in 0..2 {
                            let w = weight * around.earth_radiance(light_source, k);
                            sum.earth[light_source][0] += w;
                            sum.earth[light_source][1] += w * clear;
                        }
                        sum.air[0] += weight;
                        sum.air[1] += weight * clear;
                    } else {
                        sum.sky[0] += weight;
                        sum.sky[1] += weight * clear;
                    }
                }
            }
        }
        sum
    }

    /// Diffuse light of a part that was met on the way, back along the way.
    fn bounced(&self, face: usize, met: &Vector<Itrs>, along: &Vector<Itrs>, counts: &mut RayCounts) -> [f64; 5] {
        let (side, normal) = self.body.side_toward(face, &-*along);
        let of = &self.body.faces[face];
        if side == 1 && !of.sheet {
            return [0.0; 5];
        }
        let mut light = self.diffuse[of.facet][side];
        for (k, light_source) in [(0, &self.around.light_sources.sun), (2, &self.around.light_sources.moon)] {
            if light[k] > 0.0 && !of.open[side] {
                counts.shadow += 1;
                if self.body.shaded(met, &normal, &light_source.toward) {
                    light[k] = 0.0;
                }
            }
        }
        light
    }
}

/// One row of a picture.
struct ImageRow {
    /// The light of each pixel.
    pixels: Vec<[f64; 5]>,
    /// Pixels covered, and those of them by black backs.
    covered: f64,
    black: f64,
    rays: RayCounts,
}

/// Weights sampled, and those of them that nothing hides; light from other parts.
#[derive(Default)]
struct Hidden {
    earth: [[f64; 2]; 2],
    sky: [f64; 2],
    air: [f64; 2],
    bounced: [f64; 5],
}
