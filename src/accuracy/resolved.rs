//! The picture of a resolved satellite: error of the light of the whole of it, and the cost, by pixels, samples, rays, the
//! Earth's integral and sides.
//!
//! The ISS 45° from nadir: by day, and at full Moon in the Earth's shadow. All light, and every light with a share above
//! 1 %, is a case.

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, timed};
use crate::base::error::Result;
use crate::base::vector::Vector;
use crate::brightness::{ModelSettings, Scene};
use crate::resolved::{ComponentSatellite, RenderSettings, Renderer, ResolvedScene};

const AU_KM: f64 = crate::base::constants::AU_KM;
/// Lights of a smaller share of a picture are no case of their own.
const LEAST_SHARE: f64 = 0.01;

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

/// Irradiances by light, of each scene.
fn irradiances(satellite: &ComponentSatellite, settings: &RenderSettings) -> Result<Vec<Vec<f64>>> {
    let of = |scene| {
        let rendered = Renderer::new(&ResolvedScene { satellite: satellite.clone(), scene }, settings)?.picture();
        Ok(rendered.image.planes.iter().map(|(light, _)| rendered.image.irradiance_w_m2(*light)).collect())
    };
    scenes().map(of).into_iter().collect()
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let iss = ComponentSatellite::named("iss")?;
    let usual = RenderSettings::default();
    let effort = stopwatch.effort;
    let with = |pixels: usize, samples: usize, earth_rays: usize| RenderSettings {
        pixels,
        samples,
        earth_rays,
        ..usual.clone()
    };
    // each knob against its own finest value, the others as they are: the errors are of that knob alone
    let mut series = Vec::new();
    let mut add = |label: &str, finest: RenderSettings, settings: Vec<(String, RenderSettings, bool)>| -> Result<()> {
        let points = points(stopwatch, &iss, &finest, settings)?;
        series.push(Series { label: label.into(), points });
        Ok(())
    };
    let sizes: &[usize] = effort.of(&[32, 128, 512], &[32, 64, 128, 256, 512]);
    let sizes = sizes.iter().map(|n| (n.to_string(), with(*n, 2, 16), *n == usual.pixels)).collect();
    add("pixels a side, 2 x 2 samples", with(effort.of(512, 1024), 4, 16), sizes)?;
    let coarse = effort.of(64, 256);
    let samples = [1, 2, 3, 4, 6].map(|n| (n.to_string(), with(coarse, n, 16), n == usual.samples)).to_vec();
    add("samples along a side of a pixel", with(coarse, 12, 16), samples)?;
    let rays = [1, 4, 16, 64].map(|n| (n.to_string(), with(coarse, 2, n), n == usual.earth_rays)).to_vec();
    add("rays to Earth and sky a sample", with(coarse, 2, 256), rays)?;
    let integral = |tolerance: f64| RenderSettings {
        model: ModelSettings { tolerance, ..usual.model.clone() },
        ..with(coarse, 2, 16)
    };
    let tolerances =
        [1e-1, 1e-2, 1e-3, 1e-4, 1e-6].map(|t| (format!("{t:.0e}"), integral(t), t == usual.model.tolerance)).to_vec();
    add("tolerance of the Earth's integral", integral(1e-9), tolerances)?;
    let sides = |n: usize| RenderSettings { sides: n, ..with(coarse, 2, 16) };
    let turned = [8, 16, 32, 64, 128].map(|n| (n.to_string(), sides(n), n == usual.sides)).to_vec();
    add("sides of a cylinder", sides(512), turned)?;
    Ok(Sweep {
        knob: "setting",
        work: "one picture",
        error: "relative",
        reference: "the finest value of the knob, the others unchanged",
        default_because: "512 pixels show half-metre parts of the ISS; half of the lights are good to 1e-4, the faintest to 5e-3",
        series,
    })
}

/// Errors and costs of pictures against one of `finest`.
fn points(
    stopwatch: &Stopwatch,
    satellite: &ComponentSatellite,
    finest: &RenderSettings,
    settings: Vec<(String, RenderSettings, bool)>,
) -> Result<Vec<SweepPoint>> {
    let truth = irradiances(satellite, finest)?;
    let mut points = Vec::new();
    for (setting, settings, is_default) in settings {
        let (found, time) = timed(stopwatch, || irradiances(satellite, &settings))?;
        let cpu_us = time / truth.len() as f64;
        let mut off = Vec::new();
        for (truth, found) in truth.iter().zip(found) {
            let total: f64 = truth.iter().sum();
            let counts = truth.iter().zip(&found).filter(|(t, _)| **t > LEAST_SHARE * total);
            off.extend(counts.map(|(t, f)| f / t - 1.0));
            off.push(found.iter().sum::<f64>() / total - 1.0);
        }
        let memory_kb = Some(5.0 * 8.0 * (settings.pixels * settings.pixels) as f64 / 1024.0);
        points.extend(Errors::of(&off).map(|errors| SweepPoint { setting, errors, cpu_us, memory_kb, is_default }));
    }
    Ok(points)
}
