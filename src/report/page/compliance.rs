//! Is a satellite fainter than the limits: shares, margins, where it is worst and what would mend it, on one page.

use std::path::Path;

use maud::{Markup, html};

use super::parts::{Section, cell, key_mark, nothing, number, shown, table, whole};
use crate::base::error::Result;
use crate::base::file::write_atomic;
use crate::figures::axis::Span;
use crate::figures::canvas::{BLUE, Mark, Medium, VERMILLION};
use crate::figures::chart::Chart;
use crate::figures::panel::Ticks;
use crate::tables::{ComplianceRow, WorstRow};

/// What the page shows.
#[derive(Debug)]
pub struct CompliancePage<'a> {
    /// `starlink-v2 at 550 km`.
    pub title: String,
    /// Sites, nights, mode.
    pub subtitle: String,
    /// Every limit of the satellite as listed, of its variants, of the observations.
    pub rows: &'a [ComplianceRow],
    /// The brightest of each night.
    pub worst: &'a [WorstRow],
    /// Magnitudes of everything lit, sorted.
    pub v_mag: &'a [f64],
    /// Name of the satellite as listed among the variants.
    pub listed: &'a str,
    /// What was used: a name and its value.
    pub used: Vec<(String, String)>,
}

/// Writes the page.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_compliance_page(path: &Path, page: &CompliancePage) -> Result<()> {
    let section = |id, title, body| Section { id, title, body };
    let sections = [
        section("summary", "Verdict", verdict(page)),
        section("magnitudes", "Magnitudes", magnitudes(page)),
        section("worst", "Worst geometries", worst(page)),
        section("mend", "What would mend it", mend(page)),
        section(
            "used",
            "What was used",
            html! {
                dl.facts { @for (name, value) in &page.used { div { dt { (name) } dd { (value) } } } }
            },
        ),
    ];
    write_atomic(path, whole(&page.title, &page.subtitle, &sections).into_string().as_bytes())
}

/// A share in percent, or nothing.
fn percent(share: Option<f64>) -> Markup {
    number(share.map(|s| 100.0 * s), 2)
}

const HEAD: [&str; 11] = [
    "of",
    "limit",
    "V",
    "brighter [%]",
    "from",
    "to",
    "of what is lit [%]",
    "mean V",
    "brightest 5 %",
    "brightest",
    "margin [mag]",
];

fn cells(row: &ComplianceRow) -> Vec<Markup> {
    vec![
        cell(&row.of),
        cell(&row.rule),
        number(Some(row.limit_v_mag), 2),
        percent(row.brighter_frac),
        percent(row.brighter_p16_frac),
        percent(row.brighter_p84_frac),
        percent(row.lit_brighter_frac),
        number(row.mean_v_mag, 2),
        number(row.v_p05_mag, 2),
        number(row.brightest_v_mag, 2),
        number(row.margin_mag, 2),
    ]
}

fn verdict(page: &CompliancePage) -> Markup {
    let rows: Vec<&ComplianceRow> =
        page.rows.iter().filter(|r| r.variant == page.listed || r.of == "observations").collect();
    let sentence = |row: &ComplianceRow| {
        let of = if row.of == "model" { "of sky and time" } else { "of the observed magnitudes" };
        row.brighter_frac.map(|share| {
            let interval = row.brighter_p16_frac.zip(row.brighter_p84_frac);
            let interval =
                interval.map(|(a, b)| format!(" ({:.2} to {:.2} %)", 100.0 * a, 100.0 * b)).unwrap_or_default();
            format!("{}: {:.2} %{interval} {of} is brighter than V {:.2}.", row.rule, 100.0 * share, row.limit_v_mag)
        })
    };
    let cells: Vec<Vec<Markup>> = rows.iter().map(|r| cells(r)).collect();
    html! {
        @for row in &rows { @if let Some(text) = sentence(row) { p.lead { (text) } } }
        (table("", "Shares and margins", &HEAD, &cells))
        p.note {
            "From and to: the 68 % interval; of the model, if all magnitudes are off by the error of a prediction the same way (none "
            "where the model was not compared with observations); of observations, binomial by passes. Margin: the magnitude than which 5 % "
            "of what is lit is brighter, less the limit; below 0, that much is lacking. No rule fixes which statistic counts."
        }
    }
}

fn magnitudes(page: &CompliancePage) -> Markup {
    let Some(x) = Span::around(page.v_mag.iter().copied(), 1.0) else {
        return nothing("Nothing is lit.");
    };
    let n = page.v_mag.len() as f64;
    let step = (page.v_mag.len() / 400).max(1);
    let curve: Vec<(f64, Option<f64>)> =
        page.v_mag.iter().enumerate().step_by(step).map(|(i, v)| (*v, Some(100.0 * (i + 1) as f64 / n))).collect();
    let y = Span { from: 0.0, to: 100.0 };
    let (x_label, y_label) = ("V [mag]", "brighter [% of what is lit]");
    let chart = Chart { size: (720, 360), x, y, x_label, y_label, ticks: Ticks::Numbers };
    let mut limits: Vec<(&str, f64)> = Vec::new();
    for row in page.rows.iter().filter(|r| r.variant == page.listed) {
        limits.push((&row.rule, row.limit_v_mag));
    }
    let drawn = chart.draw(
        Medium::Page,
        |_| {},
        |panel| {
            for (_, v_mag) in limits.iter().filter(|l| x.holds(l.1)) {
                panel.polyline(&[(*v_mag, Some(0.0)), (*v_mag, Some(100.0))], VERMILLION.class("zero"), 2);
            }
            panel.polyline(&curve, BLUE.class("model"), 3);
        },
    );
    let named: Vec<String> = limits.iter().map(|(name, v)| format!("{name} {v:.2}")).collect();
    html! {
        (shown(drawn, "Share of what is lit that is brighter than a magnitude"))
        ul.key { li { (key_mark(Mark::Line(2), VERMILLION.class("zero"))) " limits: " (named.join(", ")) } }
    }
}

fn worst(page: &CompliancePage) -> Markup {
    let row = |w: &WorstRow| {
        vec![
            number(Some(w.lat_deg), 1),
            cell(w.date_mid.replace('T', " ")),
            number(w.model_v_mag, 2),
            cell(w.illum.replace('_', "-")),
            number(w.alt_deg, 0),
            number(w.az_deg, 0),
            number(w.sun_az_sep_deg, 0),
            number(Some(w.sun_alt_deg), 1),
            percent(Some(w.lit_frac)),
            percent(w.brighter_frac),
        ]
    };
    let rows: Vec<Vec<Markup>> = page.worst.iter().map(row).collect();
    let head = [
        "latitude",
        "UTC",
        "V",
        "light",
        "altitude",
        "azimuth",
        "from the Sun's azimuth",
        "Sun",
        "lit [%]",
        "brighter [%]",
    ];
    html! {
        (table("sortable", "The brightest of each night, and how much of it is brighter than the first limit", &head, &rows))
    }
}

fn mend(page: &CompliancePage) -> Markup {
    let first = page.rows.first().map(|r| r.rule.clone()).unwrap_or_default();
    let of: Vec<&ComplianceRow> = page.rows.iter().filter(|r| r.of == "model" && r.rule == first).collect();
    let Some((listed, others)) = of.split_first().filter(|(_, others)| !others.is_empty()) else {
        return nothing("The model has no surfaces that could be changed, or none was asked for.");
    };
    let change = |row: &ComplianceRow, value: fn(&ComplianceRow) -> Option<f64>| {
        value(row).zip(value(listed)).map(|(a, b)| a - b)
    };
    let row = |r: &&ComplianceRow| {
        vec![
            cell(&r.variant),
            percent(r.brighter_frac),
            number(change(r, |r| r.brighter_frac).map(|d| 100.0 * d), 2),
            number(r.v_p05_mag, 2),
            number(change(r, |r| r.v_p05_mag), 2),
            number(r.brightest_v_mag, 2),
        ]
    };
    let rows: Vec<Vec<Markup>> = others.iter().map(row).collect();
    let caption = format!("One change at a time, against {first}");
    table(
        "sortable",
        &caption,
        &["change", "brighter [%]", "change [%]", "brightest 5 %", "change [mag]", "brightest"],
        &rows,
    )
}
