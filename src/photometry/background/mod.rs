//! The sky under everything: a mesh of clipped modes, median filtered, joined by a bicubic spline.
//!
//! Levels and scatter in the unit of the frame (electrons), positions in full-frame pixels. The recipe is SExtractor's
//! (Bertin & Arnouts 1996, A&AS 117, 393, §3). It does not cover weights or crowded-field modelling.

mod histogram;
mod mesh;
mod mode;
mod spline;

use std::ops::Range;

use ndarray::Array2;

use crate::base::stats;
use crate::frames::{Electrons, Frame};
use crate::{Error, Result};

pub(crate) use mesh::MIN_GOOD_FRAC;
use mesh::{fill_from_neighbours, median_3x3, modes_of_boxes};
use mode::Mode;
pub(crate) use spline::{Pixels, Spline};

/// Level and scatter of the sky, a smooth function of position.
#[derive(Debug, Clone)]
pub struct Background {
    origin_px: (f64, f64),
    mesh_px: f64,
    level: Spline,
    rms: Spline,
    global_level: f64,
    global_rms: f64,
    /// Centre of the boxes of the corner ratio with enough good pixels, from the centre of the frame \[px\], and their levels.
    measured: Vec<(f64, f64, f64)>,
}

/// Measures the sky of a frame on a mesh of `mesh_px` boxes, clipping at `clip_sigma` (3 is usual).
///
/// Per box: a histogram of the unmasked pixels is clipped at ±`clip_sigma` around its median until σ settles; the level
/// is the mode 2.5 median − 1.5 mean, or the median where mean and median differ by more than 0.3 σ. Then a 3×3 median
/// over the mesh, and a natural bicubic spline through the box centres. Cost: about three passes over the pixels;
/// memory: one box per thread.
///
/// # Errors
/// [`Error::Config`] for a mesh below 8 px or a clip that is not positive; [`Error::Fits`] for a frame with no good pixel.
pub fn background(frame: &Frame<Electrons>, mesh_px: usize, clip_sigma: f64) -> Result<Background> {
    if mesh_px < 8 {
        return Err(Error::Config {
            key: "photometry.mesh_px".into(),
            problem: format!("{mesh_px} px is too small for statistics; at least 8, usually 64"),
        });
    }
    if clip_sigma.is_nan() || clip_sigma <= 0.0 {
        return Err(Error::Config {
            key: "photometry.clip_sigma".into(),
            problem: format!("{clip_sigma} is not a positive number of sigma; usually 3"),
        });
    }
    let modes = modes_of_boxes(frame, mesh_px, clip_sigma)?;
    let (ny, nx) = frame.pixels.dim();
    let measured = modes.indexed_iter();
    let measured = measured
        .filter(|((j, _), _)| is_of_corner_ratio(*j, modes.nrows()))
        .filter_map(|((j, i), mode)| {
            mode.map(|m| (centre_of_box(i, nx, mesh_px), centre_of_box(j, ny, mesh_px), m.level))
        })
        .collect();
    let filled = fill_from_neighbours(&modes);
    let level = median_3x3(&filled.mapv(|m| m.level));
    let rms = median_3x3(&filled.mapv(|m| m.sigma));
    Ok(Background {
        origin_px: (frame.origin_px.0 as f64, frame.origin_px.1 as f64),
        mesh_px: mesh_px as f64,
        global_level: stats::median(&mut level.iter().copied().collect::<Vec<_>>()).unwrap_or(0.0),
        global_rms: stats::median(&mut rms.iter().copied().collect::<Vec<_>>()).unwrap_or(0.0),
        level: Spline::through(&level),
        rms: Spline::through(&rms),
        measured,
    })
}

/// The edge of a field begins at this share of the largest distance of a measured box from the centre.
pub(crate) const EDGE_FRAC: f64 = 0.85;
/// The centre ends at this share of it.
pub(crate) const CENTRE_FRAC: f64 = 0.3;

/// Centre along one axis of box `b` of `mesh_px`, from the middle of `n` pixels \[px\].
pub(crate) fn centre_of_box(b: usize, n: usize, mesh_px: usize) -> f64 {
    (b * mesh_px) as f64 + 0.5 * (mesh_px.min(n - b * mesh_px) as f64 - n as f64)
}

/// Of so many rows of boxes and more not all are needed for [`Background::corner_ratio`] ...
const MANY_ROWS: usize = 64;
/// ... so many are enough: a quadrant of the edge of a clip circle has some 50 boxes in them. Whole rows, since what is read of a file in
/// one piece costs less than as many boxes one by one.
const CORNER_ROWS: usize = 16;

/// Whether the boxes in row `j` of a mesh of so many rows are those of the corner ratio: of 64 rows and more every fourth, of 80 and more
/// every fifth, and so on.
pub(crate) fn is_of_corner_ratio(j: usize, rows: usize) -> bool {
    rows < MANY_ROWS || j.is_multiple_of(rows / CORNER_ROWS)
}

/// [`Background::corner_ratio`] of boxes: centre from the middle of the field \[px\], and level.
pub(crate) fn edge_over_centre(measured: &[(f64, f64, f64)]) -> Option<f64> {
    let farthest = measured.iter().map(|(x, y, _)| x.hypot(*y)).fold(0.0, f64::max);
    let median_where = |inside: &dyn Fn(f64, f64) -> bool| {
        let levels = measured.iter().filter(|(x, y, _)| inside(*x, *y)).map(|(_, _, level)| *level);
        stats::median(&mut levels.collect::<Vec<f64>>())
    };
    let mut edge = 0.0;
    for (left, below) in [(true, true), (true, false), (false, true), (false, false)] {
        let quadrant = |x: f64, y: f64| (x < 0.0) == left && (y < 0.0) == below && x.hypot(y) >= EDGE_FRAC * farthest;
        edge += 0.25 * median_where(&quadrant)?;
    }
    let centre = median_where(&|x, y| x.hypot(y) <= CENTRE_FRAC * farthest)?;
    (centre > 0.0).then(|| edge / centre)
}

/// Levels of the boxes of a mesh from the frame's first pixel on \[e⁻/px\], before any is compared with its neighbours;
/// `None` where a box has too few good pixels.
///
/// # Errors
/// [`crate::Error::Fits`] if no pixel is good.
pub(crate) fn levels_of_boxes(
    frame: &Frame<Electrons>,
    mesh_px: usize,
    clip_sigma: f64,
) -> Result<Array2<Option<f64>>> {
    Ok(modes_of_boxes(frame, mesh_px, clip_sigma)?.mapv(|mode| mode.map(|m| m.level)))
}

/// The spline through levels at the centres of boxes, in units of boxes; a box without one has the mean of its nearest.
pub(crate) fn through_boxes(levels: &Array2<Option<f64>>) -> Spline {
    let modes = levels.mapv(|level| level.map(|level| Mode { level, sigma: 0.0 }));
    Spline::through(&fill_from_neighbours(&modes).mapv(|mode| mode.level))
}

impl Background {
    /// Position in units of boxes: the centre of the first box is 0.
    fn boxes(&self, px: f64, origin: f64) -> f64 {
        (px - origin + 0.5) / self.mesh_px - 0.5
    }

    fn at(&self, spline: &Spline, x_px: f64, y_px: f64) -> f64 {
        spline.at(self.boxes(x_px, self.origin_px.0), self.boxes(y_px, self.origin_px.1))
    }

    fn fill(&self, spline: &Spline, y_px: usize, x0_px: usize, out: &mut [f32]) {
        let (x, y) = (self.boxes(x0_px as f64, self.origin_px.0), self.boxes(y_px as f64, self.origin_px.1));
        spline.row(y, x, 1.0 / self.mesh_px, out);
    }

    /// Level of the sky \[e⁻/px\] at a full-frame position.
    #[must_use]
    pub fn level(&self, x_px: f64, y_px: f64) -> f64 {
        self.at(&self.level, x_px, y_px)
    }

    /// Scatter of the sky \[e⁻\] at a full-frame position.
    #[must_use]
    pub fn rms(&self, x_px: f64, y_px: f64) -> f64 {
        self.at(&self.rms, x_px, y_px).max(0.0)
    }

    /// Error of [`Background::level`] \[e⁻/px\] from noise alone: that of a mode 2.5 median − 1.5 mean of one box,
    /// σ √(2.5²·π/2 + 1.5² − 2·2.5·1.5)/n = 2.14 σ/mesh.
    #[must_use]
    pub fn level_err(&self, x_px: f64, y_px: f64) -> f64 {
        2.14 * self.rms(x_px, y_px) / self.mesh_px
    }

    /// Level at the edge of the field over that at its centre: 1 for an even field, less where the beam is cut.
    ///
    /// Edge: the boxes beyond 0.85 of the largest distance from the centre, the median of each quadrant, then
    /// the mean of the four, in which a gradient cancels. Centre: the median of the boxes within 0.3. Of a mesh of 64 rows of boxes
    /// and more every fourth row counts, of one of 80 every fifth, and so on. Trails do not lift a mode.
    /// `None` if a quadrant has no box at the edge or the level at the centre is not above zero.
    #[must_use]
    pub fn corner_ratio(&self) -> Option<f64> {
        edge_over_centre(&self.measured)
    }

    /// Median level over the mesh \[e⁻/px\].
    #[must_use]
    pub fn global_level(&self) -> f64 {
        self.global_level
    }

    /// Median scatter over the mesh \[e⁻\].
    #[must_use]
    pub fn global_rms(&self) -> f64 {
        self.global_rms
    }

    /// Level \[e⁻/px\] of a part of the full-frame row `y_px` that starts at `x0_px`.
    pub fn level_row(&self, y_px: usize, x0_px: usize, out: &mut [f32]) {
        self.fill(&self.level, y_px, x0_px, out);
    }

    /// What a part of the full-frame row `y_px` that starts at `x0_px` has above the level and `offset_e` \[e⁻\]; 0 where
    /// it cannot be used.
    pub(crate) fn above_row(&self, y_px: usize, x0_px: usize, pixels: Pixels, offset_e: f32, out: &mut [f32]) {
        let (x, y) = (self.boxes(x0_px as f64, self.origin_px.0), self.boxes(y_px as f64, self.origin_px.1));
        self.level.row_above((y, x, 1.0 / self.mesh_px), pixels, offset_e, out);
    }

    /// Scatter \[e⁻\] of a part of the full-frame row `y_px` that starts at `x0_px`.
    pub fn rms_row(&self, y_px: usize, x0_px: usize, out: &mut [f32]) {
        self.fill(&self.rms, y_px, x0_px, out);
        out.iter_mut().for_each(|v| *v = v.max(0.0));
    }

    /// A scatter \[e⁻\] that no pixel of a part of the full frame lies below, within rounding: close to the smallest.
    pub(crate) fn rms_floor(&self, columns_px: Range<usize>, rows_px: Range<usize>) -> f32 {
        let span = |range: Range<usize>, origin: f64| {
            self.boxes(range.start as f64, origin)..=self.boxes(range.end as f64 - 1.0, origin)
        };
        let floor = self.rms.floor_over(span(columns_px, self.origin_px.0), span(rows_px, self.origin_px.1));
        (floor * (1.0 - 1e-6)).max(0.0) as f32
    }
}
