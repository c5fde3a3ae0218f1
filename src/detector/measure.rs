//! The frames of one gain setting, measured: pairs of flats, bias frames, raw values.
//!
//! ADU as in the files, gains in e⁻/ADU. Bounded by [`Effort`]; a frame that cannot be read is reported and excluded.
//! It does not cover what is right or wrong about it ([`crate::pipeline::detector::checks`]).

use crate::base::stats::{mean_and_sd, median, sigma_clip};
use crate::detector::{Counts, DarkNoise, PairPoints, Refusal, Transfer, compare_flats, count_values, fit_transfer};
use crate::frames::{self, Blocks, Exposure, sensor_pixels};

/// How much is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Pairs of flats per gain setting.
    pub pairs: usize,
    /// Flats whose level is looked at to choose them.
    pub flats: usize,
    /// Bias frames per gain setting.
    pub biases: usize,
    /// Pixels of star and target frames per gain setting, of two frames at least.
    pub light_px: usize,
}

impl Effort {
    /// What a run can spare: under two seconds for frames of 61 Mpx.
    pub const RUN: Effort = Effort { pairs: 1, flats: 6, biases: 2, light_px: 24_000_000 };
    /// Everything named.
    pub const ALL: Effort = Effort { pairs: usize::MAX, flats: usize::MAX, biases: usize::MAX, light_px: usize::MAX };
}

/// The raw frames of one gain setting and binning.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// Flats.
    pub flats: Vec<Exposure>,
    /// Bias frames, and darks of less than a second.
    pub biases: Vec<Exposure>,
    /// Longer darks.
    pub darks: Vec<Exposure>,
    /// Star and target frames.
    pub lights: Vec<Exposure>,
}

impl Group {
    /// Any frame: of what all share.
    pub fn any(&self) -> Option<&Exposure> {
        self.flats.iter().chain(&self.lights).chain(&self.biases).chain(&self.darks).next()
    }
}

/// Level and noise of bias frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bias {
    /// Mean level \[ADU\].
    pub level_adu: f64,
    /// Its error \[ADU\].
    pub err_adu: f64,
    /// Frames.
    pub n: usize,
    /// Variance of one frame and its error \[ADU²\], from differences of two; absent with a single frame.
    pub var_adu2: Option<(f64, f64)>,
}

/// `n` of `items`, evenly spread.
pub fn spread<T>(items: &[T], n: usize) -> Vec<&T> {
    let n = n.min(items.len());
    (0..n).filter_map(|k| items.get((2 * k + 1) * items.len() / (2 * n))).collect()
}

/// Level and noise of the bias frames; the level is the mean of the blocks' clipped means.
///
/// The variance of one frame is half that of the difference of two, so that fixed pattern does not count as noise.
pub fn measure_bias(
    biases: &[Exposure],
    clip_px: Option<f64>,
    effort: Effort,
    problems: &mut Vec<String>,
) -> Option<Bias> {
    let size = biases.first()?.size_px;
    let layout = Blocks::layout(size, clip_px)?;
    let (mut levels, mut errors, mut variances) = (Vec::new(), Vec::new(), Vec::new());
    let mut before: Option<Vec<Vec<f32>>> = None;
    for bias in spread(biases, effort.biases) {
        if bias.size_px != size {
            problems.push(format!(
                "{}: {}x{} px, other bias frames are {}x{}",
                bias.name, bias.size_px.0, bias.size_px.1, size.0, size.1
            ));
            continue;
        }
        let blocks = match layout.read(bias) {
            Ok(blocks) => blocks,
            Err(e) => {
                problems.push(e.to_string());
                continue;
            }
        };
        let mut means: Vec<f64> = blocks
            .iter()
            .filter_map(|b| sigma_clip(&mut b.iter().map(|v| f64::from(*v)).collect::<Vec<_>>(), 5.0).map(|c| c.mean))
            .collect();
        if let Some(clipped) = sigma_clip(&mut means, 4.0) {
            levels.push(clipped.mean);
            errors.push(clipped.sigma / (clipped.n as f64).sqrt());
        }
        match before.take() {
            Some(other) => variances.extend(other.iter().zip(&blocks).filter_map(|(a, b)| {
                let mut d: Vec<f64> = a.iter().zip(b).map(|(u, v)| f64::from(*u) - f64::from(*v)).collect();
                sigma_clip(&mut d, 5.0).map(|c| 0.5 * c.sigma * c.sigma)
            })),
            None => before = Some(blocks),
        }
    }
    let (level_adu, sd) = mean_and_sd(&levels);
    let n = levels.len();
    let single = errors.iter().copied().fold(0f64, f64::max);
    let var_adu2 = sigma_clip(&mut variances, 4.0).map(|c| (c.mean, c.sigma / (c.n as f64).sqrt()));
    (n > 0).then(|| Bias { level_adu, err_adu: (sd / (n as f64).sqrt()).max(single), n, var_adu2 })
}

/// Level of the overscan of the first raw flat or light that has one.
pub fn overscan(group: &Group) -> Option<Bias> {
    let level = |exposure: &Exposure| frames::overscan(exposure, None).ok().flatten();
    let level = group.flats.iter().chain(&group.lights).find_map(level)?;
    Some(Bias { level_adu: level.adu, err_adu: level.err_adu, n: 1, var_adu2: None })
}

/// Median level of the darks \[ADU\], of the first that can be read.
pub fn dark_level_adu(darks: &[Exposure], clip_px: Option<f64>) -> Option<f64> {
    darks.iter().find_map(|dark| {
        let blocks = Blocks::layout(dark.size_px, clip_px)?.read(dark).ok()?;
        median(&mut blocks.iter().flatten().map(|v| f64::from(*v)).collect::<Vec<_>>())
    })
}

/// Counts the raw values of flats (their blocks) and lights (their pixels): of the flats, of the lights.
///
/// Frames that do not hold raw counts are reported in `problems` and excluded.
pub fn count_raw(group: &Group, clip_px: Option<f64>, effort: Effort, problems: &mut Vec<String>) -> (Counts, Counts) {
    let (mut flats, mut lights) = (Counts::default(), Counts::default());
    let mut add = |name: &str, counted: crate::base::error::Result<Counts>, to: &mut Counts| {
        match counted {
        Ok(counts) if counts.is_raw() => to.merge(&counts),
        Ok(counts) if counts.len() + counts.n_fractional + counts.n_outside == 0 => {
            problems.push(format!("{name}: no finite pixel"));
        }
        Ok(_) => problems.push(format!(
            "{name}: not raw counts (values that are not whole numbers from 0 to 65535); calibrated frames tell nothing of the converter"
        )),
        Err(e) => problems.push(e.to_string()),
    }
    };
    for flat in spread(&group.flats, effort.flats.min(4)) {
        // the mean of two pixels has half steps, which no converter makes
        let (flat, wide) = sensor_pixels(flat);
        let clip_px = clip_px.map(|r| r * wide as f64);
        let Some(layout) = Blocks::layout(flat.size_px, clip_px) else { continue };
        let counted = layout.read(&flat).map(|blocks| {
            let mut counts = Counts::default();
            blocks.iter().for_each(|b| counts.add(b));
            counts
        });
        add(&flat.name, counted, &mut flats);
    }
    // a compressed row costs four times as much
    let cost = |e: &Exposure| e.size_px.0 * e.size_px.1 * if e.header.is_compressed() { 4 } else { 1 };
    let most = group.lights.iter().map(cost).max().unwrap_or(1).max(1);
    let chosen = spread(&group.lights, (effort.light_px / most).max(2));
    for light in &chosen {
        let px = effort.light_px / chosen.len() / if light.header.is_compressed() { 4 } else { 1 };
        let (light, wide) = sensor_pixels(light);
        add(&light.name, count_values(&light, clip_px.map(|r| r * wide as f64), px), &mut lights);
    }
    (flats, lights)
}

/// What the flats of one gain setting gave.
#[derive(Debug, Clone, Default)]
pub struct FlatPairs {
    /// The pairs that can be used.
    pub pairs: Vec<PairPoints>,
    /// The gain, if there is one.
    pub transfer: Option<Transfer>,
    /// Pairs that cannot be used, and why.
    pub refused: Vec<(String, Refusal)>,
    /// Why there is no gain; empty if there is.
    pub why_not: String,
}

/// Pairs the flats of one gain setting and fits the gain.
///
/// A pair has the same size and filter; flats of one exposure time are paired first, by their level.
pub fn measure_flats(
    group: &Group,
    pedestal_adu: f64,
    saturation_adu: f64,
    dark: DarkNoise,
    clip_px: Option<f64>,
    effort: Effort,
    problems: &mut Vec<String>,
) -> FlatPairs {
    let mut result = FlatPairs::default();
    let couples = couples(&spread(&group.flats, effort.flats), clip_px, problems);
    if couples.is_empty() {
        result.why_not = match group.flats.len() {
            0 => "no flats".into(),
            1 => {
                "needs two flats of one setting; there is one (two halves of one flat share its pixel response)".into()
            }
            n => format!("needs two flats of one setting, filter and size; of {n} no two agree or can be read"),
        };
        return result;
    }
    for (a, b) in couples {
        if result.pairs.len() >= effort.pairs {
            break;
        }
        let names = format!("{} and {}", a.name, b.name);
        let Some(layout) = Blocks::layout(a.size_px, clip_px) else { continue };
        match layout.read(a).and_then(|x| Ok((x, layout.read(b)?))) {
            Err(e) => problems.push(e.to_string()),
            Ok((x, y)) => match compare_flats(&x, &y, pedestal_adu, saturation_adu) {
                Ok(pair) => result.pairs.push(pair),
                Err(refusal) => result.refused.push((names, refusal)),
            },
        }
    }
    match fit_transfer(&result.pairs, dark) {
        Ok(transfer) => result.transfer = Some(transfer),
        Err(Refusal::NoPixels) if !result.refused.is_empty() => {
            let (names, refusal) = &result.refused[0];
            result.why_not = format!("{names}: {refusal}");
        }
        Err(refusal) => result.why_not = refusal.to_string(),
    }
    result
}

/// Couples of flats, the closest in level first; each flat in one couple only.
fn couples<'a>(
    flats: &[&'a Exposure],
    clip_px: Option<f64>,
    problems: &mut Vec<String>,
) -> Vec<(&'a Exposure, &'a Exposure)> {
    let mut levelled: Vec<(&Exposure, f64)> = Vec::new();
    for flat in flats {
        let read = Blocks::layout(flat.size_px, clip_px).map(|layout| layout.read(flat));
        match read {
            None => problems.push(format!(
                "{}: {}x{} px inside the clip circle are too few",
                flat.name, flat.size_px.0, flat.size_px.1
            )),
            Some(Err(e)) => problems.push(e.to_string()),
            Some(Ok(blocks)) => {
                let mut values: Vec<f64> = blocks.iter().flatten().map(|v| f64::from(*v)).collect();
                levelled.push((flat, median(&mut values).unwrap_or(f64::NAN)));
            }
        }
    }
    let alike = |a: &Exposure, b: &Exposure| a.size_px == b.size_px && a.filter == b.filter;
    let mut found: Vec<(f64, (&Exposure, &Exposure))> = Vec::new();
    for same_exptime in [true, false] {
        levelled.sort_by(|(a, la), (b, lb)| {
            let time = if same_exptime { a.exptime_s.total_cmp(&b.exptime_s) } else { std::cmp::Ordering::Equal };
            let kind = a.size_px.cmp(&b.size_px).then_with(|| a.filter.cmp(&b.filter));
            kind.then(time).then(la.total_cmp(lb)).then_with(|| a.path.cmp(&b.path))
        });
        let mut left = Vec::new();
        let mut remaining = levelled.drain(..).peekable();
        while let Some((a, la)) = remaining.next() {
            let partner = remaining.next_if(|(b, lb)| {
                alike(a, b)
                    && (!same_exptime || (a.exptime_s == b.exptime_s && *lb <= crate::detector::MAX_FLAT_RATIO * la))
            });
            match partner {
                Some((b, lb)) => found.push((lb / la, (a, b))),
                None => left.push((a, la)),
            }
        }
        drop(remaining);
        levelled = left;
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, couple)| couple).collect()
}
