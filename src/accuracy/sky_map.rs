//! An all-sky map: error of reading a magnitude between its points, and the cost of the map, by spacing and by tolerance.
//!
//! Starlink V1.5 at 550 km with laboratory laws, the Sun 12° below the horizon. Between the points the logarithm of the
//! flux is linear in altitude and azimuth. The reference is the model in that very direction.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us, timed};
use crate::base::error::{Error, Result};
use crate::base::vector::Vector;
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::sky::{Body, Sky, SkyGrid, SkyMap, sky_map};
use crate::brightness::{Model, ModelSettings, Satellite, ToleranceOf};

const SATELLITE: &str = "starlink-v1.5-lab";
const HEIGHT_KM: f64 = 550.0;
/// Altitudes and azimuths of the maps.
const GRIDS: [(usize, usize); 5] = [(10, 19), (16, 37), (31, 73), (46, 121), (91, 181)];
/// Those of `satphot predict sky` by default.
const DEFAULT: (usize, usize) = (31, 73);
/// Tolerances of the sum of the lights, and that of `satphot predict sky`.
const TOLERANCES: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-6];
const DEFAULT_TOLERANCE: f64 = 1e-4;
/// Directions this near the horizon are excluded \[rad\]: nobody observes there.
const LEAST_ALT_RAD: f64 = 0.0873;

/// V between the points of a map; `None` next to a direction without light.
fn between(map: &SkyMap, alt_deg: f64, az_deg: f64) -> Option<f64> {
    let (n_alt, n_az) = (map.grid.alt_deg.len(), map.grid.az_deg.len());
    let (u, w) = (alt_deg / 90.0 * (n_alt - 1) as f64, az_deg / 360.0 * (n_az - 1) as f64);
    let (i, j) = ((u as usize).min(n_alt - 2), (w as usize).min(n_az - 2));
    let (s, t) = (u - i as f64, w - j as f64);
    let at = |di: usize, dj: usize| map.points[(j + dj) * n_alt + i + di].v_mag();
    Some((1.0 - t) * ((1.0 - s) * at(0, 0)? + s * at(1, 0)?) + t * ((1.0 - s) * at(0, 1)? + s * at(1, 1)?))
}

/// The map of the default grid by the tolerance of the sum of its lights, at its points.
fn by_tolerance(
    stopwatch: &Stopwatch,
    sky: &Sky,
    satellite: &Satellite,
    settings: &ModelSettings,
) -> Result<Vec<SweepPoint>> {
    let grid = SkyGrid::new(DEFAULT.0, DEFAULT.1)?;
    let map = |tolerance: f64| {
        let settings = ModelSettings { tolerance, tolerance_of: ToleranceOf::Total, ..settings.clone() };
        sky_map(sky, &grid, satellite, &settings, &|| ())
    };
    let exact = map(1e-8)?;
    let mut points = Vec::new();
    for tolerance in TOLERANCES {
        let (found, cpu_us) = timed(stopwatch, || map(tolerance))?;
        let both = found.points.iter().zip(&exact.points);
        let off: Vec<f64> = both.filter_map(|(a, b)| Some(a.v_mag()? - b.v_mag()?)).collect();
        points.extend(Errors::of(&off).map(|errors| SweepPoint {
            setting: format!("{tolerance:e}"),
            errors,
            cpu_us,
            memory_kb: None,
            is_default: tolerance == DEFAULT_TOLERANCE,
        }));
    }
    Ok(points)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let axes = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];
    let sun = Body::sun((-12f64).to_radians(), FRAC_PI_2).at_infinity();
    let sky = Sky::new(axes, (PUBLISHED_EARTH_RADIUS_KM, HEIGHT_KM), 0.0, sun, None)?;
    let satellite = Satellite::named(SATELLITE)
        .ok_or_else(|| Error::Model { problem: format!("{SATELLITE} is not in the list of satellites") })?;
    let settings = ModelSettings { moon: false, ..ModelSettings::default() };
    let model = Model::new(
        &satellite,
        &ModelSettings { earth_radius_km: Some(PUBLISHED_EARTH_RADIUS_KM), ..settings.clone() },
    )?;
    let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(8));
    let mut truth = Vec::new();
    for _ in 0..stopwatch.effort.of(300, 5000) {
        // even over the sky: the sine of the altitude is uniform
        let alt = rng.random_range(LEAST_ALT_RAD.sin()..1.0f64).asin();
        let az = rng.random_range(0.0..TAU);
        if let Some(mag) = model.brightness(&sky.scene(alt, az))?.total_v_mag {
            truth.push((alt.to_degrees(), az.to_degrees(), mag));
        }
    }
    let mut points = Vec::new();
    for (n_alt, n_az) in GRIDS {
        let grid = SkyGrid::new(n_alt, n_az)?;
        let map = sky_map(&sky, &grid, &satellite, &settings, &|| ())?;
        let off: Vec<f64> =
            truth.iter().filter_map(|(alt, az, mag)| between(&map, *alt, *az).map(|m| m - mag)).collect();
        let mut failed = None;
        let us = cpu_us(stopwatch, || {
            failed = sky_map(&sky, &grid, &satellite, &settings, &|| ()).err();
        });
        if let Some(error) = failed {
            return Err(error);
        }
        let kb = (map.points.len() * size_of_val(&map.points[0])) as f64 / 1024.0;
        points.extend(Errors::of(&off).map(|errors| SweepPoint {
            setting: format!("{n_alt}x{n_az}"),
            errors,
            cpu_us: us,
            memory_kb: Some(kb),
            is_default: (n_alt, n_az) == DEFAULT,
        }));
    }
    Ok(Sweep {
        knob: "grid, tolerance",
        work: "one map",
        error: "mag",
        reference: "the model in the very direction; of tolerances the same map at 1e-8",
        default_because: "3 x 5 deg is what a figure shows; a finer map can be requested. Tolerances count at the points, where the sum \
                          of the lights has them",
        series: vec![
            Series { label: "Starlink V1.5, Sun at -12 deg: grid".into(), points },
            Series {
                label: "the same: tolerance".into(),
                points: by_tolerance(stopwatch, &sky, &satellite, &settings)?,
            },
        ],
    })
}
