//! The average of a scattering law over a light source's disc against independent quadratures, and mirrors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::brdf_common;

use std::f64::consts::{PI, TAU};

use brdf_common::{SUN_RAD, UP, chassis_with_v, convolved, direction, every_law, gauss, gaussian, phong};
use satphot::base::vector::{Enu, Vector};
use satphot::brightness::brdf::mirror_reflection;
use satphot::brightness::{Brdf, direct_reflection};
use satphot::config::SourceDisc;

/// The laws whose averages are hardest near a horizon, one of a kind.
fn one_of_each() -> Vec<Brdf> {
    let named = ["aluminium-lumos", "starlink-chassis-lab"].map(|name| Brdf::named(name).unwrap());
    named
        .into_iter()
        .chain([Brdf::Lambert { albedo: 0.3 }, phong(8.9), phong(1e6), gaussian(1e-4), chassis_with_v()])
        .collect()
}

/// Mean over the disc in polar coordinates about its centre: for lobes the grid resolves.
fn about_the_source(brdf: &Brdf, light_source: &Vector<Enu>, observer: &Vector<Enu>, disc_rad: f64) -> f64 {
    let e1 = light_source.any_perpendicular().unwrap();
    let e2 = light_source.cross(&e1);
    let (radial, around) = (gauss(40), 96);
    let mut sum = 0.0;
    for (x, weight) in &radial {
        // uniform in 1 − cos
        let t = x * (1.0 - disc_rad.cos());
        let (c, s) = (1.0 - t, (t * (2.0 - t)).sqrt());
        for k in 0..around {
            let (sin, cos) = (TAU * (f64::from(k) + 0.5) / f64::from(around)).sin_cos();
            let toward = *light_source * c + (e1 * cos + e2 * sin) * s;
            sum += weight * brdf.value(&toward, &UP, observer) * UP.dot(&toward).max(0.0) / f64::from(around);
        }
    }
    sum
}

/// Mean over the disc along great circles from the mirror direction, on the disc or off it: for narrow lobes.
fn from_the_peak(brdf: &Brdf, light_source: &Vector<Enu>, observer: &Vector<Enu>, disc_rad: f64, rays: usize) -> f64 {
    let m = UP * (2.0 * UP.dot(observer)) - *observer;
    let apart = m.angle_to(light_source);
    let across = *light_source - m * m.dot(light_source);
    let e1 = if across.norm() > 1e-12 { across.unit().unwrap() } else { m.any_perpendicular().unwrap() };
    let e2 = m.cross(&e1);
    let rule = gauss(20);
    // from inside all rays meet the disc, from outside those within the tangents, ever more of them towards these
    let outside = apart > disc_rad;
    let tangent = if outside { (disc_rad.sin() / apart.sin()).asin() } else { PI };
    let mut sum = 0.0;
    for k in 0..rays {
        let x = (k as f64 + 0.5) / rays as f64;
        let (psi, width) = if outside {
            (-tangent * (PI * x).cos(), tangent * PI * (PI * x).sin() / rays as f64)
        } else {
            (TAU * x, TAU / rays as f64)
        };
        let (sin, cos) = psi.sin_cos();
        // cosα = cosδ cosγ + sinδ cosψ sinγ = R cos(γ − β)
        let beta = (apart.sin() * cos).atan2(apart.cos());
        let reach = (disc_rad.cos() / apart.cos().hypot(apart.sin() * cos)).min(1.0).acos();
        let e = e1 * cos + e2 * sin;
        // n·s' = cosγ n·m + sinγ n·e falls to 0 once
        let horizon = UP.dot(&m).atan2(-UP.dot(&e));
        let (mut low, edge) = (if outside { beta - reach } else { 0.0 }, (beta + reach).min(horizon));
        let mut high = (2.0 * low).max(1e-6);
        while low < edge {
            let end = high.min(edge);
            for (x, weight) in &rule {
                let gamma = low + (end - low) * x;
                let toward = m * gamma.cos() + e * gamma.sin();
                let value = brdf.value(&toward, &UP, observer) * UP.dot(&toward).max(0.0);
                sum += weight * width * (end - low) * gamma.sin() * value;
            }
            (low, high) = (end, 2.0 * end);
        }
    }
    sum / (TAU * (1.0 - disc_rad.cos()))
}

#[test]
fn the_mean_over_a_disc_is_the_independently_integrated_one_far_from_the_peak() {
    for brdf in every_law() {
        for (zenith, azimuth, out, out_azimuth) in
            [(40.0, 0.0, 25.0, 170.0), (10.0, 30.0, 30.0, 100.0), (80.0, 10.0, 70.0, 185.0), (0.0, 0.0, 45.0, 0.0)]
        {
            for disc_rad in [1e-4, SUN_RAD, 0.05] {
                let (light_source, observer) = (direction(zenith, azimuth), direction(out, out_azimuth));
                let expected = about_the_source(&brdf, &light_source, &observer, disc_rad);
                let got = convolved(&brdf, &light_source, &observer, disc_rad);
                let error = (got - expected).abs() / expected.max(1e-12);
                assert!(error <= 2e-8, "{brdf:?} {zenith} {azimuth} {out} {disc_rad}: {got} {expected} {error:e}");
            }
        }
    }
}

#[test]
fn the_mean_over_a_disc_is_the_independently_integrated_one_at_the_peak() {
    for brdf in every_law() {
        for (zenith, off) in [(0.0, 0.0), (0.0, 0.1), (40.0, 0.0), (40.0, 0.2), (75.0, 0.1), (88.0, 0.24)] {
            for turned in [0.0_f64, 50.0] {
                let light_source = direction(zenith, 0.0);
                let along = off * turned.to_radians().cos();
                let across =
                    if zenith > 0.0 { off * turned.to_radians().sin() / f64::to_radians(zenith).sin() } else { 0.0 };
                let observer = direction(zenith + along, 180.0 + across);
                let expected =
                    from_the_peak(&brdf, &light_source, &observer, SUN_RAD, if zenith > 70.0 { 800 } else { 120 });
                let got = convolved(&brdf, &light_source, &observer, SUN_RAD);
                let error = (got - expected).abs() / expected.max(1e-12);
                assert!(error <= 2e-8, "{brdf:?} {zenith} {off}: {got} {expected} {error:e}");
            }
        }
    }
}

#[test]
fn the_mean_over_a_disc_is_the_independently_integrated_one_just_off_the_disc() {
    for brdf in every_law() {
        for (zenith, off_disc, turned) in
            [(0.0, 1e-4, 0.0), (30.0, 1e-3, 40.0), (60.0, 0.05, 0.0), (80.0, 0.5, 70.0), (30.0, 1.0, 200.0)]
        {
            let light_source = direction(zenith, 0.0);
            let off = SUN_RAD * (1.0 + off_disc);
            let e1 = light_source.any_perpendicular().unwrap();
            let e2 = light_source.cross(&e1);
            let (sin, cos) = f64::to_radians(turned).sin_cos();
            let m = light_source * off.cos() + (e1 * cos + e2 * sin) * off.sin();
            let observer = UP * (2.0 * UP.dot(&m)) - m;
            let expected = from_the_peak(&brdf, &light_source, &observer, SUN_RAD, 400);
            let got = convolved(&brdf, &light_source, &observer, SUN_RAD);
            let error = (got - expected).abs() / expected.max(1e-12);
            assert!(error <= 2e-8, "{brdf:?} {zenith} {off_disc}: {got} {expected} {error:e}");
        }
    }
}

#[test]
fn the_mean_over_a_disc_is_the_independently_integrated_one_at_the_horizon() {
    for brdf in one_of_each() {
        for (zenith, out, azimuth) in [
            (89.9, 89.9, 180.0),
            (89.9, 89.95, 180.1),
            (89.9, 40.0, 170.0),
            (90.1, 89.95, 180.0),
            (90.1, 89.5, 180.0),
            (90.2, 30.0, 180.0),
            (90.0, 80.0, 180.3),
        ] {
            let light_source = direction(zenith, 0.0);
            let observer = direction(out, azimuth);
            let expected = from_the_peak(&brdf, &light_source, &observer, SUN_RAD, 4000);
            let got = convolved(&brdf, &light_source, &observer, SUN_RAD);
            let error = (got - expected).abs() / expected.max(1e-12);
            assert!(error <= 1e-6, "{brdf:?} {zenith} {out} {azimuth}: {got} {expected} {error:e}");
        }
    }
}

#[test]
fn the_chassis_peak_loses_0_70_mag_to_the_disc_of_the_sun() {
    let chassis = Brdf::named("starlink-chassis-lab").unwrap();
    let point = direct_reflection(&chassis, &UP, &UP, &UP, SUN_RAD, SourceDisc::Point);
    let disc = convolved(&chassis, &UP, &UP, SUN_RAD);
    assert!((point - 2187.76).abs() < 0.01 && (disc - 1143.0).abs() < 1.0, "{point} {disc}");
    assert!((2.5 * (disc / point).log10() + 0.70).abs() < 0.01);
}

#[test]
fn a_mirror_conserves_radiance_and_is_dark_outside_the_image_of_the_sun() {
    // 18 m square at 625 km, reflectance 0.96, Sun of 0.53 deg and -26.76 mag
    let mirror = Brdf::Mirror { reflectance: 0.96 };
    let radius = f64::to_radians(0.265);
    for disc in [SourceDisc::Point, SourceDisc::Convolved] {
        let per_sr = direct_reflection(&mirror, &UP, &UP, &UP, radius, disc);
        let mag = -26.76 - 2.5 * (per_sr * 324.0 / 625_000f64.powi(2)).log10();
        assert!((mag + 14.444149632).abs() < 1e-5, "{mag}"); // the published number takes π α² for Ω
        let light_source = direction(30.0, 0.0);
        let seen = |off_deg: f64| {
            direct_reflection(&mirror, &light_source, &UP, &direction(30.0 + off_deg, 180.0), radius, disc)
        };
        assert!(seen(0.2649) > 0.0 && seen(-0.2649) > 0.0);
        assert_eq!((seen(0.2651), seen(-0.2651)), (0.0, 0.0));
        assert_eq!(direct_reflection(&mirror, &light_source, &UP, &direction(150.0, 180.0), radius, disc), 0.0);
        assert_eq!(direct_reflection(&mirror, &light_source, &UP, &direction(30.0, 180.0), 0.0, disc), 0.0);
    }
    // half of the disc still above the surface's horizon
    let low =
        direct_reflection(&mirror, &direction(90.1, 0.0), &UP, &direction(89.95, 180.0), radius, SourceDisc::Convolved);
    assert!(low > 0.0);
}

#[test]
fn at_the_edge_of_its_beam_a_mirror_of_some_size_fades_continuously() {
    let (radius, size) = (f64::to_radians(0.265), f64::to_radians(0.01));
    let share = |off_deg: f64| {
        let out = direction(30.0 + off_deg, 180.0);
        mirror_reflection(1.0, &direction(30.0, 0.0), &UP, &out, radius, size) * TAU * (1.0 - radius.cos())
    };
    assert!((share(0.25) - 1.0).abs() < 1e-9 && share(0.2751) == 0.0);
    // the disc's edge is nearly straight: half of the mirror, less the sagitta 4/(3π) · size/(2 radius) or so
    assert!((share(0.265) - 0.5).abs() < 0.01, "{}", share(0.265));
    let mut last = 1.0;
    for k in 0..=240 {
        let now = share(0.253 + 1e-4 * f64::from(k));
        assert!(now <= last + 1e-6 && last - now < 0.01, "{k}: {now} {last}");
        last = now;
    }
}

#[test]
fn a_gaussian_goes_over_into_the_mirror() {
    let (light_source, observer) = (direction(50.0, 0.0), direction(50.1, 180.1));
    let mirror = convolved(&Brdf::Mirror { reflectance: 0.9 }, &light_source, &observer, SUN_RAD);
    for sigma in [1e-7, 1e-8, 1e-9] {
        // ∫ f (n·s) dω = ρ for the direction of this observer
        let peak_per_sr = 0.9 / (TAU * sigma * UP.dot(&observer));
        let lobe = convolved(&Brdf::Gaussian { peak_per_sr, sigma }, &light_source, &observer, SUN_RAD);
        assert!((lobe / mirror - 1.0).abs() < 10.0 * sigma, "{sigma}: {lobe} {mirror}");
    }
}

#[test]
fn a_disc_sends_out_what_its_points_send_out() {
    // ∫ mean (n·o) dω_o = mean of R(θ') cosθ' over the disc, outgoing light about the mirror direction
    let (light_source, disc_rad) = (direction(35.0, 0.0), 0.05);
    let m = direction(35.0, 180.0);
    let e1 = m.any_perpendicular().unwrap();
    let e2 = m.cross(&e1);
    let rule = gauss(24);
    for brdf in
        [phong(400.0), gaussian(1e-4), Brdf::named("starlink-chassis-lab").unwrap(), Brdf::Lambert { albedo: 0.5 }]
    {
        let mut sent = 0.0;
        let (mut low, mut high) = (0.0, 0.025);
        while low < 2.6 {
            for (x, weight) in &rule {
                let gamma: f64 = low + (high - low) * x;
                for k in 0..72 {
                    let (sin, cos) = (TAU * f64::from(k) / 72.0).sin_cos();
                    let o = m * gamma.cos() + (e1 * cos + e2 * sin) * gamma.sin();
                    let cos_out = UP.dot(&o).max(0.0);
                    sent += weight * (high - low) * gamma.sin() * TAU / 72.0
                        * convolved(&brdf, &light_source, &o, disc_rad)
                        * cos_out;
                }
            }
            (low, high) = (high, if low < 0.2 { high + 0.025 } else { 1.5 * high });
        }
        let mut received = 0.0;
        let a1 = light_source.any_perpendicular().unwrap();
        let a2 = light_source.cross(&a1);
        for (x, weight) in &rule {
            let t = x * (1.0 - disc_rad.cos());
            for k in 0..24 {
                let (sin, cos) = (TAU * f64::from(k) / 24.0).sin_cos();
                let s = light_source * (1.0 - t) + (a1 * cos + a2 * sin) * (t * (2.0 - t)).sqrt();
                let cos_in = UP.dot(&s);
                received += weight / 24.0 * cos_in * brdf.hemispherical_reflectance(cos_in.acos());
            }
        }
        // the horizon of the outgoing hemisphere is a kink the crude outer sum knows nothing of
        assert!((sent / received - 1.0).abs() < 2e-3, "{brdf:?}: {sent} {received}");
    }
}

#[test]
fn the_mean_is_smooth_where_one_method_hands_over_to_the_next() {
    for brdf in every_law() {
        if matches!(brdf, Brdf::Phong { n, .. } if n == 0.0) {
            continue; // a half-space: its edge is a kink
        }
        // third differences of lg over a sweep through all distances from the peak; a step shows as itself
        let step = 1e-6;
        for k in 0..400 {
            let off_deg = 1e-3 * 40_000f64.powf(f64::from(k) / 399.0);
            let at = |j: f64| {
                convolved(&brdf, &direction(30.0, 0.0), &direction(30.0 + off_deg * (1.0 + j * step), 179.0), SUN_RAD)
            };
            let v = [at(0.0), at(1.0), at(2.0), at(3.0)];
            if v.iter().any(|x| *x < 1e-12) {
                continue;
            }
            let third = (v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]).abs() / v[0];
            assert!(third < 3e-8, "{brdf:?} at {off_deg} deg: {third:e}");
        }
    }
}

proptest::proptest! {
    #[test]
    fn nothing_is_ever_negative_or_not_finite(
        which in 0usize..24, zenith in 0.0f64..95.0, out in 0.0f64..95.0, azimuth in 0.0f64..360.0,
        near in proptest::bool::ANY, lg_disc in -7.0f64..0.1,
    ) {
        let laws = every_law();
        let law = &laws[which % laws.len()];
        let light_source = direction(zenith, 0.0);
        let observer = if near { direction(zenith + 1e-3 * (out - 45.0), 180.0 + 1e-3 * azimuth) } else { direction(out, azimuth) };
        for disc in [SourceDisc::Point, SourceDisc::Convolved] {
            let value = direct_reflection(law, &light_source, &UP, &observer, 10f64.powf(lg_disc), disc);
            proptest::prop_assert!(value.is_finite() && value >= 0.0, "{:?} {}", law, value);
        }
    }
}
