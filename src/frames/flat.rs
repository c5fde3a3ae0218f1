//! The master flat: the median of the night's flats, each divided by its own level, streamed in row bands.
//!
//! Response without unit, median 1 inside the clip circle; levels in ADU above the pedestal. A pixel that is zero, low
//! or not a number is masked and never divided by. Leaves out darks and illumination correction.

use std::collections::BTreeMap;
use std::path::PathBuf;

use ndarray::Array2;
use rayon::prelude::*;

use super::clip::Region;
use super::detector::Detector;
use super::exposure::Exposure;
use super::frame::mask;
use super::median::{CountingMedian, StackMedian};
use super::raw::guarded;
use super::read::{Pixels, TILE_ROWS};
use crate::config;
use crate::error::{Error, Result};

/// Memory for the bands of all threads together \[bytes\].
const BAND_BYTES: usize = 48 << 20;

/// One flat of the night and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatMember {
    /// The file.
    pub path: PathBuf,
    /// Median level inside the clip circle, above the pedestal \[ADU\]; NaN if it could not be read.
    pub level_adu: f64,
    /// Whether it is part of the master.
    pub used: bool,
    /// Why not; empty if used.
    pub reason: String,
}

/// The detector's response, to divide frames by.
#[derive(Debug, Clone)]
pub struct MasterFlat {
    /// Response, median 1, NaN where masked; shape (ny, nx) of the clip circle's box.
    pub response: Array2<f32>,
    /// [`mask::BAD`] where the response must not be used, same shape.
    pub mask: Array2<u8>,
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
}

/// A usable flat: its place in the list, level, and saturation level.
struct Usable<'a> {
    exposure: &'a Exposure,
    level_adu: f64,
    saturation_adu: f32,
}

impl MasterFlat {
    /// Makes the master of `flats`.
    ///
    /// F = median_k[(N_k − pedestal) / level_k], then divided by its own median. Levels and medians inside the clip
    /// circle. A saturated or NaN pixel is left out of its median; with at most half of the flats left, or at or below
    /// `config.min_response`, it is masked. Flats of another size than most, or of a level outside
    /// `config.level_range_frac` of full scale, are rejected with a reason.
    ///
    /// Memory: the result and 48 MB.
    ///
    /// # Errors
    /// [`Error::Flat`] if fewer than `config.min_flats` are usable, naming the reasons.
    pub fn make(
        flats: &[Exposure],
        detector: &Detector,
        config: &config::Flat,
        clip_radius_px: Option<f64>,
    ) -> Result<MasterFlat> {
        let size_px = common_size(flats).ok_or_else(|| Error::Flat {
            problem: "no flat was found; check IMAGETYP or frames.flat, or name a master in flat.master".into(),
        })?;
        let region = Region::new(size_px, clip_radius_px);
        let checked: Vec<(FlatMember, f32)> =
            flats.par_iter().map(|flat| check_member(flat, detector, config, &region)).collect();
        let usable: Vec<Usable> = flats
            .iter()
            .zip(&checked)
            .filter(|(_, (member, _))| member.used)
            .map(|(exposure, (member, saturation_adu))| Usable {
                exposure,
                level_adu: member.level_adu,
                saturation_adu: *saturation_adu,
            })
            .collect();
        let members: Vec<FlatMember> = checked.iter().map(|(m, _)| m.clone()).collect();
        if usable.len() < config.min_flats.max(1) {
            return Err(Error::Flat { problem: too_few(&members, config.min_flats.max(1)) });
        }
        let (nx, ny) = region.size_px;
        let mut values = vec![0f32; nx * ny];
        let rows = (BAND_BYTES / rayon::current_num_threads().max(1) / (usable.len() * nx * 4)).clamp(1, TILE_ROWS);
        values.par_chunks_mut(nx * rows).enumerate().try_for_each_init(
            || (StackMedian::new(usable.len()), Vec::new()),
            |(median, stack), (band, out)| {
                combine_band(&usable, detector.pedestal_adu(), &region, band * rows, median, stack, out)
            },
        )?;
        let response = Array2::from_shape_vec((ny, nx), values).map_err(|e| Error::Flat { problem: e.to_string() })?;
        let filter = usable.first().and_then(|u| u.exposure.filter.clone());
        let filter = filter.filter(|f| usable.iter().all(|u| u.exposure.filter.as_ref() == Some(f)));
        Self::finish(response, &region, config.min_response, true, members, filter)
    }

    /// Normalises (where asked) and masks what must not be divided by.
    pub(super) fn finish(
        mut response: Array2<f32>,
        region: &Region,
        min_response: f64,
        normalise: bool,
        members: Vec<FlatMember>,
        filter: Option<String>,
    ) -> Result<MasterFlat> {
        if normalise {
            let level = median_inside(&response, region).filter(|m| *m > 0.0 && m.is_finite()).ok_or_else(|| Error::Flat {
                problem: "the median of the master flat is not positive: the flats hold no light above the pedestal (detector.pedestal_adu)".into(),
            })?;
            response.mapv_inplace(|v| (f64::from(v) / level) as f32);
        }
        let lowest = min_response.max(0.0) as f32;
        let mut bits = Array2::zeros(response.dim());
        let (mut inside, mut masked) = (0usize, 0usize);
        for (j, (mut values, mut row)) in response.outer_iter_mut().zip(bits.outer_iter_mut()).enumerate() {
            let kept = region.inside(j);
            inside += kept.len();
            for (i, (value, bit)) in values.iter_mut().zip(row.iter_mut()).enumerate() {
                // Written so that NaN is masked too.
                if !(*value > lowest && value.is_finite()) {
                    *value = f32::NAN;
                    *bit = mask::BAD;
                    masked += usize::from(kept.contains(&i));
                }
            }
        }
        if masked == inside {
            return Err(Error::Flat {
                problem: format!("every pixel of the master flat is at or below flat.min_response = {min_response}"),
            });
        }
        Ok(MasterFlat {
            response,
            mask: bits,
            origin_px: region.origin_px,
            full_size_px: region.full_size_px,
            members,
            masked_frac: masked as f64 / inside.max(1) as f64,
            filter,
        })
    }
}

/// The size most flats have; the first of equals.
fn common_size(flats: &[Exposure]) -> Option<(usize, usize)> {
    let mut votes: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    flats.iter().for_each(|f| *votes.entry(f.size_px).or_default() += 1);
    let most = votes.values().copied().max()?;
    flats.iter().map(|f| f.size_px).find(|s| votes.get(s) == Some(&most)).filter(|s| s.0 > 0 && s.1 > 0)
}

/// Measures the level of a flat and judges it; second: its saturation level \[ADU\].
fn check_member(flat: &Exposure, detector: &Detector, config: &config::Flat, region: &Region) -> (FlatMember, f32) {
    // A flat needs no electrons: with an unknown gain the converter alone says what is saturated.
    let gain = detector.gain(flat).ok();
    let saturation_adu = gain.map_or(detector.saturation_of_converter_adu(), |g| g.saturation_adu);
    let full_adu = saturation_adu / detector.saturation_frac() - detector.pedestal_adu();
    let mut member = FlatMember { path: flat.path.clone(), level_adu: f64::NAN, used: false, reason: String::new() };
    if flat.size_px != region.full_size_px {
        let ((a, b), (c, d)) = (flat.size_px, region.full_size_px);
        member.reason = format!("{a}x{b} px, most flats are {c}x{d} px");
        return (member, 0.0);
    }
    match level_adu(flat, region) {
        Err(e) => member.reason = e.to_string(),
        Ok(None) => member.reason = "no finite pixel inside the clip circle".into(),
        Ok(Some(median)) => {
            member.level_adu = median - detector.pedestal_adu();
            let [lo, hi] = config.level_range_frac;
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

/// Median of the raw pixels inside the clip circle \[ADU\].
fn level_adu(flat: &Exposure, region: &Region) -> Result<Option<f64>> {
    guarded(&flat.path, || {
        let (nx, ny) = region.size_px;
        let mut pixels = Pixels::open(&flat.path, &flat.header)?;
        let mut tile = vec![0f32; nx * TILE_ROWS];
        CountingMedian::new().of(|count| {
            for row in (0..ny).step_by(TILE_ROWS) {
                let rows = TILE_ROWS.min(ny - row);
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

/// One band of rows: every flat's pixels, scaled, then the median.
fn combine_band(
    usable: &[Usable],
    pedestal_adu: f64,
    region: &Region,
    first_row: usize,
    median: &mut StackMedian,
    stack: &mut Vec<f32>,
    out: &mut [f32],
) -> Result<()> {
    let nx = region.size_px.0;
    stack.resize(usable.len() * out.len(), 0.0);
    for (flat, values) in usable.iter().zip(stack.chunks_mut(out.len())) {
        let path = &flat.exposure.path;
        guarded(path, || {
            let origin = (region.origin_px.0, region.origin_px.1 + first_row);
            Pixels::open(path, &flat.exposure.header)?.read(origin, (nx, values.len() / nx), values)
        })?;
        let (pedestal, per_level) = (pedestal_adu as f32, (1.0 / flat.level_adu) as f32);
        for v in values.iter_mut() {
            // Saturated, infinite and NaN pixels do not vote.
            *v = if *v < flat.saturation_adu && v.is_finite() { (*v - pedestal) * per_level } else { f32::NAN };
        }
    }
    median.run(stack, out);
    Ok(())
}

/// Median of the finite pixels inside the circle.
pub(super) fn median_inside(response: &Array2<f32>, region: &Region) -> Option<f64> {
    let of = CountingMedian::new().of(|count| {
        for (j, row) in response.outer_iter().enumerate() {
            if let Some(values) = row.as_slice() {
                count(&values[region.inside(j)]);
            }
        }
        Ok::<(), Error>(())
    });
    of.ok().flatten()
}

fn too_few(members: &[FlatMember], need: usize) -> String {
    let used = members.iter().filter(|m| m.used).count();
    let name = |m: &FlatMember| m.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let reasons: Vec<String> =
        members.iter().filter(|m| !m.used).take(5).map(|m| format!("{}: {}", name(m), m.reason)).collect();
    let why = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join("; ")) };
    format!("{used} of {} flats are usable, flat.min_flats = {need}{why}", members.len())
}
