//! Leaving out never changes an answer beyond the error it states: scenes and nights with and without it.
#![allow(clippy::unwrap_used)]

use crate::support;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{Attitude, Brdf, Brightness, Model, ModelSettings, Satellite, Scene, Surface, ToleranceOf};
use satphot::config::{Mode, Shadow};
use satphot::pipeline::explain::explain_scenes;
use support::{Night, simulated};

const R_KM: f64 = 6378.0;

fn direction(rng: &mut ChaCha12Rng) -> Vector<Itrs> {
    let (z, turn): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..std::f64::consts::TAU));
    let level = (1.0 - z * z).sqrt();
    Vector::new(level * turn.cos(), level * turn.sin(), z)
}

/// The angle of a light source from the satellite's vertical: anywhere, or within two degrees of the limb of the Earth, where
/// penumbra and the last lit ground are.
fn light_source(rng: &mut ChaCha12Rng, r_km: f64, near_limb: bool) -> Vector<Itrs> {
    if !near_limb {
        return direction(rng);
    }
    let dip = std::f64::consts::FRAC_PI_2 + (R_KM / r_km).acos() + rng.random_range(-0.035..0.035);
    let turn: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    Vector::new(dip.sin() * turn.cos(), dip.sin() * turn.sin(), dip.cos())
}

/// A scene anywhere: every third light source is at the limb, every eighth observer below the horizon.
fn scene(k: usize, rng: &mut ChaCha12Rng) -> Scene {
    let r_km = R_KM + [300.0, 550.0, 1200.0, 35_786.0][k % 4] * rng.random_range(0.9..1.1);
    let horizon = (R_KM / r_km).acos();
    let off = horizon * if k % 8 == 7 { rng.random_range(1.01..1.2) } else { rng.random_range(0.0..0.99) };
    let turn: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    Scene {
        satellite_km: Vector::new(0.0, 0.0, r_km),
        velocity_km_s: Vector::new(7.6, 0.0, 0.0),
        observer_km: Vector::new(off.sin() * turn.cos(), off.sin() * turn.sin(), off.cos()) * R_KM,
        sun_km: light_source(rng, r_km, k.is_multiple_of(3)) * 1.496e8,
        moon_km: light_source(rng, r_km, k % 3 == 1) * rng.random_range(357_000.0..406_000.0),
        sidereal_rad: 0.0,
    }
}

/// Plates of many laws in many attitudes, one of them two-sided.
fn satellite() -> Satellite {
    let plate = |name: &str, attitude, brdf, back| Surface { name: name.into(), area_m2: 10.0, attitude, brdf, back };
    let side = |x, y, z| Attitude::Fixed(Vector::new(x, y, z));
    Satellite::of(
        "many plates",
        vec![
            plate("chassis", Attitude::Nadir, Brdf::named("starlink-chassis-lab").unwrap(), None),
            plate("lid", side(0.0, 0.0, 1.0), Brdf::Lambert { albedo: 0.3 }, None),
            plate("wall", side(0.6, 0.8, 0.0), Brdf::Phong { kd: 0.3, ks: 0.4, n: 30.0 }, None),
            plate("mirror", side(0.3, 0.4, -0.866_025_403_784_438_6), Brdf::Mirror { reflectance: 0.9 }, None),
            plate(
                "array",
                side(-0.48, 0.64, -0.6),
                Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 },
                Some(Brdf::Lambert { albedo: 0.6 }),
            ),
        ],
    )
}

fn lights(b: &Brightness) -> [f64; 4] {
    [b.sun, b.earthshine, b.moon, b.lunar_earthshine].map(|l| l.flux_ratio)
}

fn settings(shadow: Shadow, tolerance_of: ToleranceOf) -> ModelSettings {
    let mut settings =
        ModelSettings { earth_radius_km: Some(R_KM), tolerance_of, ..ModelSettings::new(Mode::Corrected, 1e-4) };
    settings.effects.shadow = shadow;
    settings
}

#[test]
fn what_is_skipped_of_a_scene_gives_no_light_when_it_is_computed() {
    let mut rng = ChaCha12Rng::seed_from_u64(60);
    let mut skipped_flux = std::collections::BTreeMap::<&str, usize>::new();
    for shadow in [Shadow::Cylinder, Shadow::Penumbra, Shadow::Atmospheric] {
        let model = Model::new(&satellite(), &settings(shadow, ToleranceOf::EachLight)).unwrap();
        for k in 0..400 {
            let scene = scene(k, &mut rng);
            let (some, all) = (model.brightness(&scene).unwrap(), model.exhaustive_brightness(&scene).unwrap());
            assert!(all.skipped.is_empty(), "{:?}", all.skipped);
            // the same sums in the same order, and zeros: not a bit may differ
            assert_eq!(lights(&some), lights(&all), "{scene:?} {:?}", some.skipped);
            assert_eq!(
                (some.total_v_mag, some.mu_mean_mag_arcsec2, some.illum),
                (all.total_v_mag, all.mu_mean_mag_arcsec2, all.illum)
            );
            for skip in &some.skipped {
                assert_eq!(model.skipped_flux(&scene, skip).unwrap(), 0.0, "{skip}: {scene:?}");
                *skipped_flux.entry(skip.why).or_default() += 1;
            }
        }
    }
    // every reason there is was met; a plate that an observer on the ground sees, sees that ground
    for why in [
        "satellite below the observer's horizon",
        "faces away from the observer",
        "in umbra",
        "below the satellite's horizon",
        "faces away from the Sun",
        "faces away from the Moon",
        "no sunlit ground in view",
        "no moonlit ground in view",
    ] {
        assert!(skipped_flux.get(why).is_some_and(|n| *n >= 5), "{why}: {skipped_flux:?}");
    }
}

#[test]
fn a_faint_light_computed_only_as_well_as_the_sum_needs_stays_within_the_error_that_is_stated() {
    let mut rng = ChaCha12Rng::seed_from_u64(61);
    let model = Model::new(&satellite(), &settings(Shadow::Atmospheric, ToleranceOf::Total)).unwrap();
    let (mut within, mut lit, mut fewer) = (0, 0, 0);
    for k in 0..300 {
        let scene = scene(k, &mut rng);
        let (some, all) = (model.brightness(&scene).unwrap(), model.exhaustive_brightness(&scene).unwrap());
        let (Some(a), Some(b)) = (some.total_v_mag, all.total_v_mag) else {
            assert_eq!(some.total_v_mag, all.total_v_mag);
            continue;
        };
        lit += 1;
        within += usize::from((a - b).abs() <= some.err_mag + all.err_mag + 1e-12);
        fewer += usize::from(some.nodes < all.nodes);
        // four quarters of the tolerance of the sum, in magnitudes, and what each light may be off by itself
        assert!((a - b).abs() < 1.0857 * 2e-4 + some.err_mag, "{a} {b} {scene:?}");
    }
    // the estimate covers 99 of 100 integrals
    assert!(lit > 100 && within * 100 >= lit * 99, "{within} of {lit}");
    assert!(fewer * 10 > lit, "the knob does nothing: {fewer} of {lit}");
}

#[test]
fn a_prediction_explains_every_reason_with_what_it_skipped_and_changes_nothing() {
    let mut rng = ChaCha12Rng::seed_from_u64(62);
    let model = Model::new(
        &satellite(),
        &ModelSettings { moon: false, ..settings(Shadow::Atmospheric, ToleranceOf::EachLight) },
    )
    .unwrap();
    let scenes: Vec<Scene> = (0..60).map(|k| scene(k, &mut rng)).collect();
    let ticks = std::cell::Cell::new(0.0);
    let clock = || {
        ticks.set(ticks.get() + 1.0);
        ticks.get()
    };
    let explained = explain_scenes(&model, &scenes, &|i| i.to_string(), &clock).unwrap();
    let mut counted = 0;
    for scene in &scenes {
        for skip in model.brightness(scene).unwrap().skipped {
            let item = explained.items.iter().find(|i| i.what == skip.what() && i.why == skip.why).unwrap();
            assert!(item.count > 0 && item.of == 60 && item.timed > 0 && item.each_us.is_some());
            // the Moon was switched off: that is somebody's choice and no promise
            assert_eq!(item.changes_mag, if skip.is_choice() { None } else { Some(0.0) }, "{skip}");
            counted += 1;
        }
    }
    assert_eq!(counted, explained.items.iter().map(|i| i.count).sum::<usize>());
    assert!(explained.items.iter().any(|i| i.why == "switched off" && i.count > 40));
    assert_eq!(explained.differs_mag, Some(0.0));
}

#[test]
fn a_night_with_nothing_skipped_gives_the_same_tables() {
    let mut n = Night::copy_of(&simulated("skipped", &[]));
    n.run().unwrap();
    let names = ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml"];
    let some = names.map(|name| n.text(name));
    assert!(n.rows().iter().any(|r| !r.skipped.is_empty()));
    n.options.exhaustive = true;
    n.run().unwrap();
    assert!(n.rows().iter().all(|r| r.skipped.is_empty()), "everything was computed");
    // the column that says what was skipped is all that differs
    let mut with: Vec<_> = n.rows();
    n.options.exhaustive = false;
    n.options.explain = true;
    let summary = n.run().unwrap();
    for (row, whole) in n.rows().iter().zip(&mut with) {
        whole.skipped.clone_from(&row.skipped);
        assert_eq!(row, whole);
    }
    // and explaining changes no byte
    assert_eq!(names.map(|name| n.text(name)), some);
    let explained = summary.explained.unwrap();
    let pixels = explained.items.iter().find(|i| i.what == "pixels of target frames").unwrap();
    assert_eq!((pixels.count, pixels.changes_mag), (6, Some(0.0)));
    assert!(explained.items.iter().any(|i| i.why.contains("faces away") || i.why.contains("ground")), "{explained:?}");
    assert!(n.manifest()["left_out_measured"]["items"].as_array().is_some_and(|a| a.len() == explained.items.len()));
}

#[test]
fn what_is_too_faint_for_the_sum_is_below_its_bound_and_the_sum_within_its_stated_error() {
    let mut rng = ChaCha12Rng::seed_from_u64(63);
    let mut alone = 0;
    for (tolerance, count, least) in [(1e-3, 400, 100), (1e-6, 100, 5), (1e-9, 25, 0)] {
        let of = |tolerance_of, tolerance| {
            let settings = ModelSettings { tolerance, ..settings(Shadow::Atmospheric, tolerance_of) };
            Model::new(&satellite(), &settings).unwrap()
        };
        let (sum, each) = (of(ToleranceOf::Total, tolerance), of(ToleranceOf::EachLight, tolerance.min(1e-6)));
        let mut too_faint = 0;
        for k in 0..count {
            let scene = scene(k, &mut rng);
            let (some, all) = (sum.brightness(&scene).unwrap(), each.brightness(&scene).unwrap());
            let flux = |b: &Brightness| lights(b).iter().sum::<f64>();
            let err = |b: &Brightness| b.err_mag / 1.085_736 * flux(b);
            let (off, stated) = ((flux(&some) - flux(&all)).abs(), err(&some) + err(&all));
            assert!(off <= stated * (1.0 + 1e-6), "{tolerance}: {off:e} {stated:e} {:?} {scene:?}", some.skipped);
            for (light, full) in some.lights().into_iter().zip(lights(&all)) {
                if light.is_too_faint() {
                    assert!(light.v_mag.is_none());
                    too_faint += 1;
                }
                if light.flux_ratio == 0.0 {
                    assert!(full <= light.skipped_flux_ratio, "{full:e} {light:?} {scene:?}");
                }
            }
            let shares: f64 = some.lights().iter().map(|light| light.skipped_flux_ratio).sum();
            assert!(shares <= 0.5 * tolerance * flux(&some), "{shares:e} {scene:?}");
            // where nothing else shines the faintest light is all there is
            if all.sun.flux_ratio + all.earthshine.flux_ratio + all.moon.flux_ratio == 0.0 {
                assert!(!some.lunar_earthshine.is_too_faint());
                alone += usize::from(some.lunar_earthshine.flux_ratio > 0.0);
            }
            for skip in some.skipped.iter().filter(|skip| skip.is_too_faint()) {
                assert!(skip.light.ends_with("earthshine"), "{skip}");
            }
        }
        assert!(too_faint >= least, "{tolerance}: {too_faint} too faint");
    }
    assert!(alone >= 5, "{alone}");
}
