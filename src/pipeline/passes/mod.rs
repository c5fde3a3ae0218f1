//! The passes of a night as one measurement each: the stage that makes `pass_stack.ecsv`.
//!
//! Target frames are read again, a window around the place of the target in each, as many at once as fit into memory; of each
//! a few numbers stay, or running sums of its pixels. [`frames`]: the flux of the target in the frames of a pass. [`rows`]: the
//! rows made of them. It does not cover single frames ([`super::target`]).

pub mod frames;
pub mod rows;

use std::collections::HashMap;

use crate::base::error::Result;
use crate::base::progress::Progress;
use crate::base::threads::pool;
use crate::frames::Exposure;
use crate::photometry::Flags;
use crate::pipeline::options::Options;
use crate::pipeline::prepared::Calibrated;
use crate::pipeline::target::measurement::PointAt;
use crate::tables::row_passes::passes;
use crate::tables::words::{ForcedAt, Verdict};
use crate::tables::{PassStackRow, PhotometryRow};

use frames::PassFrames;

/// The rows of `pass_stack.ecsv`: of each pass of `rows`, which are those of `exposures`, the mean and the bins. `rows` get the
/// light of a point at the place of their pass, where that is known and their frame does not show the target's own.
///
/// The same for any number of threads, and for rows that were measured elsewhere.
///
/// # Errors
/// Only what is wrong with the machine, or a stop; a frame that cannot be read any more is excluded from its pass.
pub fn pass_stack(
    rows: &mut [PhotometryRow],
    exposures: &[Exposure],
    night: &Calibrated,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Vec<PassStackRow>> {
    if !night.config.target.stack_passes {
        return Ok(Vec::new());
    }
    let number: HashMap<*const PhotometryRow, usize> =
        rows.iter().enumerate().map(|(k, row)| (std::ptr::from_ref(row), k)).collect();
    let place = |row: &PhotometryRow| number.get(&std::ptr::from_ref(row)).copied();
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
        let light = curve.light_of_frames();
        let light: Vec<_> = light.iter().filter_map(|(frame, light)| Some((place(frame.row)?, *light))).collect();
        light.into_iter().for_each(|(k, light)| at_place_of_pass(&mut rows[k], light));
        progress.tick();
    }
    night.buffers.clear();
    progress.done();
    Ok(out)
}

/// The light of a point at the place of the pass in the columns of a frame that has none of its own detection, that of an
/// outline with what disturbs it, or that of a detection elsewhere.
fn at_place_of_pass(row: &mut PhotometryRow, light: Option<PointAt>) {
    let is_disturbed = row.verdict == Verdict::Reject && row.disc_fwhm2.is_none();
    let is_elsewhere = Flags(row.flags).has(Flags::UNCONFIRMED);
    if row.forced_at == ForcedAt::Detection && !((is_disturbed || is_elsewhere) && light.is_some()) {
        return;
    }
    let light = light.filter(|l| l.flux_e.is_finite() && l.err_e.is_finite());
    if light.is_none() {
        let sep = if row.reason.is_empty() { "" } else { "; " };
        row.reason +=
            &format!("{sep}no forced flux: the place of its pass is masked, disturbed, under a hit or off the frame");
    }
    row.forced_at = light.map(|l| l.at.into()).unwrap_or_default();
    (row.forced_x_px, row.forced_y_px) = (light.map(|l| l.x_px), light.map(|l| l.y_px));
    (row.forced_flux_e, row.forced_flux_err_e) = (light.map(|l| l.flux_e), light.map(|l| l.err_e));
}
