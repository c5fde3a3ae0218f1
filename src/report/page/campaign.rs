//! Several nights on one page: a line for each, their magnitudes against date, one distribution and one table of passes.

use std::path::Path;

use maud::{Markup, html};

use super::chart::{Chart, Point};
use super::{NightPage, Section, cell, distribution, nothing, number, table, whole};
use crate::error::Result;
use crate::report::file::write_atomic;
use crate::report::plot::axis::Span;
use crate::report::rows::PhotometryRow;
use crate::report::summary::{is_used, passes, robust};

/// Writes the page of a campaign; `nights` with the file of each night's own report.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_campaign(path: &Path, nights: &[(String, NightPage)]) -> Result<()> {
    let rows: Vec<PhotometryRow> = nights.iter().flat_map(|(_, n)| n.rows.iter().cloned()).collect();
    let section = |id, title, body| Section { id, title, body };
    let sections = [
        section("summary", "Nights", table_of_nights(nights)),
        section("month", "Magnitudes by date", by_date(&rows)),
        section("distribution", "Distribution", distribution::histogram(&rows)),
        section("passes", "Passes", distribution::pass_table(&rows)),
    ];
    let title = format!("{} nights", nights.len());
    let names: Vec<&str> = nights.iter().map(|(_, n)| n.name.as_str()).collect();
    write_atomic(path, whole(&title, &names.join(", "), &sections).into_string().as_bytes())
}

fn table_of_nights(nights: &[(String, NightPage)]) -> Markup {
    let line = |(link, night): &(String, NightPage)| {
        let used: Vec<&PhotometryRow> = night.rows.iter().filter(|r| is_used(&r.status, &r.verdict)).collect();
        let spread =
            |of: fn(&PhotometryRow) -> Option<f64>| robust(&used.iter().filter_map(|r| of(r)).collect::<Vec<_>>());
        let (v, residual) = (spread(|r| r.v_mag), spread(|r| r.residual_mag));
        let with = |status: &str| night.rows.iter().filter(|r| r.status == status).count();
        let z = night.zeropoint.as_ref();
        vec![
            html! { @if link.is_empty() { (night.name) } @else { a href=(link) { (night.name) } } },
            cell(passes(&night.rows).len()),
            cell(night.rows.len()),
            cell(with("ok")),
            cell(with("nondetection")),
            cell(with("rejected") + with("failed")),
            number(v.map(|s| s.0), 2),
            number(v.map(|s| s.1), 2),
            number(residual.map(|s| s.0), 3),
            number(residual.map(|s| s.1), 3),
            number(z.map(|z| z.zp_mag), 3),
            number(z.map(|z| z.errs()[0]), 3),
            number(z.map(|z| z.k_mag_airmass), 3),
            number(robust(&used.iter().filter_map(|r| r.moon_illum_pct).collect::<Vec<_>>()).map(|m| m.0), 0),
        ]
    };
    let head = [
        "night",
        "passes",
        "frames",
        "measured",
        "not detected",
        "failed",
        "median V",
        "scatter",
        "O − C",
        "scatter",
        "ZP",
        "error",
        "k",
        "Moon lit [%]",
    ];
    table("sortable", "Nights; magnitudes V", &head, &nights.iter().map(line).collect::<Vec<_>>())
}

fn by_date(rows: &[PhotometryRow]) -> Markup {
    let used: Vec<&PhotometryRow> =
        rows.iter().filter(|r| is_used(&r.status, &r.verdict) && r.v_mag.is_some() && r.mjd_mid_d.is_some()).collect();
    let first = used.iter().filter_map(|r| r.mjd_mid_d).min_by(f64::total_cmp).unwrap_or(0.0).floor();
    let day = |r: &PhotometryRow| r.mjd_mid_d.unwrap_or(f64::NAN) - first;
    let (Some(x), Some(y)) =
        (Span::around(used.iter().map(|r| day(r)), 1.0), Span::around(used.iter().filter_map(|r| r.v_mag), 1.0))
    else {
        return nothing("No magnitude is used.");
    };
    let earliest = used.iter().min_by(|a, b| day(a).total_cmp(&day(b)));
    let date: String = earliest.map(|r| r.date_mid.chars().take(10).collect()).unwrap_or_default();
    let chart = Chart {
        title: "Magnitudes by date".into(),
        width: 940.0,
        height: 320.0,
        x,
        y: y.reversed(),
        x_label: format!("days since {date} 0h UTC"),
        y_label: "V [mag]".into(),
        clock: false,
    };
    let class = |r: &PhotometryRow| match r.illum.as_str() {
        "sun" => "sun",
        "penumbra" | "earthshine" => "earthshine",
        "moon" | "lunar_earthshine" => "moon",
        _ => "starlight",
    };
    let points: Vec<Point> = used
        .iter()
        .map(|r| Point {
            x: day(r),
            y: r.v_mag.unwrap_or(f64::NAN),
            err: r.v_mag_err,
            class: class(r),
            href: None,
            tip: super::tip(r),
        })
        .collect();
    html! {
        ul.key {
            @for (name, class) in [("sunlit", "sun"), ("penumbra or Earthshine", "earthshine"), ("moonlit", "moon"), ("no model or none", "starlight")] {
                li { svg width="12" height="12" aria-hidden="true" { circle class={ "point " (class) } cx="6" cy="6" r="4" {} } " " (name) }
            }
        }
        figure { (chart.with(&html! {}, &chart.points(&points))) figcaption { (points.len()) " used magnitudes." } }
    }
}
