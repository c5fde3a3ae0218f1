//! The part of a target frame that is read: where the target can be, and the sky at the edge and the centre of the field.
//!
//! Electrons and full-frame pixels. A measurement of the target needs nothing of the rest of the frame, unless it finds no
//! sky around the place; then all of the clip circle is read. The numbers are those of the whole frame in both cases.

use std::ops::Range;

use crate::base::error::Result;
use crate::frames::{Electrons, Frame, FrameReader, PooledFrame};
use crate::photometry::Flags;
use crate::photometry::background::{Background, background};
use crate::photometry::target::compact::err_of_pixels;
use crate::photometry::target::measure::TargetFound;
use crate::photometry::target::measure::measure_target;
use crate::photometry::target::settings::TargetSettings;
use crate::pipeline::prepared::{Calibrated, Seeing};
use crate::pipeline::stars::vignetting::corner_ratio;
use crate::tables::PhotometryRow;
use crate::tables::words::Status;

/// Read around the cutout of the target \[px\]: enough that what lies at the edge of the cutout sees the frame go on.
const MARGIN_PX: f64 = 64.0;
/// Boxes of the mesh to each side of the expected place.
const BOXES_AROUND: usize = 2;
/// A region of a larger share of the whole search radius than this saves too little.
const LARGEST_SHARE: f64 = 0.7;
/// A trail makes an aperture this much longer than wide.
const ELONGATED: f64 = 1.5;
/// An aperture so much longer than in other frames holds more than the target.
pub(super) const MOST_GROWTH: f64 = 1.5;
/// A target with one of these may go on outside of a small window.
const CUT: Flags = Flags(Flags::EDGE.0 | Flags::NO_ANNULUS.0 | Flags::CROSSED.0);

/// Where the target is looked for first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Column of its centre \[px\].
    pub x_px: f64,
    /// Row of its centre \[px\].
    pub y_px: f64,
    /// Its radius \[px\].
    pub radius_px: f64,
    /// The radius of the largest aperture around the target in other frames \[px\].
    pub aper_px: f64,
    /// No part of the target is further from that centre \[px\].
    pub bound_px: f64,
    /// The square of the diameter of the disc that fits it in other frames, and its error \[FWHM²\].
    pub disc2: Option<(f64, f64)>,
}

impl Region {
    /// Whether an aperture is as large as in other frames, or larger by no more than a change of range or attitude makes it.
    #[must_use]
    pub fn is_usual(&self, aper_px: f64) -> bool {
        aper_px <= MOST_GROWTH * self.aper_px
    }

    /// Whether it is enough smaller than all of the search region to look there first.
    #[must_use]
    pub fn is_small(&self, s: &TargetSettings) -> bool {
        self.radius_px <= LARGEST_SHARE * s.search_radius_px
    }

    /// Whether an aperture of these axes \[px\] is longer than the target in other frames, as one with a trail or a neighbour in it is.
    /// A round one that is larger is a target that is brighter.
    #[must_use]
    pub fn is_joined(&self, (a_px, b_px): (f64, f64)) -> bool {
        !self.is_usual(a_px) && a_px > ELONGATED * b_px
    }

    /// The same of the row of a frame.
    #[must_use]
    pub fn is_joined_in(&self, row: &PhotometryRow) -> bool {
        let axes = row.aper_a_px.zip(row.aper_b_px).filter(|_| row.status == Status::Ok);
        axes.is_some_and(|axes| self.is_joined(axes))
    }

    /// Whether other frames say more of the size of a compact target than its own pixels: their mean has less than half of the variance.
    #[must_use]
    pub fn knows_more_than(&self, row: &PhotometryRow, seeing: &Seeing) -> bool {
        let errs = self.disc2.zip(size_err(row, seeing));
        errs.is_some_and(|((_, of_others), own)| 2.0 * of_others * of_others < own * own)
    }

    /// The settings of a search there.
    #[must_use]
    pub fn search(&self, s: &TargetSettings) -> TargetSettings {
        let search_radius_px = self.radius_px.min(s.search_radius_px);
        TargetSettings { x_px: self.x_px, y_px: self.y_px, search_radius_px, ..*s }
    }
}

/// The error of the size of a compact target by its pixels alone \[FWHM²\].
pub(super) fn size_err(row: &PhotometryRow, seeing: &Seeing) -> Option<f64> {
    Some(err_of_pixels(row.disc_fwhm2_err?, seeing.fwhm_err_frac(row.exptime_s?)))
}

/// The result of the search in a frame.
#[derive(Debug)]
pub struct Seen {
    /// The target, or its limit.
    pub found: TargetFound,
    /// Radius of the circle in which it was looked for \[px\].
    pub search_radius_px: f64,
    /// Level of the sky at the edge of the field over that at its centre.
    pub corner_ratio: Option<f64>,
}

/// Half the side of the square that is read around the expected place \[px\].
#[must_use]
pub fn reach_px(s: &TargetSettings) -> f64 {
    s.reach_px() + MARGIN_PX
}

/// Looks for the target in the frame behind `reader`: in the region where its pass has it, and in all of the search region if it is
/// not clear there. An object larger than the target is in other frames is a trail or a neighbour that joins it: what there is within
/// the bound of the target is measured then, if it is a detection.
///
/// # Errors
/// [`crate::Error::Fits`] if the file is damaged or none of its pixels can be used.
pub fn measure_in_window(
    reader: &FrameReader,
    night: &Calibrated,
    settings: &TargetSettings,
    region: Option<&Region>,
) -> Result<Seen> {
    let settings = &TargetSettings { known_disc2: region.and_then(|region| region.disc2), ..*settings };
    if let Some(region) = region.filter(|region| region.is_small(settings)) {
        let there = region.search(settings);
        let seen = if night.exhaustive {
            Some(measure_whole_frame(reader, night, &there)?)
        } else {
            measure_around(reader, night, &there)?
        };
        if let Some(seen) = seen.filter(|seen| is_clear(&seen.found, region, settings.detect_sigma)) {
            return Ok(seen);
        }
    }
    let around = if night.exhaustive { None } else { measure_around(reader, night, settings)? };
    let seen = around.map_or_else(|| measure_whole_frame(reader, night, settings), Ok)?;
    let is_joined = |region: &&Region| match &seen.found {
        TargetFound::Detected { flux, .. } => {
            let (a_px, b_px, _) = flux.shape.axes();
            region.is_joined((a_px, b_px))
        }
        TargetFound::NotDetected { .. } => false,
    };
    let Some(region) = region.filter(is_joined) else { return Ok(seen) };
    let bounded = TargetSettings { bound_px: Some(region.bound_px), ..region.search(settings) };
    let is_detected = |seen: &Seen| match &seen.found {
        TargetFound::Detected { flux, .. } => region.is_usual(flux.shape.axes().0) && flux.snr >= settings.detect_sigma,
        TargetFound::NotDetected { .. } => false,
    };
    Ok(measure_around(reader, night, &bounded)?.filter(is_detected).unwrap_or(seen))
}

/// Whether a target is as large as in other frames and has all around it that its measurement needs.
fn is_clear(found: &TargetFound, region: &Region, detect_sigma: f64) -> bool {
    match found {
        TargetFound::Detected { flux, light, unseen, .. } => {
            unseen.is_none()
                && flux.snr >= detect_sigma
                && region.is_usual(flux.shape.axes().0)
                && !flux.flags.any(CUT)
                && light.contamination_e.is_finite()
        }
        TargetFound::NotDetected { .. } => false,
    }
}

/// The target in the window around the place of the search; `None` where there is no sky around it.
fn measure_around(reader: &FrameReader, night: &Calibrated, settings: &TargetSettings) -> Result<Option<Seen>> {
    let p = &night.config.photometry;
    if let Some(frame) = around(reader, night, settings)? {
        let sky = sky_at(&frame, p.mesh_px, p.clip_sigma, settings);
        if let Some(sky) = sky {
            let found = measure_target(&frame, &sky, settings);
            let (TargetFound::Detected { flux, .. } | TargetFound::NotDetected { flux, .. }) = &found;
            if !flux.flags.has(Flags::NO_ANNULUS) && flux.flux_e.is_finite() {
                drop(frame);
                let corner_ratio = corner_ratio(reader, p.mesh_px, p.clip_sigma, &night.buffers)?;
                return Ok(Some(Seen { found, search_radius_px: settings.search_radius_px, corner_ratio }));
            }
        }
    }
    Ok(None)
}

/// The same with the whole clip circle read, including what [`measure_in_window`] skips.
///
/// # Errors
/// As [`measure_in_window`].
pub fn measure_whole_frame(reader: &FrameReader, night: &Calibrated, settings: &TargetSettings) -> Result<Seen> {
    let p = &night.config.photometry;
    let frame = night.usable(reader.whole(&night.buffers)?)?;
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    let found = measure_target(&frame, &sky, settings);
    Ok(Seen { found, search_radius_px: settings.search_radius_px, corner_ratio: sky.corner_ratio() })
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
