//! Laws of the Earth-reflected light, a brute-force integral, and the honesty of its error.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{Accuracy, Binomial, Brdf, Ground, PreparedBrdf, ReflectedLight, reflected_by_earth};

const RADIUS_KM: f64 = 6378.0;
const VEGETATION: Brdf = Brdf::Phong { kd: 0.53, ks: 0.28, n: 7.31 };
const NADIR: Vector<Itrs> = Vector::new(0.0, 0.0, -1.0);

fn light_source(elevation_deg: f64) -> Vector<Itrs> {
    let (sin_e, cos_e) = elevation_deg.to_radians().sin_cos();
    Vector::new(0.0, cos_e, sin_e)
}

fn above(height_km: f64) -> Vector<Itrs> {
    Vector::new(0.0, 0.0, RADIUS_KM + height_km)
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

/// The integral of one case.
fn light(
    height_km: f64,
    elevation_deg: f64,
    earth: &Brdf,
    brdf: &Brdf,
    [normal, observer]: [Vector<Itrs>; 2],
    tolerance: f64,
) -> ReflectedLight {
    let ground = Ground::new(&above(height_km), RADIUS_KM, &light_source(elevation_deg), earth).unwrap();
    reflected_by_earth(&ground, brdf, &normal, &observer, &Accuracy::relative(tolerance, 1_000_000))
}

/// The same as a plain sum over equal cells of the view, from the definition alone: rays cut with a sphere.
fn brute_force(height_km: f64, elevation_deg: f64, brdf: &Brdf, [n, o]: [Vector<Itrs>; 2], cells: usize) -> f64 {
    let (s, satellite) = (light_source(elevation_deg), above(height_km));
    let cos_max = (1.0 - (RADIUS_KM / satellite.z()).powi(2)).sqrt();
    let (mut sum, cell) = (0.0, (1.0 - cos_max) * TAU / (cells * cells) as f64);
    for i in 0..cells {
        let c = cos_max + (1.0 - cos_max) * (i as f64 + 0.5) / cells as f64;
        for j in 0..cells {
            let (sin_a, cos_a) = (TAU * (j as f64 + 0.5) / cells as f64).sin_cos();
            let t = (1.0 - c * c).sqrt();
            let w = Vector::<Itrs>::new(t * cos_a, t * sin_a, -c);
            let along = -w.dot(&satellite);
            let beyond = RADIUS_KM * RADIUS_KM - (satellite.dot(&satellite) - along * along);
            let p = (satellite + w * (along - beyond.max(0.0).sqrt())).unit().unwrap();
            let height = p.dot(&s);
            if height > 0.0 && n.dot(&w) > 0.0 {
                sum += VEGETATION.value(&s, &p, &-w) * height * brdf.value(&w, &n, &o) * n.dot(&w) * cell;
            }
        }
    }
    sum
}

#[test]
fn every_law_is_the_plain_sum_over_the_view() {
    let two_rows = Brdf::Binomial(Arc::new(Binomial {
        b: vec![vec![-0.2, -1.5], vec![0.6, -0.4]],
        c: vec![vec![-1.0, 0.5], vec![0.3]],
        d: 2.0,
        l1: 0,
    }));
    let laws = [
        Brdf::Lambert { albedo: 0.6 },
        Brdf::Phong { kd: 0.1, ks: 0.5, n: 0.0 },
        Brdf::Phong { kd: 0.1, ks: 0.5, n: 0.4 },
        Brdf::Phong { kd: 0.0, ks: 0.9, n: 40.0 },
        Brdf::Gaussian { peak_per_sr: 8.0, sigma: 0.02 },
        Brdf::Abg { a: 0.01, b: 0.02, g: 1.7 },
        two_rows,
    ];
    for (elevation_deg, normal, observer) in [
        (55.0, direction(0.0, 0.0), direction(30.0, 70.0)),
        (-8.0, direction(60.0, 80.0), direction(50.0, 60.0)),
        (5.0, direction(80.0, 140.0), direction(40.0, 200.0)),
    ] {
        for brdf in &laws {
            let got = light(700.0, elevation_deg, &VEGETATION, brdf, [normal, observer], 1e-7);
            let expected = brute_force(700.0, elevation_deg, brdf, [normal, observer], 900);
            // cells cut by an edge: a share of 1/900 each, of random sign
            let off = (got.per_sr / expected - 1.0).abs();
            assert!(off < 1.5e-3, "{brdf:?} at {elevation_deg}: {off:e}");
        }
    }
}

#[test]
fn under_light_from_everywhere_a_nadir_plate_sees_the_view_factor() {
    // the mean of (p·s)₊ over all s is 1/4: L = a/4π everywhere, and ∫ (n·w) dω = π (R/r)²
    for height_km in [400.0, 36_000.0] {
        let steps = 200;
        let mean: f64 = (0..steps)
            .map(|j| {
                let e = (2.0 * (f64::from(j) + 0.5) / f64::from(steps) - 1.0).asin().to_degrees();
                let laws = (Brdf::Lambert { albedo: 0.3 }, Brdf::Lambert { albedo: 1.0 });
                light(height_km, e, &laws.0, &laws.1, [NADIR, NADIR], 1e-6).per_sr
            })
            .sum::<f64>()
            / f64::from(steps);
        let factor = (RADIUS_KM / (RADIUS_KM + height_km)).powi(2);
        // the midpoint rule over the elevations
        assert!((mean * 4.0 * PI / (0.3 * factor) - 1.0).abs() < 1e-4, "{height_km}: {mean}");
    }
}

#[test]
fn from_afar_the_earth_is_a_lambert_sphere() {
    let (earth, plate) = (Brdf::Lambert { albedo: 0.3 }, Brdf::Lambert { albedo: 1.0 });
    for elevation_deg in [90.0_f64, 30.0, 0.0, -45.0, -80.0] {
        let got = light(1e9, elevation_deg, &earth, &plate, [NADIR, NADIR], 1e-8).per_sr * PI;
        let phase = (90.0 - elevation_deg).to_radians();
        let k = RADIUS_KM / (RADIUS_KM + 1e9);
        let expected = 2.0 * 0.3 / (3.0 * PI) * k * k * (phase.sin() + (PI - phase) * phase.cos());
        // parallax of 6e-6 rad, on a crescent of 0.17 rad
        assert!((got / expected - 1.0).abs() < 3e-4, "{elevation_deg}: {}", got / expected);
    }
}

#[test]
fn a_narrow_lobe_becomes_the_mirror() {
    let (normal, observer) = (direction(20.0, 40.0), direction(35.0, 100.0));
    let mirror = light(600.0, 40.0, &VEGETATION, &Brdf::Mirror { reflectance: 1.0 }, [normal, observer], 1e-6);
    let cos_out = normal.dot(&observer);
    for (sigma, claim) in [(1e-4, 2e-3), (1e-6, 2e-5), (1e-8, 2e-7), (1e-10, 1e-7)] {
        // ∫ f (n·w) dω = 2πσ A (n·m)
        let peak_per_sr = 1.0 / (2.0 * PI * sigma * cos_out);
        let gaussian = Brdf::Gaussian { peak_per_sr, sigma };
        let got = light(600.0, 40.0, &VEGETATION, &gaussian, [normal, observer], 1e-8);
        assert!((got.per_sr / mirror.per_sr - 1.0).abs() < claim, "{sigma}: {}", got.per_sr / mirror.per_sr);
    }
}

#[test]
fn the_light_of_two_laws_is_that_of_their_sum() {
    let (normal, observer) = (direction(30.0, 60.0), direction(20.0, 10.0));
    for n in [0.7, 12.0, 3000.0] {
        let of = |brdf: &Brdf| light(550.0, 12.0, &VEGETATION, brdf, [normal, observer], 1e-9).per_sr;
        let both = of(&Brdf::Phong { kd: 0.3, ks: 0.4, n });
        let parts = of(&Brdf::Lambert { albedo: 0.3 }) + of(&Brdf::Phong { kd: 0.0, ks: 0.4, n });
        assert!((both / parts - 1.0).abs() < 4e-9, "{n}: {:e}", both / parts - 1.0);
    }
}

#[test]
fn left_and_right_of_the_light_source_are_the_same_and_so_is_every_turned_scene() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for brdf in [Brdf::Lambert { albedo: 0.5 }, Brdf::Phong { kd: 0.1, ks: 0.3, n: 300.0 }, chassis()] {
        let (normal, observer) = (direction(15.0, 70.0), direction(33.0, 130.0));
        let accuracy = Accuracy::relative(1e-6, 1_000_000);
        let value = |turn: &dyn Fn(Vector<Itrs>) -> Vector<Itrs>| {
            let ground = Ground::new(&turn(above(550.0)), RADIUS_KM, &turn(light_source(7.0)), &VEGETATION).unwrap();
            reflected_by_earth(&ground, &brdf, &turn(normal), &turn(observer), &accuracy).per_sr
        };
        let here = value(&|v| v);
        let mirrored = value(&|v| Vector::new(-v.x(), v.y(), v.z()));
        assert!((mirrored / here - 1.0).abs() < 1e-11, "{brdf:?}: {:e}", mirrored / here - 1.0);
        let axis = |rng: &mut ChaCha8Rng| {
            Vector::<Itrs>::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
        };
        let x = axis(&mut rng).unit().unwrap();
        let y = x.cross(&axis(&mut rng)).unit().unwrap();
        let z = x.cross(&y);
        let turned = value(&|v| x * v.x() + y * v.y() + z * v.z());
        assert!((turned / here - 1.0).abs() < 1e-11, "{brdf:?}: {:e}", turned / here - 1.0);
    }
}

#[test]
fn a_prepared_law_is_the_law() {
    let (normal, observer) = (direction(5.0, 70.0), direction(40.0, 130.0));
    for tolerance in [1e-3, 1e-9] {
        let ground = Ground::new(&above(550.0), RADIUS_KM, &light_source(30.0), &VEGETATION).unwrap();
        let accuracy = Accuracy::relative(tolerance, 1_000_000);
        let plain = reflected_by_earth(&ground, &chassis(), &normal, &observer, &accuracy);
        let prepared = PreparedBrdf::new(&chassis()).reflected(&ground, &normal, &observer, &accuracy);
        assert_eq!(plain.nodes, prepared.nodes);
        // the table is good to 1e-9
        assert!((plain.per_sr / prepared.per_sr - 1.0).abs() < 1e-9);
    }
}

#[test]
fn what_is_dark_or_behind_is_exactly_nothing() {
    let plate = Brdf::Lambert { albedo: 1.0 };
    let nothing = ReflectedLight { per_sr: 0.0, err_per_sr: 0.0, nodes: 0 };
    // the light source behind the Earth; the surface looking up; the observer behind the surface
    assert_eq!(light(550.0, -40.0, &VEGETATION, &plate, [NADIR, NADIR], 1e-3), nothing);
    assert_eq!(light(550.0, 40.0, &VEGETATION, &plate, [-NADIR, -NADIR], 1e-3), nothing);
    assert_eq!(light(550.0, 40.0, &VEGETATION, &plate, [NADIR, -NADIR], 1e-3), nothing);
    // a mirror that shows the sky
    let up = direction(100.0, 0.0);
    let mirror = Brdf::Mirror { reflectance: 0.9 };
    assert_eq!(light(550.0, 40.0, &VEGETATION, &mirror, [direction(89.0, 0.0), up], 1e-3).per_sr, 0.0);
}

/// A case drawn among the nasty ones.
fn draw(rng: &mut ChaCha8Rng) -> (f64, f64, Brdf, Brdf, [Vector<Itrs>; 2]) {
    let height_km = 10.0_f64.powf(rng.random_range(2.0..6.0));
    let dip = (RADIUS_KM / (RADIUS_KM + height_km)).acos().to_degrees();
    let elevation_deg = match rng.random_range(0..6) {
        0 => 0.0,
        1 => 90.0,
        2 => -dip * rng.random_range(0.9..0.999),
        _ => rng.random_range(-dip..90.0),
    };
    let exponents = [0.0, 0.05, 0.26, 1.0, 2.5, 7.31, 60.0, 1e3];
    let lobe = |rng: &mut ChaCha8Rng| exponents[rng.random_range(0..exponents.len())];
    let earth = match rng.random_range(0..3) {
        0 => Brdf::Lambert { albedo: 0.3 },
        1 => VEGETATION,
        _ => Brdf::Phong { kd: 0.2, ks: 0.5, n: lobe(rng) },
    };
    let brdf = match rng.random_range(0..6) {
        0 => Brdf::Lambert { albedo: 0.6 },
        1 => Brdf::Phong { kd: 0.1, ks: 0.4, n: lobe(rng) },
        2 => Brdf::Phong { kd: 0.0, ks: 0.9, n: 10.0_f64.powf(rng.random_range(1.0..6.0)) },
        3 => Brdf::Gaussian { peak_per_sr: 10.0, sigma: 10.0_f64.powf(rng.random_range(-9.0..-1.0)) },
        4 => Brdf::Abg { a: 1e-3, b: 10.0_f64.powf(rng.random_range(-9.0..-1.0)), g: rng.random_range(1.2..3.0) },
        _ => chassis(),
    };
    let horizon_deg = (RADIUS_KM / (RADIUS_KM + height_km)).asin().to_degrees();
    let observer = direction(horizon_deg * rng.random_range(0.0..1.0), rng.random_range(0.0..360.0));
    let mut normal = direction(rng.random_range(0.0..150.0), rng.random_range(0.0..360.0));
    if rng.random_range(0..3) == 0 {
        normal = NADIR;
    } else if rng.random_range(0..2) == 0 {
        // a glint from near the limb
        let at = direction(horizon_deg * rng.random_range(0.98..1.02), rng.random_range(0.0..360.0));
        normal = (at + observer).unit().unwrap();
    }
    (height_km, elevation_deg, earth, brdf, [normal, observer])
}

#[test]
fn the_estimate_is_honest_over_nasty_cases_and_nothing_is_ever_a_nan() {
    let mut rng = ChaCha8Rng::seed_from_u64(2026);
    let cases: Vec<_> = (0..120).map(|_| draw(&mut rng)).collect();
    let (mut n_cases, mut lies, mut misses) = (0, Vec::new(), Vec::new());
    for (height_km, elevation_deg, earth, brdf, facing) in &cases {
        let of = |tolerance| light(*height_km, *elevation_deg, earth, brdf, *facing, tolerance);
        let best = of(1e-9);
        assert!(best.per_sr.is_finite() && best.err_per_sr.is_finite() && best.per_sr >= 0.0, "{brdf:?}");
        if best.per_sr < 1e-30 {
            continue;
        }
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-6] {
            let got = of(tolerance);
            n_cases += 1;
            let off = (got.per_sr - best.per_sr).abs();
            let case = format!("{height_km} km {elevation_deg} deg {earth:?} {brdf:?} {facing:?}: {tolerance:e}");
            let what = format!("{case} off {:e} estimated {:e}", off / best.per_sr, got.err_per_sr / best.per_sr);
            if off > got.err_per_sr + best.err_per_sr + 1e-10 * best.per_sr {
                lies.push(what.clone());
            }
            if off > tolerance * best.per_sr + best.err_per_sr {
                misses.push(what);
            }
        }
    }
    assert!(n_cases > 200, "{n_cases}");
    assert!(100 * lies.len() <= n_cases, "{} of {n_cases}: {lies:#?}", lies.len());
    assert!(100 * misses.len() <= n_cases, "{} of {n_cases}: {misses:#?}", misses.len());
}

#[test]
fn the_nodes_allowed_bound_the_work_and_the_error_says_so() {
    let case = |max_nodes| {
        let ground = Ground::new(&above(550.0), RADIUS_KM, &light_source(30.0), &VEGETATION).unwrap();
        let accuracy = Accuracy::relative(1e-12, max_nodes);
        reflected_by_earth(&ground, &chassis(), &direction(5.0, 70.0), &direction(40.0, 130.0), &accuracy)
    };
    let (few, many) = (case(1), case(300_000));
    // at most one refinement beyond what is allowed
    assert!(few.nodes < 20_000 && many.nodes < 600_000, "{} {}", few.nodes, many.nodes);
    assert!((few.per_sr - many.per_sr).abs() <= few.err_per_sr + 1e-10 * many.per_sr);
}

/// Prints what a map of the sky costs; run by hand with `--ignored --nocapture`, best on an optimised build.
#[test]
#[ignore = "measures time"]
fn a_map_of_the_sky_is_timed() {
    let sun = light_source(-10.0);
    let observer_km = above(0.0);
    let prepared = PreparedBrdf::new(&chassis());
    for tolerance in [1e-3, 1e-6] {
        let (started, mut nodes, mut integrals) = (std::time::Instant::now(), 0, 0);
        for point in 0..90 * 180 {
            let (alt, az) = (f64::from(point / 180).to_radians(), f64::from(2 * (point % 180)).to_radians());
            let up = Vector::<Itrs>::new(alt.cos() * az.sin(), alt.cos() * az.cos(), alt.sin());
            let range_km = (RADIUS_KM * alt.sin()).mul_add(-1.0, {
                let (s, h) = (RADIUS_KM * alt.sin(), 550.0);
                (s * s + 2.0 * RADIUS_KM * h + h * h).sqrt()
            });
            let satellite = observer_km + up * range_km;
            let normal = -satellite.unit().unwrap();
            let ground = Ground::new(&satellite, RADIUS_KM, &sun, &VEGETATION).unwrap();
            let light = prepared.reflected(&ground, &normal, &-up, &Accuracy::relative(tolerance, 200_000));
            nodes += light.nodes;
            integrals += usize::from(light.nodes > 0);
        }
        let seconds = started.elapsed().as_secs_f64();
        println!(
            "{tolerance:e}: {seconds:.3} s, {integrals} integrals of {:.1} us, {:.0} nodes of {:.1} ns",
            seconds * 1e6 / integrals as f64,
            nodes as f64 / integrals as f64,
            seconds * 1e9 / nodes as f64
        );
    }
}
