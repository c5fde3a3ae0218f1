//! What the converter did, derived from the raw values alone: their step, the bits behind them, and where they pile up.
//!
//! ADU as in the file. Cameras pad their 12 or 14 bits with zeros (values x16, x4), and drivers give EGAIN for either
//! kind of count; a converter that is full piles pixels up on one value. It does not cover electrons
//! ([`super::transfer`]).

use crate::base::error::Error;
use crate::base::error::Result;
use crate::fits::raw::guarded;
use crate::frames::clip::Region;
use crate::frames::exposure::Exposure;
use crate::frames::read::Pixels;
use crate::frames::read::TILE_ROWS;

/// Values that fit a 16-bit file.
const N_LEVELS: usize = 65_536;
/// Share of pixels that must agree with a step: dead columns, overscan and rounding by others are the rest.
const STEP_SHARE: f64 = 0.98;
/// Fewer pixels off the commonest value than this tell nothing of the step.
const STEP_MIN_PX: u64 = 64;
/// Factors a step is made of: padding is by powers of two; 257 fills 16 bits with 8; the rest are odd scalings.
const STEP_FACTORS: [usize; 8] = [2, 3, 5, 7, 11, 13, 17, 257];
/// Pixels that make a value well filled.
const FILLED_PX: u64 = 8;
/// A pile at the top holds at least this many pixels.
const PILE_MIN_PX: u64 = 10;
/// Width of a pile, share of its level: a full well scatters a little, the noise of light scatters more.
const PILE_WIDTHS: [f64; 2] = [1e-3, 0.0];

/// How often each raw value occurs.
#[derive(Debug, Clone)]
pub struct Counts {
    /// Pixels of each value 0 to 65535.
    bins: Vec<u64>,
    /// Pixels counted in `bins`.
    n: u64,
    /// Pixels whose value is not a whole number.
    pub n_fractional: u64,
    /// Pixels below 0 or above 65535.
    pub n_outside: u64,
    /// Pixels that are NaN, infinite or BLANK.
    pub n_nan: u64,
}

impl Default for Counts {
    fn default() -> Self {
        Self { bins: vec![0; N_LEVELS], n: 0, n_fractional: 0, n_outside: 0, n_nan: 0 }
    }
}

/// The spacing of the values in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Greatest common divisor of the differences between values \[ADU\].
    pub step_adu: u32,
    /// Every value is a multiple of the step plus this \[ADU\].
    pub offset_adu: u32,
    /// Mean distance of neighbouring values that occur \[ADU\]: more than the step where counts were rescaled.
    pub spacing_adu: f64,
    /// Share of the pixels that fit.
    pub share: f64,
}

/// Pixels that pile up at the top of the range: saturation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pile {
    /// Lowest value of the pile \[ADU\].
    pub level_adu: f64,
    /// Highest value of the pile \[ADU\].
    pub top_adu: f64,
    /// Pixels in it.
    pub n_px: u64,
}

impl Counts {
    /// Counts values \[ADU\].
    pub fn add(&mut self, values: &[f32]) {
        for v in values {
            let whole = *v as u16; // saturates, NaN becomes 0
            if f32::from(whole) == *v {
                self.bins[usize::from(whole)] += 1;
                self.n += 1;
            } else if !v.is_finite() {
                self.n_nan += 1;
            } else if v.fract() != 0.0 {
                self.n_fractional += 1;
            } else {
                self.n_outside += 1;
            }
        }
    }

    /// Adds the counts of another frame.
    pub fn merge(&mut self, other: &Counts) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| *a += b);
        self.n += other.n;
        self.n_fractional += other.n_fractional;
        self.n_outside += other.n_outside;
        self.n_nan += other.n_nan;
    }

    /// Number of whole values from 0 to 65535.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.n
    }

    /// Whether nothing was counted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Whether these are raw counts of a 16-bit file: nearly all finite values are whole numbers from 0 to 65535.
    #[must_use]
    pub fn is_raw(&self) -> bool {
        let odd = self.n_fractional + self.n_outside;
        self.n > 0 && odd as f64 <= 0.01 * (self.n + odd) as f64
    }

    /// The value below or at which the share `q` of the pixels lies \[ADU\]; `None` without pixels.
    #[must_use]
    pub fn quantile(&self, q: f64) -> Option<f64> {
        let rank = (q.clamp(0.0, 1.0) * self.n as f64).ceil().max(1.0) as u64;
        let mut below = 0;
        self.bins
            .iter()
            .position(|n| {
                below += n;
                below >= rank
            })
            .filter(|_| self.n > 0)
            .map(|v| v as f64)
    }

    /// Highest value that occurs \[ADU\].
    #[must_use]
    pub fn max_adu(&self) -> Option<f64> {
        self.bins.iter().rposition(|n| *n > 0).map(|v| v as f64)
    }

    /// Pixels above a level \[ADU\].
    #[must_use]
    pub fn n_above(&self, level_adu: f64) -> u64 {
        let first = (level_adu.floor() + 1.0).clamp(0.0, N_LEVELS as f64) as usize;
        self.bins[first..].iter().sum()
    }

    /// The step of the values: the largest g for which nearly all values differ by multiples of g.
    ///
    /// Counted from the commonest value, over the pixels that have another one; up to 2 % of them may be odd. `None`
    /// where too few differ (a constant bias frame carries no information), or where the values are not raw counts.
    #[must_use]
    pub fn step(&self) -> Option<Step> {
        let mode = (0..N_LEVELS).rev().max_by_key(|v| self.bins[*v])?;
        let others = self.n - self.bins[mode];
        if !self.is_raw() || others < STEP_MIN_PX {
            return None;
        }
        let share = |g: usize| {
            let fit: u64 = (mode % g..N_LEVELS).step_by(g).map(|v| self.bins[v]).sum();
            (fit - self.bins[mode]) as f64 / others as f64
        };
        let mut step = 1;
        for factor in STEP_FACTORS {
            while step * factor < N_LEVELS && share(step * factor) >= STEP_SHARE {
                step *= factor;
            }
        }
        Some(Step {
            step_adu: step as u32,
            offset_adu: (mode % step) as u32,
            spacing_adu: self.spacing_adu(step),
            share: share(step),
        })
    }

    /// Mean distance from a well-filled value (8 pixels) to the next that occurs; the step itself where most of them
    /// follow each other by a step, or where there are fewer than 20.
    fn spacing_adu(&self, step: usize) -> f64 {
        let occurring: Vec<usize> = (0..N_LEVELS).filter(|v| self.bins[*v] > 0).collect();
        let filled = |pair: &[usize]| (self.bins[pair[0]] >= FILLED_PX).then(|| (pair[1] - pair[0]) as f64);
        let mut gaps: Vec<f64> = occurring.windows(2).filter_map(filled).collect();
        gaps.sort_by(f64::total_cmp);
        let middle = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
        if gaps.len() < 20 || middle <= step as f64 {
            return step as f64;
        }
        let near: Vec<f64> = gaps.into_iter().filter(|g| *g <= 1.5 * middle).collect();
        near.iter().sum::<f64>() / near.len() as f64
    }

    /// The pile of pixels at the top of the range, if there is one; values at or below `floor_adu` do not count.
    ///
    /// At least 10 pixels within 0.1 % of one value, with hardly a pixel above, and far more than the density of the
    /// values in the next 2 % below would put there; failing that, two pixels at 65535. Light alone piles up over no
    /// less than its own noise.
    #[must_use]
    pub fn pile(&self, floor_adu: f64) -> Option<Pile> {
        let below: Vec<u64> = std::iter::once(0)
            .chain(self.bins.iter().scan(0, |sum, n| {
                *sum += n;
                Some(*sum)
            }))
            .collect(); // below[v] pixels have a value under v
        let between = |a: usize, b: usize| below[b.min(N_LEVELS)] - below[a.min(b).min(N_LEVELS)];
        let step = self.step().map_or(1, |s| s.step_adu as usize);
        for top in (0..N_LEVELS).rev().filter(|v| self.bins[*v] > 0 && *v as f64 > floor_adu) {
            let above = self.n - below[top + 1];
            for share in PILE_WIDTHS {
                let width = (share * top as f64) as usize + step;
                let first = (top + 1).saturating_sub(width);
                let n_px = between(first, top + 1);
                let range = (top / 50).max(5 * width).max(20 * step);
                let expected = between(first.saturating_sub(range), first) as f64 * width as f64 / range as f64;
                let alone = above as f64 <= 0.1 * n_px as f64;
                if n_px >= PILE_MIN_PX && alone && n_px as f64 > 5.0 * expected + 5.0 && first as f64 > floor_adu {
                    // a stray pixel below the pile is no part of it
                    let level = (first..=top).find(|v| 50 * between(first, v + 1) >= n_px).unwrap_or(top);
                    return Some(Pile { level_adu: level as f64, top_adu: top as f64, n_px });
                }
            }
            if above > self.n / 2 {
                break;
            }
        }
        let last = self.bins[N_LEVELS - 1];
        let end = (N_LEVELS - 1) as f64;
        (last >= 2 && end > floor_adu).then_some(Pile { level_adu: end, top_adu: end, n_px: last })
    }
}

/// Bits of the converter behind a 16-bit file: 16 − lg₂ spacing where the low bits are padded, else the bits that hold
/// the value at which the pixels pile up; `None` where neither shows one.
#[must_use]
pub fn converter_bits(step: Option<Step>, pile: Option<Pile>) -> Option<u32> {
    let padded = step.map(|s| s.spacing_adu).filter(|s| *s > 1.5);
    if let Some(spacing) = padded {
        return Some((16.0 - spacing.log2()).round().clamp(1.0, 16.0) as u32);
    }
    pile.map(|p| (p.top_adu + 1.0).log2().ceil().clamp(1.0, 16.0) as u32)
}

/// Counts the raw values inside the clip circle; of a frame of more than `max_px` only every n-th tile of 64 rows.
///
/// # Errors
/// [`Error::Fits`] if the file is damaged or holds no image.
pub fn count_values(exposure: &Exposure, clip_radius_px: Option<f64>, max_px: usize) -> Result<Counts> {
    let (full_nx, full_ny) = exposure.size_px;
    if full_nx == 0 || full_ny == 0 {
        return Err(Error::Fits { path: exposure.path.clone(), problem: "no image in the header".into() });
    }
    let region = Region::new(exposure.size_px, clip_radius_px);
    let (nx, ny) = region.size_px;
    let stride = (nx * ny).div_ceil(max_px.max(1)).max(1);
    guarded(&exposure.path, || {
        let mut pixels = Pixels::open(&exposure.path, &exposure.header)?;
        let mut counts = Counts::default();
        let mut tile = vec![0f32; nx * TILE_ROWS.min(ny)];
        // tall frames are thinned by tiles, low ones by single rows
        let tile_rows = if ny / TILE_ROWS >= 4 * stride { TILE_ROWS } else { (ny / (4 * stride)).clamp(1, TILE_ROWS) };
        for first in (0..ny).step_by(tile_rows * stride) {
            let rows = tile_rows.min(ny - first);
            let tile = &mut tile[..nx * rows];
            pixels.read((region.origin_px.0, region.origin_px.1 + first), (nx, rows), tile)?;
            for (j, values) in tile.chunks(nx).enumerate() {
                counts.add(&values[region.inside(first + j)]);
            }
        }
        Ok(counts)
    })
}
