//! What the tests against real observations share: tables, spherical scenes, the model's flux, statistics.
#![allow(dead_code, clippy::unwrap_used)]

use std::collections::HashMap;
use std::path::PathBuf;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{Brdf, Brightness, Model, ModelSettings, Satellite, Scene, Surface};
use satphot::config::{Distances, Mode, Shadow, Source, SourceDisc};

/// Radius of the reference geometry.
pub const R_KM: f64 = 6378.0;

/// One row, by column name.
pub type Row = HashMap<String, String>;

/// A file next to the project; `None`, and a line saying so, on a clone that has none.
pub fn shared(path: &str) -> Option<PathBuf> {
    let full = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")).join(path);
    if full.exists() {
        return Some(full);
    }
    println!("skipped: ../shared/{path} not present");
    None
}

/// The rows of a table with `#` comments.
pub fn rows(path: &str) -> Option<Vec<Row>> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(shared(path)?).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
    let row = |r: csv::StringRecord| names.iter().cloned().zip(r.iter().map(String::from)).collect();
    Some(reader.records().map(|r| row(r.unwrap())).collect())
}

/// A number of a row; NaN where the table has none.
pub fn number(row: &Row, name: &str) -> f64 {
    let text = row.get(name).unwrap_or_else(|| panic!("no column {name}"));
    if text.is_empty() { f64::NAN } else { text.parse().unwrap() }
}

/// East, north, up from altitude and azimuth.
pub fn direction(alt_deg: f64, az_deg: f64) -> Vector<Itrs> {
    let ((sh, ch), (sa, ca)) = (alt_deg.to_radians().sin_cos(), az_deg.to_radians().sin_cos());
    Vector::new(ch * sa, ch * ca, sh)
}

/// Observer at the top of a sphere of [`R_KM`], satellite and Sun by altitude and azimuth \[deg\], the Sun far enough to
/// have no parallax.
pub fn spherical_scene(height_km: f64, satellite: (f64, f64), sun: (f64, f64)) -> Scene {
    let sin_alt = satellite.0.to_radians().sin();
    let range_km =
        -R_KM * sin_alt + (R_KM * R_KM * sin_alt * sin_alt + 2.0 * R_KM * height_km + height_km * height_km).sqrt();
    let observer_km = Vector::new(0.0, 0.0, R_KM);
    let sun = direction(sun.0, sun.1);
    Scene {
        satellite_km: observer_km + direction(satellite.0, satellite.1) * range_km,
        velocity_km_s: Vector::new(7.6, 0.0, 0.0),
        observer_km,
        sun_km: sun * 1e14,
        moon_km: -sun * 4e5,
        sidereal_rad: 0.0,
    }
}

/// The conventions of the reference fluxes: parallel light, cylinder, a sphere of 6378 km, no Moon.
pub fn reference_settings(tolerance: f64) -> ModelSettings {
    let mut settings = ModelSettings::new(Mode::Corrected, tolerance);
    settings.earth_radius_km = Some(R_KM);
    settings.moon = false;
    settings.effects.distances = Distances::Ignored;
    settings.effects.source = Source::ExoAtmospheric;
    settings.effects.source_disc = SourceDisc::Point;
    settings.effects.shadow = Shadow::Cylinder;
    settings
}

/// A model of one surface of 1 m².
pub fn unit_surface(attitude: satphot::brightness::Attitude, law: &str, settings: &ModelSettings) -> Model {
    let surface = Surface { name: law.into(), area_m2: 1.0, attitude, brdf: Brdf::named(law).unwrap(), back: None };
    Model::new(&Satellite::of("unit", vec![surface]), settings).unwrap()
}

/// Flux at the observer per unit irradiance of the Sun: direct, by way of the Earth.
pub fn per_sun(b: &Brightness) -> [f64; 2] {
    [b.sun, b.earthshine].map(|l| l.flux_ratio / 10.0_f64.powf(0.4 * 26.76))
}

pub fn median(values: &[f64]) -> f64 {
    let mut v = values.to_vec();
    v.sort_by(f64::total_cmp);
    let n = v.len();
    0.5 * (v[(n - 1) / 2] + v[n / 2])
}

/// 1.4826 MAD.
pub fn robust_sigma(values: &[f64]) -> f64 {
    let m = median(values);
    1.4826 * median(&values.iter().map(|v| (v - m).abs()).collect::<Vec<_>>())
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Of the population.
pub fn std(values: &[f64]) -> f64 {
    let m = mean(values);
    (values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Pearson's coefficient.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (ma, mb) = (mean(a), mean(b));
    let cov = a.iter().zip(b).map(|(x, y)| (x - ma) * (y - mb)).sum::<f64>() / a.len() as f64;
    cov / (std(a) * std(b))
}

/// Worst relative difference, without rows in which both are zero.
pub fn worse(worst: &mut f64, got: f64, expected: f64) {
    if got != expected {
        *worst = worst.max((got / expected - 1.0).abs());
    }
}
