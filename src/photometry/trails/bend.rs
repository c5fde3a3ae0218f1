//! What a sky's surface gets wrong along the trails: among many of them no surface can be fitted through the gaps.
//!
//! Electrons per pixel; u along the trails, v across, in cells of a cutout. A trail adds the same to all of its line, so
//! how the blocks of one line differ among themselves is sky alone, however many trails there are. What changes across
//! the trails only stays in the levels of the lines. Leaves out: trails that end, but for a clip.

use nalgebra::{Matrix3, Vector3};
use ndarray::Array2;

use super::exclusion::Hole;
use crate::base::stats;
use crate::photometry::target::sky::parabola;
use crate::photometry::trails::direction::Turned;
use crate::photometry::trails::model::Strips;

/// Blocks further than this from their line do not count \[σ\].
const CLIP_SIGMA: f64 = 3.0;
/// Passes of fit and clip.
const PASSES: usize = 3;
/// Fewest blocks of a line that tell of a bend.
const MIN_BLOCKS: usize = 6;
/// Every how many lines are looked at: neighbours share their cells.
const LINE_STEP: usize = 2;

/// a U + b U² + c U V with U = u/h, V = v/h, h half the diagonal of the cutout.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bend {
    turned: Turned,
    half: f64,
    terms: Vector3<f64>,
}

impl Bend {
    /// Of the blocks in no hole, each line having its own level; `None` where they do not tell.
    ///
    /// Least squares within lines: `Σ_q Σ_p w (t − t̄_q)(y − ȳ_q)`, t̄_q and ȳ_q the means over line q, clipped at 3 σ.
    pub fn of(strips: &Strips, holes: &[Hole]) -> Option<Self> {
        let (turned, half) = (strips.turned, strips.half());
        let mut bend = Self { turned, half, terms: Vector3::zeros() };
        let lines: Vec<(f64, Vec<(f64, f64)>)> = (0..strips.n_lines())
            .step_by(LINE_STEP)
            .map(|q| (strips.v_of(q), strips.free_blocks(q, holes)))
            .filter(|(_, blocks)| blocks.len() >= MIN_BLOCKS)
            .collect();
        let mut levels: Vec<f64> = lines
            .iter()
            .map(|(_, blocks)| {
                let mut values: Vec<f64> = blocks.iter().map(|b| b.1).collect();
                stats::median(&mut values).unwrap_or(f64::NAN)
            })
            .collect();
        for _ in 0..PASSES {
            let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Vector3::<f64>::zeros());
            for ((v, blocks), level) in lines.iter().zip(&mut levels) {
                let variance = strips.variance_of_block(*level);
                let limit = CLIP_SIGMA * variance.sqrt();
                let (mut n, mut t1, mut y1) = (0.0, Vector3::zeros(), 0.0);
                let (mut tt, mut ty) = (Matrix3::zeros(), Vector3::zeros());
                for (u, value) in blocks {
                    let t = bend.terms_at(*u, *v);
                    if (value - *level - t.dot(&bend.terms)).abs() <= limit {
                        n += 1.0;
                        t1 += t;
                        y1 += value;
                        tt += t * t.transpose();
                        ty += t * *value;
                    }
                }
                if n >= MIN_BLOCKS as f64 {
                    normal += (tt - t1 * t1.transpose() / n) / variance;
                    right += (ty - t1 * (y1 / n)) / variance;
                    *level = (y1 - t1.dot(&bend.terms)) / n;
                }
            }
            bend.terms = normal.cholesky()?.solve(&right);
        }
        bend.terms.iter().all(|t| t.is_finite()).then_some(bend)
    }

    fn terms_at(&self, u: f64, v: f64) -> Vector3<f64> {
        let (u, v) = (u / self.half, v / self.half);
        Vector3::new(u, u * u, u * v)
    }

    /// Its value at a place along and across the trails \[e⁻/px\].
    pub fn at_uv(&self, u: f64, v: f64) -> f64 {
        self.terms.dot(&self.terms_at(u, v))
    }

    /// Its value at a cell \[e⁻/px\].
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = self.turned.uv(x, y);
        self.at_uv(u, v)
    }

    /// Takes it off an image of cells.
    pub fn take_off(&self, image: &mut Array2<f32>) {
        let (ny, nx) = image.dim();
        let mut bend = vec![0f32; nx];
        for j in 0..ny {
            // a parabola along each row, from three of its cells
            let y = j as f64;
            let (a, p, m) = (self.at(0.0, y), self.at(1.0, y), self.at(-1.0, y));
            parabola([a, 0.5 * (p - m), 0.5 * (p + m) - a], 0.0, 1.0, &mut bend);
            image.row_mut(j).iter_mut().zip(&bend).for_each(|(v, b)| *v -= b);
        }
    }
}
