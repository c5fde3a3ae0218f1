//! The beam of a mirror: its brightness, crossings found whatever the step, the paper's orbit, `limits footprint`.
#![allow(clippy::unwrap_used, clippy::panic)]

use crate::support;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::light_sources::SourceSettings;
use satphot::brightness::{Attitude, Band, Scene};
use satphot::config::{Effects, Mode};
use satphot::visibility::footprint::{
    Approach, CircularOrbit, LightSource, Mirror, approaches, beam_diameter_km, crossings_per_day, glint_mag,
};
use support::satphot;

const R_KM: f64 = 6371.0;
const HEIGHT_KM: f64 = 625.0;
const HALF_DEG: f64 = 0.265;
const EARENDIL: Mirror = Mirror {
    area_m2: 324.0,
    reflectance: 0.96,
    attitude: Attitude::SunToNadir,
    half_rad: HALF_DEG * std::f64::consts::PI / 180.0,
};

/// A mirror on a circle over an Earth that does not turn, overhead at `zenith_s` but `aside_km` of ground to the side.
fn overhead(zenith_s: f64, aside_km: f64) -> impl Fn(f64) -> satphot::Result<Scene> {
    let n = (398_600.441_8 / (R_KM + HEIGHT_KM).powi(3)).sqrt();
    let tilt = aside_km / R_KM;
    move |t: f64| {
        let (s, c) = (n * (t - zenith_s)).sin_cos();
        let (east, north) = (Vector::<Itrs>::new(tilt.cos(), tilt.sin(), 0.0), Vector::new(0.0, 0.0, 1.0));
        Ok(Scene {
            satellite_km: (east * c + north * s) * (R_KM + HEIGHT_KM),
            velocity_km_s: (north * c + east * -s) * (n * (R_KM + HEIGHT_KM)),
            observer_km: Vector::new(R_KM, 0.0, 0.0),
            sun_km: Vector::new(0.6, 0.8, 0.0) * 1.495_978_707e8,
            moon_km: Vector::new(0.6, 0.8, 0.1) * 4e5,
            sidereal_rad: 0.0,
        })
    }
}

fn search(
    scene: &dyn Fn(f64) -> satphot::Result<Scene>,
    light_source: LightSource,
    mirror: &Mirror,
    length_s: f64,
    step_s: f64,
) -> Vec<Approach> {
    let light_sources = SourceSettings::new(&Effects::of(Mode::Corrected), &Band::named("V").unwrap()).unwrap();
    approaches(scene, (light_source, mirror), (length_s, step_s), &light_sources).unwrap()
}

/// Central angle from the site at which the nadir beam's edge passes over it: `tan α = R sin ψ/(r − R cos ψ)`.
fn edge_rad() -> f64 {
    let (mut lo, mut hi) = (0.0f64, 0.01f64);
    for _ in 0..100 {
        let psi = 0.5 * (lo + hi);
        let tan = R_KM * psi.sin() / (R_KM + HEIGHT_KM - R_KM * psi.cos());
        if tan < HALF_DEG.to_radians().tan() { lo = psi } else { hi = psi }
    }
    lo
}

#[test]
fn the_published_beam_and_the_magnitude_inside_it() {
    assert!((beam_diameter_km(625.0, 0.53f64.to_radians()).unwrap() - 5.781_444_372).abs() < 1e-6);
    let up = Vector::<Itrs>::new(0.0, 0.0, 1.0);
    let mag = |source_mag| glint_mag((324.0, 0.96), (&up, &up, &up), 625.0, HALF_DEG.to_radians(), source_mag);
    // points earendil_glint_sun; the Moon of −12.73 as much fainter as the Sun's −26.76
    assert!((mag(-26.76).unwrap() + 14.444_149_632).abs() < 1e-3);
    assert!((mag(-12.73).unwrap() + 0.414).abs() < 1e-3);
    let aside = Vector::<Itrs>::new(0.3f64.to_radians().sin(), 0.0, 0.3f64.to_radians().cos());
    assert_eq!(glint_mag((324.0, 0.96), (&up, &up, &aside), 625.0, HALF_DEG.to_radians(), -26.76), None);
    assert!(beam_diameter_km(0.0, 0.01).is_err() && beam_diameter_km(625.0, 0.0).is_err());
}

#[test]
fn a_crossing_of_less_than_a_second_is_found_whatever_the_step_and_lasts_as_long_as_it_must() {
    let n = (398_600.441_8 / (R_KM + HEIGHT_KM).powi(3)).sqrt();
    let expected_s = 2.0 * edge_rad() / n;
    assert!((0.7..1.0).contains(&expected_s), "{expected_s}");
    for (zenith_s, step_s) in [(1234.567, 10.0), (1230.0, 10.0), (1234.567, 3.0), (1237.9, 47.0)] {
        let found = search(&overhead(zenith_s, 0.0), LightSource::Sun, &EARENDIL, 3000.0, step_s);
        assert_eq!(found.len(), 1, "{step_s}");
        let a = found[0];
        let inside = a.inside.unwrap();
        assert!((a.t_s - zenith_s).abs() < 0.003 && a.miss_km < 0.03, "{a:?}");
        assert!((inside.to_s - inside.from_s - expected_s).abs() < 0.005, "{inside:?}");
        // the Sun stands 126.87° from nadir: the mirror, halfway, sees both at half of that
        let expected = -14.444_15 - 2.5 * (0.5 * (-0.6f64).acos()).cos().log10();
        assert!((inside.mag.unwrap() - expected).abs() < 0.01, "{inside:?}");
    }
}

#[test]
fn off_the_middle_the_crossing_is_shorter_and_beyond_the_edge_there_is_none() {
    let edge_km = R_KM * edge_rad();
    let at = |aside_km: f64| search(&overhead(1000.0, aside_km), LightSource::Sun, &EARENDIL, 2000.0, 10.0)[0];
    let long = |a: Approach| a.inside.map(|i| i.to_s - i.from_s);
    let whole = long(at(0.0)).unwrap();
    let half = long(at(0.5 * edge_km)).unwrap();
    assert!((half / whole - 0.75f64.sqrt()).abs() < 0.01, "{half} {whole}");
    assert!(long(at(0.999 * edge_km)).is_some() && long(at(1.001 * edge_km)).is_none());
    let far = at(500.0);
    assert!(far.inside.is_none() && (far.miss_km / 500.0 - 1.0).abs() < 0.02, "{far:?}");
}

#[test]
fn a_fixed_mirrors_crossings_are_those_of_a_dense_search_and_the_moons_beam_goes_elsewhere() {
    // a normal fixed among the stars whose beam comes to the site while the mirror passes
    let scene = overhead(1000.0, 30.0);
    let at = scene(1020.0).unwrap();
    let toward = |v: Vector<Itrs>| (v - at.satellite_km).unit().unwrap();
    let normal = (toward(at.sun_km) + toward(at.observer_km)).unit().unwrap();
    let mirror = Mirror { attitude: Attitude::Fixed(normal), ..EARENDIL };
    let found = search(&scene, LightSource::Sun, &mirror, 2000.0, 10.0);
    let inside: Vec<_> = found.iter().filter_map(|a| a.inside).collect();
    assert_eq!(inside.len(), 1);
    assert!(inside[0].from_s < 1020.0 && 1020.0 < inside[0].to_s);
    // every 5 ms around, directly
    let offset = |t: f64| {
        let s = scene(t).unwrap();
        let sun = (s.sun_km - s.satellite_km).unit().unwrap();
        (normal * (2.0 * normal.dot(&sun)) - sun).angle_to(&(s.observer_km - s.satellite_km))
    };
    let covered: Vec<f64> =
        (0..4000).map(|i| 1010.0 + 0.005 * f64::from(i)).filter(|t| offset(*t) <= EARENDIL.half_rad).collect();
    assert!((covered[0] - inside[0].from_s).abs() < 0.006, "{} {inside:?}", covered[0]);
    assert!((covered[covered.len() - 1] - inside[0].to_s).abs() < 0.006);
    // the Moon stands 6° from the Sun: its beam passes by
    assert!(
        search(&scene, LightSource::Moon, &mirror, 2000.0, 10.0)
            .iter()
            .all(|a| a.inside.is_none() || (a.t_s - 1020.0).abs() > 1.0)
    );
}

#[test]
fn in_the_shadow_the_beam_crosses_without_light() {
    let dark = |t: f64| {
        overhead(500.0, 0.0)(t).map(|s| Scene { sun_km: Vector::new(-0.96, 0.28, 0.0) * 1.495_978_707e8, ..s })
    };
    let found = search(&dark, LightSource::Sun, &EARENDIL, 1000.0, 10.0);
    let a = found.iter().find(|a| a.inside.is_some()).unwrap();
    assert_eq!((a.lit_frac, a.inside.unwrap().mag), (0.0, None));
}

#[test]
fn the_papers_orbit_does_not_meet_the_site_on_its_day_and_does_from_a_node_that_is_made_to() {
    let empty = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let base = ["limits", "footprint", "--site", "-33.7703,151.1113,70", "--light-source", "sun"];
        satphot(empty.path(), &[&base[..], more].concat()).expect(0, &[]).out
    };
    let text = run(&["--hours", "24"]);
    assert!(text.contains("5.781 km across") && text.contains("the beam covers the site 0 times"), "{text}");
    assert!(text.contains("once in 194 days"), "{text}");
    // turn the node until the nearest approach of the evening is overhead
    let miss = |node: f64| -> (f64, f64) {
        // a quarter of an orbit from the descending node at the start on
        let node = format!("{node}");
        let text = run(&["--hours", "0.4", "--phase-deg", "180", "--csv", "--node-deg", &node]);
        let row = text.lines().skip(1).map(|l| l.split(',').map(String::from).collect::<Vec<_>>());
        let nearest = row.min_by(|a, b| a[5].parse::<f64>().unwrap().total_cmp(&b[5].parse::<f64>().unwrap()));
        nearest.map_or((1e9, 0.0), |r| (r[5].parse().unwrap(), r[11].parse().unwrap_or(0.0)))
    };
    let nodes: Vec<(f64, f64)> = (0..36).map(|k| (10.0 * f64::from(k), miss(10.0 * f64::from(k)).0)).collect();
    let coarse = nodes.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
    let (mut lo, mut hi) = (coarse - 10.0, coarse + 10.0);
    for _ in 0..25 {
        let (a, b) = (lo + 0.382 * (hi - lo), lo + 0.618 * (hi - lo));
        if miss(a).0 < miss(b).0 { hi = b } else { lo = a }
    }
    let (miss_km, in_beam_s) = miss(0.5 * (lo + hi));
    assert!(miss_km < 0.5 && (0.6..1.1).contains(&in_beam_s), "{miss_km} {in_beam_s}");
}

#[test]
fn refusals_name_the_option() {
    let empty = tempfile::tempdir().unwrap();
    for (args, word) in [
        (&["--area-m2", "0"][..], "--area-m2"),
        (&["--reflectance", "1.1"], "--reflectance"),
        (&["--height-km", "-5"], "--height-km"),
        (&["--lvlh", "0,0"], "--lvlh"),
        (&["--lvlh", "0,0,0"], "--lvlh"),
        (&["--inertial-deg", "10,95"], "--inertial-deg"),
        (&["--start", "yesterday"], "--start"),
        (&["--hours", "0"], "--hours"),
        (&["-o", "beam.csv"], ".ecsv"),
        (&["--elements", "x.tle", "--height-km", "500"], "--height-km"),
    ] {
        let base = ["limits", "footprint", "--site", "-33.7703,151.1113,70"];
        satphot(empty.path(), &[&base[..], args].concat()).expect(2, &[word]).without_results();
    }
    satphot(empty.path(), &["limits", "footprint"]).expect(2, &["--site"]).without_results();
}

#[test]
fn a_beam_of_unknown_node_and_phase_meets_a_site_as_often_as_is_said() {
    let (lat, wide_km) = ((-33.77f64).to_radians(), 400.0);
    let expected = crossings_per_day(625.0, 88f64.to_radians(), lat, wide_km).unwrap();
    let (days, step_s) = (600, 8.0);
    let mut met = 0;
    for k in 0..days {
        // two irrational strides spread node and phase evenly
        let turn = |stride: f64| std::f64::consts::TAU * (f64::from(k) * stride).fract();
        let orbit =
            CircularOrbit::new(625.0, 88f64.to_radians(), turn(0.618_033_988_75), turn(0.754_877_666_25)).unwrap();
        let mut before = true; // one that begins inside is not counted
        for i in 0..(86_400.0 / step_s) as u32 {
            let t = f64::from(i) * step_s;
            let (s, c) = (satphot::base::constants::EARTH_ROTATION_RAD_S * t).sin_cos();
            let r = orbit.state(t).0;
            let apart = (r.x() * c + r.y() * s) * lat.cos() + r.z() * lat.sin();
            let inside = (apart / r.norm()).acos() * R_KM < 0.5 * wide_km;
            met += u32::from(inside && !before);
            before = inside;
        }
    }
    let per_day = f64::from(met) / f64::from(days);
    // some 210 crossings: even strides do better than their root of 7 %
    assert!((per_day / expected - 1.0).abs() < 0.12, "{per_day} {expected}");
}
