//! Charts of the report as figures for papers: the sky of each pass, and how magnitudes are spread, each one SVG file.
//!
//! The charts are those of the page, side by side at a fixed width in mm, in the colours of a light page, without links.
//! Style sheets are written out without variables: few programs that draw SVG know them.

use std::path::Path;

use maud::{Markup, PreEscaped, html};

use super::distribution;
use super::kinds::KINDS;
use super::parts::NightPage;
use super::parts::STYLE;
use super::sky;
use super::violins;
use crate::base::error::Result;
use crate::base::file::write_atomic;
use crate::figures::PAPER_MM;
use crate::figures::chart::px;

/// Width of a sheet in its own units; [`PAPER_MM`] on paper.
const WIDTH: f64 = 740.0;
/// Room of the title, of the caption of a chart, between charts.
const TITLE: f64 = 34.0;
const CAPTION: f64 = 20.0;
const GAP: f64 = 12.0;

/// A chart: its SVG, its size in its own units, and what stands below it.
struct Piece {
    svg: String,
    size: (f64, f64),
    caption: String,
}

/// Writes the sky of every pass of a night, as in its report.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_sky_figure(path: &Path, page: &NightPage) -> Result<()> {
    let page = unlinked(page);
    let discs = pieces(&sky::skies(&page));
    let titles = sky::drawn(&page).into_iter().map(|sky| sky.title.clone()).chain([String::new()]);
    let named: Vec<Piece> = discs.into_iter().zip(titles).map(|(piece, caption)| Piece { caption, ..piece }).collect();
    // the bar of colours comes last and takes a line of its own
    let (bar, discs): (Vec<Piece>, Vec<Piece>) = named.into_iter().partition(|p| p.size.1 < 60.0);
    let columns = match discs.len() {
        0 | 1 => 1,
        2..=4 => 2,
        _ => 3,
    };
    let why = "no frame has a place on the sky ([orbit] is needed)";
    write(path, &format!("{}: V of the model and of frames on the sky", page.name), &[(discs, columns), (bar, 1)], why)
}

/// Writes the violins of passes and of lights and the histogram of a night, as in its report.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_distribution_figure(path: &Path, page: &NightPage) -> Result<()> {
    let page = unlinked(page);
    let captioned = |markup: &Markup, text: &str| -> Vec<Piece> {
        pieces(markup).into_iter().map(|p| Piece { caption: text.into(), ..p }).collect()
    };
    let by_pass = captioned(&violins::by_pass(&page), "each pass; below: UTC of its first used frame");
    let by_light = captioned(&violins::by_light(&page), "each target under each light");
    let histogram = captioned(&distribution::histogram(&page), "all of them, by the largest light of the model");
    let key = if histogram.is_empty() { Vec::new() } else { captioned(&light_key(), "") };
    let violins: Vec<Piece> = by_pass.into_iter().chain(by_light).collect();
    let rows = [(violins, 2), (histogram, 1), (key, 1)];
    write(path, &format!("{}: used magnitudes", page.name), &rows, "no magnitude is used")
}

/// What the colours of lights mean, in a line.
fn light_key() -> Markup {
    let kinds = KINDS.iter().map(|k| (k.0, k.1)).chain([("no model", "unmodelled")]);
    html! {
        svg.chart viewBox=(format!("0 0 {WIDTH:.0} 16")) {
            @for (k, (name, class)) in kinds.enumerate() {
                @let x = 60.0 + 0.23 * WIDTH * k as f64;
                rect class={ "column " (class) } x=(px(x)) y="2" width="12" height="12" {}
                text x=(px(x + 18.0)) y="12" { (name) }
            }
        }
    }
}

/// The night without its links: a figure stands alone.
fn unlinked(page: &NightPage) -> NightPage {
    NightPage {
        name: page.name.clone(),
        rows: page.rows.clone(),
        skies: page.skies.clone(),
        meta: page.meta.clone(),
        frames_elsewhere: Some(String::new()),
        ..NightPage::default()
    }
}

/// The charts in a section of the page.
fn pieces(markup: &Markup) -> Vec<Piece> {
    let piece = |rest: &str| {
        let body = rest.split_once("</svg>")?.0;
        let view = body.split_once("viewBox=\"")?.1.split_once('"')?.0;
        let size: Vec<f64> = view.split(' ').filter_map(|n| n.parse().ok()).collect();
        let &[_, _, width, height] = size.as_slice() else { return None };
        Some(Piece { svg: format!("{body}</svg>"), size: (width, height), caption: String::new() })
    };
    markup.0.split("<svg class=\"chart").skip(1).filter_map(piece).collect()
}

/// Lays rows of charts below each other, so many in a line, and writes the sheet.
fn write(path: &Path, title: &str, rows: &[(Vec<Piece>, usize)], why_empty: &str) -> Result<()> {
    let mut body = String::new();
    let mut y = TITLE;
    for (pieces, columns) in rows {
        let columns = (*columns).clamp(1, pieces.len().max(1));
        let cell = (WIDTH - GAP * (columns - 1) as f64) / columns as f64;
        for line in pieces.chunks(columns) {
            let mut tallest = 0.0f64;
            for (k, piece) in line.iter().enumerate() {
                let (width, height) = piece.size;
                // a chart alone is hardly magnified
                let scale = (cell / width).min(1.1);
                let (w, h) = (scale * width, scale * height);
                let x = k as f64 * (cell + GAP) + 0.5 * (cell - w);
                let place = format!("x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"", px(x), px(y), px(w), px(h));
                body += &format!("<svg {place} class=\"chart{}", piece.svg);
                let below = html! { text.caption text-anchor="middle" x=(px(x + 0.5 * w)) y=(px(y + h + 13.0)) { (piece.caption) } };
                body += &below.into_string();
                tallest = tallest.max(h);
            }
            y += tallest + CAPTION;
        }
    }
    if body.is_empty() {
        body = html! { text.caption text-anchor="middle" x=(px(0.5 * WIDTH)) y=(px(y + 40.0)) { "no data: " (why_empty) } }
            .into_string();
        y += 80.0;
    }
    let height_mm = PAPER_MM * y / WIDTH;
    let sheet = html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(format!("{PAPER_MM:.0}mm")) height=(format!("{height_mm:.1}mm"))
            viewBox=(format!("0 0 {WIDTH:.0} {}", px(y))) {
            style { (PreEscaped(plain_style())) }
            rect width="100%" height="100%" fill="#ffffff" {}
            text.title x="8" y="22" { (title) }
            (PreEscaped(body))
        }
    };
    // XML has no control characters
    let text = sheet.into_string().replace(|c: char| c.is_control() && c != '\n', " ");
    write_atomic(path, text.as_bytes())
}

/// The rules of charts with the colours of a light page in place of variables.
fn plain_style() -> String {
    let mut rules = STYLE.split("/* charts */").nth(1).unwrap_or_default().to_owned();
    let roots = STYLE.split(":root {").skip(1).filter_map(|root| root.split_once('}')).map(|root| root.0);
    // the later :root blocks are those of dark pages and of print: the first to name a colour is the light one
    for pair in roots.flat_map(|root| root.split(';')) {
        if let Some((name, value)) = pair.split_once(':').filter(|(name, _)| name.trim().starts_with("--")) {
            rules = rules.replace(&format!("var({})", name.trim()), value.trim());
        }
    }
    rules
        + "\ntext.title { font-family: sans-serif; font-size: 16px; } text.caption { font-family: sans-serif; font-size: 10px; }\n"
}
