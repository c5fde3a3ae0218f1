//! The passes of a night as one measurement each: the stage that makes `pass_stack.ecsv`.
//!
//! Target frames are read again, a window around the place of the target in each, as many at once as fit into memory; of each
//! a few numbers stay, or running sums of its pixels. [`frames`]: the flux of the target in the frames of a pass. [`rows`]: the
//! rows made of them. It does not cover single frames ([`super::target`]).

pub mod frames;
pub mod rows;

use crate::base::error::Result;
use crate::base::progress::Progress;
use crate::base::threads::pool;
use crate::frames::Exposure;
use crate::pipeline::options::Options;
use crate::pipeline::prepared::Calibrated;
use crate::tables::row_passes::passes;
use crate::tables::{PassStackRow, PhotometryRow};

use frames::PassFrames;

/// The rows of `pass_stack.ecsv`: of each pass of `rows`, which are those of `exposures`, the mean and the bins.
///
/// The same for any number of threads, and for rows that were measured elsewhere.
///
/// # Errors
/// Only what is wrong with the machine, or a stop; a frame that cannot be read any more is excluded from its pass.
pub fn pass_stack(
    rows: &[PhotometryRow],
    exposures: &[Exposure],
    night: &Calibrated,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Vec<PassStackRow>> {
    if !night.config.target.stack_passes {
        return Ok(Vec::new());
    }
    let place = |row: &PhotometryRow| rows.iter().position(|r| std::ptr::eq(r, row));
    let passes: Vec<Vec<usize>> =
        passes(rows).iter().map(|pass| pass.iter().filter_map(|row| place(row)).collect()).collect();
    progress.stage("pass stacks", passes.len());
    let all: Vec<&Exposure> = exposures.iter().collect();
    let (threads, at_once) = options.memory().target_frames(night, &all, options.threads());
    let threads = pool(threads)?;
    let mut out = Vec::new();
    for (number, pass) in (1..).zip(&passes) {
        let of_pass = PassFrames::new(pass.iter().filter_map(|k| Some((&rows[*k], exposures.get(*k)?))), night);
        let curve = of_pass.curve(&threads, at_once, &options.stop)?;
        out.extend(rows::rows_of(number, &of_pass, &curve));
        progress.tick();
    }
    night.buffers.clear();
    progress.done();
    Ok(out)
}
