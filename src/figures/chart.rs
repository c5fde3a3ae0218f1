//! Charts of the report, as inline SVG whose points are links: axes, marks, error bars, lines, bands.
//!
//! Values in the units of the axis labels, lengths in CSS pixels. Colours are classes, so that light, dark and print
//! differ in the style sheet alone. Leaves out figures for papers ([`crate::figures`]).

use maud::{Markup, html};

use crate::figures::axis::{Span, clock};

/// Room for labels: left, right, top, bottom.
const MARGIN: (f64, f64, f64, f64) = (62.0, 12.0, 8.0, 42.0);
/// More points than this are not reached by the tabulator key one by one.
const MOST_STOPS: usize = 60;
/// More points than this are marks alone: no error bars, no links, no words.
const MOST_TOLD: usize = 500;
/// Of more points than this every n-th is drawn: a page must stay below 5 MB.
const MOST_DRAWN: usize = 1500;

/// One panel with two axes.
pub(crate) struct Chart {
    /// What is read out where it cannot be seen.
    pub title: String,
    pub width: f64,
    pub height: f64,
    pub x: Span,
    pub y: Span,
    pub x_label: String,
    pub y_label: String,
    /// What stands below the horizontal axis.
    pub ticks: Ticks,
}

/// Labels of a horizontal axis.
pub(crate) enum Ticks {
    /// Round numbers.
    Numbers,
    /// The clock; the values are seconds since midnight.
    Clock,
    /// A name in the middle of each unit from 0; a line break makes two lines.
    Names(Vec<String>),
}

/// One mark: where, what it says, where it leads.
#[derive(Default)]
pub(crate) struct Point<'a> {
    pub x: f64,
    pub y: f64,
    pub err: Option<f64>,
    pub class: &'a str,
    pub href: Option<String>,
    pub tip: String,
    /// Its colour where points are coloured by altitude.
    pub colour: Option<String>,
}

/// A length with a tenth of a pixel.
pub(crate) fn px(v: f64) -> String {
    format!("{v:.1}")
}

/// A number with a true minus sign.
fn signed(v: f64, decimals: usize) -> String {
    format!("{v:.decimals$}").replace('-', "\u{2212}")
}

impl Chart {
    fn sides(&self) -> (f64, f64, f64, f64) {
        let (left, right, top, bottom) = MARGIN;
        (left, top, self.width - right, self.height - bottom)
    }

    /// Pixels from the left.
    pub fn at_x(&self, x: f64) -> f64 {
        let (left, _, right, _) = self.sides();
        left + (x - self.x.from) / (self.x.to - self.x.from) * (right - left)
    }

    /// Pixels from the top.
    pub fn at_y(&self, y: f64) -> f64 {
        let (_, top, _, bottom) = self.sides();
        bottom - (y - self.y.from) / (self.y.to - self.y.from) * (bottom - top)
    }

    /// The chart with what is drawn in it; what is shaded lies below the grid.
    pub fn with(&self, shades: &Markup, body: &Markup) -> Markup {
        let (left, top, right, bottom) = self.sides();
        let (y_ticks, y_decimals) = self.y.ticks(((bottom - top) / 38.0).clamp(3.0, 9.0) as usize);
        let room = |each: f64| ((right - left) / each).clamp(2.0, 12.0) as usize;
        let x_ticks: Vec<(f64, String)> = match &self.ticks {
            Ticks::Numbers => {
                let (ticks, decimals) = self.x.ticks(room(62.0));
                ticks.into_iter().map(|x| (x, signed(x, decimals))).collect()
            }
            Ticks::Clock => self.x.time_ticks(room(92.0)).into_iter().map(|x| (x, clock(x))).collect(),
            Ticks::Names(names) => names.iter().enumerate().map(|(i, n)| (i as f64 + 0.5, n.clone())).collect(),
        };
        html! {
            svg.chart role="group" aria-label=(self.title) viewBox=(format!("0 0 {:.0} {:.0}", self.width, self.height)) {
                (shades)
                @for y in y_ticks {
                    line.grid x1=(px(left)) x2=(px(right)) y1=(px(self.at_y(y))) y2=(px(self.at_y(y))) {}
                    text.tick text-anchor="end" x=(px(left - 6.0)) y=(px(self.at_y(y) + 4.0)) { (signed(y, y_decimals)) }
                }
                @for (x, name) in x_ticks {
                    line.grid x1=(px(self.at_x(x))) x2=(px(self.at_x(x))) y1=(px(top)) y2=(px(bottom)) {}
                    @for (line, part) in name.split('\n').enumerate() {
                        text.tick text-anchor="middle" x=(px(self.at_x(x))) y=(px(bottom + 16.0 + 13.0 * line as f64)) { (part) }
                    }
                }
                (body)
                rect.frame x=(px(left)) y=(px(top)) width=(px(right - left)) height=(px(bottom - top)) {}
                text.label text-anchor="middle" x=(px(0.5 * (left + right))) y=(px(self.height - 6.0)) { (self.x_label) }
                text.label text-anchor="middle" transform=(format!("translate(14 {}) rotate(-90)", px(0.5 * (top + bottom)))) {
                    (self.y_label)
                }
            }
        }
    }

    /// Marks with their error bars; what lies beyond the frame sits on its edge, as an open mark.
    pub fn points(&self, points: &[Point]) -> Markup {
        let stop = if points.len() > MOST_STOPS { "-1" } else { "0" };
        if points.len() > MOST_TOLD {
            return self.marks_alone(points);
        }
        html! {
            @for p in points.iter().filter(|p| p.x.is_finite() && p.y.is_finite()) {
                @if let Some(err) = p.err.filter(|e| e.is_finite() && self.y.holds(p.y)) {
                    line class={ "err " (p.class) } x1=(px(self.at_x(p.x))) x2=(px(self.at_x(p.x)))
                        y1=(px(self.clamped(p.y - err))) y2=(px(self.clamped(p.y + err))) {}
                }
                @match &p.href {
                    Some(href) => a href=(href) tabindex=(stop) { (self.mark(p)) },
                    None => (self.mark(p)),
                }
            }
        }
    }

    /// Very many points: small marks, thinned evenly where there are too many, which is said in the corner.
    fn marks_alone(&self, points: &[Point]) -> Markup {
        let (left, top, ..) = self.sides();
        let step = points.len().div_ceil(MOST_DRAWN);
        html! {
            @for p in points.iter().step_by(step).filter(|p| p.x.is_finite() && p.y.is_finite()) {
                circle class={ "point " (p.class) } cx=(px(self.at_x(p.x))) cy=(px(self.clamped(p.y))) r="2" {}
            }
            @if step > 1 { text.tick x=(px(left + 6.0)) y=(px(top + 14.0)) { "1 of " (step) " points drawn" } }
        }
    }

    fn mark(&self, p: &Point) -> Markup {
        let edge = if self.y.holds(p.y) { "" } else { " beyond" };
        html! {
            circle class={ "point " (p.class) (edge) } style=[p.colour.as_ref().map(|c| format!("--by:{c}"))] cx=(px(self.at_x(p.x))) cy=(px(self.clamped(p.y))) r="3.6" {
                @if !p.tip.is_empty() { title { (p.tip) @if !edge.is_empty() { " (beyond the axis)" } } }
            }
        }
    }

    fn clamped(&self, y: f64) -> f64 {
        self.at_y(y.clamp(self.y.low(), self.y.high()))
    }

    /// An arrow downwards: at most so bright.
    pub fn limit(&self, p: &Point) -> Markup {
        let (x, y) = (self.at_x(p.x), self.clamped(p.y));
        let path = format!("M{} {}h8m-4 0v12m-4 -5l4 5l4 -5", px(x - 4.0), px(y));
        let arrow = html! { path class={ "limit " (p.class) } d=(path) { title { (p.tip) } } };
        match &p.href {
            Some(href) => html! { a href=(href) tabindex="-1" { (arrow) } },
            None => arrow,
        }
    }

    /// A line through the values inside the frame, broken where one is missing.
    pub fn line(&self, class: &str, points: &[(f64, Option<f64>)]) -> Markup {
        let mut path = String::new();
        let mut down = false;
        for (x, y) in points {
            match y.filter(|y| self.y.holds(*y)) {
                Some(y) => {
                    path += &format!("{}{} {}", if down { "L" } else { "M" }, px(self.at_x(*x)), px(self.at_y(y)));
                    down = true;
                }
                None => down = false,
            }
        }
        html! { @if !path.is_empty() { path class={ "line " (class) } d=(path) {} } }
    }

    /// A stretch of the horizontal axis in another shade.
    pub fn shade(&self, class: &str, from: f64, to: f64, tip: &str) -> Markup {
        let (_, top, _, bottom) = self.sides();
        let (a, b) =
            (self.at_x(from.clamp(self.x.low(), self.x.high())), self.at_x(to.clamp(self.x.low(), self.x.high())));
        html! {
            rect class={ "shade " (class) } x=(px(a.min(b))) y=(px(top)) width=(px((b - a).abs().max(1.0)))
                height=(px(bottom - top)) { title { (tip) } }
        }
    }

    /// A bar of a histogram standing on zero.
    pub fn column(&self, class: &str, (from, to): (f64, f64), count: f64, tip: &str) -> Markup {
        let (x0, x1) = (self.at_x(from), self.at_x(to));
        let (y0, y1) = (self.clamped(0.0), self.clamped(count));
        html! {
            rect class={ "column " (class) } x=(px(x0.min(x1) + 0.5)) y=(px(y1)) width=(px(((x1 - x0).abs() - 1.0).max(0.5)))
                height=(px((y0 - y1).max(0.0))) { title { (tip) } }
        }
    }

    /// A violin about the middle of unit `at`: how densely values lie, to half a width of `half` units.
    pub fn violin(&self, class: &str, at: f64, half: f64, density: &[(f64, f64)], tip: &str) -> Markup {
        let inside: Vec<(f64, f64)> = density.iter().copied().filter(|(v, _)| self.y.holds(*v)).collect();
        let corner =
            |sign: f64, (v, d): (f64, f64)| format!("{} {}", px(self.at_x(at + sign * half * d)), px(self.at_y(v)));
        let mut outline: Vec<String> = inside.iter().map(|p| corner(-1.0, *p)).collect();
        outline.extend(inside.iter().rev().map(|p| corner(1.0, *p)));
        html! {
            @if outline.len() > 2 {
                path class={ "column violin " (class) } d={ "M" (outline.join("L")) "Z" } { title { (tip) } }
            }
        }
    }

    /// A short bar across, for a median.
    pub fn dash(&self, at: f64, half: f64, y: f64, tip: &str) -> Markup {
        html! {
            line.median x1=(px(self.at_x(at - half))) x2=(px(self.at_x(at + half))) y1=(px(self.clamped(y))) y2=(px(self.clamped(y))) {
                title { (tip) }
            }
        }
    }

    /// A piece of the strip along the foot of the frame, in a colour of its own.
    pub fn foot(&self, from: f64, to: f64, colour: &str, tip: &str) -> Markup {
        let (_, _, _, bottom) = self.sides();
        let (a, b) =
            (self.at_x(from.clamp(self.x.low(), self.x.high())), self.at_x(to.clamp(self.x.low(), self.x.high())));
        html! {
            rect.foot x=(px(a)) y=(px(bottom - 9.0)) width=(px((b - a).max(0.5))) height="9" fill=(colour) { title { (tip) } }
        }
    }
}
