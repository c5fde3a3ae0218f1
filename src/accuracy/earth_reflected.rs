//! Light by way of the Earth: error and cost of the integral by tolerance and scattering law.
//!
//! Nadir-facing plates 550 km up, anywhere in the sky of an observer, the Sun 2° to 40° below or above the horizon;
//! ground of vegetation. The reference is the same integral at tolerance 1e-12.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::sky::{Body, Sky};
use crate::brightness::{Accuracy, Brdf, Ground, ModelSettings, PreparedBrdf, Scene, plain_rule};

const HEIGHT_KM: f64 = 550.0;
const TOLERANCES: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];
const REFERENCE: f64 = 1e-12;
/// Gauss nodes in ζ and places in φ of a product rule that knows no edge and no lobe.
const PLAIN: [(usize, usize); 4] = [(8, 16), (16, 32), (32, 64), (64, 128)];
const MOST_NODES: usize = 20_000_000;
const AXES: [Vector<Itrs>; 3] = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];

/// `n` scenes over the sky, the Sun between −40° and +40°.
fn scenes(n: usize, seed: u64) -> Result<Vec<Scene>> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let sun_alt_deg: f64 = rng.random_range(-40.0..40.0);
            let sun = Body::sun(sun_alt_deg.to_radians(), rng.random_range(0.0..std::f64::consts::TAU)).at_infinity();
            let sky = Sky::new(AXES, (PUBLISHED_EARTH_RADIUS_KM, HEIGHT_KM), 0.0, sun, None)?;
            Ok(sky.scene(rng.random_range(5f64..90.0).to_radians(), rng.random_range(0.0..std::f64::consts::TAU)))
        })
        .collect()
}

/// One integral: a scene and a law.
struct Case {
    ground: Ground,
    normal: Vector<Itrs>,
    observer: Vector<Itrs>,
}

/// `None` where no lit ground is in view.
fn case(scene: &Scene, earth: &Brdf) -> Option<Case> {
    let ground = Ground::new(&scene.satellite_km, PUBLISHED_EARTH_RADIUS_KM, &scene.sun_km, earth)?;
    let (normal, observer) = ((-scene.satellite_km).unit()?, (scene.observer_km - scene.satellite_km).unit()?);
    Some(Case { ground, normal, observer })
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let default = ModelSettings::default().tolerance;
    let earth = Brdf::named("earth-vegetation")?;
    let laws = [
        ("Lambert", Brdf::Lambert { albedo: 0.3 }),
        ("Phong n = 9", Brdf::Phong { kd: 0.34, ks: 0.4, n: 8.9 }),
        ("Phong n = 1e4", Brdf::Phong { kd: 0.0, ks: 1.0, n: 1e4 }),
        ("ABG of a painted plate", Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 }),
        ("Starlink chassis, laboratory", Brdf::named("starlink-chassis-lab")?),
    ];
    let scenes = scenes(stopwatch.effort.of(12, 200), stopwatch.seed(6))?;
    let cases: Vec<Case> = scenes.iter().filter_map(|scene| case(scene, &earth)).collect();
    let mut series = Vec::new();
    for (label, brdf) in laws {
        let law = PreparedBrdf::new(&brdf);
        let light = |case: &Case, tolerance: f64| {
            law.reflected(&case.ground, &case.normal, &case.observer, &Accuracy::relative(tolerance, MOST_NODES)).per_sr
        };
        let exact: Vec<f64> = cases.iter().map(|c| light(c, REFERENCE)).collect();
        let mut points = Vec::new();
        for tolerance in TOLERANCES {
            let off: Vec<f64> = (cases.iter().zip(&exact).filter(|(_, exact)| **exact > 0.0))
                .map(|(case, exact)| light(case, tolerance) / exact - 1.0)
                .collect();
            let all_us = cpu_us(stopwatch, || {
                for case in &cases {
                    std::hint::black_box(light(case, tolerance));
                }
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: format!("{tolerance:e}"),
                errors,
                cpu_us: all_us / cases.len() as f64,
                memory_kb: None,
                is_default: tolerance == default,
            }));
        }
        for rule in PLAIN {
            let plain = |c: &Case| plain_rule(&c.ground, &brdf, &c.normal, &c.observer, rule);
            let off: Vec<f64> = (cases.iter().zip(&exact).filter(|(_, exact)| **exact > 0.0))
                .map(|(case, exact)| plain(case) / exact - 1.0)
                .collect();
            let all_us = cpu_us(stopwatch, || {
                for case in &cases {
                    std::hint::black_box(plain(case));
                }
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: format!("{}x{}", rule.0, rule.1),
                errors,
                cpu_us: all_us / cases.len() as f64,
                memory_kb: None,
                is_default: false,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "tolerance, or nodes of a plain rule",
        work: "one integral",
        error: "relative",
        reference: "the same integral at tolerance 1e-12",
        default_because: "1e-4 is 0.1 mmag, a hundredth of what the scattering laws are known to, and costs little more \
                          than 1e-3",
        series,
    })
}
