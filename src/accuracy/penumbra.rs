//! The edge of the Earth's shadow: error and cost of the share of the Sun's disc, with and without air.
//!
//! Satellites 550 km up and geostationary, the Sun anywhere across the penumbra. Errors in shares of the whole Sun. The
//! references: Gauss rules of 72 points in a piece through the air, 4000 rings on the sphere without it.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::{AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::brightness::shadow::{ATMOSPHERE_ORDER, Colour, mean_over_disc, visible_fraction};

const RADIUS_KM: f64 = 6378.0;
const ORDERS: [usize; 7] = [2, 4, 6, 8, 12, 18, 24];
const REFERENCE_ORDER: usize = 72;
const RINGS: [usize; 4] = [4, 16, 64, 256];
const REFERENCE_RINGS: usize = 4000;

/// Share of a disc of radius `a` left by a cover of radius `b` at separation `c`, both caps of the sphere: rings about
/// the middle of the disc, of each the exact arc outside the cover, by the midpoint rule in the cosine.
pub(super) fn by_rings(a: f64, b: f64, c: f64, rings: usize) -> f64 {
    let versine = |r: f64| 2.0 * (0.5 * r).sin().powi(2);
    let mut seen = 0.0;
    for ring in 0..rings {
        let share = (ring as f64 + 0.5) / rings as f64;
        let r = 2.0 * (0.5 * share * versine(a)).sqrt().asin();
        // cos b = cos c cos r + sin c sin r cos φ, in differences that keep their digits
        let cos_arc = (versine(c - r) - versine(b)) / (c.sin() * r.sin());
        let covered = (1.0 + cos_arc).clamp(-1.0, 1.0);
        // cos φ ≥ 1 + (vers(c−r) − vers b)/(sin c sin r) is under the cover
        seen += 1.0 - covered.acos() / std::f64::consts::PI;
    }
    seen / rings as f64
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let sun_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(21));
    let n = stopwatch.effort.of(60, 2000);
    let mut series = Vec::new();
    for (label, r_km) in
        [("550 km up, through the air", RADIUS_KM + 550.0), ("geostationary, through the air", 42_164.0)]
    {
        // from the last ray over the ground to 100 km of air
        let limb = (RADIUS_KM / r_km).asin();
        let top = ((RADIUS_KM + 100.0) / r_km).min(1.0).asin();
        let places: Vec<f64> =
            (0..n).map(|_| rng.random_range(limb - 2.0 * sun_rad..top.max(limb + sun_rad))).collect();
        let share = |c: f64, order: usize| mean_over_disc(r_km, RADIUS_KM, sun_rad, c, &Colour::V, order);
        let exact: Vec<f64> = places.iter().map(|c| share(*c, REFERENCE_ORDER)).collect();
        let points = ORDERS.into_iter().filter_map(|order| {
            let off: Vec<f64> = places.iter().zip(&exact).map(|(c, exact)| share(*c, order) - exact).collect();
            let us = cpu_us(stopwatch, || {
                places.iter().for_each(|c| {
                    std::hint::black_box(share(*c, order));
                });
            });
            Errors::of(&off).map(|errors| SweepPoint {
                setting: format!("order {order}"),
                errors,
                cpu_us: us / n as f64,
                memory_kb: None,
                is_default: order == ATMOSPHERE_ORDER,
            })
        });
        series.push(Series { label: label.into(), points: points.collect() });
    }
    for (label, r_km) in [("550 km up, no air", RADIUS_KM + 550.0), ("geostationary, no air", 42_164.0)] {
        let limb = (RADIUS_KM / r_km).asin();
        let places: Vec<f64> = (0..n).map(|_| limb + sun_rad * rng.random_range(-1.0..1.0)).collect();
        let exact: Vec<f64> = places.iter().map(|c| by_rings(sun_rad, limb, *c, REFERENCE_RINGS)).collect();
        let plane = |c: f64| visible_fraction(sun_rad, limb, c);
        let mut points = Vec::new();
        let mut add = |setting: String, share: &dyn Fn(f64) -> f64, is_default: bool| {
            let off: Vec<f64> = places.iter().zip(&exact).map(|(c, exact)| share(*c) - exact).collect();
            let us = cpu_us(stopwatch, || {
                places.iter().for_each(|c| {
                    std::hint::black_box(share(*c));
                });
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting,
                errors,
                cpu_us: us / n as f64,
                memory_kb: None,
                is_default,
            }));
        };
        add("discs in a plane".into(), &plane, true);
        for rings in RINGS {
            add(format!("{rings} rings"), &|c| by_rings(sun_rad, limb, c, rings), false);
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "points in a piece of air; rings of the disc",
        work: "one share of the Sun",
        error: "share of the Sun",
        reference: "72 points in a piece; 4000 rings of the disc on the sphere",
        default_because: "12 points leave 1e-8 of the Sun's light; without air the closed form in a plane is the \
                          quickest, and its few 1e-4 are far below what the air takes away",
        series,
    })
}
