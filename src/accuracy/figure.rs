//! Error against run time: every setting of one method's knob, the fronts, the defaults.
//!
//! lg error (95 of 100 cases are better) over lg CPU time. Down and to the left is better.

use std::path::Path;

use super::sweep::{Place, Series, Sweep, SweepPoint, places};
use crate::base::error::Result;
use crate::figures::axis::Span;
use crate::figures::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, Mark, ORANGE, PURPLE, SKY_BLUE, SMALL, VERMILLION, VPos, figure, heading,
    legend, no_data, signed, write_text,
};
use crate::figures::panel::{Panel, Ticks};

const SIZE: (u32, u32) = (1060, 640);
const COLOURS: [Colour; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY];
/// Marks of the series, where there are more of them than colours.
const FULL: [Mark; 3] = [Mark::Full, Mark::Diamond, Mark::Up];
/// Errors below are rounding: drawn here.
const LEAST: f64 = 1e-16;
/// An error that is not a number is drawn as this.
const MOST: f64 = 1e3;

/// Height and width of a letter of a label.
const LETTER: (i32, i32) = (22, 12);

/// Where the name of a setting is written.
struct Label {
    /// Left and lower corner.
    at: (i32, i32),
    width: i32,
}

impl Label {
    /// To the right of a mark, or to its left where the frame ends.
    fn next_to((x, y): (i32, i32), text: &str, right_end: i32) -> Self {
        let width = LETTER.1 * text.chars().count() as i32;
        let left = if x + 12 + width > right_end { x - 12 - width } else { x + 12 };
        Self { at: (left, y - 8), width }
    }

    fn covers(&self, other: &Self) -> bool {
        let apart = (self.at.0 - other.at.0, (self.at.1 - other.at.1).abs());
        apart.1 < LETTER.0 && apart.0 < other.width && -apart.0 < self.width
    }
}

/// The settings that none is ahead of, from fast to slow.
fn front_line(points: &[&SweepPoint], height: impl Fn(f64) -> f64) -> Vec<(f64, Option<f64>)> {
    let mut line: Vec<(f64, f64)> = (points.iter().zip(places(points)))
        .filter(|(_, place)| *place != Place::Behind)
        .map(|(p, _)| (p.cpu_us.median_us.max(1e-6).log10(), height(p.errors.p95)))
        .collect();
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    // of those that are level in time, the line goes through the more accurate
    let mut best = f64::INFINITY;
    line.retain(|(_, y)| {
        let is_lower = *y < best;
        best = best.min(*y);
        is_lower
    });
    line.into_iter().map(|(x, y)| (x, Some(y))).collect()
}

/// Draws the settings of a sweep: filled on the front or level with it, open behind it, a square for the default; each
/// labelled.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn error_against_time(path: &Path, name: &str, sweep: &Sweep) -> Result<()> {
    let height = |error: f64| if error.is_finite() { error.clamp(LEAST, MOST).log10() } else { MOST.log10() };
    let every = || sweep.series.iter().flat_map(|s| &s.points);
    let times = every().map(|p| p.cpu_us.median_us.max(1e-6).log10());
    // settings of one system are near one another: one front over all of them, and the default once
    let one_system = sweep.common_default();
    let least = if one_system.is_some() { (0.1, 0.2) } else { (0.5, 1.0) };
    let heights = every().map(|p| height(p.errors.p95));
    let (Some(x), Some(y)) = (Span::around(times, least.0), Span::around(heights, least.1)) else {
        return no_data(path, SIZE, name, "no setting could be measured");
    };
    figure(path, SIZE, |sheet| {
        heading(sheet, &format!("Error against run time: {name}"));
        let panel = Panel { sheet, frame: (170, 110, 1440, 1130), x, y };
        panel.axes(
            Ticks::Numbers,
            &format!("lg CPU time of {} [µs]", sweep.work),
            &signed(&format!("lg error [{}], 95 % of cases", sweep.error)),
        );
        let mut entries = Vec::new();
        let mut labels: Vec<Label> = Vec::new();
        if one_system.is_some() {
            panel.polyline(&front_line(&every().collect::<Vec<_>>(), height), INK, 2);
        }
        for (k_series, series) in sweep.series.iter().enumerate() {
            // another program's curve has the colour of ours in the same situation, and a thin line
            let own = |s: &Series| s.points.iter().any(|p| p.is_default);
            let twin = sweep.series.iter().position(|s| own(s) && series.label.ends_with(&s.label));
            let colour = COLOURS[twin.unwrap_or(k_series) % COLOURS.len()];
            let width = if own(series) { 3 } else { 1 };
            let place = |k: usize| {
                let p = &series.points[k];
                (p.cpu_us.median_us.max(1e-6).log10(), height(p.errors.p95))
            };
            let stands = series.places();
            if one_system.is_none() {
                panel.polyline(&front_line(&series.points.iter().collect::<Vec<_>>(), height), colour, width);
            }
            for (k, point) in series.points.iter().enumerate() {
                let mark = match (point.is_default, stands[k]) {
                    (true, _) => Mark::Square,
                    (false, Place::Behind) => Mark::Open,
                    (false, _) => FULL[(twin.unwrap_or(k_series) / COLOURS.len()) % FULL.len()],
                };
                if one_system.is_some() && point.is_default {
                    continue;
                }
                let (at_x, at_y) = place(k);
                panel.mark(mark, at_x, at_y, colour);
                let text = match (one_system, series.label.split(' ').next()) {
                    (Some(_), Some(key)) => {
                        signed(&format!("{} {}", key.rsplit('.').next().unwrap_or(key), point.setting))
                    }
                    _ => signed(&point.setting),
                };
                let label = Label::next_to((panel.px(at_x) as i32, panel.py(at_y) as i32), &text, panel.frame.2);
                // what would cover another label is left to the table
                if !labels.iter().any(|l| l.covers(&label)) {
                    write_text(sheet, &text, label.at, SMALL - 6.0, colour, (HPos::Left, VPos::Bottom));
                    labels.push(label);
                }
            }
            let mark = FULL[(twin.unwrap_or(k_series) / COLOURS.len()) % FULL.len()];
            entries.push((Some((mark, colour)), series.label.clone()));
        }
        if let Some(p) = one_system {
            panel.mark(Mark::Square, p.cpu_us.median_us.max(1e-6).log10(), height(p.errors.p95), INK);
        }
        entries.push((None, String::new()));
        entries.push((Some((Mark::Square, INK)), "default".into()));
        entries.push((Some((Mark::Full, INK)), "not behind another setting".into()));
        entries.push((Some((Mark::Open, INK)), "behind another setting".into()));
        if one_system.is_some() {
            entries.push((None, "line: the front of all settings".into()));
        }
        if sweep.series.iter().any(|s| !s.points.iter().any(|p| p.is_default)) {
            entries.push((None, "thin: another program".into()));
        }
        if every().any(|p| p.errors.p95 < LEAST) {
            entries.push((None, "no error: drawn at −16".into()));
        }
        entries.push((None, format!("knob: {}", sweep.knob)));
        legend(sheet, (1480, 130), &entries)
    })
}
