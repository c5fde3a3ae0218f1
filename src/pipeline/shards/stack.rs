//! The passes of a night that was measured in shards: the table that a run writes, from the merged rows and the frames.
//!
//! What a stack needs of a pass is known when all of its frames are measured, so this is work of the merge; the target frames
//! of the plan are read again, a window of each.

use std::path::Path;

use super::merge::Merged;
use super::plan_file::{Plan, PlannedFrame};
use super::products::FrameCache;
use super::shard::night_of_plan;
use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::pipeline::options::Options;
use crate::pipeline::passes::pass_stack;

/// Stacks the passes of a merged night; `zeropoint` and `flat` are those its shards were measured with.
///
/// # Errors
/// [`Error::PoorNight`] where frames are missing; [`Error::Mismatch`] for a frame that is not the one of the plan, or a master
/// flat that is not the zeropoint's; what must be there before work begins; a stop.
pub fn stack_merged(
    merged: &mut Merged,
    plan: &Plan,
    (zeropoint, flat): (Option<&Path>, Option<&Path>),
    options: &Options,
    progress: &dyn Progress,
) -> Result<()> {
    if !merged.missing.is_empty() {
        let problem = "passes of a night with missing frames cannot be stacked; measure the missing frames first";
        return Err(Error::PoorNight { problem: problem.into() });
    }
    let products = FrameCache::default();
    let (night, _) = night_of_plan(plan, (zeropoint, flat), &products, options, progress, &mut merged.notes)?;
    // the rows of target frames stand first, in the order of the plan
    let mut places: Vec<usize> = plan.shards.iter().flatten().copied().collect();
    places.sort_unstable();
    let frames: Vec<&PlannedFrame> = places.iter().map(|k| &plan.frames[*k]).collect();
    let exposures = plan.exposures(frames.into_iter(), &night.config, &night.target_names())?;
    let rows = merged.rows.get_mut(..exposures.len()).unwrap_or_default();
    merged.stacks = pass_stack(rows, &exposures, &night, options, progress)?;
    Ok(())
}
