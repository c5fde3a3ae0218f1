//! Error against run time: every setting of one method's knob, the fronts, the defaults.
//!
//! lg error (95 of 100 cases are better) over lg CPU time. Down and to the left is better.

use std::path::Path;

use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::Span;
use super::canvas::{
    BLUE, GREEN, GREY, INK, Mark, ORANGE, PURPLE, SKY_BLUE, SMALL, TITLE, VERMILLION, figure, legend, no_data, signed,
    write_text,
};
use super::panel::{Panel, Ticks};
use crate::accuracy::Sweep;
use crate::error::Result;

const SIZE: (u32, u32) = (1060, 640);
const COLOURS: [RGBColor; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY];
/// Errors below are rounding: drawn here.
const LEAST: f64 = 1e-16;
/// An error that is no number is drawn as this.
const MOST: f64 = 1e3;

/// Draws the settings of a sweep: filled on the front, open behind it, a square for the default; each labelled.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn error_against_time(path: &Path, name: &str, sweep: &Sweep) -> Result<()> {
    let height = |error: f64| if error.is_finite() { error.clamp(LEAST, MOST).log10() } else { MOST.log10() };
    let every = || sweep.series.iter().flat_map(|s| &s.points);
    let times = every().map(|p| p.cpu_us.max(1e-6).log10());
    let (Some(x), Some(y)) = (Span::around(times, 0.5), Span::around(every().map(|p| height(p.errors.p95)), 1.0))
    else {
        return no_data(path, SIZE, name, "no setting could be measured");
    };
    figure(path, SIZE, |sheet| {
        write_text(sheet, &format!("Error against run time: {name}"), (40, 26), TITLE, INK, (HPos::Left, VPos::Top))?;
        let panel = Panel { sheet, frame: (170, 110, 1440, 1130), x, y };
        panel.axes(
            Ticks::Numbers,
            &format!("lg CPU time of {} [µs]", sweep.work),
            &signed(&format!("lg error [{}], 95 % of cases", sweep.error)),
        )?;
        let mut entries = Vec::new();
        for (series, colour) in sweep.series.iter().zip(COLOURS.into_iter().cycle()) {
            let place = |k: usize| {
                let p = &series.points[k];
                (p.cpu_us.max(1e-6).log10(), height(p.errors.p95))
            };
            let front = series.on_front();
            let mut on_front: Vec<usize> = (0..front.len()).filter(|k| front[*k]).collect();
            on_front.sort_by(|a, b| place(*a).0.total_cmp(&place(*b).0));
            let line: Vec<(f64, Option<f64>)> = on_front.iter().map(|k| (place(*k).0, Some(place(*k).1))).collect();
            panel.polyline(&line, colour, 3)?;
            for (k, point) in series.points.iter().enumerate() {
                let mark = match (point.is_default, front[k]) {
                    (true, _) => Mark::Square,
                    (false, true) => Mark::Full,
                    (false, false) => Mark::Open,
                };
                let (at_x, at_y) = place(k);
                panel.mark(mark, at_x, at_y, colour)?;
                let beside = (panel.px(at_x) + 12, panel.py(at_y) - 8);
                write_text(sheet, &signed(&point.setting), beside, SMALL - 7, colour, (HPos::Left, VPos::Bottom))?;
            }
            entries.push((Some((Mark::Full, colour)), series.label.clone()));
        }
        entries.push((None, String::new()));
        entries.push((Some((Mark::Square, INK)), "default".into()));
        entries.push((Some((Mark::Full, INK)), "on the front".into()));
        entries.push((Some((Mark::Open, INK)), "beaten by another setting".into()));
        entries.push((None, format!("knob: {}", sweep.knob)));
        legend(sheet, (1480, 130), &entries)
    })
}
