//! The figures of the paper that can be computed: the four lights, one target under three lights, a pass over the sky,
//! skies of two days, the moonlit Earth, and the resolved station.
//!
//! Each is drawn from the model as published and as corrected, in the same colours for the same numbers. Observations are
//! not public and in none of them. For the resolved station *as published* means the uniform radiance of the Earth that
//! the published simulation was given.

use std::path::{Path, PathBuf};

use hifitime::Epoch;
use ndarray::Array2;

use super::context::{Context, settings};
use super::resolved_case::PASS_UTC;
use crate::base::error::Result;
use crate::base::file::make_folder;
use crate::base::progress::Progress;
use crate::base::time::{iso_utc, parse_utc, shifted};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::Band;
use crate::brightness::brdf::{Brdf, EARTH_VEGETATION};
use crate::brightness::earth_view::{EarthLightSource, EarthPicture, Viewpoint, earth_picture};
use crate::brightness::light_sources::{SourceSettings, mag_of_flux};
use crate::brightness::scene::local_radius_km;
use crate::brightness::sky::{Sky, SkyGrid, sky_map};
use crate::brightness::spectrum::{SolarColumn, Spectrum};
use crate::brightness::{ModelSettings, ToleranceOf};
use crate::config::{EarthRadius, Effects, Mode};
use crate::figures::{
    EarthMark, ModelSky, Picture, PictureRow, SkyMark, SkyPanel, earth, four_lights, model_sky, pictures,
    sky_sequence_on,
};
use crate::orbit::ground_track::{point_under, terminator};
use crate::orbit::{EarthOrientation, bodies};
use crate::resolved::sensor::{Sensor, SensorSettings};
use crate::resolved::settings::PAPER_EARTH_W_CM2_SR_UM;
use crate::resolved::{ComponentSatellite, Light, RadianceImage, RenderSettings, Rendered, Renderer, ResolvedScene};
use crate::tables::SkyRow;
use crate::visibility::forecast::dome::Overhead;
use crate::visibility::forecast::{Window, moments, predict, sky_rows, visible};

/// Both readings, with what figures call them.
const MODES: [(Mode, &str); 2] = [(Mode::AsPublished, "as published"), (Mode::Corrected, "corrected")];
/// Height of the orbits of a sky \[km\], and its altitudes and azimuths.
const HEIGHT_KM: f64 = 420.0;
const GRID: (usize, usize) = (31, 73);
/// Radius of the Earth where a reading has one for all places \[km\].
const RADIUS_KM: f64 = 6378.0;
/// The pass of figure 7, and the days of figure 8.
const PASS: (&str, f64) = ("2025-06-09T10:27:00", 720.0);
const DAYS: [&str; 2] = ["2025-06-11T04:00:00", "2025-06-18T04:00:00"];
const EVERY_H: f64 = 4.0;
/// The station by day, in twilight and at night.
const THREE_LIGHTS: [(&str, &str); 3] =
    [("2025-06-18T06:29:45", "by day"), ("2025-06-11T08:54:00", "twilight"), (PASS_UTC, "night")];
/// Pixels along a side of a picture, and exposure time of the sensor's \[s\].
const PIXELS: usize = 300;
const EXPTIME_S: f64 = 30.0;
/// Band of the radiances \[nm\], and that in which the Moon's colour is known there.
const WIDE_NM: (f64, f64) = (300.0, 1050.0);
const MOON_NM: (f64, f64) = (350.0, 1050.0);
/// The geostationary satellite that sees the Earth: longitude, latitude \[deg\], height \[km\].
const GEOSTATIONARY: (f64, f64, f64) = (140.7, 0.0, 35_786.0);

/// Draws every figure into a folder; returns the paths.
///
/// # Errors
/// Those of the model and of the renderer, and [`crate::Error::Io`].
pub fn write_figures(folder: &Path, progress: &dyn Progress) -> Result<Vec<PathBuf>> {
    make_folder(folder)?;
    let context = Context::new()?;
    let mut paths = Vec::new();
    let mut add = |name: &str| -> PathBuf {
        paths.push(folder.join(name));
        folder.join(name)
    };
    progress.stage("figures", 6);
    four_lights(&add("four_lights.svg"))?;
    progress.tick();
    one_target_under_three_lights(&add("three_lights.svg"), &context)?;
    progress.tick();
    pass_and_sky(&add("pass_and_sky.svg"), &context)?;
    progress.tick();
    skies_of_two_days([&add("skies_as_published.svg"), &add("skies_corrected.svg")], &context)?;
    progress.tick();
    moonlit_earth([&add("earth_as_published.svg"), &add("earth_corrected.svg")])?;
    progress.tick();
    resolved_station([&add("resolved_as_published.svg"), &add("resolved_corrected.svg")], &context)?;
    progress.tick();
    progress.done();
    Ok(paths)
}

/// The sky of a moment in one reading, with Sun and Moon.
fn sky(context: &Context, epoch: &Epoch, mode: Mode) -> Result<(Vec<SkyRow>, Vec<SkyMark>)> {
    let site = &context.site;
    let Overhead { sun, moon, sidereal_rad, .. } = Overhead::at(site, epoch)?;
    let axes =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[x, y, z]| site.from_enu(&Vector::new(x, y, z)));
    let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..settings(mode) };
    let radius_km = match settings.effects.earth_radius {
        EarthRadius::Local => local_radius_km(&site.position()),
        _ => RADIUS_KM,
    };
    let mark = |name: &str, alt_rad: f64, az_rad: f64| SkyMark {
        name: name.into(),
        alt_deg: alt_rad.to_degrees(),
        az_deg: az_rad.to_degrees(),
    };
    let marks = vec![mark("Sun", sun.alt_rad, sun.az_rad), mark("Moon", moon.alt_rad, moon.az_rad)];
    let mut sky = Sky::new(axes, (radius_km, HEIGHT_KM), std::f64::consts::FRAC_PI_2, sun, Some(moon))?;
    sky.sidereal_rad = sidereal_rad;
    let map = sky_map(&sky, &SkyGrid::new(GRID.0, GRID.1)?, &context.satellite("iss")?, &settings, &|| ())?;
    Ok((sky_rows(&map), marks))
}

/// Figure 7, without its observations.
fn pass_and_sky(path: &Path, context: &Context) -> Result<()> {
    let tracker = context.tracker("iss")?;
    let start = parse_utc("time", PASS.0)?;
    let window = Window { start, end: shifted(start, PASS.1), step_s: 4.0, min_alt_rad: 10f64.to_radians() };
    let epochs = moments(&window, &visible(tracker, &window)?)?;
    let culmination = parse_utc("time", PASS_UTC)?;
    let reading = |(mode, label): &(Mode, &str)| -> Result<ModelSky> {
        let pass = predict(tracker, &context.model("iss", *mode)?, &epochs, &crate::base::progress::Silent)?;
        let (sky, marks) = sky(context, &culmination, *mode)?;
        Ok(ModelSky { label: format!("ISS, {label}"), pass, sky, marks })
    };
    let readings = MODES.iter().map(reading).collect::<Result<Vec<_>>>()?;
    model_sky(path, "ISS over Macquarie, 9 June 2025: the pass and the sky at 10:33 UTC", &readings)
}

/// Figure 8.
fn skies_of_two_days(paths: [&PathBuf; 2], context: &Context) -> Result<()> {
    let mut sheets: Vec<Vec<SkyPanel>> = Vec::new();
    for (mode, _) in MODES {
        let mut panels = Vec::new();
        for day in DAYS {
            let start = parse_utc("time", day)?;
            for k in 0..(24.0 / EVERY_H) as usize {
                let epoch = shifted(start, 3600.0 * EVERY_H * k as f64);
                let (rows, marks) = sky(context, &epoch, mode)?;
                let label: String = iso_utc(epoch, 0).chars().take(16).collect::<String>().replace('T', " ");
                panels.push(SkyPanel { label: format!("{label} UTC"), rows, marks });
            }
        }
        sheets.push(panels);
    }
    let all = sheets.concat();
    for ((path, panels), (_, label)) in paths.into_iter().zip(&sheets).zip(MODES) {
        let title =
            format!("ISS at {HEIGHT_KM} km over the sky, 11 June (full Moon) and 18 June 2025 (last quarter), {label}");
        sky_sequence_on(path, panels, &all, 3, &title)?;
    }
    Ok(())
}

/// Figure 9, left: the Earth under the Moon from a geostationary satellite.
fn moonlit_earth(paths: [&PathBuf; 2]) -> Result<()> {
    let epoch = parse_utc("time", PASS_UTC)?;
    let (lon_deg, lat_deg, height_km) = GEOSTATIONARY;
    let view = Viewpoint::new(lon_deg, lat_deg, height_km)?;
    let sky = bodies(&epoch, &EarthOrientation::default())?;
    let sun_w_m2 = Spectrum::sun(SolarColumn::Extraterrestrial)?.irradiance_w_m2(WIDE_NM.0, WIDE_NM.1);
    let sources = SourceSettings::new(&Effects::of(Mode::Corrected), &Band::between(MOON_NM.0, MOON_NM.1)?)?;
    let centre = Vector::<Itrs>::new(0.0, 0.0, 0.0);
    let (moon_w_m2, _) =
        EarthLightSource::Moon.irradiance_w_m2(&centre, &sky.sun_itrs_km, &sky.moon_itrs_km, &sources, sun_w_m2);
    let near = sources.moon_over_ground(&sky.moon_itrs_km, &sky.sun_itrs_km, view.radius_km);
    let corrected = earth_picture(&view, (&sky.moon_itrs_km, near.as_ref()), moon_w_m2, &EARTH_VEGETATION, (512, 3))?;
    // W/cm²/sr/µm over the band, from every direction in which there is ground
    let uniform_w_m2_sr = 1e4 * PAPER_EARTH_W_CM2_SR_UM * 1e-3 * (WIDE_NM.1 - WIDE_NM.0);
    let published = EarthPicture {
        view,
        radiance: Array2::from_elem(corrected.radiance.dim(), uniform_w_m2_sr),
        half_side: corrected.half_side,
    };
    let brightest = corrected.brightest().max(uniform_w_m2_sr);
    let kinds = [(published, "ground: 1e-9 W cm⁻² sr⁻¹ µm⁻¹"), (corrected, "ground: vegetation")];
    for ((path, (picture, ground)), (_, label)) in paths.into_iter().zip(kinds).zip(MODES) {
        let mark = EarthMark {
            light_source: "Moon".into(),
            under_deg: point_under(&sky.moon_itrs_km).map_or((0.0, 0.0), |(lon, lat, _)| (lon, lat)),
            terminator_deg: terminator(&sky.moon_itrs_km, 180)?,
            notes: vec![
                iso_utc(epoch, 0),
                "band 0.3–1.05 µm".into(),
                format!("from {lon_deg}° E, {height_km} km"),
                ground.into(),
                "coasts: Natural Earth".into(),
            ],
            brightest: Some(brightest),
        };
        earth(path, &picture, &format!("The Earth under the Moon, {label}"), &mark)?;
    }
    Ok(())
}

/// The station at one moment; with a uniform radiance of the Earth where one is given.
fn rendered(context: &Context, utc: &str, uniform: Option<f64>) -> Result<(Rendered, crate::orbit::Geometry)> {
    let satellite = ComponentSatellite::named("iss")?;
    let geometry = context.tracker("iss")?.at(&parse_utc("time", utc)?)?;
    let mut settings =
        RenderSettings { pixels: PIXELS, uniform_earth_w_cm2_sr_um: uniform, ..RenderSettings::default() };
    settings.model.earth = Brdf::named("earth-vegetation")?;
    Ok((Renderer::new(&ResolvedScene::of(&satellite, &geometry), &settings)?.picture(), geometry))
}

/// The sum of some lights.
fn sum(image: &RadianceImage, lights: &[Light]) -> Array2<f64> {
    let shape = image.planes.first().map_or((0, 0), |(_, plane)| plane.dim());
    let wanted = image.planes.iter().filter(|(light, _)| lights.contains(light));
    wanted.fold(Array2::zeros(shape), |sum, (_, plane)| sum + plane)
}

fn v_mag(rendered: &Rendered, lights: &[Light]) -> Option<f64> {
    mag_of_flux(rendered.v_flux.iter().filter(|(light, _)| lights.contains(light)).map(|(_, v)| v).sum())
}

/// The largest value of some pictures.
fn largest<'a>(pictures: impl Iterator<Item = &'a Picture>) -> f64 {
    pictures.flat_map(|p| p.values.iter().copied()).fold(0.0, f64::max)
}

/// The powers of ten about two values.
fn decades(low: f64, high: f64) -> (f64, f64) {
    (10f64.powf(low.log10().floor()), 10f64.powf(high.log10().ceil()))
}

/// Figure 5 as the model has it: the station by day, in twilight and at night on one scale.
fn one_target_under_three_lights(path: &Path, context: &Context) -> Result<()> {
    let mut panels = Vec::new();
    for (utc, when) in THREE_LIGHTS {
        let (rendered, geometry) = rendered(context, utc, None)?;
        let image = &rendered.image;
        let strongest = image.planes.iter().map(|(light, _)| *light);
        let strongest = strongest.max_by(|a, b| image.irradiance_w_m2(*a).total_cmp(&image.irradiance_w_m2(*b)));
        let v = v_mag(&rendered, &Light::ALL).map(|v| format!("V {v:.1}, ")).unwrap_or_default();
        let time: String = utc.chars().skip(5).take(11).collect::<String>().replace('T', " ");
        panels.push(Picture {
            label: format!("{when}: {}", strongest.map_or("no light", Light::title)),
            note: format!("{v}{:.0} km, {time} UTC", geometry.range_km),
            values: sum(image, &Light::ALL),
            pixel_m: image.pixel_rad * image.range_km * 1e3,
        });
    }
    let row = PictureRow {
        ends: decades(1e-6, largest(panels.iter())),
        pictures: panels,
        quantity: "radiance".into(),
        unit: "[W m⁻² sr⁻¹]".into(),
    };
    pictures(path, "The ISS under three lights on one scale, June 2025 (north up, east left)", &[row])
}

/// Figure 10: the station under starlight, with moonlight, with Lunar-Earthshine; before and behind the telescope.
fn resolved_station(paths: [&PathBuf; 2], context: &Context) -> Result<()> {
    let steps: [(&str, &[Light]); 3] = [
        ("starlight", &[Light::Starlight]),
        ("with Moonlight", &[Light::Starlight, Light::Moon, Light::Sun, Light::Earthshine]),
        ("with Lunar-Earthshine", &Light::ALL),
    ];
    let mut sheets = Vec::new();
    let mut noise_e = f64::INFINITY;
    for uniform in [Some(PAPER_EARTH_W_CM2_SR_UM), None] {
        let (rendered, geometry) = rendered(context, PASS_UTC, uniform)?;
        let image = &rendered.image;
        let sensor = Sensor::new(&SensorSettings::named("macquarie-cdk24", &[])?, image.band_um)?;
        let air = sensor.air(&geometry)?;
        let (mut before, mut behind) = (Vec::new(), Vec::new());
        for (label, lights) in steps {
            let planes = image.planes.iter().filter(|(light, _)| lights.contains(light)).cloned().collect();
            let lit = RadianceImage { planes, ..image.clone() };
            let exposure = sensor.expose(&lit, EXPTIME_S, &air, (0.0, 0.0))?;
            let counts = sensor.read_out(&exposure, 1);
            let sky_adu = sensor.background_adu(&exposure);
            let e_per_adu = sensor.gain.e_per_adu.0;
            noise_e = noise_e.min((exposure.sky_e_px + exposure.dark_e_px + sensor.gain.read_noise_e.powi(2)).sqrt());
            let pixel_m = (sensor.pixel_arcsec / 3600.0).to_radians() * image.range_km * 1e3;
            // as large a piece of the frame as the picture before the telescope
            let side = (PIXELS as f64 * image.pixel_rad * image.range_km * 1e3 / pixel_m).ceil() as usize;
            let v = v_mag(&rendered, lights).map(|v| format!("V {v:.2}")).unwrap_or_default();
            before.push(Picture {
                label: label.into(),
                note: v,
                values: sum(image, lights),
                pixel_m: image.pixel_rad * image.range_km * 1e3,
            });
            behind.push(Picture {
                label: format!("{label}, {EXPTIME_S:.0} s"),
                note: format!("{:.0} e⁻ in the satellite", exposure.satellite_e()),
                values: middle(&counts.mapv(|n| (f64::from(n) - sky_adu) * e_per_adu), side),
                pixel_m,
            });
        }
        sheets.push((before, behind));
    }
    let (brightest, most_e) = (largest(sheets.iter().flat_map(|s| &s.0)), largest(sheets.iter().flat_map(|s| &s.1)));
    for ((path, (before, behind)), (_, label)) in paths.into_iter().zip(sheets).zip(MODES) {
        let rows = [
            PictureRow {
                pictures: before,
                quantity: "radiance".into(),
                unit: "[W m⁻² sr⁻¹]".into(),
                ends: decades(1e-7, brightest),
            },
            PictureRow {
                pictures: behind,
                quantity: "above the sky".into(),
                unit: "[e⁻ per pixel]".into(),
                ends: (noise_e, most_e),
            },
        ];
        let title = format!("The ISS, 9 June 2025, 10:33 UTC, Lunar-Earthshine {label} (north up, east left)");
        pictures(path, &title, &rows)?;
    }
    Ok(())
}

/// A square about the middle.
fn middle(frame: &Array2<f64>, side: usize) -> Array2<f64> {
    let (ny, nx) = frame.dim();
    let side = side.clamp(1, ny.min(nx));
    let (top, left) = ((ny - side) / 2, (nx - side) / 2);
    frame.slice(ndarray::s![top..top + side, left..left + side]).to_owned()
}
