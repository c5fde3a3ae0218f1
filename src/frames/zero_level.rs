//! The counts of a frame without light: the night's biases and darks, matched to a frame and scaled to its exposure.
//!
//! Z = B + (D − B) t / t_D, or D where its exposure is that of the frame, in ADU; B and D are medians. Biases match in size,
//! binning, gain setting and offset, darks in temperature as well. Pixels whose dark current adds more than a few read noises
//! to a frame are masked: it is neither stable nor linear in time. Flats are not treated: their level is far above the structure
//! of a bias.

use std::collections::BTreeMap;
use std::ops::Range;

use super::clip::Region;
use super::exposure::Exposure;
use super::flat::BAND_BYTES;
use super::flat::stack::{Stack, Usable};
use super::frame::{Gain, GainSetting, mask};
use super::header::optics;
use super::role::Role;
use crate::base::stats::{median_variance_factor, robust};

/// Exposure times within this share of each other are the same.
const SAME_EXPTIME: f64 = 0.02;
/// A dark belongs to frames whose sensor was as warm within this \[°C\]: dark current doubles in 6 °C.
const SAME_TEMPERATURE_C: f64 = 1.0;
/// A pixel of a dark this many robust standard deviations above its median is hot (ccdproc `ccdmask` takes 9).
const HOT_SIGMA: f64 = 9.0;
/// A hot pixel is masked in frames to which it adds more than this many read noises.
pub(super) const HOT_READ_NOISES: f64 = 3.0;
/// Pixels that median and scatter of a master are taken of, at most.
const SAMPLE_PX: usize = 1 << 20;
/// Fewest frames of a master: with one or two, its own noise or a cosmic ray would enter every frame.
const FEWEST: usize = 3;

/// What biases and darks of one kind agree in.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Kind {
    size_px: (usize, usize),
    binning: u32,
    setting: Option<GainSetting>,
    offset: Option<i64>,
}

impl Kind {
    fn of(exposure: &Exposure) -> Self {
        let offset = optics(&exposure.header, &Default::default()).offset.map(|offset| offset.value as i64);
        Self { size_px: exposure.size_px, binning: exposure.binning, setting: exposure.setting, offset }
    }
}

/// The median of several frames inside the clip circle.
#[derive(Debug)]
struct Master {
    n: usize,
    /// Row by row over the box of the clip circle \[ADU\]; NaN outside the circle.
    level_adu: Vec<f32>,
    median_adu: f64,
    /// Robust standard deviation of its pixels \[ADU\].
    sigma_adu: f64,
}

#[derive(Debug)]
struct Dark {
    exptime_s: f64,
    temperature_c: Option<f64>,
    master: Master,
}

/// The biases and darks of a night, combined.
#[derive(Debug, Default)]
pub struct ZeroLevels {
    biases: BTreeMap<Kind, Master>,
    /// Of each kind, by exposure time.
    darks: BTreeMap<Kind, Vec<Dark>>,
    /// What should be known of them.
    pub notes: Vec<String>,
    /// Hash of all that went in.
    pub key: String,
}

/// The zero level of one frame.
#[derive(Debug, Clone)]
pub struct ZeroLevel<'a> {
    /// Subtracted as it is.
    base: &'a Master,
    /// Dark, bias and share of their difference that is added.
    dark: Option<(&'a Master, &'a Master, f32)>,
    /// Which frames, in words: `bias of 9`, `dark of 5 x 60 s`, `bias of 9, dark of 5 x 60 s times 0.5`.
    pub from: String,
}

impl ZeroLevels {
    /// Combines the biases and darks among `frames` that match one of `lights`.
    ///
    /// A frame that cannot be read is not used, with a note.
    #[must_use]
    pub fn make(frames: &[&Exposure], lights: &[&Exposure], clip_radius_px: Option<f64>) -> Self {
        let mut out = Self::default();
        let kinds: std::collections::BTreeSet<Kind> = lights.iter().map(|e| Kind::of(e)).collect();
        let of = |role: Role| frames.iter().copied().filter(move |e| e.role == role);
        let mut unmatched = 0;
        for kind in kinds {
            let region = Region::new(kind.size_px, clip_radius_px);
            let biases: Vec<&Exposure> = of(Role::Bias).filter(|e| Kind::of(e) == kind).collect();
            if let Some(master) = out.master("bias", biases, &region) {
                out.biases.insert(kind.clone(), master);
            }
            let mut by_exptime: Vec<(f64, Option<f64>, Vec<&Exposure>)> = Vec::new();
            for dark in of(Role::Dark).filter(|e| Kind::of(e) == kind && e.exptime_s > 0.0) {
                let temperature = temperature_c(dark);
                let same = by_exptime.iter_mut().find(|(exptime_s, t, _)| {
                    same_exptime(*exptime_s, dark.exptime_s) && same_temperature(*t, temperature)
                });
                match same {
                    Some((.., list)) => list.push(dark),
                    None => by_exptime.push((dark.exptime_s, temperature, vec![dark])),
                }
            }
            by_exptime.sort_by(|a, b| a.0.total_cmp(&b.0));
            let of_kind: Vec<&Exposure> = lights.iter().copied().filter(|e| Kind::of(e) == kind).collect();
            let has_bias = out.biases.contains_key(&kind);
            for (exptime_s, temperature, list) in by_exptime {
                let warm_as = |e: &&&Exposure| same_temperature(temperature, temperature_c(e));
                let serves = of_kind.iter().filter(warm_as).any(|e| has_bias || same_exptime(exptime_s, e.exptime_s));
                if !serves {
                    unmatched += list.len();
                    continue;
                }
                if let Some(master) = out.master("dark", list, &region) {
                    let dark = Dark { exptime_s, temperature_c: temperature, master };
                    out.darks.entry(kind.clone()).or_default().push(dark);
                }
            }
        }
        let without = lights.iter().filter(|e| out.of(e).is_none()).count();
        if without > 0 && !out.is_empty() {
            out.notes.push(format!(
                "warning: {without} of {} light frames have no bias frames of their GAIN, OFFSET, binning and size: \
                 detector.pedestal_adu is subtracted from them; take biases at each setting",
                lights.len()
            ));
        }
        let used = |e: &&Exposure| lights.iter().any(|light| Kind::of(light) == Kind::of(e));
        let others = of(Role::Bias).chain(of(Role::Dark)).filter(|e| !used(e)).count();
        if others > 0 {
            out.notes.push(format!(
                "{others} bias and dark frames match no light frame in size, binning, GAIN and OFFSET: not used"
            ));
        }
        if unmatched > 0 {
            out.notes.push(format!(
                "{unmatched} dark frames are not used: without biases a dark needs the exposure time of the frames, and always \
                 their temperature within {SAME_TEMPERATURE_C} C"
            ));
        }
        out
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.biases.is_empty() && self.darks.is_empty()
    }

    fn master(&mut self, what: &str, mut frames: Vec<&Exposure>, region: &Region) -> Option<Master> {
        // at the top of the range a pixel says nothing
        let usable = |exposure| Usable { exposure, level_adu: 1.0, saturation_adu: f32::INFINITY };
        let (nx, ny) = region.size_px;
        let mut level_adu = vec![0.0; nx * ny];
        // once more without those that cannot be read: each round has fewer
        loop {
            if frames.is_empty() {
                return None;
            }
            if frames.len() < FEWEST {
                self.notes
                    .push(format!("{} {what} frames are too few to be used; take at least {FEWEST}", frames.len()));
                return None;
            }
            let stack = Stack::open(frames.iter().copied().map(usable).collect(), false, 0.0, region);
            let unreadable = stack.median(BAND_BYTES, &mut level_adu);
            if unreadable.is_empty() {
                break;
            }
            for (k, error) in unreadable.into_iter().rev() {
                let frame = frames.remove(k);
                let why = error.to_string().replace(&*frame.path.to_string_lossy(), &frame.name);
                self.notes.push(format!("warning: {} is not used as {what}: {why}", frame.name));
            }
        }
        let step = level_adu.len().div_ceil(SAMPLE_PX);
        let sample = level_adu.iter().step_by(step.max(1)).filter(|v| v.is_finite());
        let Some((median_adu, sigma_adu)) = robust(&sample.map(|v| f64::from(*v)).collect::<Vec<_>>()) else {
            self.notes.push(format!("the {what} frames hold no finite pixel: not used"));
            return None;
        };
        Some(Master { n: frames.len(), level_adu, median_adu, sigma_adu })
    }

    /// The zero level of a frame; `None` where nothing matches it.
    #[must_use]
    pub fn of(&self, exposure: &Exposure) -> Option<ZeroLevel<'_>> {
        let kind = Kind::of(exposure);
        let bias = self.biases.get(&kind);
        let warm = temperature_c(exposure);
        let fits = |dark: &&Dark| same_temperature(dark.temperature_c, warm);
        let darks: Vec<&Dark> = self.darks.get(&kind).into_iter().flatten().filter(fits).collect();
        let words = |dark: &Dark| format!("dark of {} x {} s", dark.master.n, dark.exptime_s);
        if let Some(dark) = darks.iter().find(|dark| same_exptime(dark.exptime_s, exposure.exptime_s)) {
            let hot = bias.map(|bias| (&dark.master, bias, 0.0));
            return Some(ZeroLevel { base: &dark.master, dark: hot, from: words(dark) });
        }
        let bias = bias?;
        let of_bias = format!("bias of {}", bias.n);
        // downwards from the next longer one; upwards from the longest
        let longer = darks.iter().find(|dark| dark.exptime_s > exposure.exptime_s).or(darks.last());
        let Some(dark) = longer else { return Some(ZeroLevel { base: bias, dark: None, from: of_bias }) };
        let share = exposure.exptime_s / dark.exptime_s;
        let from = format!("{of_bias}, {} times {share:.3}", words(dark));
        Some(ZeroLevel { base: bias, dark: Some((&dark.master, bias, share as f32)), from })
    }
}

impl ZeroLevel<'_> {
    /// Whether a dark shows which pixels are hot.
    #[must_use]
    pub fn shows_hot_pixels(&self) -> bool {
        self.dark.is_some()
    }

    /// By how much its own noise makes the read noise of a frame larger: Z of n_B biases and n_D darks has the variance
    /// RN² ((1 − s)² m(n_B)/n_B + s² m(n_D)/n_D), m the variance of a median over that of a mean.
    #[must_use]
    pub fn noise_factor(&self) -> f64 {
        let of = |master: &Master| median_variance_factor(master.n) / master.n as f64;
        let variance = match self.dark {
            Some((dark, bias, share)) if share > 0.0 => {
                let share = f64::from(share);
                (1.0 - share).powi(2) * of(bias) + share * share * of(dark)
            }
            _ => of(self.base),
        };
        (1.0 + variance).sqrt()
    }

    /// Subtracts it from flattened electrons of which a constant pedestal was subtracted, and masks what is too hot.
    ///
    /// `at` are the places of the pixels in the box of the clip circle, row by row; `response` is the master flat over the same
    /// pixels. e⁻: N − g (Z − pedestal) / F.
    pub(super) fn subtract(
        &self,
        at: Range<usize>,
        pixels: &mut [f32],
        bits: &mut [u8],
        response: Option<&[f32]>,
        gain: &Gain,
    ) {
        let (g, pedestal) = (gain.e_per_adu.0 as f32, gain.pedestal_adu as f32);
        let base = &self.base.level_adu[at.clone()];
        for (k, pixel) in pixels.iter_mut().enumerate() {
            let mut zero_adu = base[k] - pedestal;
            if let Some((dark, bias, share)) = self.dark {
                let current = dark.level_adu[at.start + k] - bias.level_adu[at.start + k];
                zero_adu += share * current;
                // share 0: the dark itself is the base
                let added_adu = if share > 0.0 { share * current } else { current };
                let hot = f64::from(dark.level_adu[at.start + k]) > dark.median_adu + HOT_SIGMA * dark.sigma_adu;
                if hot && f64::from(g * added_adu) > HOT_READ_NOISES * gain.read_noise_e {
                    bits[k] |= mask::BAD;
                }
            }
            if zero_adu.is_finite() {
                let response = response.map_or(1.0, |r| r[k]);
                *pixel -= g * zero_adu / if response.is_finite() { response } else { 1.0 };
            } else {
                bits[k] |= mask::BAD;
            }
        }
    }
}

fn same_exptime(a_s: f64, b_s: f64) -> bool {
    (a_s - b_s).abs() <= SAME_EXPTIME * a_s.max(b_s)
}

/// A temperature that is not stated is no reason against a dark.
fn same_temperature(a_c: Option<f64>, b_c: Option<f64>) -> bool {
    a_c.zip(b_c).is_none_or(|(a, b)| (a - b).abs() <= SAME_TEMPERATURE_C)
}

fn temperature_c(exposure: &Exposure) -> Option<f64> {
    optics(&exposure.header, &Default::default()).temperature_c.map(|t| t.value)
}
