//! Hot pixels by the night's own star frames, where no darks show them: a star is elsewhere in another field, a hot pixel is not.
//!
//! A pixel p of a frame stands out where N_p − m > 5 √(m + σ_R²), m the median of its eight neighbours \[e⁻\]. One that stands out
//! in at least four of five frames of different fields is hot; its rate is the median of (N_p − m)/t \[e⁻/s\]. It does not cover
//! the outermost pixels of the clip circle's box, and warm pixels below the noise of one star frame.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::exposure::Exposure;
use super::frame::{Electrons, Frame, mask};
use crate::base::stats::median;

/// Standard deviations by which a hot pixel stands out of its neighbours in a frame.
const STANDS_OUT_SIGMA: f32 = 5.0;
/// Fewest usable neighbours.
const FEWEST_NEIGHBOURS: usize = 5;
/// Fields that are compared at most: more of them find no fainter pixel, since each has to show it.
pub const MOST_FIELDS: usize = 5;
/// Fewest fields that are compared.
pub const FEWEST_FIELDS: usize = 3;
/// Share of the fields in which a hot pixel stands out.
const SHARE_OF_FIELDS: f64 = 0.8;
/// A camera with a larger share of hot pixels is none: the fields were not different.
const LARGEST_SHARE: f64 = 0.02;

/// A pixel that is brighter than its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Row of the full frame.
    pub y_px: u32,
    /// Column of the full frame.
    pub x_px: u32,
    /// By how much it is brighter: \[e⁻\] in a frame, \[e⁻/s\] of a hot pixel.
    pub above: f32,
}

/// The hot pixels of a detector in one size and binning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HotPixels {
    /// Size of the frames (nx, ny) \[px\].
    pub size_px: (usize, usize),
    /// Their binning.
    pub binning: u32,
    /// Fields that were compared.
    pub n_fields: usize,
    /// The pixels, by row and column; `above` is their rate \[e⁻/s\].
    pub pixels: Vec<Peak>,
}

impl HotPixels {
    /// What stands out in most of the frames, each given as the peaks in it and its exposure time \[s\].
    ///
    /// # Errors
    /// A sentence where more pixels do than any camera has hot ones.
    pub fn common(first: &Exposure, frames: &[(Vec<Peak>, f64)]) -> Result<Self, String> {
        let mut rates: BTreeMap<(u32, u32), Vec<f64>> = BTreeMap::new();
        for (peaks, exptime_s) in frames {
            for peak in peaks {
                rates.entry((peak.y_px, peak.x_px)).or_default().push(f64::from(peak.above) / exptime_s);
            }
        }
        let fewest = (SHARE_OF_FIELDS * frames.len() as f64).ceil() as usize;
        let hot = rates
            .into_iter()
            .filter(|(_, rates)| rates.len() >= fewest)
            .filter_map(|((y_px, x_px), mut rates)| Some(Peak { y_px, x_px, above: median(&mut rates)? as f32 }));
        let pixels: Vec<Peak> = hot.collect();
        let n_px = (first.size_px.0 * first.size_px.1) as f64;
        if pixels.len() as f64 > LARGEST_SHARE * n_px {
            return Err(format!(
                "{} pixels stand out in {fewest} of {} star fields, more than {} % of the detector: no map of hot pixels is made",
                pixels.len(),
                frames.len(),
                100.0 * LARGEST_SHARE
            ));
        }
        Ok(Self { size_px: first.size_px, binning: first.binning, n_fields: frames.len(), pixels })
    }

    /// Whether it is one of the detector as this frame was read out.
    #[must_use]
    pub fn is_of(&self, exposure: &Exposure) -> bool {
        (self.size_px, self.binning) == (exposure.size_px, exposure.binning)
    }

    /// Those of a row of the full frame, by column.
    pub(super) fn row(&self, y_px: usize) -> &[Peak] {
        let first = self.pixels.partition_point(|p| (p.y_px as usize) < y_px);
        let end = self.pixels.partition_point(|p| (p.y_px as usize) <= y_px);
        &self.pixels[first..end]
    }
}

/// The pixels of a frame that stand out of their neighbours, by row and column.
#[must_use]
pub fn peaks(frame: &Frame<Electrons>) -> Vec<Peak> {
    use rayon::prelude::*;
    let (ny, nx) = frame.pixels.dim();
    let read_noise2 = (frame.gain.read_noise_e * frame.gain.read_noise_e) as f32;
    let (Some(pixels), Some(bits)) = (frame.pixels.as_slice(), frame.mask.as_slice()) else { return Vec::new() };
    let stands_out = |above: f32, m: f32| {
        above > 0.0 && above * above > STANDS_OUT_SIGMA * STANDS_OUT_SIGMA * (m.max(0.0) + read_noise2)
    };
    let usable = |k: usize| bits[k] & (mask::BAD | mask::CLIPPED) == 0 && pixels[k].is_finite();
    let of_row = |y: usize| {
        let mut found = Vec::new();
        for x in 1..nx.saturating_sub(1) {
            let k = y * nx + x;
            let p = pixels[k];
            // most pixels are refused by the fainter of two opposite neighbours; NaN takes the long way
            let least = pixels[k - nx].min(pixels[k + nx]).min(pixels[k - 1]).min(pixels[k + 1]);
            if !stands_out(p - least, least) || !usable(k) {
                continue;
            }
            let around = [k - nx - 1, k - nx, k - nx + 1, k - 1, k + 1, k + nx - 1, k + nx, k + nx + 1];
            let mut near: Vec<f64> = around.into_iter().filter(|k| usable(*k)).map(|k| f64::from(pixels[k])).collect();
            if near.len() < FEWEST_NEIGHBOURS {
                continue;
            }
            let Some(m) = median(&mut near).map(|m| m as f32) else { continue };
            if stands_out(p - m, m) {
                let (y_px, x_px) = (frame.origin_px.1 + y, frame.origin_px.0 + x);
                found.push(Peak { y_px: y_px as u32, x_px: x_px as u32, above: p - m });
            }
        }
        found
    };
    (1..ny.saturating_sub(1)).into_par_iter().flat_map_iter(of_row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::frame::{ElectronsPerAdu, Gain};
    use ndarray::Array2;

    fn frame(value: impl Fn(usize, usize) -> f32) -> Frame<Electrons> {
        let gain = Gain {
            setting: None,
            e_per_adu: ElectronsPerAdu(1.0),
            source: String::new(),
            read_noise_e: 3.0,
            pedestal_adu: 0.0,
            saturation_adu: 65_535.0,
        };
        Frame::from_electrons("f".into(), Array2::from_shape_fn((20, 30), |(y, x)| value(x, y)), gain)
    }

    #[test]
    fn a_single_pixel_a_pair_and_a_column_stand_out_and_a_gradient_does_not() {
        // 5 sqrt(100 + 9) = 52.2
        let hot = |x: usize, y: usize| (x, y) == (4, 5) || (x, y) == (10, 7) || (x, y) == (11, 7) || x == 20;
        let found = peaks(&frame(|x, y| 100.0 + if hot(x, y) { 60.0 } else { 0.0 }));
        let places: Vec<_> = found.iter().map(|p| (p.x_px as usize, p.y_px as usize)).collect();
        assert_eq!(places.len(), 3 + 18, "{places:?}"); // the ends of the column are edges of the frame
        assert!(places.iter().all(|(x, y)| hot(*x, *y)) && found.iter().all(|p| p.above == 60.0));
        assert!(peaks(&frame(|x, y| 100.0 + 40.0 * x as f32 + 30.0 * y as f32)).is_empty());
        assert!(peaks(&frame(|x, y| 100.0 + if hot(x, y) { 50.0 } else { 0.0 })).is_empty());
        assert!(peaks(&frame(|x, _| if x == 3 { f32::NAN } else { 100.0 })).is_empty());
    }
}
