//! The whole sky of one observer: how bright a type of satellite at one height would be in every direction.
//!
//! Lengths in km, angles in rad, irradiances relative to a star of magnitude 0. Observer and orbits on concentric
//! spheres. Not included: where the satellites of a constellation really are; every direction is computed.

use rayon::prelude::*;

use super::answer::Brightness;
use super::catalogue::Satellite;
use super::light_sources::{SourceSettings, eclipse_factor, sunlight};
use super::model::Model;
use super::scene::{Scene, impossible};
use super::settings::ModelSettings;
use super::spectrum::Band;
use crate::base::constants::AU_KM;
use crate::base::error::Result;
use crate::base::vector::{Enu, Itrs, Vector};
use crate::config::{Distances, Effects, Shadow, SourceDisc};
use crate::orbit::earth::from_alt_az;

/// Most directions of one map.
pub const MAX_POINTS: usize = 4_000_000;
/// Lowest altitude that is computed: at 0 itself rounding decides whether the satellite is up \[rad\].
const HORIZON_RAD: f64 = 1e-10;
/// How many times further light sources stand that shine in parallel: the Moon's parallax from orbit is then 2e-9 rad.
const TO_INFINITY: f64 = 1e7;
/// Distance of a Moon of which only the direction is known \[km\] (Cox 2002).
const MOON_KM: f64 = super::light_sources::MOON_MEAN_DISTANCE_KM;
/// Gravitational parameter of the Earth \[km³/s²\] (WGS84).
pub const GM_KM3_S2: f64 = 398_600.441_8;

/// The directions of a map: every altitude with every azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyGrid {
    /// From 0 to 90 \[deg\].
    pub alt_deg: Vec<f64>,
    /// From 0 to 360, both ends \[deg\].
    pub az_deg: Vec<f64>,
}

/// What is above an observer: the sphere of the orbits, the Sun, the Moon.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// East, north and up of the observer.
    axes: [Vector<Itrs>; 3],
    /// Radius of the Earth \[km\]; the observer is on it.
    pub radius_km: f64,
    /// Height of the orbits above it \[km\].
    pub height_km: f64,
    /// Azimuth in which the satellites move \[rad\].
    pub track_az_rad: f64,
    /// Sidereal time at Greenwich \[rad\], for attitudes fixed among the stars.
    pub sidereal_rad: f64,
    sun_km: Vector<Itrs>,
    moon_km: Option<Vector<Itrs>>,
}

/// A direction and, where it is known, a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Altitude above the observer's horizon \[rad\].
    pub alt_rad: f64,
    /// Azimuth, north through east \[rad\].
    pub az_rad: f64,
    /// From the observer \[km\].
    pub distance_km: f64,
}

impl Body {
    /// A Sun at 1 au.
    #[must_use]
    pub fn sun(alt_rad: f64, az_rad: f64) -> Self {
        Self { alt_rad, az_rad, distance_km: AU_KM }
    }
    /// A Moon at its mean distance.
    #[must_use]
    pub fn moon(alt_rad: f64, az_rad: f64) -> Self {
        Self { alt_rad, az_rad, distance_km: MOON_KM }
    }
    /// The same direction in parallel light; Sun and Moon keep the ratio of their distances, and so the phase.
    #[must_use]
    pub fn at_infinity(self) -> Self {
        Self { distance_km: TO_INFINITY * self.distance_km, ..self }
    }
}

/// One direction of a map.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SkyPoint {
    /// Distance of the satellite \[km\].
    pub range_km: f64,
    /// Sun, earthshine, Moon, lunar earthshine: irradiance relative to a star of magnitude 0.
    pub lights: [f64; 4],
    /// Which of them are there and were not computed: they cannot change the sum by more than the tolerance.
    pub too_faint: [bool; 4],
    /// Estimated numerical error of their sum \[mag\].
    pub err_mag: f64,
    /// 1-sigma error as a prediction \[mag\]; `None` where the model was not compared with observations.
    pub pred_err_mag: Option<f64>,
    /// Share of the Sun's light that gets past the Earth to the satellite.
    pub sun_visible_frac: f64,
    /// Moonlight was requested beyond the range of validity of the law.
    pub extrapolated: bool,
}

/// A map of the sky: plain arrays, altitude running fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyMap {
    /// The directions.
    #[doc(hidden)]
    pub grid: SkyGrid,
    /// `points[j * n_alt + i]` is at `alt_deg[i]`, `az_deg[j]`.
    #[doc(hidden)]
    pub points: Vec<SkyPoint>,
    /// Irradiance of the Sun at 1 au, as the model scales it, relative to magnitude 0.
    #[doc(hidden)]
    pub sun_flux: f64,
}

impl SkyGrid {
    /// `n_alt` altitudes from 0 to 90° and `n_az` azimuths from 0 to 360°, ends included.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for fewer than two of either, or more than [`MAX_POINTS`] directions.
    pub fn new(n_alt: usize, n_az: usize) -> Result<Self> {
        let count = n_alt.checked_mul(n_az).filter(|n| *n <= MAX_POINTS);
        if n_alt < 2 || n_az < 2 || count.is_none() {
            return Err(impossible(format!(
                "a grid of {n_alt} altitudes and {n_az} azimuths; accepted are 2 or more of each, {MAX_POINTS} in all"
            )));
        }
        let even = |end: f64, n: usize| -> Vec<f64> { (0..n).map(|i| end * i as f64 / (n - 1) as f64).collect() };
        Ok(Self { alt_deg: even(90.0, n_alt), az_deg: even(360.0, n_az) })
    }

    /// Altitude and azimuth of every direction, in the order of the points \[deg\].
    pub fn directions(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.az_deg.iter().flat_map(|az| self.alt_deg.iter().map(move |alt| (*alt, *az)))
    }

    /// The share of the sky each direction stands for, in the order of the points: trapezoids in altitude and azimuth,
    /// `equal_areas` with cos(altitude). Their sum is 1.
    #[must_use]
    pub fn weights(&self, equal_areas: bool) -> Vec<f64> {
        let ends = |i: usize, n: usize| if i == 0 || i + 1 == n { 0.5 } else { 1.0 };
        let (n_alt, n_az) = (self.alt_deg.len(), self.az_deg.len());
        let mut weights: Vec<f64> = Vec::with_capacity(n_alt * n_az);
        for j in 0..n_az {
            for (i, alt) in self.alt_deg.iter().enumerate() {
                let area = if equal_areas { alt.to_radians().cos() } else { 1.0 };
                weights.push(ends(i, n_alt) * ends(j, n_az) * area);
            }
        }
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        weights
    }
}

impl Sky {
    /// The sky of an observer whose east, north and up are `axes`, on a sphere of `radius_km`, under orbits `height_km`
    /// above it whose satellites move towards the azimuth `track_az_rad`. Without a Moon there is no moonlight.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for a radius or height that is not above 0, or a direction that is not finite.
    pub fn new(
        axes: [Vector<Itrs>; 3],
        (radius_km, height_km): (f64, f64),
        track_az_rad: f64,
        sun: Body,
        moon: Option<Body>,
    ) -> Result<Self> {
        for (name, value) in [("radius_km", radius_km), ("height_km", height_km)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(impossible(format!("{name} = {value}; accepted is above 0")));
            }
        }
        let place = |body: Body| {
            let toward = in_axes(&axes, &from_alt_az(body.alt_rad, body.az_rad));
            axes[2] * radius_km + toward * body.distance_km
        };
        let (sun_km, moon_km) = (place(sun), moon.map(place));
        let finite = [Some(sun_km), moon_km].into_iter().flatten().all(|v| v.norm().is_finite());
        if !(finite && track_az_rad.is_finite()) {
            return Err(impossible("a direction of Sun, Moon or track is not a finite number".into()));
        }
        Ok(Self { axes, radius_km, height_km, track_az_rad, sidereal_rad: 0.0, sun_km, moon_km })
    }

    /// The scene with the satellite where a line of sight meets the sphere of the orbits.
    ///
    /// `d = −R sin a + sqrt(R² sin² a + 2Rh + h²)`; the velocity is that of a circular orbit, along the local
    /// horizontal nearest to the track's direction at the observer. Altitude and azimuth in rad; below the horizon
    /// counts as on it.
    #[must_use]
    pub fn scene(&self, alt_rad: f64, az_rad: f64) -> Scene {
        let alt_rad = alt_rad.max(HORIZON_RAD);
        let (r, h) = (self.radius_km, self.height_km);
        let (sin_a, depth) = (alt_rad.sin(), h * (2.0 * r + h));
        // the other root's form keeps its digits for low orbits
        let range_km = depth / (r * sin_a + (r * r * sin_a * sin_a + depth).sqrt());
        let observer_km = self.axes[2] * r;
        let satellite_km = observer_km + in_axes(&self.axes, &from_alt_az(alt_rad, az_rad)) * range_km;
        let track = in_axes(&self.axes, &from_alt_az(0.0, self.track_az_rad));
        let up = satellite_km * (1.0 / satellite_km.norm());
        let along = track - up * up.dot(&track);
        let speed_km_s = (GM_KM3_S2 / satellite_km.norm()).sqrt();
        let velocity_km_s = along.unit().unwrap_or(track) * speed_km_s;
        // a Moon that is not wanted stands under the observer's feet and is switched off
        let moon_km = self.moon_km.unwrap_or(self.axes[2] * -MOON_KM);
        Scene {
            satellite_km,
            velocity_km_s,
            observer_km,
            sun_km: self.sun_km,
            moon_km,
            sidereal_rad: self.sidereal_rad,
        }
    }

    /// A satellite under this sky: its sphere, and no Moon where there is none.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn model(&self, satellite: &Satellite, settings: &ModelSettings) -> Result<Model> {
        let moon = settings.moon && self.moon_km.is_some();
        Model::new(satellite, &ModelSettings { earth_radius_km: Some(self.radius_km), moon, ..settings.clone() })
    }

    fn point(&self, alt_deg: f64, az_deg: f64, model: &dyn Fn(&Scene) -> Result<Brightness>) -> Result<SkyPoint> {
        // 360 deg is 0, to the last digit
        let scene = self.scene(alt_deg.to_radians(), (az_deg % 360.0).to_radians());
        let b = model(&scene)?;
        Ok(SkyPoint::of(&scene, &b))
    }
}

/// The map of a sky: rows of one azimuth each, computed in parallel, the result the same for any number of threads.
/// `tick` is called after each.
///
/// # Errors
/// As [`Model::new`] and [`Model::brightness`].
pub fn sky_map(
    sky: &Sky,
    grid: &SkyGrid,
    satellite: &Satellite,
    settings: &ModelSettings,
    tick: &(dyn Fn() + Sync),
) -> Result<SkyMap> {
    let model = sky.model(satellite, settings)?;
    let model = |scene: &Scene| model.brightness(scene);
    let rows: Vec<Vec<SkyPoint>> = grid
        .az_deg
        .par_iter()
        .map(|az| {
            let row = grid.alt_deg.iter().map(|alt| sky.point(*alt, *az, &model)).collect();
            tick();
            row
        })
        .collect::<Result<_>>()?;
    let sun_flux = sunlight(AU_KM, &light_sources(settings)?).flux;
    Ok(SkyMap { grid: grid.clone(), points: rows.concat(), sun_flux })
}

impl Sky {
    /// The share of the Moon's light that the Earth's shadow leaves it; 1 without a Moon or an eclipse.
    #[must_use]
    pub fn moon_out_of_eclipse(&self) -> f64 {
        self.moon_km.map_or(1.0, |moon_km| eclipse_factor(&moon_km, &self.sun_km))
    }
}

impl SkyPoint {
    /// The answer of the model for a satellite in one direction.
    #[must_use]
    pub fn of(scene: &Scene, b: &Brightness) -> Self {
        Self {
            range_km: scene.range_km(),
            lights: b.lights().map(|light| light.flux_ratio),
            too_faint: b.too_faint(),
            err_mag: b.err_mag,
            pred_err_mag: b.v_pred_err_mag,
            sun_visible_frac: b.sun_visible_frac,
            extrapolated: b.extrapolated,
        }
    }

    /// All four lights together, relative to a star of magnitude 0.
    #[must_use]
    pub fn flux(&self) -> f64 {
        self.lights.iter().sum()
    }

    /// V of all four lights; `None` without any \[mag\].
    #[must_use]
    pub fn v_mag(&self) -> Option<f64> {
        super::light_sources::mag_of_flux(self.flux())
    }
}

impl SkyMap {
    /// The magnitudes at the given shares of the lit sky, brightest first (0.5 = median) and the share of the sky that
    /// is lit, both weighted by [`SkyGrid::weights`].
    #[must_use]
    pub fn quantiles(&self, shares: &[f64], equal_areas: bool) -> (Vec<Option<f64>>, f64) {
        let weights = self.grid.weights(equal_areas);
        let mut lit: Vec<(f64, f64)> =
            self.points.iter().zip(weights).filter_map(|(p, w)| Some((p.v_mag()?, w))).collect();
        lit.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = lit.iter().map(|(_, w)| w).sum();
        let at = |share: f64| {
            let mut sum = 0.0;
            lit.iter().find(|(_, w)| {
                sum += w;
                sum >= share * total
            })
        };
        (shares.iter().map(|s| at(*s).or(lit.last()).map(|(v, _)| *v)).collect(), total)
    }

    /// Altitude \[deg\], azimuth \[deg\] and V \[mag\] of every direction; `None` where no light comes from.
    pub fn magnitudes(&self) -> impl Iterator<Item = (f64, f64, Option<f64>)> + '_ {
        self.grid.directions().zip(&self.points).map(|((alt_deg, az_deg), point)| (alt_deg, az_deg, point.v_mag()))
    }

    /// Direction \[deg\] and V of the brightest point.
    #[must_use]
    pub fn brightest(&self) -> Option<((f64, f64), f64)> {
        let lit = self.grid.directions().zip(&self.points).filter_map(|(at, p)| Some((at, p.v_mag()?)));
        lit.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Moonlight at one phase angle over that at another \[deg\]; `None` where the other is dark.
///
/// # Errors
/// As [`SourceSettings::new`].
pub fn phase_ratio(settings: &ModelSettings, wanted_deg: f64, from_deg: f64) -> Result<Option<f64>> {
    let light_sources = light_sources(settings)?;
    let ratio = light_sources.moonlight_at_phase(wanted_deg).flux / light_sources.moonlight_at_phase(from_deg).flux;
    Ok(ratio.is_finite().then_some(ratio))
}

fn light_sources(settings: &ModelSettings) -> Result<SourceSettings> {
    match &settings.band {
        Some(band) => SourceSettings::new(&settings.effects, band),
        None => SourceSettings::new(&settings.effects, &Band::of_config("V")?),
    }
}

/// Light without distances, discs or penumbra can come from infinity: the convention of other programs.
#[must_use]
pub fn parallel_light(effects: &Effects) -> bool {
    effects.distances == Distances::Ignored
        && effects.source_disc == SourceDisc::Point
        && effects.shadow == Shadow::Cylinder
}

/// A vector of the horizon along Earth-fixed axes.
fn in_axes([east, north, up]: &[Vector<Itrs>; 3], v: &Vector<Enu>) -> Vector<Itrs> {
    *east * v.x() + *north * v.y() + *up * v.z()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::model::brightness;
    use crate::config::Mode;

    const AXES: [Vector<Itrs>; 3] =
        [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];

    fn sky(moon: Option<Body>) -> Sky {
        let sun = Body::sun((-10.0_f64).to_radians(), 1.0).at_infinity();
        Sky::new(AXES, (6378.0, 550.0), 1.5, sun, moon.map(Body::at_infinity)).unwrap()
    }

    #[test]
    fn every_satellite_is_on_its_sphere_in_its_direction_and_moves_along_its_horizon() {
        let sky = sky(None);
        for (alt_deg, az_deg) in SkyGrid::new(7, 9).unwrap().directions() {
            let scene = sky.scene(alt_deg.to_radians(), az_deg.to_radians());
            assert!((scene.satellite_km.norm() - 6928.0).abs() < 1e-8);
            let line = scene.satellite_km - scene.observer_km;
            assert!((line.z().atan2(line.x().hypot(line.y())).to_degrees() - alt_deg).abs() < 1e-7);
            assert!(scene.velocity_km_s.dot(&scene.satellite_km).abs() < 1e-8);
            assert!((scene.velocity_km_s.norm() - 7.585).abs() < 0.001);
        }
    }

    #[test]
    fn a_sky_turned_with_its_light_sources_is_the_same_sky() {
        let satellite = Satellite::named("starlink-v1.5").unwrap();
        let settings = ModelSettings::new(Mode::AsPublished, 1e-6);
        let turned = |by_rad: f64| {
            let sun = Body::sun(-0.1, 1.0 + by_rad).at_infinity();
            let moon = Body::moon(0.5, 3.0 + by_rad).at_infinity();
            let sky = Sky::new(AXES, (6378.0, 550.0), 0.3 + by_rad, sun, Some(moon)).unwrap();
            let b = brightness(&sky.scene(0.7, 2.0 + by_rad), &satellite, &settings).unwrap();
            [b.sun.flux_ratio, b.earthshine.flux_ratio, b.moon.flux_ratio, b.lunar_earthshine.flux_ratio]
        };
        for (a, b) in turned(0.0).into_iter().zip(turned(1.234)) {
            assert!((a - b).abs() <= 1e-9 * a, "{a} {b}");
        }
    }

    #[test]
    fn the_map_is_the_same_for_any_number_of_threads_and_has_no_moonlight_without_a_moon() {
        let satellite = Satellite::named("starlink-v1.5").unwrap();
        let settings = ModelSettings::new(Mode::AsPublished, 1e-3);
        let grid = SkyGrid::new(5, 9).unwrap();
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| sky_map(&sky(None), &grid, &satellite, &settings, &|| ()).unwrap())
        };
        let map = on(1);
        assert_eq!(map, on(3));
        assert!(map.points.iter().all(|p| p.lights[2] == 0.0 && p.lights[3] == 0.0));
        // azimuth 0 and 360 are one direction
        let (first, last) = (&map.points[2], &map.points[8 * 5 + 2]);
        assert!((first.flux() / last.flux() - 1.0).abs() < 1e-9);
        assert!(map.points.iter().any(|p| p.flux() > 0.0));
    }

    #[test]
    fn weights_of_equal_areas_favour_the_horizon_and_both_sum_to_one() {
        let grid = SkyGrid::new(10, 5).unwrap();
        for equal_areas in [true, false] {
            assert!((grid.weights(equal_areas).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        let areas = grid.weights(true);
        assert!(areas[9] < 1e-12 && areas[1] > areas[8]);
        assert!(SkyGrid::new(1, 5).is_err() && SkyGrid::new(usize::MAX, 3).is_err());
    }

    #[test]
    fn quantiles_count_the_lit_sky_alone() {
        let grid = SkyGrid::new(2, 3).unwrap();
        let lit = |v: f64| SkyPoint { lights: [10_f64.powf(-0.4 * v), 0.0, 0.0, 0.0], ..SkyPoint::default() };
        let points = vec![lit(5.0), lit(6.0), lit(7.0), SkyPoint::default(), SkyPoint::default(), SkyPoint::default()];
        let map = SkyMap { grid, points, sun_flux: 1.0 };
        let (quantiles, share) = map.quantiles(&[0.5], false);
        // weights 1/8 at the corners, 1/4 in the middle: 5 and 6 at azimuth 0, 7 at 180 deg
        assert!((quantiles[0].unwrap() - 6.0).abs() < 1e-12 && (share - 0.5).abs() < 1e-12);
        assert!((map.brightest().unwrap().1 - 5.0).abs() < 1e-12);
    }
}
