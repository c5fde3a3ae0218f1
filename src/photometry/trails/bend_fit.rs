//! The bend of the sky along the trails, from the blocks between them.

use nalgebra::{Matrix3, Vector3};

use super::bend::Bend;
use super::exclusion::ExclusionMask;
use super::model::TrailBackground;
use crate::base::stats;
use crate::photometry::clip::CLIP_SIGMA;

/// Passes of fit and clip.
const PASSES: usize = 3;
/// Fewest blocks of a line from which a bend is measured.
const MIN_BLOCKS: usize = 6;
/// Every how many lines are looked at: neighbours share their cells.
const LINE_STEP: usize = 2;

/// From the blocks outside every exclusion mask, each line having its own level; `None` if they do not determine it.
///
/// Least squares within lines: `Σ_q Σ_p w (t − t̄_q)(y − ȳ_q)`, t̄_q and ȳ_q the means over line q, clipped at 3 σ.
pub(crate) fn bend_of(trail_background: &TrailBackground, exclusions: &[ExclusionMask]) -> Option<Bend> {
    let (turned, half) = (trail_background.turned, trail_background.half());
    let mut bend = Bend { turned, half, terms: Vector3::zeros() };
    let lines: Vec<(f64, Vec<(f64, f64)>)> = (0..trail_background.n_lines())
        .step_by(LINE_STEP)
        .map(|q| (trail_background.v_of(q), trail_background.free_blocks(q, exclusions)))
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
            let variance = trail_background.variance_of_block(*level);
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
