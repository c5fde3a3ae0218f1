//! The direct and the Earth-reflected flux against 200 independently converged cases (those of Lambert and Phong).
#![allow(clippy::unwrap_used)]

use std::path::Path;

use satphot::brightness::{
    Accuracy, Attitude, Brdf, Ground, ModelSettings, Satellite, Scene, Surface, brightness, reflected_by_earth,
};
use satphot::config::Mode;
use satphot::vector::{Itrs, Vector};

/// One row: geometry in the frame of the satellite's vertical, lengths in km.
struct Row {
    id: String,
    satellite_km: Vector<Itrs>,
    observer_km: Vector<Itrs>,
    lamp: Vector<Itrs>,
    normal: Vector<Itrs>,
    area_m2: f64,
    brdf: Brdf,
    earth: Brdf,
    direct: f64,
    via_earth: f64,
}

const RADIUS_KM: f64 = 6378.0;

fn rows() -> Option<Vec<Row>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/brightness_vectors.csv");
    if !Path::new(path).exists() {
        println!("skipped: ../shared/reference/brightness_vectors.csv not present");
        return None;
    }
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).unwrap();
    let column: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.unwrap();
        let text = |name: &str| record[column.iter().position(|c| c == name).unwrap()].to_string();
        let number = |name: &str| text(name).parse::<f64>().unwrap_or(f64::NAN);
        let law = |kind: &str, p: [f64; 3]| match kind {
            "lambertian" => Some(Brdf::Lambert { albedo: p[0] }),
            "phong" => Some(Brdf::Phong { kd: p[0], ks: p[1], n: p[2] }),
            _ => None,
        };
        let Some(brdf) = law(&text("brdf"), ["p1", "p2", "p3"].map(number)) else { continue };
        let earth = law(&text("earth_brdf"), ["ep1", "ep2", "ep3"].map(number)).unwrap();
        let elevation = number("src_elev_deg").to_radians();
        let [x, y, z] = ["obs_x_m", "obs_y_m", "obs_z_m"].map(|c| number(c) / 1e3);
        rows.push(Row {
            id: text("id"),
            satellite_km: Vector::new(0.0, 0.0, RADIUS_KM + number("height_m") / 1e3),
            observer_km: Vector::new(x, y, z),
            lamp: Vector::new(0.0, elevation.cos(), elevation.sin()),
            normal: Vector::new(number("nx"), number("ny"), number("nz")),
            area_m2: number("area_m2"),
            brdf,
            earth,
            direct: number("direct_per_E0"),
            via_earth: number("earth_per_E0"),
        });
    }
    Some(rows)
}

/// ∫ over the Earth times A (n·o)/d², as the engine composes it; the estimated error beside it.
fn via_earth(row: &Row, tolerance: f64) -> (f64, f64, usize) {
    let to_observer = row.observer_km - row.satellite_km;
    let observer = to_observer.unit().unwrap();
    let normal = row.normal.unit().unwrap();
    let ground = Ground::new(&row.satellite_km, RADIUS_KM, &row.lamp, &row.earth).unwrap();
    let cos_o = normal.dot(&observer);
    // the rules of the reference: nothing below the horizon, nothing from behind
    let below = row.observer_km.z() < RADIUS_KM * RADIUS_KM / row.satellite_km.z();
    if cos_o <= 0.0 || below || !ground.lit_in_view() || !ground.seen_by(&normal) {
        return (0.0, 0.0, 0);
    }
    let light = reflected_by_earth(&ground, &row.brdf, &normal, &observer, &Accuracy::relative(tolerance, 1_000_000));
    let d_m = to_observer.norm() * 1e3;
    (row.area_m2 * cos_o / (d_m * d_m) * light.per_sr, light.err_per_sr / light.per_sr.max(1e-300), light.nodes)
}

#[test]
fn the_earth_reflected_flux_is_the_reference_to_the_tolerance_asked() {
    let Some(rows) = rows() else { return };
    assert!(rows.len() > 90, "{}", rows.len());
    for (tolerance, claim) in [(1e-3, 1e-3), (1e-4, 1e-4), (1e-7, 1e-6), (1e-10, 1e-8)] {
        let started = std::time::Instant::now();
        let (mut worst, mut nodes, mut misses) = (0.0_f64, Vec::new(), Vec::new());
        for row in &rows {
            let (got, err_rel, n) = via_earth(row, tolerance);
            if row.via_earth == 0.0 {
                assert_eq!(got, 0.0, "{}", row.id);
                continue;
            }
            let off = (got / row.via_earth - 1.0).abs();
            worst = worst.max(off);
            nodes.push(n);
            if off > claim {
                misses.push(format!("{} off {off:.1e}, estimated {err_rel:.1e}, {n} nodes", row.id));
            }
        }
        nodes.sort_unstable();
        println!(
            "tolerance {tolerance:e}: worst {worst:.2e}, nodes median {} max {}, {:.1} us a row",
            nodes[nodes.len() / 2],
            nodes[nodes.len() - 1],
            started.elapsed().as_secs_f64() * 1e6 / rows.len() as f64
        );
        assert!(misses.is_empty(), "tolerance {tolerance:e}: {misses:#?}");
    }
}

#[test]
fn the_direct_flux_is_the_reference_to_1e_8() {
    let Some(rows) = rows() else { return };
    for row in &rows {
        // The engine's lamps are at a distance: at 1e14 km parallax and range are below 1e-9.
        let far_km = 1e14;
        let plate = Surface {
            name: "plate".into(),
            area_m2: row.area_m2,
            attitude: Attitude::Fixed(row.normal),
            brdf: row.brdf.clone(),
            back: None,
        };
        let satellite = Satellite { name: row.id.clone(), surfaces: vec![plate], source: "test".into() };
        let scene = Scene {
            satellite_km: row.satellite_km,
            velocity_km_s: Vector::new(7.6, 0.0, 0.0),
            observer_km: row.observer_km,
            sun_km: row.lamp * far_km,
            moon_km: -row.lamp * far_km,
        };
        let mut settings = ModelSettings::new(Mode::AsPublished, 1e-3);
        settings.earth_radius_km = Some(RADIUS_KM);
        settings.earth = row.earth.clone();
        let got = brightness(&scene, &satellite, &settings).unwrap().sun.flux_ratio / 10.0_f64.powf(0.4 * 26.76);
        let off = (got - row.direct).abs();
        assert!(off <= 1e-8 * row.direct, "{}: {got:e} {:e}", row.id, row.direct);
    }
}
