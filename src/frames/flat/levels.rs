//! Medians of millions of pixels: of a flat's counts from a sample of its rows, of the master's response exactly.
//!
//! ADU for counts; no units for responses. A response is read once: a few rows bracket its median, then what is below the
//! bracket is only counted, on lanes, and what falls inside is looked at. Where that sample misled, or the image is small,
//! everything is counted instead ([`CountingMedian`]), so that the result is exact always. NaN is not counted.

use multiversion::multiversion;
use ndarray::Array2;
use rayon::prelude::*;

use super::counting::{CountingMedian, find};
use crate::base::error::{Error, Result};
use crate::fits::stored::{PIXEL_BYTES, Stored};
use crate::frames::clip::Region;

/// Pixels that make the level of a flat: its standard error is a thousandth of their scatter.
const LEVEL_PX: usize = 1 << 21;
/// One row in so many brackets the median of a response.
const SAMPLE_RESPONSE_ROWS: usize = 128;
/// Pixels below which a sample saves nothing.
const SMALL_PX: usize = 1 << 18;
/// Rows read at a time: they stay in a core's cache.
const READ_ROWS: usize = 16;

/// Ranks of a sample of `n` (at least 1) between which the median lies: ±4σ of the rank of an independent sample.
fn bracket(n: usize) -> (usize, usize) {
    let reach = 2 * n.isqrt() + 1;
    ((n / 2).saturating_sub(reach), (n / 2 + reach).min(n - 1))
}

/// The two middle values from `at(rank)`, `None` if that has no answer.
fn middle_of(total: u64, at: impl Fn(u64) -> Option<f64>) -> Option<f64> {
    let last = total.checked_sub(1)?;
    Some((at(last / 2)? + at(total / 2)?) / 2.0)
}

/// One row in so many makes the level of a flat: all of them where there are few. Odd, so that rows which differ in turn
/// are both seen.
pub(crate) fn level_step(region: &Region) -> usize {
    let total: usize = (0..region.size_px.1).map(|j| region.inside(j).len()).sum();
    (total / LEVEL_PX).saturating_sub(1) | 1
}

/// Median of the counts of every [`level_step`]-th row inside the circle \[ADU\]; `None` if there are none.
///
/// Exact for up to 6 million pixels; of a frame of 61 million its standard error is 1.25 σ/√2·10⁶, 1e-5 of the level where
/// pixels scatter by a hundredth of it: a hundredth of the master's own noise, and the same for all its pixels.
///
/// # Errors
/// The errors of reading the file.
pub(crate) fn median_of_stored(stored: &Stored, region: &Region) -> Result<Option<f64>> {
    let mut counts = Histogram::new();
    each_row(stored, region, level_step(region), &mut Vec::new(), |pixels| counts.add(pixels))?;
    Ok(middle_of(counts.counted, |rank| Some(f64::from(counts.at(rank)))))
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

/// How often each count occurs.
struct Histogram {
    counts: Vec<u32>,
    counted: u64,
}

impl Histogram {
    fn new() -> Self {
        Self { counts: vec![0; 1 << 16], counted: 0 }
    }

    fn add(&mut self, pixels: &[[u8; PIXEL_BYTES]]) {
        for pixel in pixels {
            self.counts[usize::from(crate::fits::stored::count(*pixel))] += 1;
        }
        self.counted += pixels.len() as u64;
    }

    /// The count of this rank.
    fn at(&self, rank: u64) -> u16 {
        find(&self.counts, rank).0 as u16
    }
}

/// Median of the pixels inside the circle that are not NaN; `None` if there are none.
pub(crate) fn median_inside(response: &Array2<f32>, region: &Region) -> Option<f64> {
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

/// The same in one pass; `None` if the sample was misleading.
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
    use crate::fits::cards::Header;
    use crate::fits::write_u16;

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
    fn the_level_of_any_small_image_is_that_of_a_plain_sort() {
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
    fn the_level_of_a_large_noisy_image_is_within_four_standard_errors_of_that_of_all_its_pixels() {
        // sum of four uniform numbers about 26 000, scatter 256·2/√3 = 296; vignetted by 4 % towards the edges
        let (nx, ny) = (5_000, 4_000);
        let mut state = 7u64;
        let image = Array2::from_shape_fn((ny, nx), |(j, i)| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (state >> 20 & 511) + (state >> 29 & 511) + (state >> 38 & 511) + (state >> 47 & 511);
            let (x, y) = (i as f64 / nx as f64 - 0.5, j as f64 / ny as f64 - 0.5);
            (25_000.0 * (1.0 - 0.08 * (x * x + y * y)) + noise as f64) as u16
        });
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("large.fits");
        write_u16(&path, &image, &[], false).unwrap();
        let stored = Stored::open(&path, &Header::read(&path).unwrap()).unwrap().unwrap();
        let region = Region::new((nx, ny), None);
        assert!(level_step(&region) > 1);
        let want = plain(image.iter().map(|v| f64::from(*v)).collect());
        let level = median_of_stored(&stored, &region).unwrap().unwrap();
        // the rows sample the vignetting evenly: only the noise of 2 million pixels is left, and the rounding to counts
        let scatter = 400.0;
        assert!((level - want).abs() < 4.0 * 1.25 * scatter / (LEVEL_PX as f64).sqrt() + 0.5, "{level} {want}");
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
