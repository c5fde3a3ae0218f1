//! How brightness is distributed under each light: one histogram per class on one axis of magnitudes.
//!
//! V in mag, brighter to the left; bars are shares of their own class, so that a long pass does not drown a short one.

use std::path::Path;

use super::axis::Span;
use super::canvas::{BLUE, Colour, Mark, ORANGE, PURPLE, figure, heading, legend, no_data, signed};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;

const SIZE: (u32, u32) = (960, 560);
/// Width of a bar \[mag\].
const BIN_MAG: f64 = 0.5;
const COLOURS: [Colour; 3] = [ORANGE, PURPLE, BLUE];

/// The magnitudes of one class.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelSample {
    /// Its name in the legend.
    pub name: String,
    /// Magnitudes.
    pub v_mag: Vec<f64>,
    /// Their median; drawn as a line.
    pub median_v_mag: Option<f64>,
}

/// Draws the histograms.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn label_histogram(path: &Path, title: &str, samples: &[LabelSample]) -> Result<()> {
    let bars: Vec<Vec<(f64, f64)>> = samples.iter().map(|s| shares(&s.v_mag)).collect();
    let edges = bars.iter().flatten().flat_map(|bar| [bar.0, bar.0 + BIN_MAG]);
    let (from, to) = edges.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), at| (lo.min(at), hi.max(at)));
    if from > to {
        return no_data(path, SIZE, title, "no row has a magnitude");
    }
    let x = Span { from, to };
    let top = bars.iter().flatten().map(|b| b.1).fold(0.0, f64::max);
    let y = Span { from: 0.0, to: (1.08 * top).max(0.1) };
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        let panel = Panel { sheet, frame: (170, 110, 1340, 980), x, y };
        panel.axes(Ticks::Numbers, "V [mag]", "share of the class in 0.5 mag");
        let mut entries = Vec::new();
        for ((sample, bars), colour) in samples.iter().zip(&bars).zip(COLOURS) {
            let corners: Vec<(f64, f64)> =
                bars.iter().flat_map(|(at, share)| [(*at, *share), (at + BIN_MAG, *share)]).collect();
            panel.band(&corners.iter().map(|(x, y)| (*x, 0.0, *y)).collect::<Vec<_>>(), colour);
            panel.polyline(&corners.iter().map(|(x, y)| (*x, Some(*y))).collect::<Vec<_>>(), colour, 4);
            entries.push((Some((Mark::Swatch, colour)), sample.name.clone()));
            let median = sample.median_v_mag.map_or("none".to_owned(), |m| format!("median {m:.2}"));
            entries.push((None, signed(&format!("   {} rows, {median}", sample.v_mag.len()))));
            if let Some(median) = sample.median_v_mag {
                panel.polyline(&[(median, Some(0.0)), (median, Some(y.to))], colour, 2);
            }
        }
        legend(sheet, (1370, 140), &entries)
    })
}

/// Left edge and share of every bar from the first to the last that is not empty, with an empty one on either side.
fn shares(v_mag: &[f64]) -> Vec<(f64, f64)> {
    let bins: Vec<i64> = v_mag.iter().filter(|v| v.abs() < 1e3).map(|v| (v / BIN_MAG).floor() as i64).collect();
    let (Some(first), Some(last)) = (bins.iter().min(), bins.iter().max()) else { return Vec::new() };
    let count = |bin: i64| bins.iter().filter(|b| **b == bin).count() as f64;
    (first - 1..=last + 1).map(|bin| (bin as f64 * BIN_MAG, count(bin) / bins.len() as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bars_of_a_class_sum_to_one_and_end_empty() {
        let bars = shares(&[1.0, 1.2, 1.6, 12.0]);
        assert!((bars.iter().map(|b| b.1).sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!((bars[0], bars[1], bars[2]), ((0.5, 0.0), (1.0, 0.5), (1.5, 0.25)));
        assert_eq!(bars.last().map(|b| b.1), Some(0.0));
        assert!(shares(&[]).is_empty());
    }
}
