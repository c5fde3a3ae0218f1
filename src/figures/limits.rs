//! Up to three panels of curves and their legend: limits against time, ratios against magnitude, limits by Moon.
//!
//! The values are those given, in the units of the titles; faint is up, since deeper is better here.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, Mark, ORANGE, PURPLE, SKY_BLUE, VERMILLION, figure, heading, legend, no_data, signed,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;

const SIZE: (u32, u32) = (940, 760);
/// Left upper corners of the panels, and of the legend after them; width and height of a panel.
const CORNERS: [(i32, i32); 4] = [(160, 120), (1_080, 120), (160, 860), (1_080, 860)];
const PANEL: (i32, i32) = (740, 540);
const COLOURS: [Colour; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY];
const MARKS: [Mark; 5] = [Mark::Full, Mark::Square, Mark::Diamond, Mark::Up, Mark::Down];
/// Points between two marks on a curve.
const MARK_EVERY: usize = 40;

/// One curve of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitCurve {
    /// Which line of the legend it is.
    pub series: usize,
    /// The points, rising in x.
    pub points: Vec<(f64, Option<f64>)>,
}

/// One panel.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitPanel {
    /// Title of the horizontal axis, with its unit.
    pub x_title: String,
    /// Title of the vertical axis, with its unit.
    pub y_title: String,
    /// Its curves.
    pub curves: Vec<LimitCurve>,
    /// Larger values downwards.
    pub y_reversed: bool,
    /// Values marked by a line across.
    pub lines: Vec<f64>,
}

/// Draws one to three panels, the legend and some notes after the last.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn limit_panels(path: &Path, title: &str, panels: &[LimitPanel], names: &[String], notes: &[String]) -> Result<()> {
    if panels.iter().all(|p| spans(p).is_none()) {
        return no_data(path, SIZE, title, "no limit is a number");
    }
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        for (panel, (left, top)) in panels.iter().take(3).zip(CORNERS) {
            let Some((x, y)) = spans(panel) else { continue };
            let frame = (left, top, left + PANEL.0, top + PANEL.1);
            let drawn = Panel { sheet, frame, x, y: if panel.y_reversed { y.reversed() } else { y } };
            drawn.axes(Ticks::Numbers, &panel.x_title, &panel.y_title);
            for at in panel.lines.iter().filter(|at| y.holds(**at)) {
                drawn.across(*at, GREY, 2);
            }
            for curve in &panel.curves {
                let (colour, mark) = style(curve.series);
                drawn.polyline(&curve.points, colour, 4);
                // marks tell curves apart where colour does not; each series at its own places
                let few = curve.points.len() <= MARK_EVERY;
                let shown = |i: usize| few || i % MARK_EVERY == (8 * curve.series) % MARK_EVERY;
                for (_, (x, y)) in curve.points.iter().enumerate().filter(|(i, _)| shown(*i)) {
                    if let Some(y) = y.filter(|y| y.is_finite()) {
                        drawn.mark(mark, *x, y, colour);
                    }
                }
            }
        }
        let mut entries: Vec<(Option<(Mark, Colour)>, String)> = names
            .iter()
            .enumerate()
            .map(|(series, name)| {
                let (colour, mark) = style(series);
                (Some((mark, colour)), signed(name))
            })
            .collect();
        entries.push((None, String::new()));
        entries.extend(notes.iter().map(|note| (None, signed(note))));
        let (left, top) = CORNERS[panels.len().min(3)];
        legend(sheet, (left - 40, top + 20), &entries)
    })
}

fn style(series: usize) -> (Colour, Mark) {
    (COLOURS[series % COLOURS.len()], MARKS[series % MARKS.len()])
}

/// The spans of a panel; `None` without a point.
fn spans(panel: &LimitPanel) -> Option<(Span, Span)> {
    let points = || panel.curves.iter().flat_map(|c| &c.points);
    let xs: Vec<f64> = points().map(|p| p.0).filter(|x| x.is_finite()).collect();
    let (low, high) = xs.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(*x), hi.max(*x)));
    let x = (low < high).then_some(Span { from: low, to: high }).or_else(|| Span::around(xs, 1.0))?;
    Some((x, Span::around(points().filter_map(|p| p.1), 1.0)?))
}
