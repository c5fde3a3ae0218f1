//! The Earth's shadow through its air against an independent evaluation, against 1173 observations, and at its limits.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::shadow::{Colour, atmospheric, lit_fraction, visible_fraction};
use satphot::brightness::spectrum::{Band, published_ab_mag};
use satphot::config::Shadow;

const R_KM: f64 = 6378.0;
const SUN_RAD: f64 = 0.2666 * PI / 180.0;

/// Angle from nadir at which the straight line to the disc's centre passes at `h_g`.
fn psi(r_km: f64, tangent_km: f64) -> f64 {
    ((R_KM + tangent_km) / r_km).asin()
}

fn at_550_km(tangent_km: f64) -> f64 {
    let r_km = R_KM + 550.0;
    atmospheric(r_km, R_KM, SUN_RAD, psi(r_km, tangent_km), &Colour::V)
}

/// The same by brute force: the ray of every strip of the disc found by bisection, ozone summed along it.
fn brute_force(r_km: f64, disc_rad: f64, from_nadir_rad: f64, colour: &Colour) -> f64 {
    let horizon_km = (r_km * r_km - R_KM * R_KM).sqrt();
    let bend_rad = |h: f64| (70.0_f64 / 60.0).to_radians() * (-h / 7.5).exp();
    let ozone = |h: f64| {
        if h > 75.0 {
            return 0.0;
        }
        let (steps, reach_km) = (800, 900.0);
        let step_km = reach_km / f64::from(steps);
        let density = |s: f64| {
            let z = (R_KM + h).hypot(s) - R_KM;
            (-0.5 * ((z - 22.0) / 5.0).powi(2)).exp() / (5.0 * (2.0 * PI).sqrt())
        };
        // trapezoid of a smooth function that vanishes at the far end
        2.0 * step_km * ((1..steps).map(|j| density(f64::from(j) * step_km)).sum::<f64>() + 0.5 * density(0.0))
    };
    let passed = |psi: f64| {
        let geometric_km = r_km * from_nadir_rad.sin() - R_KM + horizon_km * (psi - from_nadir_rad);
        let (mut low, mut high) = (geometric_km, geometric_km.max(0.0) + horizon_km * 0.0204 + 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if middle - horizon_km * bend_rad(middle) < geometric_km { low = middle } else { high = middle }
        }
        if high < 0.0 {
            return 0.0;
        }
        let mag =
            colour.rayleigh_mag * (2.0 * PI * R_KM / 8.0).sqrt() * (-high / 8.0).exp() + colour.ozone_mag * ozone(high);
        10.0_f64.powf(-0.4 * mag) / (1.0 + horizon_km * bend_rad(high) / 7.5)
    };
    // rings about nadir, the arc of each by the cosine rule of the sphere; over all rings the weights are the whole disc
    let (lowest, highest) = ((from_nadir_rad - disc_rad).max(0.0), from_nadir_rad + disc_rad);
    let (mut light, mut whole, rings) = (0.0, 0.0, 6000);
    for i in 0..rings {
        let psi = lowest + (highest - lowest) * (f64::from(i) + 0.5) / f64::from(rings);
        let cos_arc = (disc_rad.cos() - from_nadir_rad.cos() * psi.cos()) / (from_nadir_rad.sin() * psi.sin());
        let weight = cos_arc.clamp(-1.0, 1.0).acos() * psi.sin();
        whole += weight;
        light += weight * passed(psi);
    }
    light / whole
}

#[test]
fn at_550_km_the_dimming_is_the_documented_table() {
    let table = [
        (0.0, 3.84),
        (5.0, 3.40),
        (10.0, 2.90),
        (15.0, 2.22),
        (20.0, 1.51),
        (25.0, 0.94),
        (30.0, 0.54),
        (40.0, 0.13),
        (50.0, 0.03),
    ];
    for (tangent_km, mag) in table {
        let got = -2.5 * at_550_km(tangent_km).log10();
        assert!((got - mag).abs() < 0.006, "{tangent_km} km: {got}"); // printed to 0.01
    }
}

#[test]
fn a_brute_force_sum_over_the_disc_agrees_from_low_orbit_to_beyond_the_umbra() {
    let red = Colour::of(&Band::named("i").unwrap()).unwrap();
    let moon_rad = 0.26_f64.to_radians();
    for (r_km, tangents_km) in [
        (R_KM + 420.0, [-60.0, -20.0, 12.0, 45.0]),
        (R_KM + 2000.0, [-120.0, -40.0, 0.0, 70.0]),
        (42_164.0, [-900.0, -300.0, -10.0, 150.0]),
        (384_400.0, [-6000.0, -2500.0, 0.0, 1500.0]),
        (2e6, [-6378.0, -4000.0, 2000.0, 9000.0]),
    ] {
        for tangent_km in tangents_km {
            for (disc_rad, colour) in [(SUN_RAD, Colour::V), (moon_rad, red)] {
                let from_nadir = psi(r_km, tangent_km);
                let fast = atmospheric(r_km, R_KM, disc_rad, from_nadir, &colour);
                let slow = brute_force(r_km, disc_rad, from_nadir, &colour);
                // 6000 rings: a jump at the ground, 0.03 in i from high orbit, falls between two of them
                assert!((fast - slow).abs() < 1e-5, "{r_km} {tangent_km}: {fast} {slow}");
            }
        }
    }
}

#[test]
fn it_is_within_0_and_1_continuous_and_never_falls_towards_the_light() {
    let colours =
        [Colour::V, Colour::of(&Band::named("i").unwrap()).unwrap(), Colour { rayleigh_mag: 0.0, ozone_mag: 0.0 }];
    for r_km in [R_KM + 150.0, R_KM + 550.0, 42_164.0, 384_400.0, 1.38e6, 1e8] {
        for disc_rad in [SUN_RAD, 0.26_f64.to_radians(), 1e-6] {
            for colour in colours {
                let (reach, steps) = (psi(r_km, 250.0_f64.min(r_km - R_KM)) + 1.5 * disc_rad, 2000);
                let mut before = atmospheric(r_km, R_KM, disc_rad, 0.0, &colour);
                assert!((0.0..=1.0).contains(&before));
                for j in 1..=steps {
                    let from_nadir = reach * f64::from(j) / f64::from(steps);
                    let now = atmospheric(r_km, R_KM, disc_rad, from_nadir, &colour);
                    assert!((0.0..=1.0).contains(&now), "{r_km} {disc_rad} {j}: {now}");
                    assert!(now > before - 1e-6, "{r_km} {disc_rad} {colour:?} {j}: {before} {now}");
                    before = now;
                }
                assert_eq!(atmospheric(r_km, R_KM, disc_rad, 3.0, &colour), 1.0);
            }
        }
    }
}

#[test]
fn at_the_ground_and_in_the_air_nothing_breaks() {
    for height_km in [1e-6, 0.5, 30.0, 90.0] {
        for disc_rad in [0.0, SUN_RAD] {
            let r_km = R_KM + height_km;
            let mut before = 0.0;
            for j in 0..=1000 {
                let from_nadir = PI * f64::from(j) / 1000.0;
                let now = atmospheric(r_km, R_KM, disc_rad, from_nadir, &Colour::V);
                assert!(
                    (0.0..=1.0).contains(&now) && now > before - 1e-6,
                    "{height_km} {disc_rad} {j}: {before} {now}"
                );
                before = now;
            }
            assert_eq!(before, 1.0);
        }
    }
}

#[test]
fn no_jump_is_larger_than_the_ground_makes() {
    // in a step of 1e-7 rad (20 m at the limb from low orbit) nothing moves by more than 1e-4 of the light
    for r_km in [R_KM + 550.0, 42_164.0, 384_400.0] {
        for tangent_km in [-2000.0, -855.0, -200.0, -55.0, -20.0, 0.0, 30.0, 100.0, 187.0, 200.0, 213.0, 260.0] {
            let from_nadir = psi(r_km, tangent_km);
            let of = |c: f64| atmospheric(r_km, R_KM, SUN_RAD, c, &Colour::V);
            assert!((of(from_nadir + 1e-7) - of(from_nadir)).abs() < 1e-4, "{r_km} {tangent_km}");
        }
    }
}

#[test]
fn without_air_to_speak_of_the_shadow_is_the_penumbra() {
    // beyond the tip the refracted ring is spread so thin that the airless fraction is approached: within the rays that
    // the air takes away, 50 km of 6378 around the limb
    for r_km in [1.5e6, 3e6] {
        for from_nadir in [0.0, 1e-3, 3e-3, 6e-3, 1.2e-2] {
            let air = atmospheric(r_km, R_KM, SUN_RAD, from_nadir, &Colour::V);
            let bare = visible_fraction(SUN_RAD, (R_KM / r_km).asin(), from_nadir);
            assert!((air - bare).abs() < 0.025, "{r_km} {from_nadir}: {air} {bare}");
        }
    }
}

#[test]
fn red_light_survives_longest_and_ozone_takes_v_first() {
    let r_km = R_KM + 550.0;
    let left = |band: &str, tangent_km: f64| {
        let colour = Colour::of(&Band::named(band).unwrap()).unwrap();
        atmospheric(r_km, R_KM, SUN_RAD, psi(r_km, tangent_km), &colour)
    };
    // deep down Rayleigh scattering decides
    let deep = ["g", "V", "r", "i"].map(|b| left(b, -20.0));
    assert!(deep[0] < deep[1] && deep[1] < deep[2] && deep[2] < deep[3] && deep[3] > 5.0 * deep[0], "{deep:?}");
    // in the ozone layer its absorption does: i has none, g little
    let high = ["i", "g", "V"].map(|b| left(b, 28.0));
    assert!(high[0] > high[1] && high[1] > high[2], "{high:?}");
}

#[test]
fn the_three_shadows_agree_far_from_the_edge_and_order_near_it() {
    let r_km = R_KM + 550.0;
    let satellite = Vector::<Itrs>::new(0.0, 0.0, r_km);
    let fraction = |from_nadir: f64, shadow| {
        let sun = satellite + Vector::new(from_nadir.sin(), 0.0, -from_nadir.cos()) * 1.496e8;
        lit_fraction(&satellite, &sun, 695_700.0, R_KM, shadow, &Colour::V)
    };
    for shadow in [Shadow::Cylinder, Shadow::Penumbra, Shadow::Atmospheric] {
        assert_eq!(fraction(psi(r_km, 260.0), shadow), 1.0);
        assert_eq!(fraction(psi(r_km, -120.0), shadow), 0.0);
    }
    // 8 km above the limb the bare disc is nearly whole, the air has taken most; 20 km below it, the other way round
    let above = psi(r_km, 8.0);
    assert!(fraction(above, Shadow::Penumbra) > 0.8 && fraction(above, Shadow::Atmospheric) < 0.1);
    let below = psi(r_km, -20.0);
    assert!(fraction(below, Shadow::Penumbra) == 0.0 && fraction(below, Shadow::Atmospheric) > 0.0);
}

#[test]
fn it_lifts_the_agreement_with_1173_observations_of_starlink() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/pomenis_starlink_2022.csv");
    if !Path::new(path).exists() {
        println!("skipped: ../shared/reference/pomenis_starlink_2022.csv not present");
        return;
    }
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
    let mut pairs: Vec<[Vec<(f64, f64)>; 2]> = vec![Default::default(), Default::default()];
    for record in reader.records() {
        let record = record.unwrap();
        let value = |name: &str| -> f64 { record[names.iter().position(|n| n == name).unwrap()].parse().unwrap() };
        let r_km = R_KM + value("sat_height_km");
        let past = value("angle_past_terminator_deg").to_radians();
        let lit = atmospheric(r_km, R_KM, SUN_RAD, FRAC_PI_2 - past, &Colour::V);
        for (k, prefix) in ["g_", "g_inf_"].iter().enumerate() {
            let sum = |a: &str, b: &str| value(&format!("{prefix}{a}")) + value(&format!("{prefix}{b}"));
            for (j, share) in [1.0, lit].into_iter().enumerate() {
                let flux = share * sum("dir_ch", "dir_sa") + sum("veg_ch", "veg_sa");
                let model_mag = published_ab_mag(1360.0 * flux).map_or(12.5, |m| m.min(12.5));
                pairs[k][j].push((value("ab_mag"), model_mag));
            }
        }
    }
    // laboratory surfaces: the cylinder, the air; surfaces inferred from these data: the same
    let expected =
        [[(0.7965, 0.6993, 0.002), (0.7061, 0.7676, 0.01)], [(0.7498, 0.6893, 0.002), (0.6506, 0.7685, 0.01)]];
    for (got, expected) in pairs.iter().flatten().zip(expected.iter().flatten()) {
        let (std, r) = agreement(got);
        println!("std {std:.4}, R {r:.4}");
        assert!((std - expected.0).abs() < expected.2 && (r - expected.1).abs() < expected.2, "{std} {r} {expected:?}");
    }
}

/// Standard deviation of the residuals and Pearson's R of observed and modelled magnitudes.
fn agreement(pairs: &[(f64, f64)]) -> (f64, f64) {
    let n = pairs.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let (o, m) = (mean(&|p| p.0), mean(&|p| p.1));
    let variance = |a: &dyn Fn(&(f64, f64)) -> f64, b: &dyn Fn(&(f64, f64)) -> f64| mean(&|p| a(p) * b(p));
    let (from_o, from_m) = (|p: &(f64, f64)| p.0 - o, |p: &(f64, f64)| p.1 - m);
    let residual = |p: &(f64, f64)| p.0 - p.1 - (o - m);
    let r = variance(&from_o, &from_m) / (variance(&from_o, &from_o) * variance(&from_m, &from_m)).sqrt();
    (variance(&residual, &residual).sqrt(), r)
}
