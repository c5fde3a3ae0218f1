//! What was skipped in scenes, computed all the same and timed.

use super::text::Explanation;
use super::text::LeftOut;
use super::text::runs;
use super::timing::SCENES;
use super::timing::brighter_mag;
use super::timing::each_us;
use super::timing::sample;
use crate::base::error::Result;
use crate::base::time::seconds_between;
use crate::base::time::shifted;
use crate::brightness::Brightness;
use crate::brightness::Model;
use crate::brightness::Scene;
use crate::brightness::Skip;
use crate::brightness::scene::scene;
use crate::orbit::Tracker;
use crate::visibility::forecast::Window;
use hifitime::Epoch;
use std::collections::BTreeMap;

pub(super) fn flux(b: &Brightness) -> f64 {
    [b.sun, b.earthshine, b.moon, b.lunar_earthshine].iter().map(|l| l.flux_ratio).sum()
}

/// Lights and surfaces that were skipped in scenes, in the order of their frequency.
///
/// # Errors
/// As [`Model::brightness`].
pub fn explain_scenes(
    model: &Model,
    scenes: &[Scene],
    labels: &dyn Fn(usize) -> String,
    cpu_s: &dyn Fn() -> f64,
) -> Result<Explanation> {
    let mut found: BTreeMap<(String, &str), (Skip, Vec<usize>)> = BTreeMap::new();
    for (i, scene) in scenes.iter().enumerate() {
        for skip in model.brightness(scene)?.skipped {
            let entry = found.entry((skip.what(), skip.why)).or_insert_with(|| (skip, Vec::new()));
            entry.1.push(i);
        }
    }
    let mut items = Vec::new();
    for ((what, why), (skip, at)) in found {
        let chosen = sample(&at, SCENES);
        let mut changes_mag = 0.0f64;
        for i in &chosen {
            let more = model.skipped_flux(&scenes[*i], &skip)?;
            changes_mag = changes_mag.max(brighter_mag(flux(&model.brightness(&scenes[*i])?), more));
        }
        // what a call costs before any light is computed is not saved
        let time = |skip: &Skip| {
            each_us(cpu_s, chosen.len(), |k| {
                std::hint::black_box(model.skipped_flux(&scenes[chosen[k]], skip).is_ok());
            })
        };
        let each_us = (time(&skip) - time(&skip.without_lights())).max(0.0);
        items.push(LeftOut {
            what,
            why: why.into(),
            count: at.len(),
            of: scenes.len(),
            scenes: runs(&at, labels),
            timed: chosen.len(),
            each_us: Some(each_us),
            changes_mag: Some(changes_mag).filter(|_| !skip.is_choice()),
        });
    }
    items.sort_by_key(|item| std::cmp::Reverse(item.count));
    let indices: Vec<usize> = (0..scenes.len()).collect();
    let chosen = sample(&indices, SCENES);
    let mut explained = Explanation { items, timed: chosen.len(), ..Explanation::default() };
    if chosen.is_empty() {
        return Ok(explained);
    }
    let (mut differs_mag, mut stated_err_mag) = (0.0f64, 0.0f64);
    for i in &chosen {
        let (some, all) = (model.brightness(&scenes[*i])?, model.exhaustive_brightness(&scenes[*i])?);
        differs_mag = differs_mag.max(brighter_mag(flux(&some), flux(&all) - flux(&some)));
        stated_err_mag = stated_err_mag.max(some.err_mag);
    }
    explained.scene_us = Some(each_us(cpu_s, chosen.len(), |k| {
        std::hint::black_box(model.brightness(&scenes[chosen[k]]).is_ok());
    }));
    explained.everything_us = Some(each_us(cpu_s, chosen.len(), |k| {
        std::hint::black_box(model.exhaustive_brightness(&scenes[chosen[k]]).is_ok());
    }));
    (explained.differs_mag, explained.stated_err_mag) = (Some(differs_mag), Some(stated_err_mag));
    Ok(explained)
}

/// Rows of a prediction that were skipped because the satellite is too low, timed as rows like the others.
///
/// # Errors
/// As [`explain_scenes`].
pub fn explain_low_rows(
    tracker: &Tracker,
    model: &Model,
    window: &Window,
    epochs: &[Epoch],
    cpu_s: &dyn Fn() -> f64,
) -> Result<Option<LeftOut>> {
    let steps = (seconds_between(window.start, window.end) / window.step_s).floor() as usize + 1;
    let low: Vec<Epoch> = sample(&(0..steps).collect::<Vec<_>>(), 64 * SCENES)
        .into_iter()
        .map(|k| shifted(window.start, k as f64 * window.step_s))
        .filter(|at| tracker.altitude_at(at).is_ok_and(|alt_rad| alt_rad < window.min_alt_rad))
        .collect();
    let chosen = sample(&low, SCENES);
    let count = steps.saturating_sub(epochs.len());
    if chosen.is_empty() || count == 0 {
        return Ok(None);
    }
    let us = each_us(cpu_s, chosen.len(), |k| {
        let row = || model.brightness(&scene(&tracker.at(&chosen[k])?));
        std::hint::black_box(row().is_ok());
    });
    Ok(Some(LeftOut {
        what: "rows".into(),
        why: format!("satellite below {} deg", window.min_alt_rad.to_degrees()),
        count,
        of: steps,
        scenes: String::new(),
        timed: chosen.len(),
        each_us: Some(us),
        changes_mag: None,
    }))
}
