//! Fitting scattering laws to measured tables: injection and recovery, an independent fit, damaged tables.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use satphot::brightness::brdf::fit::{BrdfFit, FitLaw, FitOptions, MeasuredTable, Measurement, fit_brdf};
use satphot::brightness::{Binomial, Brdf};

/// Four incidences, outgoing angles of 0 to 80 deg in three azimuths: 204 rows.
fn geometries() -> Vec<[f64; 4]> {
    let mut all = Vec::new();
    for phi_i in [10.0, 30.0, 50.0, 70.0] {
        for step in 0..17 {
            for theta_o in [180.0, 150.0, 90.0] {
                all.push([phi_i, 0.0, 5.0 * f64::from(step), theta_o]);
            }
        }
    }
    all
}

/// A table of the law with `noise_dex(k)` on row k.
fn table(brdf: &Brdf, mut noise_dex: impl FnMut(usize) -> f64) -> MeasuredTable {
    let mut text = String::from("phi_i theta_i phi_o theta_o BRDF\n");
    for (k, [phi_i, theta_i, phi_o, theta_o]) in geometries().into_iter().enumerate() {
        let row = Measurement {
            line: 0,
            phi_i_deg: phi_i,
            theta_i_deg: theta_i,
            phi_o_deg: phi_o,
            theta_o_deg: theta_o,
            brdf_per_sr: 0.0,
        };
        let f = row.of(brdf).unwrap() * 10f64.powf(noise_dex(k));
        writeln!(text, "{phi_i} {theta_i} {phi_o} {theta_o} {f:e}").unwrap();
    }
    MeasuredTable::parse(Path::new("table.txt"), &text).unwrap()
}

fn binomial(b: Vec<f64>, c: Vec<f64>, l1: i32) -> Brdf {
    Brdf::Binomial(Arc::new(Binomial { b: vec![b], c: vec![c], d: 3.0, l1 }))
}

const ONE_ROW: FitLaw = FitLaw::Binomial { rows: 1, terms: 2, l1: -2, l2: 1, d: Some(3.0) };

fn fit(table: &MeasuredTable, law: &FitLaw) -> BrdfFit {
    fit_brdf(table, law, &FitOptions::default()).unwrap()
}

fn values(fit: &BrdfFit) -> Vec<f64> {
    fit.parameters.iter().map(|p| p.value).collect()
}

fn errors(fit: &BrdfFit) -> Vec<f64> {
    fit.parameters.iter().map(|p| p.err.unwrap_or(f64::NAN)).collect()
}

fn assert_close(got: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(got.len(), expected.len());
    for (g, e) in got.iter().zip(expected) {
        assert!((g - e).abs() <= relative * e.abs(), "{got:?} but expected {expected:?}");
    }
}

#[test]
fn values_and_errors_are_those_of_scipy_curve_fit() {
    // scipy 1.17 curve_fit on the same rows, noise 0.05 sin(12.9898 k) dex; tolerances: its own stopping rule
    let noise = |k: usize| 0.05 * (12.9898 * k as f64).sin();
    let phong = Brdf::Phong { kd: 0.3, ks: 0.4, n: 25.0 };
    let found = fit(&table(&phong, noise), &FitLaw::Phong);
    assert_close(&values(&found), &[0.300_756_839_5, 0.402_318_106_4, 25.315_525_32], 1e-6);
    assert_close(&errors(&found), &[0.002_378_734_995, 0.004_776_092_229, 0.308_945_731_5], 1e-4);
    assert!((found.correlation[0][2].unwrap() - 0.328_318).abs() < 1e-4);
    assert!((found.correlation[1][2].unwrap() - 0.031_427).abs() < 1e-4);

    let linear = FitOptions { log_space: false, ..FitOptions::default() };
    let found = fit_brdf(&table(&phong, noise), &FitLaw::Phong, &linear).unwrap();
    assert_close(&values(&found), &[0.298_631_784_7, 0.406_535_708_1, 24.800_656_38], 1e-6);
    assert_close(&errors(&found), &[0.013_791_949_62, 0.006_036_848_138, 0.445_606_139_7], 1e-4);

    let found = fit(&table(&Brdf::Abg { a: 0.01, b: 1e-3, g: 1.8 }, noise), &FitLaw::Abg);
    assert_close(&values(&found), &[0.010_002_324_88, 0.001_000_578_227, 1.801_989_092], 1e-5);
    assert_close(&errors(&found), &[8.302_701_46e-5, 3.997_106_939e-5, 0.008_388_429_379], 1e-3);

    let found = fit(&table(&Brdf::Gaussian { peak_per_sr: 2.0, sigma: 0.1 }, noise), &FitLaw::Gaussian);
    assert_close(&values(&found), &[2.002_372_93, 0.100_014_83], 1e-6);
    assert_close(&errors(&found), &[0.017_156_29, 0.000_221_38], 1e-4);

    let found = fit(&table(&binomial(vec![0.5, -2.0], vec![-1.0, 2.0, -3.0], -2), noise), &ONE_ROW);
    assert_close(
        &values(&found),
        &[0.502_232_993, -1.989_241_174, -28.252_729_33, 17.996_361_51, -5.565_797_487],
        1e-5,
    );
    assert_close(
        &errors(&found),
        &[0.011_680_894_5, 0.108_063_460_6, 63.237_369_75, 37.768_356_81, 6.630_664_239],
        1e-4,
    );
}

#[test]
fn what_was_injected_without_noise_is_recovered() {
    for (law, brdf) in [
        (FitLaw::Lambert, Brdf::Lambert { albedo: 0.37 }),
        (FitLaw::Phong, Brdf::Phong { kd: 0.53, ks: 0.28, n: 7.31 }),
        (FitLaw::Phong, Brdf::Phong { kd: 0.15, ks: 0.25, n: 0.26 }),
        (FitLaw::Phong, Brdf::Phong { kd: 0.1, ks: 0.6, n: 900.0 }),
        (FitLaw::Abg, Brdf::named("aluminium-lumos").unwrap()),
        (FitLaw::Gaussian, Brdf::Gaussian { peak_per_sr: 30.0, sigma: 0.005 }),
        (ONE_ROW, binomial(vec![0.5, -2.0], vec![-1.0, 2.0, -3.0], -2)),
    ] {
        let found = fit(&table(&brdf, |_| 0.0), &law);
        assert!(found.rms_dex < 1e-7, "{law:?}: {found:?}");
        let again = fit(&table(&found.brdf, |_| 0.0), &law);
        assert_close(&values(&again), &values(&found), 1e-5);
    }
    let found = fit(&table(&Brdf::Phong { kd: 0.53, ks: 0.28, n: 7.31 }, |_| 0.0), &FitLaw::Phong);
    assert_close(&values(&found), &[0.53, 0.28, 7.31], 1e-7);
}

#[test]
fn the_laboratory_laws_are_recovered_as_functions() {
    // ten logarithms are nearly dependent: the function is determined, its coefficients hardly
    for (name, terms, l1, l2) in [("starlink-chassis-lab", 2, -5, 5), ("starlink-array-lab", 2, -3, 3)] {
        let law = FitLaw::Binomial { rows: 1, terms, l1, l2, d: Some(3.0) };
        let found = fit(&table(&Brdf::named(name).unwrap(), |_| 0.0), &law);
        assert!(found.rms_dex < 0.01, "{name}: {}", found.rms_dex);
    }
}

#[test]
fn a_binomial_with_a_dependence_on_v_and_a_free_d_is_recovered_as_a_function() {
    let truth = Binomial {
        b: vec![vec![0.5, -2.0], vec![0.3, -0.1]],
        c: vec![vec![-1.0, 2.0], vec![0.2, -0.4]],
        d: 3.0,
        l1: -1,
    };
    let data = table(&Brdf::Binomial(Arc::new(truth)), |_| 0.0);
    for d in [Some(3.0), None] {
        let found = fit(&data, &FitLaw::Binomial { rows: 2, terms: 2, l1: -1, l2: 1, d });
        assert!(found.rms_dex < 1e-4, "{d:?}: {found:?}");
    }
    // without V the same table is not described
    let flat = fit(&data, &FitLaw::Binomial { rows: 1, terms: 2, l1: -1, l2: 1, d: Some(3.0) });
    assert!(flat.rms_dex > 0.01, "{}", flat.rms_dex);
}

#[test]
fn errors_are_the_scatter_of_repeated_fits() {
    let truth = [0.3, 0.4, 25.0];
    let brdf = Brdf::Phong { kd: truth[0], ks: truth[1], n: truth[2] };
    let mut rng = ChaCha8Rng::seed_from_u64(20250611);
    let normal = Normal::new(0.0, 0.05).unwrap();
    let mut pulls = Vec::new();
    for _ in 0..60 {
        let found = fit(&table(&brdf, |_| normal.sample(&mut rng)), &FitLaw::Phong);
        pulls.extend(found.parameters.iter().zip(truth).map(|(p, t)| (p.value - t) / p.err.unwrap()));
    }
    let mean = pulls.iter().sum::<f64>() / pulls.len() as f64;
    let std = (pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / pulls.len() as f64).sqrt();
    // 180 pulls, partly correlated: 0.1 is two of their own errors for the mean, more for the spread
    assert!(mean.abs() < 0.2 && (std - 1.0).abs() < 0.15, "{mean} {std}");
}

#[test]
fn the_right_law_has_the_lowest_criterion() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let normal = Normal::new(0.0, 0.03).unwrap();
    let data = table(&Brdf::Abg { a: 0.01, b: 1e-3, g: 1.8 }, |_| normal.sample(&mut rng));
    let aic = |law: &FitLaw| fit(&data, law).aic;
    let right = aic(&FitLaw::Abg);
    for wrong in [FitLaw::Lambert, FitLaw::Phong, FitLaw::Gaussian] {
        assert!(right + 10.0 < aic(&wrong), "{wrong:?}");
    }
    // two parameters through two rows prove nothing
    let two = MeasuredTable::parse(Path::new("t"), "10 0 10 180 0.5\n10 0 20 180 0.4\n").unwrap();
    let exact = fit(&two, &FitLaw::Gaussian);
    assert!(exact.aic == f64::INFINITY && exact.parameters.iter().all(|p| p.err.is_none()), "{exact:?}");
}

#[test]
fn a_parameter_the_data_do_not_determine_has_no_error() {
    // one geometry: a Phong law cannot be distinguished from a Lambert one
    let text = "a b c d e\n30 0 30 180 0.5\n30 0 30 180 0.51\n30 0 30 180 0.49\n30 0 30 180 0.5\n";
    let data = MeasuredTable::parse(Path::new("t"), text).unwrap();
    let found = fit(&data, &FitLaw::Phong);
    assert!(found.parameters.iter().all(|p| p.err.is_none()), "{found:?}");
    assert!(found.warnings.iter().any(|w| w.contains("rank deficient") || w.contains("bound")), "{found:?}");
    let lambert = fit(&data, &FitLaw::Lambert);
    assert!(lambert.parameters[0].at_bound == Some(1.0) && lambert.parameters[0].err.is_none(), "{lambert:?}");
}

#[test]
fn a_fit_that_creates_light_says_so() {
    let found = fit(&table(&Brdf::Gaussian { peak_per_sr: 3.0, sigma: 0.5 }, |_| 0.0), &FitLaw::Gaussian);
    assert!(found.warnings.iter().any(|w| w.contains("creates light")), "{:?}", found.warnings);
    assert!(fit(&table(&Brdf::Lambert { albedo: 0.3 }, |_| 0.0), &FitLaw::Lambert).warnings.is_empty());
}

#[test]
fn bounds_and_starts_are_obeyed_and_unknown_names_refused() {
    let data = table(&Brdf::Phong { kd: 0.3, ks: 0.4, n: 25.0 }, |_| 0.0);
    let with = |bounds: Vec<(String, f64, f64)>, starts: Vec<(String, f64)>| {
        fit_brdf(&data, &FitLaw::Phong, &FitOptions { bounds, starts, ..FitOptions::default() })
    };
    let held = with(vec![("n".into(), 1.0, 10.0)], vec![]).unwrap();
    assert_eq!(held.parameters[2].at_bound, Some(10.0));
    assert!((held.parameters[2].value - 10.0).abs() < 1e-9 && held.parameters[2].err.is_none());
    assert!(held.parameters[0].err.is_some());
    assert!(with(vec![], vec![("m".into(), 1.0)]).unwrap_err().to_string().contains("kd, ks, n"));
    assert!(with(vec![("n".into(), 5.0, 1.0)], vec![]).is_err());
    assert!(with(vec![("kd".into(), -1.0, 1.0)], vec![]).is_err());
}

#[test]
fn rows_below_the_surface_and_at_the_clip_are_counted() {
    let text = "phi_i,theta_i,phi_o,theta_o,BRDF\n# comment\n30,0,30,180,0.1\n30,0,95,180,0.1\n\n30,0,20,180,0\n30,0,10,0,0.1 # x\n";
    let data = MeasuredTable::parse(Path::new("t"), text).unwrap();
    assert_eq!(data.rows.iter().map(|r| r.line).collect::<Vec<_>>(), [3, 4, 6, 7]);
    let found = fit(&data, &FitLaw::Lambert);
    assert_eq!((found.used, found.clipped, found.below_surface), (2, 1, 1));
    assert!((found.parameters[0].value - 0.1 * std::f64::consts::PI).abs() < 1e-9);
    let none = fit_brdf(&data, &FitLaw::Lambert, &FitOptions { clip_per_sr: 1.0, ..FitOptions::default() });
    assert!(none.unwrap_err().to_string().contains("0 rows left"));
}

#[test]
fn a_damaged_table_is_an_error_with_its_line() {
    for (text, expected) in [
        ("", "holds no row"),
        ("phi theta\n", "holds no row"),
        ("h\n1 2 3 4 0.1\n1 2 3 4\n", "t:3: 4 columns"),
        ("h\n1 2 3 4 x\n", "t:2: BRDF = \"x\""),
        ("h\n1 2 3 4 nan\n", "t:2: BRDF = \"nan\""),
        ("h\n1 2 inf 4 1\n", "t:2: phi_o = \"inf\""),
        ("h\n1 2 3000 4 1\n", "t:2: phi_o = 3000"),
        ("h\n1 2 30 4 1e300\n", "t:2: BRDF = "),
        ("1 2 3 4 .1\nphi theta\n", "t:2: 2 columns"),
        ("h\n1,2,3,,0.1\n", "t:2: theta_o = \"\""),
    ] {
        let message = MeasuredTable::parse(Path::new("t"), text).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    assert!(MeasuredTable::read(Path::new("/nonexistent/x")).is_err());
}

#[test]
fn the_toml_line_gives_the_law_back() {
    for (law, brdf) in [
        (FitLaw::Phong, Brdf::Phong { kd: 0.53, ks: 0.28, n: 7.31 }),
        (FitLaw::Abg, Brdf::named("aluminium-lumos").unwrap()),
        (ONE_ROW, binomial(vec![0.5, -2.0], vec![-1.0, 2.0, -3.0], -2)),
    ] {
        let found = fit(&table(&brdf, |k| 0.01 * (k as f64).sin()), &law);
        #[derive(serde::Deserialize)]
        struct Line {
            brdf: satphot::config::Brdf,
        }
        let line: Line = toml::from_str(&found.toml()).unwrap();
        assert_eq!(Brdf::try_from(&line.brdf).unwrap(), found.brdf);
    }
}
