//! How bright it was: violins, a histogram of each light, and the table of passes in the manner of the published ones.

use super::kinds::{kind_of, named};
use maud::{Markup, html};

use super::parts::cell;
use super::parts::nothing;
use super::parts::number;
use super::parts::table;
use super::parts::{NightPage, key_mark, shown};
use super::violins;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::figures::axis::{Span, clock};
use crate::figures::canvas::{Mark, Medium, Sheet};
use crate::figures::chart::Chart;
use crate::figures::panel::Ticks;
use crate::report::summary::old_elements_note;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::selection::counts;
use crate::tables::selection::is_used;

/// Width of a bin \[mag\].
const BIN_MAG: f64 = 0.25;

/// The section.
pub(super) fn distribution(page: &NightPage) -> Markup {
    html! {
        div.panels { (violins::by_pass(page).figure()) (violins::by_light(page).figure()) }
        (histogram(page))
        (pass_table(page))
    }
}

/// The clock of a place by the mean Sun: UTC + longitude/15 h.
fn local_clock(row: &PhotometryRow, lon_deg: f64) -> Option<String> {
    let day = (row.mjd_mid_d? + lon_deg / 360.0).rem_euclid(1.0);
    Some(clock(day * 86_400.0).chars().take(5).collect())
}

/// How many used magnitudes of each light lie in each bin.
struct Bins {
    width_mag: f64,
    /// Number of the first bin.
    first: i64,
    counts: Vec<[usize; 4]>,
}

/// `None` without a used magnitude.
fn bins(page: &NightPage) -> Option<Bins> {
    let used: Vec<(&PhotometryRow, f64)> =
        page.rows.iter().filter(|r| is_used(&r.status, &r.verdict)).filter_map(|r| Some((r, r.v_mag?))).collect();
    let span = Span::around(used.iter().map(|u| u.1), 1.0)?;
    // a night of 30 mag is not a night; bins stay few
    let width_mag = BIN_MAG.max((span.high() - span.low()) / 80.0);
    let first = (span.low() / width_mag).floor() as i64;
    let n = ((span.high() / width_mag).ceil() as i64 - first).max(1);
    let mut counts = vec![[0usize; 4]; n as usize];
    for (row, v_mag) in used {
        let at = ((v_mag / width_mag).floor() as i64 - first).clamp(0, n - 1) as usize;
        counts[at][kind_of(row)] += 1;
    }
    Some(Bins { width_mag, first, counts })
}

/// The histogram by the largest light; `None` without a used magnitude.
pub(super) fn histogram_chart(page: &NightPage, medium: Medium) -> Option<Sheet> {
    let (bins, band) = (bins(page)?, page.band());
    let edge = |i: usize| (bins.first + i as i64) as f64 * bins.width_mag;
    let most = bins.counts.iter().map(|c| c.iter().sum::<usize>()).max().unwrap_or(1) as f64;
    let chart = Chart {
        size: (940, 260),
        x: Span { from: edge(0), to: edge(bins.counts.len()) },
        y: Span { from: 0.0, to: 1.08 * most },
        x_label: &format!("{band} [mag]"),
        y_label: "frames",
        ticks: Ticks::Numbers,
    };
    Some(chart.draw(
        medium,
        |_| {},
        |panel| {
            for (i, counted) in bins.counts.iter().enumerate() {
                // the highest first: what is below covers it
                for (k, (name, paint)) in named().into_iter().enumerate().rev().filter(|(k, _)| counted[*k] > 0) {
                    let below: usize = counted[..=k].iter().sum();
                    let tip = format!("{band} {:.2} to {:.2}: {} {name}", edge(i), edge(i + 1), counted[k]);
                    panel.column((edge(i), edge(i + 1)), below as f64, paint, &tip);
                }
            }
        },
    ))
}

fn histogram(page: &NightPage) -> Markup {
    let (Some(bins), Some(chart)) = (bins(page), histogram_chart(page, Medium::Page)) else {
        return nothing("No magnitude is used.");
    };
    let of = |k: usize| bins.counts.iter().map(|c| c[k]).sum::<usize>();
    let all: usize = (0..4).map(of).sum();
    html! {
        ul.key {
            @for (_, (name, paint)) in named().into_iter().enumerate().filter(|(k, _)| of(*k) > 0) {
                li { (key_mark(Mark::Square, paint)) " " (name) }
            }
        }
        figure {
            (shown(chart, "Distribution of the used magnitudes"))
            figcaption { (all) " used magnitudes in bins of " (format!("{:.2}", bins.width_mag)) " mag, by the largest light of the model." }
        }
    }
}

/// The passes as published tables give them; the local clock is the mean solar time of the site's longitude, where
/// known.
pub(super) fn pass_table(page: &NightPage) -> Markup {
    let (rows, lon_deg, band) = (&page.rows, page.meta.number_in("site", "lon_deg"), page.band());
    let (brightest, middle) = (format!("brightest {band}"), format!("median {band}"));
    let line = |(i, pass): (usize, &Vec<&PhotometryRow>)| {
        let used: Vec<&PhotometryRow> = pass.iter().filter(|r| counts(r)).copied().collect();
        let v: Vec<f64> = used.iter().filter_map(|r| r.v_mag).collect();
        let median = |of: fn(&PhotometryRow) -> Option<f64>| {
            robust(&pass.iter().filter_map(|r| of(r)).collect::<Vec<_>>()).map(|m| m.0)
        };
        let first = pass.first();
        let residual = robust(&used.iter().filter_map(|r| r.residual_mag).collect::<Vec<_>>());
        let mut lights: Vec<&str> = pass.iter().map(|r| r.illum.as_str()).filter(|l| !l.is_empty()).collect();
        let mut seen: Vec<&str> = Vec::new();
        lights.retain(|light| !seen.contains(light) && (seen.push(light), true).1);
        vec![
            cell(i + 1),
            cell(first.map(|r| r.date_mid.chars().take(19).collect::<String>().replace('T', " ")).unwrap_or_default()),
            cell(first.zip(lon_deg).and_then(|(r, lon)| local_clock(r, lon)).unwrap_or_default()),
            cell(first.map(|r| r.object_name.clone()).unwrap_or_default()),
            number(median(|r| r.moon_illum_pct), 0),
            number(median(|r| r.moon_alt_deg), 0),
            number(median(|r| r.sun_alt_deg), 0),
            number(pass.iter().filter_map(|r| r.alt_deg).max_by(f64::total_cmp), 1),
            cell(lights.join(", ").replace('_', "-")),
            cell(format!("{} of {}", v.len(), pass.len())),
            number(v.iter().copied().min_by(f64::total_cmp), 2),
            number(robust(&v).map(|s| s.0), 2),
            number(scatter(&v), 2),
            number(residual.map(|s| s.0), 2),
        ]
    };
    let lines: Vec<Vec<Markup>> = passes(rows).iter().enumerate().map(line).collect();
    if lines.is_empty() {
        return nothing("No pass: no frame has a time.");
    }
    let head = [
        "pass",
        "first frame (UTC)",
        "mean solar",
        "target",
        "Moon lit [%]",
        "Moon alt",
        "Sun alt",
        "alt max",
        "light",
        "used",
        brightest.as_str(),
        middle.as_str(),
        "scatter",
        "O − C",
    ];
    html! {
        (table("sortable", &format!("Passes; angles in degrees, magnitudes {band}"), &head, &lines))
        @if let Some(note) = old_elements_note(rows) { p { (note) } }
    }
}
