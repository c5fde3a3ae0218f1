//! Pictures: where the satellite lies in them, what they hold of it, what is refused before they are made.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use satphot::base::vector::Vector;
use satphot::brightness::{Brdf, Catalogue, Scene};
use satphot::figures::radiance::fits::{PictureFacts, write_picture};
use satphot::figures::radiance::radiance_rows;
use satphot::resolved::points::parse_point;
use satphot::resolved::{ComponentSatellite, RenderSettings, Renderer, ResolvedScene, render};

const R_KM: f64 = 6378.137;

/// A satellite 420 km up, the observer 5 degrees away, the Sun half up behind him.
fn scene(satellite: &ComponentSatellite) -> ResolvedScene {
    let (s, c) = 5.0_f64.to_radians().sin_cos();
    let scene = Scene {
        satellite_km: Vector::new(R_KM + 420.0, 0.0, 0.0),
        velocity_km_s: Vector::new(0.0, 4.7, 6.0),
        observer_km: Vector::new(c, 0.8 * s, 0.6 * s) * R_KM,
        sun_km: Vector::new(0.5, 0.7, 0.51) * 149_597_870.7,
        moon_km: Vector::new(0.6, -0.5, 0.6) * 385_000.0,
        sidereal_rad: 0.0,
    };
    ResolvedScene { satellite: satellite.clone(), scene }
}

fn satellite(shape: &str, at_m: [f64; 3], folder: &Path) -> satphot::Result<ComponentSatellite> {
    let text = format!(
        "name = \"t\"\ntitle = \"t\"\ncomponents = [ {{ name = \"a\", material = \"grey\", at_m = {at_m:?}, shape = {{ {shape} }} }} ]\n\
         [materials.grey]\nbrdf = {{ kind = \"lambert\", albedo = 0.5 }}\n"
    );
    ComponentSatellite::parse(&text, folder)
}

fn cube(at_m: [f64; 3]) -> ComponentSatellite {
    satellite("box = { size_m = [2, 2, 2] }", at_m, Path::new(".")).unwrap()
}

fn settings(pixels: usize) -> RenderSettings {
    RenderSettings { pixels, ..RenderSettings::default() }
}

#[test]
fn a_body_off_its_origin_lies_in_the_middle_of_its_picture_and_fills_it() {
    let (here, there) = (cube([0.0; 3]), cube([40.0, -25.0, 10.0]));
    let pictures = [&here, &there].map(|body| render(&scene(body), &settings(64)).unwrap());
    let [a, b] = &pictures;
    assert!((a.image.pixel_rad / b.image.pixel_rad - 1.0).abs() < 1e-9);
    assert!((a.seen_area_m2 / b.seen_area_m2 - 1.0).abs() < 1e-3, "{} {}", a.seen_area_m2, b.seen_area_m2);
    for rendered in &pictures {
        let plane = &rendered.image.planes.last().unwrap().1; // starlight, from all sides
        let lit = |rows: bool| {
            let at: Vec<usize> =
                plane.indexed_iter().filter(|(_, v)| **v > 0.0).map(|((j, i), _)| if rows { j } else { i }).collect();
            (*at.iter().min().unwrap() as f64, *at.iter().max().unwrap() as f64)
        };
        for (low, high) in [lit(true), lit(false)] {
            assert!((0.5 * (low + high) - 31.5).abs() <= 1.0, "{low} {high}");
        }
    }
}

#[test]
fn a_picture_that_cuts_the_satellite_off_does_not_pass_its_light_for_the_satellites() {
    let body = cube([3.0, 0.0, 0.0]);
    let whole = Renderer::new(&scene(&body), &settings(32)).unwrap();
    let fits_exactly = 2.0 * whole.view.half_m[0].max(whole.view.half_m[1]) / 32.0;
    let range_m = whole.pixel_m() / whole.picture().image.pixel_rad;
    let folder = tempfile::tempdir().unwrap();
    for (share, cut) in [(1.001, false), (0.999, true)] {
        let own = RenderSettings { pixel_rad: Some(share * fits_exactly / range_m), ..settings(32) };
        let renderer = Renderer::new(&scene(&body), &own).unwrap();
        let rendered = renderer.picture();
        assert_eq!(rendered.whole, !cut, "{share}");
        assert_eq!(rendered.warnings.iter().any(|w| w.contains("reaches beyond the picture")), cut);
        let rows = radiance_rows(&renderer, &rendered, &[]);
        assert!(rows.iter().all(|r| r.place == if cut { "picture" } else { "satellite" }));
        let path = folder.path().join("a.fits");
        let facts = PictureFacts { v_mag: Some(7.0), part: !rendered.whole, ..PictureFacts::default() };
        write_picture(&path, &rendered.image, &facts).unwrap();
        let header = String::from_utf8_lossy(&std::fs::read(&path).unwrap()[..2880 * 2]).into_owned();
        assert_eq!(header.contains("VMAG    ="), !cut);
        assert_eq!(header.contains("VMAGPART="), cut);
    }
}

/// A cube of 2 m as OBJ, its fronts outwards or inwards.
fn cube_obj(inwards: bool) -> String {
    let corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n".to_owned();
    let faces = ["4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"];
    faces.iter().fold(corners, |text, face| {
        let mut face: Vec<&str> = face.split(' ').collect();
        if inwards {
            face.reverse();
        }
        format!("{text}f {}\n", face.join(" "))
    })
}

#[test]
fn a_closed_mesh_wound_inwards_is_refused_with_the_remedy_and_an_open_one_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = |name: &str, more: &str| {
        let shape = format!("mesh = {{ file = \"{name}\", scale_m = 1{more} }}");
        let body = satellite(&shape, [0.0; 3], folder.path()).unwrap();
        render(&scene(&body), &settings(32))
    };
    std::fs::write(folder.path().join("out.obj"), cube_obj(false)).unwrap();
    std::fs::write(folder.path().join("in.obj"), cube_obj(true)).unwrap();
    assert!(mesh("out.obj", "").unwrap().warnings.is_empty());
    let error = mesh("in.obj", "").unwrap_err().to_string();
    assert!(error.contains("in.obj") && error.contains("inwards") && error.contains("sheet = true"), "{error}");
    assert!(mesh("in.obj", ", sheet = true").is_ok());
    // open, only its backs towards the observer
    let open: String = cube_obj(true).lines().filter(|l| *l != "f 1 2 3 4").map(|l| format!("{l}\n")).collect();
    std::fs::write(folder.path().join("open.obj"), open).unwrap();
    let warnings = mesh("open.obj", "").unwrap().warnings;
    assert!(warnings.iter().any(|w| w.contains("black backs")), "{warnings:?}");
}

#[test]
fn a_point_outside_its_component_is_refused_with_the_components_extent() {
    let body = cube([10.0, 0.0, 0.0]);
    let renderer = Renderer::new(&scene(&body), &settings(16)).unwrap();
    for inside in ["a", "a@10,0,0", "a@11,0.9,-0.9", "a@11.04,0,0"] {
        renderer.point("w", &parse_point(inside).unwrap()).unwrap();
    }
    let error = renderer.point("w", &parse_point("a@100,0,0").unwrap()).unwrap_err().to_string();
    assert!(error.contains("89.00 m beyond a") && error.contains("x 9.00 to 11.00"), "{error}");
    let iss = ComponentSatellite::named("iss").unwrap();
    let renderer = Renderer::new(&scene(&iss), &settings(16)).unwrap();
    assert_eq!(iss.points.len(), 3);
    iss.points.iter().for_each(|(name, point)| assert!(renderer.point(name, point).is_ok(), "{name}"));
}

#[test]
fn rays_that_are_no_power_of_two_are_refused() {
    let own = RenderSettings { earth_rays: 15, ..settings(16) };
    let error = own.check().unwrap_err().to_string();
    assert!(error.contains("15") && error.contains("8 or 16"), "{error}");
}

#[test]
fn the_laws_of_a_shipped_satellite_are_those_of_the_catalogues_surface_it_names() {
    let catalogue = Catalogue::load(None).unwrap();
    let mut compared = 0;
    for name in ComponentSatellite::names() {
        let own = ComponentSatellite::named(name).unwrap();
        let Some(entry) = own.catalogue.as_ref().map(|n| catalogue.find(n).unwrap()) else { continue };
        for part in &own.components {
            let Some(surface) = entry.surfaces.iter().find(|s| Some(&s.name) == part.counts_as.as_ref()) else {
                continue;
            };
            let material = own.materials.iter().find(|m| m.name == part.material).unwrap();
            assert_eq!(material.front, Brdf::try_from(&surface.brdf).unwrap(), "{name}: {}", part.name);
            compared += 1;
        }
    }
    assert_eq!(compared, 4);
}

#[test]
fn the_example_of_the_documents_runs() {
    let page = include_str!("../../docs/resolved.md");
    let block = |fence: &str| {
        let (_, rest) = page.split_once(&format!("```{fence}\n")).unwrap();
        rest.split_once("```").unwrap().0.to_owned()
    };
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own.toml");
    std::fs::write(&own, block("toml")).unwrap();
    std::fs::write(folder.path().join("bus.obj"), block("obj")).unwrap();
    let satellite = ComponentSatellite::named(own.to_str().unwrap()).unwrap();
    let renderer = Renderer::new(&scene(&satellite), &settings(48)).unwrap();
    let rendered = renderer.picture();
    assert!(rendered.warnings.is_empty() && rendered.v_flux[0].1 > 0.0, "{:?}", rendered.warnings);
    renderer.point("wing", &satellite.points["wing"]).unwrap();
}
