//! The part of a target frame that is read: where the target can be, and the sky at the edge and the centre of the field.
//!
//! Electrons and full-frame pixels. A measurement of the target needs nothing of the rest of the frame, unless it finds no
//! sky around the place; then all of the clip circle is read. The numbers are those of the whole frame in both cases.

use std::ops::Range;

use crate::base::error::Result;
use crate::frames::{Electrons, Frame, FrameReader, PooledFrame};
use crate::photometry::Flags;
use crate::photometry::background::{Background, background};
use crate::photometry::target::measure::TargetFound;
use crate::photometry::target::measure::measure_target;
use crate::photometry::target::settings::TargetSettings;
use crate::pipeline::prepared::Calibrated;
use crate::pipeline::stars::vignetting::corner_ratio;

/// Read around the cutout of the target \[px\]: enough that what lies at the edge of the cutout sees the frame go on.
const MARGIN_PX: f64 = 64.0;
/// Boxes of the mesh to each side of the expected place.
const BOXES_AROUND: usize = 2;

/// The result of the search in a frame.
#[derive(Debug)]
pub struct Seen {
    /// The target, or its limit.
    pub found: TargetFound,
    /// Level of the sky at the edge of the field over that at its centre.
    pub corner_ratio: Option<f64>,
}

/// Half the side of the square that is read around the expected place \[px\].
#[must_use]
pub fn reach_px(s: &TargetSettings) -> f64 {
    s.reach_px() + MARGIN_PX
}

/// Looks for the target in the frame behind `reader`.
///
/// # Errors
/// [`crate::Error::Fits`] if the file is damaged or none of its pixels can be used.
pub fn measure_in_window(reader: &FrameReader, night: &Calibrated, settings: &TargetSettings) -> Result<Seen> {
    let p = &night.config.photometry;
    if night.exhaustive {
        return measure_whole_frame(reader, night, settings);
    }
    if let Some(frame) = around(reader, night, settings)? {
        let sky = sky_at(&frame, p.mesh_px, p.clip_sigma, settings);
        if let Some(sky) = sky {
            let found = measure_target(&frame, &sky, settings);
            let (TargetFound::Detected { flux, .. } | TargetFound::NotDetected { flux, .. }) = &found;
            if !flux.flags.has(Flags::NO_ANNULUS) && flux.flux_e.is_finite() {
                drop(frame);
                let corner_ratio = corner_ratio(reader, p.mesh_px, p.clip_sigma, &night.buffers)?;
                return Ok(Seen { found, corner_ratio });
            }
        }
    }
    measure_whole_frame(reader, night, settings)
}

/// The same with the whole clip circle read, including what [`measure_in_window`] skips.
///
/// # Errors
/// As [`measure_in_window`].
pub fn measure_whole_frame(reader: &FrameReader, night: &Calibrated, settings: &TargetSettings) -> Result<Seen> {
    let p = &night.config.photometry;
    let frame = night.usable(reader.whole(&night.buffers)?)?;
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    Ok(Seen { found: measure_target(&frame, &sky, settings), corner_ratio: sky.corner_ratio() })
}

/// The window around the expected place, if any of its pixels can be used.
///
/// # Errors
/// [`crate::base::error::Error::Fits`] if the file is damaged.
pub fn around<'b>(reader: &FrameReader, night: &'b Calibrated, s: &TargetSettings) -> Result<Option<PooledFrame<'b>>> {
    let reach = reach_px(s);
    let span = |at: f64, within: Range<usize>| {
        let first = (at - reach).floor().max(0.0) as usize;
        let end = (at + reach).ceil().max(0.0) as usize;
        first.clamp(within.start, within.end)..end.clamp(within.start, within.end)
    };
    let (columns, rows) = reader.box_px();
    let (columns, rows) = (span(s.x_px, columns), span(s.y_px, rows));
    if columns.is_empty() || rows.is_empty() {
        return Ok(None);
    }
    let frame = reader.part(columns, rows, &night.buffers)?;
    Ok(Some(frame).filter(|f| !f.all_bad()))
}

/// The sky in a few boxes around the expected place, if any of their pixels is good.
#[must_use]
pub fn sky_at(frame: &Frame<Electrons>, mesh_px: usize, clip_sigma: f64, s: &TargetSettings) -> Option<Background> {
    let (ny, nx) = frame.pixels.dim();
    let reach = BOXES_AROUND * mesh_px + mesh_px / 2;
    let span = |at: f64, origin: usize, n: usize| {
        let at = (at.max(0.0) as usize).saturating_sub(origin).min(n - 1);
        at.saturating_sub(reach)..(at + reach).min(n)
    };
    let (columns, rows) = (span(s.x_px, frame.origin_px.0, nx), span(s.y_px, frame.origin_px.1, ny));
    let part = ndarray::s![rows.clone(), columns.clone()];
    let pixels = frame.pixels.slice(part).to_owned();
    let mut own = Frame::from_electrons(frame.path.clone(), pixels, frame.gain.clone());
    own.mask = frame.mask.slice(part).to_owned();
    own.origin_px = (frame.origin_px.0 + columns.start, frame.origin_px.1 + rows.start);
    own.full_size_px = frame.full_size_px;
    background(&own, mesh_px, clip_sigma).ok()
}
