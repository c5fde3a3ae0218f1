//! The levels of the lines under an aperture, from both sides of it, and what they leave uncertain.
//!
//! Electrons per pixel; lines of cells along the trails. It does not cover where the trails are (`trail_model`).

use super::exclusion::ExclusionMask;
use crate::photometry::trails::model::Level;
use crate::photometry::trails::model::TrailBackground;
use crate::photometry::trails::rotate::catmull_rom;

/// The levels of the lines under an aperture.
#[derive(Debug, Clone)]
pub(crate) struct TrailLevel {
    /// First line.
    pub first: usize,
    v0: f64,
    pub levels: Vec<Level>,
    /// Cells they rest on.
    pub n: f64,
}

impl TrailLevel {
    /// The levels of the lines that `over` touches; pixels in `exclusions` do not count. `None` if a line has no room next to
    /// it.
    pub fn of(trail_background: &TrailBackground, over: ExclusionMask, exclusions: &[ExclusionMask]) -> Option<Self> {
        let reach = over.across() + 1.0;
        let lines = trail_background.lines((over.v - reach, over.v + reach));
        let mut levels = Vec::with_capacity(lines.len());
        for q in lines.clone() {
            let u = over.chord(trail_background.v_of(q)).unwrap_or((over.u, over.u));
            levels.push(trail_background.side_bands(q, u, exclusions)?);
        }
        if levels.len() < 4 {
            return None;
        }
        let n = levels.iter().map(|l| l.n).sum();
        Some(Self { first: lines.start, v0: trail_background.v_of(lines.start), levels, n })
    }

    /// The level at v, by the cubic through four lines.
    pub fn at(&self, v: f64) -> f64 {
        let x = (v - self.v0).clamp(1.0, self.levels.len() as f64 - 2.001);
        let k = x as usize;
        let of = |q: usize| self.levels[q].mean as f32;
        f64::from(catmull_rom([of(k - 1), of(k), of(k + 1), of(k + 2)], (x - k as f64) as f32))
    }

    /// Variance of the sum of the levels over the cells of an aperture.
    pub fn variance(&self, trail_background: &TrailBackground, aperture: &ExclusionMask) -> f64 {
        let of = |(k, l): (usize, &Level)| {
            let (from, to) = aperture.chord(trail_background.v_of(self.first + k)).unwrap_or((0.0, 0.0));
            (to - from).powi(2) * trail_background.variance(l.mean) / l.n
        };
        self.levels.iter().enumerate().map(of).sum()
    }

    /// Where the two sides of a line differ by D a trail ends under the aperture, anywhere along its chord c: a level
    /// between both is wrong by D c/√12. Lines are taken together over the width of a trail; noise is subtracted twice.
    pub fn variance_of_ends(&self, trail_background: &TrailBackground, aperture: &ExclusionMask, fwhm: f64) -> f64 {
        let width = (1.5 * fwhm).round().max(2.0) as usize;
        let of_trail = |(g, lines): (usize, &[Level])| {
            let (mut step, mut noise) = (0.0, 0.0);
            for (k, line) in lines.iter().enumerate() {
                let (from, to) =
                    aperture.chord(trail_background.v_of(self.first + g * width + k)).unwrap_or((0.0, 0.0));
                step += (to - from) * line.step;
                noise += (to - from).powi(2) * line.step_variance;
            }
            (step * step - 2.0 * noise).max(0.0) / 12.0
        };
        self.levels.chunks(width).enumerate().map(of_trail).sum()
    }
}
