//! Light curve and residuals of every pass: points lead to the picture of their frame.
//!
//! Magnitudes upwards to brighter; seconds of the day to the right. Lights that are far fainter than everything else are
//! left out of the chart: their numbers are in the table.

use maud::{Markup, html};

use super::parts::MOST_ROWS;
use super::parts::NightPage;
use super::parts::nothing;
use super::parts::tip;
use super::parts::verdict_class;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::brightness::Illum;
use crate::figures::axis::Span;
use crate::figures::chart::{Chart, Point, Ticks};
use crate::figures::viridis;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::words::{Status, Verdict};

/// How far below everything else a light is still drawn \[mag\].
const LIGHTS_BELOW_MAG: f64 = 3.0;

/// Light curves of a campaign.
const MOST_SMALL: usize = 60;

/// How large a light curve is \[CSS px\], and whether its caption explains it.
struct Size {
    width: f64,
    height: f64,
    told: bool,
}

const WIDE: Size = Size { width: 940.0, height: 340.0, told: true };
const SMALL: Size = Size { width: 460.0, height: 250.0, told: false };

type Light = (&'static str, &'static str, fn(&PhotometryRow) -> Option<f64>);

const LIGHTS: [Light; 5] = [
    ("model", "model", |r| r.model_v_mag),
    ("Sunlight", "sun", |r| r.sun_v_mag),
    ("Earthshine", "earthshine", |r| r.earthshine_v_mag),
    ("Moonlight", "moon", |r| r.moon_v_mag),
    ("Lunar-Earthshine", "lunar", |r| r.lunar_earthshine_v_mag),
];

/// Seconds from the midnight before the first row.
fn seconds(row: &PhotometryRow, first: &PhotometryRow) -> f64 {
    let day = first.mjd_mid_d.unwrap_or(0.0).floor();
    (row.mjd_mid_d.unwrap_or(f64::NAN) - day) * 86_400.0
}

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
    html! {
        fieldset.toggles hidden {
            legend { "Show" }
            @for (name, class, _) in LIGHTS { label { input type="checkbox" checked data-toggle=(class); " " (name) } }
            label { input type="checkbox" data-by="by-altitude"; " points by altitude" }
        }
        ul.key {
            @for (name, class, _) in LIGHTS { li { svg width="30" height="10" aria-hidden="true" { path class={ "line " (class) } d="M1 5h28" {} } " " (name) } }
            (verdict_key())
            li { svg width="12" height="16" aria-hidden="true" { path class="limit use" d="M2 1h8m-4 0v12m-4 -5l4 5l4 -5" {} } " fainter than" }
            li {
                "altitude 0° "
                svg width="90" height="10" aria-hidden="true" {
                    @for k in 0..18 { rect x=(5 * k) y="0" width="5.5" height="10" fill=(altitude_colour(5.0 * f64::from(k) + 2.5)) {} }
                }
                " 90°"
            }
        }
    }
}

fn one_pass(page: &NightPage, i: usize, pass: &[&PhotometryRow], size: &Size) -> Option<Markup> {
    let first = *pass.first()?;
    let limit = |r: &PhotometryRow| r.limit_v_mag.filter(|_| r.v_mag.is_none() && r.status == Status::Nondetection);
    let main: Vec<f64> = pass
        .iter()
        .flat_map(|r| [r.v_mag.filter(|_| is_used(&r.status, &r.verdict)), limit(r), r.model_v_mag])
        .flatten()
        .chain(pass.iter().filter_map(|r| r.v_mag).filter(|_| pass.iter().all(|r| !is_used(&r.status, &r.verdict))))
        .filter(|v| v.is_finite())
        .collect();
    let faintest = main.iter().copied().max_by(f64::total_cmp)? + LIGHTS_BELOW_MAG;
    let lights = pass.iter().flat_map(|r| LIGHTS.iter().filter_map(|(_, _, of)| of(r))).filter(|v| *v <= faintest);
    let bars = pass.iter().filter(|r| is_used(&r.status, &r.verdict)).filter_map(|r| r.v_mag.zip(r.v_mag_err));
    let bars = bars.flat_map(|(v, e)| [v - e.min(1.0), v + e.min(1.0)]);
    let mut y = Span::around(main.iter().copied().chain(lights).chain(bars), 1.0)?.reversed();
    y.from += 0.08 * (y.from - y.to); // room for arrows and for the strip of altitudes
    let x = Span::around(pass.iter().map(|r| seconds(r, first)), 20.0)?;
    let date: String = first.date_mid.chars().take(10).collect();
    let title = format!("Pass {}: {} on {date}", i + 1, first.object_name);
    let chart = Chart {
        title: title.clone(),
        width: size.width,
        height: size.height,
        x,
        y,
        x_label: format!("UTC on {date}"),
        y_label: format!("{} [mag]", page.band()),
        ticks: Ticks::Clock,
    };
    let at = |r: &PhotometryRow| seconds(r, first);
    let point = |r: &&&PhotometryRow, v: f64| Point {
        x: at(r),
        y: v,
        err: r.v_mag_err,
        class: verdict_class(r),
        href: page.link(r),
        tip: if page.rows.len() > MOST_ROWS { String::new() } else { tip(r) },
        colour: r.alt_deg.map(altitude_colour),
    };
    let observed: Vec<Point> = pass.iter().filter_map(|r| Some(point(&r, r.v_mag?))).collect();
    let limits: Vec<Point> = pass.iter().filter_map(|r| Some(point(&r, limit(r)?))).collect();
    let shaded =
        html! { @for (class, from, to, what) in shades(pass, first) { (chart.shade(class, from, to, &what)) } };
    let body = html! {
        @for (_, class, of) in LIGHTS {
            g data-series=(class) { (chart.line(class, &pass.iter().map(|r| (at(r), of(r))).collect::<Vec<_>>())) }
        }
        @for limit in &limits { (chart.limit(limit)) }
        (chart.points(&observed))
        (altitudes(&chart, pass, first))
    };
    let used = observed.iter().filter(|p| p.class != Verdict::Reject.as_str()).count();
    Some(html! {
        figure {
            (chart.with(&shaded, &body))
            figcaption { (title) ": " (observed.len()) " magnitudes, " (used) " of them used, " (limits.len()) " limits."
                @if size.told { " Shaded: penumbra and what is not sunlit; strip at the foot: altitude. A point leads to its picture." } }
        }
    })
}

/// What the colours of points mean.
fn verdict_key() -> Markup {
    html! {
        @for verdict in Verdict::ALL {
            li { svg width="12" height="12" aria-hidden="true" { circle class={ "point " (verdict) } cx="6" cy="6" r="4" {} } " " (verdict) }
        }
    }
}

/// Colour of an altitude: dark at the horizon, yellow in the zenith.
fn altitude_colour(alt_deg: f64) -> String {
    let (r, g, b) = viridis(alt_deg / 90.0);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The strip of altitudes, each frame as far as halfway to its neighbours.
fn altitudes(chart: &Chart, pass: &[&PhotometryRow], first: &PhotometryRow) -> Markup {
    let known: Vec<(f64, f64)> = pass.iter().filter_map(|r| Some((seconds(r, first), r.alt_deg?))).collect();
    let middle = |a: usize, b: usize| Some(0.5 * (known.get(a)?.0 + known.get(b)?.0));
    let piece = |k: usize, (at, alt_deg): (f64, f64)| {
        let before = k.checked_sub(1).and_then(|p| middle(p, k)).unwrap_or(at - 5.0);
        let after = middle(k, k + 1).unwrap_or(at + 5.0);
        chart.foot(before, after, &altitude_colour(alt_deg), &format!("altitude {alt_deg:.1}°"))
    };
    html! { @for (k, place) in known.iter().enumerate() { (piece(k, *place)) } }
}

/// Where the satellite is in the penumbra or has no direct sunlight; each shade reaches halfway to its neighbours.
fn shades(pass: &[&PhotometryRow], first: &PhotometryRow) -> Vec<(&'static str, f64, f64, String)> {
    let class = |r: &PhotometryRow| match Illum::from_cell(&r.illum) {
        Some(Illum::Penumbra) => Some("penumbra"),
        Some(Illum::Moon | Illum::LunarEarthshine | Illum::None) => Some("umbra"),
        _ => None,
    };
    let mut shades: Vec<(&'static str, f64, f64, String)> = Vec::new();
    let mut last = f64::NAN;
    for row in pass {
        let at = seconds(row, first);
        // the first shade begins at the edge of the chart
        let half = if last.is_finite() { 0.5 * (at - last) } else { f64::INFINITY };
        let what = || format!("largest light: {}", row.illum.replace('_', "-"));
        let open = shades.last_mut().filter(|open| open.2 == last);
        match (class(row), open) {
            (Some(c), Some(open)) if open.0 == c => open.2 = at,
            (now, Some(open)) => {
                open.2 = last + half;
                shades.extend(now.map(|c| (c, at - half, at, what())));
            }
            (Some(c), None) => shades.push((c, at - half, at, what())),
            (None, None) => {}
        }
        last = at;
    }
    // and the last one ends there
    if let Some(open) = shades.last_mut().filter(|open| open.2 == last) {
        open.2 = f64::INFINITY;
    }
    shades
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
            li { svg width="12" height="12" aria-hidden="true" { circle class="point beyond" cx="6" cy="6" r="4" {} } " beyond the axis" }
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

/// Residuals in order of time, each pass moved beside the one before.
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
    let chart = Chart {
        title: format!("Residual against {label}"),
        width: 460.0,
        height: 250.0,
        x,
        y,
        x_label: label.into(),
        y_label: "O − C [mag]".into(),
        ticks: Ticks::Numbers,
    };
    let point = |r: &&PhotometryRow| {
        Some(Point {
            x: of(r)?,
            y: r.residual_mag?,
            err: r.v_mag_err,
            class: verdict_class(r),
            href: page.link(r),
            colour: r.alt_deg.map(altitude_colour),
            tip: format!("O − C {:+.3}, {}", r.residual_mag?, tip(r)),
        })
    };
    let points: Vec<Point> = rows.iter().filter_map(point).collect();
    let zero = [(x.low(), Some(0.0)), (x.high(), Some(0.0))];
    html! { figure { (chart.with(&html! {}, &html! { (chart.line("zero", &zero)) (chart.points(&points)) })) } }
}
