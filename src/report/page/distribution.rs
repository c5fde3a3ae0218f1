//! How bright it was: violins, a histogram of each light, and the table of passes in the manner of the published ones.

use super::kinds::KINDS;
use super::kinds::kind_of;
use maud::{Markup, html};

use super::parts::NightPage;
use super::parts::cell;
use super::parts::nothing;
use super::parts::number;
use super::parts::table;
use super::violins;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::figures::axis::{Span, clock};
use crate::figures::chart::{Chart, Ticks};
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
        div.panels { (violins::by_pass(page)) (violins::by_light(page)) }
        (histogram(page))
        (pass_table(page))
    }
}

/// The clock of a place by the mean Sun: UTC + longitude/15 h.
fn local_clock(row: &PhotometryRow, lon_deg: f64) -> Option<String> {
    let day = (row.mjd_mid_d? + lon_deg / 360.0).rem_euclid(1.0);
    Some(clock(day * 86_400.0).chars().take(5).collect())
}

pub(super) fn histogram(page: &NightPage) -> Markup {
    let (rows, band) = (&page.rows, page.band());
    let used: Vec<&PhotometryRow> =
        rows.iter().filter(|r| is_used(&r.status, &r.verdict) && r.v_mag.is_some()).collect();
    let of = |r: &PhotometryRow| r.v_mag.unwrap_or(f64::NAN);
    let Some(span) = Span::around(used.iter().map(|r| of(r)), 1.0) else { return nothing("No magnitude is used.") };
    // a night of 30 mag is no night; bins stay few
    let bin = BIN_MAG.max((span.high() - span.low()) / 80.0);
    let first = (span.low() / bin).floor() as i64;
    let bins = ((span.high() / bin).ceil() as i64 - first).max(1) as usize;
    let mut counts = vec![[0usize; 4]; bins];
    for row in &used {
        let kind = kind_of(row);
        let at = ((of(row) / bin).floor() as i64 - first).clamp(0, bins as i64 - 1) as usize;
        counts[at][kind] += 1;
    }
    let most = counts.iter().map(|c| c.iter().sum::<usize>()).max().unwrap_or(1) as f64;
    let chart = Chart {
        title: "Distribution of the used magnitudes".into(),
        width: 940.0,
        height: 260.0,
        x: Span { from: first as f64 * bin, to: (first + bins as i64) as f64 * bin },
        y: Span { from: 0.0, to: 1.08 * most },
        x_label: format!("{band} [mag]"),
        y_label: "frames".into(),
        ticks: Ticks::Numbers,
    };
    let kinds: Vec<(&str, &str)> = KINDS.iter().map(|(n, c, _)| (*n, *c)).chain([("no model", "unmodelled")]).collect();
    let body = html! {
        @for (i, counted) in counts.iter().enumerate() {
            @for (k, (name, class)) in kinds.iter().enumerate().rev() {
                @let below: usize = counted[..=k].iter().sum();
                @if counted[k] > 0 {
                    @let from = (first + i as i64) as f64 * bin;
                    (chart.column(class, (from, from + bin), below as f64, &format!("{band} {from:.2} to {:.2}: {} {name}", from + bin, counted[k])))
                }
            }
        }
    };
    let shown = |k: usize| counts.iter().any(|c| c[k] > 0);
    html! {
        ul.key {
            @for (_, (name, class)) in kinds.iter().enumerate().filter(|(k, _)| shown(*k)) {
                li { svg width="12" height="12" aria-hidden="true" { rect class={ "column " (class) } width="12" height="12" {} } " " (name) }
            }
        }
        figure { (chart.with(&html! {}, &body)) figcaption { (used.len()) " used magnitudes in bins of " (format!("{bin:.2}")) " mag, by the largest light of the model." } }
    }
}

/// The passes as published tables give them; the local clock is the mean solar time of the site's longitude, where known.
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
