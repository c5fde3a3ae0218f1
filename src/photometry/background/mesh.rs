//! The mesh: the good pixels of its boxes, boxes without enough of them, outliers among the boxes.
//!
//! Electrons. It does not cover the statistics of a box and what lies between boxes.

use std::ops::Range;

use ndarray::{Array2, Axis, s};
use rayon::prelude::*;

use super::histogram::Bins;
use super::mode::{Mode, mode_of_box};
use crate::base::stats;
use crate::frames::{Electrons, Frame};
use crate::photometry::rows::Rows;
use crate::{Error, Result};

/// Boxes with fewer good pixels than this share of a whole box are filled from their neighbours.
pub(crate) const MIN_GOOD_FRAC: f64 = 0.5;
/// Boxes are read side by side over about as many columns: a page of pixels, and the boxes stay in the second-level cache.
const COLUMNS_TOGETHER: usize = 1024;

/// The modes of the boxes, in rows of boxes from the frame's first pixel on; one level where no box has enough pixels.
pub(super) fn modes_of_boxes(
    frame: &Frame<Electrons>,
    mesh_px: usize,
    clip_sigma: f64,
) -> Result<Array2<Option<Mode>>> {
    let (ny, nx) = frame.pixels.dim();
    let (boxes_y, boxes_x) = (ny.div_ceil(mesh_px), nx.div_ceil(mesh_px));
    // a sliver at the edge of the frame counts as its own size only if it is half a box
    let enough = MIN_GOOD_FRAC * (mesh_px * mesh_px).min(ny * nx) as f64;
    let rows = Rows::of(frame);
    let mut modes = Array2::from_elem((boxes_y, boxes_x), None);
    let together = (COLUMNS_TOGETHER / mesh_px).max(1);
    modes.outer_iter_mut().into_par_iter().enumerate().for_each_init(
        || (vec![Vec::new(); together], Bins::new()),
        |(values, bins), (b, mut modes)| {
            let across = b * mesh_px..((b + 1) * mesh_px).min(ny);
            for (g, mut modes) in modes.axis_chunks_iter_mut(Axis(0), together).enumerate() {
                let from = g * together * mesh_px;
                let along = from..(from + modes.len() * mesh_px).min(nx);
                good_pixels(&rows, across.clone(), along, mesh_px, values);
                for (mode, values) in modes.iter_mut().zip(values.iter_mut()) {
                    *mode = mode_of_box(values, bins, enough, clip_sigma);
                }
            }
        },
    );
    if modes.iter().all(Option::is_none) {
        let mut values = [Vec::new()];
        good_pixels(&rows, 0..ny, 0..nx, nx.max(1), &mut values);
        let Some(mode) = mode_of_box(&mut values[0], &mut Bins::new(), 1.0, clip_sigma) else {
            return Err(Error::Fits {
                path: frame.path.clone(),
                problem: format!("none of its {nx}x{ny} pixels is good (all NaN, masked or outside the clip circle)"),
            });
        };
        modes.fill(Some(mode));
    }
    Ok(modes)
}

/// The unmasked pixels of neighbouring boxes, each row by row. A row is read through all of them at once: memory is
/// fast where it is read in long pieces.
fn good_pixels(rows: &Rows, across: Range<usize>, along: Range<usize>, mesh_px: usize, out: &mut [Vec<f32>]) {
    out.iter_mut().for_each(Vec::clear);
    for j in across {
        let (pixels, bits) = rows.part(j, along.clone());
        let clean = bits.iter().fold(0, |any, m| any | m) == 0;
        for ((pixels, bits), out) in pixels.chunks(mesh_px).zip(bits.chunks(mesh_px)).zip(out.iter_mut()) {
            if clean {
                out.extend_from_slice(pixels);
            } else {
                out.extend(pixels.iter().zip(bits).filter(|(_, m)| **m == 0).map(|(v, _)| *v));
            }
        }
    }
}

/// Gives a box without a mode the mean of its nearest boxes that have one.
pub(super) fn fill_from_neighbours(modes: &Array2<Option<Mode>>) -> Array2<Mode> {
    let (ny, nx) = modes.dim();
    // the nearest box with a mode in its own row, to the left and to the right
    let mut neighbours = Array2::from_elem((ny, nx), (None, None));
    for (row, mut neighbours) in modes.outer_iter().zip(neighbours.outer_iter_mut()) {
        let mut last = None;
        for i in 0..nx {
            last = if row[i].is_some() { Some(i) } else { last };
            neighbours[i].0 = last;
        }
        last = None;
        for i in (0..nx).rev() {
            last = if row[i].is_some() { Some(i) } else { last };
            neighbours[i].1 = last;
        }
    }
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        if let Some(mode) = modes[[j, i]] {
            return mode;
        }
        let squared = |row: usize, column: usize| row.abs_diff(j).pow(2) + column.abs_diff(i).pow(2);
        let in_row = |row: usize| {
            let (left, right) = neighbours[[row, i]];
            [left, right.filter(|_| left != right)].into_iter().flatten()
        };
        let (mut nearest, mut reach) = (usize::MAX, 0usize);
        while reach < ny && reach * reach <= nearest {
            for row in [j.checked_sub(reach), (j + reach < ny).then_some(j + reach)].into_iter().flatten() {
                nearest = in_row(row).map(|column| squared(row, column)).fold(nearest, usize::min);
            }
            reach += 1;
        }
        let (mut n, mut level, mut sigma) = (0.0, 0.0, 0.0);
        for row in j.saturating_sub(reach)..(j + reach + 1).min(ny) {
            for mode in in_row(row).filter(|&c| squared(row, c) == nearest).filter_map(|c| modes[[row, c]]) {
                n += 1.0;
                level += mode.level;
                sigma += mode.sigma;
            }
        }
        Mode { level: level / n, sigma: sigma / n }
    })
}

/// Median over 3×3 boxes; at an edge the window shrinks on both sides, so that a gradient is not bent.
pub(super) fn median_3x3(map: &Array2<f64>) -> Array2<f64> {
    let (ny, nx) = map.dim();
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        let (rj, ri) = (usize::from(j > 0 && j + 1 < ny), usize::from(i > 0 && i + 1 < nx));
        let (mut window, mut n) = ([0.0; 9], 0);
        for v in map.slice(s![j - rj..=j + rj, i - ri..=i + ri]) {
            window[n] = *v;
            n += 1;
        }
        stats::median(&mut window[..n]).unwrap_or(map[[j, i]])
    })
}
