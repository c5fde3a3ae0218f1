//! The sky at the edge of the field over that at its centre, read from those boxes of the mesh alone.
//!
//! Electrons, positions in pixels from the centre of the field. The rest of a target frame need not be read: edge and
//! centre are a third of the clip circle. It does not cover what a departure means ([`crate::pipeline::vet`]).

use std::ops::Range;

use rayon::prelude::*;

use crate::base::error::Result;
use crate::frames::{Buffers, FrameReader};
use crate::photometry::background::{
    CENTRE_FRAC, EDGE_FRAC, MIN_GOOD_FRAC, background, centre_of_box, edge_over_centre, is_of_corner_ratio,
    levels_of_boxes,
};

/// The boxes of the mesh over the box of the clip circle.
struct Mesh<'a> {
    reader: &'a FrameReader<'a>,
    buffers: &'a Buffers,
    mesh_px: usize,
    clip_sigma: f64,
    size_px: (usize, usize),
    /// Good pixels a box must have.
    enough: f64,
}

/// What is known of a box.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    NotRead,
    /// Too few good pixels, or none of those that count.
    NotUsed,
    Level(f64),
}

/// Level of the sky at the edge over that at the centre: 1 for an even field, less where the beam is cut.
///
/// Edge: the boxes beyond 0.85 of the largest distance from the centre, the median of each quadrant, then the mean of
/// the four, in which a gradient cancels. Centre: the median of the boxes within 0.3. The boxes and their levels are
/// those of [`background`] over the whole clip circle. `None` if a quadrant has no box at the edge or the centre has
/// no level above zero.
///
/// # Errors
/// [`crate::Error::Fits`] if the file is damaged, or has no good pixel at all.
pub fn corner_ratio(reader: &FrameReader, mesh_px: usize, clip_sigma: f64, buffers: &Buffers) -> Result<Option<f64>> {
    let (columns, rows) = reader.box_px();
    let size_px = (columns.len(), rows.len());
    let enough = MIN_GOOD_FRAC * (mesh_px * mesh_px).min(size_px.0 * size_px.1) as f64;
    let mesh = Mesh { reader, buffers, mesh_px, clip_sigma, size_px, enough };
    let (nx, ny) = mesh.boxes();
    let mut known: Vec<Known> = (0..nx * ny).map(|b| mesh.before_reading(b)).collect();
    // which boxes are at the edge depends on the farthest one that has enough good pixels: known once no farther one is
    // unread
    loop {
        let possible = (0..nx * ny).filter(|b| known[*b] != Known::NotUsed);
        let farthest = possible.map(|b| mesh.distance(b)).fold(0.0, f64::max);
        let of_use = |b: usize| {
            let distance = mesh.distance(b);
            distance >= EDGE_FRAC * farthest || distance <= CENTRE_FRAC * farthest
        };
        let wanted: Vec<bool> = (0..nx * ny).map(|b| known[b] == Known::NotRead && of_use(b)).collect();
        if !wanted.contains(&true) {
            break;
        }
        mesh.measure(&wanted, &mut known)?;
    }
    let measured: Vec<(f64, f64, f64)> = (0..nx * ny)
        .filter_map(|b| if let Known::Level(level) = known[b] { Some((b, level)) } else { None })
        .map(|(b, level)| (mesh.centre(b).0, mesh.centre(b).1, level))
        .collect();
    if measured.is_empty() {
        // no box that counts has enough: the mesh then knows one level for all
        return Ok(background(&*reader.whole(buffers)?, mesh_px, clip_sigma)?.corner_ratio());
    }
    Ok(edge_over_centre(&measured))
}

impl Mesh<'_> {
    /// Columns and rows of boxes.
    fn boxes(&self) -> (usize, usize) {
        (self.size_px.0.div_ceil(self.mesh_px), self.size_px.1.div_ceil(self.mesh_px))
    }

    /// Centre of a box from the centre of the field \[px\].
    fn centre(&self, b: usize) -> (f64, f64) {
        let (nx, _) = self.boxes();
        (centre_of_box(b % nx, self.size_px.0, self.mesh_px), centre_of_box(b / nx, self.size_px.1, self.mesh_px))
    }

    fn distance(&self, b: usize) -> f64 {
        let (x, y) = self.centre(b);
        x.hypot(y)
    }

    /// Full-frame columns or rows of boxes `k` to `end` along one axis.
    fn px(&self, k: usize, end: usize, (from, n): (usize, usize)) -> Range<usize> {
        from + k * self.mesh_px..from + (end * self.mesh_px).min(n)
    }

    /// What follows for a box from the clip circle alone.
    fn before_reading(&self, b: usize) -> Known {
        let (columns, rows) = self.reader.box_px();
        let (nx, ny) = self.boxes();
        if !is_of_corner_ratio(b / nx, ny) {
            return Known::NotUsed;
        }
        let x = self.px(b % nx, b % nx + 1, (columns.start, self.size_px.0));
        let y = self.px(b / nx, b / nx + 1, (rows.start, self.size_px.1));
        let inside = |y: usize| {
            let kept = self.reader.inside(y);
            kept.end.min(x.end).saturating_sub(kept.start.max(x.start))
        };
        let pixels: usize = y.map(inside).sum();
        if (pixels as f64) < self.enough { Known::NotUsed } else { Known::NotRead }
    }

    /// Reads the wanted boxes, neighbours of a row of boxes together.
    fn measure(&self, wanted: &[bool], known: &mut [Known]) -> Result<()> {
        let (nx, ny) = self.boxes();
        let mut runs: Vec<Range<usize>> = Vec::new();
        for row in 0..ny {
            let of_row = (row * nx..(row + 1) * nx).filter(|b| wanted[*b]);
            let first_of_row = runs.len();
            for b in of_row {
                match runs[first_of_row..].last_mut() {
                    // where rows are compressed whole, a second run would unpack them a second time
                    Some(run) if run.end == b || !self.reader.reads_parts() => run.end = b + 1,
                    _ => runs.push(b..b + 1),
                }
            }
        }
        let levels: Vec<Vec<(usize, Known)>> =
            runs.into_par_iter().map(|run| self.read_run(run, wanted)).collect::<Result<_>>()?;
        levels.into_iter().flatten().for_each(|(b, level)| known[b] = level);
        Ok(())
    }

    /// The wanted boxes of one run.
    fn read_run(&self, run: Range<usize>, wanted: &[bool]) -> Result<Vec<(usize, Known)>> {
        let (nx, _) = self.boxes();
        let (columns, rows) = self.reader.box_px();
        let (row, first) = (run.start / nx, run.start % nx);
        let x = self.px(first, first + run.len(), (columns.start, self.size_px.0));
        let y = self.px(row, row + 1, (rows.start, self.size_px.1));
        let frame = self.reader.part(x, y, self.buffers)?;
        let width = frame.pixels.ncols();
        let column = |b: usize| b % nx - first;
        let good = |b: usize| {
            let columns = column(b) * self.mesh_px..((column(b) + 1) * self.mesh_px).min(width);
            let part = ndarray::s![.., columns];
            let good = |(v, m): (&f32, &u8)| *m == 0 && v.is_finite();
            frame.pixels.slice(part).iter().zip(frame.mask.slice(part)).filter(|at| good(*at)).count()
        };
        let wanted = run.filter(|b| wanted[*b]).map(|b| (b, good(b) as f64 >= self.enough));
        let wanted: Vec<(usize, bool)> = wanted.collect();
        if !wanted.iter().any(|(_, enough)| *enough) {
            return Ok(wanted.into_iter().map(|(b, _)| (b, Known::NotUsed)).collect());
        }
        let levels = levels_of_boxes(&frame, self.mesh_px, self.clip_sigma)?;
        let known = |(b, enough): (usize, bool)| {
            let level = levels[[0, column(b)]].filter(|_| enough);
            (b, level.map_or(Known::NotUsed, Known::Level))
        };
        Ok(wanted.into_iter().map(known).collect())
    }
}
