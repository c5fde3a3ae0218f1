//! The simple model: reference points, laws of the panel, the transition from resolved to unresolved, `limits simple`.
#![allow(clippy::unwrap_used, clippy::panic)]

use crate::observed;
use crate::support;

use std::f64::consts::PI;

use proptest::prelude::*;
use satphot::base::constants::FWHM_PER_SIGMA;
use satphot::config::Mode;
use satphot::visibility::simple::{
    Diameter, Panel, SimpleEffects, angle_arcsec, diameter_m, effective_solid_angle_arcsec2,
    invariant_surface_brightness, magnitude, psf_solid_angle_arcsec2, solid_angle_arcsec2, summed_solid_angle_arcsec2,
    surface_brightness,
};
use serde_json::Value;
use support::satphot;

const ISS: (f64, f64) = (4250.25, 400e3);

fn panel(mode: Mode, moon_alt_deg: f64) -> f64 {
    let p = Panel {
        albedo: 0.5,
        area_m2: 100.0,
        range_m: 5e5,
        source_alt_rad: moon_alt_deg.to_radians(),
        emission_rad: 0.0,
    };
    p.flux_ratio(&SimpleEffects::of(mode)).unwrap()
}

#[test]
fn the_published_numbers_of_the_iss_at_400_km_follow_and_the_printed_diameter_does_not_give_them() {
    let (area, d) = ISS;
    // copies of reference/points.json
    assert!((diameter_m(area, Diameter::Square).unwrap() - 73.563_485_337_568_3).abs() < 1e-9);
    let theta = angle_arcsec(diameter_m(area, Diameter::Square).unwrap(), d).unwrap();
    assert!((theta - 37.933_895_125).abs() < 1e-8);
    let omega = solid_angle_arcsec2(area, d, Diameter::Square).unwrap();
    assert!((omega - 1_130.172_562_82).abs() < 1e-6);
    assert!((surface_brightness(12.02, omega) - 19.652_861_899).abs() < 1e-8);
    // A = (π/4) D makes the station 5.4 km wide
    let printed = solid_angle_arcsec2(area, d, Diameter::Linear).unwrap();
    assert!((surface_brightness(12.02, printed) - 28.99).abs() < 0.005);
}

#[test]
fn every_reference_point_of_the_simple_model_is_met() {
    let Some(path) = observed::shared("reference/points.json") else { return };
    let points: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mut met = 0;
    for point in points.as_array().unwrap().iter().filter(|p| p["topic"] == "simple") {
        let n = |name: &str| point["inputs"][name].as_f64().unwrap();
        let omega = || solid_angle_arcsec2(n("A"), n("d_m"), Diameter::Square).unwrap();
        let got = match point["id"].as_str().unwrap() {
            "D_eq_iss" => diameter_m(n("A"), Diameter::Square).unwrap(),
            "theta_iss_400" => angle_arcsec(diameter_m(n("A"), Diameter::Square).unwrap(), n("d_m")).unwrap(),
            "omega_iss_400" => omega(),
            "mu_iss_400" => surface_brightness(n("m"), omega()),
            "simple_direct_nadir_panel_moon_above" => panel(Mode::Corrected, n("moon_alt_deg")),
            other => panic!("a point nobody computes: {other}"),
        };
        let expected = point["expected"].as_f64().unwrap();
        let scale = if point["tolerance_kind"] == "rel" { expected.abs() } else { 1.0 };
        assert!((got - expected).abs() <= point["tolerance"].as_f64().unwrap() * scale, "{} {got}", point["id"]);
        met += 1;
    }
    assert_eq!(met, 5);
}

#[test]
fn a_moon_above_lights_the_panel_as_printed_and_its_back_in_truth() {
    // ρ sin 30° A/(π d²)
    let printed = 0.5 * 0.5 * 100.0 / (PI * 25e10);
    assert!((panel(Mode::AsPublished, 30.0) / printed - 1.0).abs() < 1e-12);
    assert_eq!(panel(Mode::Corrected, 30.0), 0.0);
    // below the satellite's horizontal it is the other way round
    assert_eq!(panel(Mode::AsPublished, -10.0), 0.0);
    assert!(panel(Mode::Corrected, -10.0) > 0.0);
    assert!(panel(Mode::Corrected, 0.0) == 0.0 && panel(Mode::AsPublished, 0.0) == 0.0);
}

#[test]
fn an_area_called_projected_loses_the_observers_cosine_twice() {
    let at = |mode, emission: f64| {
        let p = Panel { albedo: 0.5, area_m2: 1.0, range_m: 1e5, source_alt_rad: -1.0, emission_rad: emission };
        let effects = SimpleEffects { light: SimpleEffects::of(Mode::Corrected).light, ..SimpleEffects::of(mode) };
        p.flux_ratio(&effects).unwrap()
    };
    let ratio = at(Mode::AsPublished, 1.0) / at(Mode::Corrected, 1.0);
    assert!((ratio - 1f64.cos()).abs() < 1e-12);
    assert_eq!(at(Mode::AsPublished, 0.0), at(Mode::Corrected, 0.0));
}

proptest! {
    #[test]
    fn surface_brightness_of_a_resolved_panel_knows_neither_area_nor_distance(
        lg_area in -2.0..8.0f64, lg_d in 4.0..8.0f64, albedo in 0.01..1.0f64, alt in -1.5..-0.05f64,
    ) {
        let p = Panel {
            albedo, area_m2: 10f64.powf(lg_area), range_m: 10f64.powf(lg_d), source_alt_rad: alt, emission_rad: 0.0,
        };
        let effects = SimpleEffects::of(Mode::Corrected);
        let m = magnitude(p.flux_ratio(&effects).unwrap(), -12.73).unwrap();
        let omega = solid_angle_arcsec2(p.area_m2, p.range_m, effects.diameter).unwrap();
        let closed = invariant_surface_brightness(-12.73, albedo, -alt.sin()).unwrap();
        prop_assert!((surface_brightness(m, omega) - closed).abs() < 1e-10);
        // and with a PSF ten times narrower than the disc its brightest point is as bright
        let fwhm = 0.1 * (4.0 * omega / PI).sqrt();
        let peak = surface_brightness(m, effective_solid_angle_arcsec2(omega, fwhm).unwrap());
        prop_assert!((peak - closed).abs() < 1e-6);
    }

    #[test]
    fn flux_falls_with_the_square_of_the_distance(lg_d in 4.0..9.0f64, factor in 1.0..100.0f64) {
        let at = |d: f64| {
            let p = Panel { albedo: 0.3, area_m2: 5.0, range_m: d, source_alt_rad: -0.7, emission_rad: 0.4 };
            p.flux_ratio(&SimpleEffects::of(Mode::Corrected)).unwrap()
        };
        let d = 10f64.powf(lg_d);
        prop_assert!((at(d) / at(factor * d) / (factor * factor) - 1.0).abs() < 1e-12);
    }
}

/// Peak of a disc of radius `r` and unit light behind a Gaussian of `sigma`, summed over a fine grid of the disc.
fn folded_peak(r: f64, sigma: f64) -> f64 {
    let n = 600;
    let step = 2.0 * r / f64::from(n);
    let (mut sum, mut cells) = (0.0, 0.0);
    for i in 0..n {
        for j in 0..n {
            let at = |k: i32| (f64::from(k) + 0.5) * step - r;
            let r2 = at(i).powi(2) + at(j).powi(2);
            if r2 <= r * r {
                sum += (-0.5 * r2 / (sigma * sigma)).exp() / (2.0 * PI * sigma * sigma);
                cells += 1.0;
            }
        }
    }
    sum / cells
}

#[test]
fn the_peak_of_a_disc_behind_a_psf_is_the_folded_one_and_the_sum_of_areas_misses_it_by_at_most_0_28_mag() {
    let fwhm: f64 = 1.5;
    let sigma = fwhm / FWHM_PER_SIGMA;
    let (mut worst, mut at_ends) = (0.0f64, Vec::new());
    for k in -8..=8 {
        let r = sigma * 2f64.powf(0.5 * f64::from(k));
        let omega = PI * r * r;
        let exact = effective_solid_angle_arcsec2(omega, fwhm).unwrap();
        // the edge of the disc on a grid of 600 cells is good to 1e-3
        assert!((exact * folded_peak(r, sigma) - 1.0).abs() < 2e-3, "{k}: {exact}");
        let off = 2.5 * (summed_solid_angle_arcsec2(omega, fwhm).unwrap() / exact).log10();
        assert!(off >= 0.0);
        worst = worst.max(off);
        at_ends.push(off);
    }
    assert!((0.25..0.285).contains(&worst), "{worst}");
    assert!(at_ends[0] < 0.04 && at_ends[16] < 0.01, "{at_ends:?}");
    // 2πσ² is π FWHM²/(4 ln 2)
    assert!((psf_solid_angle_arcsec2(fwhm).unwrap() / (2.0 * PI * sigma * sigma) - 1.0).abs() < 1e-12);
    let far_below = effective_solid_angle_arcsec2(1e-14, fwhm).unwrap();
    assert!((far_below / psf_solid_angle_arcsec2(fwhm).unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let good = Panel { albedo: 0.5, area_m2: 1.0, range_m: 1e5, source_alt_rad: 0.1, emission_rad: 0.0 };
    for (bad, name) in [
        (Panel { albedo: 1.01, ..good }, "albedo"),
        (Panel { albedo: 0.0, ..good }, "albedo"),
        (Panel { area_m2: 0.0, ..good }, "area_m2"),
        (Panel { range_m: 0.0, ..good }, "range_m"),
        (Panel { range_m: f64::INFINITY, ..good }, "range_m"),
        (Panel { source_alt_rad: f64::NAN, ..good }, "source_alt_rad"),
        (Panel { emission_rad: 1.6, ..good }, "emission_rad"),
    ] {
        let message = bad.flux_ratio(&SimpleEffects::of(Mode::Corrected)).unwrap_err().to_string();
        assert!(message.contains(name) && message.contains("accepted"), "{message}");
    }
    assert!(effective_solid_angle_arcsec2(1.0, 0.0).unwrap_err().to_string().contains("fwhm_arcsec = 0"));
    assert!(effective_solid_angle_arcsec2(0.0, 1.0).is_err());
}

#[test]
fn the_command_prints_both_readings_and_refuses_a_panel_brighter_than_its_light() {
    let empty = tempfile::tempdir().unwrap();
    let output = satphot(empty.path(), &["limits", "simple", "--mag", "12.02", "--csv"]).expect(0, &[]);
    let row = |name: &str| -> Vec<String> {
        let line = output.out.lines().find(|l| l.starts_with(name)).unwrap_or_else(|| panic!("{name}: {}", output.out));
        line.split(',').map(String::from).collect()
    };
    let mu = row("mean mu");
    assert!((mu[2].parse::<f64>().unwrap() - 28.986).abs() < 1e-3);
    assert!((mu[3].parse::<f64>().unwrap() - 19.652_861_899).abs() < 1e-6);
    assert_eq!(row("m by direct moonlight")[3], "");
    // lunar earthshine: a white plate over a uniform Lambert ground of albedo a would be at most
    // m_Moon − 2.5 lg(ρ a A/(π d²)); the ground reflects at most 81 %
    let shine: f64 = row("m by Lunar-Earthshine")[3].parse().unwrap();
    let most = -12.73 - 2.5 * (0.3 * 0.81 * 4250.25 / (PI * 16e10)).log10();
    assert!(shine > most && shine < most + 1.5, "{shine} {most}");
    for (args, word) in [
        (["--albedo", "1.2"], "--albedo"),
        (["--area-m2", "0"], "--area-m2"),
        (["--range-km", "0"], "--range-km"),
        (["--fwhm-arcsec", "0"], "--fwhm-arcsec"),
        (["--moon-alt-deg", "91"], "--moon-alt-deg"),
    ] {
        satphot(empty.path(), &[&["limits", "simple"][..], &args].concat()).expect(2, &[word]).without_results();
    }
}
