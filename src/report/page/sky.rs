//! The sky of each pass as a disc: the model's magnitude in colour, the observed ones on the same scale, Sun and Moon.
//!
//! Zenith in the middle, North up and East left, as one looks up; equal steps of altitude are equal steps of radius.

use maud::{Markup, html};

use super::parts::NightPage;
use super::parts::PassSky;
use super::parts::nothing;
use super::parts::tip;
use crate::figures::axis::Span;
use crate::figures::chart::px;
use crate::figures::viridis;
use crate::tables::PhotometryRow;

/// Radius of the disc and room around it \[CSS px\].
const RADIUS: f64 = 150.0;
const ROOM: f64 = 24.0;
/// Length of the bar of colours \[CSS px\].
const BAR: f64 = 330.0;

/// Place of a direction on the disc.
fn place(alt_deg: f64, az_deg: f64) -> (f64, f64) {
    let r = RADIUS * (90.0 - alt_deg.clamp(0.0, 90.0)) / 90.0;
    let (sin, cos) = az_deg.to_radians().sin_cos();
    (ROOM + RADIUS - r * sin, ROOM + RADIUS - r * cos)
}

/// The skies with a frame of which the place is known.
pub(super) fn drawn(page: &NightPage) -> Vec<&PassSky> {
    page.skies.iter().filter(|s| s.track.iter().any(|r| r.alt_deg.is_some())).collect()
}

/// The section.
pub(super) fn skies(page: &NightPage) -> Markup {
    let drawn = drawn(page);
    if drawn.is_empty() {
        return nothing("No frame has a place on the sky ([orbit] is needed).");
    }
    let values = drawn
        .iter()
        .flat_map(|s| s.cells.iter().filter_map(|c| c.model_v_mag).chain(s.track.iter().filter_map(|r| r.v_mag)));
    let scale = Span::around(values.filter(|v| v.is_finite()), 1.0);
    html! {
        div.panels { @for sky in drawn { (disc(page, sky, scale)) } }
        @if let Some(scale) = scale { (bar(scale)) }
        p.note {
            "Colour: V of the model in every direction at the middle of the pass, at the range its height gives; dots: what "
            "was observed, on the same scale; the arrow is the direction of motion. No colour: no light. North up, East left, horizon outside."
        }
    }
}

/// Colour of a magnitude: bright is yellow.
fn colour(scale: Option<Span>, v: Option<f64>) -> Option<String> {
    let (scale, v) = scale.zip(v)?;
    let (r, g, b) = viridis(1.0 - (v - scale.low()) / (scale.high() - scale.low()));
    Some(format!("#{r:02x}{g:02x}{b:02x}"))
}

fn disc(page: &NightPage, sky: &PassSky, scale: Option<Span>) -> Markup {
    let side = 2.0 * (RADIUS + ROOM);
    let (c, r) = (px(ROOM + RADIUS), |share: f64| px(RADIUS * share));
    let dots: Vec<(&PhotometryRow, (f64, f64))> =
        sky.track.iter().filter_map(|row| Some((row, place(row.alt_deg?, row.az_deg?)))).collect();
    let way: Vec<String> = dots.iter().map(|(_, (x, y))| format!("{} {}", px(*x), px(*y))).collect();
    html! {
        figure {
            svg.chart.dome role="group" aria-label={ "Sky of " (sky.title) } viewBox=(format!("0 0 {side:.0} {side:.0}")) {
                circle.ground cx=(c) cy=(c) r=(r(1.0)) {}
                (cells(sky, scale))
                @for share in [1.0 / 3.0, 2.0 / 3.0, 1.0] { circle.ring cx=(c) cy=(c) r=(r(share)) {} }
                @for (name, az) in [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0f64)] {
                    @let (sin, cos) = az.to_radians().sin_cos();
                    text.label text-anchor="middle" x=(px(ROOM + RADIUS - (RADIUS + 12.0) * sin)) y=(px(ROOM + RADIUS - (RADIUS + 12.0) * cos + 4.0)) { (name) }
                }
                @if way.len() > 1 { path.track d={ "M" (way.join("L")) } {} }
                @for (row, (x, y)) in &dots {
                    a href=[page.link(row)] tabindex="-1" {
                        circle.seen cx=(px(*x)) cy=(px(*y)) r="4.2" fill=(colour(scale, row.v_mag).unwrap_or("none".into())) { title { (tip(row)) } }
                    }
                }
                (arrow(&dots.iter().map(|d| d.1).collect::<Vec<_>>()))
                @for mark in &sky.marks { (lamp(&mark.name, mark.alt_deg, mark.az_deg)) }
            }
            figcaption { (sky.title) @if sky.cells.is_empty() { " (no model)" } }
        }
    }
}

/// Which way the track goes: a head beyond the last frame.
fn arrow(dots: &[(f64, f64)]) -> Markup {
    let (Some(&(x, y)), Some(&(x0, y0))) = (dots.last(), dots.len().checked_sub(2).and_then(|i| dots.get(i))) else {
        return html! {};
    };
    let turn = (y - y0).atan2(x - x0).to_degrees();
    html! {
        path.arrow transform=(format!("translate({} {}) rotate({turn:.1})", px(x), px(y))) d="M6 0L17 0M11 -5L17 0L11 5" {
            title { "direction of the motion" }
        }
    }
}

/// Sun or Moon; below the horizon on its rim, in brackets.
fn lamp(name: &str, alt_deg: f64, az_deg: f64) -> Markup {
    let (x, y) = place(alt_deg, az_deg);
    let said = if alt_deg < 0.0 { format!("({name})") } else { name.to_string() };
    let inward = if x > ROOM + RADIUS { ("end", -8.0) } else { ("start", 8.0) };
    html! {
        circle class={ "lamp " (name.to_lowercase()) } cx=(px(x)) cy=(px(y)) r="6" {
            title { (name) ": altitude " (format!("{alt_deg:.1}°, azimuth {az_deg:.0}°")) }
        }
        text.lamp text-anchor=(inward.0) x=(px(x + inward.1)) y=(px(y + 4.0)) { (said) }
    }
}

/// The cells of the model, each a ring's piece.
fn cells(sky: &PassSky, scale: Option<Span>) -> Markup {
    let (n_alt, n_az) = sky.grid;
    if sky.cells.len() != n_alt * n_az || n_alt < 2 || n_az < 2 {
        return html! {};
    }
    let (half_alt, half_az) = (45.0 / (n_alt - 1) as f64, 180.0 / (n_az - 1) as f64);
    let piece = |alt: f64, az: f64| {
        let (low, high) = (alt - half_alt, alt + half_alt);
        let corner = |alt: f64, az: f64| {
            let (x, y) = place(alt, az);
            format!("{} {}", px(x), px(y))
        };
        format!(
            "M{}L{}L{}L{}L{}L{}Z",
            corner(low, az - half_az),
            corner(low, az),
            corner(low, az + half_az),
            corner(high, az + half_az),
            corner(high, az),
            corner(high, az - half_az)
        )
    };
    html! {
        // the last azimuth is the first one again
        @for cell in sky.cells.iter().take(n_alt * (n_az - 1)) {
            @if let Some(fill) = colour(scale, cell.model_v_mag) { path d=(piece(cell.alt_deg, cell.az_deg)) fill=(fill) stroke=(fill) {} }
        }
    }
}

/// The scale of colours, bright on the left.
fn bar(scale: Span) -> Markup {
    const STEPS: usize = 60;
    let at = |v: f64| 10.0 + BAR * (v - scale.low()) / (scale.high() - scale.low());
    let (ticks, decimals) = scale.ticks(8);
    let step = (scale.high() - scale.low()) / STEPS as f64;
    let colour = |k: usize| colour(Some(scale), Some(scale.low() + (k as f64 + 0.5) * step)).unwrap_or_default();
    html! {
        svg.chart.scale role="img" aria-label="Scale of colours, V in magnitudes" viewBox="0 0 420 36" {
            @for k in 0..STEPS {
                rect x=(px(at(scale.low() + k as f64 * step))) y="2" width=(px(BAR / STEPS as f64 + 0.5)) height="14" fill=(colour(k)) {}
            }
            @for v in ticks {
                text.tick text-anchor="middle" x=(px(at(v))) y="30" { (format!("{v:.decimals$}").replace('-', "−")) }
            }
            text.label x=(px(BAR + 18.0)) y="14" { "V [mag]" }
        }
    }
}
