//! How long the brightness engine takes: one Earth-reflected integral by law and tolerance, and a map of the sky.
//!
//! `cargo bench --bench brightness`. The map is that of scripts/bench_lumos.sh, which also measures its error and the
//! peer; here it is computed by the library alone, without reading or writing anything.
#![allow(clippy::unwrap_used)]

use divan::{Bencher, black_box};
use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::sky::{Body, Sky, SkyGrid, sky_map};
use satphot::brightness::{
    Accuracy, Brdf, Ground, ModelSettings, PreparedBrdf, ReflectedLight, Satellite, ToleranceOf,
};
use satphot::config::Mode;

fn main() {
    divan::main();
}

const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-9];
const RADIUS_KM: f64 = 6378.0;
const HEIGHT_KM: f64 = 550.0;
const AXES: [Vector<Itrs>; 3] = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];

/// A nadir-facing surface by day, 30° up in the sky: its lobe lies on the lit ground.
fn integral(law: &PreparedBrdf, tolerance: f64) -> ReflectedLight {
    let sun = Body::sun(40.0_f64.to_radians(), 1.0).at_infinity();
    let sky = Sky::new(AXES, (RADIUS_KM, HEIGHT_KM), 0.0, sun, None).unwrap();
    let scene = sky.scene(30.0_f64.to_radians(), 2.5);
    let earth = Brdf::named("earth-vegetation").unwrap();
    let ground = Ground::new(&scene.satellite_km, RADIUS_KM, &scene.sun_km, &earth).unwrap();
    let observer = (scene.observer_km - scene.satellite_km).unit().unwrap();
    let nadir = (-scene.satellite_km).unit().unwrap();
    law.reflected(&ground, &nadir, &observer, &Accuracy::relative(tolerance, 1_000_000))
}

fn law(bencher: Bencher, brdf: &Brdf, tolerance: f64) {
    let law = PreparedBrdf::new(brdf);
    bencher.bench_local(|| integral(black_box(&law), tolerance));
}

#[divan::bench(args = TOLERANCES)]
fn integral_lambert(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::Lambert { albedo: 0.3 }, tolerance);
}

#[divan::bench(args = TOLERANCES)]
fn integral_phong_9(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::Phong { kd: 0.34, ks: 0.4, n: 8.9 }, tolerance);
}

#[divan::bench(args = TOLERANCES)]
fn integral_phong_1e6(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::Phong { kd: 0.0, ks: 1.0, n: 1e6 }, tolerance);
}

#[divan::bench(args = TOLERANCES)]
fn integral_gaussian_1e_minus_6(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::Gaussian { peak_per_sr: 1e5, sigma: 1e-6 }, tolerance);
}

#[divan::bench(args = TOLERANCES)]
fn integral_abg(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 }, tolerance);
}

#[divan::bench(args = TOLERANCES)]
fn integral_binomial_chassis(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::named("starlink-chassis-lab").unwrap(), tolerance);
}

#[divan::bench(args = TOLERANCES)]
fn integral_binomial_array(bencher: Bencher, tolerance: f64) {
    law(bencher, &Brdf::named("starlink-array-lab").unwrap(), tolerance);
}

/// 90 altitudes by 180 azimuths: Starlink V1.5, laboratory BRDFs, Sun at altitude −10°, as lumos-sat models it.
fn map(bencher: Bencher, tolerance: f64, threads: usize) {
    let sun = Body::sun((-10.0_f64).to_radians(), 90.0_f64.to_radians()).at_infinity();
    let sky = Sky::new(AXES, (RADIUS_KM, HEIGHT_KM), 0.0, sun, None).unwrap();
    let grid = SkyGrid::new(90, 180).unwrap();
    let satellite = Satellite::named("starlink-v1.5-lab").unwrap();
    let settings =
        ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(Mode::AsPublished, tolerance) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    bencher
        .counter(divan::counter::ItemsCount::new(grid.alt_deg.len() * grid.az_deg.len()))
        .bench_local(|| pool.install(|| sky_map(&sky, &grid, &satellite, &settings, &|| ()).unwrap()));
}

#[divan::bench(args = [1e-3, 1e-6], sample_count = 5, sample_size = 1)]
fn map_90x180_one_thread(bencher: Bencher, tolerance: f64) {
    map(bencher, tolerance, 1);
}

#[divan::bench(args = [1e-3, 1e-6], sample_count = 5, sample_size = 1)]
fn map_90x180_two_threads(bencher: Bencher, tolerance: f64) {
    map(bencher, tolerance, 2);
}
