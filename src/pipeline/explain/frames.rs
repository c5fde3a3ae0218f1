//! What was skipped in a night: stages without input, pixels that are not read, lights and surfaces of the model.
//!
//! CPU seconds from the listener's clock, magnitudes. Reads a few frames again, changes nothing.

use super::scenes::explain_scenes;
use super::timing::each_us;
use super::timing::sample;
use crate::base::error::Result;
use crate::base::file::file_name;
use crate::base::progress::Progress;
use crate::base::threads::with_threads;
use crate::brightness::Scene;
use crate::brightness::light_sources::mag_of_flux;
use crate::brightness::scene::scene;
use crate::config;
use crate::frames::flat::{BAND_BYTES, MasterFlat};
use crate::frames::{Exposure, FrameReader};
use crate::photometry::target::measure::TargetFound;
use crate::pipeline::explain::text::{Explanation, LeftOut, runs};
use crate::pipeline::options::Options;
use crate::pipeline::prepared::Calibrated;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::target::frame::missing_parts;
use crate::pipeline::target::frame::{settings_of_frame, target_settings};
use crate::pipeline::target::outcome::TargetFrame;
use crate::pipeline::target::pilots::TargetFrames;
use crate::pipeline::target::window::{Region, Seen, measure_in_window, measure_whole_frame};

/// Frames a piece is computed for.
const FRAMES: usize = 3;

/// Stages, rows of pixels, lights and surfaces that were skipped in a night; `None` unless requested.
///
/// # Errors
/// As [`explain_scenes`]; a frame that cannot be read again is skipped here.
pub fn explain_night(
    survey: &Survey,
    frames: &[TargetFrame],
    night: &Calibrated,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Option<Explanation>> {
    if !options.explain {
        return Ok(None);
    }
    let cpu_s = || progress.cpu_s().unwrap_or(0.0);
    let modelled: Vec<(&str, Scene)> =
        frames.iter().filter_map(|f| Some((f.row.frame.as_str(), scene(f.geometry.as_ref()?)))).collect();
    let scenes: Vec<Scene> = modelled.iter().map(|(_, scene)| *scene).collect();
    let mut explained = match &night.model {
        Some(model) => explain_scenes(model, &scenes, &|i| modelled[i].0.to_string(), &cpu_s)?,
        None => Explanation::default(),
    };
    let mut items = stages(survey, night);
    items.extend(fewer_flats(survey, frames, night, (options.jobs, &cpu_s)));
    items.extend(outside_the_circle(survey, night, &cpu_s));
    items.extend(away_from_the_target(survey, night, &cpu_s));
    items.extend(beside_the_pilots(survey, frames, night, &cpu_s));
    items.append(&mut explained.items);
    Ok(Some(Explanation { items, ..explained }))
}

/// Stages without input, and frames that were not requested: there is nothing to compute.
fn stages(survey: &Survey, night: &Calibrated) -> Vec<LeftOut> {
    let nothing = |what: &str, why: String, count: usize, of: usize, scenes: String| LeftOut {
        what: what.into(),
        why,
        count,
        of,
        scenes,
        timed: 0,
        each_us: None,
        changes_mag: None,
    };
    let mut items: Vec<LeftOut> = missing_parts(night, night.flat.is_some(), night.zeropoint.is_some())
        .into_iter()
        .map(|part| nothing("stage", part.to_string(), 1, 1, String::new()))
        .collect();
    if let Some(path) = &night.config.zeropoint.previous {
        items.push(nothing("zeropoint fit", format!("taken from {}", path.display()), 1, 1, String::new()));
    }
    if !survey.others.is_empty() {
        let name = |i: usize| survey.others[i].name.clone();
        let all: Vec<usize> = (0..survey.others.len()).collect();
        let why = "neither flat, stars nor target".to_string();
        items.push(nothing("frames", why, survey.others.len(), survey.len(), runs(&all, &name)));
    }
    items
}

/// Flats beyond those that `flat.noise_frac` takes: the master of all is made too, and compared where targets stand.
fn fewer_flats(
    survey: &Survey,
    frames: &[TargetFrame],
    night: &Calibrated,
    (jobs, cpu_s): (usize, &dyn Fn() -> f64),
) -> Option<LeftOut> {
    let flat = night.flat.as_ref()?;
    let spared: Vec<usize> = (0..flat.members.len()).filter(|k| flat.members[*k].not_needed).collect();
    if spared.is_empty() {
        return None;
    }
    let make = |noise_frac: Option<f64>| {
        let config = config::Flat { noise_frac, ..night.config.flat.clone() };
        let start = cpu_s();
        let clip = night.config.photometry.clip_radius_px;
        let master = || MasterFlat::make(&survey.flats, &night.detector, &config, clip, BAND_BYTES);
        let master = with_threads(jobs, master).ok()?.ok()?;
        Some((master, cpu_s() - start))
    };
    let ((of_all, all_s), (of_some, some_s)) = (make(None)?, make(night.config.flat.noise_frac)?);
    let at = |f: &TargetFrame| Some((f.row.x_px?, f.row.y_px?, f.row.fwhm_px?));
    let changes = frames.iter().filter_map(at).filter_map(|(x_px, y_px, fwhm_px)| {
        let [all, some] = [&of_all, &of_some].map(|flat| flat.mean_under_point(x_px, y_px, fwhm_px));
        Some(mag_of_flux(some? / all?)?.abs())
    });
    Some(LeftOut {
        what: "flats".into(),
        why: format!("noise of a pixel {:.5} with the others", flat.noise_frac.unwrap_or(f64::NAN)),
        count: spared.len(),
        of: flat.members.len(),
        scenes: runs(&spared, &|k| file_name(&flat.members[k].path)),
        timed: spared.len(),
        each_us: Some(1e6 * (all_s - some_s).max(0.0) / spared.len() as f64),
        changes_mag: changes.reduce(f64::max),
    })
}

/// Pixels outside of the clip circle are not read.
fn outside_the_circle(survey: &Survey, night: &Calibrated, cpu_s: &dyn Fn() -> f64) -> Option<LeftOut> {
    let radius_px = night.config.photometry.clip_radius_px?;
    let all: Vec<&Exposure> = survey.pointings.iter().flatten().chain(&survey.targets).collect();
    let chosen = sample(&all, FRAMES);
    let exposure = chosen.first()?;
    let reader = night.open(exposure).ok()?;
    let inside: usize = reader.box_px().1.map(|y| reader.inside(y).len()).sum();
    let total = exposure.size_px.0 * exposure.size_px.1;
    if inside >= total {
        return None;
    }
    let time = |clip: Option<f64>| {
        each_us(cpu_s, chosen.len(), |k| {
            let read = || {
                let gain = night.detector.gain(chosen[k])?;
                FrameReader::open(chosen[k], gain, clip, None)?.whole(&night.buffers).map(drop)
            };
            std::hint::black_box(read().is_ok());
        })
    };
    Some(LeftOut {
        what: format!("rows and spans, {:.0} % of the pixels", 100.0 * (1.0 - inside as f64 / total as f64)),
        why: format!("outside the clip circle of {radius_px} px"),
        count: all.len(),
        of: all.len(),
        scenes: "star and target frames".into(),
        timed: chosen.len(),
        each_us: Some((time(None) - time(Some(radius_px))).max(0.0)),
        changes_mag: None,
    })
}

/// Of a target frame only the window around the target is read and measured.
fn away_from_the_target(survey: &Survey, night: &Calibrated, cpu_s: &dyn Fn() -> f64) -> Option<LeftOut> {
    let all: Vec<&Exposure> = survey.targets.iter().collect();
    let chosen = sample(&all, FRAMES);
    let measure = |k: usize, whole: bool| -> Option<Seen> {
        let (reader, settings) =
            (night.open(chosen[k]).ok()?, target_settings(chosen[k], night, night.seeing.fwhm_arcsec(None)));
        if whole {
            measure_whole_frame(&reader, night, &settings).ok()
        } else {
            measure_in_window(&reader, night, &settings, None).ok()
        }
    };
    let (each_us, changes_mag) = with_and_without(chosen.len(), &measure, cpu_s)?;
    Some(LeftOut {
        what: "pixels of target frames".into(),
        why: "the target cannot be there".into(),
        count: all.len(),
        of: all.len(),
        scenes: "target frames".into(),
        timed: chosen.len(),
        each_us: Some(each_us),
        changes_mag: Some(changes_mag),
    })
}

/// Of the frames between the pilots of a pass only the part where the pilots have the target.
fn beside_the_pilots(
    survey: &Survey,
    frames: &[TargetFrame],
    night: &Calibrated,
    cpu_s: &dyn Fn() -> f64,
) -> Option<LeftOut> {
    let targets = TargetFrames::all(&survey.targets);
    let pilots = targets.pilots();
    let rows: Vec<_> = pilots.iter().filter_map(|k| Some((*k, frames.get(*k)?.row.clone()))).collect();
    let others = (0..frames.len()).filter(|k| pilots.binary_search(k).is_err());
    let settings_of = |k: usize| settings_of_frame(frames[k].geometry.as_ref(), &survey.targets[k], night);
    let small = |k: usize| targets.region(k, &rows, night).filter(|region| region.is_small(&settings_of(k)));
    let all: Vec<(usize, Region)> = others.filter_map(|k| Some((k, small(k)?))).collect();
    let chosen = sample(&all, FRAMES);
    let measure = |i: usize, whole: bool| -> Option<Seen> {
        let (k, region) = chosen[i];
        let reader = night.open(&survey.targets[k]).ok()?;
        measure_in_window(&reader, night, &settings_of(k), (!whole).then_some(&region)).ok()
    };
    let (each_us, changes_mag) = with_and_without(chosen.len(), &measure, cpu_s)?;
    Some(LeftOut {
        what: "pixels between pilots".into(),
        why: "other frames of the pass show where the target stands".into(),
        count: all.len(),
        of: frames.len(),
        scenes: "target frames".into(),
        timed: chosen.len(),
        each_us: Some(each_us),
        changes_mag: Some(changes_mag),
    })
}

/// What it saves to look at less of `n` frames \[µs\], and by how much that changes the light of the target at most \[mag\]; `None`
/// where there are none, or one cannot be read again.
fn with_and_without(
    n: usize,
    measure: &dyn Fn(usize, bool) -> Option<Seen>,
    cpu_s: &dyn Fn() -> f64,
) -> Option<(f64, f64)> {
    let light = |seen: Option<Seen>| {
        seen.map(|s| match s.found {
            TargetFound::Detected { flux, .. } | TargetFound::NotDetected { flux, .. } => flux.flux_e,
        })
    };
    let mut changes_mag = 0.0f64;
    for k in 0..n {
        let (some, whole) = (light(measure(k, false))?, light(measure(k, true))?);
        let changed = if some == whole { 0.0 } else { mag_of_flux(some / whole).map_or(f64::INFINITY, f64::abs) };
        changes_mag = changes_mag.max(changed);
    }
    let time = |whole: bool| {
        each_us(cpu_s, n, |k| {
            std::hint::black_box(measure(k, whole).is_some());
        })
    };
    (n > 0).then(|| ((time(true) - time(false)).max(0.0), changes_mag))
}
