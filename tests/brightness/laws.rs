//! Laws of the brightness engine on whole scenes: limits, symmetries, sums, skipped lights, and 2000 random scenes.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{
    Accuracy, Attitude, Brdf, Brightness, Ground, Illum, Model, ModelSettings, Satellite, Scene, Surface, brightness,
    light_class, reflected_by_earth, skipped_text,
};
use satphot::config::{Arrays, Effects, GroundMoonlight, Mode, Source};

type V = Vector<Itrs>;
const AU_KM: f64 = 149_597_870.7;
const R_KM: f64 = 6378.0;

fn on_sphere(rng: &mut ChaCha8Rng) -> V {
    let (z, turn): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..2.0 * PI));
    let across = (1.0 - z * z).sqrt();
    V::new(across * turn.cos(), across * turn.sin(), z)
}

/// Satellite on the z axis at `r_km`; observer `off_rad` away; Sun and Moon at elevations there.
fn scene(r_km: f64, off_rad: f64, sun_deg: f64, moon_deg: f64) -> Scene {
    let toward = |deg: f64| V::new(0.0, deg.to_radians().cos(), deg.to_radians().sin());
    Scene {
        satellite_km: V::new(0.0, 0.0, r_km),
        velocity_km_s: V::new(7.6, 0.0, 0.0),
        observer_km: V::new(off_rad.sin() * 0.6, off_rad.sin() * 0.8, off_rad.cos()) * R_KM,
        sun_km: toward(sun_deg) * AU_KM,
        moon_km: toward(moon_deg) * 384_400.0,
        sidereal_rad: 0.0,
    }
}

fn sphere(tolerance: f64) -> ModelSettings {
    let mut settings = ModelSettings::new(Mode::Corrected, tolerance);
    settings.earth_radius_km = Some(R_KM);
    settings
}

fn plate(attitude: Attitude, brdf: Brdf) -> Satellite {
    let surface = Surface { name: "plate".into(), area_m2: 10.0, attitude, brdf, back: None };
    Satellite::of("plate", vec![surface])
}

fn iss() -> Satellite {
    Satellite::named("iss").unwrap()
}

fn fluxes(b: &Brightness) -> [f64; 4] {
    [b.sun.flux_ratio, b.earthshine.flux_ratio, b.moon.flux_ratio, b.lunar_earthshine.flux_ratio]
}

#[test]
fn a_nadir_plate_receives_the_independently_integrated_share_of_the_zenith_sun() {
    // Lambert ground 0.3, R = 6371 km, 420 km up; a white Lambert plate turns irradiance into π f = 1
    let satellite = V::new(0.0, 0.0, 6371.0 + 420.0);
    let down = V::new(0.0, 0.0, -1.0);
    let at = |sun: V, albedo: f64| {
        let ground = Ground::new(&satellite, 6371.0, &sun, &Brdf::Lambert { albedo }).unwrap();
        PI * reflected_by_earth(
            &ground,
            &Brdf::Lambert { albedo: 1.0 },
            &down,
            &down,
            &Accuracy::relative(1e-10, 100_000),
        )
        .per_sr
    };
    let got = at(V::new(0.0, 0.0, 1.0), 0.3);
    // Simpson with 200 000 steps in the angle at the Earth's centre
    assert!((got - 0.262_886_215_196_448_45).abs() < 1e-10, "{got}");
    // an earlier independent quadrature, good to 0.2 %
    assert!((got / 0.262_884_863_332_490_9 - 1.0).abs() < 2e-3);
}

#[test]
fn an_earth_of_uniform_radiance_fills_a_nadir_plate_to_r_over_r_squared() {
    // Two opposite sources and four around the equator of a Lambert sphere do not make it uniform, but a mean over all
    // source directions does: E[max(0, p·s)] = 1/4 everywhere. Gauss in elevation is exact for what is left after it.
    let (radius, r): (f64, f64) = (6371.0, 6791.0);
    let satellite = V::new(0.0, 0.0, r);
    let down = V::new(0.0, 0.0, -1.0);
    let steps = 400;
    let mut mean = 0.0;
    for j in 0..steps {
        let sin_e = (2.0 * (f64::from(j) + 0.5) / f64::from(steps)) - 1.0;
        let light_source = V::new(0.0, (1.0 - sin_e * sin_e).sqrt(), sin_e);
        let ground = Ground::new(&satellite, radius, &light_source, &Brdf::Lambert { albedo: 1.0 }).unwrap();
        if ground.lit_in_view() {
            mean += PI
                * reflected_by_earth(
                    &ground,
                    &Brdf::Lambert { albedo: 1.0 },
                    &down,
                    &down,
                    &Accuracy::relative(1e-8, 100_000),
                )
                .per_sr;
        }
    }
    // uniform radiance (1/4)/π, so F = 4 × mean; the midpoint rule in sin E leaves 1e-5
    let view_factor = 4.0 * mean / f64::from(steps);
    assert!((view_factor / (radius / r).powi(2) - 1.0).abs() < 2e-5, "{view_factor}");
}

#[test]
fn a_narrow_lobe_shows_the_ground_as_a_mirror_does() {
    // ∫ L f (n·w) dω → ks L(m) (n·o) with L(m) = (ρ/π) p·s where the mirror ray m meets the ground
    let satellite = V::new(0.0, 0.0, R_KM + 550.0);
    let light_source = V::new(0.0, 30_f64.to_radians().cos(), 30_f64.to_radians().sin());
    let albedo = 0.3;
    let ground = Ground::new(&satellite, R_KM, &light_source, &Brdf::Lambert { albedo }).unwrap();
    let observer = V::new(0.5, 0.2, -0.8).unit().unwrap();
    let normal = V::new(0.1, 0.1, -1.0).unit().unwrap();
    let m = normal * (2.0 * normal.dot(&observer)) - observer;
    let b = satellite.dot(&m);
    let to_ground = -b - (b * b - satellite.dot(&satellite) + R_KM * R_KM).sqrt();
    let p = (satellite + m * to_ground).unit().unwrap();
    let mirror = albedo / PI * p.dot(&light_source) * normal.dot(&observer);
    for (n, claim) in [(1e3, 2e-2), (1e4, 2e-3), (1e6, 2e-5)] {
        let brdf = Brdf::Phong { kd: 0.0, ks: 1.0, n };
        let got = reflected_by_earth(&ground, &brdf, &normal, &observer, &Accuracy::relative(1e-8, 1_000_000));
        assert!((got.per_sr / mirror - 1.0).abs() < claim, "{n}: {} {mirror} {got:?}", got.per_sr / mirror);
    }
}

#[test]
fn direct_light_falls_with_the_square_of_the_range() {
    let satellite = plate(Attitude::Nadir, Brdf::Lambert { albedo: 0.5 });
    // observer straight below; the Sun in the nadir plane lights the plate from below the horizontal
    let near = brightness(&scene(R_KM + 400.0, 0.0, -5.0, -80.0), &satellite, &sphere(1e-3)).unwrap();
    let far = brightness(&scene(R_KM + 800.0, 0.0, -5.0, -80.0), &satellite, &sphere(1e-3)).unwrap();
    let ratio = near.sun.flux_ratio / far.sun.flux_ratio;
    assert!((ratio - 4.0).abs() < 2e-4, "{ratio}"); // 400 km turn the Sun by 2.7e-6 rad, of 5°: 3e-5 in the cosine
}

#[test]
fn a_black_satellite_gives_no_light_and_no_magnitude() {
    let black = plate(Attitude::Nadir, Brdf::Phong { kd: 0.0, ks: 0.0, n: 3.0 });
    let b = brightness(&scene(6800.0, 0.05, -5.0, 40.0), &black, &sphere(1e-3)).unwrap();
    assert_eq!((fluxes(&b), b.total_v_mag, b.illum), ([0.0; 4], None, Illum::None));
}

#[test]
fn the_total_is_the_sum_of_surfaces_and_of_lights_run_alone() {
    let s = scene(6800.0, 0.05, -5.0, 40.0);
    let whole = brightness(&s, &iss(), &sphere(1e-9)).unwrap();
    let mut parts = [0.0; 4];
    for surface in iss().surfaces {
        let alone = Satellite { surfaces: vec![surface], ..iss() };
        let b = brightness(&s, &alone, &sphere(1e-9)).unwrap();
        parts.iter_mut().zip(fluxes(&b)).for_each(|(sum, f)| *sum += f);
    }
    for (a, b) in parts.iter().zip(fluxes(&whole)) {
        assert!((a - b).abs() <= 1e-14 * b, "{a} {b}");
    }
    let total: f64 = parts.iter().sum();
    assert!((whole.total_v_mag.unwrap() + 2.5 * total.log10()).abs() < 1e-12);
    // each light source alone: the other one put where it lights nothing (behind the Earth, and new for the Moon)
    let moonless = brightness(&Scene { moon_km: V::new(0.0, 0.0, -384_400.0), ..s }, &iss(), &sphere(1e-9)).unwrap();
    assert_eq!((fluxes(&moonless)[0], fluxes(&moonless)[1]), (fluxes(&whole)[0], fluxes(&whole)[1]));
    assert_eq!((fluxes(&moonless)[2], fluxes(&moonless)[3]), (0.0, 0.0));
}

#[test]
fn turning_the_whole_scene_changes_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let s = scene(6800.0, 0.1, -8.0, 50.0);
    let before = fluxes(&brightness(&s, &iss(), &sphere(1e-4)).unwrap());
    for _ in 0..20 {
        // an orthonormal right-handed set
        let a = on_sphere(&mut rng);
        let b = a.any_perpendicular().unwrap();
        let c = a.cross(&b);
        let turn = |v: V| a * v.x() + b * v.y() + c * v.z();
        let turned = Scene {
            satellite_km: turn(s.satellite_km),
            velocity_km_s: turn(s.velocity_km_s),
            observer_km: turn(s.observer_km),
            sun_km: turn(s.sun_km),
            moon_km: turn(s.moon_km),
            sidereal_rad: 0.0,
        };
        let after = fluxes(&brightness(&turned, &iss(), &sphere(1e-4)).unwrap());
        for (x, y) in before.iter().zip(after) {
            assert!((x - y).abs() <= 1e-12 * x, "{x:e} {y:e}");
        }
    }
}

#[test]
fn with_the_moon_down_no_lunar_earth_integral_is_evaluated() {
    let b = brightness(&scene(6800.0, 0.05, -5.0, -60.0), &iss(), &sphere(1e-4)).unwrap();
    assert_eq!(b.quadratures.moon, 0);
    assert!(b.quadratures.sun > 0);
    assert!(skipped_text(&b.skipped).contains("lunar_earthshine: no moonlit ground in view"), "{:?}", b.skipped);
    assert!(skipped_text(&b.skipped).contains("moon: below the satellite's horizon"), "{:?}", b.skipped);
    let night = brightness(&scene(6800.0, 0.05, -60.0, 40.0), &iss(), &sphere(1e-4)).unwrap();
    assert_eq!(night.quadratures.sun, 0);
    assert!(skipped_text(&night.skipped).contains("sun: in umbra"), "{:?}", night.skipped);
}

#[test]
fn a_surface_turned_away_is_not_integrated_unless_its_back_scatters() {
    let s = scene(6800.0, 0.05, 40.0, 40.0);
    let up = Attitude::Fixed(V::new(0.0, 0.0, 1.0));
    let b = brightness(&s, &plate(up, Brdf::Lambert { albedo: 0.5 }), &sphere(1e-4)).unwrap();
    assert_eq!((b.quadratures.sun, b.quadratures.moon, b.total_v_mag), (0, 0, None));
    assert_eq!(b.skipped[0].to_string(), "plate: faces away from the observer");
    let mut two_sided = plate(up, Brdf::Lambert { albedo: 0.1 });
    two_sided.surfaces[0].back = Some(Brdf::Lambert { albedo: 0.5 });
    let down = plate(Attitude::Nadir, Brdf::Lambert { albedo: 0.5 });
    let (back, front) =
        (brightness(&s, &two_sided, &sphere(1e-4)).unwrap(), brightness(&s, &down, &sphere(1e-4)).unwrap());
    // the two normals differ in the sign of a zero: rounding only
    for (a, b) in fluxes(&back).iter().zip(fluxes(&front)) {
        assert!((a - b).abs() <= 1e-13 * b, "{a} {b}");
    }
    assert!(fluxes(&front)[1] > 0.0);
}

#[test]
fn a_satellite_below_the_horizon_has_no_magnitude_and_one_below_the_surface_is_an_error() {
    let b = brightness(&scene(6800.0, 0.5, -5.0, 40.0), &iss(), &sphere(1e-4)).unwrap();
    assert_eq!((b.total_v_mag, b.quadratures.sun), (None, 0));
    assert!(b.skipped[0].to_string().contains("horizon"));
    let sunk = brightness(&scene(6300.0, 0.0, -5.0, 40.0), &iss(), &sphere(1e-4)).unwrap_err();
    assert!(sunk.to_string().contains("below the surface"));
    let mut broken = scene(6800.0, 0.0, -5.0, 40.0);
    broken.sun_km = V::new(f64::NAN, 0.0, 0.0);
    assert!(brightness(&broken, &iss(), &sphere(1e-4)).is_err() && light_class(&broken).is_err());
}

#[test]
fn the_sun_sets_on_a_satellite_smoothly_and_once() {
    let mut before = 1.0;
    let mut seen = Vec::new();
    let model = Model::new(&iss(), &sphere(0.1)).unwrap();
    for j in 0..=8000 {
        let s = scene(6798.0, 0.05, -14.0 - 8.0 * f64::from(j) / 8000.0, -80.0);
        let frac = model.brightness(&s).unwrap().sun_visible_frac;
        assert!(frac <= before + 1e-6 && before - frac < 4e-3, "{j}: {before} {frac}");
        before = frac;
        let class = light_class(&s).unwrap();
        if seen.last() != Some(&class) {
            seen.push(class);
        }
    }
    assert_eq!(before, 0.0);
    assert_eq!(seen, [Illum::Sun, Illum::Penumbra, Illum::None]);
}

#[test]
fn under_a_full_moon_the_published_and_the_corrected_mode_differ_by_the_distances_alone() {
    // Moon and Sun opposite but out of eclipse, satellite deep in the umbra
    let mut s = scene(6798.0, 0.05, -70.0, 70.0);
    s.moon_km = s.moon_km * (405_000.0 / 384_400.0);
    let run = |mode| {
        // the published source, at the ground, the published arrays and the published moonlight on the ground are other effects
        let (source, arrays, ground_moonlight) = (Source::ExoAtmospheric, Arrays::AsListed, GroundMoonlight::Parallel);
        let effects = Effects { source, arrays, ground_moonlight, ..Effects::of(mode) };
        let settings = ModelSettings { effects, ..sphere(1e-8) };
        brightness(&s, &iss(), &settings).unwrap()
    };
    let (published, corrected) = (run(Mode::AsPublished), run(Mode::Corrected));
    let fainter = corrected.lunar_earthshine.v_mag.unwrap() - published.lunar_earthshine.v_mag.unwrap();
    // 5 lg(405000/384400 · 1.002…): the Moon is a little farther from the Sun than the Earth is
    let expected = 5.0 * (405.0 / 384.4 * (s.sun_km - s.moon_km).norm() / AU_KM).log10();
    assert!((fainter - expected).abs() < 1e-3, "{fainter} {expected}");
    assert_eq!(published.illum, Illum::LunarEarthshine);
}

/// A random scene from 300 km to beyond GEO, with the degenerate directions mixed in.
fn random_scene(rng: &mut ChaCha8Rng) -> Scene {
    let r_km = R_KM + [300.0, 420.0, 1200.0, 35_786.0, 2e5][rng.random_range(0..5)] * rng.random_range(0.98..1.02);
    let up = if rng.random_bool(0.1) { V::new(0.0, 0.0, 1.0) } else { on_sphere(rng) };
    let side = up.any_perpendicular().unwrap();
    let off = [0.0, 1e-9, 0.1, 0.3, 1.4][rng.random_range(0..5)];
    let limb = (R_KM / r_km).asin();
    let toward = |rng: &mut ChaCha8Rng| match rng.random_range(0..8) {
        0 => up,
        1 => -up,
        2 => side,
        3 => up * -limb.cos() + side * limb.sin(), // on the geometric limb, as seen from the satellite
        _ => on_sphere(rng),
    };
    Scene {
        satellite_km: up * r_km,
        velocity_km_s: side * 7.5,
        observer_km: (up * f64::cos(off) + side * f64::sin(off)) * R_KM,
        sun_km: toward(rng) * AU_KM,
        moon_km: toward(rng) * rng.random_range(4e5..4.1e5),
        sidereal_rad: 0.0,
    }
}

#[test]
fn two_thousand_random_scenes_hold_no_nan_and_no_inconsistency() {
    let mut rng = ChaCha8Rng::seed_from_u64(20_250_610);
    let (mut lit, mut calls) = (0, 0);
    for j in 0..2000 {
        let s = random_scene(&mut rng);
        let mut satellite = iss();
        let brdf = Brdf::Phong { kd: 0.2, ks: 0.7, n: 10.0_f64.powf(rng.random_range(-1.5..6.0)) };
        let normal = on_sphere(&mut rng);
        let extra = Surface { name: "extra".into(), area_m2: 5.0, attitude: Attitude::Fixed(normal), brdf, back: None };
        satellite.surfaces.push(extra);
        let mut settings = sphere(1e-3);
        settings.effects = Effects::of(if j % 2 == 0 { Mode::Corrected } else { Mode::AsPublished });
        let b = brightness(&s, &satellite, &settings).unwrap();
        calls += 1;
        let light = fluxes(&b);
        assert!(light.iter().all(|f| f.is_finite() && *f >= 0.0), "{j}: {light:?}");
        assert!((0.0..=1.0).contains(&b.sun_visible_frac) && b.err_mag.is_finite(), "{j}");
        assert!(b.err_mag < 0.01, "{j}: {}", b.err_mag);
        assert_eq!(b.total_v_mag.is_some(), light.iter().sum::<f64>() > 0.0);
        assert_eq!(b.total_v_mag.is_some(), b.illum != Illum::None);
        assert!(b.total_v_mag.is_none_or(f64::is_finite) && b.mu_mean_mag_arcsec2.is_none_or(f64::is_finite));
        light_class(&s).unwrap();
        lit += usize::from(b.total_v_mag.is_some());
    }
    assert!(lit > calls / 4, "{lit} of {calls} lit");
}

#[test]
fn the_stated_error_covers_the_true_one_on_fresh_random_geometries() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (mut n, mut beyond_tolerance, mut worst) = (0, 0, 0.0_f64);
    for _ in 0..1200 {
        let s = random_scene(&mut rng);
        let brdf =
            Brdf::Phong { kd: rng.random_range(0.0..0.5), ks: 0.5, n: 10.0_f64.powf(rng.random_range(-1.5..4.0)) };
        let earth = Brdf::Phong { kd: 0.5, ks: 0.3, n: rng.random_range(0.0..30.0) };
        let (side, observer) = (on_sphere(&mut rng), (s.observer_km - s.satellite_km).unit().unwrap());
        let normal = if side.dot(&observer) > 0.0 { side } else { -side };
        let Some(ground) = Ground::new(&s.satellite_km, R_KM, &s.sun_km, &earth) else { continue };
        if !ground.lit_in_view() || !ground.seen_by(&normal) {
            continue;
        }
        let run =
            |tolerance| reflected_by_earth(&ground, &brdf, &normal, &observer, &Accuracy::relative(tolerance, 300_000));
        let (fast, slow) = (run(1e-3), run(1e-8));
        if slow.per_sr == 0.0 {
            assert_eq!(fast.per_sr, 0.0);
            continue;
        }
        // a last sliver between terminator and surface horizon, 25 mag below a lit Earth, may be off by 1 %
        if slow.per_sr < 1e-12 {
            continue;
        }
        let off = (fast.per_sr / slow.per_sr - 1.0).abs();
        n += 1;
        if off > 1e-3 {
            println!("{off:.1e} {brdf:?} {earth:?} {normal:?} {fast:?} {slow:?} {s:?}");
        }
        beyond_tolerance += usize::from(off > 1e-3);
        worst = worst.max(off);
    }
    println!("{n} geometries at tolerance 1e-3: worst {worst:.1e}, {beyond_tolerance} beyond the tolerance");
    assert!(n > 500);
    // two orders can agree by chance; measured 0 of 3864 geometries
    assert!(beyond_tolerance == 0, "{beyond_tolerance} of {n}, worst {worst:e}");
}

#[test]
fn one_call_for_the_iss_with_four_lights_takes_well_under_5_ms() {
    let s = scene(6798.0, 0.05, -12.0, 40.0);
    let b = brightness(&s, &iss(), &sphere(1e-4)).unwrap();
    let lit = fluxes(&b).iter().filter(|f| **f > 0.0).count();
    let started = std::time::Instant::now();
    let calls = 20;
    let model = Model::new(&iss(), &sphere(1e-4)).unwrap();
    for _ in 0..calls {
        model.brightness(&s).unwrap();
    }
    let ms = started.elapsed().as_secs_f64() * 1e3 / f64::from(calls);
    println!("{lit} lights, {ms:.2} ms a call");
    assert!(ms < 20.0, "{ms} ms"); // four times the claim: a loaded machine must not fail it
}
