//! Two flats, compared block by block: the level and the variance of their difference.
//!
//! Levels in ADU above the pedestal, variances in ADU². Pixel response cancels in the difference, drift of the lamp or
//! sky in the ratio and a plane in every block. What is no pair of flats is refused by name. It does not cover the gain
//! ([`super::transfer`]).

use crate::base::stats::{median, sigma_clip};

/// Clip of the differences in a block \[σ\]: stars and cosmic rays; the truncated variance is corrected.
const CLIP_SIGMA: f64 = 4.5;
/// More saturated pixels than this share make a block useless: they have no noise.
const SATURATED_FRAC: f64 = 0.002;
/// Flats whose levels differ by more are no pair.
pub const MAX_FLAT_RATIO: f64 = 1.5;
/// One block of a pair of flats: V = L/g + R².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockPoint {
    /// L: light that makes the noise, level of one flat above the pedestal \[ADU\].
    pub level_adu: f64,
    /// V: variance of one flat \[ADU²\].
    pub var_adu2: f64,
    /// Pixels.
    pub n_px: usize,
}

/// What two flats say.
#[derive(Debug, Clone, PartialEq)]
pub struct PairPoints {
    /// The usable blocks.
    pub blocks: Vec<BlockPoint>,
    /// Median level of both flats above the pedestal \[ADU\].
    pub level_adu: f64,
    /// Level of the first over that of the second.
    pub ratio: f64,
}

/// Why two flats give no gain.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// No difference anywhere.
    #[error("the two flats are identical: one is a copy of the other")]
    Identical,
    /// Too many pixels at the end of the scale.
    #[error("saturated: {blocks} of {of} blocks hold pixels at or above {level_adu:.0} ADU")]
    Saturated {
        /// Blocks with saturated pixels.
        blocks: usize,
        /// All blocks.
        of: usize,
        /// Level of saturation \[ADU\].
        level_adu: f64,
    },
    /// No light.
    #[error(
        "too dark: level {level_adu:.1} ADU above the pedestal, where read noise and digitisation hide the noise of light"
    )]
    Dark {
        /// Level above the pedestal \[ADU\].
        level_adu: f64,
    },
    /// Different light.
    #[error("levels too far apart: one is {ratio:.2} times the other; a pair may differ by a factor of 1.5")]
    Unlike {
        /// Level of the first over that of the second.
        ratio: f64,
    },
    /// Nothing to measure.
    #[error("no block with enough finite pixels")]
    NoPixels,
    /// The variance does not grow with the light.
    #[error(
        "the noise does not grow with the light: variance over level {adu_per_e:.4} +- {err:.4} ADU/e- (combined, smoothed or scaled copies?)"
    )]
    Uncertain {
        /// (V − R²)/L \[ADU/e⁻\].
        adu_per_e: f64,
        /// Its error \[ADU/e⁻\].
        err: f64,
    },
}

impl Refusal {
    /// Whether the frames are not what the camera wrote: copies, or combined or smoothed ones.
    #[must_use]
    pub fn doubts_the_frames(&self) -> bool {
        matches!(self, Refusal::Identical | Refusal::Uncertain { .. })
    }
}

/// Compares two flats block by block.
///
/// With levels m_a, m_b above the pedestal and q = m_a/m_b in each block, d = a − q b holds no pixel response and
/// Var d = m_a (1 + q)/g + (1 + q²) R². Divided by 1 + q² that is V = L/g + R², L = m_a (1 + q)/(1 + q²).
/// Levels are means over the same pixels as the variance.
///
/// # Errors
/// [`Refusal`]: identical, saturated, dark or very different flats.
pub fn compare_flats(
    a: &[Vec<f32>],
    b: &[Vec<f32>],
    pedestal_adu: f64,
    saturation_adu: f64,
) -> Result<PairPoints, Refusal> {
    let (mut blocks, mut ratios, mut levels) = (Vec::new(), Vec::new(), Vec::new());
    let (mut saturated, mut equal, mut usable) = (0, 0, 0);
    for (xa, xb) in a.iter().zip(b) {
        let side = xa.len().isqrt().max(1);
        let pairs: Vec<Pixel> = xa
            .iter()
            .zip(xb)
            .enumerate()
            .filter(|(_, (u, v))| u.is_finite() && v.is_finite())
            .map(|(i, (u, v))| Pixel {
                a: f64::from(*u) - pedestal_adu,
                b: f64::from(*v) - pedestal_adu,
                x: (i % side) as f64,
                y: (i / side) as f64,
            })
            .collect();
        if pairs.len() < (xa.len() / 2).max(32) {
            continue;
        }
        usable += 1;
        let full = saturation_adu - pedestal_adu;
        let n_full = pairs.iter().filter(|p| p.a >= full || p.b >= full).count();
        if n_full as f64 > SATURATED_FRAC * pairs.len() as f64 {
            saturated += 1;
            continue;
        }
        if pairs.iter().all(|p| p.a == p.b) {
            equal += 1;
            continue;
        }
        let mid = |of: fn(&Pixel) -> f64| median(&mut pairs.iter().map(of).collect::<Vec<f64>>());
        let (Some(ma), Some(mb)) = (mid(|p| p.a), mid(|p| p.b)) else { continue };
        levels.push(0.5 * (ma + mb));
        if ma <= 0.0 || mb <= 0.0 {
            continue;
        }
        let q = ma / mb;
        ratios.push(q);
        blocks.extend(block_point(&pairs, q));
    }
    let Some(level_adu) = median(&mut levels) else {
        return Err(match (usable, equal) {
            (0, _) => Refusal::NoPixels,
            _ if saturated > 0 => Refusal::Saturated { blocks: saturated, of: usable, level_adu: saturation_adu },
            _ => Refusal::Identical,
        });
    };
    if 2 * saturated > usable {
        return Err(Refusal::Saturated { blocks: saturated, of: usable, level_adu: saturation_adu });
    }
    if 2 * equal > usable {
        return Err(Refusal::Identical);
    }
    let ratio = median(&mut ratios).unwrap_or(f64::NAN);
    if level_adu <= 0.0 || ratio.is_nan() || blocks.is_empty() {
        return Err(Refusal::Dark { level_adu });
    }
    if !(1.0 / MAX_FLAT_RATIO..=MAX_FLAT_RATIO).contains(&ratio) {
        return Err(Refusal::Unlike { ratio });
    }
    Ok(PairPoints { blocks, level_adu, ratio })
}

/// One pixel in both flats, above the pedestal \[ADU\], and its place in the block \[px\].
struct Pixel {
    a: f64,
    b: f64,
    x: f64,
    y: f64,
}

/// Level and variance of one block, from the pixels whose difference is not an outlier.
///
/// A plane is taken out of the difference: the gradient of a twilight sky turns between two flats. Its coefficients
/// are those of single regressions, which are independent where the pixels fill a square.
fn block_point(pixels: &[Pixel], q: f64) -> Option<BlockPoint> {
    let raw = |p: &Pixel| p.a - q * p.b;
    let first = sigma_clip(&mut pixels.iter().map(raw).collect::<Vec<f64>>(), CLIP_SIGMA)?;
    let near = |d: f64, centre: f64, sigma: f64| (d - centre).abs() <= CLIP_SIGMA * sigma;
    let kept = || pixels.iter().filter(|p| near(raw(p), first.median, first.sigma));
    let slope = |of: fn(&Pixel) -> f64| {
        let n = kept().count().max(1) as f64;
        let mean = kept().map(of).sum::<f64>() / n;
        let (xd, xx) = kept().fold((0.0, 0.0), |(xd, xx), p| {
            let x = of(p) - mean;
            (xd + x * (raw(p) - first.mean), xx + x * x)
        });
        if xx > 0.0 { (xd / xx, mean) } else { (0.0, mean) }
    };
    let ((sx, x0), (sy, y0)) = (slope(|p| p.x), slope(|p| p.y));
    let flat = |p: &Pixel| raw(p) - sx * (p.x - x0) - sy * (p.y - y0);
    let clipped = sigma_clip(&mut pixels.iter().map(flat).collect::<Vec<f64>>(), CLIP_SIGMA)?;
    let last = pixels.iter().filter(|p| near(flat(p), clipped.median, clipped.sigma));
    let (n, sum_a, sum_b) = last.fold((0usize, 0.0, 0.0), |(n, a, b), p| (n + 1, a + p.a, b + p.b));
    let (ma, mb) = (sum_a / n.max(1) as f64, sum_b / n.max(1) as f64);
    if 2 * n < pixels.len() || n < 16 || !(ma > 0.0 && mb > 0.0) {
        return None;
    }
    // the noise of the light of both, as it enters d: m_a + q² m_b
    let share = 1.0 + q * q;
    // two slopes more than the mean were fitted
    let fitted = (n - 1) as f64 / (n - 3) as f64;
    Some(BlockPoint {
        level_adu: (ma + q * q * mb) / share,
        var_adu2: fitted * clipped.sigma.powi(2) / share,
        n_px: n - 2,
    })
}
