//! Where Sun and Moon stand: error of the predicted magnitude and cost, by ephemeris.
//!
//! Starlink V1.5 at 550 km over random places in 2025. Errors in magnitudes of all lights together. The reference is the
//! ephemeris satphot uses (ERFA epv00 and moon98, of date), itself within 0.01″ and 9.8″ of DE421.

use hifitime::{Duration, Epoch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::AU_KM;
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::{Model, ModelSettings, Satellite, Scene};
use crate::orbit::earth::sidereal_rad;
use crate::orbit::time::tt;
use crate::orbit::{EarthOrientation, SkyBodies, bodies};

const SATELLITE: &str = "starlink-v1.5-lab";
const HEIGHT_KM: f64 = 550.0;

/// Sun and Moon by the formulae of the Astronomical Almanac, page C24 and D46: 0.01° and 0.3° by their own account.
pub(super) fn almanac(epoch: &Epoch) -> SkyBodies {
    let (t1, t2) = tt(epoch);
    let days = (t1 - 2_451_545.0) + t2;
    let centuries = days / 36_525.0;
    let wave = |at_0: f64, per_century: f64| (at_0 + per_century * centuries).to_radians();
    let g = (357.528 + 0.985_600_3 * days).to_radians();
    let sun_lon = (280.460 + 0.985_647_4 * days + 1.915 * g.sin() + 0.020 * (2.0 * g).sin()).to_radians();
    let sun_km = AU_KM * (1.000_14 - 0.016_71 * g.cos() - 0.000_14 * (2.0 * g).cos());
    let lon_deg = 218.32 + 481_267.881 * centuries + 6.29 * wave(135.0, 477_198.87).sin()
        - 1.27 * wave(259.3, -413_335.36).sin()
        + 0.66 * wave(235.7, 890_534.22).sin()
        + 0.21 * wave(269.9, 954_397.74).sin()
        - 0.19 * wave(357.5, 35_999.05).sin()
        - 0.11 * wave(186.5, 966_404.03).sin();
    let lat_deg = 5.13 * wave(93.3, 483_202.02).sin() + 0.28 * wave(228.2, 960_400.89).sin()
        - 0.28 * wave(318.3, 6_003.15).sin()
        - 0.17 * wave(217.6, -407_332.21).sin();
    let parallax_deg = 0.9508
        + 0.0518 * wave(135.0, 477_198.87).cos()
        + 0.0095 * wave(259.3, -413_335.36).cos()
        + 0.0078 * wave(235.7, 890_534.22).cos()
        + 0.0028 * wave(269.9, 954_397.74).cos();
    let obliquity = (23.439 - 0.000_000_4 * days).to_radians();
    let turn = sidereal_rad(epoch, &EarthOrientation::default());
    let fixed = |lon: f64, lat: f64, distance_km: f64| -> Vector<Itrs> {
        let (x, y, z) = (lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
        let (y, z) = (y * obliquity.cos() - z * obliquity.sin(), y * obliquity.sin() + z * obliquity.cos());
        let (s, c) = turn.sin_cos();
        Vector::new(c * x + s * y, c * y - s * x, z) * distance_km
    };
    SkyBodies {
        sun_itrs_km: fixed(sun_lon, 0.0, sun_km),
        moon_itrs_km: fixed(lon_deg.to_radians(), lat_deg.to_radians(), 6_378.14 / parallax_deg.to_radians().sin()),
    }
}

/// A moment, and a satellite above an observer in it.
struct Case {
    epoch: Epoch,
    satellite_km: Vector<Itrs>,
    observer_km: Vector<Itrs>,
}

fn scene(case: &Case, sky: &SkyBodies) -> Scene {
    let up = case.satellite_km * (1.0 / case.satellite_km.norm());
    let east = Vector::new(-up.y(), up.x(), 0.0);
    Scene {
        satellite_km: case.satellite_km,
        velocity_km_s: east * (7.6 / east.norm().max(1e-9)),
        observer_km: case.observer_km,
        sun_km: sky.sun_itrs_km,
        moon_km: sky.moon_itrs_km,
        sidereal_rad: 0.0,
    }
}

fn case(rng: &mut ChaCha12Rng) -> Case {
    let radius_km = 6_371.0;
    let (z, lon): (f64, f64) = (rng.random_range(-0.9..0.9), rng.random_range(0.0..std::f64::consts::TAU));
    let level = (1.0 - z * z).sqrt();
    let up = Vector::new(level * lon.cos(), level * lon.sin(), z);
    let aside = Vector::new(rng.random_range(-0.2..0.2), rng.random_range(-0.2..0.2), rng.random_range(-0.2..0.2));
    let seen = (up + aside).unit().unwrap_or(up);
    Case {
        epoch: Epoch::from_mjd_utc(60_676.0) + Duration::from_days(rng.random_range(0.0..365.0)),
        satellite_km: seen * (radius_km + HEIGHT_KM),
        observer_km: up * radius_km,
    }
}

/// An ephemeris.
type Ephemeris = fn(&Epoch) -> Result<SkyBodies>;

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    const ERFA: &str = "ERFA epv00, moon98";
    let satellite = Satellite::named(SATELLITE)
        .ok_or_else(|| Error::Model { problem: format!("{SATELLITE} is not in the list of satellites") })?;
    let settings = ModelSettings { earth_radius_km: Some(6_371.0), ..ModelSettings::default() };
    let model = Model::new(&satellite, &settings)?;
    let ways: [(&str, Ephemeris); 4] = [
        (ERFA, |e| bodies(e, &EarthOrientation::default())),
        ("Almanac formulae", |e| Ok(almanac(e))),
        ("one minute old", |e| bodies(&(*e - Duration::from_seconds(60.0)), &EarthOrientation::default())),
        ("ten minutes old", |e| bodies(&(*e - Duration::from_seconds(600.0)), &EarthOrientation::default())),
    ];
    let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(25));
    let n = stopwatch.effort.of(60, 2000);
    let mut groups: [(&str, Vec<(Case, f64)>); 2] =
        [("in sunlight", Vec::new()), ("by Moon and Earth alone", Vec::new())];
    for _ in 0..20 * n {
        let case = case(&mut rng);
        let b = model.brightness(&scene(&case, &bodies(&case.epoch, &EarthOrientation::default())?))?;
        let group = usize::from(b.sun_visible_frac <= 0.0);
        // fainter than that nothing is seen of a satellite
        if let Some(v) = b.total_v_mag.filter(|v| *v < 25.0 && groups[group].1.len() < n) {
            groups[group].1.push((case, v));
        }
    }
    let mut series = Vec::new();
    for (label, cases) in groups {
        let mut points = Vec::new();
        for (setting, way) in ways {
            let mut off = Vec::new();
            for (case, v) in &cases {
                let got = model.brightness(&scene(case, &way(&case.epoch)?))?.total_v_mag;
                off.push(got.map_or(f64::INFINITY, |got| got - v));
            }
            let us = cpu_us(stopwatch, || {
                cases.iter().for_each(|(case, _)| {
                    std::hint::black_box(way(&case.epoch).is_ok());
                });
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: setting.into(),
                errors,
                cpu_us: us / cases.len().max(1) as f64,
                memory_kb: None,
                is_default: setting == ERFA,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "ephemeris",
        work: "Sun and Moon at one moment",
        error: "mag",
        reference: "ERFA epv00 and moon98 at the moment",
        default_because: "the formulae are off by 0.03 mag where a panel glints; the better ephemeris costs about as much as the \
                          lights it is for",
        series,
    })
}
