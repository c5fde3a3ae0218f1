//! The stated error of the Earth-reflected light against its true error, over geometries drawn to be difficult.
//!
//! The oracle is another method (`oracle.rs`). The long run is `scripts/prove_stated_error.sh`.

mod oracle;
mod rule;

use std::env;
use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{Accuracy, Binomial, Brdf, Ground, ReflectedLight, reflected_by_earth};

use oracle::Case;
use rule::Sum;

const RADIUS_KM: f64 = 6378.0;
const VEGETATION: Brdf = Brdf::Phong { kd: 0.53, ks: 0.28, n: 7.31 };
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-9];
/// Nodes allowed, as in the settings of the program.
const MAX_NODES: usize = 200_000;
/// E d²/A below which the lit ground is a sliver \[1/sr\].
const SLIVER_PER_SR: f64 = 1e-8;

/// A surface over the lit Earth.
#[derive(Debug, Clone)]
struct Geometry {
    height_km: f64,
    elevation_deg: f64,
    earth: Brdf,
    brdf: Brdf,
    normal: Vector<Itrs>,
    observer: Vector<Itrs>,
}

impl Geometry {
    fn satellite_km(&self) -> Vector<Itrs> {
        Vector::new(0.0, 0.0, RADIUS_KM + self.height_km)
    }

    fn source(&self) -> Vector<Itrs> {
        let (sin_e, cos_e) = self.elevation_deg.to_radians().sin_cos();
        Vector::new(0.0, cos_e, sin_e)
    }

    fn engine(&self, tolerance: f64) -> ReflectedLight {
        let ground = Ground::new(&self.satellite_km(), RADIUS_KM, &self.source(), &self.earth).unwrap();
        let accuracy = Accuracy::relative(tolerance, MAX_NODES);
        reflected_by_earth(&ground, &self.brdf, &self.normal, &self.observer, &accuracy)
    }

    fn oracle(&self) -> Sum {
        let k = RADIUS_KM / (RADIUS_KM + self.height_km);
        Case::new(k, self.source(), [&self.earth, &self.brdf], [self.normal, self.observer]).per_sr()
    }

    /// E d²/A.
    fn is_sliver(&self, per_sr: f64) -> bool {
        per_sr * self.normal.dot(&self.observer) < SLIVER_PER_SR
    }
}

fn direction(nadir_deg: f64, azimuth_deg: f64) -> Vector<Itrs> {
    let ((s, c), (sa, ca)) = (nadir_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    Vector::new(s * ca, s * sa, -c)
}

fn chassis() -> Brdf {
    Brdf::Binomial(Arc::new(Binomial {
        b: vec![vec![3.34, -98.085]],
        c: vec![vec![-999.999, 867.538, 1000.0, 1000.0, -731.248, 618.552, -294.054, 269.248, -144.853, 75.196]],
        d: 3.0,
        l1: -5,
    }))
}

/// A geometry drawn among the difficult ones: mirror directions beside limb and terminator, cusps, slivers.
fn draw(rng: &mut ChaCha8Rng) -> Geometry {
    let height_km = 10.0_f64.powf(rng.random_range(2.0..6.0));
    let k = RADIUS_KM / (RADIUS_KM + height_km);
    let (dip_deg, limb_deg) = (k.acos().to_degrees(), k.asin().to_degrees());
    let elevation_deg = match rng.random_range(0..6) {
        0 => 0.0,
        1 => 90.0,
        2 => -dip_deg * rng.random_range(0.9..0.999),
        _ => rng.random_range(-dip_deg..90.0),
    };
    let exponents = [0.0, 0.05, 0.26, 1.0, 2.5, 7.31, 60.0, 200.0, 1e3];
    let exponent = |rng: &mut ChaCha8Rng| exponents[rng.random_range(0..exponents.len())];
    let earth = match rng.random_range(0..3) {
        0 => Brdf::Lambert { albedo: 0.3 },
        1 => VEGETATION,
        _ => Brdf::Phong { kd: 0.2, ks: 0.5, n: exponent(rng) },
    };
    let brdf = match rng.random_range(0..7) {
        0 => Brdf::Lambert { albedo: 0.6 },
        1 => Brdf::Phong { kd: 0.1, ks: 0.4, n: exponent(rng) },
        2 => Brdf::Phong { kd: 0.0, ks: 0.9, n: 10.0_f64.powf(rng.random_range(1.0..6.0)) },
        3 => Brdf::Gaussian { peak_per_sr: 10.0, sigma: 10.0_f64.powf(rng.random_range(-9.0..-1.0)) },
        4 | 5 => Brdf::Abg { a: 1e-3, b: 10.0_f64.powf(rng.random_range(-11.0..-1.0)), g: rng.random_range(1.2..3.0) },
        _ => chassis(),
    };
    let observer = direction(limb_deg * rng.random_range(0.0..1.0), rng.random_range(0.0..360.0));
    let mut normal = direction(rng.random_range(0.0..150.0), rng.random_range(0.0..360.0));
    match rng.random_range(0..6) {
        0 | 1 => normal = Vector::new(0.0, 0.0, -1.0),
        2 | 3 => {
            // a glint from near the limb, some very near
            let side = if rng.random_range(0..2) == 0 { -1.0 } else { 1.0 };
            let off = if rng.random_range(0..2) == 0 {
                rng.random_range(0.0..0.02)
            } else {
                10.0_f64.powf(rng.random_range(-5.0..-1.5))
            };
            let at = direction(limb_deg * (1.0 + side * off), rng.random_range(0.0..360.0));
            normal = (at + observer).unit().unwrap();
        }
        _ => {}
    }
    Geometry { height_km, elevation_deg, earth, brdf, normal, observer }
}

/// One geometry at one tolerance.
struct Verdict {
    tolerance: f64,
    /// True error over the stated one.
    ratio: f64,
    line: String,
}

/// The verdicts over `count` geometries that are judged, and how many were drawn, slivers, and not known ten times better.
fn judge(seed: u64, count: usize, tolerances: &[f64]) -> (Vec<Verdict>, [usize; 3]) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut verdicts, mut judged, mut counts) = (Vec::new(), 0, [0; 3]);
    while judged < count {
        let drawn: Vec<Geometry> = (0..64).map(|_| draw(&mut rng)).collect();
        let results: Vec<Option<(Sum, Vec<ReflectedLight>)>> = drawn
            .par_iter()
            .map(|g| {
                let lights: Vec<ReflectedLight> = tolerances.iter().map(|t| g.engine(*t)).collect();
                let some = lights.last().is_some_and(|light| !g.is_sliver(light.per_sr));
                some.then(|| (g.oracle(), lights))
            })
            .collect();
        for (g, result) in drawn.iter().zip(results) {
            if judged == count {
                break;
            }
            counts[0] += 1;
            let Some((oracle, lights)) = result.filter(|r| !g.is_sliver(r.0.value)) else {
                counts[1] += 1;
                continue;
            };
            judged += 1;
            for (tolerance, light) in tolerances.iter().zip(lights) {
                let off = (light.per_sr - oracle.value).abs();
                if oracle.err > 0.1 * light.err_per_sr.max(tolerance * oracle.value) {
                    counts[2] += 1;
                    continue;
                }
                let line = format!(
                    "{tolerance:e}: off {:.2e}, stated {:.2e}, oracle {:.1e}, {} nodes, {:e} 1/sr: {g:?}",
                    off / oracle.value,
                    light.err_per_sr / oracle.value,
                    oracle.err / oracle.value,
                    light.nodes,
                    oracle.value
                );
                verdicts.push(Verdict { tolerance: *tolerance, ratio: off / (light.err_per_sr + oracle.err), line });
            }
        }
    }
    (verdicts, counts)
}

/// A number from the environment.
fn setting(name: &str, default: u64) -> u64 {
    env::var(name).ok().map_or(default, |text| text.parse().expect(name))
}

#[test]
fn the_stated_error_holds_over_a_few_difficult_geometries() {
    let (verdicts, [_, _, unknown]) = judge(3_105, 40, &TOLERANCES);
    let beyond = |limit: f64| verdicts.iter().filter(|v| v.ratio > limit).map(|v| v.line.clone()).collect::<Vec<_>>();
    assert!(unknown == 0 && verdicts.len() == 120, "{unknown}");
    // 99.8 % hold over thousands (scripts/prove_stated_error.sh)
    assert!(beyond(1.0).len() <= 1 && beyond(2.0).is_empty(), "{:#?}", beyond(1.0));
}

/// Spikes so narrow that the rings do not resolve them, with the mirror direction next to the limb and a lobe of the ground.
fn draw_spike(rng: &mut ChaCha8Rng) -> Geometry {
    let height_km = 10.0_f64.powf(rng.random_range(2.6..4.6));
    let limb_deg = (RADIUS_KM / (RADIUS_KM + height_km)).asin().to_degrees();
    let observer = direction(limb_deg * rng.random_range(0.0..0.9), rng.random_range(0.0..360.0));
    let side = if rng.random_range(0..2) == 0 { -1.0 } else { 1.0 };
    let off = 10.0_f64.powf(rng.random_range(-7.0..-2.0));
    let at = direction(limb_deg * (1.0 + side * off), rng.random_range(0.0..360.0));
    Geometry {
        height_km,
        elevation_deg: rng.random_range(0.0..90.0),
        earth: Brdf::Phong { kd: 0.2, ks: 0.5, n: 200.0 },
        brdf: Brdf::Abg { a: 1e-3, b: 10.0_f64.powf(rng.random_range(-11.0..-8.0)), g: rng.random_range(1.2..3.0) },
        normal: (at + observer).unit().unwrap(),
        observer,
    }
}

#[test]
fn spikes_next_to_the_limb_meet_the_tolerance_or_say_so() {
    let mut rng = ChaCha8Rng::seed_from_u64(setting("SATPHOT_SEED", 77_003));
    let count = setting("SATPHOT_GEOMETRIES", 6) as usize;
    let drawn: Vec<Geometry> = (0..count).map(|_| draw_spike(&mut rng)).collect();
    let lines: Vec<(f64, bool, String)> = drawn
        .par_iter()
        .flat_map_iter(|g| {
            let oracle = g.oracle();
            [1e-4, 1e-9].map(|tolerance| {
                let light = g.engine(tolerance);
                let off = (light.per_sr - oracle.value).abs();
                let line = format!(
                    "{tolerance:e}: off {:.1e}, stated {:.1e}, oracle {:.0e}, {} nodes: {g:?}",
                    off / oracle.value,
                    light.err_per_sr / oracle.value,
                    oracle.err / oracle.value,
                    light.nodes
                );
                (off / (light.err_per_sr + oracle.err), light.err_per_sr <= 1.001 * tolerance * light.per_sr, line)
            })
        })
        .collect();
    println!("{} spikes, {} of {} to the tolerance", count, lines.iter().filter(|l| l.1).count(), lines.len());
    let wrong: Vec<&String> = lines.iter().filter(|l| l.0 > 1.0).map(|l| &l.2).collect();
    let short: Vec<&String> = lines.iter().filter(|l| !l.1).map(|l| &l.2).collect();
    assert!(wrong.len() * 100 <= lines.len(), "{wrong:#?}");
    assert!(short.len() * 20 <= lines.len(), "{short:#?}");
}

#[test]
#[ignore = "minutes: scripts/prove_stated_error.sh"]
fn long_run() {
    let (seed, count) = (setting("SATPHOT_SEED", 20_261), setting("SATPHOT_GEOMETRIES", 5_000) as usize);
    let (verdicts, [drawn, slivers, unknown]) = judge(seed, count, &TOLERANCES);
    println!("seed {seed}: {drawn} drawn, {slivers} slivers, {unknown} of {} not judged", 3 * count);
    for tolerance in TOLERANCES {
        let of: Vec<&Verdict> = verdicts.iter().filter(|v| v.tolerance == tolerance).collect();
        let beyond = |limit: f64| of.iter().filter(|v| v.ratio > limit).count();
        let held = 100.0 * (1.0 - beyond(1.0) as f64 / of.len() as f64);
        println!("{tolerance:e}: {} judged, {held:.2} % stated >= true, {} more than 2x small", of.len(), beyond(2.0));
    }
    for v in verdicts.iter().filter(|v| v.ratio > 1.0) {
        println!("x{:.2} {}", v.ratio, v.line);
    }
}
