//! The pixels of an annulus, as runs of columns.
//!
//! A pixel belongs to the annulus with its centre: no shares. Full-frame columns and rows. It does not cover masks.

use std::ops::Range;

use multiversion::multiversion;

use super::Bounds;
use super::pixels::cells;

/// Rows whose ends are found at once.
const LANES: usize = 8;

/// Calls `visit(columns, j)` for the runs of pixels with `inner`² ≤ (i − x)² + (j − y)² ≤ `outer`².
///
/// Rows ascending, in each at most two runs, left before right. A position that is not finite visits nothing.
pub(crate) fn for_each_ring_run(
    (x, y): (f64, f64),
    (inner, outer): (f64, f64),
    bounds: Bounds,
    mut visit: impl FnMut(Range<usize>, usize),
) {
    if !x.is_finite() {
        return;
    }
    let (inner2, outer2) = (inner.max(0.0).powi(2), outer.max(0.0).powi(2));
    let rows = cells(y - outer, y + outer, bounds.y0, bounds.y1);
    let end = rows.end;
    let (mut whole, mut hole) = ([(0, 0); LANES], [(0, 0); LANES]);
    for first in rows.step_by(LANES) {
        ring_rows(x, y, (inner2, outer2), first, (bounds.x0, bounds.x1), &mut whole, &mut hole);
        for (j, (whole, hole)) in (first..end).zip(whole.iter().zip(&hole)) {
            let (whole, hole) = (whole.0 as usize..whole.1 as usize, hole.0 as usize..hole.1 as usize);
            if whole.is_empty() {
                continue;
            }
            if hole.is_empty() {
                visit(whole, j);
                continue;
            }
            for run in [whole.start..hole.start, hole.end..whole.end] {
                if !run.is_empty() {
                    visit(run, j);
                }
            }
        }
    }
}

/// Columns of the outer and of the inner circle in the rows from `first` on, start and end.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn ring_rows(
    x: f64,
    y: f64,
    (inner2, outer2): (f64, f64),
    first: usize,
    (lo, hi): (usize, usize),
    whole: &mut [(i32, i32); LANES],
    hole: &mut [(i32, i32); LANES],
) {
    let (first, lo, hi) = (first as i32, lo as f64, hi as f64);
    for lane in 0..LANES {
        let dy2 = (f64::from(first + lane as i32) - y).powi(2);
        let distance2 = |i: i32| (f64::from(i) - x).powi(2) + dy2;
        // the root says where to look, at most half a pixel too far; the squares say who belongs
        let reach = (outer2 - dy2).max(0.0).sqrt();
        let start = (x - reach + 0.5).max(lo).min(hi) as i32;
        let end = (x + reach + 1.5).max(lo).min(hi) as i32;
        let start = start + i32::from(!(distance2(start) <= outer2));
        // never below the start: nothing wraps where the circle does not reach
        let end = (end - i32::from(!(distance2(end - 1) <= outer2))).max(start);
        whole[lane] = (start, end);
        let (lo, hi) = (f64::from(start), f64::from(end));
        let hollow = (inner2 - dy2).max(0.0).sqrt();
        let start = (x - hollow + 0.5).max(lo).min(hi) as i32;
        let end = (x + hollow + 1.5).max(lo).min(hi) as i32;
        let start = start + i32::from(!(distance2(start) < inner2));
        hole[lane] = (start, (end - i32::from(!(distance2(end - 1) < inner2))).max(start));
    }
}
