//! Light curve and residuals of every pass: points lead to the picture of their frame.
//!
//! Magnitudes upwards to brighter; seconds of the day to the right. Lights that are far fainter than everything else
//! are excluded from the chart: their numbers are in the table.

use maud::{Markup, html};

use super::parts::MOST_ROWS;
use super::parts::NightPage;
use super::parts::nothing;
use super::parts::{key_mark, over_line, paint_of, shown, tip, verdict_paint};
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::figures::axis::Span;
use crate::figures::canvas::{Mark, VERMILLION};
use crate::figures::chart::Chart;
use crate::figures::interaction::Interaction;
use crate::figures::panel::{Point, Ticks};
use crate::figures::{LIGHTS, MODEL, altitude_colour, limit, pass_chart};
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::words::{Status, Verdict};

/// Light curves of a campaign.
const MOST_SMALL: usize = 60;

/// How large a light curve is \[CSS px\], and whether its caption explains it.
struct Size {
    shown: (i32, i32),
    told: bool,
}

const WIDE: Size = Size { shown: (940, 340), told: true };
const SMALL: Size = Size { shown: (460, 250), told: false };

/// The section of light curves.
pub(super) fn light_curve(page: &NightPage) -> Markup {
    let all = passes(&page.rows);
    let charts: Vec<Markup> = all.iter().enumerate().filter_map(|(i, pass)| one_pass(page, i, pass, &WIDE)).collect();
    if charts.is_empty() {
        return nothing("No frame has a magnitude, a limit or a model: see the reasons under Frames.");
    }
    html! { (light_key()) @for chart in charts { (chart) } }
}

/// The light curves of several nights as small panels, a line of them for each night.
pub(super) fn light_curves(nights: &[NightPage]) -> Markup {
    let room = (MOST_SMALL / nights.len().max(1)).max(1);
    let of_night = |night: &NightPage| -> (usize, Vec<Markup>) {
        let all = passes(&night.rows);
        let drawn =
            all.iter().enumerate().filter_map(|(i, pass)| one_pass(night, i, pass, &SMALL)).take(room).collect();
        (all.len(), drawn)
    };
    let drawn: Vec<(&NightPage, (usize, Vec<Markup>))> = nights.iter().map(|n| (n, of_night(n))).collect();
    if drawn.iter().all(|(_, (_, charts))| charts.is_empty()) {
        return nothing("No night has a frame with a magnitude, a limit or a model.");
    }
    html! {
        (light_key())
        p.note { "Shaded: penumbra and what is not sunlit; strip at the foot: altitude." }
        @for (night, (passes, charts)) in drawn {
            h3 { (night.linked_name("light-curve")) ": " (passes) " passes"
                @if charts.len() < passes { ", " (charts.len()) " drawn; the others are in the night's own report or have nothing to draw" } }
            div.panels { @for chart in charts { (chart) } }
        }
    }
}

/// Switches and key of light curves.
fn light_key() -> Markup {
    let lines = || std::iter::once(("model", MODEL)).chain(LIGHTS.iter().map(|(name, paint, _)| (*name, *paint)));
    html! {
        fieldset.toggles hidden {
            legend { "Show" }
            @for (name, paint) in lines() { label { input type="checkbox" checked data-toggle=(paint.class); " " (name) } }
            label { input type="checkbox" data-by="by-altitude"; " points by altitude" }
        }
        ul.key {
            @for (name, paint) in lines() { li { (key_mark(Mark::Line(3), paint)) " " (name) } }
            (verdict_key())
            li { (key_mark(Mark::Limit, paint_of(Verdict::Use))) " fainter than" }
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

fn one_pass(page: &NightPage, i: usize, pass: &[&PhotometryRow], size: &Size) -> Option<Markup> {
    let first = *pass.first()?;
    let interaction = Interaction {
        link: &|r| page.link(r),
        tip: &|r| if page.rows.len() > MOST_ROWS { String::new() } else { tip(r) },
    };
    let chart = pass_chart(pass, page.band(), size.shown, &interaction)?;
    let date: String = first.date_mid.chars().take(10).collect();
    let title = format!("Pass {}: {} on {date}", i + 1, first.object_name);
    let observed = pass.iter().filter(|r| r.v_mag.is_some());
    let used = observed.clone().filter(|r| verdict_paint(r).class != Verdict::Reject.as_str()).count();
    let limits = pass.iter().filter(|r| limit(r).is_some()).count();
    Some(html! {
        figure {
            (shown(chart, &title))
            figcaption { (title) ": " (observed.count()) " magnitudes, " (used) " of them used, " (limits) " limits."
                @if size.told { " Shaded: penumbra and what is not sunlit; strip at the foot: altitude. A point leads to its picture." } }
        }
    })
}

/// What the colours of points mean.
fn verdict_key() -> Markup {
    html! { @for verdict in Verdict::ALL { li { (key_mark(Mark::Full, paint_of(verdict))) " " (verdict) } } }
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

/// The section of residuals.
pub(super) fn residuals(page: &NightPage) -> Markup {
    let rows: Vec<&PhotometryRow> =
        page.rows.iter().filter(|r| r.residual_mag.is_some() && r.status == Status::Ok).collect();
    let used = |r: &&&PhotometryRow| is_used(&r.status, &r.verdict) && !is_lower_limit(r.flags);
    let kept: Vec<f64> = rows.iter().filter(used).filter_map(|r| r.residual_mag).collect();
    if rows.is_empty() {
        return nothing("No row has both an observed and a modelled magnitude ([model] and a zeropoint are needed).");
    }
    let shown = if kept.is_empty() { rows.iter().filter_map(|r| r.residual_mag).collect() } else { kept.clone() };
    let Some(y) = Span::around(shown, 0.4) else { return nothing("No residual is a number.") };
    html! {
        @match robust(&kept) {
            Some((m, _)) => p {
                "Median " (format!("{m:+.3}").replace('-', "−")) " mag"
                @if let Some(s) = scatter(&kept) { ", robust scatter " (format!("{s:.3}")) " mag" } ", over "
                (kept.len()) " frames that are used; positive = observed fainter. Frames with the verdict reject and lower limits do not count."
            },
            None => p { "No frame is used: all have the verdict reject or are lower limits." },
        }
        ul.key {
            (verdict_key())
            li { (key_mark(Mark::Up, VERMILLION.class("reject beyond"))) " beyond the axis" }
        }
        div.panels { @for (label, of) in AGAINST { (panel(page, label, of, &rows, y)) } (in_time(page, &rows, y)) }
    }
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
