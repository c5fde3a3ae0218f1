//! Several nights on one page: a line for each, their magnitudes against date, one distribution and one table of passes.

use std::path::Path;

use maud::{Markup, PreEscaped, html};

use super::checks;
use super::curve;
use super::distribution;
use super::groups::{Group, groups};
use super::kinds::{kind_of, named, paint_of_kind};
use super::parts::MOST_BYTES;
use super::parts::NightPage;
use super::parts::PassSky;
use super::parts::Section;
use super::parts::cell;
use super::parts::insert_frames;
use super::parts::nothing;
use super::parts::number;
use super::parts::table;
use super::parts::whole;
use super::parts::{key_mark, shown};
use super::passes;
use super::phase_curve;
use super::sky;
use super::strip;
use crate::base::error::Result;
use crate::base::file::write_atomic;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::figures::axis::Span;
use crate::figures::canvas::{BLUE, Mark, Medium};
use crate::figures::chart::Chart;
use crate::figures::panel::{Point, Ticks};
use crate::report::gallery::legend;
use crate::tables::PhotometryRow;
use crate::tables::row_passes;
use crate::tables::selection::counts;
use crate::tables::selection::is_used;
use crate::tables::words::Status;
use crate::zeropoint::fit::Zeropoint;

/// Skies of passes on the page.
const MOST_SKIES: usize = 12;

/// Pictures of a night.
const MOST_CARDS: usize = 6;

/// Writes the page of a campaign: the sections of a night over all of them, with a month of dates; `nights` in order,
/// each with the link to its own report ([`NightPage::frames_elsewhere`]), to which points lead.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_campaign(path: &Path, nights: &[NightPage]) -> Result<()> {
    let all = together(nights);
    let section = |id, title, body| Section { id, title, body };
    let mut sections = vec![
        section("summary", "Nights", html! { (table_of_nights(nights)) (passes::pass_tables(nights)) }),
        section("month", "By date", by_date(nights)),
        section("light-curve", "Light curves", curve::light_curves(nights)),
        section("residuals", "Observed minus modelled", curve::residuals(&all, nights)),
        section("phase-curve", "Phase curve", phase_curve::section(nights)),
        section("distribution", "Distribution", distribution::distribution(nights)),
        section("sky", "Sky", sky::skies(&all)),
        section("zeropoint", "Zeropoint", zeropoints(nights)),
        section("calibration", "Calibration", checks::gains(&all)),
        section("timing", "Timing", checks::timing(&all)),
        section("provenance", "Provenance", made_by(nights)),
    ];
    let taken: usize = sections.iter().map(|s| s.body.0.len()).sum();
    insert_frames(&mut sections, "Worst frames", worst(nights, MOST_BYTES.saturating_sub(taken)));
    let mut modes: Vec<String> = nights.iter().filter_map(NightPage::data_mode).collect();
    let count = modes.len();
    modes.sort_unstable();
    modes.dedup();
    let drawn = if count > 0 { format!(" ({}: {count} of {})", modes.join(", "), nights.len()) } else { String::new() };
    let title = format!("{} nights{drawn}", nights.len());
    let names: Vec<&str> = nights.iter().map(|n| n.name.as_str()).collect();
    write_atomic(path, whole(&title, &names.join(", "), &sections).into_string().as_bytes())
}

/// The nights as one; the meta block of the first, its site only if it is that of all.
fn together(nights: &[NightPage]) -> NightPage {
    let mut all = NightPage { frames_elsewhere: Some(String::new()), ..NightPage::default() };
    let lon = |n: &NightPage| n.meta.number_in("site", "lon_deg");
    for night in nights {
        all.rows.extend(night.rows.iter().cloned());
        let named = |sky: &PassSky| PassSky { title: format!("{}, {}", night.name, sky.title), ..sky.clone() };
        all.skies.extend(night.skies.iter().map(named));
    }
    all.skies.truncate(MOST_SKIES);
    if let Some(first) = nights.first()
        && nights.iter().all(|n| lon(n) == lon(first))
    {
        all.meta = first.meta.clone();
    }
    all
}

/// Each night's zeropoint, extinction and colour term against date.
fn zeropoints(nights: &[NightPage]) -> Markup {
    let start = |n: &NightPage| n.rows.iter().filter_map(|r| r.mjd_mid_d).min_by(f64::total_cmp);
    let known: Vec<(&str, f64, &Zeropoint)> =
        nights.iter().filter_map(|n| Some((n.name.as_str(), start(n)?, n.zeropoint.as_ref()?))).collect();
    let Some(first) = known.iter().map(|k| k.1).min_by(f64::total_cmp).map(f64::floor) else {
        return nothing("No night has a zeropoint and a frame with a time.");
    };
    type Of = fn(&Zeropoint) -> f64;
    let views: [(&str, usize, Of); 3] = [
        ("ZP [mag]", 0, |z| z.zp_mag),
        ("k [mag/airmass]", 1, |z| z.k_mag_airmass),
        ("C [mag/mag]", 2, |z| z.c_mag_mag),
    ];
    let panel = |(name, i, of): &(&str, usize, Of)| {
        let (Some(x), Some(y)) = (
            Span::around(known.iter().map(|k| k.1 - first), 1.0),
            Span::around(known.iter().flat_map(|k| [-1.0, 1.0].map(|s| of(k.2) + s * k.2.errs()[*i])), 0.05),
        ) else {
            return html! {};
        };
        let x_label = format!("days since MJD {first:.0}");
        let chart = Chart { size: (460, 250), x, y, x_label: &x_label, y_label: name, ticks: Ticks::Numbers };
        let point = |k: &(&str, f64, &Zeropoint)| Point {
            x: k.1 - first,
            y: of(k.2),
            err: Some(k.2.errs()[*i]),
            paint: BLUE.class("star"),
            tip: format!("{}: {name} {:.4} ± {:.4}", k.0, of(k.2), k.2.errs()[*i]),
            ..Point::default()
        };
        let points: Vec<Point> = known.iter().map(point).collect();
        let drawn = chart.draw(
            Medium::Page,
            |_| {},
            |panel| {
                panel.points(&points);
            },
        );
        html! { figure { (shown(drawn, &format!("{name} of each night"))) } }
    };
    html! { div.panels { @for view in &views { (panel(view)) } } }
}

/// The worst frames of each night, as its gallery shows them, and the way to all of them; `room` bytes at most.
fn worst(nights: &[NightPage], mut room: usize) -> Markup {
    let mut of_nights = Vec::new();
    for (k, night) in nights.iter().enumerate() {
        let mut shown = Vec::new();
        for (id, card) in night.cards.iter().take(MOST_CARDS) {
            if card.len() > room {
                break;
            }
            room -= card.len();
            // frames of two nights may have one name
            shown.push(card.replacen(&format!("id=\"{id}\""), &format!("id=\"night{}-{id}\"", k + 1), 1));
        }
        of_nights.push((night, shown));
    }
    html! {
        (legend())
        @for (night, shown) in of_nights {
            h3 { (night.linked_name("frames")) ": " (shown.len()) " of " (night.cards.len()) " pictures, the worst first" }
            @if night.cards.is_empty() { p.none { "No frame has a picture (vetting.gallery_frames = 0, or no figures were requested)." } }
            ol.gallery { @for card in &shown { (PreEscaped(card)) } }
        }
    }
}

/// Which program and configuration each night is from.
fn made_by(nights: &[NightPage]) -> Markup {
    let keys = [
        "tool",
        "data_mode",
        "mode",
        "satellite",
        "orbit_source",
        "catalogue",
        "config_sha256",
        "input_manifest_sha256",
    ];
    let line = |n: &NightPage| {
        let mut cells = vec![cell(&n.name)];
        cells.extend(keys.iter().map(|k| cell(n.stated(k).unwrap_or_default())));
        cells
    };
    let head: Vec<&str> = ["night"].into_iter().chain(keys).collect();
    table(
        "sortable",
        "What each night is from; more is in its own report",
        &head,
        &nights.iter().map(line).collect::<Vec<_>>(),
    )
}

fn table_of_nights(nights: &[NightPage]) -> Markup {
    let line = |night: &NightPage| {
        let used: Vec<&PhotometryRow> = night.rows.iter().filter(|r| counts(r)).collect();
        let values = |of: fn(&PhotometryRow) -> Option<f64>| used.iter().filter_map(|r| of(r)).collect::<Vec<_>>();
        let (v, residual) = (values(|r| r.v_mag), values(|r| r.residual_mag));
        let with = |status: Status| night.rows.iter().filter(|r| r.status == status).count();
        let z = night.zeropoint.as_ref();
        vec![
            night.linked_name("summary"),
            cell(night.data_mode().unwrap_or_else(|| "sky".into())),
            cell(row_passes::passes(&night.rows).len()),
            cell(night.rows.len()),
            cell(with(Status::Ok)),
            cell(with(Status::Nondetection)),
            cell(with(Status::Rejected) + with(Status::Failed)),
            number(robust(&v).map(|s| s.0), 2),
            number(scatter(&v), 2),
            number(robust(&residual).map(|s| s.0), 3),
            number(scatter(&residual), 3),
            number(z.map(|z| z.zp_mag), 3),
            number(z.map(|z| z.errs()[0]), 3),
            number(z.map(|z| z.k_mag_airmass), 3),
            number(strip::moon_lit_pct(&night.rows), 0),
        ]
    };
    let middle = format!("median {}", bands(nights));
    let head = [
        "night",
        "data",
        "passes",
        "frames",
        "measured",
        "not detected",
        "excluded or failed",
        middle.as_str(),
        "scatter",
        "O − C",
        "scatter",
        "ZP",
        "error",
        "k",
        "Moon lit [%]",
    ];
    table(
        "sortable",
        &format!("Nights; magnitudes {}", bands(nights)),
        &head,
        &nights.iter().map(line).collect::<Vec<_>>(),
    )
}

/// The bands of the nights, each once.
fn bands(nights: &[NightPage]) -> String {
    let mut bands: Vec<&str> = nights.iter().map(NightPage::band).collect();
    bands.sort_unstable();
    bands.dedup();
    if bands.is_empty() { "V".into() } else { bands.join(" or ") }
}

/// Magnitudes and mean surface brightness of the used frames against date, for every satellite in every band; the
/// surface brightness is what a survey would have to bear.
fn by_date(nights: &[NightPage]) -> Markup {
    let groups = groups(nights);
    let seen = |kind: usize| {
        let mut used =
            groups.iter().flat_map(Group::rows).filter(|r| is_used(&r.status, &r.verdict) && r.v_mag.is_some());
        used.any(|r| kind_of(r) == kind)
    };
    html! {
        ul.key {
            @for (_, (name, paint)) in named().into_iter().enumerate().filter(|(kind, _)| seen(*kind)) {
                li { (key_mark(Mark::Full, paint)) " " (name) }
            }
        }
        @if groups.is_empty() { (nothing("No frame of a target.")) }
        @for group in &groups {
            @if !group.name.is_empty() { h3 { (group.name) } }
            (dated(group, "Magnitudes by date", &format!("{} [mag]", group.band), |r| r.v_mag))
            (dated(group, "Surface brightness by date", "mean μ [mag/arcsec²]", |r| r.mu_mean_mag_arcsec2))
        }
    }
}

/// A quantity of the used frames of a group against date, with the median of each night as a dash.
fn dated(group: &Group, title: &str, label: &str, of: fn(&PhotometryRow) -> Option<f64>) -> Markup {
    let fits = |r: &&PhotometryRow| is_used(&r.status, &r.verdict) && of(r).is_some() && r.mjd_mid_d.is_some();
    let used: Vec<&PhotometryRow> = group.rows().filter(fits).collect();
    let first = used.iter().filter_map(|r| r.mjd_mid_d).min_by(f64::total_cmp).unwrap_or(0.0).floor();
    let day = |r: &PhotometryRow| r.mjd_mid_d.unwrap_or(f64::NAN) - first;
    let (Some(x), Some(y)) =
        (Span::around(used.iter().map(|r| day(r)), 1.0), Span::around(used.iter().filter_map(|r| of(r)), 1.0))
    else {
        return nothing(&format!("{title}: no used frame has one."));
    };
    let earliest = used.iter().min_by(|a, b| day(a).total_cmp(&day(b)));
    let date: String = earliest.map(|r| r.date_mid.chars().take(10).collect()).unwrap_or_default();
    let x_label = format!("days since {date} 0h UTC");
    let chart =
        Chart { size: (760, 300), x, y: y.reversed(), x_label: &x_label, y_label: label, ticks: Ticks::Numbers };
    let mut points = Vec::new();
    let mut medians = Vec::new();
    for part in &group.parts {
        let (night, rows) = (part.night, part.rows.iter().copied().filter(fits).collect::<Vec<_>>());
        points.extend(rows.iter().map(|r| Point {
            x: day(r),
            y: of(r).unwrap_or(f64::NAN),
            err: r.v_mag_err,
            paint: paint_of_kind(kind_of(r)),
            href: night.link(r),
            tip: super::parts::tip(r),
            ..Point::default()
        }));
        let spread =
            |of: fn(&PhotometryRow) -> Option<f64>| robust(&rows.iter().filter_map(|r| of(r)).collect::<Vec<_>>());
        if let (Some((at, _)), Some((m, _))) = (spread(|r| r.mjd_mid_d), spread(of)) {
            let scattered = scatter(&rows.iter().filter_map(|r| of(r)).collect::<Vec<_>>());
            let scattered = scattered.map(|s| format!(", scatter {s:.2}")).unwrap_or_default();
            medians.push((at - first, m, format!("{}: median {m:.2}{scattered}", night.name)));
        }
    }
    let drawn = chart.draw(
        Medium::Page,
        |_| {},
        |panel| {
            panel.points(&points);
            for (at, m, tip) in &medians {
                panel.dash(*at, 10.0, *m, tip);
            }
        },
    );
    html! {
        figure {
            (shown(drawn, title))
            figcaption {
                (title) ": " (points.len()) " used frames; dash: median of a night."
                @if points.iter().any(|p| p.href.is_some()) { " A point leads to its picture in the report of its night." }
            }
        }
    }
}
