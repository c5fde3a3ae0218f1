//! The master flat: the median of the night's flats, each divided by its own level, streamed in row bands.
//!
//! Response without unit, median 1 inside the clip circle; levels in ADU above the pedestal. A pixel that is zero, low
//! or not a number is masked and never divided by. It does not cover darks and illumination correction.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use ndarray::parallel::prelude::*;
use ndarray::{Array2, Axis};

use super::counting::CountingMedian;
use super::levels::{level_step, median_inside, median_of_stored};
use super::needed::{needed, noise_area_px, noise_of_flat, noise_of_master};
use super::ratio::{limit, ratio_scatter};
use super::stack::{Stack, Usable};
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::pages::zeros;
use crate::config;
use crate::config::FlatScale;
use crate::fits::raw::guarded;
use crate::fits::tall::open_stored;
use crate::frames::camera::Detector;
use crate::frames::clip::Region;
use crate::frames::exposure::Exposure;
use crate::frames::read::{Pixels, TILE_ROWS};
use crate::frames::sample::never_filled;

/// Memory for the bands of all threads together, where nothing else is requested \[bytes\].
pub const BAND_BYTES: usize = 32 << 20;

/// One flat of the night and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlatMember {
    /// The file.
    #[serde(with = "crate::base::path_text")]
    pub path: PathBuf,
    /// Median level inside the clip circle, above the pedestal \[ADU\]; NaN if it could not be read. Of a large frame,
    /// that of rows which hold 2 million pixels.
    pub level_adu: f64,
    /// Whether it is part of the master.
    pub used: bool,
    /// Whether it could be, and fewer are enough for `flat.noise_frac`.
    #[serde(default)]
    pub not_needed: bool,
    /// Why not; empty if used.
    pub reason: String,
    /// Noise of a pixel at the median level; `None` where gain or level are not known.
    #[serde(default)]
    pub noise_frac: Option<f64>,
    /// Scatter of its ratio to the master over blocks of the frame, a plane subtracted.
    #[serde(default)]
    pub ratio_scatter_frac: Option<f64>,
    /// The scatter above which it differs from the others; `None` for fewer than four flats.
    #[serde(default)]
    pub ratio_limit_frac: Option<f64>,
}

/// The detector's response, to divide frames by.
#[derive(Debug, Clone)]
pub struct MasterFlat {
    /// Response, median 1; shape (ny, nx) of the clip circle's box. NaN where masked or outside.
    pub response: Array2<f32>,
    /// Full-frame (x, y) of `response[[0, 0]]` \[px\].
    pub origin_px: (usize, usize),
    /// Full-frame size (nx, ny) \[px\].
    pub full_size_px: (usize, usize),
    /// Every flat that was offered.
    pub members: Vec<FlatMember>,
    /// Share of the pixels inside the clip circle that are masked.
    pub masked_frac: f64,
    /// Filter of the flats, where all agree.
    pub filter: Option<String>,
    /// Noise of a pixel at the median level, by photons and read noise of the flats; `None` where it is not known.
    pub noise_frac: Option<f64>,
}

impl MasterFlat {
    /// Makes the master of `flats`.
    ///
    /// F = median_k[(N_k − pedestal) / level_k], then divided by its own median. Levels and medians inside the clip
    /// circle. With `config.scale` none, or levels that are all the same, level_k is excluded, and 16-bit files are
    /// combined as they are stored: less work. A saturated or NaN pixel is excluded from its median; with at most half of
    /// the flats left, or at or below `config.min_response`, it is masked. Flats of another size than most, of a level
    /// outside `config.level_range_frac` of full scale, that cannot be read, be it while they are combined, or whose ratio
    /// to the master is not that of the others, are rejected with a reason. With `config.noise_frac` only as many are combined
    /// as make a pixel of the master that certain: others take the place of those that turn out to be rejected.
    ///
    /// Memory: the result, and `band_bytes` for the bands of all threads together. The result depends on neither.
    ///
    /// # Errors
    /// [`Error::Flat`] if fewer than `config.min_flats` are usable, naming the reasons.
    pub fn make(
        flats: &[Exposure],
        detector: &Detector,
        config: &config::Flat,
        clip_radius_px: Option<f64>,
        band_bytes: usize,
    ) -> Result<MasterFlat> {
        let size_px = common_size(flats).ok_or_else(|| Error::Flat {
            problem: "no flat was found; check IMAGETYP or frames.flat, or name a master in flat.master".into(),
        })?;
        let region = Region::new(size_px, clip_radius_px);
        let detector = &detector.at_overscan_of(flats);
        let checked: Vec<(FlatMember, f32)> =
            flats.par_iter().map(|flat| check_member(flat, detector, config, &region)).collect();
        let (mut members, saturation_adu): (Vec<FlatMember>, Vec<f32>) = checked.into_iter().unzip();
        let (nx, ny) = region.size_px;
        let first = flats.first().map_or(Path::new(""), |flat| flat.path.as_path());
        let mut values = zeros(first, nx * ny)?;
        let mut compared: Vec<usize> = Vec::new();
        // Once more without those that turn out to be unreadable where their level did not look, and once without those
        // that differ from the others: each round has fewer.
        let (filter, values, used) = loop {
            let usable: Vec<usize> = (0..flats.len()).filter(|k| members[*k].used).collect();
            let used: Vec<usize> = needed(&noises(&members, &usable), config.noise_frac, config.min_flats)
                .into_iter()
                .map(|i| usable[i])
                .collect();
            if used.len() < config.min_flats.max(1) {
                return Err(Error::Flat { problem: too_few(&members, config.min_flats.max(1)) });
            }
            let usable = used.iter().map(|k| Usable {
                exposure: &flats[*k],
                level_adu: members[*k].level_adu,
                saturation_adu: saturation_adu[*k],
            });
            let usable: Vec<Usable> = usable.collect();
            // One level for all makes no difference, once the master is divided by its median.
            let scale = config.scale == FlatScale::Level && usable.windows(2).any(|w| w[0].level_adu != w[1].level_adu);
            let filter = usable.first().and_then(|u| u.exposure.filter.clone());
            let filter = filter.filter(|f| usable.iter().all(|u| u.exposure.filter.as_ref() == Some(f)));
            let unreadable =
                Stack::open(usable, scale, detector.pedestal_adu(), &region).median(band_bytes, &mut values);
            if unreadable.is_empty() {
                let master =
                    Array2::from_shape_vec((ny, nx), values).map_err(|e| Error::Flat { problem: e.to_string() })?;
                let again = used.iter().any(|k| !compared.contains(k))
                    && set_different_aside(flats, &mut members, &used, &master, (detector, config, &region));
                values = master.into_raw_vec_and_offset().0;
                if !again {
                    break (filter, values, used);
                }
                compared.clone_from(&used);
            }
            for (k, error) in unreadable {
                let member = &mut members[used[k]];
                (member.used, member.reason) = (false, reason(&flats[used[k]], &error));
            }
        };
        let response = Array2::from_shape_vec((ny, nx), values).map_err(|e| Error::Flat { problem: e.to_string() })?;
        let noise_frac = noise_of_master(&noises(&members, &used));
        set_not_needed_aside(&mut members, &used, noise_frac, config.noise_frac);
        let master = Self::finish(response, &region, config.min_response, true, members, filter)?;
        Ok(MasterFlat { noise_frac, ..master })
    }

    /// Mean response under the image of a point: over the square of its noise-equivalent area; `None` where it reaches over the edge
    /// or a masked pixel.
    #[must_use]
    pub fn mean_under_point(&self, x_px: f64, y_px: f64, fwhm_px: f64) -> Option<f64> {
        let half_px = (noise_area_px(fwhm_px).sqrt() / 2.0).round();
        let range = |at_px: f64, origin_px: usize| {
            let (lo, hi) = (at_px.round() - half_px - origin_px as f64, at_px.round() + half_px - origin_px as f64);
            (lo >= 0.0).then_some(lo as usize..hi as usize + 1)
        };
        let (columns, rows) = (range(x_px, self.origin_px.0)?, range(y_px, self.origin_px.1)?);
        let (ny, nx) = self.response.dim();
        if columns.end > nx || rows.end > ny {
            return None;
        }
        let under = self.response.slice(ndarray::s![rows, columns]);
        Some(under.iter().map(|r| f64::from(*r)).sum::<f64>() / under.len() as f64).filter(|mean| mean.is_finite())
    }

    /// Normalises (where configured) and masks what must not be divided by.
    pub(crate) fn finish(
        mut response: Array2<f32>,
        region: &Region,
        min_response: f64,
        normalise: bool,
        members: Vec<FlatMember>,
        filter: Option<String>,
    ) -> Result<MasterFlat> {
        let level = if normalise {
            median_inside(&response, region).filter(|m| *m > 0.0 && m.is_finite()).ok_or_else(|| Error::Flat {
                problem: "the median of the master flat is not positive: the flats hold no light above the pedestal (detector.pedestal_adu)".into(),
            })?
        } else {
            1.0
        };
        let lowest = min_response.max(0.0) as f32;
        let rows = response.axis_iter_mut(Axis(0)).into_par_iter().enumerate();
        let counts = rows.map(|(j, mut row)| match row.as_slice_mut() {
            Some(values) => (region.inside(j).len(), finish_row(values, region.inside(j), level, lowest)),
            None => (0, 0),
        });
        let (inside, masked) = counts.reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        if masked == inside {
            return Err(Error::Flat {
                problem: format!("every pixel of the master flat is at or below flat.min_response = {min_response}"),
            });
        }
        Ok(MasterFlat {
            response,
            origin_px: region.origin_px,
            full_size_px: region.full_size_px,
            members,
            masked_frac: masked as f64 / inside.max(1) as f64,
            filter,
            noise_frac: None,
        })
    }
}

/// Divides a row by the master's level and masks what must not be divided by; how many of those are `inside`.
fn finish_row(values: &mut [f32], inside: Range<usize>, level: f64, lowest: f32) -> usize {
    let masked = |values: &[f32]| values.iter().map(|v| usize::from(v.is_nan())).sum::<usize>();
    for value in values.iter_mut() {
        let response = (f64::from(*value) / level) as f32;
        // Written so that NaN is masked too.
        *value = if response > lowest && response < f32::INFINITY { response } else { f32::NAN };
    }
    masked(&values[inside])
}

/// The size most flats have; the first of equals.
pub(crate) fn common_size(flats: &[Exposure]) -> Option<(usize, usize)> {
    let mut votes: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    flats.iter().for_each(|f| *votes.entry(f.size_px).or_default() += 1);
    let most = votes.values().copied().max()?;
    flats.iter().map(|f| f.size_px).find(|s| votes.get(s) == Some(&most)).filter(|s| s.0 > 0 && s.1 > 0)
}

/// Measures the level of a flat and judges it; second: its saturation level \[ADU\].
fn check_member(flat: &Exposure, detector: &Detector, config: &config::Flat, region: &Region) -> (FlatMember, f32) {
    // A flat needs no electrons: with an unknown gain the converter alone says what is saturated.
    let gain = detector.gain(flat).ok();
    let saturation_adu = gain.as_ref().map_or(detector.saturation_of_converter_adu(), |g| g.saturation_adu);
    let full_adu = saturation_adu / detector.saturation_frac() - detector.pedestal_adu();
    let mut member = FlatMember {
        path: flat.path.clone(),
        level_adu: f64::NAN,
        used: false,
        not_needed: false,
        reason: String::new(),
        noise_frac: None,
        ratio_scatter_frac: None,
        ratio_limit_frac: None,
    };
    if flat.size_px != region.full_size_px {
        let ((a, b), (c, d)) = (flat.size_px, region.full_size_px);
        member.reason = format!("{a}x{b} px, most flats are {c}x{d} px");
        return (member, 0.0);
    }
    if let Ok(Some(adu)) = never_filled(flat, region.radius_px)
        && f64::from(adu) < saturation_adu
    {
        member.reason = format!("every pixel is {adu} ADU: the file was never filled");
        return (member, 0.0);
    }
    let [lo, hi] = config.level_range_frac;
    match level_adu(flat, region) {
        Err(error) => member.reason = reason(flat, &error),
        Ok(None) => member.reason = "no finite pixel inside the clip circle".into(),
        Ok(Some(median)) => {
            member.level_adu = median - detector.pedestal_adu();
            member.noise_frac =
                gain.map(|gain| noise_of_flat(member.level_adu, &gain)).filter(|noise| noise.is_finite());
            let share = member.level_adu / full_adu;
            if member.level_adu > 0.0 && share >= lo && share <= hi {
                member.used = true;
            } else {
                member.reason = format!(
                    "level {:.0} ADU above the pedestal is {share:.3} of full scale, outside flat.level_range_frac {lo} to {hi}",
                    member.level_adu
                );
            }
        }
    }
    (member, saturation_adu as f32)
}

/// Median of the raw pixels inside the clip circle \[ADU\], of every [`level_step`]-th row.
fn level_adu(flat: &Exposure, region: &Region) -> Result<Option<f64>> {
    if let Some(stored) = open_stored(&flat.path, &flat.header)? {
        return median_of_stored(&stored, region);
    }
    guarded(&flat.path, || {
        let (nx, ny) = region.size_px;
        let mut pixels = Pixels::open(&flat.path, &flat.header)?;
        let step = level_step(region);
        let at_once = if step == 1 { TILE_ROWS } else { 1 };
        let mut tile = vec![0f32; nx * at_once];
        CountingMedian::new().of(|count| {
            for row in (step / 2..ny).step_by(step.max(at_once)) {
                let rows = at_once.min(ny - row);
                let tile = &mut tile[..nx * rows];
                pixels.read((region.origin_px.0, region.origin_px.1 + row), (nx, rows), tile)?;
                for (j, values) in tile.chunks(nx).enumerate() {
                    count(&values[region.inside(row + j)]);
                }
            }
            Ok(())
        })
    })
}

/// Why a flat cannot be read; by its name: where it lies is nothing of a result's.
fn reason(flat: &Exposure, error: &Error) -> String {
    error.to_string().replace(&*flat.path.to_string_lossy(), &flat.name)
}

/// Noise of a pixel of some of the flats.
fn noises(members: &[FlatMember], which: &[usize]) -> Vec<Option<f64>> {
    which.iter().map(|k| members[*k].noise_frac).collect()
}

/// The flats that could be used and are not needed, with the reason.
fn set_not_needed_aside(members: &mut [FlatMember], used: &[usize], noise: Option<f64>, accepted: Option<f64>) {
    let could = members.iter().filter(|m| m.used).count();
    for (_, member) in members.iter_mut().enumerate().filter(|(k, m)| m.used && !used.contains(k)) {
        (member.used, member.not_needed) = (false, true);
        member.reason = format!(
            "not needed: with {} of {could} flats the noise of a pixel is {:.5}, flat.noise_frac = {}",
            used.len(),
            noise.unwrap_or(f64::NAN),
            accepted.unwrap_or(f64::NAN)
        );
    }
}

/// Compares the flats of a master with it and marks those that differ as not used, where enough others are left; whether there
/// are any.
fn set_different_aside(
    flats: &[Exposure],
    members: &mut [FlatMember],
    used: &[usize],
    master: &Array2<f32>,
    (detector, config, region): (&Detector, &config::Flat, &Region),
) -> bool {
    let scatters: Vec<Option<f64>> = used
        .par_iter()
        .map(|k| {
            let levels = (members[*k].level_adu, detector.pedestal_adu());
            // a file that cannot be read now was read a moment ago: nothing is known of its ratio
            ratio_scatter(&flats[*k], levels, master, region).ok().flatten()
        })
        .collect();
    let known: Vec<f64> = scatters.iter().flatten().copied().collect();
    let limit = limit(&known);
    let differs = |scatter: Option<f64>| scatter.zip(limit).is_some_and(|(scatter, limit)| scatter > limit);
    let left = scatters.iter().filter(|s| !differs(**s)).count();
    for (k, scatter) in used.iter().zip(scatters) {
        let member = &mut members[*k];
        (member.ratio_scatter_frac, member.ratio_limit_frac) = (scatter, limit.filter(|_| scatter.is_some()));
        if let Some((scatter, limit)) =
            scatter.zip(limit).filter(|_| differs(scatter) && left >= config.min_flats.max(1))
        {
            member.used = false;
            member.reason = format!(
                "its ratio to the others scatters by {:.2} % over the frame, where {:.2} % is the limit: is it of another \
                 filter, camera or focus?",
                100.0 * scatter,
                100.0 * limit
            );
        }
    }
    left < known.len() && left >= config.min_flats.max(1)
}

fn too_few(members: &[FlatMember], need: usize) -> String {
    let used = members.iter().filter(|m| m.used).count();
    let reasons: Vec<String> =
        members.iter().filter(|m| !m.used).take(5).map(|m| format!("{}: {}", file_name(&m.path), m.reason)).collect();
    let why = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join("; ")) };
    format!("{used} of {} flats are usable, flat.min_flats = {need}{why}", members.len())
}
