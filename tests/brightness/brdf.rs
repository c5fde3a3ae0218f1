//! Laws of scattering: values, reflectances, what is refused, limits into one another.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::brdf_common;

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use brdf_common::{SUN_RAD, UP, convolved, direction, every_law, gauss};
use satphot::brightness::{Binomial, Brdf};

#[test]
fn values_are_the_directly_evaluated_ones() {
    // lg f summed term by term elsewhere, D in the plane of incidence at normal incidence: D = sin of the outgoing angle
    let chassis = [
        (0.0, 2187.761623949552),
        (0.001, 1749.193809279182),
        (0.01, 282.49310813867424),
        (0.1, 0.9921976494481876),
        (0.5, 0.034952094985581876),
        (1.0, 0.013159706381021782),
        (1.9, 0.017436777345691386),
    ];
    let array = [
        (0.0, 3.4197944251370886),
        (0.001, 3.2632774499344896),
        (0.01, 2.1687338503530396),
        (0.1, 0.12244754227852066),
        (0.5, 0.005992517775282081),
        (1.0, 0.002501660787752561),
        (1.9, 0.0018049359688023698),
    ];
    for (name, rows) in [("starlink-chassis-lab", chassis), ("starlink-array-lab", array)] {
        let Brdf::Binomial(law) = Brdf::named(name).unwrap() else { panic!("{name}") };
        for (d, expected) in rows {
            assert!((law.value(d, 0.3) / expected - 1.0).abs() < 1e-12, "{name} {d}");
        }
    }
    let chassis = Brdf::named("starlink-chassis-lab").unwrap();
    let f = chassis.value(&direction(30.0, 0.0), &UP, &direction(20.0, 150.0));
    assert!((f / 0.1413022898062588 - 1.0).abs() < 1e-11, "{f}"); // D itself is good to 1e-15 of 1
    let aluminium = Brdf::named("aluminium-lumos").unwrap();
    let f = aluminium.value(&direction(0.0, 0.0), &UP, &direction(30.0, 77.0));
    assert!((f / (0.003362 / (4.309e-6 + 0.5f64.powf(2.068))) - 1.0).abs() < 1e-12);
}

#[test]
fn a_binomial_with_two_rows_is_the_sum_of_its_rows_weighted_with_v() {
    let law = Binomial { b: vec![vec![0.2, -1.0], vec![0.5]], c: vec![vec![], vec![-2.0, 3.0]], d: 2.0, l1: -1 };
    let (i, o) = (direction(50.0, 20.0), direction(35.0, 140.0));
    let (ix, ox) = (i - UP * UP.dot(&i), o - UP * UP.dot(&o));
    let (d, v) = ((ix + ox).norm(), -ix.dot(&ox));
    let lg = 0.2 - d + v * (0.5 + 0.5 * (-2.0 * (1.0 + d * d / 2.0).log10() + 3.0 * (1.0 + d * d).log10()));
    let f = Brdf::Binomial(Arc::new(law)).value(&i, &UP, &o);
    assert!((f / 10f64.powf(lg) - 1.0).abs() < 1e-12);
}

#[test]
fn reflectances_are_the_independently_integrated_ones() {
    // polar quadrature about the mirror direction in another language, ten digits printed; degrees 0, 40, 60, 85
    let named = |name: &str| Brdf::named(name).unwrap();
    for (brdf, expected) in [
        (named("starlink-chassis-lab"), [0.5781364726, 0.5672907042, 0.5424634203, 0.3738360193]),
        (named("starlink-array-lab"), [0.0338534246, 0.0332368698, 0.0300768137, 0.02096349]),
        (named("aluminium-lumos"), [0.1565207868, 0.1506172104, 0.140798528, 0.0960386863]),
        (Brdf::Gaussian { peak_per_sr: 1.0, sigma: 0.3 }, [1.3396420825, 1.0622145775, 0.77693679, 0.4193909361]),
    ] {
        for (deg, expected) in [0.0_f64, 40.0, 60.0, 85.0].into_iter().zip(expected) {
            let got = brdf.hemispherical_reflectance(deg.to_radians());
            assert!((got - expected).abs() < 2e-9, "{brdf:?} at {deg}: {got} but {expected}");
        }
    }
    // 2πAσ (1 − σ(1 − e^(−1/σ))) at normal incidence, in closed form
    for sigma in [1e-9, 1e-5, 1e-2, 0.3, 5.0, 1e3] {
        let got = Brdf::Gaussian { peak_per_sr: 1.0 / sigma, sigma }.hemispherical_reflectance(0.0);
        let exact = if sigma < 100.0 {
            TAU * (1.0 + sigma * (-1.0 / sigma).exp_m1())
        } else {
            PI / sigma * (1.0 - 1.0 / (3.0 * sigma))
        };
        assert!((got / exact - 1.0).abs() < 1e-7, "{sigma}: {got} {exact}");
    }
}

#[test]
fn a_dependence_on_v_is_integrated_over_the_arcs() {
    // f = 10^(0.3 V − 0.9), V = −i·o + (n·i)(n·o): brute force over the hemisphere
    let law = Brdf::Binomial(Arc::new(Binomial { b: vec![vec![-0.9], vec![0.3]], c: vec![], d: 1.0, l1: 0 }));
    let rule = gauss(40);
    for deg in [0.0_f64, 35.0, 80.0] {
        let i = direction(deg, 0.0);
        let mut sum = 0.0;
        for (x, weight) in &rule {
            for k in 0..64 {
                let o = direction(x.sqrt().asin().to_degrees(), 360.0 * f64::from(k) / 64.0);
                sum += weight * PI * law.value(&i, &UP, &o) / 64.0;
            }
        }
        let got = law.hemispherical_reflectance(deg.to_radians());
        assert!((got - sum).abs() < 1e-9, "{deg}: {got} {sum}");
    }
}

#[test]
fn the_largest_reflectance_is_found_wherever_it_is() {
    for brdf in every_law() {
        let largest = brdf.max_reflectance();
        let grid = (0..=900).map(|k| brdf.hemispherical_reflectance(f64::from(k) * PI / 1800.0)).fold(0.0, f64::max);
        assert!(largest >= grid - 1e-5 * grid && largest <= grid + 1e-4 * grid, "{brdf:?}: {largest} {grid}");
    }
    // rises towards grazing: V is sin² of the incidence at the mirror direction
    let rising = Brdf::Binomial(Arc::new(Binomial { b: vec![vec![1.0, -20.0], vec![1.5]], c: vec![], d: 1.0, l1: 0 }));
    assert!(rising.max_reflectance() > 1.5 * rising.hemispherical_reflectance(0.0));
}

#[test]
fn every_law_known_by_name_returns_no_more_than_it_receives() {
    for name in Brdf::names() {
        let law = Brdf::named(name).unwrap();
        law.check(name).unwrap();
        assert!(!law.creates_light() && law.max_reflectance() <= 1.0, "{name}");
        assert!(Brdf::source(name).is_some());
    }
}

#[test]
fn an_unknown_law_is_an_error_that_names_the_nearest_and_all() {
    let message = Brdf::named("starlink-chasis-lab").unwrap_err().to_string();
    assert!(message.contains("did you mean \"starlink-chassis-lab\""), "{message}");
    assert!(Brdf::names().iter().all(|name| message.contains(name)), "{message}");
    assert_eq!(Brdf::named("Earth_Vegetation").unwrap(), Brdf::named("earth-vegetation").unwrap());
}

#[test]
fn what_creates_light_passes_the_parameters_and_fails_the_check() {
    let bright = [
        Brdf::Lambert { albedo: 1.2 },
        Brdf::Mirror { reflectance: 1.01 },
        Brdf::Phong { kd: 0.8, ks: 0.4, n: 3.0 },
        Brdf::Gaussian { peak_per_sr: 1e3, sigma: 1e-3 },
        Brdf::Abg { a: 1.0, b: 1e-3, g: 2.0 },
        Brdf::Binomial(Arc::new(Binomial { b: vec![vec![1.0]], c: vec![], d: 1.0, l1: 0 })),
        // unbalanced thousands: finite all the same
        Brdf::Binomial(Arc::new(Binomial { b: vec![vec![0.0]], c: vec![vec![1000.0; 8]], d: 3.0, l1: 0 })),
    ];
    for law in bright {
        law.check_parameters("plate").unwrap();
        assert!(law.creates_light(), "{law:?}");
        assert!(law.check("plate").unwrap_err().to_string().contains("plate"), "{law:?}");
    }
}

#[test]
fn parameters_that_are_no_law_are_refused_with_their_name() {
    let binomial =
        |b: Vec<Vec<f64>>, c: Vec<Vec<f64>>, d: f64, l1: i32| Brdf::Binomial(Arc::new(Binomial { b, c, d, l1 }));
    for (law, named) in [
        (Brdf::Lambert { albedo: -0.1 }, "albedo = -0.1"),
        (Brdf::Mirror { reflectance: f64::NAN }, "reflectance = NaN"),
        (Brdf::Phong { kd: 0.1, ks: f64::INFINITY, n: 1.0 }, "ks = inf"),
        (Brdf::Phong { kd: 0.1, ks: 0.1, n: 2e6 }, "n = 2000000"),
        (Brdf::Gaussian { peak_per_sr: 1.0, sigma: 0.0 }, "sigma = 0"),
        (Brdf::Gaussian { peak_per_sr: -1.0, sigma: 1.0 }, "peak_per_sr = -1"),
        (Brdf::Abg { a: 1.0, b: 0.0, g: 2.0 }, "b = 0"),
        (Brdf::Abg { a: 1.0, b: 1.0, g: -2.0 }, "g = -2"),
        (binomial(vec![], vec![], 3.0, 0), "empty"),
        (binomial(vec![vec![f64::NAN]], vec![], 3.0, 0), "NaN"),
        (binomial(vec![vec![1.0]], vec![vec![1.0]], f64::NAN, 0), "d = NaN"),
        (binomial(vec![vec![1.0]], vec![vec![1.0]], 3.0, i32::MAX), "l1"),
        (binomial(vec![vec![1.0]], vec![vec![1.0]], 0.0, -2), "l1"),
    ] {
        let message = law.check_parameters("plate").unwrap_err().to_string();
        assert!(message.contains(named) && message.contains("plate"), "{message}");
        assert!(law.check("plate").is_err());
    }
}

#[test]
fn every_law_is_reciprocal_finite_and_one_sided() {
    for brdf in every_law() {
        for (i, o) in [
            (direction(40.0, 0.0), direction(25.0, 170.0)),
            (direction(80.0, 10.0), direction(3.0, 250.0)),
            (direction(89.999999, 0.0), direction(89.9999999, 180.0)),
            (direction(89.9999999, 0.0), direction(0.0, 0.0)),
            (direction(30.0, 0.0), direction(30.0, 180.0)),
        ] {
            let (there, back) = (brdf.value(&i, &UP, &o), brdf.value(&o, &UP, &i));
            // σ = 1e-9 turns the last bit of a direction into 1e-7 of f
            assert!(there.is_finite() && (there - back).abs() <= 1e-6 * there, "{brdf:?} {there} {back}");
        }
        assert_eq!(brdf.value(&direction(90.1, 0.0), &UP, &direction(10.0, 0.0)), 0.0);
        assert_eq!(brdf.value(&direction(10.0, 0.0), &UP, &direction(90.1, 0.0)), 0.0);
    }
}

#[test]
fn laws_go_over_into_one_another() {
    let (i, o) = (direction(20.0, 0.0), direction(19.0, 178.0));
    let same = |a: &Brdf, b: &Brdf, tolerance: f64| {
        let (a, b) = (a.value(&i, &UP, &o), b.value(&i, &UP, &o));
        assert!((a / b - 1.0).abs() < tolerance, "{a} {b}");
    };
    let lambert = Brdf::Lambert { albedo: 0.4 };
    same(&Brdf::Phong { kd: 0.4, ks: 0.0, n: 50.0 }, &lambert, 1e-15);
    same(&Brdf::Abg { a: 0.8 / PI, b: 1.0, g: 0.0 }, &lambert, 1e-15);
    same(&Brdf::Gaussian { peak_per_sr: 0.4 / PI, sigma: 1e9 }, &lambert, 1e-8);
    let constant = Binomial { b: vec![vec![(0.4 / PI).log10()]], c: vec![], d: 3.0, l1: 0 };
    same(&Brdf::Binomial(Arc::new(constant)), &lambert, 1e-14);
    // cosⁿγ = exp(n ln cosγ) → exp(−n(1 − cosγ)), apart by n(1 − cosγ)²/2
    for n in [1e3, 1e4, 1e5, 1e6] {
        let phong = Brdf::Phong { kd: 0.0, ks: 1.0, n };
        let gaussian = Brdf::Gaussian { peak_per_sr: (n + 2.0) / TAU, sigma: 1.0 / n };
        let off = direction(20.0 + 0.5 / n.sqrt() * 180.0 / PI, 180.0);
        let (a, b) = (phong.value(&i, &UP, &off), gaussian.value(&i, &UP, &off));
        assert!((a / b - 1.0).abs() < 0.1 / n, "{n}: {a} {b}");
    }
}

#[test]
fn laws_at_the_edge_of_the_accepted_neither_hang_nor_fail() {
    let binomial = |b: f64, c: f64, d: f64| {
        Brdf::Binomial(Arc::new(Binomial { b: vec![vec![0.0, b]], c: vec![vec![c]], d, l1: 0 }))
    };
    for law in [
        Brdf::Abg { a: 1.0, b: 1e-300, g: 20.0 },
        Brdf::Abg { a: 0.0, b: 1e300, g: 1e3 },
        Brdf::Gaussian { peak_per_sr: 1.0, sigma: 1e-300 },
        Brdf::Gaussian { peak_per_sr: 1.0, sigma: 1e300 },
        Brdf::Phong { kd: 0.0, ks: 0.0, n: 0.0 },
        binomial(-1e300, 0.0, 3.0),
        binomial(1.0, 1.0, 0.0),
        binomial(0.0, -1e6, 1e90),
    ] {
        law.check_parameters("plate").unwrap();
        assert!(law.max_reflectance().is_finite(), "{law:?}");
        for disc_rad in [0.0, 1e-300, 1e-20, 1e-7, SUN_RAD, 1.0, 9.0] {
            for out in [0.0, 30.0, 89.99] {
                let value = convolved(&law, &direction(30.0, 0.0), &direction(out, 180.0), disc_rad);
                assert!(value.is_finite() && value >= 0.0, "{law:?} {disc_rad} {out}: {value}");
            }
        }
    }
}
