//! The sky of a tracked frame around the target: a quadratic surface through the means of small blocks.
//!
//! Electrons; columns and rows of a cutout. A mesh would follow a target larger than its boxes and swallow it: a surface
//! of six terms cannot, and it still follows moonlight. A mesh is added only where what is off it is too smooth to be a target (`bumps`).
//! It does not cover trails, which `trail_model` subtracts.

use multiversion::multiversion;
use nalgebra::{SMatrix, SVector};

use super::blocks::{Block, Blocks};
use super::bumps::Bumps;
use crate::base::stats;
use crate::photometry::clip::CLIP_SIGMA;

/// Terms of the surface: 1, x, y, x², xy, y².
const TERMS: usize = 6;
/// Fewest blocks of a surface; below, the sky is one level.
const MIN_BLOCKS: usize = 24;

/// A quadratic surface and the covariance of its terms.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    centre: (f64, f64),
    scale: (f64, f64),
    coefficients: SVector<f64, TERMS>,
    covariance: SMatrix<f64, TERMS, TERMS>,
    /// What the sky has besides a quadratic, where it is known to be none.
    bumps: Option<Bumps>,
    /// Variance of a sky pixel less its level \[e⁻²\].
    excess: f64,
}

impl Surface {
    /// The surface through the blocks that `is_excluded` does not exclude.
    ///
    /// Least absolute deviations first (reweighted), then a clip at 3 σ of what is left, so that a target and trails
    /// which cover less than half of the cutout do not lift it. `bumps` are added to it.
    pub fn fit(
        blocks: &Blocks,
        (ny, nx): (usize, usize),
        bumps: Option<&Bumps>,
        is_excluded: impl Fn(&Block) -> bool,
    ) -> Self {
        let centre = (0.5 * (nx as f64 - 1.0), 0.5 * (ny as f64 - 1.0));
        let scale = (0.5 * nx as f64, 0.5 * ny as f64);
        let kept: Vec<&Block> = blocks.all.iter().filter(|b| !is_excluded(b)).collect();
        let kept = if kept.is_empty() { blocks.all.iter().collect() } else { kept };
        let mut sd: Vec<f64> = kept.iter().map(|b| b.sd).collect();
        let sigma = stats::median(&mut sd).unwrap_or(0.0).max(1e-9);
        let mut means: Vec<f64> = kept.iter().map(|b| b.mean).collect();
        let mut coefficients = SVector::<f64, TERMS>::zeros();
        coefficients[0] = stats::median(&mut means).unwrap_or(0.0);
        let mut surface = Self {
            centre,
            scale,
            coefficients,
            covariance: SMatrix::zeros(),
            bumps: bumps.cloned(),
            excess: sigma * sigma,
        };
        let total: f64 = kept.iter().map(|b| b.n).sum();
        surface.covariance[(0, 0)] = sigma * sigma / total.max(1.0);
        let enough = |n: usize| n >= MIN_BLOCKS;
        if enough(kept.len()) {
            for _ in 0..8 {
                surface.solve(&kept, |r, b| b.n / (r.abs() * b.n.sqrt() / sigma).max(0.5), sigma);
            }
            for _ in 0..4 {
                let mut r: Vec<f64> = kept.iter().map(|b| surface.pull(b, sigma)).collect();
                let limit = CLIP_SIGMA * stats::mad_sigma(&mut r).unwrap_or(1.0).max(1.0);
                surface.solve(&kept, |r, b| if r.abs() * b.n.sqrt() / sigma <= limit { b.n } else { 0.0 }, sigma);
            }
        }
        let near = kept.iter().filter(|b| surface.pull(b, sigma).abs() <= CLIP_SIGMA);
        let mut excess: Vec<f64> = near.map(|b| b.sd * b.sd - surface.level(b.x, b.y).max(0.0)).collect();
        surface.excess = stats::median(&mut excess).unwrap_or(0.0);
        surface
    }

    /// Distance of a block from the surface \[σ\].
    fn pull(&self, b: &Block, sigma: f64) -> f64 {
        (b.mean - self.level(b.x, b.y)) * b.n.sqrt() / sigma
    }

    /// One weighted least-squares step; the surface stays as it is where the blocks do not determine it.
    fn solve(&mut self, blocks: &[&Block], weight: impl Fn(f64, &Block) -> f64, sigma: f64) {
        let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
        let mut right = SVector::<f64, TERMS>::zeros();
        let (mut chi2, mut n) = (0.0, 0.0);
        for b in blocks {
            let r = b.mean - self.level(b.x, b.y);
            let w = weight(r, b);
            if w > 0.0 {
                let t = self.terms(b.x, b.y);
                normal += t * t.transpose() * w;
                right += t * (w * r);
                chi2 += w * r * r / (sigma * sigma);
                n += 1.0;
            }
        }
        if n < MIN_BLOCKS as f64 {
            return;
        }
        let Some(inverse) = normal.cholesky().map(|c| c.inverse()) else { return };
        self.coefficients += inverse * right;
        self.covariance = inverse * (sigma * sigma * (chi2 / n).max(1.0));
    }

    fn terms(&self, x: f64, y: f64) -> SVector<f64, TERMS> {
        let (u, v) = ((x - self.centre.0) / self.scale.0, (y - self.centre.1) / self.scale.1);
        SVector::from([1.0, u, v, u * u, u * v, v * v])
    }

    /// Adds a quadratic function of the place.
    pub fn add_quadratic(&mut self, of: impl Fn(f64, f64) -> f64) {
        let at = |u: f64, v: f64| of(self.centre.0 + u * self.scale.0, self.centre.1 + v * self.scale.1);
        let (middle, corner) = (at(0.0, 0.0), at(1.0, 1.0));
        let ([l, r], [b, t]) = ([at(-1.0, 0.0), at(1.0, 0.0)], [at(0.0, -1.0), at(0.0, 1.0)]);
        let (u, v, uu, vv) = (0.5 * (r - l), 0.5 * (t - b), 0.5 * (r + l) - middle, 0.5 * (t + b) - middle);
        self.coefficients += SVector::from([middle, u, v, uu, corner - middle - u - v - uu - vv, vv]);
    }

    /// Level of the sky \[e⁻/px\].
    pub fn level(&self, x: f64, y: f64) -> f64 {
        self.terms(x, y).dot(&self.coefficients) + self.bumps.as_ref().map_or(0.0, |bumps| bumps.at(x, y))
    }

    /// Level of the sky in row `j`, from column 0 on \[e⁻/px\].
    pub fn row(&self, j: usize, out: &mut [f32]) {
        let (c, v) = (&self.coefficients, (j as f64 - self.centre.1) / self.scale.1);
        let (a, b) = (c[0] + v * (c[2] + v * c[5]), c[1] + v * c[4]);
        parabola([a, b, c[3]], self.centre.0, self.scale.0, out);
        if let Some(bumps) = &self.bumps {
            bumps.add_row(j, out);
        }
    }

    /// Scatter of a sky pixel \[e⁻\].
    pub fn rms(&self, x: f64, y: f64) -> f64 {
        let level = self.level(x, y).max(0.0);
        // counts that scatter less than Poisson (binned, compressed) keep their share
        (level + self.excess).max(0.1 * (level + self.excess.abs())).max(1e-12).sqrt()
    }

    /// Variance of the difference between the surface's means over two sets of pixels \[e⁻²/px²\].
    pub fn variance_between(&self, one: &MeanOf, other: &MeanOf) -> f64 {
        let g = one.mean() - other.mean();
        (g.transpose() * self.covariance * g)[(0, 0)].max(0.0)
    }

    /// Adds a pixel to a mean.
    pub fn add(&self, to: &mut MeanOf, x: f64, y: f64, weight: f64) {
        to.sum += self.terms(x, y) * weight;
        to.weight += weight;
    }
}

/// a + b u + c u² at u = (i − centre)/scale, from i = 0 on.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
pub(crate) fn parabola([a, b, c]: [f64; 3], centre: f64, scale: f64, out: &mut [f32]) {
    for (i, o) in out.iter_mut().enumerate() {
        let u = (f64::from(i as u32) - centre) / scale;
        *o = (a + u * (b + u * c)) as f32;
    }
}

/// Mean of the terms of a surface over some pixels.
#[derive(Debug, Clone, Default)]
pub(crate) struct MeanOf {
    sum: SVector<f64, TERMS>,
    weight: f64,
}

impl MeanOf {
    fn mean(&self) -> SVector<f64, TERMS> {
        self.sum / self.weight.max(1e-300)
    }
}
