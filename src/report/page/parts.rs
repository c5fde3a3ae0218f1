//! What every section of a page uses: the night it shows, tables, cells, tips.

use crate::figures::SkyMark;
use crate::figures::canvas::{BLUE, INK, Mark, Medium, ORANGE, Paint, Sheet, VERMILLION, draw_mark};
use crate::figures::chart::Chart;
use crate::figures::panel::Point;
use crate::tables::meta::Meta;
use crate::tables::meta::MetaValue;
use crate::tables::words::Verdict;
use crate::tables::{PassStackRow, PhotometryRow, SkyRow, StarRow};
use crate::zeropoint::fit::Zeropoint;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::DOCTYPE;
use maud::Markup;
use maud::PreEscaped;
use maud::html;
use sha2::Digest as _;
use sha2::Sha256;

pub(super) const STYLE: &str = concat!(include_str!("../gallery/page.css"), include_str!("page.css"));

pub(super) const SCRIPT: &str = concat!(include_str!("../gallery/page.js"), include_str!("page.js"));

/// A page of more bytes than this is a burden to open and to send.
pub(super) const MOST_BYTES: usize = 4_800_000;

/// Rows of the table of frames; all of them are in photometry.ecsv.
pub(super) const MOST_ROWS: usize = 1_000;

/// The section before which the frames stand: what they take is what the other sections leave.
pub(super) const AFTER_FRAMES: &str = "timing";

/// Everything a night's report is made of.
#[derive(Debug, Default)]
pub struct NightPage {
    /// Name of the night.
    pub name: String,
    /// Rows of photometry.ecsv.
    pub rows: Vec<PhotometryRow>,
    /// Their meta block.
    pub meta: Meta,
    /// Rows of pass_stack.ecsv.
    pub stacks: Vec<PassStackRow>,
    /// Rows of stars.ecsv.
    pub stars: Vec<StarRow>,
    /// zeropoint.toml.
    pub zeropoint: Option<Zeropoint>,
    /// The model of the passes at more moments than those of the frames; empty, and it is drawn at the frames.
    pub curve: Vec<PhotometryRow>,
    /// The sky of each pass.
    pub skies: Vec<PassSky>,
    /// manifest.json; null without one.
    pub manifest: serde_json::Value,
    /// effective.toml.
    pub config_toml: String,
    /// Cards of gallery.html: the frame's id and the card as it stands there.
    pub cards: Vec<(String, String)>,
    /// What is not in the report, and why.
    pub notes: Vec<String>,
    /// The page that has the frames, as a link, where it is not this one; empty without such a page: points lead nowhere.
    pub frames_elsewhere: Option<String>,
}

impl NightPage {
    /// The band of its magnitudes; V where the table does not tell.
    pub(crate) fn band(&self) -> &str {
        self.meta.band().unwrap_or("V")
    }

    /// Where a point leads: to the card of its frame, or to its row, where all rows are on the page of the frames.
    pub(super) fn link(&self, row: &PhotometryRow) -> Option<String> {
        let card = link(row).filter(|_| self.rows.len() <= MOST_ROWS)?;
        match self.frames_elsewhere.as_deref() {
            None => Some(card),
            Some("") => None,
            Some(report) => Some(format!("{report}{card}")),
        }
    }

    /// The night's name, leading to a part of its report, where it is on another page that is known.
    pub(super) fn linked_name(&self, part: &str) -> Markup {
        html! {
            @match self.frames_elsewhere.as_deref().filter(|report| !report.is_empty()) {
                Some(report) => a href={ (report) "#" (part) } { (self.name) },
                None => (self.name),
            }
        }
    }

    /// A text of the meta block; `None` where it is empty.
    pub(super) fn stated(&self, key: &str) -> Option<String> {
        match self.meta.get(key) {
            Some(MetaValue::Text(t)) => Some(t.clone()).filter(|t| !t.is_empty()),
            _ => None,
        }
    }

    /// Name of the site, from the configuration in force, and its place, from the meta block.
    pub(super) fn site(&self) -> Option<String> {
        let config: Option<toml::Table> = self.config_toml.parse().ok();
        let name = config.as_ref().and_then(|c| c.get("site")?.get("name")?.as_str()).filter(|n| !n.is_empty());
        let number = |field| self.meta.number_in("site", field);
        let place = number("lat_deg")
            .zip(number("lon_deg"))
            .map(|(lat, lon)| format!("latitude {lat}°, longitude {lon}°").replace('-', "−"));
        let parts: Vec<String> = name.map(str::to_owned).into_iter().chain(place).collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// `SIMULATED`, `TEST` or `EXERCISE`, which nobody must take for a night of the sky; `None` for real frames.
    pub(super) fn data_mode(&self) -> Option<String> {
        self.stated("data_mode").filter(|mode| mode != "REAL")
    }
}

/// Model, track, Sun and Moon of one pass.
#[derive(Debug, Default, Clone)]
pub struct PassSky {
    /// Which pass.
    pub title: String,
    /// The model in every direction; empty without one.
    pub cells: Vec<SkyRow>,
    /// Numbers of altitudes and azimuths of the cells.
    pub grid: (usize, usize),
    /// Sun and Moon.
    pub marks: Vec<SkyMark>,
    /// Frames of the pass.
    pub track: Vec<PhotometryRow>,
}

/// A part of the page: what links call it, its title, its content.
pub(super) struct Section {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) body: Markup,
}

/// Puts the frames into their place.
pub(super) fn insert_frames(sections: &mut Vec<Section>, title: &'static str, body: Markup) {
    let at = sections.iter().position(|s| s.id == AFTER_FRAMES).unwrap_or(sections.len());
    sections.insert(at, Section { id: "frames", title, body });
}

/// The page around its sections.
pub(super) fn whole(title: &str, subtitle: &str, sections: &[Section]) -> Markup {
    let script_hash = STANDARD.encode(Sha256::digest(SCRIPT.as_bytes()));
    let policy =
        format!("default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{script_hash}'");
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                a.skip href="#summary" { "To the summary" }
                header {
                    h1 { (title) }
                    p { (subtitle) }
                    nav aria-label="Sections" { @for s in sections { a href={ "#" (s.id) } { (s.title) } " " } }
                }
                main { @for s in sections { section id=(s.id) aria-labelledby={ (s.id) "-title" } {
                    h2 id={ (s.id) "-title" } { (s.title) }
                    (s.body)
                } } }
                footer { p { "Made by satphot from the tables next to this file. UTC; magnitudes are V (Vega) outside the atmosphere." } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
}

/// A section without data says why.
pub(super) fn nothing(why: &str) -> Markup {
    html! { p.none { (why) } }
}

/// A table that can be sorted: heads, then rows of cells with what they are sorted by.
pub(super) fn table(class: &str, caption: &str, head: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! {
        div.scroll tabindex="0" role="group" aria-label=(caption) {
            table class=(class) {
                caption { (caption) }
                thead { tr { @for name in head { th scope="col" { (name) } } } }
                tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

/// A number of things: `1 pass`, `3 passes`.
pub(super) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Text of a cell.
pub(super) fn cell(text: impl std::fmt::Display) -> Markup {
    html! { (text.to_string()) }
}

/// A number with `decimals`, or nothing.
pub(super) fn number(value: Option<f64>, decimals: usize) -> Markup {
    html! { @if let Some(v) = value.filter(|v| v.is_finite()) { (format!("{v:.decimals$}").replace('-', "−")) } }
}

/// Clock of a row, without the day.
pub(super) fn time_of(row: &PhotometryRow) -> String {
    row.date_mid.chars().skip(11).take(10).collect()
}

/// What a point of a chart says about its frame.
pub(super) fn tip(row: &PhotometryRow) -> String {
    let v = match (row.v_mag, row.limit_v_mag) {
        (Some(v), _) => format!("V {v:.3}{}", row.v_mag_err.map(|e| format!(" ± {e:.3}")).unwrap_or_default()),
        (None, Some(v)) => format!("fainter than V {v:.2}"),
        _ => String::new(),
    };
    let alt = row.alt_deg.map(|a| format!("altitude {a:.1}°")).unwrap_or_default();
    let parts = [row.frame.clone(), time_of(row), v, alt, row.illum.replace('_', "-"), row.verdict.clone()];
    parts.into_iter().filter(|p| !p.is_empty()).collect::<Vec<_>>().join(", ")
}

/// The card of a frame.
pub(super) fn link(row: &PhotometryRow) -> Option<String> {
    (!row.frame.is_empty()).then(|| format!("#{}", crate::report::gallery::card::card_id(&row.frame)))
}

/// The colour of a point, by its verdict.
pub(super) fn verdict_paint(row: &PhotometryRow) -> Paint<'static> {
    paint_of(Verdict::from_cell(&row.verdict).unwrap_or(Verdict::Use))
}

/// The colour of a verdict.
pub(super) fn paint_of(verdict: Verdict) -> Paint<'static> {
    match verdict {
        Verdict::Use => BLUE,
        Verdict::Caution => ORANGE,
        Verdict::Reject => VERMILLION,
    }
    .class(verdict.as_str())
}

/// A chart in the page, with what is read out where it cannot be seen.
pub(super) fn shown(chart: Sheet, title: &str) -> Markup {
    PreEscaped(chart.into_page("chart", "group", title))
}

/// A chart of points over a line.
pub(super) fn over_line(chart: &Chart, line: &[(f64, Option<f64>)], points: &[Point], title: &str) -> Markup {
    let drawn = chart.draw(
        Medium::Page,
        |_| {},
        |panel| {
            panel.polyline(line, INK.class("zero"), 2);
            panel.points(points);
        },
    );
    shown(drawn, title)
}

/// A mark as a key shows it.
pub(super) fn key_mark(mark: Mark, paint: Paint) -> Markup {
    let (size, y) = match mark {
        Mark::Line(_) => ((22, 12), 6.0),
        Mark::Limit => ((12, 20), 1.5),
        _ => ((12, 12), 6.0),
    };
    let sheet = Sheet::new(Medium::Page, size);
    draw_mark(&sheet, mark, (0.5 * sheet.width(), y), paint);
    PreEscaped(sheet.into_sign())
}
