//! What is known of a night at first sight: a verdict in a sentence or two, and its passes.
//!
//! Magnitudes in the band of the table, observed − modelled positive where the target was fainter. Only used frames count.

use maud::{Markup, html};

use super::groups::{Group, Part, groups};
use super::parts::{NightPage, cell, count, nothing, number, table};
use crate::base::stats::{robust, scatter};
use crate::figures::axis::clock;
use crate::report::summary::old_elements_note;
use crate::tables::PhotometryRow;
use crate::tables::selection::counts;
use crate::tables::words::Status;

/// Groups that a verdict names; of more it gives the number.
const MOST_NAMED: usize = 4;

/// The verdict on a night: how much of it can be used, how bright the targets were, how far from the model.
pub(super) fn verdict(page: &NightPage) -> Markup {
    let groups = groups(std::slice::from_ref(page));
    let passes = crate::tables::row_passes::passes(&page.rows).len();
    let used = page.rows.iter().filter(|r| counts(r)).count();
    // rows of flats, stars and files that are no frame of a target have no time or no target
    let targets: Vec<&PhotometryRow> = groups.iter().flat_map(Group::rows).collect();
    let failed = page.rows.iter().filter(|r| r.status == Status::Failed).count();
    let of_page = |key: &str| page.manifest.get(key).and_then(|v| v.as_array()).and_then(|a| a.first());
    let poor = of_page("poor").and_then(|v| v.as_str());
    let parts: Vec<String> = groups.iter().filter_map(magnitudes).collect();
    html! {
        p.lead {
            @if let Some(why) = poor { strong { "Poor night: " } (why) ". " }
            @else if used == 0 { strong { "No magnitude can be used. " } }
            (used) " of " (count(targets.len(), "target frame", "target frames")) " in " (count(passes, "pass", "passes"))
            @if used == 1 { " gives a magnitude that can be used" } @else { " give magnitudes that can be used" }
            @if failed > 0 { "; " (count(failed, "file", "files")) " could not be reduced" }
            ". "
            @if parts.len() > MOST_NAMED { (parts.len()) " satellites and bands have magnitudes: see the tables of passes." }
            @else { @for part in &parts { (part) " " } }
            @if page.zeropoint.is_none() && used > 0 { "The night has no zeropoint." }
        }
    }
}

/// Median and comparison with the model of one group in a sentence; `None` without a used magnitude.
fn magnitudes(group: &Group) -> Option<String> {
    let used: Vec<&PhotometryRow> = group.rows().filter(|r| counts(r)).collect();
    let values = |of: fn(&PhotometryRow) -> Option<f64>| -> Vec<f64> {
        used.iter().filter_map(|r| of(r)).filter(|v| v.is_finite()).collect()
    };
    let (v, residual) = (values(|r| r.v_mag), values(|r| r.residual_mag));
    let median = robust(&v)?.0;
    let who = if group.name.is_empty() { satellite(group).unwrap_or("The target") } else { &group.name };
    let mut text = format!("{who}: median {} {} mag", group.band, format!("{median:.2}").replace('-', "−"));
    if let Some((off, _)) = robust(&residual) {
        let side = if off < 0.0 { "brighter" } else { "fainter" };
        text += &format!(", {:.2} mag {side} than the model", off.abs());
        if let Some(s) = scatter(&residual) {
            text += &format!(" with a scatter of {s:.2} mag");
        }
    }
    Some(text + ".")
}

/// The satellite of a group, where its frames name it.
fn satellite<'a>(group: &Group<'a>) -> Option<&'a str> {
    group.rows().map(|r| r.object_name.as_str()).find(|name| !name.is_empty())
}

/// The clock of a place by the mean Sun: UTC + longitude/15 h.
fn local_clock(row: &PhotometryRow, lon_deg: f64) -> Option<String> {
    let day = (row.mjd_mid_d? + lon_deg / 360.0).rem_euclid(1.0);
    Some(clock(day * 86_400.0).chars().take(5).collect())
}

/// The passes of every group, each group a table.
pub(super) fn pass_tables(nights: &[NightPage]) -> Markup {
    let groups: Vec<Group> =
        groups(nights).into_iter().filter(|group| group.parts.iter().any(|part| !part.passes.is_empty())).collect();
    if groups.is_empty() {
        return nothing("No pass: no frame has a time.");
    }
    html! {
        @for group in &groups { (pass_table(group)) }
        @for night in nights { @if let Some(note) = old_elements_note(&night.rows) { p { (note) } } }
    }
}

/// The passes of a group, what is read first on the left; the local clock is the mean solar time of the site's
/// longitude, where known.
fn pass_table(group: &Group) -> Markup {
    let band = &group.band;
    let (brightest, middle) = (format!("brightest {band}"), format!("median {band}"));
    let line = |lon_deg: Option<f64>, (i, pass): &(usize, Vec<&PhotometryRow>)| {
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
            cell(format!("{} of {}", v.len(), pass.len())),
            number(robust(&v).map(|s| s.0), 2),
            number(v.iter().copied().min_by(f64::total_cmp), 2),
            number(scatter(&v), 2),
            number(residual.map(|s| s.0), 2),
            cell(lights.join(", ").replace('_', "-")),
            number(pass.iter().filter_map(|r| r.alt_deg).max_by(f64::total_cmp), 1),
            number(median(|r| r.moon_illum_pct), 0),
            number(median(|r| r.moon_alt_deg), 0),
            number(median(|r| r.sun_alt_deg), 0),
            cell(first.zip(lon_deg).and_then(|(r, lon)| local_clock(r, lon)).unwrap_or_default()),
        ]
    };
    let of_part = |part: &Part| -> Vec<Vec<Markup>> {
        let lon_deg = part.night.meta.number_in("site", "lon_deg");
        part.passes.iter().map(|pass| line(lon_deg, pass)).collect()
    };
    let lines: Vec<Vec<Markup>> = group.parts.iter().flat_map(of_part).collect();
    let head = [
        "pass",
        "first frame (UTC)",
        "used",
        middle.as_str(),
        brightest.as_str(),
        "scatter",
        "O\u{a0}−\u{a0}C",
        "light",
        "highest [deg]",
        "Moon lit [%]",
        "Moon alt [deg]",
        "Sun alt [deg]",
        "mean solar time",
    ];
    let of = match group.name.as_str() {
        "" => satellite(group).map(|name| format!(" of {name}")).unwrap_or_default(),
        name => format!(" of {name}"),
    };
    table("sortable passes", &format!("Passes{of}; {band} in mag, of the used frames"), &head, &lines)
}
