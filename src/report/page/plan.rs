//! The plan of a night as a page: when what can be observed, how bright, with which exposure; and what cannot, and why.

use std::path::Path;

use maud::{Markup, html};

use super::parts::{Section, cell, count, key_mark, nothing, number, shown, table, whole};
use crate::base::error::Result;
use crate::base::file::write_atomic;
use crate::brightness::Illum;
use crate::figures::axis::Span;
use crate::figures::canvas::{GREEN, GREY, Mark, Medium, ORANGE, PURPLE, Paint, SKY_BLUE};
use crate::figures::chart::Chart;
use crate::figures::panel::{Point, Ticks};
use crate::tables::PlanRow;
use crate::tables::words::PlanStatus;

/// Rows of a table of the page; all of them are in plan_night.ecsv.
const MOST_ROWS: usize = 500;

/// What the page of a plan shows.
#[derive(Debug)]
pub struct PlanPage<'a> {
    /// `Plan for the night of 2025-06-10`.
    pub title: String,
    /// Site and telescope.
    pub subtitle: String,
    /// Rows of the table, as [`crate::visibility::night_plan::plan`] gives them.
    pub rows: &'a [PlanRow],
    /// The dark spans \[MJD UTC\].
    pub dark_mjd_d: Vec<[f64; 2]>,
    /// Band of the magnitudes.
    pub band: String,
    /// What was asked for and used: a name and its value.
    pub used: Vec<(String, String)>,
}

/// Writes the page.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_plan_page(path: &Path, page: &PlanPage) -> Result<()> {
    let section = |id, title, body| Section { id, title, body };
    let sections = [
        section("summary", "The night", summary(page)),
        section("schedule", "Schedule", schedule(page)),
        section("observable", "All observable passes", observable(page)),
        section("others", "Not observable", others(page)),
        section("used", "What was used", used(page)),
    ];
    write_atomic(path, whole(&page.title, &page.subtitle, &sections).into_string().as_bytes())
}

/// The passes of a status.
fn of_status(rows: &[PlanRow], status: PlanStatus) -> impl Iterator<Item = &PlanRow> {
    rows.iter().filter(move |r| r.status == status)
}

fn summary(page: &PlanPage) -> Markup {
    let n = of_status(page.rows, PlanStatus::Observable).count();
    let scheduled = page.rows.iter().filter(|r| r.scheduled == 1).count();
    html! {
        p.lead {
            (count(n, "pass is observable", "passes are observable")) "; "
            (count(scheduled, "of them is", "of them are")) " scheduled without overlap."
        }
        @match chart(page) {
            None => (nothing("No pass is observable; the sections below say why.")),
            Some(drawn) => {
                (drawn)
                ul.key {
                    @for (name, paint) in LIGHTS {
                        li { (key_mark(Mark::Full, paint)) " " (name) }
                    }
                    li { (key_mark(Mark::Full, GREY.class("unmodelled"))) " not scheduled" }
                }
                p.note {
                    "Each line is the time in which a pass can be observed, the dot its best moment, the bar the 1σ error of the "
                    "prediction, where the model was compared with observations. Grey: a pass of better rank is in the way. Shaded: too bright."
                }
            }
        }
    }
}

/// The colours of the lights.
const LIGHTS: [(&str, Paint<'static>); 4] = [
    ("Sunlight", Paint { colour: ORANGE, class: "sun" }),
    ("Earthshine", Paint { colour: GREEN, class: "earthshine" }),
    ("Moonlight", Paint { colour: SKY_BLUE, class: "moon" }),
    ("Lunar-Earthshine", Paint { colour: PURPLE, class: "pointing" }),
];

fn paint_of(row: &PlanRow) -> Paint<'static> {
    let light = match Illum::from_cell(&row.illum) {
        _ if row.scheduled == 0 => None,
        Some(Illum::Sun | Illum::Penumbra) => Some(0),
        Some(Illum::Earthshine) => Some(1),
        Some(Illum::Moon) => Some(2),
        Some(Illum::LunarEarthshine) => Some(3),
        Some(Illum::None) | None => None,
    };
    light.and_then(|i| LIGHTS.get(i)).map_or(GREY.class("unmodelled"), |l| l.1)
}

/// Magnitudes against time; `None` without an observable pass.
fn chart(page: &PlanPage) -> Option<Markup> {
    let rows: Vec<&PlanRow> =
        of_status(page.rows, PlanStatus::Observable).filter(|r| r.model_v_mag.is_some()).collect();
    let ends = page.dark_mjd_d.first().zip(page.dark_mjd_d.last());
    let ([from_d, _], [_, to_d]) = ends?;
    let midnight = from_d.floor();
    let second = |mjd_d: f64| (mjd_d - midnight) * 86_400.0;
    let x = Span { from: second(*from_d) - 900.0, to: second(*to_d) + 900.0 };
    let y = Span::around(rows.iter().filter_map(|r| r.model_v_mag), 1.0).map(Span::reversed)?;
    let y_label = format!("{} [mag]", page.band);
    let chart = Chart { size: (960, 420), x, y, x_label: "UTC", y_label: &y_label, ticks: Ticks::Hours };
    let clock = |text: &str| crate::base::time::parse_utc("date", text).map_or(f64::NAN, crate::base::time::mjd_utc);
    // those that are scheduled on top
    let (below, above): (Vec<&PlanRow>, Vec<&PlanRow>) = rows.iter().partition(|r| r.scheduled == 0);
    let sheet = chart.draw(
        Medium::Page,
        |panel| {
            let mut bright_from = x.from;
            for [dusk, dawn] in &page.dark_mjd_d {
                panel.shade(bright_from, second(*dusk), GREY.class("penumbra"), "too bright");
                bright_from = second(*dawn);
            }
            panel.shade(bright_from, x.to, GREY.class("penumbra"), "too bright");
        },
        |panel| {
            for group in [&below, &above] {
                for row in group {
                    let (beg, end) = (second(clock(&row.date_beg)), second(clock(&row.date_end)));
                    panel.polyline(&[(beg, row.model_v_mag), (end, row.model_v_mag)], paint_of(row), 2);
                }
                let points: Vec<Point> = group.iter().map(|row| point(row, &second)).collect();
                panel.points(&points);
            }
        },
    );
    Some(shown(sheet, "Predicted magnitude of every observable pass against time"))
}

fn point<'a>(row: &PlanRow, second: &dyn Fn(f64) -> f64) -> Point<'a> {
    let v = row.model_v_mag.unwrap_or(f64::NAN);
    let err = row.v_pred_err_mag.map(|e| format!(" ± {e:.2}")).unwrap_or_default();
    let snr = row.snr.map(|s| format!(", S/N {s:.0}")).unwrap_or_default();
    let alt = row.alt_deg.map(|a| format!(", altitude {a:.0}°")).unwrap_or_default();
    Point {
        x: row.mjd_best_d.map_or(f64::NAN, second),
        y: v,
        err: row.v_pred_err_mag,
        paint: paint_of(row),
        tip: format!("{}, {}, {v:.2}{err}{snr}{alt}", row.object_name, time(&row.date_best)),
        ..Point::default()
    }
}

/// Clock of a date, without the day.
fn time(date: &str) -> String {
    date.chars().skip(11).take(8).collect()
}

const HEAD: [&str; 16] = [
    "rank",
    "from",
    "best",
    "to",
    "satellite",
    "number",
    "magnitude",
    "± 1σ",
    "light",
    "altitude",
    "azimuth",
    "°/s",
    "S/N",
    "needs [s]",
    "Moon [°]",
    "overlaps",
];

fn cells(row: &PlanRow) -> Vec<Markup> {
    let whole = |value: Option<i64>| cell(value.map(|v| v.to_string()).unwrap_or_default());
    let needs = match (row.needed_exptime_s, row.needed_n_sub) {
        (Some(s), Some(n)) if n > 1 => cell(format!("{n} × {}", short(s / n as f64))),
        (Some(s), _) => cell(short(s)),
        _ => cell(""),
    };
    vec![
        whole(row.rank),
        cell(time(&row.date_beg)),
        cell(time(&row.date_best)),
        cell(time(&row.date_end)),
        cell(&row.object_name),
        cell(row.norad_cat_id),
        number(row.model_v_mag, 2),
        number(row.v_pred_err_mag, 2),
        cell(row.illum.replace('_', "-")),
        number(row.alt_deg, 0),
        number(row.az_deg, 0),
        number(row.rate_deg_s, 3),
        number(row.snr, 0),
        needs,
        number(row.moon_sep_deg.filter(|_| row.moon_alt_deg.is_some_and(|a| a > 0.0)), 0),
        whole(row.conflicts_with),
    ]
}

/// Seconds with two or three figures.
fn short(seconds: f64) -> String {
    let decimals = (1.0 - seconds.log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{seconds:.decimals$}")
}

fn schedule(page: &PlanPage) -> Markup {
    let mut rows: Vec<&PlanRow> = page.rows.iter().filter(|r| r.scheduled == 1).collect();
    rows.sort_by(|a, b| a.date_beg.cmp(&b.date_beg));
    if rows.is_empty() {
        return nothing("Nothing to schedule.");
    }
    listed("Passes in the schedule, by time", &rows)
}

fn observable(page: &PlanPage) -> Markup {
    let rows: Vec<&PlanRow> = of_status(page.rows, PlanStatus::Observable).collect();
    if rows.is_empty() {
        return nothing("None.");
    }
    listed("Observable passes, by rank", &rows)
}

/// A table of passes.
fn listed(caption: &str, rows: &[&PlanRow]) -> Markup {
    let shown: Vec<Vec<Markup>> = rows.iter().take(MOST_ROWS).map(|r| cells(r)).collect();
    html! {
        (table("sortable", caption, &HEAD, &shown))
        @if rows.len() > MOST_ROWS {
            p.note { "The first " (MOST_ROWS) " of " (rows.len()) "; all of them are in the table." }
        }
    }
}

fn others(page: &PlanPage) -> Markup {
    let of = |status: PlanStatus| -> Option<Vec<Markup>> {
        let n = of_status(page.rows, status).count();
        let mut names: Vec<&str> = of_status(page.rows, status).map(|r| r.object_name.as_str()).collect();
        names.dedup();
        let named = names.iter().take(8).copied().collect::<Vec<_>>().join(", ");
        let more = if names.len() > 8 { ", …" } else { "" };
        let why = of_status(page.rows, status).map(|r| r.reason.as_str()).find(|r| !r.is_empty()).unwrap_or_default();
        (n > 0).then(|| vec![cell(status.as_str().replace('_', " ")), cell(n), cell(named + more), cell(why)])
    };
    let rows: Vec<Vec<Markup>> =
        PlanStatus::ALL.into_iter().filter(|s| *s != PlanStatus::Observable).filter_map(of).collect();
    if rows.is_empty() {
        return nothing("Every pass is observable.");
    }
    table("", "Passes that are not observable", &["why", "passes", "satellites", "for example"], &rows)
}

fn used(page: &PlanPage) -> Markup {
    html! {
        dl.facts { @for (name, value) in &page.used { div { dt { (name) } dd { (value) } } } }
    }
}
