//! The picture of a resolved satellite: error of the light of the whole of it, and the cost, by pixels, rays and sides.
//!
//! The ISS 45° from nadir: by day, and at full Moon in the Earth's shadow. Every light with a share above 0.1 % is a case.
//! The reference has more of everything; what it has too little of itself (`sides`) is its own series.

use super::Stopwatch;
use super::sweep::{Errors, Point, Series, Sweep};
use crate::brightness::Scene;
use crate::error::Result;
use crate::resolved::{ComponentSatellite, RenderSettings, Renderer, ResolvedScene};
use crate::vector::Vector;

const AU_KM: f64 = crate::constants::AU_KM;

/// By day, and at full Moon at night.
fn scenes() -> [Scene; 2] {
    let night = Scene {
        satellite_km: Vector::new(6790.0, 0.0, 0.0),
        velocity_km_s: Vector::new(0.0, 4.7, 6.0),
        observer_km: Vector::new(6371.0 * 0.9976, 6371.0 * 0.05, 6371.0 * 0.0479),
        sun_km: Vector::new(-0.80, 0.55, 0.24) * AU_KM,
        moon_km: Vector::new(0.76, -0.60, -0.25) * 390_000.0,
        sidereal_rad: 0.0,
    };
    let day = Scene { sun_km: Vector::new(0.62, -0.68, 0.39) * AU_KM, ..night };
    [day, night]
}

/// Irradiances by light.
fn irradiances(satellite: &ComponentSatellite, settings: &RenderSettings) -> Result<Vec<f64>> {
    let mut all = Vec::new();
    for scene in scenes() {
        let rendered = Renderer::new(&ResolvedScene { satellite: satellite.clone(), scene }, settings)?.picture();
        all.extend(rendered.image.planes.iter().map(|(l, _)| rendered.image.irradiance_w_m2(*l)));
    }
    Ok(all)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let iss = ComponentSatellite::named("iss")?;
    let usual = RenderSettings::default();
    let effort = stopwatch.effort;
    let finest = RenderSettings {
        pixels: effort.of(192, 1024),
        samples: effort.of(3, 4),
        earth_rays: effort.of(16, 64),
        ..usual.clone()
    };
    let mut knobs: Vec<(&str, RenderSettings, Vec<(String, RenderSettings, bool)>)> = Vec::new();
    let with = |pixels: usize, samples: usize, rays: usize| RenderSettings {
        pixels,
        samples,
        earth_rays: rays,
        ..usual.clone()
    };
    let sizes: &[usize] = effort.of(&[32, 64, 128], &[32, 64, 128, 256, 512]);
    let pixels = sizes.iter().map(|n| (n.to_string(), with(*n, 2, 16), *n == usual.pixels)).collect();
    knobs.push(("pixels a side, 2 x 2 samples", finest.clone(), pixels));
    let rays = [1, 4, 16, 64]
        .iter()
        .map(|n| (n.to_string(), with(effort.of(64, 128), 2, *n), *n == usual.earth_rays))
        .collect();
    knobs.push(("rays to the Earth a sample", finest.clone(), rays));
    let sides = |n: usize| RenderSettings { sides: n, ..with(effort.of(64, 256), 2, 16) };
    let turned = [8, 16, 32, 64, 128].iter().map(|n| (n.to_string(), sides(*n), *n == usual.sides)).collect();
    knobs.push(("sides of a cylinder", sides(256), turned));
    let mut series = Vec::new();
    for (label, reference, settings) in knobs {
        let truth = irradiances(&iss, &reference)?;
        let brightest =
            [0, 1].map(|k| truth[k * truth.len() / 2..(k + 1) * truth.len() / 2].iter().copied().fold(0.0, f64::max));
        let mut points = Vec::new();
        for (setting, settings, is_default) in settings {
            let before = (stopwatch.cpu_s)();
            let found = irradiances(&iss, &settings)?;
            let cpu_us = 1e6 * ((stopwatch.cpu_s)() - before) / 2.0;
            let counts = |k: usize| truth[k] > 1e-3 * brightest[usize::from(k >= truth.len() / 2)];
            let off: Vec<f64> = (0..truth.len()).filter(|k| counts(*k)).map(|k| found[k] / truth[k] - 1.0).collect();
            let memory_kb = Some(5.0 * 8.0 * (settings.pixels * settings.pixels) as f64 / 1024.0);
            points.extend(Errors::of(&off).map(|errors| Point { setting, errors, cpu_us, memory_kb, is_default }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "setting",
        work: "one picture",
        error: "relative",
        reference: "more pixels, samples and rays of the same",
        default_because: "512 pixels show half-metre parts of the ISS; its light is good to 1e-3 with far fewer",
        series,
    })
}
