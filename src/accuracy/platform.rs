//! A platform that is large against its range: error and cost of dividing it.
//!
//! A plate of 4 km, 300 to 600 km up, Sunlight and Earthshine together. Errors relative to the flux. The reference is the
//! sum over 24 × 24 plates of their own, extrapolated from 12 × 12 (the error of the midpoint rule falls as h²).

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::AU_KM;
use crate::base::error::Result;
use crate::base::vector::Vector;
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::{Attitude, Brdf, Model, ModelSettings, Satellite, Scene, Surface};
use crate::config::{Mode, PlatformSize};

const R_KM: f64 = PUBLISHED_EARTH_RADIUS_KM;
const SIDE_KM: f64 = 4.0;
const PIECES: [usize; 3] = [2, 4, 8];
const REFERENCE: [usize; 2] = [12, 24];

fn settings(size: PlatformSize, tolerance: f64) -> ModelSettings {
    let mut settings =
        ModelSettings { earth_radius_km: Some(R_KM), moon: false, ..ModelSettings::new(Mode::Corrected, tolerance) };
    settings.effects.platform_size = size;
    settings
}

fn plate(side_km: f64, brdf: &Brdf) -> Satellite {
    let attitude = Attitude::Fixed(Vector::new(0.0, 0.0, -1.0));
    let surface =
        Surface { name: "platform".into(), area_m2: 1e6 * side_km * side_km, attitude, brdf: brdf.clone(), back: None };
    Satellite::of("platform", vec![surface])
}

fn scene(rng: &mut ChaCha12Rng) -> Scene {
    let (off, sun): (f64, f64) = (rng.random_range(0.0..0.1), rng.random_range(-15f64..40.0).to_radians());
    let turn: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    Scene {
        satellite_km: Vector::new(0.0, 0.0, R_KM + rng.random_range(300.0..600.0)),
        velocity_km_s: Vector::new(7.6, 0.0, 0.0),
        observer_km: Vector::new(off.sin() * turn.cos(), off.sin() * turn.sin(), off.cos()) * R_KM,
        sun_km: Vector::new(0.0, sun.cos(), sun.sin()) * AU_KM,
        moon_km: Vector::new(0.0, 0.0, -384_400.0),
        sidereal_rad: 0.0,
    }
}

/// n × n plates of their own, each a point.
fn in_pieces(model: &Model, scene: &Scene, side_km: f64, n: usize) -> Result<f64> {
    let along = |k: usize| ((k as f64 + 0.5) / n as f64 - 0.5) * side_km;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let satellite_km = scene.satellite_km + Vector::new(along(i), along(j), 0.0);
            let b = model.brightness(&Scene { satellite_km, ..*scene })?;
            sum += b.sun.flux_ratio + b.earthshine.flux_ratio;
        }
    }
    Ok(sum)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let side_km = SIDE_KM;
    let mut series = Vec::new();
    for (label, n) in [("Phong n = 9", 8.9), ("Phong n = 1000", 1e3)] {
        let law = Brdf::Phong { kd: 0.1, ks: 0.5, n };
        let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(22));
        let scenes: Vec<Scene> = (0..stopwatch.effort.of(4, 40)).map(|_| scene(&mut rng)).collect();
        let piece = |n: usize, tolerance: f64| {
            Model::new(&plate(side_km / n as f64, &law), &settings(PlatformSize::Point, tolerance))
        };
        let mut exact = Vec::new();
        for scene in &scenes {
            let [coarse, fine] = REFERENCE;
            let coarse = in_pieces(&piece(coarse, 1e-7)?, scene, side_km, coarse)?;
            let fine = in_pieces(&piece(fine, 1e-7)?, scene, side_km, fine)?;
            exact.push(fine + (fine - coarse) / 3.0);
        }
        let whole = Model::new(&plate(side_km, &law), &settings(PlatformSize::Subdivided, 1e-4))?;
        let mut points = Vec::new();
        let mut add = |setting: String, light: &dyn Fn(&Scene) -> Result<f64>, is_default: bool| -> Result<()> {
            let mut off = Vec::new();
            for (scene, exact) in scenes.iter().zip(&exact).filter(|(_, exact)| **exact > 0.0) {
                off.push(light(scene)? / exact - 1.0);
            }
            let us = cpu_us(stopwatch, || {
                scenes.iter().for_each(|scene| {
                    std::hint::black_box(light(scene).is_ok());
                });
            });
            let cpu_us = us / scenes.len() as f64;
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting,
                errors,
                cpu_us,
                memory_kb: None,
                is_default,
            }));
            Ok(())
        };
        let point = piece(1, 1e-4)?;
        add("a point".into(), &|scene| in_pieces(&point, scene, side_km, 1), false)?;
        for n in PIECES {
            let piece = piece(n, 1e-4)?;
            add(format!("{n} x {n} plates"), &|scene| in_pieces(&piece, scene, side_km, n), false)?;
        }
        let divided = |scene: &Scene| whole.brightness(scene).map(|b| b.sun.flux_ratio + b.earthshine.flux_ratio);
        add("Gauss to 1e-4".into(), &divided, true)?;
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "model.effects.platform_size",
        work: "one scene",
        error: "relative",
        reference: "24 x 24 plates of their own, extrapolated",
        default_because: "the one way that knows its own error: Gauss rules of rising order stop when two agree to 1e-4. Plates \
                          below a thousandth of their range are points and cost as much as points",
        series,
    })
}
