//! Sums along lines through the cuts of a patch, for many lines that begin next to each other at once.
//!
//! Electrons; columns of a patch and rows of its cuts. It does not cover which line is a hit ([`super::cosmic_rays`]).

use std::ops::Range;

use multiversion::multiversion;
use ndarray::Array2;

/// Lines that are summed side by side: one AVX-512 register.
pub(super) const LANES: usize = 16;

/// What a line sums: the light and its variance in the cut of the sharpest star, the light in that of the star of the night.
pub(super) const KINDS: usize = 3;

/// A piece with less of the variance of its line than this holds no pixels.
pub(super) const LEAST_SHARE: f32 = 1e-6;

/// The running sums of [`LANES`] lines after a column.
pub(super) type Sums = [[f32; LANES]; KINDS];

/// The cuts column by column: the rows that are looked at, and zeros for the lines that begin or end among them.
pub(super) struct Columns {
    kinds: [Vec<f32>; KINDS],
    stride: usize,
    /// Place of row 0 in a column, which may be before it.
    origin: isize,
    /// Places in a column that are looked at.
    seen: Range<isize>,
}

impl Columns {
    /// The `rows` of the cuts that are looked at.
    pub fn new(cuts: [&Array2<f32>; KINDS], rows: &Range<usize>) -> Self {
        let nx = cuts[0].ncols();
        let stride = rows.len() + 2 * LANES;
        let kinds = cuts.map(|cut| {
            let mut columns = vec![0.0; nx * stride];
            for (out, column) in columns.chunks_exact_mut(stride).zip(cut.columns()) {
                let seen = column.iter().skip(rows.start).take(rows.len());
                out.iter_mut().skip(LANES).zip(seen).for_each(|(out, v)| *out = *v);
            }
            columns
        });
        let seen = LANES as isize..(LANES + rows.len()) as isize;
        Self { kinds, stride, origin: LANES as isize - rows.start as isize, seen }
    }

    /// The sums of the lines that begin at row `start` and after it and rise by `rises` in each column: none before the first column,
    /// then after each.
    pub fn sum(&self, start: isize, rises: &[isize], sums: &mut [Sums]) {
        let first = start + self.origin;
        let kinds = [0, 1, 2].map(|kind| self.kinds[kind].as_slice());
        add_up(kinds, (self.stride, &self.seen), first, rises, sums);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn add_up(
    kinds: [&[f32]; KINDS],
    (stride, seen): (usize, &Range<isize>),
    first: isize,
    rises: &[isize],
    sums: &mut [Sums],
) {
    let mut sum = [[0.0; LANES]; KINDS];
    let Some((none, after)) = sums.split_first_mut() else { return };
    *none = sum;
    for (i, (rise, out)) in rises.iter().zip(after).enumerate() {
        let row = first + rise;
        if row < seen.end && row + LANES as isize > seen.start {
            let at = i * stride + row as usize;
            for (sum, column) in sum.iter_mut().zip(kinds) {
                let values = &column[at..at + LANES];
                sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
            }
        }
        *out = sum;
    }
}

/// Whether a piece of `length` columns of any line, of those that begin every `step`, has in the star of the night more than `least` of
/// its errors.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn any_above(sums: &[Sums], length: usize, step: usize, least: f32) -> bool {
    let floor = sums.last().map_or([0.0; LANES], |whole| whole[1].map(|q| LEAST_SHARE * q));
    let mut any = [0u32; LANES];
    for (a, b) in sums.iter().zip(&sums[length..]).step_by(step) {
        for l in 0..LANES {
            let (q, n) = (b[1][l] - a[1][l], b[2][l] - a[2][l]);
            any[l] |= u32::from((n > 0.0) & (n * n > least * least * q) & (q > floor[l]));
        }
    }
    any.iter().any(|any| *any > 0)
}
