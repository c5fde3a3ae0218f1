#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
//! Laws of the resolved satellite: limits, energy, shadows, the Moon's criterion, and the areas of the shipped ones.

use std::path::Path;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{self, Attitude, Brdf, ModelSettings, Satellite, Scene, Surface};
use satphot::resolved::projected::{areas, silhouette_m2};
use satphot::resolved::triangle::double_area;
use satphot::resolved::{ComponentSatellite, Light, RayCounts, RenderSettings, Renderer, ResolvedScene, render};

const R_KM: f64 = 6378.137;
const AU_KM: f64 = 149_597_870.7;

/// A satellite 420 km up over the equator at longitude 0, moving north east; angles in degrees.
///
/// The observer is `arc` away from the sub-satellite point towards the azimuth of `body`; Sun and Moon stand at elevations
/// above the satellite's own horizontal, in the plane of that azimuth.
fn scene(arc_deg: f64, sun_deg: f64, moon_deg: f64) -> Scene {
    let at = |deg: f64| {
        let (s, c) = deg.to_radians().sin_cos();
        // up is x; the plane holds 0.8 east, 0.6 north
        Vector::<Itrs>::new(s, 0.8 * c, 0.6 * c)
    };
    let (s, c) = arc_deg.to_radians().sin_cos();
    Scene {
        satellite_km: Vector::new(R_KM + 420.0, 0.0, 0.0),
        velocity_km_s: Vector::new(0.0, 4.7, 6.0),
        observer_km: Vector::new(c, 0.8 * s, 0.6 * s) * R_KM,
        sun_km: at(sun_deg) * AU_KM,
        moon_km: Vector::new(R_KM, 0.0, 0.0) + at(moon_deg) * 385_000.0,
        sidereal_rad: 0.0,
    }
}

fn satellite(components: &str) -> ComponentSatellite {
    let text = format!(
        "name = \"t\"\ntitle = \"t\"\ncomponents = [\n{components}\n]\n\
         [materials.white]\nbrdf = {{ kind = \"lambert\", albedo = 0.5 }}\n\
         [materials.glossy]\nbrdf = {{ kind = \"phong\", kd = 0.3, ks = 0.3, n = 6.0 }}\n\
         [[joints]]\nname = \"alpha\"\npivot_m = [0, 60, 0]\naxis = [0, 1, 0]\nzero = [0, 0, -1]\n\
         [[joints]]\nname = \"beta\"\non = \"alpha\"\npivot_m = [0, 60, 0]\naxis = [1, 0, 0]\nzero = [0, 0, -1]\n"
    );
    ComponentSatellite::parse(&text, Path::new(".")).unwrap()
}

fn cube(name: &str, at: [f64; 3], size: f64) -> String {
    format!(
        "{{ name = \"{name}\", material = \"glossy\", at_m = {at:?}, shape = {{ box = {{ size_m = [{size:?}, {size:?}, {size:?}] }} }} }},"
    )
}

const DOWN: &str = "{ name = \"down\", material = \"white\", at_m = [0.0, 0.0, 0.0], shape = { plate = { size_m = [12, 20], normal = [0, 0, 1], along = [1, 0, 0] } } },";

fn settings(pixels: usize, samples: usize) -> RenderSettings {
    RenderSettings { pixels, samples, starlight_mag_arcsec2: None, ..RenderSettings::default() }
}

fn of(satellite: &ComponentSatellite, scene: Scene) -> ResolvedScene {
    ResolvedScene { satellite: satellite.clone(), scene }
}

fn v_flux(rendered: &satphot::resolved::Rendered, light: Light) -> f64 {
    rendered.v_flux.iter().find(|(l, _)| *l == light).map_or(0.0, |(_, v)| *v)
}

#[test]
fn a_far_component_satellite_is_the_two_surface_engines_to_1e_3() {
    // far apart, so that neither can shade the other
    let wing = "{ name = \"wing\", material = \"glossy\", at_m = [0.0, 60.0, 0.0], joint = \"beta\", shape = { plate = { size_m = [20, 8], normal = [0, 0, -1], along = [1, 0, 0] } } },";
    let resolved = satellite(&format!("{DOWN}{wing}"));
    let surface =
        |name: &str, area_m2, attitude, brdf| Surface { name: name.into(), area_m2, attitude, brdf, back: None };
    let two = Satellite::of(
        "two",
        vec![
            surface("chassis", 240.0, Attitude::Nadir, Brdf::Lambert { albedo: 0.5 }),
            surface("array", 160.0, Attitude::Sun, Brdf::Phong { kd: 0.3, ks: 0.3, n: 6.0 }),
        ],
    );
    let model = ModelSettings { tolerance: 1e-5, ..ModelSettings::default() };
    let mut compared = 0;
    for (arc, sun, moon) in [(1.0, 30.0, 60.0), (4.0, -8.0, 50.0), (8.0, -60.0, 64.0), (6.0, -70.0, -10.0)] {
        let at = scene(arc, sun, moon);
        let engine = brightness::brightness(&at, &two, &model).unwrap();
        let own = RenderSettings { model: model.clone(), ..settings(512, 6) };
        let rendered = render(&of(&resolved, at), &own).unwrap();
        let pairs = [
            (Light::Sun, engine.sun.flux_ratio),
            (Light::Earthshine, engine.earthshine.flux_ratio),
            (Light::Moon, engine.moon.flux_ratio),
            (Light::LunarEarthshine, engine.lunar_earthshine.flux_ratio),
        ];
        for (light, expected) in pairs {
            let got = v_flux(&rendered, light);
            // 512 pixels, 36 samples: the edges of the plates are sampled to 3e-4
            assert!((got - expected).abs() <= 1e-3 * expected, "{arc} {sun} {moon} {light:?}: {got} {expected}");
            compared += usize::from(expected > 0.0);
        }
    }
    assert!(compared >= 9, "{compared}");
}

#[test]
fn a_convex_body_needs_no_shadow_rays_and_says_so() {
    let one = satellite(&cube("a", [0.0, 0.0, 0.0], 3.0));
    let rendered = render(&of(&one, scene(5.0, 20.0, 50.0)), &settings(64, 2)).unwrap();
    assert!(rendered.convex);
    assert_eq!((rendered.rays.shadow, rendered.rays.earth_and_sky), (0, 0));
    let two = satellite(&(cube("a", [0.0, 0.0, 0.0], 3.0) + &cube("b", [0.0, 5.0, 0.0], 3.0)));
    let rendered = render(&of(&two, scene(5.0, 20.0, 50.0)), &settings(64, 2)).unwrap();
    assert!(!rendered.convex && rendered.rays.earth_and_sky > 0);
}

/// Irradiance of each light by places on the surface instead of pixels: `per_m2` places on every square metre of triangle
/// the observer sees, in Roberts' sequence R2, each with its share of the triangle's area.
fn over_surface(renderer: &Renderer, range_km: f64, per_m2: f64) -> [f64; 5] {
    let body = &renderer.body;
    let observer = renderer.around.observer;
    let mut sum = [0.0; 5];
    for (at, face) in body.faces.iter().enumerate() {
        let (side, normal) = body.side_toward(at, &observer);
        if side == 1 && !face.sheet {
            continue;
        }
        let [a, b, c] = face.corners;
        let area = 0.5 * double_area(&face.corners).norm() * normal.dot(&observer);
        let places = (area * per_m2).ceil().max(16.0);
        for i in 0..places as usize {
            let [u, v] = [0.754_877_666_246_693, 0.569_840_290_998_053_2].map(|step| (0.5 + i as f64 * step).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let place = a + (b - a) * u + (c - a) * v;
            if !body.shaded(&place, &normal, &observer) {
                let light = renderer.light(at, &place, &[i], &mut RayCounts::default());
                sum.iter_mut().zip(light).for_each(|(sum, l)| *sum += l * area / places);
            }
        }
    }
    sum.map(|radiance_m2| radiance_m2 / (range_km * 1e3).powi(2))
}

#[test]
fn the_sum_of_the_picture_is_the_sum_over_the_surface() {
    let convex = satellite(&cube("a", [0.0, 0.0, 0.0], 3.0));
    // the second cube shades part of the first and hides part of it
    let shaded = satellite(&(cube("a", [0.0, 0.0, 0.0], 3.0) + &cube("b", [1.0, 3.5, 2.5], 2.0)));
    for (body, per_m2) in [(&convex, 1.0), (&shaded, 40_000.0)] {
        let at = scene(5.0, 20.0, 50.0);
        let renderer = Renderer::new(&of(body, at), &settings(512, 4)).unwrap();
        let rendered = renderer.picture();
        let surface = over_surface(&renderer, at.range_km(), per_m2);
        for (index, light) in Light::ALL.into_iter().enumerate().take(3) {
            let (picture, surface) = (rendered.image.irradiance_w_m2(light), surface[index]);
            assert!(picture > 0.0 && (picture / surface - 1.0).abs() < 1e-4, "{light:?}: {picture} {surface}");
        }
    }
}

#[test]
fn a_scene_turned_about_the_axis_of_the_earth_gives_the_same_light() {
    let body = satellite(&(cube("a", [0.0, 0.0, 0.0], 3.0) + &cube("b", [1.0, 3.5, 2.5], 2.0)));
    let turn = |v: Vector<Itrs>| {
        let (s, c) = 1.1_f64.sin_cos();
        Vector::new(c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z())
    };
    let here = scene(5.0, 20.0, 50.0);
    let there = Scene {
        satellite_km: turn(here.satellite_km),
        velocity_km_s: turn(here.velocity_km_s),
        observer_km: turn(here.observer_km),
        sun_km: turn(here.sun_km),
        moon_km: turn(here.moon_km),
        ..here
    };
    let (a, b) =
        (render(&of(&body, here), &settings(96, 2)).unwrap(), render(&of(&body, there), &settings(96, 2)).unwrap());
    for light in Light::ALL {
        let (a, b) = (v_flux(&a, light), v_flux(&b, light));
        // the directions towards Earth and sky are counted from another zero: their noise, some 1e-3
        let tolerance = if matches!(light, Light::Sun | Light::Moon) { 1e-6 } else { 5e-3 };
        assert!((a - b).abs() <= tolerance * a, "{light:?}: {a} {b}");
    }
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let body = satellite(&(cube("a", [0.0, 0.0, 0.0], 3.0) + &cube("b", [1.0, 3.5, 2.5], 2.0)));
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| render(&of(&body, scene(5.0, 20.0, 50.0)), &settings(48, 2)).unwrap())
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.image.planes, three.image.planes);
    assert_eq!(one.rays, three.rays);
}

/// Direct moonlight of a plate that faces nadir, Sun far below.
fn moonlight_on_a_nadir_plate(arc_deg: f64, moon_deg: f64) -> f64 {
    let rendered = render(&of(&satellite(DOWN), scene(arc_deg, -70.0, moon_deg)), &settings(32, 1)).unwrap();
    assert!(rendered.seen_area_m2 > 0.0, "the observer sees its underside");
    v_flux(&rendered, Light::Moon)
}

#[test]
fn direct_moonlight_reaches_no_nadir_face_exactly_when_the_moon_is_above_the_satellites_own_horizontal() {
    // the Moon's disc is 0.26 degrees in radius; below -20 degrees it sets behind the Earth
    for arc in [0.5, 6.0] {
        for moon in [0.5, 1.0, 10.0, 64.0] {
            assert_eq!(moonlight_on_a_nadir_plate(arc, moon), 0.0, "{arc} {moon}");
        }
        for moon in [-0.5, -1.0, -10.0, -18.0] {
            assert!(moonlight_on_a_nadir_plate(arc, moon) > 0.0, "{arc} {moon}");
        }
        assert_eq!(moonlight_on_a_nadir_plate(arc, -25.0), 0.0, "behind the Earth");
    }
}

#[test]
fn away_from_the_zenith_the_observers_horizon_is_the_wrong_criterion() {
    let moon_alt_deg = |s: &Scene| {
        let up = s.observer_km.unit().unwrap();
        ((s.moon_km - s.observer_km).unit().unwrap().dot(&up)).asin().to_degrees()
    };
    // the observer, 8 degrees towards the Moon, sees it up while it shines on the satellite from below
    let toward = scene(8.0, -70.0, -4.0);
    assert!(moon_alt_deg(&toward) > 2.0);
    assert!(moonlight_on_a_nadir_plate(8.0, -4.0) > 0.0);
    // and away from it sees it down while it is above the satellite's horizontal
    let away = scene(-8.0, -70.0, 4.0);
    assert!(moon_alt_deg(&away) < -2.0);
    assert_eq!(moonlight_on_a_nadir_plate(-8.0, 4.0), 0.0);
}

#[test]
fn shadows_only_take_light_and_a_bounce_only_gives_it() {
    let iss = ComponentSatellite::named("iss").unwrap();
    let at = scene(5.0, 20.0, 50.0);
    let with = |shadows: bool, bounce: bool| {
        render(&of(&iss, at), &RenderSettings { shadows, bounce, ..settings(64, 1) }).unwrap()
    };
    let (bare, shaded, bounced) = (with(false, false), with(true, false), with(true, true));
    for light in [Light::Sun, Light::Earthshine, Light::Moon] {
        let (bare, shaded, bounced) = (v_flux(&bare, light), v_flux(&shaded, light), v_flux(&bounced, light));
        assert!(shaded < bare && shaded > 0.3 * bare, "{light:?}: {shaded} {bare}");
        assert!(bounced > shaded && bounced < 2.0 * shaded, "{light:?}: {bounced} {shaded}");
    }
}

#[test]
fn the_areas_of_the_shipped_satellites_are_the_catalogues() {
    let mut checked = 0;
    for name in ComponentSatellite::names() {
        for row in areas(&ComponentSatellite::named(name).unwrap(), 32).unwrap() {
            if let Some(area) = row.catalogue_m2 {
                // edges are given to a few digits; a prism shows up to (π/32)²/6 more or less than its cylinder
                assert!((row.broadside_m2 / area - 1.0).abs() < 5e-3, "{name}: {row:?}");
                checked += 1;
            }
        }
    }
    assert!(checked >= 33, "{checked}");
    let iss = areas(&ComponentSatellite::named("iss").unwrap(), 64).unwrap();
    let arrays = |part: &str| part.to_lowercase().contains("solar panel") || part.contains("solar array");
    let (mut chassis, mut array) = (0.0, 0.0);
    for row in iss.iter().filter(|r| r.part != "Cupola") {
        *(if arrays(&row.part) { &mut array } else { &mut chassis }) += row.broadside_m2;
    }
    assert!((array / 2672.36 - 1.0).abs() < 1e-4, "{array}");
    // the parts, not the published total of 1577.89
    assert!((chassis / 1623.94 - 1.0).abs() < 2e-3, "{chassis}");
}

#[test]
fn what_is_seen_in_the_picture_is_the_silhouette() {
    let iss = ComponentSatellite::named("iss").unwrap();
    let at = scene(5.0, 20.0, 50.0);
    let renderer = Renderer::new(&of(&iss, at), &settings(256, 2)).unwrap();
    let (seen, rays) = (renderer.picture().seen_area_m2, silhouette_m2(&renderer.body, &renderer.around.observer, 400));
    assert!((seen / rays - 1.0).abs() < 1e-2, "{seen} {rays}");
    let sum: f64 = areas(&iss, 32).unwrap().iter().map(|r| r.broadside_m2).sum();
    assert!(seen < sum);
}

#[test]
fn of_the_published_case_panel_and_radiator_have_no_direct_moonlight_and_body_1_has() {
    let (rows, notes) =
        satphot::paper::resolved_case::resolved_case(&RenderSettings { pixels: 96, ..RenderSettings::default() })
            .unwrap();
    assert!(notes.iter().any(|n| n.contains("204")) && notes.iter().any(|n| n.contains("per cm2")));
    let of = |quantity: &str, whose: &str| {
        rows.iter().find(|r| r.quantity == quantity && r.of.contains(whose)).unwrap().steps
    };
    for whose in ["uniform", "Lambert", "vegetation"] {
        for dark in ["panel", "body2"] {
            let [star, moon, all] = of(dark, whose).map(Option::unwrap);
            assert!(star > 0.0 && (moon / star - 1.0).abs() < 1e-9 && all > 2.0 * moon, "{dark} {whose}");
        }
        let [star, moon, all] = of("body1", whose).map(Option::unwrap);
        assert!(moon > 5.0 * star && all > moon, "{whose}: {star} {moon} {all}");
    }
    // a uniform Earth is that much fainter than the ground under the full Moon
    let (uniform, lambert) = (of("panel", "uniform")[2].unwrap(), of("panel", "Lambert")[2].unwrap());
    assert!(lambert > 5.0 * uniform, "{lambert} {uniform}");
}
