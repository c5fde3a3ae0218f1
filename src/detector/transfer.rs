//! Photon transfer: electrons per ADU from pairs of flats, because the variance of counted light is its mean.
//!
//! Levels in ADU above the pedestal, variances in ADU², gains in e⁻/ADU, from the blocks of [`super::flat_pairs`].
//! Source: Janesick 2001, Scientific Charge-Coupled Devices (SPIE), the difference method. It does not cover
//! non-linearity and the correlation of neighbouring pixels.

use super::flat_pairs::{BlockPoint, PairPoints, Refusal};
use crate::base::stats::{median, sigma_clip};

/// Blocks further from the line are excluded \[σ of a variance\].
const BLOCK_CLIP_SIGMA: f64 = 4.0;
/// A gain less certain than this is none.
const MAX_REL_ERR: f64 = 0.2;

/// No camera counts more electrons per ADU: 8 bits of a well of 12 800 e⁻. Light that shows less noise was smoothed.
const MOST_E_PER_ADU: f64 = 50.0;
/// Noise of light below this share of the noise without it gives no gain.
const LIGHT_SHARE: f64 = 0.5;

/// What is held fixed of the noise that is there without light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DarkNoise {
    /// Variance in ADU², as measured in a pair of bias frames (digitisation included).
    Measured(f64),
    /// Read noise of the camera's table \[e⁻\] and the variance of digitisation, step²/12 \[ADU²\].
    Table {
        /// Read noise \[e⁻\].
        read_noise_e: f64,
        /// step²/12 \[ADU²\].
        digitisation_adu2: f64,
    },
}

/// How well a table knows the read noise.
const TABLE_NOISE_ERR: f64 = 0.1;

impl DarkNoise {
    /// dR²/dx \[ADU²/(ADU/e⁻)\].
    fn slope(self, x: f64) -> f64 {
        match self {
            DarkNoise::Measured(_) => 0.0,
            DarkNoise::Table { read_noise_e, .. } => 2.0 * read_noise_e * read_noise_e * x,
        }
    }

    /// x that makes L x + R²(x) the variance V of a block: (√(L² + 4 N (V − d)) − L)/2N with N = read_noise_e².
    fn start(self, block: &BlockPoint) -> f64 {
        let (l, v) = (block.level_adu, block.var_adu2);
        match self {
            DarkNoise::Measured(var) => (v - var) / l,
            DarkNoise::Table { read_noise_e, digitisation_adu2 } => {
                let (n, rest) = (read_noise_e * read_noise_e, v - digitisation_adu2);
                // the same root, written so that N = 0 divides nothing by zero
                2.0 * rest / (l + (l * l + 4.0 * n * rest).max(0.0).sqrt())
            }
        }
    }

    /// R² \[ADU²\] at x = 1/g \[ADU/e⁻\].
    fn var_adu2(self, x: f64) -> f64 {
        match self {
            DarkNoise::Measured(var) => var,
            DarkNoise::Table { read_noise_e, digitisation_adu2 } => (read_noise_e * x).powi(2) + digitisation_adu2,
        }
    }
}

/// A gain with its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainEstimate {
    /// Electrons per ADU.
    pub e_per_adu: f64,
    /// Its 1 σ error.
    pub err: f64,
}

/// The photon transfer of all pairs of one gain setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// The gain to quote: of `slope` where levels span a factor of 3 and it is known to 3 %, else of `fixed`.
    pub gain: GainEstimate,
    /// With the noise without light held fixed: (V − R²)/L.
    pub fixed: GainEstimate,
    /// From the slope of V against L, free of pedestal and read noise; with two or more pairs.
    pub slope: Option<GainEstimate>,
    /// Intercept of that line \[ADU²\] and its error: R², if the pedestal is right.
    pub intercept_adu2: Option<(f64, f64)>,
    /// Whether `gain` is `slope`.
    pub from_slope: bool,
    /// Gain of each pair alone, in the order given.
    pub pairs: Vec<GainEstimate>,
    /// Lowest and highest level of the pairs above the pedestal \[ADU\].
    pub level_range_adu: (f64, f64),
    /// R² held fixed \[ADU²\].
    pub dark_var_adu2: f64,
    /// Pixels compared.
    pub n_px: usize,
}

/// A straight line through weighted points, V = x L + c.
struct Line {
    x: f64,
    x_err: f64,
    c: f64,
    c_err: f64,
}

/// Fits the gain to pairs of one gain setting.
///
/// x = 1/g from Σ w L (V − R²)/Σ w L², w the inverse variance 2V²/(n−1) of a variance, taken at the line and not at the
/// point, for which low points would weigh more; with a table's read noise R² = (read_noise_e x)² + digitisation,
/// solved together. Blocks beyond 4 σ are excluded. Errors grow by √(χ²/dof) where blocks or pairs scatter more than
/// counted light does, and by 10 % of a table's read noise.
///
/// # Errors
/// [`Refusal::NoPixels`] without a pair; [`Refusal::Dark`], [`Refusal::Uncertain`] where no gain to 20 % comes out.
pub fn fit_transfer(pairs: &[PairPoints], dark: DarkNoise) -> Result<Transfer, Refusal> {
    if pairs.is_empty() {
        return Err(Refusal::NoPixels);
    }
    let mut singles = Vec::new();
    for pair in pairs {
        let line = fit(&pair.blocks, Some(dark)).ok_or(Refusal::NoPixels)?;
        singles.push((line.x, line.x_err));
    }
    let (x, mut x_err) = weighted_mean(&singles);
    let levels = pairs.iter().map(|p| p.level_adu);
    let (low, high) = levels.fold((f64::INFINITY, 0f64), |(a, b), l| (a.min(l), b.max(l)));
    let dark_var = dark.var_adu2(x.max(0.0));
    // what an error of the table's read noise does: δx (L + dR²/dx) = 2 R² δR/R
    let bend = x.max(0.0) * dark.slope(x.max(0.0));
    x_err = x_err.hypot(TABLE_NOISE_ERR * x * bend / (x * low + bend).max(f64::MIN_POSITIVE));
    let hidden = x * high < LIGHT_SHARE * dark_var;
    if hidden && high / MOST_E_PER_ADU < LIGHT_SHARE * dark_var {
        return Err(Refusal::Dark { level_adu: high });
    }
    if hidden || !(x > 0.0 && x_err < MAX_REL_ERR * x) {
        return Err(Refusal::Uncertain { adu_per_e: x, err: x_err });
    }
    let all: Vec<BlockPoint> = pairs.iter().flat_map(|p| p.blocks.iter().copied()).collect();
    let line = if pairs.len() > 1 { fit(&all, None) } else { None };
    let slope = line.as_ref().filter(|l| l.x > 0.0).map(|l| estimate(l.x, l.x_err * between_pairs(pairs, l)));
    let fixed = estimate(x, x_err);
    let spanning = slope.filter(|s| high >= 3.0 * low && s.err < 0.03 * s.e_per_adu);
    Ok(Transfer {
        gain: spanning.unwrap_or(fixed),
        fixed,
        slope,
        intercept_adu2: line.map(|l| (l.c, l.c_err)),
        from_slope: spanning.is_some(),
        pairs: singles.iter().map(|(x, e)| estimate(*x, *e)).collect(),
        level_range_adu: (low, high),
        dark_var_adu2: dark_var,
        n_px: all.iter().map(|b| b.n_px).sum(),
    })
}

/// g = 1/x.
fn estimate(x: f64, x_err: f64) -> GainEstimate {
    GainEstimate { e_per_adu: 1.0 / x, err: x_err / (x * x) }
}

/// Mean weighted by the errors; its error grows with the scatter (the scale factor of the Particle Data Group).
fn weighted_mean(values: &[(f64, f64)]) -> (f64, f64) {
    let weight = |e: f64| 1.0 / (e * e);
    let total: f64 = values.iter().map(|(_, e)| weight(*e)).sum();
    let mean = values.iter().map(|(v, e)| v * weight(*e)).sum::<f64>() / total;
    let chi2: f64 = values.iter().map(|(v, e)| ((v - mean) / e).powi(2)).sum();
    let dof = values.len().saturating_sub(1).max(1) as f64;
    (mean, (chi2 / dof).max(1.0).sqrt() / total.sqrt())
}

/// √(χ²/dof) of the pairs' mean residuals from the line, at least 1; with fewer than three pairs 1.
fn between_pairs(pairs: &[PairPoints], line: &Line) -> f64 {
    if pairs.len() < 3 {
        return 1.0;
    }
    let chi2: f64 = pairs
        .iter()
        .map(|pair| {
            let terms = pair.blocks.iter().map(|b| {
                let model = line.x * b.level_adu + line.c;
                let var = 2.0 * model * model / (b.n_px.max(2) - 1) as f64;
                let off = b.var_adu2 - model;
                if off * off > BLOCK_CLIP_SIGMA.powi(2) * var { (0.0, 0.0) } else { (off / var, 1.0 / var) }
            });
            let (sum, weight) = terms.fold((0.0, 0.0), |(s, w), (a, b)| (s + a, w + b));
            if weight > 0.0 { sum * sum / weight } else { 0.0 }
        })
        .sum();
    (chi2 / (pairs.len() - 2) as f64).max(1.0).sqrt()
}

/// Iterated weighted line through blocks; `dark` fixes what is there without light. `None` without light or blocks.
fn fit(blocks: &[BlockPoint], dark: Option<DarkNoise>) -> Option<Line> {
    let start = |b: &BlockPoint| dark.map_or(b.var_adu2 / b.level_adu, |d| d.start(b));
    let mut each: Vec<f64> = blocks.iter().map(start).collect();
    let (mut x, mut c) = (median(&mut each)?, 0.0);
    let mut errors = (f64::NAN, f64::NAN);
    for _ in 0..30 {
        // slope of V in x besides L, and V without light
        let (bend, dark_var) = dark.map_or((0.0, c), |d| (d.slope(x.max(0.0)), d.var_adu2(x.max(0.0))));
        // Σ w, Σ w a, Σ w a², Σ w r, Σ w a r, Σ w r², n; a = dV/dx, r the residual
        let mut s = [0.0f64; 7];
        for b in blocks {
            let model = (x * b.level_adu + dark_var).max(1e-12);
            let w = (b.n_px.max(2) - 1) as f64 / (2.0 * model * model);
            let (a, r) = (b.level_adu + bend, b.var_adu2 - model);
            if w * r * r > BLOCK_CLIP_SIGMA.powi(2) {
                continue;
            }
            for (sum, term) in s.iter_mut().zip([w, w * a, w * a * a, w * r, w * a * r, w * r * r, 1.0]) {
                *sum += term;
            }
        }
        let [w, wa, waa, wr, war, chi2, n] = s;
        let free = if dark.is_some() { 1.0 } else { 2.0 };
        if n < free || n < 0.3 * blocks.len() as f64 {
            return scattered(each);
        }
        let scale = if n > free + 6.0 { (chi2 / (n - free)).max(1.0) } else { 1.0 };
        let (step_x, step_c);
        if dark.is_some() {
            (step_x, step_c) = (war / waa, 0.0);
            errors = ((scale / waa).sqrt(), 0.0);
        } else {
            let det = w * waa - wa * wa;
            if !(det > 1e-12 * w * waa) {
                return None;
            }
            (step_x, step_c) = ((w * war - wa * wr) / det, (waa * wr - wa * war) / det);
            errors = ((scale * w / det).sqrt(), (scale * waa / det).sqrt());
        }
        (x, c) = (x + step_x, c + step_c);
        if step_x.abs() <= 1e-10 * x.abs() && step_c.abs() <= 1e-3 * errors.1 {
            break;
        }
    }
    Some(Line { x, x_err: errors.0, c, c_err: errors.1 })
}

/// Blocks that scatter so much that no line holds a third of them: their median, with its own scatter as the error.
fn scattered(mut each: Vec<f64>) -> Option<Line> {
    let clipped = sigma_clip(&mut each, 3.0)?;
    Some(Line { x: clipped.median, x_err: clipped.sigma.max(1e-12), c: 0.0, c_err: 0.0 })
}
