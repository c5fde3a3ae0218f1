//! Where the target ends, if other frames of its pass show it: nothing beyond that is part of it.
//!
//! Cells of the cutout. What goes on beyond the bound is a trail or a neighbour.

use std::borrow::Cow;

use ndarray::Array2;

use crate::photometry::target::cutout::Cutout;

impl Cutout {
    /// Significances in squares of `scale` cells, none of which is more than 0 where nothing is part of the target.
    pub fn in_bound<'a>(&self, snr: &'a Array2<f32>, scale: usize) -> Cow<'a, Array2<f32>> {
        let Some(beyond) = &self.beyond else { return Cow::Borrowed(snr) };
        let (ny, nx) = beyond.dim();
        let middle = |k: usize, n: usize| (k * scale + scale / 2).min(n - 1);
        let inside =
            |(j, i): (usize, usize), v: f32| if beyond[[middle(j, ny), middle(i, nx)]] { v.min(0.0) } else { v };
        Cow::Owned(Array2::from_shape_fn(snr.dim(), |at| inside(at, snr[at])))
    }

    /// Takes cells away in which nothing is part of the target; whether there were any.
    pub fn cut_at_bound(&self, cells: &mut Array2<bool>) -> bool {
        let Some(beyond) = &self.beyond else { return false };
        let mut cut = false;
        cells.zip_mut_with(beyond, |cell, beyond| {
            cut |= *cell && *beyond;
            *cell &= !beyond;
        });
        cut
    }
}
