//! Observed minus modelled magnitude against altitude, coloured by the largest light.
//!
//! Upwards is brighter than modelled, as in a light curve. Median and robust σ are of the points that count.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, INK, Mark, ORANGE, PURPLE, SKY_BLUE, VERMILLION, figure, heading, legend, no_data,
    signed,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::brightness::Illum;
use crate::tables::ResidualRow;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::selection::used_residuals;
use crate::tables::words::Verdict;

const SIZE: (u32, u32) = (960, 640);
const NAME: &str = "Residuals against altitude";

/// Largest light in the table, in words, with its mark.
const CLASSES: [(Option<Illum>, &str, Mark, Colour); 7] = [
    (Some(Illum::Sun), "sunlit", Mark::Full, ORANGE),
    (Some(Illum::Penumbra), "penumbra", Mark::Diamond, VERMILLION),
    (Some(Illum::Earthshine), "Earthshine", Mark::Down, GREEN),
    (Some(Illum::Moon), "Moonlight", Mark::Square, SKY_BLUE),
    (Some(Illum::LunarEarthshine), "Lunar-Earthshine", Mark::Up, PURPLE),
    (Some(Illum::None), "no light", Mark::Full, GREY),
    (None, "light not known", Mark::Full, BLUE),
];

/// Draws residual against altitude with median and robust σ; rejected points are crosses, cautioned ones open circles;
/// `band` names the magnitudes.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn residuals_altitude(path: &Path, rows: &[ResidualRow], band: &str) -> Result<()> {
    let points: Vec<(&ResidualRow, f64, f64)> = rows
        .iter()
        .filter_map(|r| Some((r, r.alt_deg?, r.residual_mag?)))
        .filter(|p| p.1.is_finite() && p.2.is_finite())
        .collect();
    let counted = robust(&used_residuals(rows));
    let scattered = scatter(&used_residuals(rows));
    let used = points.iter().filter(|(r, _, _)| is_used("", &r.verdict));
    let in_range: Vec<f64> = used.map(|p| p.2).chain([0.0]).collect();
    let every: Vec<f64> = points.iter().map(|p| p.2).chain([0.0]).collect();
    let y = Span::around(if in_range.len() > 1 { in_range } else { every }, 0.2).map(Span::reversed);
    let (Some(x), Some(y)) = (Span::around(points.iter().map(|p| p.1), 10.0), y) else {
        let reason = if rows.is_empty() {
            "no frame has both a magnitude and a model".to_owned()
        } else {
            format!("none of {} rows has both an altitude and a residual", rows.len())
        };
        return no_data(path, SIZE, NAME, &reason);
    };
    figure(path, SIZE, |sheet| {
        heading(sheet, NAME);
        let panel = Panel { sheet, frame: (170, 110, 1440, 1150), x, y };
        let across = |v: f64| vec![(x.from, Some(v)), (x.to, Some(v))];
        let mut entries = Vec::new();
        if let Some((median, sigma)) = counted {
            panel.band(&[(x.from, median - sigma, median + sigma), (x.to, median - sigma, median + sigma)], GREY);
        }
        panel.axes(Ticks::Numbers, "altitude [deg]", &format!("observed − modelled {band} [mag]"));
        panel.polyline(&across(0.0), INK, 2);
        if let Some((median, sigma)) = counted {
            panel.polyline(&across(median), INK, 5);
            entries.push((Some((Mark::Line(5), INK)), signed(&format!("median {median:+.3}"))));
            if scattered.is_some() {
                entries.push((Some((Mark::Band, GREY)), format!("robust σ {sigma:.3}")));
            }
            entries.push((None, String::new()));
        }
        let (mut rejected, mut cautioned, mut at_least, mut beyond) = (0, 0, 0, 0);
        for (light, name, mark, colour) in CLASSES {
            let of_class = points.iter().filter(|(r, _, _)| Illum::from_cell(&r.illum) == light);
            let mut count = 0;
            for (row, alt_deg, residual_mag) in of_class {
                let (mark, colour) = match Verdict::from_cell(&row.verdict) {
                    Some(Verdict::Reject) => (Mark::Cross, GREY),
                    _ if is_lower_limit(row.flags) => (Mark::AtLeast, colour),
                    Some(Verdict::Caution) => (Mark::Open, colour),
                    _ => (mark, colour),
                };
                rejected += usize::from(mark == Mark::Cross);
                cautioned += usize::from(mark == Mark::Open);
                at_least += usize::from(mark == Mark::AtLeast);
                count += usize::from(mark != Mark::Cross);
                if mark != Mark::Cross {
                    panel.error_bar(*alt_deg, *residual_mag, row.v_mag_err.unwrap_or(0.0), colour);
                }
                beyond += usize::from(!panel.mark(mark, *alt_deg, *residual_mag, colour));
            }
            if count > 0 {
                entries.push((Some((mark, colour)), format!("{name} ({count})")));
            }
        }
        if cautioned > 0 {
            entries.push((Some((Mark::Open, INK)), format!("open: caution ({cautioned})")));
        }
        if at_least > 0 {
            entries.push((Some((Mark::AtLeast, INK)), format!("lower limit ({at_least}), not in σ")));
        }
        if rejected > 0 {
            entries.push((Some((Mark::Cross, GREY)), format!("verdict reject ({rejected})")));
        }
        entries.push((None, String::new()));
        if beyond > 0 {
            entries.push((None, format!("{beyond} beyond the axis (△)")));
        }
        entries.push((None, "up = observed brighter".into()));
        legend(sheet, (1480, 130), &entries)
    })
}
