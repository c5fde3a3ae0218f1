//! Extremes of where things stand: the Moon overhead and underfoot, the Sun on the horizon, phases 0 and 180, eclipses,
//! shadows of far orbits, the least of areas.
//!
//! Expected are closed forms, and the eclipses of the calendar.

use std::f64::consts::PI;

use hifitime::Epoch;

use super::light::{AREA, R_KM, V, fluxes, plate, scene, settings, white};
use super::{Extreme, absolute, holds, or_wrong, relative};
use crate::base::constants::{AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::brightness::light_sources::{SourceSettings, eclipse_factor, moon_v_mag, moonlight};
use crate::brightness::shadow::penumbra;
use crate::brightness::{Attitude, Brdf, ModelSettings, brightness, direct_reflection};
use crate::config::SourceDisc;
use crate::orbit::{EarthOrientation, bodies};

pub(super) fn cases() -> Vec<Extreme> {
    let mut all = vec![
        or_wrong(AREA, "Moon at the zenith of a plate", moon_overhead()),
        or_wrong(AREA, "Moon at the nadir", moon_underfoot()),
        or_wrong(AREA, "phase angle 180", satellite_before_the_sun()),
        or_wrong(AREA, "the least area", least_area()),
    ];
    all.extend(sun_on_the_horizon());
    all.extend(incidence());
    all.extend(far_shadow());
    all.extend(lunar_phases());
    all.extend(eclipses());
    all
}

/// E = E_moon ρ/π A (n·s)(n·o)/d², the Moon straight up, the plate tilted 30° towards it from the observer's horizontal.
fn moon_overhead() -> Result<Extreme> {
    let s = scene(R_KM + 420.0, 0.3, -60.0, 90.0);
    let to_observer = s.observer_km - s.satellite_km;
    let range_m = 1e3 * to_observer.norm();
    let o = to_observer * (1e3 / range_m);
    // half of it up, the rest level towards the observer
    let level = V::new(o.x(), o.y(), 0.0);
    let n = V::new(0.0, 0.0, 0.5) + level * (0.75f64.sqrt() / level.norm());
    let b = brightness(&s, &plate(10.0, Attitude::Fixed(n), Brdf::Lambert { albedo: 0.6 }), &settings(1e-6))?;
    let band = crate::brightness::Band::of_config("V")?;
    let light_sources = SourceSettings::new(&settings(1e-6).effects, &band)?;
    let light_source = moonlight(&s.satellite_km, &s.moon_km, &s.sun_km, &light_sources).flux;
    let expected = light_source * 0.6 / PI * 10.0 * n.z() * n.dot(&o) / (range_m * range_m);
    // the Moon's disc: a quarter of its radius squared
    Ok(relative(AREA, "Moon at the zenith: moonlight of a tilted plate", expected, b.moon.flux_ratio, 1e-5))
}

fn moon_underfoot() -> Result<Extreme> {
    let b = brightness(&scene(R_KM + 420.0, 0.3, -60.0, -90.0), &white(1.0), &settings(1e-6))?;
    let light = b.moon.flux_ratio + b.lunar_earthshine.flux_ratio;
    Ok(absolute(AREA, "Moon at the nadir, behind the Earth: moonlight of both ways", 0.0, light, 0.0))
}

fn satellite_before_the_sun() -> Result<Extreme> {
    let mut s = scene(R_KM + 550.0, 0.0, 0.0, 0.0);
    s.sun_km = V::new(0.0, 0.0, AU_KM);
    let b = brightness(&s, &white(1.0), &ModelSettings { moon: false, ..settings(1e-6) })?;
    Ok(holds(
        AREA,
        "phase angle 180: no sunlight from the lit back, some from the ground",
        "0 and more than 0",
        b.sun.flux_ratio == 0.0 && b.earthshine.flux_ratio > 0.0,
        format!("{:e} and {:.3e}", b.sun.flux_ratio, b.earthshine.flux_ratio),
    ))
}

/// Light is proportional to area, down to where numbers lose digits.
fn least_area() -> Result<Extreme> {
    let s = scene(R_KM + 550.0, 0.05, 40.0, 10.0);
    let of = |area_m2: f64| brightness(&s, &white(area_m2), &settings(1e-6)).map(|b| fluxes(&b).iter().sum::<f64>());
    Ok(relative(AREA, "a plate of 1e-280 m2 against one of 1 m2, per area", of(1.0)?, of(1e-280)? * 1e280, 1e-9))
}

/// The last sunlit ground goes over the horizon: the light falls to 0 without a jump, and none is made up beyond.
fn sun_on_the_horizon() -> Vec<Extreme> {
    let dip = (R_KM / (R_KM + 550.0)).acos().to_degrees();
    let light = |below_deg: f64| {
        let s = scene(R_KM + 550.0, 0.05, -dip - below_deg, -80.0);
        brightness(&s, &white(1.0), &settings(1e-6)).map(|b| b.earthshine.flux_ratio)
    };
    let day = light(-20.0);
    let share = |below_deg: f64| -> Result<f64> {
        Ok(light(below_deg)? / day.as_ref().map_err(|e| crate::Error::Model { problem: e.to_string() })?)
    };
    let mut all: Vec<Extreme> = [(1e-9, 0.0), (1e-3, 0.0)]
        .into_iter()
        .map(|(below_deg, limit)| {
            let case = format!("Earthshine, the Sun {below_deg:e} deg below the last ground in view");
            or_wrong(AREA, &case, share(below_deg).map(|s| absolute(AREA, &case, 0.0, s, limit)))
        })
        .collect();
    // light, area and slant of what is lit all go with the distance to the edge: below its fourth power's root
    for (above_deg, limit) in [(1e-6, 1e-12), (1e-2, 1e-5)] {
        let case = format!("Earthshine, the Sun {above_deg:e} deg above it, share of day");
        all.push(or_wrong(AREA, &case, share(-above_deg).map(|s| absolute(AREA, &case, 0.0, s, limit))));
    }
    all
}

/// Light that comes in at a grazing angle falls with its sine; from behind it is nothing.
fn incidence() -> Vec<Extreme> {
    let up = V::new(0.0, 0.0, 1.0);
    let law = Brdf::Lambert { albedo: 1.0 };
    let light = |sine: f64| {
        let light_source = V::new((1.0f64 - sine * sine).sqrt(), 0.0, sine);
        direct_reflection(&law, &light_source, &up, &up, 0.0, SourceDisc::Point)
    };
    let case = |sine: f64| format!("Lambert lit at {sine:e} rad of grazing [1/sr]");
    let mut all: Vec<Extreme> = [1e-3, 1e-9, 1e-300]
        .into_iter()
        .map(|sine| relative(AREA, case(sine), sine / PI, light(sine), 1e-12))
        .collect();
    all.push(absolute(AREA, "Lambert lit from 1e-12 rad behind [1/sr]", 0.0, light(-1e-12), 0.0));
    // half the Sun above the surface: the mean of cos over the half disc is 2/3 of its radius over π/2 …
    let sun_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let level = direct_reflection(&law, &V::new(1.0, 0.0, 0.0), &up, &up, sun_rad, SourceDisc::Convolved);
    all.push(relative(
        AREA,
        "Lambert, the Sun's centre in its plane [1/sr]",
        2.0 * sun_rad / (3.0 * PI * PI),
        level,
        1e-4,
    ));
    all
}

/// The geostationary orbit's shadow: half angle asin(R/r) = 8.7°, half a Sun to each side.
fn far_shadow() -> Vec<Extreme> {
    let r_km = 42_164.0;
    let half = (R_KM / r_km).asin();
    let sun_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let share = |off: f64| {
        let s = V::new(r_km * (half + off).cos(), r_km * (half + off).sin(), 0.0);
        penumbra(&s, &V::new(-AU_KM, 0.0, 0.0), SUN_RADIUS_KM, R_KM)
    };
    vec![
        absolute(AREA, "geostationary, 1.1 Suns inside the edge of the shadow", 0.0, share(-1.1 * sun_rad), 0.0),
        absolute(AREA, "geostationary, 1.1 Suns outside of it", 1.0, share(1.1 * sun_rad), 0.0),
        absolute(AREA, "geostationary, on the edge: share of the Sun", 0.5, share(0.0), 0.02),
    ]
}

fn lunar_phases() -> Vec<Extreme> {
    let v = |deg: f64| moon_v_mag(deg);
    let mut all = vec![
        absolute(AREA, "V of the Moon at phase 0", -12.73, v(0.0), 0.0),
        absolute(AREA, "V of the Moon at phase -90 against 90", v(90.0), v(-90.0), 0.0),
    ];
    let light_sources =
        crate::brightness::Band::of_config("V").and_then(|band| SourceSettings::new(&settings(1e-4).effects, &band));
    all.push(or_wrong(
        AREA,
        "the new Moon",
        light_sources.map(|light_sources| {
            let (new, beyond) = (light_sources.moonlight_at_phase(180.0), light_sources.moonlight_at_phase(540.0));
            let fine = new.flux == 0.0 && new.extrapolated && beyond == new;
            holds(
                AREA,
                "the new Moon: dark, reported as beyond its law, the same a turn later",
                "0, reported",
                fine,
                format!("{new:?}"),
            )
        }),
    ));
    all
}

/// The Moon's light in eclipses of the calendar (NASA, Five Millennium Catalog), and at a full Moon without one.
fn eclipses() -> Vec<Extreme> {
    let factor = |text: &str| -> Result<f64> {
        let wrong = |e: hifitime::HifitimeError| crate::Error::Orbit { problem: format!("{text}: {e}") };
        let at = Epoch::from_gregorian_str(text).map_err(wrong)?;
        let sky = bodies(&at, &EarthOrientation::default())?;
        Ok(eclipse_factor(&sky.moon_itrs_km, &sky.sun_itrs_km))
    };
    let mut all = Vec::new();
    for (text, total) in [
        ("2025-03-14T06:58:00 UTC", true),
        ("2025-09-07T18:12:00 UTC", true),
        ("2026-03-03T11:34:00 UTC", true),
        ("2025-06-11T07:44:00 UTC", false),
        ("2025-12-04T23:14:00 UTC", false),
    ] {
        let case = format!("full Moon of {}: {}", &text[..16], if total { "eclipsed" } else { "whole" });
        all.push(or_wrong(
            AREA,
            &case,
            factor(text).map(|f| {
                let (expected, fine) =
                    if total { ("below 0.01 of its light", f < 0.01) } else { ("all its light", f == 1.0) };
                holds(AREA, &case, expected, fine, format!("{f:.2e}"))
            }),
        ));
    }
    all
}
