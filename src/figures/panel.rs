//! One panel of a figure: two axes, and marks, lines and bands placed by value.
//!
//! Nothing is drawn outside the frame: lines are cut at it, a point beyond it becomes an open triangle on its edge,
//! and the caller is told, so that the figure can say how many.

use plotters::element::{PathElement, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoFont, IntoTextStyle, RGBColor, ShapeStyle};

use super::axis::{Span, clock};
use super::canvas::{Drawn, INK, LABEL, MARK, Mark, PALE, SMALL, Sheet, draw_mark, signed, write_text};

/// How the horizontal axis is labelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ticks {
    /// Plain numbers.
    Numbers,
    /// Seconds since midnight as `hh:mm:ss`.
    Clock,
    /// Seconds since midnight as `hh:mm`, a tick every few hours.
    Hours,
}

/// A frame on the sheet with the values of its edges.
pub(crate) struct Panel<'a, 'b> {
    pub sheet: &'a Sheet<'b>,
    /// Left, top, right, bottom \[drawn px\].
    pub frame: (i32, i32, i32, i32),
    /// Values at the left and right edge.
    pub x: Span,
    /// Values at the bottom and top edge.
    pub y: Span,
}

fn line(colour: RGBColor, width: u32) -> ShapeStyle {
    ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: width }
}

impl Panel<'_, '_> {
    pub(crate) fn px(&self, x: f64) -> i32 {
        let (left, _, right, _) = self.frame;
        left + ((x - self.x.from) / (self.x.to - self.x.from) * f64::from(right - left)).round().clamp(-1e6, 1e6) as i32
    }

    pub(crate) fn py(&self, y: f64) -> i32 {
        let (_, top, _, bottom) = self.frame;
        bottom
            - ((y - self.y.from) / (self.y.to - self.y.from) * f64::from(bottom - top)).round().clamp(-1e6, 1e6) as i32
    }

    /// Grid, frame, tick labels and axis titles. An empty `x_title` leaves the labels of the x axis out too.
    pub(crate) fn axes(&self, x_ticks: Ticks, x_title: &str, y_title: &str) -> Drawn {
        let (left, top, right, bottom) = self.frame;
        let y_count = ((bottom - top) / 60).clamp(4, 10) as usize;
        let (y_values, decimals) = self.y.ticks(y_count);
        for y in y_values {
            let at = self.py(y);
            self.sheet.draw(&PathElement::new(vec![(left, at), (right, at)], line(PALE, 1)))?;
            self.sheet.draw(&PathElement::new(vec![(left - 8, at), (left, at)], line(INK, 2)))?;
            write_text(
                self.sheet,
                &signed(&format!("{y:.decimals$}")),
                (left - 14, at),
                SMALL,
                INK,
                (HPos::Right, VPos::Center),
            )?;
        }
        let room = match x_ticks {
            Ticks::Clock => 170,
            Ticks::Hours => 130,
            Ticks::Numbers => 100,
        };
        let count = ((right - left) / room).clamp(3, 10) as usize;
        let (x_values, decimals) = match x_ticks {
            Ticks::Numbers => self.x.ticks(count),
            Ticks::Clock | Ticks::Hours => (self.x.time_ticks(count), 0),
        };
        for x in x_values {
            let at = self.px(x);
            self.sheet.draw(&PathElement::new(vec![(at, top), (at, bottom)], line(PALE, 1)))?;
            self.sheet.draw(&PathElement::new(vec![(at, bottom), (at, bottom + 8)], line(INK, 2)))?;
            if !x_title.is_empty() {
                let text = match x_ticks {
                    Ticks::Clock => clock(x),
                    Ticks::Hours => clock(x).chars().take(5).collect(),
                    Ticks::Numbers => signed(&format!("{x:.decimals$}")),
                };
                write_text(self.sheet, &text, (at, bottom + 14), SMALL, INK, (HPos::Center, VPos::Top))?;
            }
        }
        self.sheet.draw(&Rectangle::new([(left, top), (right, bottom)], line(INK, 2)))?;
        let below = ((left + right) / 2, bottom + 52);
        write_text(self.sheet, x_title, below, LABEL, INK, (HPos::Center, VPos::Top))?;
        let upright = ("sans-serif", LABEL)
            .into_font()
            .transform(FontTransform::Rotate270)
            .into_text_style(self.sheet)
            .color(&INK)
            .pos(Pos::new(HPos::Center, VPos::Bottom));
        self.sheet.draw(&plotters::element::Text::new(y_title.to_owned(), (left - 112, (top + bottom) / 2), upright))
    }

    /// A mark at a value. Returns whether it lies inside; outside it is an open triangle on the edge.
    pub(crate) fn mark(
        &self,
        mark: Mark,
        x: f64,
        y: f64,
        colour: RGBColor,
    ) -> std::result::Result<bool, super::canvas::DrawError> {
        if self.y.holds(y) {
            draw_mark(self.sheet, mark, (self.px(x), self.py(y)), colour)?;
            return Ok(true);
        }
        let (_, top, _, bottom) = self.frame;
        let above = (y > self.y.high()) == (self.y.to > self.y.from);
        let (edge, inward) = if above { (top + 3, 2 * MARK) } else { (bottom - 3, -2 * MARK) };
        let at = self.px(x);
        let corners = vec![(at, edge), (at + MARK, edge + inward), (at - MARK, edge + inward), (at, edge)];
        self.sheet.draw(&PathElement::new(corners, line(colour, 2)))?;
        Ok(false)
    }

    /// An error bar, cut at the frame.
    pub(super) fn error_bar(&self, x: f64, y: f64, error: f64, colour: RGBColor) -> Drawn {
        if !self.y.holds(y) {
            return Ok(());
        }
        let at = self.px(x);
        let inside = |v: f64| self.py(v.clamp(self.y.low(), self.y.high()));
        let ends = vec![(at, inside(y - error)), (at, inside(y + error))];
        self.sheet.draw(&PathElement::new(ends, line(colour, 2)))
    }

    /// A line through the values, broken at `None` and cut at the frame; a lone value is a dash.
    pub(crate) fn polyline(&self, points: &[(f64, Option<f64>)], colour: RGBColor, width: u32) -> Drawn {
        let style = line(colour, width);
        let at = |i: usize| points.get(i).and_then(|(x, y)| y.filter(|y| y.is_finite()).map(|y| (*x, y)));
        let mut run: Vec<(i32, i32)> = Vec::new();
        for i in 0..points.len() {
            let Some(here) = at(i) else { continue };
            let next = at(i + 1);
            let before = i.checked_sub(1).and_then(at);
            if next.is_none() && before.is_none() && self.y.holds(here.1) {
                let (x, y) = (self.px(here.0), self.py(here.1));
                self.sheet.draw(&PathElement::new(vec![(x - 12, y), (x + 12, y)], style))?;
            }
            let piece = next.and_then(|next| self.cut(here, next));
            if let Some((a, b)) = piece {
                if run.last() != Some(&a) {
                    self.flush(&mut run, style)?;
                    run.push(a);
                }
                run.push(b);
            } else {
                self.flush(&mut run, style)?;
            }
        }
        self.flush(&mut run, style)
    }

    fn flush(&self, run: &mut Vec<(i32, i32)>, style: ShapeStyle) -> Drawn {
        let points = std::mem::take(run);
        if points.len() < 2 {
            return Ok(());
        }
        self.sheet.draw(&PathElement::new(points, style))
    }

    /// The part of a segment inside the y range, in drawn pixels.
    fn cut(&self, a: (f64, f64), b: (f64, f64)) -> Option<((i32, i32), (i32, i32))> {
        let along = |y: f64| (y - a.1) / (b.1 - a.1);
        let (mut start, mut end) = (0.0f64, 1.0f64);
        if a.1 == b.1 {
            if !self.y.holds(a.1) {
                return None;
            }
        } else {
            let (t_low, t_high) = (along(self.y.low()), along(self.y.high()));
            start = start.max(t_low.min(t_high));
            end = end.min(t_low.max(t_high));
        }
        let point = |t: f64| (self.px(a.0 + t * (b.0 - a.0)), self.py(a.1 + t * (b.1 - a.1)));
        (start < end).then(|| (point(start), point(end)))
    }

    /// A band between two curves, cut at the frame.
    pub(super) fn band(&self, points: &[(f64, f64, f64)], colour: RGBColor) -> Drawn {
        if points.len() < 2 {
            return Ok(());
        }
        let inside = |v: f64| self.py(v.clamp(self.y.low(), self.y.high()));
        let mut outline: Vec<(i32, i32)> = points.iter().map(|(x, low, _)| (self.px(*x), inside(*low))).collect();
        outline.extend(points.iter().rev().map(|(x, _, high)| (self.px(*x), inside(*high))));
        self.sheet.draw(&Polygon::new(outline, colour.mix(0.2).filled()))
    }

    /// Fills the panel between two values of x.
    pub(super) fn shade(&self, from: f64, to: f64, colour: RGBColor) -> Drawn {
        let (left, top, right, bottom) = self.frame;
        let corners = [(self.px(from).clamp(left, right), top), (self.px(to).clamp(left, right), bottom)];
        self.sheet.draw(&Rectangle::new(corners, colour.filled()))
    }
}
