//! The Sun is a disc: error and cost of taking it for a point in a direct reflection, by scattering law.
//!
//! Geometries within a degree of the mirror direction, where it matters, and far from it. The reference is the mean of
//! the law over the disc by brute force: rings of points of equal area.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::{AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::{Brdf, ModelSettings, direct_reflection};
use crate::config::SourceDisc;

/// Rings of the reference, and points on each: the mean of a law as wide as the disc to about 1e-7.
const RINGS: (usize, usize) = (400, 256);

/// Light source, normal, observer.
pub(super) type Case = [Vector<Itrs>; 3];

/// Directions towards the Sun and the observer on the upper side of a plate; every second within a degree of the
/// mirror direction.
pub(super) fn cases(n: usize, seed: u64) -> Vec<Case> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let normal = Vector::new(0.0, 0.0, 1.0);
    let direction = |zenith: f64, azimuth: f64| {
        Vector::new(zenith.sin() * azimuth.cos(), zenith.sin() * azimuth.sin(), zenith.cos())
    };
    (0..n)
        .map(|k| {
            let (zenith, azimuth): (f64, f64) = (rng.random_range(0.05..1.3), rng.random_range(0.0..TAU));
            let off = if k % 2 == 0 { 0.0175 } else { 0.2 };
            let mirrored = azimuth + TAU / 2.0 + rng.random_range(-off..off);
            let observer = direction((zenith + rng.random_range(-off..off)).abs().min(1.5), mirrored);
            [direction(zenith, azimuth), normal, observer]
        })
        .collect()
}

/// Mean of f (n·s) over the disc, by points of equal solid angle.
pub(super) fn by_brute_force(brdf: &Brdf, [light_source, normal, observer]: &Case, disc_rad: f64) -> f64 {
    let Some(u) = light_source.any_perpendicular() else { return f64::NAN };
    let v = light_source.cross(&u);
    let (rings, spokes) = RINGS;
    let mut sum = 0.0;
    for ring in 0..rings {
        // equal solid angles: cos r falls linearly
        let share = (ring as f64 + 0.5) / rings as f64;
        let half = (0.5 * disc_rad).sin();
        let radius = 2.0 * (half * share.sqrt()).asin();
        for spoke in 0..spokes {
            let turn = TAU * (spoke as f64 + 0.5 * (ring % 2) as f64) / spokes as f64;
            let side = u * (radius.sin() * turn.cos()) + v * (radius.sin() * turn.sin());
            let s = *light_source * radius.cos() + side;
            sum += brdf.value(&s, normal, observer) * normal.dot(&s).max(0.0);
        }
    }
    sum / (rings * spokes) as f64
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let disc_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let laws = [
        ("Lambert", Brdf::Lambert { albedo: 0.3 }),
        ("Phong n = 9", Brdf::Phong { kd: 0.34, ks: 0.4, n: 8.9 }),
        ("Phong n = 1e4", Brdf::Phong { kd: 0.0, ks: 1.0, n: 1e4 }),
        ("Phong n = 1e6", Brdf::Phong { kd: 0.0, ks: 1.0, n: 1e6 }),
        ("ABG of a painted plate", Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 }),
        ("Starlink chassis, laboratory", Brdf::named("starlink-chassis-lab")?),
    ];
    let cases = cases(stopwatch.effort.of(12, 120), stopwatch.seed(7));
    let default = ModelSettings::default().effects.source_disc;
    let mut series = Vec::new();
    for (label, brdf) in laws {
        let exact: Vec<f64> = cases.iter().map(|case| by_brute_force(&brdf, case, disc_rad)).collect();
        // what is a millionth of the brightest is no light
        let least = 1e-6 * exact.iter().copied().fold(0.0, f64::max);
        let mut points = Vec::new();
        for (setting, disc) in [("point", SourceDisc::Point), ("convolved", SourceDisc::Convolved)] {
            let light = |[light_source, normal, observer]: &Case| {
                direct_reflection(&brdf, light_source, normal, observer, disc_rad, disc)
            };
            let off: Vec<f64> = (cases.iter().zip(&exact).filter(|(_, exact)| **exact > least))
                .map(|(case, exact)| light(case) / exact - 1.0)
                .collect();
            let all_us = cpu_us(stopwatch, || {
                for case in &cases {
                    std::hint::black_box(light(case));
                }
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: setting.into(),
                errors,
                cpu_us: all_us / cases.len() as f64,
                memory_kb: None,
                is_default: disc == default,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "source_disc",
        work: "one direct reflection",
        error: "relative",
        reference: "mean of the law over 102 400 points of the disc",
        default_because: "a lobe narrower than the Sun is wrong by any factor with a point; broad laws cost no more",
        series,
    })
}
