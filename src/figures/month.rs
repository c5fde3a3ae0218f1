//! A month of midnights: surface brightness of satellites, a line each, over the limits of a telescope that follows.
//!
//! Surface brightness upwards to brighter, nights to the right; bars are the error of a prediction. Shaded: the Moon below the horizon at midnight, and
//! nights in which no satellite of the figure is lit.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, INK, Mark, ORANGE, PALE, PURPLE, SKY_BLUE, VERMILLION, draw_mark, figure, heading, legend,
    no_data,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::tables::MonthRow;

/// Shown size \[px\].
const SIZE: (u32, u32) = (1060, 720);
/// The ground of nights without any lit satellite.
const UNLIT: Colour = Colour(190, 190, 190);
/// What distinguishes the satellites besides their colour.
const STYLES: [(Colour, Mark); 8] = [
    (BLUE, Mark::Full),
    (SKY_BLUE, Mark::Square),
    (GREEN, Mark::Up),
    (VERMILLION, Mark::Diamond),
    (ORANGE, Mark::Down),
    (PURPLE, Mark::Open),
    (Colour(110, 84, 0), Mark::Cross),
    (Colour(90, 90, 200), Mark::Dot),
];

/// Draws a month from the rows of its table, of one mode. A mirror whose beam was looked for is excluded; `notes`
/// are written below the legend.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn month(path: &Path, rows: &[MonthRow], title: &str, notes: &[String]) -> Result<()> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|r| !r.beam_looked_for) {
        if !names.contains(&row.object_name.as_str()) && row.mu_mean_mag_arcsec2.is_some() {
            names.push(&row.object_name);
        }
    }
    let shown: Vec<&MonthRow> = rows.iter().filter(|r| names.contains(&r.object_name.as_str())).collect();
    let nights: Vec<&MonthRow> = match rows.first() {
        Some(first) => rows.iter().take_while(|r| r.object_name == first.object_name).collect(),
        None => Vec::new(),
    };
    let within = |r: &MonthRow| Some((r.mu_mean_mag_arcsec2?, r.v_pred_err_mag?));
    let mus = shown.iter().filter_map(|r| r.mu_mean_mag_arcsec2);
    let errors = shown.iter().filter_map(|r| within(r)).flat_map(|(mu, err_mag)| [mu - err_mag, mu + err_mag]);
    let limits = nights.iter().flat_map(|r| [r.limit_1sigma_mag_arcsec2, r.limit_5sigma_mag_arcsec2]).flatten();
    let Some(y) = Span::around(mus.chain(errors).chain(limits), 2.0).map(Span::reversed).filter(|_| !shown.is_empty())
    else {
        return no_data(path, SIZE, title, "no satellite is lit in any of these nights");
    };
    let first_mjd_d = nights.first().map_or(0.0, |r| r.mjd_mid_d);
    let first_day = day_of(nights.first().map_or("", |r| r.night.as_str()));
    let at = |r: &MonthRow| (r.mjd_mid_d - first_mjd_d).round() + first_day;
    let (from, to) = (first_day - 0.5, nights.last().map_or(first_day, |r| at(r)) + 0.5);
    let one_month = nights.first().zip(nights.last()).is_some_and(|(a, b)| a.night.get(..7) == b.night.get(..7));
    let since = nights.first().map_or("", |r| r.night.as_str());
    let axis = match since.get(..7).filter(|_| one_month) {
        Some(month) => format!("evening of {month} (local date)"),
        None => format!("night, counted on from {since} (local date of the evening)"),
    };
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        let panel = Panel { sheet, frame: (170, 110, 1560, 1300), x: Span { from, to }, y };
        for night in &nights {
            let dark = shown.iter().filter(|r| r.night == night.night).all(|r| r.mu_mean_mag_arcsec2.is_none());
            if dark {
                panel.shade(at(night) - 0.5, at(night) + 0.5, UNLIT, "");
            } else if night.moon_alt_deg <= 0.0 {
                panel.shade(at(night) - 0.5, at(night) + 0.5, PALE, "");
            }
        }
        panel.axes(Ticks::Numbers, &axis, "surface brightness [mag/arcsec²]");
        let limit = |of: fn(&MonthRow) -> Option<f64>| -> Vec<(f64, Option<f64>)> {
            nights.iter().map(|r| (at(r), of(r))).collect()
        };
        panel.polyline(&limit(|r| r.limit_1sigma_mag_arcsec2), INK, 3);
        panel.polyline(&limit(|r| r.limit_5sigma_mag_arcsec2), INK, 7);
        let mut entries = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let (colour, mark) = STYLES[i % STYLES.len()];
            let line: Vec<(f64, Option<f64>)> =
                shown.iter().filter(|r| r.object_name == *name).map(|r| (at(r), r.mu_mean_mag_arcsec2)).collect();
            panel.polyline(&line, colour, 3);
            for row in shown.iter().filter(|r| r.object_name == *name) {
                if let Some((mu, err_mag)) = within(row) {
                    panel.error_bar(at(row), mu, err_mag, colour);
                }
            }
            for (x, mu) in line.iter().filter_map(|(x, mu)| Some((*x, (*mu)?))) {
                draw_mark(sheet, mark, (panel.px(x), panel.py(mu)), colour);
            }
            entries.push((Some((mark, colour)), (*name).to_string()));
        }
        entries.push((None, String::new()));
        if shown.iter().any(|r| within(r).is_some()) {
            entries.push((None, "bars: 68 % of observations".into()));
        }
        entries.push((Some((Mark::Line(3), INK)), "limit, 1 σ".into()));
        entries.push((Some((Mark::Line(7), INK)), "limit, 5 σ".into()));
        entries.push((Some((Mark::Swatch, PALE)), "Moon down at midnight".into()));
        entries.push((Some((Mark::Swatch, UNLIT)), "no satellite is lit".into()));
        entries.push((None, String::new()));
        entries.extend(notes.iter().map(|note| (None, note.clone())));
        legend(sheet, (1590, 140), &entries)
    })
}

/// Day of the month of `2025-06-11`.
fn day_of(night: &str) -> f64 {
    night.get(8..10).and_then(|d| d.parse().ok()).unwrap_or(0.0)
}
