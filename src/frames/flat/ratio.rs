//! A flat against the master: one of another filter, camera or state of the optics shows a pattern in the ratio of the two.
//!
//! Responses without unit. Medians of blocks, a plane subtracted: the gradient of a twilight sky is no fault of a flat. It does
//! not cover dust smaller than a block.

use ndarray::Array2;

use crate::base::error::Result;
use crate::base::stats::{mean_and_sd, median};
use crate::fits::raw::guarded;
use crate::frames::clip::Region;
use crate::frames::exposure::Exposure;
use crate::frames::read::Pixels;

/// Blocks along either side of the frame.
const BLOCKS: usize = 8;
/// Rows read of each block.
const ROWS: usize = 8;
/// Fewest pixels of a block that give a median.
const FEWEST_PX: usize = 16;
/// Fewest flats whose scatter is known.
const FEWEST_FLATS: usize = 4;
/// A flat differs where its ratio scatters this many times more than that of the median flat.
const TIMES: f64 = 5.0;
/// Smallest scatter that counts: lamps and skies differ by less from flat to flat.
const LEAST_FRAC: f64 = 0.003;

/// Standard deviation over blocks of (N − pedestal) / (level F), F the master, with the best plane subtracted; `None` where too
/// few blocks hold pixels.
///
/// # Errors
/// Those of reading the file.
pub(super) fn ratio_scatter(
    flat: &Exposure,
    (level_adu, pedestal_adu): (f64, f64),
    master: &Array2<f32>,
    region: &Region,
) -> Result<Option<f64>> {
    guarded(&flat.path, || {
        let (nx, ny) = region.size_px;
        let mut pixels = Pixels::open(&flat.path, &flat.header)?;
        let mut row = vec![0f32; nx];
        let mut blocks: Vec<[f64; 3]> = Vec::new();
        for band in 0..BLOCKS {
            let (first, last) = (band * ny / BLOCKS, (band + 1) * ny / BLOCKS);
            let step = ((last - first) / ROWS).max(1);
            let mut ratios: Vec<Vec<f64>> = vec![Vec::new(); BLOCKS];
            for j in (first..last).step_by(step) {
                pixels.read((region.origin_px.0, region.origin_px.1 + j), (nx, 1), &mut row)?;
                for i in region.inside(j) {
                    let ratio = (f64::from(row[i]) - pedestal_adu) / level_adu / f64::from(master[[j, i]]);
                    if ratio.is_finite() {
                        ratios[i * BLOCKS / nx].push(ratio);
                    }
                }
            }
            let place = |k: usize| k as f64 - 0.5 * (BLOCKS as f64 - 1.0);
            let found = ratios.iter_mut().enumerate().filter(|(_, values)| values.len() >= FEWEST_PX);
            blocks.extend(found.filter_map(|(k, values)| Some([place(k), place(band), median(values)?])));
        }
        Ok(without_plane(&blocks).map(|(scatter, mean)| scatter / mean).filter(|s| s.is_finite()))
    })
}

/// Standard deviation about the plane through values at places (x, y), and their mean; `None` for fewer than a quarter of all
/// blocks.
///
/// Slopes along x and y by themselves: the clip circle and the grid are symmetric about the centre.
fn without_plane(blocks: &[[f64; 3]]) -> Option<(f64, f64)> {
    if blocks.len() < BLOCKS * BLOCKS / 4 {
        return None;
    }
    let (mean, _) = mean_and_sd(&blocks.iter().map(|b| b[2]).collect::<Vec<_>>());
    let slope = |axis: usize| {
        let (xy, xx) =
            blocks.iter().fold((0.0, 0.0), |(xy, xx), b| (xy + b[axis] * (b[2] - mean), xx + b[axis].powi(2)));
        if xx > 0.0 { xy / xx } else { 0.0 }
    };
    let (along_x, along_y) = (slope(0), slope(1));
    let rest: Vec<f64> = blocks.iter().map(|b| b[2] - along_x * b[0] - along_y * b[1]).collect();
    Some((mean_and_sd(&rest).1, mean))
}

/// The scatter above which a flat differs from the others; `None` where there are too few to say.
pub(super) fn limit(scatters: &[f64]) -> Option<f64> {
    if scatters.len() < FEWEST_FLATS {
        return None;
    }
    median(&mut scatters.to_vec()).map(|usual| (TIMES * usual).max(LEAST_FRAC))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn blocks(of: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let place = |k: usize| k as f64 - 3.5;
        (0..64).map(|k| (place(k % 8), place(k / 8))).map(|(x, y)| [x, y, of(x, y)]).collect()
    }

    #[test]
    fn a_gradient_is_no_pattern_and_vignetting_is() {
        assert!(without_plane(&blocks(|x, y| 1.0 + 0.02 * x - 0.01 * y)).unwrap().0 < 1e-12);
        // 1 − a (x² + y²): the variance of x² over the eight places is 21
        let (scatter, _) = without_plane(&blocks(|x, y| 1.0 - 0.001 * (x * x + y * y))).unwrap();
        let expected = 0.001 * (2.0f64 * 21.0).sqrt();
        assert!((scatter / expected - 1.0).abs() < 0.02, "{scatter} {expected}");
        assert!(without_plane(&blocks(|_, _| 1.0)[..15]).is_none());
    }

    #[test]
    fn a_limit_needs_four_flats_and_one_among_them_does_not_move_it() {
        assert_eq!(limit(&[0.001, 0.001, 0.03]), None);
        assert_eq!(limit(&[0.001, 0.001, 0.001, 0.03]), Some(0.005));
        assert_eq!(limit(&[1e-4; 5]), Some(LEAST_FRAC));
    }
}
