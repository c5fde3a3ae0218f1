//! Charts of the report as figures for papers: the sky of each pass, and how magnitudes are spread, each one SVG file.
//!
//! The charts are those of the page, drawn for a file and laid side by side.

use std::path::Path;

use super::distribution::histogram_chart;
use super::groups::groups;
use super::kinds::{kind_of, named};
use super::parts::NightPage;
use super::phase_curve::{PhaseCurve, phase_curves};
use super::sky;
use super::violins;
use crate::base::error::Result;
use crate::figures::canvas::{
    GREY, HPos, INK, LABEL, Mark, Medium, SMALL, Sheet, VPos, draw_mark, figure, heading, no_data, write_text,
};
use crate::tables::selection::is_used;

/// Shown width of a sheet \[px\].
const WIDTH: u32 = 960;
/// Room of the title, below a chart, between charts \[drawn px\].
const ABOVE: f64 = 100.0;
const BELOW: f64 = 60.0;
const GAP: f64 = 24.0;

/// A chart and what stands below it.
struct CaptionedChart {
    chart: Sheet,
    caption: String,
}

/// Writes the sky of every pass of a night, as in its report.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_sky_figure(path: &Path, page: &NightPage) -> Result<()> {
    let (discs, scale) = sky::charts(page, Medium::File);
    let discs: Vec<CaptionedChart> =
        discs.into_iter().map(|(sky, chart)| CaptionedChart { chart, caption: sky.title.clone() }).collect();
    let columns = match discs.len() {
        0 | 1 => 1,
        2..=4 => 2,
        _ => 3,
    };
    let bar = scale.into_iter().map(|chart| CaptionedChart { chart, caption: String::new() }).collect();
    let why = "no frame has a place on the sky ([orbit] is needed)";
    write(
        path,
        &format!("{}: V of the model and of frames on the sky", page.name),
        vec![(discs, columns), (bar, 1)],
        why,
    )
}

/// Writes the violins of passes and of lights and the histogram of a night, as in its report.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_distribution_figure(path: &Path, page: &NightPage) -> Result<()> {
    let captioned = |chart: Option<Sheet>, text: &str| -> Vec<CaptionedChart> {
        chart.into_iter().map(|chart| CaptionedChart { chart, caption: text.into() }).collect()
    };
    let mut rows = Vec::new();
    for group in groups(std::slice::from_ref(page)) {
        let of = if group.name.is_empty() { String::new() } else { format!("{}: ", group.name) };
        let by_pass = violins::by_pass(&group).chart(Medium::File);
        let mut violins = captioned(by_pass, &format!("{of}each pass; below: UTC of its first used frame"));
        let by_light = violins::by_light(&group).chart(Medium::File);
        violins.extend(captioned(by_light, &format!("{of}under each light")));
        let histogram = histogram_chart(&group, Medium::File);
        rows.push((violins, 2));
        rows.push((captioned(histogram, &format!("{of}all of them, by the largest light of the model")), 1));
    }
    let used = page.rows.iter().filter(|r| is_used(&r.status, &r.verdict) && r.v_mag.is_some());
    let mut kinds: Vec<usize> = used.map(kind_of).collect();
    kinds.sort_unstable();
    kinds.dedup();
    rows.push((captioned((!kinds.is_empty()).then(|| light_key(&kinds)), ""), 1));
    write(path, &format!("{}: used magnitudes", page.name), rows, "no magnitude is used")
}

/// Writes the phase curves of a night, as in its report.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_phase_figure(path: &Path, page: &NightPage) -> Result<()> {
    let captioned = |curve: &PhaseCurve| {
        let name = if curve.name.is_empty() { String::new() } else { format!("{}: ", curve.name) };
        Some((vec![CaptionedChart { chart: curve.chart(Medium::File)?, caption: name + &curve.caption() }], 1))
    };
    let rows = phase_curves(std::slice::from_ref(page)).iter().filter_map(captioned).collect();
    let why = "fewer than five used magnitudes are of satellites in sunlight";
    write(path, &format!("{}: magnitudes at 1000 km by phase angle", page.name), rows, why)
}

/// What the colours of these lights mean, in a line.
fn light_key(kinds: &[usize]) -> Sheet {
    let sheet = Sheet::new(Medium::File, (1880, 40));
    let occurring = named().into_iter().enumerate().filter(|(kind, _)| kinds.contains(kind));
    for (k, (_, (name, paint))) in occurring.enumerate() {
        let x = 120 + 440 * k as i32;
        draw_mark(&sheet, Mark::Swatch, (x, 20), paint);
        write_text(&sheet, name, (x + 34, 20), SMALL, INK, (HPos::Left, VPos::Center));
    }
    sheet
}

/// Lays rows of charts below each other, so many in a line, and writes the sheet.
fn write(path: &Path, title: &str, rows: Vec<(Vec<CaptionedChart>, usize)>, why_empty: &str) -> Result<()> {
    let width = f64::from(2 * WIDTH);
    let mut y = ABOVE;
    let mut placed = Vec::new();
    for (items, columns) in rows {
        let columns = columns.clamp(1, items.len().max(1));
        let cell = (width - GAP * (columns - 1) as f64) / columns as f64;
        let mut tallest = 0.0f64;
        for (k, item) in items.into_iter().enumerate() {
            if k > 0 && k % columns == 0 {
                y += std::mem::take(&mut tallest) + BELOW;
            }
            let (w, h) = item.chart.size();
            // a chart alone is hardly magnified
            let scale = (cell / w).min(1.1);
            let x = (k % columns) as f64 * (cell + GAP) + 0.5 * (cell - scale * w);
            tallest = tallest.max(scale * h);
            placed.push((item, (x, y, scale * w, scale * h)));
        }
        y += if tallest > 0.0 { tallest + BELOW } else { 0.0 };
    }
    if placed.is_empty() {
        return no_data(path, (WIDTH, 140), title, why_empty);
    }
    figure(path, (WIDTH, (0.5 * y).ceil() as u32), |sheet| {
        heading(sheet, title);
        for (item, (x, y, w, h)) in placed {
            sheet.nest(item.chart, (x, y, w, h));
            let below = (x + 0.5 * w, y + h + 8.0);
            write_text(sheet, &item.caption, below, LABEL, GREY, (HPos::Center, VPos::Top));
        }
    })
}
