//! Light by two paths: over the ground instead of over the view, by points of the disc, by rings on the sphere.
//!
//! Relative errors and shares. Rules of its own, written without the engine's.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::super::{penumbra, source_disc};
use crate::base::constants::AU_KM;
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::light_sources::{SourceSettings, moonlight};
use crate::brightness::shadow::visible_fraction;
use crate::brightness::{Accuracy, Band, Brdf, Ground, direct_reflection, reflected_by_earth};
use crate::config::{Effects, Mode, SourceDisc};

const R_KM: f64 = 6378.0;

/// Nodes and weights of Gauss and Legendre on −1 to 1, by Newton's method.
fn gauss(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut p, mut before) = (1.0, 0.0);
                for k in 0..n {
                    (p, before) = (((2 * k + 1) as f64 * x * p - k as f64 * before) / (k + 1) as f64, p);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                let step = p / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The integral over the ground itself: dω = cos ζ dA/d², from vectors alone. Only where every place in view is lit and in
/// front of the surface, so that no edge spoils the rule.
fn over_the_ground(
    case: &(f64, Vector<Itrs>, Vector<Itrs>),
    earth: &Brdf,
    law: &Brdf,
    light_source: &Vector<Itrs>,
    rule: &[(f64, f64)],
) -> f64 {
    let (r_km, normal, observer) = case;
    let satellite = Vector::new(0.0, 0.0, *r_km);
    let edge = (R_KM / r_km).acos();
    let places = 2 * rule.len();
    let mut sum = 0.0;
    for (x, weight) in rule {
        let theta = 0.5 * edge * (1.0 + x);
        for k in 0..places {
            let turn = std::f64::consts::TAU * (k as f64 + 0.5) / places as f64;
            let up = Vector::new(theta.sin() * turn.cos(), theta.sin() * turn.sin(), theta.cos());
            let line = satellite - up * R_KM;
            let toward = line * (1.0 / line.norm());
            let (w, cos_zeta) = (-toward, toward.dot(&up).max(0.0));
            let light = earth.value(light_source, &up, &toward) * light_source.dot(&up).max(0.0);
            let area = R_KM * R_KM * theta.sin() * 0.5 * edge * weight * std::f64::consts::TAU / places as f64;
            sum +=
                light * law.value(&w, normal, observer) * normal.dot(&w).max(0.0) * cos_zeta * area / line.dot(&line);
        }
    }
    sum
}

pub(super) fn earth_integrals() -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(31);
    let rule = gauss(160);
    let laws = [
        Brdf::Lambert { albedo: 0.3 },
        Brdf::Phong { kd: 0.3, ks: 0.4, n: 12.0 },
        Brdf::Gaussian { peak_per_sr: 3.0, sigma: 0.05 },
    ];
    let earths = [Brdf::Lambert { albedo: 0.25 }, Brdf::Phong { kd: 0.4, ks: 0.2, n: 8.0 }];
    let (mut worst, mut n) = (0.0f64, 0);
    for k in 0..18 {
        let r_km = R_KM + [400.0, 700.0, 1200.0][k % 3];
        let (off, turn): (f64, f64) = (rng.random_range(0.0..0.3), rng.random_range(0.0..std::f64::consts::TAU));
        let light_source = Vector::new(off.sin() * turn.cos(), off.sin() * turn.sin(), off.cos());
        // tilted so little that all ground in view is in front
        let normal = Vector::new(rng.random_range(-0.05..0.05), rng.random_range(-0.05..0.05), -1.0);
        let observer = Vector::new(rng.random_range(-0.6..0.6), rng.random_range(-0.6..0.6), -1.0);
        let (Some(normal), Some(observer)) = (normal.unit(), observer.unit()) else { continue };
        let (law, earth) = (&laws[k % 3], &earths[k % 2]);
        let Some(ground) = Ground::new(&Vector::new(0.0, 0.0, r_km), R_KM, &light_source, earth) else { continue };
        let ours = reflected_by_earth(&ground, law, &normal, &observer, &Accuracy::relative(1e-10, 5_000_000)).per_sr;
        let other = over_the_ground(&(r_km, normal, observer), earth, law, &light_source, &rule);
        worst = worst.max((ours / other - 1.0).abs());
        n += 1;
    }
    (worst, n)
}

/// Rings and places of the sum over patches.
const PATCHES: (usize, usize) = (500, 1000);

/// Moonlight by way of the ground: a sum over patches, each with the Moon where it is seen from there, its distance and its
/// phase. No parallel light, no view, no edge; the lunar law written out. In V, relative to a star of magnitude 0.
fn over_patches(
    (r_km, normal, observer): &(f64, Vector<Itrs>, Vector<Itrs>),
    (albedo, law): (f64, &Brdf),
    (moon_km, sun_km): (&Vector<Itrs>, &Vector<Itrs>),
) -> f64 {
    let satellite = Vector::new(0.0, 0.0, *r_km);
    let edge = (R_KM / r_km).acos();
    let to_sun = *sun_km - *moon_km;
    let (rings, places) = PATCHES;
    let mut sum = 0.0;
    for i in 0..rings {
        let theta = edge * (i as f64 + 0.5) / rings as f64;
        for k in 0..places {
            let turn = std::f64::consts::TAU * (k as f64 + 0.5) / places as f64;
            let up = Vector::new(theta.sin() * turn.cos(), theta.sin() * turn.sin(), theta.cos());
            let to_moon = *moon_km - up * R_KM;
            let (line, cos_moon) = (satellite - up * R_KM, up.dot(&to_moon) / to_moon.norm());
            let toward = line * (1.0 / line.norm());
            let cos_in = -normal.dot(&toward);
            if cos_moon <= 0.0 || cos_in <= 0.0 {
                continue;
            }
            let alpha_deg = to_sun.angle_to(&-to_moon).to_degrees();
            let v_mag = -12.73
                + 0.026 * alpha_deg
                + 4e-9 * alpha_deg.powi(4)
                + 5.0 * (to_moon.norm() / 384_400.0 * to_sun.norm() / AU_KM).log10();
            let radiance = 10f64.powf(-0.4 * v_mag) * albedo / std::f64::consts::PI * cos_moon;
            let solid_angle = toward.dot(&up) * theta.sin() * R_KM * R_KM / line.dot(&line);
            sum += radiance * law.value(&-toward, normal, observer) * cos_in * solid_angle;
        }
    }
    sum * edge / rings as f64 * std::f64::consts::TAU / places as f64
}

/// Lunar-Earthshine with the Moon from the zenith of the satellite to where only a sliver of ground is lit.
pub(super) fn moonlit_ground() -> Result<(f64, usize)> {
    let v = Band::of_config("V")?;
    let light_sources = SourceSettings::new(&Effects::of(Mode::Corrected), &v)?;
    let albedo = 0.3;
    let laws = [Brdf::Lambert { albedo: 1.0 }, Brdf::Phong { kd: 0.3, ks: 0.4, n: 12.0 }];
    let (mut worst, mut n) = (0.0f64, 0);
    let cases =
        [(88.0, 4.0), (60.0, 25.0), (30.0, 100.0), (15.0, 60.0), (4.0, 5.0), (0.0, 40.0), (-10.0, 20.0), (-15.0, 90.0)];
    for (k, (alt_deg, phase_deg)) in cases.into_iter().enumerate() {
        let at = |deg: f64| Vector::new(0.0, deg.to_radians().cos(), deg.to_radians().sin());
        let moon_km = at(alt_deg) * [384_400.0, 360_000.0, 404_000.0][k % 3];
        // on either side of the line from the Earth
        let side = if k % 2 == 0 { phase_deg } else { -phase_deg };
        let sun_km = moon_km + at(180.0 + alt_deg + side) * AU_KM;
        let r_km = R_KM + [420.0, 550.0, 1200.0][(k / 3) % 3];
        let (Some(normal), Some(observer)) = (Vector::new(0.1, 0.3, -1.0).unit(), Vector::new(0.3, -0.2, -1.0).unit())
        else {
            continue;
        };
        let Some(moon) = light_sources.moon_over_ground(&moon_km, &sun_km, R_KM) else { continue };
        let satellite = Vector::new(0.0, 0.0, r_km);
        let Some(ground) = Ground::under_moon(&satellite, R_KM, &moon, &Brdf::Lambert { albedo }) else { continue };
        let law = &laws[k % 2];
        let light = reflected_by_earth(&ground, law, &normal, &observer, &Accuracy::relative(1e-8, 5_000_000)).per_sr;
        let ours = light * moonlight(&Vector::new(0.0, 0.0, 0.0), &moon_km, &sun_km, &light_sources).flux;
        let other = over_patches(&(r_km, normal, observer), (albedo, law), (&moon_km, &sun_km));
        worst = worst.max((ours / other - 1.0).abs());
        n += 1;
    }
    Ok((worst, n))
}

pub(super) fn disc_means(sun_rad: f64) -> (f64, usize) {
    let laws = [
        Brdf::Lambert { albedo: 0.3 },
        Brdf::Phong { kd: 0.34, ks: 0.4, n: 8.9 },
        Brdf::Phong { kd: 0.0, ks: 1.0, n: 1e4 },
        Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 },
    ];
    let cases = source_disc::cases(12, 7);
    let (mut worst, mut n) = (0.0f64, 0);
    for law in &laws {
        let brute: Vec<f64> = cases.iter().map(|case| source_disc::by_brute_force(law, case, sun_rad)).collect();
        let brightest = brute.iter().copied().fold(0.0, f64::max);
        for ([light_source, normal, observer], brute) in cases.iter().zip(&brute) {
            let ours = direct_reflection(law, light_source, normal, observer, sun_rad, SourceDisc::Convolved);
            worst = worst.max((ours - brute).abs() / brightest);
            n += 1;
        }
    }
    (worst, n)
}

pub(super) fn penumbrae(sun_rad: f64) -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(32);
    let n = 200;
    let off = |_| {
        let limb = (R_KM / (R_KM + rng.random_range(300.0..36_000.0))).asin();
        let c = limb + sun_rad * rng.random_range(-0.999..0.999);
        (visible_fraction(sun_rad, limb, c) - penumbra::by_rings(sun_rad, limb, c, 4000)).abs()
    };
    ((0..n).map(off).fold(0.0, f64::max), n)
}
