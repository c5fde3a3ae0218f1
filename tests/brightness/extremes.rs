//! The stiff and extreme cases of the brightness engine, each by its name.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::f64::consts::{FRAC_PI_2, PI};

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{Attitude, Brdf, Brightness, Model, ModelSettings, Satellite, Scene, Surface, brightness};
use satphot::config::{Mode, PlatformSize, Shadow};

type V = Vector<Itrs>;
const AU_KM: f64 = 149_597_870.7;
const R_KM: f64 = 6378.0;

fn settings(tolerance: f64) -> ModelSettings {
    let mut settings = ModelSettings::new(Mode::Corrected, tolerance);
    settings.earth_radius_km = Some(R_KM);
    settings
}

/// Satellite on the z axis at `r_km`; observer `off_rad` away on the ground; Sun and Moon at elevations there.
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

fn plate(area_m2: f64, attitude: Attitude, brdf: Brdf) -> Satellite {
    Satellite::of("plate", vec![Surface { name: "plate".into(), area_m2, attitude, brdf, back: None }])
}

fn finite(b: &Brightness) {
    for light in [b.sun, b.earthshine, b.moon, b.lunar_earthshine] {
        assert!(light.flux_ratio >= 0.0 && light.flux_ratio.is_finite(), "{light:?}");
        assert_eq!(light.v_mag.is_some(), light.flux_ratio > 0.0, "{light:?}");
    }
    assert!(b.err_mag >= 0.0 && b.err_mag.is_finite() && (0.0..=1.0).contains(&b.sun_visible_frac));
}

#[test]
fn at_grazing_incidence_and_grazing_view_the_light_goes_to_nothing_without_a_step() {
    let laws = ["starlink-chassis-lab", "starlink-array-lab", "earth-vegetation"].map(|n| Brdf::named(n).unwrap());
    for brdf in laws {
        let s = scene(R_KM + 550.0, 0.02, 30.0, -60.0);
        let to_sun = (s.sun_km - s.satellite_km).unit().unwrap();
        let to_observer = (s.observer_km - s.satellite_km).unit().unwrap();
        for (grazed, other) in [(to_sun, to_observer), (to_observer, to_sun)] {
            // a normal tilted ε off the plane at right angles to `grazed`
            let across = (other - grazed * grazed.dot(&other)).unit().unwrap();
            let mut before = f64::INFINITY;
            for eps in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10] {
                let normal = across + grazed * eps;
                let b = brightness(&s, &plate(10.0, Attitude::Fixed(normal), brdf.clone()), &settings(1e-3)).unwrap();
                finite(&b);
                assert!(b.sun.flux_ratio < before, "{eps}");
                before = b.sun.flux_ratio;
            }
            let behind = plate(10.0, Attitude::Fixed(across - grazed * 1e-6), brdf.clone());
            let mut point = settings(1e-3);
            point.effects.source_disc = satphot::config::SourceDisc::Point;
            assert_eq!(brightness(&s, &behind, &point).unwrap().sun.flux_ratio, 0.0);
        }
    }
}

#[test]
fn a_mirror_shows_the_sun_inside_its_beam_nothing_outside_and_a_part_at_the_edge() {
    // Sun and observer 60° apart on either side of the normal, the mirror turned off by δ
    let s = scene(R_KM + 625.0, 0.0, 30.0, -60.0);
    let to_sun = (s.sun_km - s.satellite_km).unit().unwrap();
    let to_observer = (s.observer_km - s.satellite_km).unit().unwrap();
    let normal = (to_sun + to_observer).unit().unwrap();
    let turned = |delta_rad: f64| {
        let axis = to_sun.cross(&to_observer).unit().unwrap();
        let n = normal * delta_rad.cos() + axis.cross(&normal) * delta_rad.sin();
        let mut only_sun = settings(1e-3);
        only_sun.moon = false;
        brightness(&s, &plate(324.0, Attitude::Fixed(n), Brdf::Mirror { reflectance: 0.96 }), &only_sun).unwrap()
    };
    let disc_rad = (695_700.0_f64 / AU_KM).asin();
    let inside = turned(0.0).sun.flux_ratio;
    assert!(inside > 0.0);
    // the image moves by 2δ
    assert_eq!(turned(0.51 * disc_rad).sun.v_mag, None);
    // a flat disc of the Sun: whole until the observer nears its image's edge, then gone; n·o changes by 0.2 %
    let mut before = inside * 1.01;
    for k in 0..=100 {
        let now = turned(0.45 * disc_rad + 0.06 * disc_rad * f64::from(k) / 100.0).sun.flux_ratio;
        assert!((0.0..=inside * 1.01).contains(&now) && now <= before, "{k}: {now}");
        before = now * 1.001;
    }
}

#[test]
fn a_decayed_satellite_an_empty_surface_and_an_observer_aboard_are_refused() {
    let white = |area| plate(area, Attitude::Nadir, Brdf::Lambert { albedo: 0.5 });
    let below = scene(R_KM - 10.0, 0.02, 30.0, -60.0);
    assert!(brightness(&below, &white(1.0), &settings(1e-3)).unwrap_err().to_string().contains("below the surface"));
    let fine = scene(R_KM + 500.0, 0.02, 30.0, -60.0);
    for area in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(brightness(&fine, &white(area), &settings(1e-3)).is_err(), "{area}");
    }
    let bright = plate(1.0, Attitude::Nadir, Brdf::Lambert { albedo: 1.01 });
    assert!(brightness(&fine, &bright, &settings(1e-3)).unwrap_err().to_string().contains("albedo"));
    let mut aboard = fine;
    aboard.observer_km = aboard.satellite_km;
    assert!(brightness(&aboard, &white(1.0), &settings(1e-3)).is_err());
}

#[test]
fn two_metres_are_a_point_and_four_kilometres_are_divided_until_stable_at_bounded_cost() {
    let s = scene(R_KM + 500.0, 0.04, 35.0, 20.0);
    let law = Brdf::Phong { kd: 0.3, ks: 0.3, n: 8.9 };
    let run = |area_m2: f64, size: PlatformSize| {
        let mut settings = settings(1e-6);
        settings.effects.platform_size = size;
        brightness(&s, &plate(area_m2, Attitude::Nadir, law.clone()), &settings).unwrap()
    };
    let total = |b: &Brightness| b.sun.flux_ratio + b.earthshine.flux_ratio + b.moon.flux_ratio;
    let small = [run(4.0, PlatformSize::Point), run(4.0, PlatformSize::Subdivided)];
    assert_eq!(total(&small[0]), total(&small[1]));
    assert_eq!(small[0].quadratures, small[1].quadratures);
    let large = [run(16e6, PlatformSize::Point), run(16e6, PlatformSize::Subdivided)];
    let off = (total(&large[1]) / total(&large[0]) - 1.0).abs();
    println!("4 km at 500 km: {off:.1e} off a point, {} Earth integrals", large[1].quadratures.sun);
    assert!(off > 1e-6 && off < 1e-2 && large[1].quadratures.sun > 4 && large[1].quadratures.sun < 200);
    // brute force: 64 x 64 plates of their own
    let side_km = 4.0 / 64.0;
    let mut brute = 0.0;
    for i in 0..64 {
        for j in 0..64 {
            let mut part = s;
            // a nadir plate: one side along the velocity (x), the other across
            let along = |k: i32| (f64::from(k) + 0.5 - 32.0) * side_km;
            part.satellite_km = s.satellite_km + V::new(along(i), along(j), 0.0);
            let mut one = settings(1e-4);
            one.effects.platform_size = PlatformSize::Point;
            one.moon = false;
            let fixed = plate(16e6 / 4096.0, Attitude::Fixed(V::new(0.0, 0.0, -1.0)), law.clone());
            brute += if i % 8 == 0 && j % 8 == 0 {
                64.0 * brightness(&part, &fixed, &one).unwrap().earthshine.flux_ratio
            } else {
                0.0
            };
        }
    }
    // every eighth place of the brute sum: offset by half a step, so good to a few 1e-4
    let divided = large[1].earthshine.flux_ratio;
    println!("brute {brute:e}, divided {divided:e}");
    assert!((brute / divided - 1.0).abs() < 2e-3);
}

#[test]
fn from_geostationary_orbit_the_earth_is_small_and_the_shadow_narrow() {
    // 42164 km: F = (R/r)² = 0.0229, half-angle of the cylinder 8.7°
    let white = plate(1.0, Attitude::Nadir, Brdf::Lambert { albedo: 1.0 });
    for sun_deg in [90.0, 45.0, 0.0, -45.0, -80.0] {
        finite(&brightness(&scene(42_164.0, 0.1, sun_deg, 10.0), &white, &settings(1e-6)).unwrap());
    }
    let lit = |sun_deg: f64| {
        let mut s = settings(1e-3);
        s.effects.shadow = Shadow::Cylinder;
        brightness(&scene(42_164.0, 0.1, sun_deg, 10.0), &white, &s).unwrap().sun_visible_frac
    };
    assert_eq!((lit(-81.2), lit(-81.4)), (1.0, 0.0));
}

#[test]
fn beyond_the_tip_of_the_umbra_a_ring_of_the_sun_is_left() {
    let far_km = 1.6e6;
    let s = scene(far_km, 0.1, -90.0, 10.0);
    for shadow in [Shadow::Penumbra, Shadow::Atmospheric] {
        let mut set = settings(1e-3);
        set.effects.shadow = shadow;
        let white = plate(1.0, Attitude::Sun, Brdf::Lambert { albedo: 1.0 });
        let b = brightness(&s, &white, &set).unwrap();
        finite(&b);
        assert!(b.sun_visible_frac > 0.0 && b.sun_visible_frac < 1.0, "{shadow:?} {}", b.sun_visible_frac);
    }
}

#[test]
fn a_light_source_at_zenith_or_nadir_has_no_azimuth_and_finite_light() {
    for elevation in [90.0, -90.0] {
        for (sun, moon) in [(elevation, 20.0), (20.0, elevation)] {
            for name in ["starlink-v1.5", "iss"] {
                let satellite = Satellite::named(name).unwrap();
                let b = brightness(&scene(R_KM + 420.0, 0.05, sun, moon), &satellite, &settings(1e-4)).unwrap();
                finite(&b);
                if moon == -90.0 {
                    assert_eq!(b.moon.v_mag, None, "the Earth is in front of it");
                }
            }
        }
    }
}

#[test]
fn a_sun_exactly_on_the_horizon_or_on_the_terminators_edge_gives_no_nan() {
    let k: f64 = R_KM / (R_KM + 550.0);
    let edge_deg = -k.acos().to_degrees();
    let starlink = Satellite::named("starlink-v1.5").unwrap();
    for sun_deg in [0.0, 1e-12, -1e-12, 1e-6, -1e-6, edge_deg, edge_deg + 1e-9, edge_deg - 1e-9, edge_deg + 1e-4] {
        finite(&brightness(&scene(R_KM + 550.0, 0.05, sun_deg, 30.0), &starlink, &settings(1e-4)).unwrap());
    }
    let dark = brightness(&scene(R_KM + 550.0, 0.05, edge_deg - 0.01, -60.0), &starlink, &settings(1e-4)).unwrap();
    assert_eq!(dark.earthshine.v_mag, None);
}

#[test]
fn with_both_light_sources_down_there_is_no_magnitude_and_never_a_number_in_its_place() {
    let b = brightness(&scene(R_KM + 420.0, 0.05, -60.0, -60.0), &Satellite::named("iss").unwrap(), &settings(1e-4));
    let b = b.unwrap();
    assert_eq!((b.total_v_mag, b.sun.v_mag, b.moon.v_mag), (None, None, None));
    assert_eq!(b.quadratures.sun + b.quadratures.moon, 0);
    assert!(b.skipped.len() >= 4);
}

#[test]
fn an_observer_at_the_pole_sees_what_one_at_the_equator_sees_of_the_turned_scene() {
    let iss = Satellite::named("iss").unwrap();
    let s = scene(R_KM + 420.0, 0.07, 25.0, 40.0);
    // the observer to the pole: a turn about the axis of observer and z
    let axis = s.observer_km.cross(&V::new(0.0, 0.0, 1.0)).unit().unwrap();
    let angle = s.observer_km.angle_to(&V::new(0.0, 0.0, 1.0));
    let turn = |v: V| {
        // Rodrigues
        v * angle.cos() + axis.cross(&v) * angle.sin() + axis * (axis.dot(&v) * (1.0 - angle.cos()))
    };
    let turned = Scene {
        satellite_km: turn(s.satellite_km),
        velocity_km_s: turn(s.velocity_km_s),
        observer_km: turn(s.observer_km),
        sun_km: turn(s.sun_km),
        moon_km: turn(s.moon_km),
        ..s
    };
    assert!(turned.observer_km.x().abs() < 1e-9);
    let model = Model::new(&iss, &settings(1e-9)).unwrap();
    let (a, b) = (model.brightness(&s).unwrap(), model.brightness(&turned).unwrap());
    assert!((a.total_v_mag.unwrap() - b.total_v_mag.unwrap()).abs() < 1e-11);
}

#[test]
fn at_full_moon_behind_the_earth_the_lunar_light_is_eclipsed_and_at_new_moon_it_is_gone() {
    let white = plate(1.0, Attitude::Nadir, Brdf::Lambert { albedo: 1.0 });
    let mut eclipsed = scene(R_KM + 420.0, 0.05, -40.0, 40.0);
    eclipsed.moon_km = eclipsed.sun_km * (-384_400.0 / AU_KM);
    let model = Model::new(&white, &settings(1e-4)).unwrap();
    let in_shadow = model.brightness(&eclipsed).unwrap();
    finite(&in_shadow);
    let mut off_shadow = eclipsed;
    off_shadow.moon_km = off_shadow.moon_km + V::new(384_400.0 * 0.05, 0.0, 0.0);
    let outside = model.brightness(&off_shadow).unwrap();
    let dip = outside.lunar_earthshine.v_mag.unwrap() - in_shadow.lunar_earthshine.v_mag.unwrap();
    assert!(dip < -8.0, "{dip}");
    let mut new_moon = scene(R_KM + 420.0, 0.05, 40.0, 40.0);
    new_moon.moon_km = new_moon.sun_km * (384_400.0 / AU_KM);
    let b = model.brightness(&new_moon).unwrap();
    finite(&b);
    assert!(b.lunar_earthshine.flux_ratio < 1e-6 * outside.lunar_earthshine.flux_ratio);
}

#[test]
fn a_lobe_narrower_than_the_suns_disc_is_averaged_over_it_on_a_tilted_plate_at_exact_specular() {
    let s = scene(R_KM + 550.0, 0.03, 30.0, -60.0);
    let to_sun = (s.sun_km - s.satellite_km).unit().unwrap();
    let to_observer = (s.observer_km - s.satellite_km).unit().unwrap();
    let chassis = plate(3.65, Attitude::Fixed(to_sun + to_observer), Brdf::named("starlink-chassis-lab").unwrap());
    let mut point = settings(1e-3);
    point.effects.source_disc = satphot::config::SourceDisc::Point;
    let (disc, point) = (brightness(&s, &chassis, &settings(1e-3)).unwrap(), brightness(&s, &chassis, &point).unwrap());
    let lost = disc.sun.v_mag.unwrap() - point.sun.v_mag.unwrap();
    println!("{lost:.3} mag");
    // 0.70 mag at normal incidence; the plane of the surface foreshortens the lobe, so less here
    assert!(lost > 0.3 && lost < 0.75, "{lost}");
}

#[test]
fn lights_over_ten_decades_add_up_without_loss() {
    let white = plate(1.0, Attitude::Nadir, Brdf::Lambert { albedo: 1.0 });
    let s = scene(R_KM + 420.0, 0.05, 60.0, 40.0);
    let mut one = settings(1e-6);
    let both = brightness(&s, &white, &one).unwrap();
    one.moon = false;
    let sun = brightness(&s, &white, &one).unwrap();
    (one.sun, one.moon) = (false, true);
    let moon = brightness(&s, &white, &one).unwrap();
    let flux = |b: &Brightness| [b.sun, b.earthshine, b.moon, b.lunar_earthshine].map(|l| l.flux_ratio);
    let (both, sun, moon) = (flux(&both), flux(&sun), flux(&moon));
    for k in 0..4 {
        assert_eq!(both[k], sun[k] + moon[k], "{k}");
    }
    assert!(both[1] > 1e4 * both[3] && both[3] > 0.0);
}

#[test]
fn angles_of_the_test_scenes_are_what_they_say() {
    let s = scene(R_KM + 420.0, 0.05, 30.0, -60.0);
    assert!((FRAC_PI_2 - s.sun_km.angle_to(&s.satellite_km) - PI / 6.0).abs() < 1e-12);
}
