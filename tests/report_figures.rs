//! The figures: drawn from rows alone, the same bytes each time, brightness upwards, and no input that breaks them.

use std::fs;
use std::path::{Path, PathBuf};

use satphot::report::plot::{light_curve, light_curves, residuals_altitude, zeropoint_diagnostics};
use satphot::report::{PhotometryRow, ResidualRow, StarRow};

/// Figures stay in the build folder, where a person can look at them.
fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// A small generator of numbers in (−1, 1), the same on every machine.
fn noise(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A pass that enters the umbra: bright in sunlight, then seven magnitudes fainter, with what goes wrong in a night.
fn pass(first_mjd: f64, n: usize, seed: u64) -> Vec<PhotometryRow> {
    let mut state = seed;
    (0..n)
        .map(|i| {
            let phase = i as f64 / n as f64;
            let sunlit = phase < 0.4;
            let alt_deg = 20.0 + 48.0 * (std::f64::consts::PI * phase).sin();
            let moon = 12.6 - 0.6 * (alt_deg - 20.0) / 48.0;
            let sun = 5.0 - 2.0 * phase;
            let penumbra = (0.4..0.45).contains(&phase);
            let model = match (sunlit, penumbra) {
                (true, _) => sun,
                (_, true) => 8.0,
                _ => moon - 0.4,
            };
            let v_mag = model + 0.3 * noise(&mut state);
            let mjd = first_mjd + i as f64 * 12.0 / 86_400.0;
            let (status, verdict) = match i {
                17 => ("nondetection", "use"),
                21 => ("rejected", "reject"),
                8 | 25 => ("ok", "caution"),
                _ => ("ok", "use"),
            };
            let illum = match (sunlit, penumbra) {
                (true, _) => "sun",
                (_, true) => "penumbra",
                _ => "lunar_earthshine",
            };
            PhotometryRow {
                frame: format!("iss_{i:04}.fits"),
                norad_cat_id: Some(25544),
                object_name: "ISS (ZARYA)".into(),
                date_mid: "2025-06-11T08:51:02.500Z".into(),
                mjd_mid_d: Some(mjd),
                v_mag: (status != "nondetection").then_some(if i == 21 { v_mag - 9.0 } else { v_mag }),
                v_mag_err: Some(if sunlit { 0.02 } else { 0.17 }),
                v_mag_err_sys: Some(0.05),
                limit_v_mag: Some(13.6),
                alt_deg: Some(alt_deg),
                illum: illum.into(),
                model_v_mag: Some(model),
                sun_v_mag: sunlit.then_some(sun + 0.05),
                earthshine_v_mag: Some(if sunlit { 7.5 + phase } else { 15.5 }),
                moon_v_mag: Some(moon + 0.7),
                lunar_earthshine_v_mag: Some(moon + 0.1),
                model_err_mag: Some(0.15),
                residual_mag: Some(v_mag - model),
                status: status.into(),
                verdict: verdict.into(),
                ..Default::default()
            }
        })
        .collect()
}

fn residuals(n: usize) -> Vec<ResidualRow> {
    let mut state = 7;
    let lights = ["sun", "penumbra", "moon", "lunar_earthshine", "earthshine"];
    (0..n)
        .map(|i| ResidualRow {
            frame: format!("f{i}.fits"),
            alt_deg: Some(20.0 + 60.0 * (i as f64 / n as f64)),
            illum: lights[i * 5 / n].into(),
            residual_mag: Some(0.1 + 0.4 * (noise(&mut state) + noise(&mut state)) + if i == 3 { 6.0 } else { 0.0 }),
            v_mag_err: Some(0.1),
            verdict: match i {
                3 => "reject",
                _ if i % 11 == 0 => "caution",
                _ => "use",
            }
            .into(),
            ..Default::default()
        })
        .collect()
}

fn stars(n: usize) -> Vec<StarRow> {
    let mut state = 3;
    (0..n)
        .map(|i| {
            let (airmass, b_v, v) =
                (1.5 + 0.5 * noise(&mut state), 0.55 + 0.34 * noise(&mut state), 12.0 + 2.0 * noise(&mut state));
            let bad = i % 23 == 5;
            let scatter = 0.04 * (noise(&mut state) + noise(&mut state)) + if bad { 0.9 } else { 0.0 };
            StarRow {
                star_id: format!("s{i}"),
                mjd_mid_d: Some(60_834.4 + 0.3 * i as f64 / n as f64),
                x_px: Some(4788.0 + 2400.0 * noise(&mut state)),
                y_px: Some(3194.0 + 2400.0 * noise(&mut state)),
                inst_mag: Some(v - 23.37 + 0.12 * airmass + 0.08 * b_v + scatter),
                airmass: Some(airmass),
                catalogue_v_mag: Some(v),
                catalogue_b_v_mag: Some(b_v),
                fit_weight: Some(if bad { 0.0 } else { 1.0 }),
                status: "ok".into(),
                ..Default::default()
            }
        })
        .collect()
}

#[test]
fn show() {
    light_curve(&place("one.svg"), &pass(60_837.368, 30, 1), "Macquarie CDK24, 2025-06-11").unwrap();
    let mut rows = pass(60_837.368, 30, 1);
    rows.extend(pass(60_837.433, 24, 2));
    rows.extend(pass(60_837.998, 12, 2));
    light_curve(&place("three.svg"), &rows, "Macquarie CDK24, 2025-06-11").unwrap();
    light_curves(&place(""), &rows, "Macquarie CDK24, 2025-06-11").unwrap();
    residuals_altitude(&place("residuals.svg"), &residuals(90)).unwrap();
    zeropoint_diagnostics(&place("zeropoint.svg"), &stars(321), -23.37, 0.12, 0.08).unwrap();
    light_curve(&place("none.svg"), &[], "A <night> & \"nothing\"").unwrap();
    light_curve(&place("point.svg"), &pass(60_837.3, 1, 1), "One point").unwrap();
    assert!(fs::read_to_string(place("one.svg")).unwrap().contains("</svg>"));
}
