//! From the cells of a cutout to lines along the trails and back: cubic across, to the bit the same on every machine.
//!
//! Cells of the cutout; u along the trails, v across. Positions and sums of a few cells are worked out side by side; only
//! the look-ups between them are one by one. It does not cover what the lines are used for (`trail_model`).

use multiversion::multiversion;
use ndarray::Array2;

use crate::photometry::trails::direction::Turned;

/// Cells worked out side by side.
const LANES: usize = 16;
/// No cell.
const NONE: usize = usize::MAX;

/// Whole and fractional part; without a call of `floor`, which is a function where the instruction set is not known.
#[inline(always)]
fn split(x: f64) -> (i32, f64) {
    let towards_zero = x as i32;
    let whole = towards_zero - i32::from(x < f64::from(towards_zero));
    (whole, x - f64::from(whole))
}

/// The cubic through the two middle of four equally spaced values.
#[inline(always)]
pub(crate) fn catmull_rom(p: [f32; 4], t: f32) -> f32 {
    let (a, b) = (p[2] - p[0], 2.0 * p[0] - 5.0 * p[1] + 4.0 * p[2] - p[3]);
    p[1] + 0.5 * t * (a + t * (b + t * (3.0 * (p[1] - p[2]) + p[3] - p[0])))
}

/// Between which numbers of steps `at + steps · slope` lies within 0 and `n`; the first is the larger where none does.
fn steps_within(at: f64, slope: f64, n: usize) -> (f64, f64) {
    if slope.abs() < 1e-9 {
        return if (0.0..=n as f64).contains(&at) { (0.0, f64::INFINITY) } else { (f64::INFINITY, 0.0) };
    }
    let (a, b) = (-at / slope, (n as f64 - at) / slope);
    (a.min(b), a.max(b))
}

/// Bicubic values of an image of `(ny, nx)` cells along the line at `v`, from `u0` on in steps of a cell; NaN within a
/// cell of its edge and where a neighbour is NaN.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
pub(crate) fn cubic_along(
    image: &[f32],
    (ny, nx): (usize, usize),
    turned: &Turned,
    (u0, v): (f64, f64),
    out: &mut [f32],
) {
    let (x, y) = turned.xy(u0, v);
    let (by_columns, by_rows) = (steps_within(x, turned.cos, nx), steps_within(y, turned.sin, ny));
    let (from, to) = (by_columns.0.max(by_rows.0), by_columns.1.min(by_rows.1));
    for (chunk, out) in out.chunks_mut(LANES).enumerate() {
        let step = f64::from((chunk * LANES) as u32);
        if !(step <= to && step + LANES as f64 >= from) {
            out.fill(f32::NAN);
            continue;
        }
        let (mut t, mut s, mut first) = ([0f32; LANES], [0f32; LANES], [NONE; LANES]);
        for l in 0..LANES {
            let (x, y) = turned.xy(u0 + f64::from((chunk * LANES + l) as u32), v);
            let ((i, along), (j, across)) = (split(x), split(y));
            (t[l], s[l]) = (along as f32, across as f32);
            if i >= 1 && j >= 1 && ((i + 2) as usize) < nx && ((j + 2) as usize) < ny {
                first[l] = (j as usize - 1) * nx + i as usize - 1;
            }
        }
        let mut around = [[f32::NAN; LANES]; 16];
        for (l, at) in first.iter().enumerate().filter(|(_, at)| **at != NONE) {
            for r in 0..4 {
                let four = &image[at + r * nx..][..4];
                for c in 0..4 {
                    around[4 * r + c][l] = four[c];
                }
            }
        }
        let mut rows = [[0f32; LANES]; 4];
        for (row, of) in rows.iter_mut().zip(around.as_chunks::<4>().0) {
            for l in 0..LANES {
                row[l] = catmull_rom([of[0][l], of[1][l], of[2][l], of[3][l]], t[l]);
            }
        }
        let mut values = [0f32; LANES];
        for l in 0..LANES {
            values[l] = catmull_rom([rows[0][l], rows[1][l], rows[2][l], rows[3][l]], s[l]);
        }
        out.copy_from_slice(&values[..out.len()]);
    }
}

/// Levels and their changes, block by block on lines along the trails, made ready to be looked up.
pub(crate) struct Spread {
    turned: Turned,
    half: f64,
    block: f64,
    lines: i32,
    blocks: i32,
    /// Level of a block, what the next one adds to it, the larger change of the two; a block before the first of each
    /// line, a line before the first, two after the last.
    table: Vec<[f32; 3]>,
}

impl Spread {
    /// The rotation for lines through the middle of a cutout, `half` of them on each side, in blocks of `block` cells.
    pub fn new(turned: Turned, half: f64, block: usize, level: &Array2<f32>, change: &Array2<f32>) -> Self {
        let (lines, blocks) = level.dim();
        let mut table = Vec::with_capacity((lines + 3) * (blocks + 1));
        for k in 0..lines + 3 {
            let q = k.saturating_sub(1).min(lines - 1);
            for p in 0..=blocks {
                let (a, b) = (p.saturating_sub(1), p.min(blocks - 1));
                let (l, r) = (level[[q, a]], level[[q, b]]);
                // where only one is known it stands for both
                let (base, step) = match (l.is_finite(), r.is_finite()) {
                    (true, true) => (l, r - l),
                    (true, false) => (l, 0.0),
                    _ => (r, 0.0),
                };
                table.push([base, step, change[[q, a]].max(change[[q, b]])]);
            }
        }
        Self { turned, half, block: block as f64, lines: lines as i32, blocks: blocks as i32, table }
    }

    /// Level and change at every cell of row `j`: linear along the trails, cubic across.
    pub fn row(&self, j: usize, level: &mut [f32], change: &mut [f32]) {
        spread_row(self, j as f64, level, change);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn spread_row(spread: &Spread, y: f64, level: &mut [f32], change: &mut [f32]) {
    let Spread { turned, half, block, lines, blocks, table } = spread;
    let middle = 0.5 * (block - 1.0);
    let width = *blocks as usize + 1;
    for (chunk, (level, change)) in level.chunks_mut(LANES).zip(change.chunks_mut(LANES)).enumerate() {
        let (mut s, mut t, mut first) = ([0f32; LANES], [0f32; LANES], [0usize; LANES]);
        for l in 0..LANES {
            let (u, v) = turned.uv(f64::from((chunk * LANES + l) as u32), y);
            let ((line, across), (p, along)) = (split(v + half), split((u + half - middle) / block));
            (s[l], t[l]) = (along as f32, across as f32);
            first[l] = line.clamp(0, lines - 1) as usize * width + (p.clamp(-1, blocks - 1) + 1) as usize;
        }
        let (mut base, mut step, mut larger) = ([[0f32; LANES]; 4], [[0f32; LANES]; 4], [0f32; LANES]);
        for l in 0..LANES {
            for r in 0..4 {
                let [b, d, c] = table[first[l] + r * width];
                (base[r][l], step[r][l]) = (b, d);
                if r == 1 {
                    larger[l] = c;
                }
            }
        }
        let mut values = [0f32; LANES];
        for l in 0..LANES {
            let along = |r: usize| base[r][l] + s[l] * step[r][l];
            values[l] = catmull_rom([along(0), along(1), along(2), along(3)], t[l]);
        }
        level.copy_from_slice(&values[..level.len()]);
        change.copy_from_slice(&larger[..change.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(dim: (usize, usize)) -> Array2<f32> {
        Array2::from_shape_fn(dim, |(j, i)| ((j * 7919 + i * 104_729 + j * i * 31) % 1013) as f32 - 400.0)
    }

    #[test]
    fn whole_and_fractional_part_are_those_of_the_floor() {
        for x in [0.0, -0.0, 0.25, -0.25, 1.0, -1.0, -1.75, 1e6 + 0.5, -1e6 - 0.5, 0.1 + 0.2] {
            assert_eq!(split(x), (f64::floor(x) as i32, x - f64::floor(x)), "{x}");
        }
    }

    #[test]
    fn values_along_a_line_are_the_cubics_of_the_four_by_four_cells_around() {
        let image = image((41, 57));
        let all = image.as_slice().unwrap();
        for theta in [0.0, 0.4, 1.3, 2.9] {
            let turned = Turned::new(image.dim(), theta);
            let mut n_inside = 0;
            for line in -40..=40 {
                let (u0, v) = (-37.0, f64::from(line));
                let mut got = [0f32; 75];
                cubic_along(all, image.dim(), &turned, (u0, v), &mut got);
                for (k, got) in got.iter().enumerate() {
                    let (x, y) = turned.xy(u0 + k as f64, v);
                    let (i, j) = (x.floor(), y.floor());
                    if i < 1.0 || j < 1.0 || i + 2.0 >= 57.0 || j + 2.0 >= 41.0 {
                        assert!(got.is_nan());
                        continue;
                    }
                    let cell = |r: usize, c: usize| image[[j as usize + r - 1, i as usize + c - 1]];
                    let row = |r| catmull_rom([cell(r, 0), cell(r, 1), cell(r, 2), cell(r, 3)], (x - i) as f32);
                    let wanted = catmull_rom([row(0), row(1), row(2), row(3)], (y - j) as f32);
                    assert_eq!(*got, wanted, "{theta} {line} {k}");
                    n_inside += 1;
                }
            }
            assert!(n_inside > 1500, "{n_inside}");
        }
    }

    #[test]
    fn a_cell_has_the_level_between_its_blocks_and_lines_and_the_larger_change() {
        let (dim, half, block) = ((41, 57), 37.0, 6usize);
        let (lines, blocks) = (75, 13);
        let mut level = image((lines, blocks));
        level.iter_mut().step_by(11).for_each(|v| *v = f32::NAN);
        let change = image((blocks, lines)).reversed_axes().as_standard_layout().to_owned();
        let turned = Turned::new(dim, 0.7);
        let spread = Spread::new(turned, half, block, &level, &change);
        let (mut got, mut got_change) = (vec![0f32; dim.1], vec![0f32; dim.1]);
        for j in 0..dim.0 {
            spread.row(j, &mut got, &mut got_change);
            for i in 0..dim.1 {
                let (u, v) = turned.uv(i as f64, j as f64);
                let (y, x) = (v + half, (u + half - 2.5) / block as f64);
                let clamped = |k: f64, n: usize| k.clamp(0.0, n as f64 - 1.0) as usize;
                let (a, b) = (clamped(x.floor(), blocks), clamped(x.floor() + 1.0, blocks));
                let along = |r: f64| {
                    let q = clamped(y.floor() + r, lines);
                    match (level[[q, a]], level[[q, b]]) {
                        (l, r) if l.is_finite() && r.is_finite() => l + (x - x.floor()) as f32 * (r - l),
                        (l, _) if l.is_finite() => l,
                        (_, r) => r,
                    }
                };
                let wanted = catmull_rom([along(-1.0), along(0.0), along(1.0), along(2.0)], (y - y.floor()) as f32);
                assert!(got[i] == wanted || (got[i].is_nan() && wanted.is_nan()), "{i} {j} {} {wanted}", got[i]);
                let q = clamped(y.floor(), lines);
                assert_eq!(got_change[i], change[[q, a]].max(change[[q, b]]));
            }
        }
    }
}
