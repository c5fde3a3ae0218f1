//! What the tests of scattering laws share: directions, one law of every kind, a quadrature rule of their own.
#![allow(dead_code)] // each test file uses a part

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use satphot::base::vector::{Enu, Vector};
use satphot::brightness::{Binomial, Brdf, direct_reflection};
use satphot::config::SourceDisc;

pub const UP: Vector<Enu> = Vector::new(0.0, 0.0, 1.0);
/// Angular radius of the Sun as the laboratory peak is quoted for \[rad\].
pub const SUN_RAD: f64 = 0.267 * PI / 180.0;

pub fn direction(zenith_deg: f64, azimuth_deg: f64) -> Vector<Enu> {
    let ((sz, cz), (sa, ca)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    Vector::new(sz * ca, sz * sa, cz)
}

pub fn gaussian(sigma: f64) -> Brdf {
    Brdf::Gaussian { peak_per_sr: 1.0 / (TAU * sigma), sigma }
}

pub fn phong(n: f64) -> Brdf {
    Brdf::Phong { kd: 0.1, ks: 0.9, n }
}

/// Chassis with a mild dependence on V.
pub fn chassis_with_v() -> Brdf {
    let Brdf::Binomial(law) = Brdf::named("starlink-chassis-lab").unwrap() else { panic!() };
    let Binomial { mut b, c, d, l1 } = (*law).clone();
    b.push(vec![0.3, -0.1]);
    Brdf::Binomial(Arc::new(Binomial { b, c, d, l1 }))
}

pub fn every_law() -> Vec<Brdf> {
    let mut laws: Vec<Brdf> = Brdf::names().into_iter().map(|name| Brdf::named(name).unwrap()).collect();
    laws.push(Brdf::Lambert { albedo: 0.3 });
    laws.extend([0.0, 0.26, 1.0, 8.9, 100.0, 1e4, 1e6].map(phong));
    laws.extend([1e-9, 1e-6, 1e-4, 1e-2, 1.0].map(gaussian));
    laws.push(Brdf::Abg { a: 0.01, b: 1e-3, g: 0.5 });
    laws.push(Brdf::Abg { a: 0.01, b: 1.0, g: 2.0 });
    laws.push(chassis_with_v());
    laws
}

/// Gauss-Legendre on 0 to 1, from the roots of P_n found by bisection between sign changes.
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let p = |x: f64| {
        let (mut a, mut b) = (1.0, x);
        for k in 2..=n {
            (a, b) = (b, ((2 * k - 1) as f64 * x * b - (k - 1) as f64 * a) / k as f64);
        }
        (b, n as f64 * (x * b - a) / (x * x - 1.0))
    };
    let mut rule = Vec::new();
    let steps = 40 * n;
    let grid = |k: usize| -(PI * (k as f64 + 0.37) / (steps as f64 + 0.5)).cos();
    for k in 0..steps {
        let (mut low, mut high) = (grid(k), grid(k + 1));
        if p(low).0 * p(high).0 < 0.0 {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if p(low).0 * p(middle).0 <= 0.0 { high = middle } else { low = middle }
            }
            let slope = p(low).1;
            rule.push((0.5 * (1.0 + low), 1.0 / ((1.0 - low * low) * slope * slope)));
        }
    }
    assert_eq!(rule.len(), n);
    rule
}

pub fn convolved(brdf: &Brdf, light_source: &Vector<Enu>, observer: &Vector<Enu>, disc_rad: f64) -> f64 {
    direct_reflection(brdf, light_source, &UP, observer, disc_rad, SourceDisc::Convolved)
}
