//! The pictures of the gallery, cut out of their frames at the end of the night: only those of the frames it will show.
//!
//! Each is 25 kB; kept for every frame, a long night would fill the memory with pictures nobody sees. It does not cover
//! how a picture is made ([`super::picture`]).

use rayon::prelude::*;

use super::frame::target_settings;
use super::outcome::TargetFrame;
use super::picture::{cut, extent};
use crate::base::error::Result;
use crate::base::threads::with_threads;
use crate::figures::Thumb;
use crate::frames::Exposure;
use crate::pipeline::options::Options;
use crate::pipeline::prepared::Calibrated;
use crate::report::gallery::worst_first;
use crate::tables::PhotometryRow;

/// Gives the `vetting.gallery_frames` worst of the frames that have a place their picture; `exposures` are those of
/// `frames`, in their order.
///
/// # Errors
/// [`crate::Error::Config`] when the threads cannot be started.
pub fn pictures(
    frames: &mut [TargetFrame],
    exposures: &[Exposure],
    night: &Calibrated,
    options: &Options,
) -> Result<()> {
    let most = night.config.vetting.gallery_frames;
    if options.no_figures || most == 0 {
        return Ok(());
    }
    let order = worst_first(frames.iter().map(|f| &f.row));
    let mut next = order.into_iter().filter(|i| frames[*i].row.x_px.is_some() && *i < exposures.len()).peekable();
    let mut made: Vec<(usize, Thumb)> = Vec::new();
    while made.len() < most && next.peek().is_some() {
        // a frame that has gone since leaves its place to the next
        let these: Vec<usize> = next.by_ref().take(most - made.len()).collect();
        let picture = |i: &usize| Some((*i, picture(&frames[*i].row, &exposures[*i], night)?));
        made.extend(with_threads(options.jobs, || these.par_iter().filter_map(picture).collect::<Vec<_>>())?);
    }
    made.into_iter().for_each(|(i, thumb)| frames[i].thumb = Some(thumb));
    Ok(())
}

/// The picture of one frame, of which only that much is read.
fn picture(row: &PhotometryRow, exposure: &Exposure, night: &Calibrated) -> Option<Thumb> {
    let s = target_settings(exposure, night, night.seeing.fwhm_arcsec(row.airmass));
    let extent = extent(row, exposure.size_px, [s.x_px, s.y_px, s.search_radius_px])?;
    let (columns, rows) = extent.px();
    let frame = night.open(exposure).ok()?.part(columns, rows, &night.buffers).ok()?;
    Some(cut(&frame, &extent))
}
