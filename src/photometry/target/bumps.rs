//! Sky that no quadratic surface follows: a mesh of what is left, where that is smoother than any target.
//!
//! Electrons; cells and pixels of a cutout. Halos, stray light and clouds under moonlight, of twenty FWHM and more. A target has edges as
//! sharp as a star: its light changes by much of itself from one block of four FWHM to the next, that of the sky does not. Trails are
//! subtracted before. It does not cover sky that changes within twenty FWHM.

use std::collections::HashSet;

use ndarray::Array2;

use super::blocks::{Block, Blocks};
use crate::base::stats;
use crate::photometry::background::{Spline, through_boxes};
use crate::photometry::clip::CLIP_SIGMA;

/// Blocks of a candidate that is compared: of fewer nothing is as smooth.
pub(crate) const FEWEST_BLOCKS: usize = 12;
/// The light of its brighter blocks is this much of the noise of one \[σ\] ...
const LEAST_SIGMA: f64 = 8.0;
/// ... being the level that one in ten of them exceeds.
const BRIGHT_SHARE: f64 = 0.9;
/// Root mean square of the difference between neighbouring blocks, as a share of that light: less is sky. Of an even disc it is √(1.3/R),
/// R its radius in blocks; of a Gaussian 0.4/σ.
const SMOOTH: f64 = 0.15;
/// Blocks to a side of a box of the mesh; a box needs a quarter of them.
const BOX_BLOCKS: usize = 3;

/// A smooth map of what the sky has besides a quadratic surface.
#[derive(Debug, Clone)]
pub(crate) struct Bumps {
    map: Spline,
    box_px: f64,
}

impl Bumps {
    /// The map of what blocks have above a surface, if those that are off it by 3 σ are smooth.
    pub fn above(blocks: &Blocks, above: impl Fn(&Block) -> f64) -> Option<Self> {
        Self::of(blocks, 1, &above, |b, noise| above(b).abs() > CLIP_SIGMA * noise)
    }

    /// The map of what is left in blocks of cells of `bin` pixels to a side, if the candidate in these blocks ([`blocks_of`]) is smooth.
    pub fn under(blocks: &Blocks, bin: usize, part: &HashSet<(usize, usize)>) -> Option<Self> {
        Self::of(blocks, bin, |b| b.mean, |b, _| part.contains(&place_in(blocks, b)))
    }

    /// The map of `above`, if the blocks for which `is_part` holds, given the error of the mean of a block, are smooth.
    fn of(
        blocks: &Blocks,
        bin: usize,
        above: impl Fn(&Block) -> f64,
        is_part: impl Fn(&Block, f64) -> bool,
    ) -> Option<Self> {
        let noise = stats::median(&mut blocks.all.iter().map(|b| b.sd / b.n.sqrt()).collect::<Vec<_>>())?;
        let places = blocks.all.iter().map(|b| place_in(blocks, b));
        let dim = places.fold((0, 0), |(j, i), (row, column)| (j.max(row + 1), i.max(column + 1)));
        let mut grid = Array2::from_elem(dim, None);
        blocks.all.iter().for_each(|b| grid[place_in(blocks, b)] = Some((above(b), is_part(b, noise))));
        if !is_smooth(&grid, noise) {
            return None;
        }
        let levels = Array2::from_shape_fn((dim.0.div_ceil(BOX_BLOCKS), dim.1.div_ceil(BOX_BLOCKS)), |(j, i)| {
            let span = |k: usize, n: usize| k * BOX_BLOCKS..((k + 1) * BOX_BLOCKS).min(n);
            let own = grid.slice(ndarray::s![span(j, dim.0), span(i, dim.1)]);
            let mut own: Vec<f64> = own.iter().flatten().map(|(above, _)| *above).collect();
            if 4 * own.len() < BOX_BLOCKS * BOX_BLOCKS { None } else { stats::median(&mut own) }
        });
        Some(Self { map: through_boxes(&levels), box_px: (BOX_BLOCKS * blocks.size_px * bin) as f64 })
    }

    /// A place in units of boxes from the centre of the first one.
    fn in_boxes(&self, px: f64) -> f64 {
        (px + 0.5) / self.box_px - 0.5
    }

    /// The map at a place \[e⁻/px\].
    pub fn at(&self, x: f64, y: f64) -> f64 {
        self.map.at(self.in_boxes(x), self.in_boxes(y))
    }

    /// Adds the map in row `j`, from column 0 on \[e⁻/px\].
    pub fn add_row(&self, j: usize, out: &mut [f32]) {
        let mut own = vec![0.0; out.len()];
        self.map.row(self.in_boxes(j as f64), self.in_boxes(0.0), 1.0 / self.box_px, &mut own);
        out.iter_mut().zip(own).for_each(|(o, v)| *o += v);
    }
}

/// Row and column of the blocks of `side` cells that a candidate of these cells touches.
pub(crate) fn blocks_of(candidate: &[(usize, usize)], side: usize) -> HashSet<(usize, usize)> {
    candidate.iter().map(|(i, j)| (j / side, i / side)).collect()
}

/// Row and column of a block.
fn place_in(blocks: &Blocks, b: &Block) -> (usize, usize) {
    (b.y as usize / blocks.size_px, b.x as usize / blocks.size_px)
}

/// Whether the light in some blocks of a grid, those marked, changes little to their neighbours: √(mean of Δ² − 2 σ²) below a share of it.
fn is_smooth(grid: &Array2<Option<(f64, bool)>>, noise: f64) -> bool {
    let mut light: Vec<f64> = grid.iter().flatten().filter(|(_, part)| *part).map(|(above, _)| above.abs()).collect();
    if light.len() < FEWEST_BLOCKS {
        return false;
    }
    light.sort_by(f64::total_cmp);
    let bright = light[(BRIGHT_SHARE * light.len() as f64) as usize];
    let (mut square, mut n) = (0.0, 0.0);
    for ((j, i), own) in grid.indexed_iter() {
        for next in [(j, i + 1), (j + 1, i)] {
            if let (Some((a, a_part)), Some(Some((b, b_part)))) = (own, grid.get(next))
                && (*a_part || *b_part)
            {
                square += (a - b).powi(2);
                n += 1.0;
            }
        }
    }
    bright > LEAST_SIGMA * noise && square / n - 2.0 * noise * noise < (SMOOTH * bright).powi(2)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;

    /// 30 × 30 blocks of 6 cells with noise of 1, and the cells that are above 3.
    fn scene(of: impl Fn(f64, f64) -> f64) -> (Blocks, Vec<(usize, usize)>) {
        let mut rng = rand_chacha::ChaCha12Rng::seed_from_u64(1);
        let mut noise = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let (mut all, mut cells) = (Vec::new(), Vec::new());
        for (i, j) in (0..900).map(|k| (k % 30, k / 30)) {
            let (x, y) = (6.0 * i as f64 + 2.5, 6.0 * j as f64 + 2.5);
            let mean = of(x, y) + noise();
            all.push(Block { x, y, mean, sd: 6.0, n: 36.0 });
            if mean > 3.0 {
                cells.push((6 * i + 2, 6 * j + 3));
            }
        }
        (Blocks { size_px: 6, all }, cells)
    }

    fn bumps(of: impl Fn(f64, f64) -> f64) -> Option<Bumps> {
        let (blocks, cells) = scene(of);
        let (under, above) =
            (Bumps::under(&blocks, 2, &blocks_of(&cells, blocks.size_px)), Bumps::above(&blocks, |b| b.mean));
        assert_eq!(under.is_some(), above.is_some());
        under
    }

    #[test]
    fn a_halo_is_followed_and_noise_targets_stars_and_trails_are_not() {
        let from = |x: f64, y: f64| (x - 100.0).hypot(y - 75.0);
        for (peak, sigma) in [(12.0, 25.0), (80.0, 20.0), (80.0, 40.0), (3000.0, 30.0)] {
            let halo = |x: f64, y: f64| peak * (-0.5 * (from(x, y) / sigma).powi(2)).exp();
            let bumps = bumps(halo).unwrap();
            for (x, y) in [(100.0, 75.0), (50.0, 50.0), (130.0, 90.0), (15.0, 165.0)] {
                let (seen, truth) = (bumps.at(2.0 * x + 0.5, 2.0 * y + 0.5), halo(x, y));
                assert!((seen - truth).abs() < 1.5 + 0.1 * peak, "{peak} {sigma} at {x} {y}: {seen} of {truth}");
            }
            let mut row = vec![1.0; 360];
            bumps.add_row(150, &mut row);
            assert!((f64::from(row[200]) - 1.0 - bumps.at(200.0, 150.0)).abs() < 1e-3 * peak);
        }
        assert!(bumps(|_, _| 0.0).is_none());
        for (light, radius) in [(9.0, 15.0), (30.0, 30.0), (300.0, 60.0), (1e5, 85.0)] {
            // a disc, a square and a star whose wings are above the sky all around
            assert!(bumps(|x, y| if from(x, y) < radius { light } else { 0.0 }).is_none(), "{light} {radius}");
            let is_in = |x: f64, y: f64| (x - 100.0).abs().max((y - 75.0).abs()) < radius;
            assert!(bumps(|x, y| if is_in(x, y) { light } else { 0.0 }).is_none(), "{light} {radius}");
            assert!(bumps(|x, y| 40.0 * light * (1.0 + (from(x, y) / 2.0).powi(2)).powf(-2.5)).is_none(), "{light}");
        }
        for along in [|_: f64, y: f64| y, |x: f64, _: f64| x, |x: f64, y: f64| x + y] {
            assert!(bumps(|x, y| if ((along(x, y) / 6.0) as usize).is_multiple_of(3) { 0.0 } else { 40.0 }).is_none());
        }
    }
}
