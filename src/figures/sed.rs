//! Spectra on one sheet, the logarithm upwards, with the pass band behind them.
//!
//! nm and lg(W m⁻² nm⁻¹). The lines are those given; two decades below the faintest peak the sheet ends.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, Mark, ORANGE, PURPLE, SKY_BLUE, VERMILLION, figure, heading, legend, no_data, signed,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;

const SIZE: (u32, u32) = (960, 600);
/// Wavelengths shown \[nm\], unless the spectrum has none of them.
const SHOWN_NM: (f64, f64) = (280.0, 1200.0);
const COLOURS: [Colour; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY];

/// One line of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct SedCurve {
    /// Its name in the legend.
    pub label: String,
    /// Wavelength \[nm\] and spectral irradiance \[W m⁻² nm⁻¹\].
    pub points: Vec<(f64, f64)>,
}

/// Draws spectra; `band` is its name with wavelength \[nm\] and transmission, shaded to scale of its peak.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn sed(path: &Path, title: &str, curves: &[SedCurve], band: (&str, &[(f64, f64)])) -> Result<()> {
    let lines: Vec<(&str, Vec<(f64, f64)>)> =
        curves.iter().map(|c| (c.label.as_str(), logarithms(&c.points))).collect();
    let peaks: Vec<f64> = lines.iter().filter_map(|(_, line)| line.iter().map(|p| p.1).reduce(f64::max)).collect();
    let low = peaks.iter().copied().reduce(f64::min).map(|lg| lg - 2.0);
    let y = Span::around(peaks.iter().copied().chain(low), 1.0);
    let (Some(x), Some(y)) = (across(&lines), y) else {
        return no_data(path, SIZE, title, "no spectrum above zero");
    };
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        let panel = Panel { sheet, frame: (190, 110, 1500, 1060), x, y };
        let (name, transmission) = band;
        let peak = transmission.iter().map(|p| p.1).fold(0.0, f64::max);
        let shown = |p: &&(f64, f64)| x.holds(p.0);
        let under: Vec<(f64, f64, f64)> = transmission
            .iter()
            .filter(shown)
            .map(|(nm, t)| (*nm, y.low(), y.low() + 0.5 * (y.high() - y.low()) * t / peak))
            .collect();
        panel.band(&under, GREY);
        panel.axes(Ticks::Numbers, "wavelength [nm]", "lg spectral irradiance [W m⁻² nm⁻¹]");
        let mut entries = Vec::new();
        for (i, (label, line)) in lines.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let points: Vec<(f64, Option<f64>)> = line.iter().map(|p| (p.0, Some(p.1))).collect();
            panel.polyline(&points, colour, 3);
            entries.push((Some((Mark::Line(5), colour)), signed(label)));
        }
        entries.push((None, String::new()));
        entries.push((Some((Mark::Band, GREY)), format!("transmission of {name}")));
        legend(sheet, (1530, 130), &entries)
    })
}

/// The part of a spectrum that has a logarithm and is shown.
fn logarithms(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let (from, to) = SHOWN_NM;
    let positive = points.iter().filter(|p| p.1 > 0.0).map(|p| (p.0, p.1.log10()));
    let shown: Vec<(f64, f64)> = positive.clone().filter(|p| (from..=to).contains(&p.0)).collect();
    if shown.len() > 1 { shown } else { positive.collect() }
}

/// From the shortest to the longest wavelength of the lines.
fn across(lines: &[(&str, Vec<(f64, f64)>)]) -> Option<Span> {
    let ends = lines.iter().flat_map(|(_, line)| line.first().into_iter().chain(line.last())).map(|p| p.0);
    let (from, to) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), nm| (lo.min(nm), hi.max(nm)));
    (from < to).then_some(Span { from, to })
}
