//! The detector as measured from the frames, compared with its table and the headers: gain, read noise, pedestal, step,
//! saturation.
//!
//! Gains in e⁻/ADU, levels in ADU as in the files, read noise in e⁻. A warning says what a disagreement does to
//! magnitudes and what to check. It does not cover how each number is measured ([`crate::detector::measure`]).

use super::gain_check::GainCheck;
use std::collections::BTreeMap;

use super::report::{verdict, warnings};
use crate::base::error::{Error, Result};
use crate::config::Config;
use crate::detector::measure::{
    Bias, Effort, FlatPairs, Group, count_raw, dark_level_adu, measure_bias, measure_flats, overscan,
};
use crate::detector::{Counts, DarkNoise, converter_bits};
use crate::frames::{Detector, Exposure, Gain, GainSetting, Role, classify};
use crate::pipeline::prepared::Prepared;
use crate::pipeline::survey::files::Survey;

/// What is known of a detector before its frames are examined.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known<'a> {
    /// The camera's table.
    pub detector: Option<&'a Detector>,
    /// Bias level of the configuration \[ADU\].
    pub pedestal_adu: Option<f64>,
    /// Circle kept around the centre \[px\].
    pub clip_radius_px: Option<f64>,
}

/// Checks the detector on the night's own frames: two flats, two bias frames and two lights of each gain setting.
///
/// Warnings are added to `notes`; what agrees is in the checks alone. Nothing here stops a night: a frame that cannot
/// be read is a line of `problems`.
///
/// # Errors
/// [`Error::Config`] only.
pub fn check(survey: &Survey, prepared: &Prepared, notes: &mut Vec<String>) -> Result<Vec<GainCheck>> {
    let groups = groups(survey, &prepared.config)?;
    let known = Known {
        detector: Some(&prepared.detector),
        pedestal_adu: Some(prepared.detector.pedestal_adu()),
        clip_radius_px: prepared.config.photometry.clip_radius_px,
    };
    let checks: Vec<GainCheck> = groups.iter().map(|group| check_group(group, &known, Effort::RUN)).collect();
    notes.extend(checks.iter().flat_map(|c| c.warnings.iter().map(|w| format!("detector: {w}"))));
    Ok(checks)
}

/// The night's frames by gain setting and binning.
///
/// # Errors
/// [`Error::Config`] only.
pub fn groups(survey: &Survey, config: &Config) -> Result<Vec<Group>> {
    // a setting; without one, EGAIN in millionths; then the binning
    let key = |e: &Exposure| {
        let egain = e.header_e_per_adu.map(|g| (1e6 * g).round() as i64).filter(|_| e.setting.is_none());
        (e.setting, egain, e.binning)
    };
    let mut groups: BTreeMap<(Option<GainSetting>, Option<i64>, u32), Group> = BTreeMap::new();
    for flat in &survey.flats {
        groups.entry(key(flat)).or_default().flats.push(flat.clone());
    }
    for light in survey.pointings.iter().flatten().chain(&survey.targets) {
        groups.entry(key(light)).or_default().lights.push(light.clone());
    }
    // bias and dark frames are classified for their role alone; as a flat their gain and binning are read too
    let mut as_flat = config.clone();
    as_flat.frames.flat = vec!["*".into()];
    as_flat.frames.ignore.clear();
    for other in survey.others.iter().filter(|e| matches!(e.role, Role::Bias | Role::Dark)) {
        let full = match classify(&other.path, &as_flat, &[]) {
            Ok(full) => full,
            Err(error @ Error::Config { .. }) => return Err(error),
            Err(_) => continue, // a stacked or calibrated one
        };
        let short = full.exptime_s > 0.0 && full.exptime_s < 1.0;
        let group = groups.entry(key(&full)).or_default();
        if other.role == Role::Bias || short { group.biases.push(full) } else { group.darks.push(full) }
    }
    // bias frames without a gain setting belong to the one setting there is
    let bare = (None, None, groups.keys().next().map_or(1, |k| k.2));
    let alone = |g: &Group| g.flats.is_empty() && g.lights.is_empty();
    if groups.len() == 2
        && groups.get(&bare).is_some_and(alone)
        && groups.keys().all(|k| k.2 == bare.2)
        && let Some(bare) = groups.remove(&bare)
        && let Some(group) = groups.values_mut().next()
    {
        group.biases.extend(bare.biases);
        group.darks.extend(bare.darks);
    }
    for group in groups.values_mut() {
        for list in [&mut group.flats, &mut group.biases, &mut group.darks, &mut group.lights] {
            list.sort_by(|a, b| a.path.cmp(&b.path));
        }
    }
    Ok(groups.into_values().collect())
}

/// Measures one gain setting and compares it with what is known.
#[must_use]
pub fn check_group(group: &Group, known: &Known, effort: Effort) -> GainCheck {
    let clip = known.clip_radius_px;
    let mut check = GainCheck::default();
    let Some(any) = group.any() else { return check };
    (check.setting, check.binning) = (any.setting.map(|s| s.0), any.binning);
    (check.n_flats, check.n_biases) = (group.flats.len(), group.biases.len());
    (check.n_darks, check.n_lights) = (group.darks.len(), group.lights.len());
    let gain = known.detector.and_then(|d| frames_of(group).find_map(|e| d.gain(e).ok()));
    take_known(&mut check, gain.as_ref(), known);
    take_header(&mut check, group);

    let bias = measure_bias(&group.biases, clip, effort, &mut check.problems).or_else(|| overscan(group));
    check.pedestal_adu = bias.map(|b| b.level_adu);
    check.pedestal_err_adu = bias.map(|b| b.err_adu);
    check.dark_level_adu = dark_level_adu(&group.darks, clip);
    let (flats, lights) = count_raw(group, clip, effort, &mut check.problems);
    take_values(&mut check, &flats, &lights, bias, gain.as_ref());

    let saturation = [check.saturation_adu, check.configured_saturation_adu].into_iter().flatten();
    let saturation_adu = saturation.fold(f64::INFINITY, f64::min);
    let Some(pedestal_adu) = check.pedestal_adu.or(known.pedestal_adu) else {
        check.method = match group.flats.len() {
            0 => "no flats",
            1 => "needs two flats of one setting; there is one",
            _ => "pedestal not known: give bias frames (argument `bias`), argument `pedestal` or a configuration",
        }
        .into();
        check.verdict = verdict(&check);
        check.warnings = warnings(&check);
        return check;
    };
    let dark = match bias.and_then(|b| b.var_adu2) {
        Some((var, _)) => DarkNoise::Measured(var),
        None => DarkNoise::Table {
            read_noise_e: check.configured_read_noise_e.unwrap_or(0.0),
            digitisation_adu2: check.spacing_adu.unwrap_or(1.0).powi(2) / 12.0,
        },
    };
    let pairs = measure_flats(group, pedestal_adu, saturation_adu, dark, clip, effort, &mut check.problems);
    take_pairs(&mut check, pairs);
    if let (Some((var, var_err)), Some(g)) =
        (bias.and_then(|b| b.var_adu2), check.measured_e_per_adu.or(check.configured_e_per_adu))
    {
        // biases that do not differ have a noise below the step of their values, which does not mean a noise of 0
        if var > 0.0 {
            check.read_noise_e = Some(g * var.sqrt());
            check.read_noise_err_e = Some(g * 0.5 * var_err / var.sqrt());
        }
    }
    check.verdict = verdict(&check);
    check.warnings = warnings(&check);
    check
}

fn frames_of(group: &Group) -> impl Iterator<Item = &Exposure> {
    group.lights.iter().chain(&group.flats).chain(&group.biases).chain(&group.darks)
}

fn take_known(check: &mut GainCheck, gain: Option<&Gain>, known: &Known) {
    check.configured_pedestal_adu = known.pedestal_adu;
    let Some(gain) = gain else { return };
    check.configured_e_per_adu = Some(gain.e_per_adu.0);
    check.configured_source = gain.source.clone();
    check.egain_in_use = known.detector.is_some_and(Detector::uses_header_egain);
    check.configured_read_noise_e = Some(gain.read_noise_e);
    check.configured_saturation_adu = Some(gain.saturation_adu);
    check.full_scale_adu = known.detector.map(|d| gain.saturation_adu / d.saturation_frac());
}

/// EGAIN, BITDEPTH and the level of saturation, from the first header that has them.
fn take_header(check: &mut GainCheck, group: &Group) {
    check.header_e_per_adu = frames_of(group).find_map(|e| e.header_e_per_adu);
    if let Some(first) = check.header_e_per_adu {
        check.header_differs =
            frames_of(group).filter_map(|e| e.header_e_per_adu).any(|g| (g / first - 1.0).abs() > 1e-3);
    }
    check.header_bits = frames_of(group).find_map(|e| e.header.integer("BITDEPTH"));
    for key in ["SATURATE", "MAXLIN", "FULLWELL"] {
        let Some((value, comment)) = frames_of(group).find_map(|e| {
            Some((e.header.number(key).filter(|v| *v > 0.0)?, e.header.comment(key).unwrap_or_default()))
        }) else {
            continue;
        };
        let comment = comment.to_ascii_lowercase();
        let says = |word: &str| comment.contains(word);
        let electrons = (says("electron") || says("e-")) && !says("adu") || key == "FULLWELL" && !says("adu");
        let adu = match (electrons, check.header_e_per_adu.or(check.configured_e_per_adu)) {
            (false, _) => value,
            (true, Some(g)) => value / g + check.configured_pedestal_adu.unwrap_or(0.0),
            (true, None) => continue,
        };
        if check.header_saturation_adu.is_none_or(|before| adu < before) {
            (check.header_saturation_adu, check.header_saturation_key) = (Some(adu), key.into());
        }
    }
}

/// Step, bits, saturation and extremes of the raw values.
fn take_values(check: &mut GainCheck, flats: &Counts, lights: &Counts, bias: Option<Bias>, gain: Option<&Gain>) {
    let mut all = flats.clone();
    all.merge(lights);
    let step = all.step();
    check.step_adu = step.map(|s| s.step_adu);
    check.spacing_adu = step.map(|s| s.spacing_adu);
    // what light and noise may pile up by themselves: the bias level and all of its noise
    let base = bias.map(|b| b.level_adu).or(check.configured_pedestal_adu);
    let base = base.or_else(|| lights.quantile(0.5)).unwrap_or(0.0);
    let noise = gain.map_or(0.0, |g| 10.0 * g.read_noise_e / g.e_per_adu.0);
    let pile = all.pile(base + noise + 100.0 * check.spacing_adu.unwrap_or(1.0));
    check.converter_bits = converter_bits(step, pile);
    check.saturation_adu = pile.map(|p| p.level_adu);
    check.saturated_px = pile.map(|p| p.n_px);
    check.highest_adu = all.max_adu();
    check.lowest_adu = lights.quantile(1e-3);
    check.n_above_full = check.full_scale_adu.map_or(0, |full| all.n_above(1.01 * full));
}

fn take_pairs(check: &mut GainCheck, pairs: FlatPairs) {
    for (names, refusal) in &pairs.refused {
        let problem = format!("{names}: {refusal}");
        check.doubtful_frames.extend(refusal.doubts_the_frames().then(|| problem.clone()));
        check.problems.push(problem);
    }
    check.n_pairs = pairs.pairs.len();
    check.blocks = pairs.pairs.iter().map(|p| p.blocks.iter().map(|b| (b.level_adu, b.var_adu2)).collect()).collect();
    check.method = pairs.why_not;
    if let Some(transfer) = pairs.transfer {
        check.measured_e_per_adu = Some(transfer.gain.e_per_adu);
        check.measured_err_e_per_adu = Some(transfer.gain.err);
        check.levels_adu = Some([transfer.level_range_adu.0.round(), transfer.level_range_adu.1.round()]);
        check.method = if transfer.from_slope { "slope" } else { "read noise held" }.into();
        check.transfer = Some(transfer);
    }
}
