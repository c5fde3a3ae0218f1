//! How far the model reaches: the Moon on the horizon and below it, orbits from 160 to 400 000 km, eccentricities next to 1, years
//! outside the theories, spikes under grazing light.
//!
//! Expected are sums of another method (source-centred rings cut at the limb in closed form, rings of the Sun's disc), states of the
//! reference SGP4 (python-sgp4 2.27), and refusals.

use std::f64::consts::{FRAC_PI_2, PI};

use hifitime::Epoch;

use super::light::{AREA, R_KM, V, scene, settings, white};
use super::orbits::GEO;
use super::{Extreme, known_limit, or_wrong, refused, relative};
use crate::base::constants::{AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::base::quadrature::{end_clustered, gauss};
use crate::base::time::parse_utc;
use crate::brightness::light_sources::{SourceSettings, moonlight, sunlight};
use crate::brightness::{Band, Brdf, Scene, brightness, direct_reflection};
use crate::config::SourceDisc;
use crate::orbit::{EarthOrientation, Elements, Propagator, bodies};

const ORBIT: &str = "orbit";
/// Nodes of one dimension of a sum.
const ORDER: usize = 64;
/// Parts of the Sun's disc in either dimension.
const PARTS: usize = 24;

pub(super) fn cases() -> Vec<Extreme> {
    let mut all = Vec::new();
    for moon_deg in [0.0, -10.0, -20.0] {
        let case = format!(
            "Lunar-Earthshine, the Moon at {moon_deg} deg under a satellite 550 km up, against a sum of patches"
        );
        all.push(or_wrong(AREA, &case, moonlit(&case, moon_deg)));
    }
    for (height_km, sun_deg) in
        [(160.0, 30.0), (35_786.0, 30.0), (35_786.0, -60.0), (400_000.0, 30.0), (400_000.0, -60.0)]
    {
        let case = format!("Earthshine {height_km} km up, the Sun at {sun_deg} deg, against a sum of patches");
        all.push(or_wrong(AREA, &case, sunlit(&case, height_km, sun_deg)));
    }
    all.extend(spikes());
    all.extend(states());
    all.extend(years());
    all
}

/// `Σ E(p) sin a(p) f_E f (p·u)₊ (n·w)₊ R²dΩ/D²` over ground within sight, in rings about the point under the light source; a nadir
/// plate and the ground are Lambertian, of albedo 1 and `albedo`. `light` is E and the direction of the light source at a place.
fn patches(r_km: f64, source: &V, least_sine: f64, albedo: f64, light: impl Fn(&V) -> (f64, V)) -> f64 {
    let k = R_KM / r_km;
    let (dip, off) = (k.acos(), FRAC_PI_2 - source.z().asin());
    let (sin_e, cos_e) = (source.z(), (1.0 - source.z() * source.z()).sqrt());
    let up = V::new(0.0, 0.0, 1.0);
    let Some(toward) = (up - *source * sin_e).unit() else { return f64::NAN };
    let across = source.cross(&toward);
    let satellite = up * r_km;
    let (first, last) = ((off - dip).max(0.0), (off + dip).min(least_sine.acos()));
    // from there inwards whole rings are within sight; and the place under the satellite, about which a low one sees all
    let inner = [dip - off, off].into_iter().filter(|edge| *edge > first && *edge < last);
    let mut edges: Vec<f64> = [first, last].into_iter().chain(inner).collect();
    edges.sort_by(f64::total_cmp);
    let (nodes, weights) = gauss(ORDER);
    let mut sum = 0.0;
    for panel in edges.windows(2).filter(|panel| panel[1] > panel[0]) {
        for (t, weight) in nodes.iter().zip(weights) {
            let (x, dx) = end_clustered(*t);
            let chi = panel[0] + (panel[1] - panel[0]) * x;
            let (sin_chi, cos_chi) = chi.sin_cos();
            // p·z > k
            let half = ((k - cos_chi * sin_e) / (sin_chi * cos_e)).clamp(-1.0, 1.0).acos();
            for (u, weight_xi) in nodes.iter().flat_map(|u| [-u, *u]).zip(weights.iter().flat_map(|w| [*w, *w])) {
                // both sides of the plane of light source and satellite
                let (y, dy) = end_clustered(u.abs());
                let xi = half * y.copysign(u);
                let p = *source * cos_chi + (toward * xi.cos() + across * xi.sin()) * sin_chi;
                let to_satellite = satellite - p * R_KM;
                let d_km = to_satellite.norm();
                let view = to_satellite * (1.0 / d_km);
                let (e, direction) = light(&p);
                let patch = e * p.dot(&direction).max(0.0) * p.dot(&view).max(0.0) * view.z().max(0.0) / (d_km * d_km);
                sum += weight * dx * (panel[1] - panel[0]) * weight_xi * dy * half * sin_chi * patch;
            }
        }
    }
    sum * R_KM * R_KM * albedo / (PI * PI)
}

/// A (n·o)/d² of a plate of 1 m² that faces the nadir.
fn spread(s: &Scene) -> f64 {
    let line = s.observer_km - s.satellite_km;
    -line.z() / line.norm() / (1e3 * line.norm()).powi(2)
}

fn moonlit(case: &str, moon_deg: f64) -> Result<Extreme> {
    let albedo = 0.3;
    let mut settings = settings(1e-8);
    settings.earth = Brdf::Lambert { albedo };
    // the Sun far below, on the other side
    let s = scene(R_KM + 550.0, 0.05, 200.0, moon_deg);
    let sources = SourceSettings::new(&settings.effects, &Band::of_config("V")?)?;
    let source = s.moon_km * (1.0 / s.moon_km.norm());
    let least = R_KM / s.moon_km.norm();
    let expected = patches(R_KM + 550.0, &source, least, albedo, |p| {
        let line = s.moon_km - *p * R_KM;
        (moonlight(&(*p * R_KM), &s.moon_km, &s.sun_km, &sources).flux, line * (1.0 / line.norm()))
    });
    let got = brightness(&s, &white(1.0), &settings)?.lunar_earthshine.flux_ratio;
    Ok(relative(AREA, case, spread(&s) * expected, got, 1e-6))
}

fn sunlit(case: &str, height_km: f64, sun_deg: f64) -> Result<Extreme> {
    let albedo = 0.3;
    let mut settings = settings(1e-8);
    (settings.earth, settings.moon) = (Brdf::Lambert { albedo }, false);
    let s = scene(R_KM + height_km, 0.01, sun_deg, -80.0);
    let sources = SourceSettings::new(&settings.effects, &Band::of_config("V")?)?;
    let source = s.sun_km * (1.0 / s.sun_km.norm());
    let flux = sunlight(s.sun_km.norm(), &sources).flux;
    let expected = patches(R_KM + height_km, &source, 0.0, albedo, |_| (flux, source));
    let got = brightness(&s, &white(1.0), &settings)?.earthshine.flux_ratio;
    Ok(relative(AREA, case, spread(&s) * expected, got, 1e-6))
}

/// Lobes narrower than the Sun, seen in the mirror direction of a Sun that touches the horizon of the surface: the mean of f cos over
/// the part of the disc that is up.
fn spikes() -> Vec<Extreme> {
    let sun_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let up = V::new(0.0, 0.0, 1.0);
    let laws = [
        ("Phong n = 1e6", Brdf::Phong { kd: 0.0, ks: 0.9, n: 1e6 }),
        ("Gauss sigma = 1e-7", Brdf::Gaussian { peak_per_sr: 10.0, sigma: 1e-7 }),
        ("ABG B = 1e-7", Brdf::Abg { a: 1e-3, b: 1e-7, g: 2.0 }),
    ];
    let mut all = Vec::new();
    for (name, law) in laws {
        for altitude in [2.0 * sun_rad, 0.5 * sun_rad, 0.0] {
            let (sin, cos) = altitude.sin_cos();
            let source = V::new(cos, 0.0, sin);
            // the mirror image of a point of the disc that is up, off its centre
            let (seen, aside) = (altitude + 0.3 * sun_rad, 0.2 * sun_rad);
            let observer = V::new(-seen.cos() * aside.cos(), -seen.cos() * aside.sin(), seen.sin());
            let expected = over_disc(&law, (&source, altitude), &observer, sun_rad);
            let got = direct_reflection(&law, &source, &up, &observer, sun_rad, SourceDisc::Convolved);
            let case = format!("{name}, the Sun {:.2} deg above the surface's plane [1/sr]", altitude.to_degrees());
            all.push(relative(AREA, case, expected, got, 1e-6));
        }
    }
    all
}

/// `(1/Ω) ∫ f (n·s')₊ dω'` in rings about the centre of the disc, cut at the surface's horizon.
fn over_disc(law: &Brdf, (source, altitude): (&V, f64), observer: &V, sun_rad: f64) -> f64 {
    let up = V::new(0.0, 0.0, 1.0);
    let across = V::new(0.0, 1.0, 0.0);
    let upward = source.cross(&across);
    let (nodes, weights) = gauss(ORDER / 2);
    let mut edges: Vec<f64> = (0..=PARTS).map(|k| sun_rad * k as f64 / PARTS as f64).collect();
    edges.push(altitude.min(sun_rad));
    edges.sort_by(f64::total_cmp);
    let mut sum = 0.0;
    for ring in edges.windows(2).filter(|ring| ring[1] > ring[0]) {
        for (t, weight) in nodes.iter().zip(weights) {
            // the arc that is up opens like a root
            let (x, dx) = end_clustered(*t);
            let (sin, cos) = (ring[0] + (ring[1] - ring[0]) * x).sin_cos();
            // sin a cos ρ + cos a sin ρ cos φ > 0
            let half = (-altitude.sin() * cos / (altitude.cos() * sin)).clamp(-1.0, 1.0).acos();
            for part in 0..PARTS {
                for (u, weight_phi) in nodes.iter().zip(weights) {
                    let phi = half * (2.0 * (part as f64 + u) / PARTS as f64 - 1.0);
                    let s = *source * cos + (upward * phi.cos() + across * phi.sin()) * sin;
                    let f_cos = law.value(&s, &up, observer) * s.z().max(0.0);
                    sum += weight * dx * (ring[1] - ring[0]) * weight_phi * 2.0 * half / PARTS as f64 * sin * f_cos;
                }
            }
        }
    }
    sum / (4.0 * PI * (0.5 * sun_rad).sin().powi(2))
}

/// x of the geostationary satellite ten days after its elements \[km\].
const GEO_X_KM: f64 = 15_750.319_293_936_087;
/// Minutes after the elements, and the place \[km\].
type State = (f64, [f64; 3]);

/// Elements of these mean motions and eccentricities, with the drag of the ISS, against the states of python-sgp4 \[km\].
fn states() -> Vec<Extreme> {
    const ONE: &str = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996";
    let orbits: [(&str, &str, &[State]); 4] = [
        (
            "160 km up",
            "2 25544  51.6400 352.2516 0001000 195.4618 310.3088 16.42185192500644",
            &[
                (90.0, [-5_658.167_744_846_843, 2_495.357_382_130_207, 2_112.085_695_231_158]),
                (1_440.0, [3_558.472_286_261_820_5, -3_941.320_359_951_084, -3_795.193_277_098_341_2]),
            ],
        ),
        (
            "geosynchronous",
            "2 25544  51.6400 352.2516 0001000 195.4618 310.3088  1.00270000500645",
            &[(14_400.0, [-36_542.639_280_729_64, 15_977.722_758_145_861, 13_664.594_094_340_175])],
        ),
        (
            "400 000 km up",
            "2 25544  51.6400 352.2516 0100000 195.4618 310.3088  0.03351255500649",
            &[(14_400.0, [-64_664.982_458_655_184, -248_178.190_397_536_38, -313_232.078_390_920_07])],
        ),
        (
            "of eccentricity 0.94",
            "2 25544  51.6400 352.2516 9400000 195.4618 310.3088  0.20000000500649",
            &[
                (1_440.0, [80_395.810_973_440_92, -24_140.177_191_223_48, -14_398.708_291_061_586]),
                (14_400.0, [133_118.162_585_083_54, 33_147.712_972_849_67, 61_959.315_661_026_34]),
            ],
        ),
    ];
    let mut all = Vec::new();
    for (name, two, states) in orbits {
        for (minutes, expected) in states {
            let case = format!("an orbit {name}, {minutes} min after its elements, against python-sgp4 [km]");
            let off = (|| {
                let (place, _) = Propagator::new(&Elements::from_tle("satellite", ONE, two)?)?.state_after(*minutes)?;
                let [x, y, z] = *expected;
                Ok((place - crate::base::vector::Vector::new(x, y, z)).norm())
            })();
            all.push(or_wrong(ORBIT, &case, off.map(|km| super::absolute(ORBIT, &case, 0.0, km, 1e-3))));
        }
    }
    // deep-space orbits of low inclination: this SGP4 says that it may be off by a kilometre
    let case = "geostationary, inclined by 0.0004 deg, ten days on, against python-sgp4: x [km]".to_string();
    let x = Elements::from_tle("satellite", GEO[0], GEO[1]).and_then(|e| Propagator::new(&e)?.state_after(14_400.0));
    all.push(or_wrong(
        ORBIT,
        &case.clone(),
        x.map(|(place, _)| known_limit((ORBIT, case), GEO_X_KM, place.x(), 1e-7, 1e-4)),
    ));
    let of =
        |two: &str, minutes: f64| Propagator::new(&Elements::from_tle("satellite", ONE, two)?)?.state_after(minutes);
    all.push(refused(ORBIT, "160 km up, ten days later", "decayed", of(orbits[0].1, 14_400.0)));
    let nearly_open = "2 25544  51.6400 352.2516 9999999 195.4618 310.3088  1.00000000500648";
    all.push(refused(ORBIT, "eccentricity 0.9999999", "SGP4", of(nearly_open, 0.0)));
    all
}

/// Years that the theories of Sun and Moon were not fitted to.
fn years() -> Vec<Extreme> {
    let mut all = Vec::new();
    for year in [1600, 1899, 2101, 2300] {
        let at = Epoch::maybe_from_gregorian_utc(year, 6, 1, 0, 0, 0, 0)
            .map_err(|e| crate::Error::Orbit { problem: e.to_string() });
        let seen = at.and_then(|at| bodies(&at, &EarthOrientation::default()));
        all.push(refused(ORBIT, format!("Sun and Moon of {year}"), "from 1900 to 2100 only", seen));
        let text = format!("{year}-06-01T00:00:00");
        all.push(refused(ORBIT, format!("the time {text}"), "is outside 1900 to 2100", parse_utc("time", &text)));
    }
    all
}
