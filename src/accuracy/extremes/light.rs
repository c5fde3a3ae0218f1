//! Extremes of the brightness engine: narrow lobes, mirrors, grazing angles, the edges of shadows, large platforms.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{Extreme, absolute, holds, or_wrong, refused, relative};
use crate::base::constants::{AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::light_sources::{MOON_MEAN_DISTANCE_KM, eclipse_factor};
use crate::brightness::shadow::visible_fraction;
use crate::brightness::{
    Accuracy, Attitude, Brdf, Brightness, Ground, ModelSettings, Satellite, Scene, Surface, brightness,
    direct_reflection, reflected_by_earth,
};
use crate::config::{Mode, PlatformSize, SourceDisc};

pub(super) const AREA: &str = "light";
pub(super) const R_KM: f64 = 6378.0;

pub(super) type V = Vector<Itrs>;

/// Satellite on the z axis at `r_km`; observer `off_rad` away on the ground; Sun and Moon at elevations there.
pub(super) fn scene(r_km: f64, off_rad: f64, sun_deg: f64, moon_deg: f64) -> Scene {
    let toward = |deg: f64| V::new(0.0, deg.to_radians().cos(), deg.to_radians().sin());
    Scene {
        satellite_km: V::new(0.0, 0.0, r_km),
        velocity_km_s: V::new(7.6, 0.0, 0.0),
        observer_km: V::new(off_rad.sin() * 0.6, off_rad.sin() * 0.8, off_rad.cos()) * R_KM,
        sun_km: toward(sun_deg) * AU_KM,
        moon_km: toward(moon_deg) * MOON_MEAN_DISTANCE_KM,
        sidereal_rad: 0.0,
    }
}

pub(super) fn settings(tolerance: f64) -> ModelSettings {
    ModelSettings { earth_radius_km: Some(R_KM), ..ModelSettings::new(Mode::Corrected, tolerance) }
}

pub(super) fn plate(area_m2: f64, attitude: Attitude, brdf: Brdf) -> Satellite {
    Satellite::of("plate", vec![Surface { name: "plate".into(), area_m2, attitude, brdf, back: None }])
}

pub(super) fn white(area_m2: f64) -> Satellite {
    plate(area_m2, Attitude::Nadir, Brdf::Lambert { albedo: 1.0 })
}

pub(super) fn fluxes(b: &Brightness) -> [f64; 4] {
    [b.sun, b.earthshine, b.moon, b.lunar_earthshine].map(|l| l.flux_ratio)
}

/// Every light is a number, none negative, and a magnitude exists where there is light.
fn sound(case: &str, result: Result<Brightness>) -> Extreme {
    or_wrong(
        AREA,
        case,
        result.map(|b| {
            let fine = fluxes(&b).iter().all(|f| *f >= 0.0 && f.is_finite()) && b.err_mag.is_finite();
            let has_total = b.total_v_mag.is_some() == (fluxes(&b).iter().sum::<f64>() > 0.0);
            let got = b.total_v_mag.map_or("no light".to_string(), |v| format!("V {v:.3} +- {:.1e}", b.err_mag));
            holds(AREA, case, "four lights, none negative, none a NaN", fine && has_total, got)
        }),
    )
}

pub(super) fn cases() -> Vec<Extreme> {
    let mut all = Vec::new();
    all.extend(narrow_lobes());
    all.extend(earth_lobes());
    all.extend(limb_glint());
    all.extend(shadows());
    all.push(or_wrong(AREA, "4 km platform 300 km up", platform()));
    all.extend(geometry());
    all
}

/// At normal incidence the mean of cosⁿ over the Sun's disc has a closed form.
fn narrow_lobes() -> Vec<Extreme> {
    let sun_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let up = V::new(0.0, 0.0, 1.0);
    let versine = 2.0 * (0.5 * sun_rad).sin().powi(2);
    let mean = |brdf: &Brdf| direct_reflection(brdf, &up, &up, &up, sun_rad, SourceDisc::Convolved);
    let mut all: Vec<Extreme> = [1e1, 1e3, 1e5, 1e6, 1e8]
        .into_iter()
        .map(|n| {
            // (n+2)/2π ∫ cosⁿ⁺¹ dω / Ω = (1 − cosⁿ⁺²α)/Ω
            let expected = -((n + 2.0) * (-versine).ln_1p()).exp_m1() / (TAU * versine);
            let got = mean(&Brdf::Phong { kd: 0.0, ks: 1.0, n });
            relative(AREA, format!("Phong n = {n:e} over the Sun's disc, head on [1/sr]"), expected, got, 1e-8)
        })
        .collect();
    let mirror = Brdf::Mirror { reflectance: 0.96 };
    all.push(relative(AREA, "mirror, Sun in it: radiance [1/sr]", 0.96 / (TAU * versine), mean(&mirror), 1e-12));
    let outside = V::new((2.0 * sun_rad).sin(), 0.0, (2.0 * sun_rad).cos());
    let off = direct_reflection(&mirror, &up, &up, &outside, sun_rad, SourceDisc::Convolved);
    all.push(absolute(AREA, "mirror, Sun outside its cone [1/sr]", 0.0, off, 0.0));
    for eps in [1e-6, 1e-12, 1e-300] {
        // the part of a Lambert plate's light that goes out at a grazing angle falls with the angle
        let seen = V::new((1.0f64 - eps * eps).sqrt(), 0.0, eps);
        let got = direct_reflection(&Brdf::Lambert { albedo: 1.0 }, &up, &up, &seen, 0.0, SourceDisc::Point);
        all.push(relative(AREA, format!("Lambert seen at {eps:e} rad of grazing [1/sr]"), 1.0 / PI, got, 1e-12));
    }
    all
}

/// A lobe of light from the ground becomes a mirror's as it narrows.
fn earth_lobes() -> Vec<Extreme> {
    let satellite = V::new(0.0, 0.0, R_KM + 550.0);
    let light_source = V::new(0.0, 30f64.to_radians().cos(), 0.5);
    let albedo = 0.3;
    let (Some(ground), Some(observer), Some(normal)) = (
        Ground::new(&satellite, R_KM, &light_source, &Brdf::Lambert { albedo }),
        V::new(0.5, 0.2, -0.8).unit(),
        V::new(0.1, 0.1, -1.0).unit(),
    ) else {
        return vec![holds(AREA, "narrow lobes of Earthshine", "lit ground in view", false, "none")];
    };
    let m = normal * (2.0 * normal.dot(&observer)) - observer;
    let b = satellite.dot(&m);
    let to_ground = -b - (b * b - satellite.dot(&satellite) + R_KM * R_KM).sqrt();
    let lit = (satellite + m * to_ground).unit().map_or(f64::NAN, |p| p.dot(&light_source));
    let mirror = albedo / PI * lit * normal.dot(&observer);
    // the lobe's width leaves about 20/n
    [1e3, 1e4, 1e6, 1e8]
        .into_iter()
        .map(|n| {
            let law = Brdf::Phong { kd: 0.0, ks: 1.0, n };
            let got = reflected_by_earth(&ground, &law, &normal, &observer, &Accuracy::relative(1e-9, 4_000_000));
            let case = format!("Earthshine in a lobe of n = {n:e} against a mirror [1/sr]");
            relative(AREA, case, mirror, got.per_sr, 20.0 / n + 1e-8)
        })
        .collect()
}

/// An ABG law of B = 1e-11 whose mirror direction meets the limb of the Earth, the Sun on the horizon (E = 0), under a
/// ground that glints with n = 200 just there: every break of the integral at one place, over eleven decades. Rings do not resolve
/// it; polar coordinates about the mirror direction do.
fn limb_glint() -> Vec<Extreme> {
    // scripts/make_limb_glint.py: rings about the lobe in the plane of the surface agree with rays on the sphere to 2e-11
    const FLUX: f64 = 3.702_767_934_87e-15;
    const HEIGHT_KM: f64 = 550.0;
    let satellite = V::new(0.0, 0.0, R_KM + HEIGHT_KM);
    let place = V::new(485.836_362_313_007_94, 1_262.475_127_598_478, 6_232.896_885_177_042);
    let normal = V::new(0.161_885_966_705_004_24, 0.873_604_149_324_861_1, -0.458_921_261_292_579_65);
    let law = Brdf::Abg { a: 1e-3, b: 1e-11, g: 1.5 };
    let earth = Brdf::Phong { kd: 0.0, ks: 0.5, n: 200.0 };
    let line = place - satellite;
    let (Some(ground), Some(observer), Some(normal)) =
        (Ground::new(&satellite, R_KM, &V::new(0.0, 1.0, 0.0), &earth), line.unit(), normal.unit())
    else {
        return vec![holds(AREA, "a lobe on the limb", "lit ground in view", false, "none")];
    };
    let spread = normal.dot(&observer) / (1e3 * line.norm()).powi(2);
    [1e-4, 1e-9]
        .into_iter()
        .map(|tolerance| {
            let got = reflected_by_earth(&ground, &law, &normal, &observer, &Accuracy::relative(tolerance, 1_000_000));
            let case = format!("ABG B = 1e-11 on a glinting limb (n = 200), E = 0, tolerance {tolerance:e}");
            relative(AREA, case, FLUX, spread * got.per_sr, tolerance)
        })
        .collect()
}

fn shadows() -> Vec<Extreme> {
    let (sun, earth) = ((SUN_RADIUS_KM / AU_KM).asin(), 69.743_727_418_533_2f64.to_radians());
    let mut all = vec![
        absolute(
            AREA,
            "penumbra, first contact: share of the Sun",
            1.0,
            visible_fraction(sun, earth, earth + sun),
            0.0,
        ),
        absolute(
            AREA,
            "penumbra, a hair inside first contact",
            1.0,
            visible_fraction(sun, earth, earth + sun * (1.0 - 1e-9)),
            1e-12,
        ),
        absolute(AREA, "penumbra, last contact", 0.0, visible_fraction(sun, earth, earth - sun), 0.0),
        absolute(
            AREA,
            "penumbra, centre of the Sun on the limb",
            0.500_405_363_585_874_6,
            visible_fraction(sun, earth, earth),
            1e-6,
        ),
        absolute(
            AREA,
            "ring of the Sun beyond the umbra: 1 - (b/a)^2",
            0.437_218_644_496_082_7,
            visible_fraction(0.2666f64.to_radians(), 0.2f64.to_radians(), 0.01f64.to_radians()),
            1e-9,
        ),
    ];
    let sun_km = V::new(AU_KM, 0.0, 0.0);
    let full = eclipse_factor(&V::new(-MOON_MEAN_DISTANCE_KM, 0.0, 0.0), &sun_km);
    all.push(holds(
        AREA,
        "Moon in the middle of the Earth's shadow",
        "less than 1e-3 of its light",
        full < 1e-3,
        format!("{full:.1e}"),
    ));
    let outside = eclipse_factor(&V::new(-MOON_MEAN_DISTANCE_KM, 0.05 * MOON_MEAN_DISTANCE_KM, 0.0), &sun_km);
    all.push(absolute(AREA, "Moon 3 deg outside the shadow: share of its light", 1.0, outside, 0.0));
    all
}

/// 4 km of plate 300 km above the ground against 64 × 64 plates of their own.
fn platform() -> Result<Extreme> {
    let s = scene(R_KM + 300.0, 0.02, 35.0, 20.0);
    let law = Brdf::Phong { kd: 0.3, ks: 0.3, n: 8.9 };
    let with = |size: PlatformSize, tolerance: f64| {
        let mut settings = ModelSettings { moon: false, ..settings(tolerance) };
        settings.effects.platform_size = size;
        settings
    };
    let whole = brightness(&s, &plate(16e6, Attitude::Nadir, law.clone()), &with(PlatformSize::Subdivided, 1e-6))?;
    let pieces = 24;
    let down = Attitude::Fixed(V::new(0.0, 0.0, -1.0));
    let piece = plate(16e6 / f64::from(pieces * pieces), down, law);
    let mut sum = 0.0;
    for i in 0..pieces {
        for j in 0..pieces {
            let along = |k: i32| (f64::from(k) + 0.5 - 0.5 * f64::from(pieces)) * 4.0 / f64::from(pieces);
            let part = Scene { satellite_km: s.satellite_km + V::new(along(i), along(j), 0.0), ..s };
            sum += brightness(&part, &piece, &with(PlatformSize::Point, 1e-4))?.earthshine.flux_ratio;
        }
    }
    Ok(relative(AREA, "4 km platform 300 km up against its pieces", sum, whole.earthshine.flux_ratio, 5e-4))
}

fn geometry() -> Vec<Extreme> {
    let any = settings(1e-4);
    let mut all = Vec::new();
    for (name, moon_deg) in [("zenith", 90.0), ("nadir", -90.0)] {
        let case = format!("Moon at the {name} of the satellite");
        all.push(sound(&case, brightness(&scene(R_KM + 420.0, 0.05, -60.0, moon_deg), &white(1.0), &any)));
    }
    for (name, sun_deg) in [("zenith", 90.0), ("nadir", -90.0), ("horizon", 0.0)] {
        let case = format!("Sun at the {name} of the satellite");
        all.push(sound(&case, brightness(&scene(R_KM + 420.0, 0.05, sun_deg, 10.0), &white(1.0), &any)));
    }
    for (name, r_km) in
        [("300 km up", R_KM + 300.0), ("geostationary", 42_164.0), ("at the Moon's distance", 384_400.0)]
    {
        all.push(sound(&format!("a plate {name}"), brightness(&scene(r_km, 0.01, 20.0, -20.0), &white(1.0), &any)));
    }
    let dark = scene(R_KM + 420.0, 0.05, -89.0, -89.0);
    all.push(or_wrong(
        AREA,
        "Sun and Moon far down",
        brightness(&dark, &white(1.0), &any).map(|b| {
            let got = b.total_v_mag.map_or("no magnitude".to_string(), |v| format!("V {v}"));
            holds(AREA, "Sun and Moon far down", "no magnitude, no number in its place", b.total_v_mag.is_none(), got)
        }),
    ));
    // full and new: Sun behind the observer, Sun behind the satellite
    let mut full = scene(R_KM + 550.0, 0.0, -FRAC_PI_2.to_degrees(), 0.0);
    all.push(sound("phase angle 0: the Sun under the observer's feet", brightness(&full, &white(1.0), &any)));
    full.sun_km = V::new(0.0, 0.0, AU_KM);
    all.push(sound("phase angle 180: the satellite before the Sun", brightness(&full, &white(1.0), &any)));
    // lights over ten decades
    let s = scene(R_KM + 420.0, 0.05, 60.0, 40.0);
    let alone = |sun: bool, moon: bool| brightness(&s, &white(1.0), &ModelSettings { sun, moon, ..settings(1e-6) });
    all.push(or_wrong(
        AREA,
        "lights of Sun and Moon together",
        (|| {
            let (both, sun, moon) =
                (fluxes(&alone(true, true)?), fluxes(&alone(true, false)?), fluxes(&alone(false, true)?));
            let sum: f64 = (0..4).map(|k| sun[k] + moon[k]).sum();
            Ok(relative(AREA, "four lights over six decades: the sum of each alone", sum, both.iter().sum(), 1e-15))
        })(),
    ));
    all.push(refused(
        AREA,
        "satellite under the ground",
        "below the surface",
        brightness(&scene(R_KM - 10.0, 0.02, 30.0, 0.0), &white(1.0), &any),
    ));
    all.push(refused(AREA, "a plate of no area", "area", brightness(&s, &white(0.0), &any)));
    all
}
