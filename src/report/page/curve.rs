//! Light curve and residuals of every pass: points lead to the picture of their frame.
//!
//! Magnitudes upwards to brighter; seconds of the day to the right. Lights that are far fainter than everything else
//! are excluded from the chart: their numbers are in the table.

use maud::{Markup, html};

use super::groups::{Group, groups};
use super::parts::MOST_ROWS;
use super::parts::NightPage;
use super::parts::nothing;
use super::parts::{count, key_mark, over_line, paint_of, shown, tip, verdict_paint};
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::figures::axis::Span;
use crate::figures::canvas::{Mark, Paint, VERMILLION};
use crate::figures::chart::Chart;
use crate::figures::interaction::Interaction;
use crate::figures::panel::{Point, Ticks};
use crate::figures::{LIGHTS, MODEL, altitude_colour, limit, pass_chart};
use crate::tables::PhotometryRow;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::words::{Status, Verdict};

/// Light curves of a campaign.
const MOST_SMALL: usize = 60;

/// How large a light curve is \[CSS px\]: it can still be read on a screen of 400 px.
const SHOWN: (i32, i32) = (520, 290);
const SMALL: (i32, i32) = (460, 250);

/// The section of light curves.
pub(super) fn light_curve(page: &NightPage) -> Markup {
    let drawn: Vec<(String, Vec<Markup>)> = groups(std::slice::from_ref(page))
        .iter()
        .map(|group| (group.name.clone(), charts(group, SHOWN)))
        .filter(|(_, charts)| !charts.is_empty())
        .collect();
    if drawn.is_empty() {
        return nothing("No frame has a magnitude, a limit or a model: see the reasons under Frames.");
    }
    let every = || drawn.iter().flat_map(|(_, charts)| charts);
    html! {
        (light_key(every(), &page.rows.iter().collect::<Vec<_>>()))
        p.note { "Shaded: penumbra and what is not sunlit; strip at the foot: altitude. A point leads to its picture." }
        @for (name, charts) in &drawn {
            @if !name.is_empty() { h3 { (name) } }
            div.panels.curves { @for chart in charts { (chart) } }
        }
    }
}

/// The light curves of several nights as small panels, grouped by satellite, band and instrument.
pub(super) fn light_curves(nights: &[NightPage]) -> Markup {
    let room = (MOST_SMALL / nights.len().max(1)).max(1);
    let mut blocks: Vec<(Markup, Vec<Markup>)> = Vec::new();
    for group in groups(nights) {
        for part in &group.parts {
            let all = part.passes.len();
            let of_part = part.passes.iter().filter_map(|(i, pass)| one_pass(part.night, *i, pass, &group.band, SMALL));
            let charts: Vec<Markup> = of_part.take(room).collect();
            let head = html! {
                (part.night.linked_name("light-curve")) @if !group.name.is_empty() { ", " (group.name) }
                ": " (count(all, "pass", "passes"))
                @if charts.len() < all { ", " (charts.len()) " drawn; the others are in the night's own report or have nothing to draw" }
            };
            blocks.push((head, charts));
        }
    }
    if blocks.iter().all(|(_, charts)| charts.is_empty()) {
        return nothing("No night has a frame with a magnitude, a limit or a model.");
    }
    let rows: Vec<&PhotometryRow> = nights.iter().flat_map(|n| &n.rows).collect();
    html! {
        (light_key(blocks.iter().flat_map(|(_, charts)| charts), &rows))
        p.note { "Shaded: penumbra and what is not sunlit; strip at the foot: altitude." }
        @for (head, charts) in &blocks {
            h3 { (head) }
            div.panels { @for chart in charts { (chart) } }
        }
    }
}

/// The charts of a group.
fn charts(group: &Group, size: (i32, i32)) -> Vec<Markup> {
    let passes = group.parts.iter().flat_map(|part| part.passes.iter().map(|(i, pass)| (part.night, *i, pass)));
    passes.filter_map(|(night, i, pass)| one_pass(night, i, pass, &group.band, size)).collect()
}

/// Switches and key of light curves: the lines that are in one of the charts, the verdicts that a frame has.
fn light_key<'m>(charts: impl Iterator<Item = &'m Markup> + Clone, rows: &[&PhotometryRow]) -> Markup {
    let drawn = |paint: &Paint| {
        let series = format!("data-series=\"{}\"", paint.class);
        charts.clone().any(|chart| chart.0.contains(&series))
    };
    let all = std::iter::once(("model", MODEL)).chain(LIGHTS.iter().map(|(name, paint, _)| (*name, *paint)));
    let lines: Vec<(&str, Paint)> = all.filter(|(_, paint)| drawn(paint)).collect();
    let altitudes = rows.iter().any(|r| r.alt_deg.is_some());
    html! {
        fieldset.toggles hidden {
            legend { "Show" }
            @for (name, paint) in &lines { label { input type="checkbox" checked data-toggle=(paint.class); " " (name) } }
            @if altitudes { label { input type="checkbox" data-by="by-altitude"; " points by altitude" } }
        }
        ul.key {
            @for (name, paint) in &lines { li { (key_mark(Mark::Line(3), *paint)) " " (name) } }
            (verdict_key(rows))
            @if rows.iter().any(|r| limit(r).is_some()) {
                li { (key_mark(Mark::Limit, paint_of(Verdict::Use))) " not detected: fainter than" }
            }
            @if altitudes {
                li {
                    "altitude 0° "
                    svg width="90" height="10" aria-hidden="true" {
                        @for k in 0..18 { rect x=(5 * k) y="0" width="5.5" height="10" fill=(altitude_colour(5.0 * f64::from(k) + 2.5).hex()) {} }
                    }
                    " 90°"
                }
            }
        }
    }
}

fn one_pass(page: &NightPage, i: usize, pass: &[&PhotometryRow], band: &str, size: (i32, i32)) -> Option<Markup> {
    let first = *pass.first()?;
    let interaction = Interaction {
        link: &|r| page.link(r),
        tip: &|r| if page.rows.len() > MOST_ROWS { String::new() } else { tip(r) },
    };
    let chart = pass_chart(pass, &page.curve, band, size, &interaction)?;
    let date: String = first.date_mid.chars().take(10).collect();
    let title = format!("Pass {}: {} on {date}", i + 1, first.object_name);
    let observed = pass.iter().filter(|r| r.v_mag.is_some());
    let used = observed.clone().filter(|r| verdict_paint(r).class != Verdict::Reject.as_str()).count();
    let limits = pass.iter().filter(|r| limit(r).is_some()).count();
    Some(html! {
        figure {
            (shown(chart, &title))
            figcaption {
                (title) ": " (count(observed.count(), "magnitude", "magnitudes")) ", " (used) " of them used"
                @if limits > 0 { ", " (count(limits, "limit", "limits")) } "."
            }
        }
    })
}

/// What the colours of points mean, of the verdicts that a row has.
fn verdict_key(rows: &[&PhotometryRow]) -> Markup {
    let given = |verdict: &Verdict| rows.iter().any(|r| verdict_paint(r).class == verdict.as_str());
    html! {
        @for verdict in Verdict::ALL.into_iter().filter(given) { li { (key_mark(Mark::Full, paint_of(verdict))) " " (verdict) } }
    }
}

type Against = (&'static str, fn(&PhotometryRow) -> Option<f64>);

const AGAINST: [Against; 7] = [
    ("altitude [deg]", |r| r.alt_deg),
    ("azimuth [deg]", |r| r.az_deg),
    ("phase angle Sun–satellite–observer [deg]", |r| r.phase_angle_deg),
    ("distance from the Moon [deg]", |r| r.moon_sep_deg),
    ("lg of electrons in the aperture", |r| r.flux_e.filter(|f| *f > 0.0).map(f64::log10)),
    ("FWHM of the target / FWHM of stars", |r| r.extent_fwhm),
    ("modelled V [mag]", |r| r.model_v_mag),
];

/// The section of residuals; points lead where those of `page` do.
pub(super) fn residuals(page: &NightPage, nights: &[NightPage]) -> Markup {
    let all: Vec<(String, Markup)> =
        groups(nights).iter().filter_map(|g| Some((g.name.clone(), of_group(page, g)?))).collect();
    if all.is_empty() {
        return nothing("No row has both an observed and a modelled magnitude ([model] and a zeropoint are needed).");
    }
    html! { @for (name, body) in all { @if !name.is_empty() { h3 { (name) } } (body) } }
}

/// The residuals of one group; `None` where it has none.
fn of_group(page: &NightPage, group: &Group) -> Option<Markup> {
    let rows: Vec<&PhotometryRow> =
        group.rows().filter(|r| r.residual_mag.is_some_and(f64::is_finite) && r.status == Status::Ok).collect();
    let used = |r: &&&PhotometryRow| is_used(&r.status, &r.verdict) && !is_lower_limit(r.flags);
    let kept: Vec<f64> = rows.iter().filter(used).filter_map(|r| r.residual_mag).collect();
    let shown = if kept.is_empty() { rows.iter().filter_map(|r| r.residual_mag).collect() } else { kept.clone() };
    let y = Span::around(shown, 0.4)?;
    let beyond = rows.iter().filter_map(|r| r.residual_mag).any(|v| !y.holds(v));
    Some(html! {
        @match robust(&kept) {
            Some((m, _)) => p {
                "Median " (format!("{m:+.3}").replace('-', "−")) " mag"
                @if let Some(s) = scatter(&kept) { ", robust scatter " (format!("{s:.3}")) " mag" } ", over "
                (kept.len()) " frames that are used; positive = observed fainter. Frames with the verdict reject and lower limits do not count."
            },
            None => p { "No frame is used: all have the verdict reject or are lower limits." },
        }
        ul.key {
            (verdict_key(&rows))
            @if beyond { li { (key_mark(Mark::Up, VERMILLION.class("reject beyond"))) " beyond the axis" } }
        }
        div.panels { @for (label, of) in AGAINST { (panel(page, label, of, &rows, y)) } (in_time(page, &rows, y)) }
    })
}

fn panel(
    page: &NightPage,
    label: &str,
    of: fn(&PhotometryRow) -> Option<f64>,
    rows: &[&PhotometryRow],
    y: Span,
) -> Markup {
    let Some(x) = Span::around(rows.iter().filter_map(|r| of(r)), 1e-3) else { return html! {} };
    one_panel(page, (label, x, y), rows, of)
}

/// Residuals in order of time, each pass moved next to the one before.
fn in_time(page: &NightPage, rows: &[&PhotometryRow], y: Span) -> Markup {
    let Some(first) =
        rows.iter().min_by(|a, b| a.mjd_mid_d.unwrap_or(f64::MAX).total_cmp(&b.mjd_mid_d.unwrap_or(f64::MAX)))
    else {
        return html! {};
    };
    let hours = |r: &PhotometryRow| Some((r.mjd_mid_d? - first.mjd_mid_d?) * 24.0);
    let Some(x) = Span::around(rows.iter().filter_map(|r| hours(r)), 0.05) else { return html! {} };
    one_panel(page, ("hours since the first frame", x, y), rows, hours)
}

fn one_panel(
    page: &NightPage,
    (label, x, y): (&str, Span, Span),
    rows: &[&PhotometryRow],
    of: impl Fn(&PhotometryRow) -> Option<f64>,
) -> Markup {
    let chart = Chart { size: (460, 250), x, y, x_label: label, y_label: "O − C [mag]", ticks: Ticks::Numbers };
    let point = |r: &&PhotometryRow| {
        Some(Point {
            x: of(r)?,
            y: r.residual_mag?,
            err: r.v_mag_err,
            paint: verdict_paint(r),
            href: page.link(r),
            by: r.alt_deg.map(|alt_deg| altitude_colour(alt_deg).hex()),
            tip: format!("O − C {:+.3}, {}", r.residual_mag?, tip(r)),
            ..Point::default()
        })
    };
    let points: Vec<Point> = rows.iter().filter_map(point).collect();
    let zero = [(x.low(), Some(0.0)), (x.high(), Some(0.0))];
    html! { figure { (over_line(&chart, &zero, &points, &format!("Residual against {label}"))) } }
}
