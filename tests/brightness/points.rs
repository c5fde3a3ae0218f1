//! Every scalar reference point of the brightness model: catalogue, magnitudes, scattering laws, engine, shadow, spectra.
//! (`brightness_light_sources.rs` has the Moon's, the shadow's discs and the magnitude ratios; `orbit_*.rs` the geometry.)
#![allow(clippy::unwrap_used, clippy::panic)]

use crate::observed;

use std::f64::consts::PI;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::light_sources::eclipse_factor;
use satphot::brightness::spectrum::{SolarColumn, Spectrum, ab_mag, published_ab_mag};
use satphot::brightness::{
    Accuracy, Brdf, Catalogue, Ground, Model, Satellite, Scene, direct_reflection, reflected_by_earth,
};
use satphot::config::SourceDisc;
use satphot::orbit::{EarthOrientation, bodies};
use serde_json::Value;

type V = Vector<Itrs>;

/// A direction by zenith angle and azimuth \[deg\].
fn polar(zenith_deg: f64, azimuth_deg: f64) -> V {
    let ((sz, cz), (sa, ca)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    V::new(sz * ca, sz * sa, cz)
}

fn pair(v: &Value) -> (f64, f64) {
    (v[0].as_f64().unwrap(), v[1].as_f64().unwrap())
}

fn value(law: &Brdf, inputs: &Value) -> f64 {
    let (i, o) = (pair(&inputs["i"]), pair(&inputs["o"]));
    law.value(&polar(i.0, i.1), &V::new(0.0, 0.0, 1.0), &polar(o.0, o.1))
}

/// Direct and Earth-reflected flux per irradiance of the Sun, laboratory Starlink V1.5, in the satellite's vertical.
fn starlink(inputs: &Value) -> [f64; 2] {
    let n = |name: &str| inputs[name].as_f64().unwrap();
    let past = n("angle_past_terminator_deg").to_radians();
    let (theta, phi) = pair(&inputs["obs_theta_phi_deg"]);
    let r_km = n("R") / 1e3;
    let scene = Scene {
        satellite_km: V::new(0.0, 0.0, r_km + n("h_m") / 1e3),
        velocity_km_s: V::new(7.6, 0.0, 0.0),
        observer_km: polar(theta, phi) * r_km,
        sun_km: V::new(0.0, past.cos(), -past.sin()) * 1e14,
        moon_km: V::new(0.0, 0.0, -4e5),
        sidereal_rad: 0.0,
    };
    let mut settings = observed::reference_settings(1e-8);
    settings.effects.arrays = satphot::config::Arrays::SunAzimuth;
    let model = Model::new(&Satellite::named("starlink-v1.5").unwrap(), &settings).unwrap();
    observed::per_sun(&model.brightness(&scene).unwrap())
}

/// Irradiance of a nadir plate per irradiance of a source in the zenith, over a Lambert ground.
fn on_nadir_plate(inputs: &Value, albedo: f64) -> f64 {
    let r_km = inputs["R"].as_f64().unwrap() / 1e3;
    let satellite = V::new(0.0, 0.0, r_km + inputs["h_m"].as_f64().unwrap() / 1e3);
    let down = V::new(0.0, 0.0, -1.0);
    let ground = Ground::new(&satellite, r_km, &V::new(0.0, 0.0, 1.0), &Brdf::Lambert { albedo }).unwrap();
    // a white Lambert plate turns irradiance into π f = 1
    let accuracy = Accuracy::relative(1e-9, 200_000);
    PI * reflected_by_earth(&ground, &Brdf::Lambert { albedo: 1.0 }, &down, &down, &accuracy).per_sr
}

/// ISS: area in use, sum of the components counted \[m²\], of a surface.
fn iss(surface: &str) -> (f64, f64) {
    let catalogue = Catalogue::load(None).unwrap();
    let sums = catalogue.find("iss").unwrap().component_sums();
    let sum = sums.iter().find(|s| s.surface == surface).unwrap();
    (sum.published_m2, sum.listed_m2)
}

fn got(id: &str, inputs: &Value) -> Option<f64> {
    let n = |name: &str| inputs[name].as_f64().unwrap();
    let sun = |column| Spectrum::sun(column).unwrap();
    Some(match id {
        "area_iss_solar" => iss("array").1,
        "area_iss_chassis_listed" => iss("chassis").1,
        "area_iss_total_published" => iss("chassis").0 + iss("array").0,
        "starcloud_over_v15" => 2.5 * (n("A1") / n("A2")).log10(),
        "ab_from_fnu" => ab_mag(n("fnu_W_m2_Hz")).unwrap(),
        "lumos_ab_1360" => published_ab_mag(n("I_W_m2")).unwrap(),
        "phong_dhr_0" => Brdf::Phong { kd: n("kd"), ks: n("ks"), n: n("n") }.hemispherical_reflectance(n("theta_i")),
        "phong_value" => value(&Brdf::Phong { kd: n("kd"), ks: n("ks"), n: n("n") }, inputs),
        "binomial_chassis_peak" | "binomial_chassis_20" => value(&Brdf::named("starlink-chassis-lab").unwrap(), inputs),
        "binomial_chassis_dhr0" => Brdf::named("starlink-chassis-lab").unwrap().hemispherical_reflectance(0.0),
        "earendil_glint_sun" => {
            let mirror = Brdf::Mirror { reflectance: n("rho") };
            let (up, disc_rad) = (V::new(0.0, 0.0, 1.0), (0.5 * n("disc_diam_deg")).to_radians());
            let f_cos = direct_reflection(&mirror, &up, &up, &up, disc_rad, SourceDisc::Convolved);
            n("m_source") - 2.5 * (n("A") * f_cos / n("d_m").powi(2)).log10()
        }
        "lumos_direct_a" | "lumos_direct_c" => starlink(inputs)[0],
        "earthshine_c" => starlink(inputs)[1],
        "nadir_plate_lambert" => on_nadir_plate(inputs, n("albedo")),
        "simple_direct_nadir_panel_moon_above" => {
            let moon = polar(90.0 - n("moon_alt_deg"), 0.0);
            let nadir = V::new(0.0, 0.0, -1.0);
            direct_reflection(&Brdf::Lambert { albedo: 0.5 }, &moon, &nadir, &nadir, 0.0045, SourceDisc::Convolved)
        }
        "lunar_eclipse_flag" => {
            let epoch = format!("{}:00 UTC", inputs["utc"].as_str().unwrap()).parse().unwrap();
            let b = bodies(&epoch, &EarthOrientation::default()).unwrap();
            f64::from(eclipse_factor(&b.moon_itrs_km, &b.sun_itrs_km) < 0.5)
        }
        "astm_global_total" => sun(SolarColumn::Global).irradiance_w_m2(280.0, 4000.0),
        "astm_et_300_1050" => sun(SolarColumn::Extraterrestrial).irradiance_w_m2(300.0, 1050.0),
        "moon_flux_300_1050" => {
            let moon = sun(SolarColumn::Extraterrestrial).scaled(10.0_f64.powf(-0.4 * (n("m_moon") - n("V_sun"))));
            moon.irradiance_w_m2(300.0, 1050.0)
        }
        _ => return None,
    })
}

#[test]
fn every_reference_point_of_the_brightness_model_is_met() {
    let Some(path) = observed::shared("reference/points.json") else { return };
    let points: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mut met = Vec::new();
    for point in points.as_array().unwrap() {
        let id = point["id"].as_str().unwrap();
        let Some(got) = got(id, &point["inputs"]) else { continue };
        let expected = point["expected"].as_f64().unwrap_or(f64::from(point["expected"] == true));
        let scale = if point["tolerance_kind"] == "rel" { expected.abs() } else { 1.0 };
        println!("{id}: {got} ({expected})");
        assert!((got - expected).abs() <= point["tolerance"].as_f64().unwrap() * scale, "{id}: {got} {expected}");
        met.push(id);
    }
    assert_eq!(met.len(), 21, "{met:?}");
}

#[test]
fn light_from_an_earth_of_one_radiance_is_the_view_factor() {
    // the mean over all directions of the source of ground lit by cos z is a quarter of the view factor
    let (r_km, down) = (6371.0, V::new(0.0, 0.0, -1.0));
    let satellite = V::new(0.0, 0.0, r_km + 420.0);
    let (law, accuracy) = (Brdf::Lambert { albedo: 1.0 }, Accuracy::relative(1e-8, 200_000));
    let count = 400;
    let mut mean = 0.0;
    for j in 0..count {
        let cos_z = (f64::from(j) + 0.5) / f64::from(count) * 2.0 - 1.0;
        let light_source = V::new((1.0 - cos_z * cos_z).sqrt(), 0.0, cos_z);
        let Some(ground) = Ground::new(&satellite, r_km, &light_source, &law) else { continue };
        mean += PI * reflected_by_earth(&ground, &law, &down, &down, &accuracy).per_sr / f64::from(count);
    }
    // view_factor_full: (R/r)² at 420 km
    assert!((4.0 * mean - 0.880_131_873_933_557_1).abs() < 1e-4, "{mean}");
}
