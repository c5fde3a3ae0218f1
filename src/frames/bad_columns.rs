//! Hot and dead columns by the night's own star frames: parts of columns that are brighter or darker than those around them.
//!
//! In units of the noise of a pixel, σ = √(m + σ_R²), m the median of four neighbours in its row: t = (N − m)/σ, cut at ±2 so that
//! stars count no more than noise. The mean of t over a block of rows, or over the whole column, is the offset of that part. It
//! does not cover bad rows, and columns of more than two next to each other.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::frame::{Electrons, Frame, mask};
use crate::base::stats::mad_sigma;

/// Rows of a block.
const BLOCK_ROWS: usize = 64;
/// t is cut here.
const CUT: f32 = 2.0;
/// Offset of a bad block \[σ\], and of a whole column.
const BLOCK_OFFSET: f64 = 0.8;
const COLUMN_OFFSET: f64 = 0.3;
/// It is so many times the scatter among blocks, or columns: every camera has a pattern of columns.
const OUTLIER_SIGMA: f64 = 6.0;
/// A block, or a column, of fewer usable rows says nothing.
const LEAST_ROWS: f32 = 0.5;
/// Share of the fields in which a column must be bad.
const SHARE_OF_FIELDS: f64 = 0.8;
/// A camera with a larger share of bad columns is none: the frames have another pattern.
const LARGEST_SHARE: f64 = 0.01;

/// Rows `rows_px.0` up to, and without, `rows_px.1` of a column of the full frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BadColumn {
    /// Column of the full frame.
    pub x_px: u32,
    /// First row, and one past the last.
    pub rows_px: (u32, u32),
}

/// The bad parts of the columns of a frame, in order.
#[must_use]
pub fn bad_columns(frame: &Frame<Electrons>) -> Vec<BadColumn> {
    let (ny, nx) = frame.pixels.dim();
    let (Some(pixels), Some(bits)) = (frame.pixels.as_slice(), frame.mask.as_slice()) else { return Vec::new() };
    if nx < 5 || ny < BLOCK_ROWS {
        return Vec::new();
    }
    let read_noise2 = (frame.gain.read_noise_e * frame.gain.read_noise_e) as f32;
    let blocks: Vec<usize> = (0..ny / BLOCK_ROWS).collect();
    let sums: Vec<Vec<[f32; 2]>> = blocks.par_iter().map(|b| block_sums(pixels, bits, nx, *b, read_noise2)).collect();
    let offset =
        |[sum, n]: [f32; 2], rows: usize| (n >= LEAST_ROWS * rows as f32).then(|| f64::from(sum) / f64::from(n));
    let (x0, y0) = (frame.origin_px.0 as u32, frame.origin_px.1 as u32);
    let rows = |from: usize, to: usize| (y0 + (from * BLOCK_ROWS) as u32, y0 + (to * BLOCK_ROWS) as u32);
    let mut found = Vec::new();
    let of_blocks: Vec<Vec<Option<f64>>> =
        sums.iter().map(|of| of.iter().map(|s| offset(*s, BLOCK_ROWS)).collect()).collect();
    let limit = limit(of_blocks.iter().flatten().flatten().copied(), BLOCK_OFFSET);
    for (b, of_block) in of_blocks.iter().enumerate() {
        let bad = of_block.iter().enumerate().filter(|(_, o)| o.is_some_and(|o| o.abs() > limit));
        found.extend(bad.map(|(x, _)| BadColumn { x_px: x0 + x as u32, rows_px: rows(b, b + 1) }));
    }
    let whole: Vec<Option<f64>> = (0..nx)
        .map(|x| {
            let sum = sums.iter().fold([0.0; 2], |[s, n], of| [s + of[x][0], n + of[x][1]]);
            offset(sum, blocks.len() * BLOCK_ROWS)
        })
        .collect();
    let limit = self::limit(whole.iter().flatten().copied(), COLUMN_OFFSET);
    for (x, _) in whole.iter().enumerate().filter(|(_, o)| o.is_some_and(|o| o.abs() > limit)) {
        let every = blocks.iter().map(|b| BadColumn { x_px: x0 + x as u32, rows_px: rows(*b, b + 1) });
        found.extend(every);
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Σ t and the number of usable pixels of every column in a block of rows.
fn block_sums(pixels: &[f32], bits: &[u8], nx: usize, block: usize, read_noise2: f32) -> Vec<[f32; 2]> {
    let mut sums = vec![[0f32; 2]; nx];
    for y in block * BLOCK_ROWS..(block + 1) * BLOCK_ROWS {
        let (row, bits) = (&pixels[y * nx..][..nx], &bits[y * nx..][..nx]);
        for x in 2..nx - 2 {
            let [a, b, c, d] = [row[x - 2], row[x - 1], row[x + 1], row[x + 2]];
            let m = 0.5 * (a + b + c + d - a.min(b).min(c.min(d)) - a.max(b).max(c.max(d)));
            // the mean of the middle two of four has 0.30 of the variance of one
            let t = (row[x] - m) / (1.3 * (m.max(0.0) + read_noise2)).sqrt();
            // NaN around it is no use, nor is a saturated pixel
            if t.is_finite() && bits[x] & (mask::BAD | mask::CLIPPED | mask::SATURATED) == 0 {
                sums[x][0] += t.clamp(-CUT, CUT);
                sums[x][1] += 1.0;
            }
        }
    }
    sums
}

/// From which offset on a part is bad: the least one, or an outlier among all.
fn limit(offsets: impl Iterator<Item = f64>, least: f64) -> f64 {
    let mut all: Vec<f64> = offsets.collect();
    least.max(OUTLIER_SIGMA * mad_sigma(&mut all).unwrap_or(0.0))
}

/// The parts that are bad in most of the frames, blocks above each other joined, for a detector of `nx` columns.
///
/// # Errors
/// A sentence where more columns are than any camera has bad ones.
pub fn common_columns(nx: usize, frames: &[Vec<BadColumn>]) -> Result<Vec<BadColumn>, String> {
    let mut seen: BTreeMap<BadColumn, usize> = BTreeMap::new();
    frames.iter().flatten().for_each(|c| *seen.entry(*c).or_default() += 1);
    let fewest = (SHARE_OF_FIELDS * frames.len() as f64).ceil() as usize;
    let mut joined: Vec<BadColumn> = Vec::new();
    for (column, _) in seen.into_iter().filter(|(_, n)| *n >= fewest) {
        match joined.last_mut() {
            Some(last) if last.x_px == column.x_px && last.rows_px.1 >= column.rows_px.0 => {
                last.rows_px.1 = last.rows_px.1.max(column.rows_px.1);
            }
            _ => joined.push(column),
        }
    }
    let mut columns: Vec<u32> = joined.iter().map(|c| c.x_px).collect();
    columns.dedup();
    if columns.len() as f64 > (LARGEST_SHARE * nx as f64).max(2.0) {
        return Err(format!(
            "{} columns deviate in {fewest} of {} star fields, more than {} % of the detector: no columns are masked",
            columns.len(),
            frames.len(),
            100.0 * LARGEST_SHARE
        ));
    }
    Ok(joined)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::frame::{ElectronsPerAdu, Gain};
    use ndarray::Array2;

    const NX: usize = 120;
    const NY: usize = 512;

    /// A star field with a hot column from row 256 on, a weak one all along, and a dead one.
    fn frame(seed: u64, bad: bool) -> Frame<Electrons> {
        let mut state = seed;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        // of variance 1, nearly normal
        let mut noise = || (0..12).map(|_| random()).sum::<f64>() - 6.0;
        let sigma = 109f64.sqrt();
        let (sx, sy) = ((seed * 37) % 100, (seed * 101) % 500);
        let pixels = Array2::from_shape_fn((NY, NX), |(y, x)| {
            let star = 3e4 * (-0.3 * ((x as f64 - sx as f64).powi(2) + (y as f64 - sy as f64).powi(2))).exp();
            let defect = match x {
                30 if y >= 256 => 2.0 * sigma,
                60 => 0.5 * sigma,
                90 => -100.0,
                _ => 0.0,
            };
            (100.0 + star + sigma * noise() + if bad { defect } else { 0.0 }) as f32
        });
        let gain = Gain {
            setting: None,
            e_per_adu: ElectronsPerAdu(1.0),
            source: String::new(),
            read_noise_e: 3.0,
            pedestal_adu: 0.0,
            saturation_adu: 65_535.0,
        };
        Frame::from_electrons("f".into(), pixels, gain)
    }

    #[test]
    fn hot_weak_and_dead_columns_are_found_where_they_are_bad_and_no_others() {
        let found: Vec<Vec<BadColumn>> = (1..=5).map(|k| bad_columns(&frame(k, true))).collect();
        let columns = common_columns(NX, &found).unwrap_err();
        assert!(columns.contains("3 columns"), "{columns}");
        // on a detector as wide as they are
        let columns = common_columns(1000, &found).unwrap();
        let rows: Vec<_> = columns.iter().map(|c| (c.x_px, c.rows_px)).collect();
        assert_eq!(rows, [(30, (256, 512)), (60, (0, 512)), (90, (0, 512))]);
        let clean: Vec<Vec<BadColumn>> = (1..=5).map(|k| bad_columns(&frame(k, false))).collect();
        assert_eq!(common_columns(1000, &clean), Ok(Vec::new()));
    }
}
