//! Photon transfer: variance of one flat against its level, every block of every pair, with the line of each gain.
//!
//! lg ADU above the pedestal, lg ADU². Counted light is a line of slope 1; read noise bends it flat at the left.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, INK, Mark, ORANGE, PURPLE, SKY_BLUE, VERMILLION, figure, heading, legend, no_data,
    signed,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;

const SIZE: (u32, u32) = (960, 640);
const NAME: &str = "Photon transfer";
const COLOURS: [Colour; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY];

/// One gain setting in the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferCurve {
    /// Its lines in the legend.
    pub label: Vec<String>,
    /// Level above the pedestal \[ADU\] and variance \[ADU²\] of the blocks.
    pub points: Vec<(f64, f64)>,
    /// Measured gain \[e⁻/ADU\] and variance without light \[ADU²\].
    pub measured: Option<(f64, f64)>,
    /// Gain in use \[e⁻/ADU\] with the same variance without light.
    pub in_use_e_per_adu: Option<f64>,
}

/// Draws the blocks of each gain setting, the line V = L/g + R² of the gain measured and, dashed, of the gain in use.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn photon_transfer(path: &Path, curves: &[TransferCurve]) -> Result<()> {
    let logs = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
        points.iter().filter(|(l, v)| *l > 0.0 && *v > 0.0).map(|(l, v)| (l.log10(), v.log10())).collect()
    };
    let drawn: Vec<(&TransferCurve, Vec<(f64, f64)>)> = curves.iter().map(|c| (c, logs(&c.points))).collect();
    let every = || drawn.iter().flat_map(|(_, points)| points.iter());
    let (Some(x), Some(y)) = (Span::around(every().map(|p| p.0), 0.4), Span::around(every().map(|p| p.1), 0.4)) else {
        return no_data(path, SIZE, NAME, "no pair of flats could be compared");
    };
    figure(path, SIZE, |sheet| {
        heading(sheet, NAME);
        let panel = Panel { sheet, frame: (170, 110, 1290, 1150), x, y };
        panel.axes(Ticks::Numbers, "lg level above the pedestal [ADU]", "lg variance of one flat [ADU²]");
        let mut entries = Vec::new();
        for (i, (curve, points)) in drawn.iter().enumerate().filter(|(_, (_, points))| !points.is_empty()) {
            let colour = COLOURS[i % COLOURS.len()];
            for (l, v) in points {
                panel.mark(Mark::Dot, *l, *v, colour);
            }
            for (n, line) in curve.label.iter().enumerate() {
                entries.push(((n == 0).then_some((Mark::Dot, colour)), signed(line)));
            }
            if let Some((e_per_adu, dark_adu2)) = curve.measured {
                let line = |g: f64| -> Vec<(f64, Option<f64>)> {
                    let at = |k: usize| x.from + (x.to - x.from) * k as f64 / 120.0;
                    (0..=120).map(|k| (at(k), Some((10f64.powf(at(k)) / g + dark_adu2).log10()))).collect()
                };
                panel.polyline(&line(e_per_adu), INK, 4);
                for piece in curve.in_use_e_per_adu.map(line).unwrap_or_default().chunks(2).step_by(2) {
                    panel.polyline(piece, colour, 4);
                }
            }
            entries.push((None, String::new()));
        }
        entries.push((Some((Mark::Line(4), INK)), "measured".into()));
        if curves.iter().any(|c| c.measured.is_some() && c.in_use_e_per_adu.is_some()) {
            entries.push((None, "dashed: in use".into()));
        }
        legend(sheet, (1320, 130), &entries)
    })
}
