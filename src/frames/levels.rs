//! The exact median of millions of pixels, read once: a few rows bracket it, then what is below the bracket is only
//! counted, on lanes, and what falls inside is looked at.
//!
//! ADU for counts; no units for responses. Where the sample misled, or the image is small, everything is counted
//! instead ([`CountingMedian`]), so that the result is exact always. NaN is not counted.

use multiversion::multiversion;
use ndarray::Array2;
use rayon::prelude::*;

use super::clip::Region;
use super::counting::{CountingMedian, find};
use super::stored::{PIXEL_BYTES, Stored};
use crate::error::{Error, Result};

/// One row in so many makes the sample of an image of counts: its cost is that of the second pass.
const SAMPLE_ROWS: usize = 32;
/// The same for responses, which are sorted, not counted.
const SAMPLE_RESPONSE_ROWS: usize = 128;
/// Pixels below which a sample saves nothing.
const SMALL_PX: usize = 1 << 18;
/// Rows read at a time: they stay in a core's cache.
const READ_ROWS: usize = 16;
/// Pixels judged at once: few, so that few groups hold one inside the bracket.
const LANES: usize = 32;

/// Ranks of a sample of `n` (at least 1) between which the median lies: ±4σ of the rank of an independent sample.
fn bracket(n: usize) -> (usize, usize) {
    let reach = 2 * n.isqrt() + 1;
    ((n / 2).saturating_sub(reach), (n / 2 + reach).min(n - 1))
}

/// The two middle values from `at(rank)`, `None` where that does not know.
fn middle_of(total: u64, at: impl Fn(u64) -> Option<f64>) -> Option<f64> {
    let last = total.checked_sub(1)?;
    Some((at(last / 2)? + at(total / 2)?) / 2.0)
}

/// Median of the counts inside the circle \[ADU\]; `None` if there are none.
///
/// # Errors
/// Those of reading the file.
pub(super) fn median_of_stored(stored: &Stored, region: &Region) -> Result<Option<f64>> {
    let total: usize = (0..region.size_px.1).map(|j| region.inside(j).len()).sum();
    let mut bytes = Vec::new();
    if total >= SMALL_PX {
        let mut sample = Histogram::new(0, u16::MAX);
        each_row(stored, region, SAMPLE_ROWS, &mut bytes, |pixels| sample.add(pixels))?;
        if sample.counted > 0 {
            let (lo, hi) = bracket(sample.counted as usize);
            let mut tally = Tally::new(sample.at(lo as u64), sample.at(hi as u64));
            each_row(stored, region, 1, &mut bytes, |pixels| tally.add(pixels))?;
            let median = middle_of(total as u64, |rank| tally.at(rank));
            if median.is_some() {
                return Ok(median);
            }
        }
    }
    let mut all = Histogram::new(0, u16::MAX);
    each_row(stored, region, 1, &mut bytes, |pixels| all.add(pixels))?;
    Ok(middle_of(all.counted, |rank| Some(f64::from(all.at(rank)))))
}

/// Median of the counts of one row in 32 inside the circle \[ADU\]: a thirtieth of the work, and as good as a thirtieth of
/// the pixels. `None` if there are none.
///
/// # Errors
/// Those of reading the file.
pub(super) fn median_of_sample(stored: &Stored, region: &Region) -> Result<Option<f64>> {
    let mut sample = Histogram::new(0, u16::MAX);
    each_row(stored, region, SAMPLE_ROWS.min(region.size_px.1), &mut Vec::new(), |pixels| sample.add(pixels))?;
    Ok(middle_of(sample.counted, |rank| Some(f64::from(sample.at(rank)))))
}

/// Hands on the stored pixels inside the circle of every `step`-th row, from the middle of the first step.
fn each_row(
    stored: &Stored,
    region: &Region,
    step: usize,
    bytes: &mut Vec<u8>,
    mut each: impl FnMut(&[[u8; PIXEL_BYTES]]),
) -> Result<()> {
    let ((x0, y0), (nx, ny)) = (region.origin_px, region.size_px);
    if step == 1 && region.radius_px.is_none() {
        for row in (0..ny).step_by(READ_ROWS) {
            stored.read((x0, y0 + row), (nx, READ_ROWS.min(ny - row)), bytes)?;
            each(bytes.as_chunks().0);
        }
        return Ok(());
    }
    for row in (step / 2..ny).step_by(step) {
        let inside = region.inside(row);
        bytes.resize(inside.len() * PIXEL_BYTES, 0);
        stored.read_span(y0 + row, x0 + inside.start..x0 + inside.end, bytes)?;
        each(bytes.as_chunks().0);
    }
    Ok(())
}

/// How often each count from `first` to `last` occurs.
struct Histogram {
    first: u16,
    counts: Vec<u32>,
    counted: u64,
}

impl Histogram {
    fn new(first: u16, last: u16) -> Self {
        Self { first, counts: vec![0; usize::from(last.saturating_sub(first)) + 1], counted: 0 }
    }

    /// Counts pixels; those outside are left out.
    fn add(&mut self, pixels: &[[u8; PIXEL_BYTES]]) {
        for pixel in pixels {
            let bin = super::stored::count(*pixel).wrapping_sub(self.first);
            if let Some(count) = self.counts.get_mut(usize::from(bin)) {
                *count += 1;
                self.counted += 1;
            }
        }
    }

    /// The count of this rank.
    fn at(&self, rank: u64) -> u16 {
        self.first + find(&self.counts, rank).0 as u16
    }
}

/// Ranks around a bracket: how many counts are below `low`, at most `low`, at most `high`, and which lie between.
struct Tally {
    low: u16,
    high: u16,
    below: u64,
    to_low: u64,
    to_high: u64,
    between: Histogram,
}

impl Tally {
    fn new(low: u16, high: u16) -> Self {
        let between = Histogram::new(low.saturating_add(1), high.saturating_sub(1));
        Self { low, high, below: 0, to_low: 0, to_high: 0, between }
    }

    fn add(&mut self, pixels: &[[u8; PIXEL_BYTES]]) {
        let stored = |count: u16| (count ^ 0x8000) as i16;
        let many_between = self.high > self.low.saturating_add(1);
        let between = &mut self.between;
        // A lane counts to 65 535.
        for part in pixels.chunks(LANES * 32_768) {
            let counts = tally_counts(part, stored(self.low), stored(self.high), &mut |touched| {
                if many_between {
                    between.add(touched);
                }
            });
            self.below += counts[0];
            self.to_low += counts[1];
            self.to_high += counts[2];
        }
    }

    /// The count of this rank, where it is inside the bracket.
    fn at(&self, rank: u64) -> Option<f64> {
        let count = if rank < self.below || rank >= self.to_high {
            return None;
        } else if rank < self.to_low {
            self.low
        } else if rank < self.to_low + self.between.counted {
            self.between.at(rank - self.to_low)
        } else {
            self.high
        };
        Some(f64::from(count))
    }
}

/// How many are below `low`, at most `low`, at most `high`; calls `touched` with groups that hold any between.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn tally_counts(
    pixels: &[[u8; PIXEL_BYTES]],
    low: i16,
    high: i16,
    touched: &mut dyn FnMut(&[[u8; PIXEL_BYTES]]),
) -> [u64; 3] {
    let (mut below, mut to_low, mut to_high) = ([0u16; LANES], [0u16; LANES], [0u16; LANES]);
    let (groups, rest) = pixels.as_chunks::<LANES>();
    for group in groups {
        let mut between = [0u16; LANES];
        for l in 0..LANES {
            let v = i16::from_be_bytes(group[l]);
            below[l] += u16::from(v < low);
            to_low[l] += u16::from(v <= low);
            to_high[l] += u16::from(v <= high);
            between[l] = u16::from((v > low) & (v < high));
        }
        if between.iter().fold(0, |any, b| any | b) != 0 {
            touched(group);
        }
    }
    let sum = |lanes: &[u16; LANES]| lanes.iter().map(|n| u64::from(*n)).sum::<u64>();
    let mut counts = [sum(&below), sum(&to_low), sum(&to_high)];
    for pixel in rest {
        let v = i16::from_be_bytes(*pixel);
        counts[0] += u64::from(v < low);
        counts[1] += u64::from(v <= low);
        counts[2] += u64::from(v <= high);
    }
    touched(rest);
    counts
}

/// Median of the pixels inside the circle that are not NaN; `None` if there are none.
pub(super) fn median_inside(response: &Array2<f32>, region: &Region) -> Option<f64> {
    let (ny, nx) = response.dim();
    let values = response.as_slice().filter(|v| v.len() >= SMALL_PX);
    values.and_then(|values| median_by_bracket(values, (nx, ny), region)).or_else(|| {
        let of = CountingMedian::new().of(|count| {
            for (j, row) in response.outer_iter().enumerate() {
                if let Some(values) = row.as_slice() {
                    count(&values[region.inside(j)]);
                }
            }
            Ok::<(), Error>(())
        });
        of.ok().flatten()
    })
}

/// The same in one pass; `None` where the sample misled.
fn median_by_bracket(values: &[f32], (nx, ny): (usize, usize), region: &Region) -> Option<f64> {
    let row = |j: usize| &values[j * nx..(j + 1) * nx][region.inside(j)];
    let step = SAMPLE_RESPONSE_ROWS.min(ny.div_ceil(8));
    let rows = (step / 2..ny).step_by(step).flat_map(row);
    let mut sample: Vec<f32> = rows.copied().filter(|v| !v.is_nan()).collect();
    let (lo, hi) = bracket(Some(sample.len()).filter(|n| *n > 0)?);
    let low = *sample.select_nth_unstable_by(lo, f32::total_cmp).1;
    let high = *sample.select_nth_unstable_by(hi, f32::total_cmp).1;
    let most = values.len() / 16;
    let parts: Vec<([u64; 4], Vec<f32>)> = (0..ny.div_ceil(READ_ROWS))
        .into_par_iter()
        .map(|part| {
            let (mut counts, mut between) = ([0u64; 4], Vec::new());
            for j in part * READ_ROWS..((part + 1) * READ_ROWS).min(ny) {
                let row = tally_values(row(j), low, high, &mut between);
                counts.iter_mut().zip(row).for_each(|(sum, n)| *sum += n);
            }
            (counts, between)
        })
        .collect();
    let sum = |k: usize| parts.iter().map(|(counts, _)| counts[k]).sum::<u64>();
    let (below, to_low, to_high, total) = (sum(0), sum(1), sum(2), sum(3));
    let mut between: Vec<f32> = Vec::new();
    if parts.iter().map(|(_, b)| b.len()).sum::<usize>() > most {
        return None;
    }
    parts.iter().for_each(|(_, b)| between.extend(b));
    between.sort_unstable_by(f32::total_cmp);
    middle_of(total, |rank| {
        if rank < below || rank >= to_high {
            return None;
        }
        if rank < to_low {
            return Some(f64::from(low));
        }
        Some(f64::from(between.get((rank - to_low) as usize).copied().unwrap_or(high)))
    })
}

/// How many are below `low`, at most `low`, at most `high`, no NaN; appends those between to `between`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn tally_values(values: &[f32], low: f32, high: f32, between: &mut Vec<f32>) -> [u64; 4] {
    const LANES: usize = 32;
    let (mut below, mut to_low) = ([0u32; LANES], [0u32; LANES]);
    let (mut to_high, mut numbers) = ([0u32; LANES], [0u32; LANES]);
    for group in values.chunks(LANES) {
        let mut any = 0u32;
        for (l, v) in group.iter().enumerate() {
            below[l] += u32::from(*v < low);
            to_low[l] += u32::from(*v <= low);
            to_high[l] += u32::from(*v <= high);
            numbers[l] += u32::from(!v.is_nan());
            any |= u32::from((*v > low) & (*v < high));
        }
        if any != 0 {
            between.extend(group.iter().filter(|v| **v > low && **v < high));
        }
    }
    [below, to_low, to_high, numbers].map(|lanes| lanes.iter().map(|n| u64::from(*n)).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::cards::Header;
    use crate::frames::write_u16;

    fn plain(mut v: Vec<f64>) -> f64 {
        v.sort_by(f64::total_cmp);
        (v[(v.len() - 1) / 2] + v[v.len() / 2]) / 2.0
    }

    /// Images that mislead a sample of rows, or leave nothing between the ends of the bracket.
    fn images() -> Vec<(&'static str, Array2<u16>)> {
        let (nx, ny) = (701, 640);
        let noise = |i: usize, j: usize| ((i * 7_919 + j * 104_729) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 52;
        let image = |f: &dyn Fn(usize, usize) -> u64| Array2::from_shape_fn((ny, nx), |(j, i)| f(i, j) as u16);
        vec![
            ("noise", image(&|i, j| 30_000 + noise(i, j))),
            ("narrow noise", image(&|i, j| 30_000 + noise(i, j) / 1_000)),
            ("constant", image(&|_, _| 1_234)),
            ("zero", image(&|_, _| 0)),
            ("saturated", image(&|_, _| 65_535)),
            ("two values, equally often", image(&|_, j| if j < 320 { 5 } else { 60_001 })),
            ("two values, interleaved", image(&|i, j| if (i + j) % 2 == 0 { 40_000 } else { 41 })),
            ("gradient in x", image(&|i, _| 90 * i as u64)),
            ("gradient in y", image(&|_, j| 100 * j as u64)),
            ("the sampled rows are dark", image(&|i, j| if j % 32 == 16 { 100 } else { 20_000 + noise(i, j) })),
            ("the sampled rows are bright", image(&|i, j| if j % 32 == 16 { 65_535 } else { 20_000 + noise(i, j) })),
        ]
    }

    #[test]
    fn the_level_of_any_image_is_that_of_a_plain_sort() {
        let dir = tempfile::tempdir().unwrap();
        for (name, image) in images() {
            let path = dir.path().join("image.fits");
            write_u16(&path, &image, &[], false).unwrap();
            let stored = Stored::open(&path, &Header::read(&path).unwrap()).unwrap().unwrap();
            for clip in [None, Some(310.0), Some(20.5)] {
                let region = Region::new((701, 640), clip);
                let inside = (0..region.size_px.1).flat_map(|j| region.inside(j).map(move |i| (j, i)));
                let (x0, y0) = region.origin_px;
                let want = plain(inside.map(|(j, i)| f64::from(image[[y0 + j, x0 + i]])).collect());
                assert_eq!(median_of_stored(&stored, &region).unwrap(), Some(want), "{name}, clip {clip:?}");
            }
        }
    }

    #[test]
    fn the_median_of_any_response_is_that_of_a_plain_sort() {
        for (name, image) in images() {
            let mut response = image.mapv(|v| (f32::from(v) - 20_000.0) / 9_000.0);
            response.slice_mut(ndarray::s![100..130, ..]).fill(f32::NAN);
            for clip in [None, Some(300.0)] {
                let region =
                    Region { origin_px: (0, 0), size_px: (701, 640), full_size_px: (701, 640), radius_px: clip };
                let inside = (0..640).flat_map(|j| region.inside(j).map(move |i| (j, i)));
                let numbers = inside.map(|at| f64::from(response[at])).filter(|v| !v.is_nan());
                assert_eq!(median_inside(&response, &region), Some(plain(numbers.collect())), "{name}, clip {clip:?}");
            }
        }
        let region = Region::new((701, 640), None);
        assert_eq!(median_inside(&Array2::from_elem((640, 701), f32::NAN), &region), None);
    }
}
