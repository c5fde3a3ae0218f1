//! The model against 806 observations of Starlink V2 at night (Slingshot, Kandula 2025).
#![allow(clippy::unwrap_used, clippy::panic)]

use crate::observed;

use observed::*;
use satphot::brightness::{Attitude, Satellite};

/// The Sun's magnitude the observers used for their irradiances.
const SUN_MAG: f64 = -26.74;

#[test]
fn fluxes_at_night_are_the_references_and_the_papers_v2_is_a_magnitude_too_bright() {
    let Some(table) = rows("data/observations/starlink_v2_slingshot.csv") else { return };
    let settings = reference_settings(1e-7);
    let models = [
        unit_surface(Attitude::Nadir, "starlink-chassis-lab", &settings),
        unit_surface(Attitude::SunAzimuth, "starlink-array-lab", &settings),
        unit_surface(Attitude::Sun, "starlink-array-lab", &settings),
    ];
    let (mut worst_direct, mut worst_earth, mut worst_irradiance) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut fixed, mut observed, mut modelled) = (Vec::new(), Vec::new(), Vec::new());
    for row in &table {
        let n = |name: &str| number(row, name);
        // irradiance = 1361 W/m² · 10^(−0.4 (m + 26.74))
        let expected = 1361.0 * 10.0_f64.powf(-0.4 * (n("obs_mag") - SUN_MAG));
        // obs_mag has six decimals
        let rounding = 5e-7 * 0.4 * std::f64::consts::LN_10 * expected;
        worst_irradiance = worst_irradiance.max((expected - n("irradiance_W_m2")).abs() - rounding);
        let scene = spherical_scene(n("sat_height_km"), (n("sat_alt_deg"), 0.0), (n("sun_alt_deg"), n("az_diff_deg")));
        let mut flux = [0.0; 3];
        for (j, (surface, model)) in ["ch", "ar", "sp"].iter().zip(&models).enumerate() {
            let [direct, earth] = per_sun(&model.brightness(&scene).unwrap());
            worse(&mut worst_direct, direct, n(&format!("g_d_{surface}")));
            worse(&mut worst_earth, earth, n(&format!("g_e_{surface}")));
            flux[j] = direct + earth;
        }
        let mag = SUN_MAG - 2.5 * (11.07 * flux[0] + 104.96 * flux[1]).log10();
        observed.push(n("obs_mag"));
        modelled.push(mag);
        fixed.push(n("obs_mag") - mag);
    }
    println!(
        "{} rows: direct {worst_direct:.1e}, by way of the Earth {worst_earth:.1e}, irradiance {worst_irradiance:.1e} W/m²",
        table.len()
    );
    assert_eq!(table.len(), 806);
    assert!(worst_direct < 1e-6 && worst_earth < 1e-6 && worst_irradiance < 1e-16);
    let (m, s, r) = (median(&fixed), robust_sigma(&fixed), correlation(&observed, &modelled));
    println!("V2, laboratory chassis: median {m:+.3}, sigma {s:.3}, R {r:.4}");
    assert!((m - 1.369).abs() < 0.005 && (s - 0.910).abs() < 0.005 && (r - 0.8255).abs() < 0.002);
}

#[test]
fn the_second_v2_set_is_nearer_to_the_night_than_the_papers() {
    let Some(table) = rows("data/observations/starlink_v2_slingshot.csv") else { return };
    let settings = reference_settings(1e-4);
    let residuals = |name: &str| -> Vec<f64> {
        let model = satphot::brightness::Model::new(&Satellite::named(name).unwrap(), &settings).unwrap();
        let residual = |row: &Row| {
            let n = |name: &str| number(row, name);
            let sun = (n("sun_alt_deg"), n("az_diff_deg"));
            let scene = spherical_scene(n("sat_height_km"), (n("sat_alt_deg"), 0.0), sun);
            let flux: f64 = per_sun(&model.brightness(&scene).unwrap()).iter().sum();
            n("obs_mag") - (SUN_MAG - 2.5 * flux.log10())
        };
        table.iter().map(residual).collect()
    };
    let (paper, film) = (residuals("starlink-v2"), residuals("starlink-v2-film"));
    println!("paper {:+.3} ± {:.3}", median(&paper), robust_sigma(&paper));
    println!("film  {:+.3} ± {:.3}", median(&film), robust_sigma(&film));
    assert!(median(&film).abs() < 0.1 && median(&paper) > 0.5);
}
