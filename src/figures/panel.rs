//! One panel of a figure: two axes, and marks, lines and bands placed by value.
//!
//! Nothing is drawn outside the frame: lines are cut at it, a point beyond it becomes an open mark on its edge,
//! and the caller gets to know it, so that the figure can say how many.

use super::axis::{Span, clock};
use super::canvas::{
    Colour, HPos, INK, LABEL, Letters, Mark, PALE, Paint, Place, SMALL, Sheet, Style, VPos, mark_radius, signed,
    tipped_mark, write_text,
};

/// On a page, more points than this are not reached by the tabulator key one by one.
const MOST_STOPS: usize = 60;
/// On a page, more points than this are marks alone: no error bars, no links, no words.
const MOST_LINKED: usize = 500;
/// On a page, of more points than this every n-th is drawn: a page must stay below 5 MB.
const MOST_DRAWN: usize = 1500;

/// How the horizontal axis is labelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ticks<'a> {
    /// Plain numbers.
    Numbers,
    /// Seconds since midnight as `hh:mm:ss`.
    Clock,
    /// Seconds since midnight as `hh:mm`, a tick every few hours.
    Hours,
    /// A name in the middle of each unit from 0; a line break makes two lines.
    Names(&'a [String]),
}

/// A frame on the sheet with the values of its edges.
pub(crate) struct Panel<'a> {
    pub sheet: &'a Sheet,
    /// Left, top, right, bottom \[units of the sheet\].
    pub frame: (i32, i32, i32, i32),
    /// Values at the left and right edge.
    pub x: Span,
    /// Values at the bottom and top edge.
    pub y: Span,
}

/// One observation: where it is, what it says and where it leads on a page.
#[derive(Debug, Clone)]
pub(crate) struct Point<'a> {
    pub x: f64,
    pub y: f64,
    pub err: Option<f64>,
    pub mark: Mark,
    pub paint: Paint<'a>,
    pub href: Option<String>,
    pub tip: String,
    /// Its colour where the points of a page are coloured by altitude.
    pub by: Option<String>,
}

impl Default for Point<'_> {
    fn default() -> Self {
        let (href, by, tip) = (None, None, String::new());
        Point { x: 0.0, y: 0.0, err: None, mark: Mark::Full, paint: INK.into(), href, tip, by }
    }
}

/// Lengths of axes: size of the numbers and of the titles, length of a tick, from the frame to the numbers below and
/// left of it, to the titles below and left of it, and the height of a line.
struct Lengths {
    numbers: f64,
    titles: f64,
    tick: f64,
    below: f64,
    left: f64,
    title_below: f64,
    title_left: f64,
    line: f64,
    /// Between ticks upwards, of numbers, of a clock, of hours along.
    apart: [i32; 4],
}

const ON_FILE: Lengths = Lengths {
    numbers: SMALL,
    titles: LABEL,
    tick: 8.0,
    below: 14.0,
    left: 14.0,
    title_below: 52.0,
    title_left: 112.0,
    line: 30.0,
    apart: [60, 100, 170, 130],
};
const ON_PAGE: Lengths = Lengths {
    numbers: 11.5,
    titles: 11.5,
    tick: 4.0,
    below: 6.0,
    left: 6.0,
    title_below: 25.0,
    title_left: 53.0,
    line: 13.0,
    apart: [30, 62, 92, 62],
};

impl Panel<'_> {
    pub(crate) fn px(&self, x: f64) -> f64 {
        let (left, _, right, _) = self.frame;
        f64::from(left) + ((x - self.x.from) / (self.x.to - self.x.from) * f64::from(right - left)).clamp(-1e6, 1e6)
    }

    pub(crate) fn py(&self, y: f64) -> f64 {
        let (_, top, _, bottom) = self.frame;
        f64::from(bottom) - ((y - self.y.from) / (self.y.to - self.y.from) * f64::from(bottom - top)).clamp(-1e6, 1e6)
    }

    /// Left, top, right, bottom.
    fn sides(&self) -> (f64, f64, f64, f64) {
        let (left, top, right, bottom) = self.frame;
        (f64::from(left), f64::from(top), f64::from(right), f64::from(bottom))
    }

    /// The value, or the end of the axis it lies beyond.
    fn inside(&self, y: f64) -> f64 {
        self.py(y.clamp(self.y.low(), self.y.high()))
    }

    /// Grid, frame, tick labels and axis titles. An empty `x_title` leaves the numbers of the x axis out too.
    pub(crate) fn axes(&self, x_ticks: Ticks, x_title: &str, y_title: &str) {
        let lengths = if self.sheet.on_page() { &ON_PAGE } else { &ON_FILE };
        let (left, top, right, bottom) = self.sides();
        let grid = Style::line(PALE, 1).class("grid", "");
        let ink = Style::line(INK, 2).class("frame", "");
        let text = |text: &str, at: Place, place: (HPos, VPos)| {
            write_text(self.sheet, text, at, lengths.numbers, INK.class("tick"), place);
        };
        let fits = |length: f64, apart: i32, least: usize| ((length / f64::from(apart)) as usize).clamp(least, 10);
        let (y_values, decimals) = self.y.ticks(fits(bottom - top, lengths.apart[0], 4));
        for y in y_values {
            let at = self.py(y);
            self.sheet.path(&[(left, at), (right, at)], &grid);
            self.sheet.path(&[(left - lengths.tick, at), (left, at)], &ink);
            text(&signed(&format!("{y:.decimals$}")), (left - lengths.left, at), (HPos::Right, VPos::Center));
        }
        let room = |apart: i32| fits(right - left, apart, 3);
        let x_values: Vec<(f64, String)> = match x_ticks {
            Ticks::Numbers => {
                let (values, decimals) = self.x.ticks(room(lengths.apart[1]));
                values.into_iter().map(|x| (x, signed(&format!("{x:.decimals$}")))).collect()
            }
            Ticks::Clock => self.x.time_ticks(room(lengths.apart[2])).into_iter().map(|x| (x, clock(x))).collect(),
            Ticks::Hours => {
                let hours = |x| clock(x).chars().take(5).collect();
                self.x.time_ticks(room(lengths.apart[3])).into_iter().map(|x| (x, hours(x))).collect()
            }
            Ticks::Names(names) => names.iter().enumerate().map(|(i, n)| (i as f64 + 0.5, n.clone())).collect(),
        };
        for (x, name) in x_values {
            let at = self.px(x);
            self.sheet.path(&[(at, top), (at, bottom)], &grid);
            self.sheet.path(&[(at, bottom), (at, bottom + lengths.tick)], &ink);
            if x_title.is_empty() && !matches!(x_ticks, Ticks::Names(_)) {
                continue;
            }
            for (i, part) in name.split('\n').enumerate() {
                text(part, (at, bottom + lengths.below + lengths.line * i as f64), (HPos::Center, VPos::Top));
            }
        }
        self.sheet.rect((left, top), (right, bottom), &ink);
        let title = |text: &str, at: Place, place: (HPos, VPos), upright: bool| {
            let paint = INK.class("label");
            self.sheet.text(text, at, &Letters { size: lengths.titles, paint, place, upright });
        };
        let middle = (0.5 * (left + right), 0.5 * (top + bottom));
        title(x_title, (middle.0, bottom + lengths.title_below), (HPos::Center, VPos::Top), false);
        title(y_title, (left - lengths.title_left, middle.1), (HPos::Center, VPos::Bottom), true);
    }

    /// A mark at a value. Returns whether it lies inside; outside it is an open mark on the edge.
    pub(crate) fn mark<'a>(&self, mark: Mark, x: f64, y: f64, paint: impl Into<Paint<'a>>) -> bool {
        self.observed(&Point { x, y, mark, paint: paint.into(), ..Point::default() })
    }

    /// A mark with what a page says of it; whether it lies inside.
    fn observed(&self, p: &Point) -> bool {
        let extra = Style::default().property("--by", p.by.as_deref());
        if self.y.holds(p.y) {
            tipped_mark(self.sheet, p.mark, (self.px(p.x), self.py(p.y)), p.paint, &extra.tip(&p.tip));
            return true;
        }
        let (_, top, _, bottom) = self.sides();
        let r = mark_radius(self.sheet);
        let above = (p.y > self.y.high()) == (self.y.to > self.y.from);
        let (edge, base) = if above { (top + 0.4 * r, top + 2.4 * r) } else { (bottom - 0.4 * r, bottom - 2.4 * r) };
        let at = self.px(p.x);
        let tip = if p.tip.is_empty() { String::new() } else { format!("{} (beyond the axis)", p.tip) };
        let class = format!("{} beyond", p.paint.class);
        let style = extra.stroke(p.paint.colour, 2).class("point", class.trim()).tip(&tip);
        self.sheet.polygon(&[(at, edge), (at + r, base), (at - r, base)], &style);
        false
    }

    /// Observations with their error bars; returns how many lie beyond the axis. On a page they are links, and very many
    /// are marks alone, thinned evenly, which is said in the corner.
    pub(crate) fn points(&self, points: &[Point]) -> usize {
        let (page, n) = (self.sheet.on_page(), points.len());
        let few = !page || n <= MOST_LINKED;
        let step = if few { 1 } else { n.div_ceil(MOST_DRAWN) };
        let mut beyond = 0;
        for p in points.iter().step_by(step).filter(|p| p.x.is_finite() && p.y.is_finite()) {
            if few {
                if let Some(err) = p.err {
                    self.error_bar(p.x, p.y, err, p.paint);
                }
                self.sheet.link(p.href.as_deref(), n <= MOST_STOPS, || beyond += usize::from(!self.observed(p)));
            } else {
                let style = Style::filled(p.paint.colour).class("point", p.paint.class);
                let at = (self.px(p.x), self.inside(p.y));
                match p.mark {
                    Mark::Limit => tipped_mark(self.sheet, p.mark, at, p.paint, &Style::default()),
                    _ => self.sheet.circle(at, 2, &style),
                }
            }
        }
        if step > 1 {
            let at = (f64::from(self.frame.0 + 6), f64::from(self.frame.1 + 5));
            let place = (HPos::Left, VPos::Top);
            write_text(self.sheet, &format!("1 of {step} points drawn"), at, 11.5, INK.class("tick"), place);
        }
        beyond
    }

    /// An error bar, cut at the frame.
    pub(crate) fn error_bar<'a>(&self, x: f64, y: f64, error: f64, paint: impl Into<Paint<'a>>) {
        if !self.y.holds(y) || !error.is_finite() {
            return;
        }
        let (at, paint) = (self.px(x), paint.into());
        let ends = [(at, self.inside(y - error)), (at, self.inside(y + error))];
        self.sheet.path(&ends, &Style::line(paint.colour, 2).class("err", paint.class));
    }

    /// A line through the values, broken at `None` and cut at the frame; a lone value is a dash.
    pub(crate) fn polyline<'a>(
        &self,
        points: &[(f64, Option<f64>)],
        paint: impl Into<Paint<'a>>,
        width: impl Into<f64>,
    ) {
        let paint = paint.into();
        let style = Style::line(paint.colour, width).class("line", paint.class);
        let at = |i: usize| points.get(i).and_then(|(x, y)| y.filter(|y| y.is_finite()).map(|y| (*x, y)));
        let mut run: Vec<Place> = Vec::new();
        let flush = |run: &mut Vec<Place>| {
            self.sheet.path(run, &style);
            run.clear();
        };
        for i in 0..points.len() {
            let Some(here) = at(i) else { continue };
            let next = at(i + 1);
            let before = i.checked_sub(1).and_then(at);
            if next.is_none() && before.is_none() && self.y.holds(here.1) {
                let (x, y, half) = (self.px(here.0), self.py(here.1), 1.7 * mark_radius(self.sheet));
                self.sheet.path(&[(x - half, y), (x + half, y)], &style);
            }
            match next.and_then(|next| self.cut(here, next)) {
                Some((a, b)) => {
                    if run.last() != Some(&a) {
                        flush(&mut run);
                        run.push(a);
                    }
                    run.push(b);
                }
                None => flush(&mut run),
            }
        }
        flush(&mut run);
    }

    /// A line across at a value.
    pub(crate) fn across<'a>(&self, y: f64, paint: impl Into<Paint<'a>>, width: impl Into<f64>) {
        self.polyline(&[(self.x.from, Some(y)), (self.x.to, Some(y))], paint, width);
    }

    /// The part of a segment inside the y range, on the sheet.
    fn cut(&self, a: (f64, f64), b: (f64, f64)) -> Option<(Place, Place)> {
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
        // the ends themselves where nothing is cut off: the next segment begins at the same place
        let point = |t: f64| match t {
            0.0 => (self.px(a.0), self.py(a.1)),
            1.0 => (self.px(b.0), self.py(b.1)),
            _ => (self.px(a.0 + t * (b.0 - a.0)), self.py(a.1 + t * (b.1 - a.1))),
        };
        (start < end).then(|| (point(start), point(end)))
    }

    /// A band between two curves, cut at the frame.
    pub(crate) fn band<'a>(&self, points: &[(f64, f64, f64)], paint: impl Into<Paint<'a>>) {
        if points.len() < 2 {
            return;
        }
        let mut outline: Vec<Place> = points.iter().map(|(x, low, _)| (self.px(*x), self.inside(*low))).collect();
        outline.extend(points.iter().rev().map(|(x, _, high)| (self.px(*x), self.inside(*high))));
        let paint = paint.into();
        self.sheet.polygon(&outline, &Style::filled(paint.colour).opacity(0.2).class("band", paint.class));
    }

    /// Fills the panel between two values of x.
    pub(crate) fn shade<'a>(&self, from: f64, to: f64, paint: impl Into<Paint<'a>>, tip: &str) {
        let (_, top, _, bottom) = self.sides();
        let at = |x: f64| self.px(x.clamp(self.x.low(), self.x.high()));
        let paint = paint.into();
        let style = Style::filled(paint.colour).class("shade", paint.class).tip(tip);
        self.sheet.rect((at(from), top), (at(to), bottom), &style);
    }

    /// A bar of a histogram standing on zero.
    pub(crate) fn column(&self, (from, to): (f64, f64), count: f64, paint: Paint, tip: &str) {
        let gap = 0.14 * mark_radius(self.sheet);
        let (a, b) = (self.px(from).min(self.px(to)) + gap, self.px(from).max(self.px(to)) - gap);
        let style = Style::filled(paint.colour).class("column", paint.class).tip(tip);
        self.sheet.rect((a, self.inside(0.0)), (b.max(a + 0.5), self.inside(count)), &style);
    }

    /// A violin about `x`: how densely values lie, to half a width of `half` on the sheet; see
    /// [`super::density::density`].
    pub(crate) fn violin(&self, x: f64, half: f64, density: &[(f64, f64)], paint: Paint, tip: &str) {
        let at = self.px(x);
        let inside: Vec<(f64, f64)> =
            density.iter().filter(|(v, _)| self.y.holds(*v)).map(|(v, d)| (half * d, self.py(*v))).collect();
        let mut outline: Vec<Place> = inside.iter().map(|(half, y)| (at - half, *y)).collect();
        outline.extend(inside.iter().rev().map(|(half, y)| (at + half, *y)));
        if outline.len() > 2 {
            let style = Style::filled(paint.colour).opacity(0.75).class("column violin", paint.class).tip(tip);
            self.sheet.polygon(&outline, &style);
        }
    }

    /// A short bar across, for a median.
    pub(crate) fn dash(&self, x: f64, half: f64, y: f64, tip: &str) {
        let (at, y) = (self.px(x), self.inside(y));
        self.sheet.path(&[(at - half, y), (at + half, y)], &Style::line(INK, 4).class("median", "").tip(tip));
    }

    /// A piece of the strip along the foot of the frame, in a colour of its own.
    pub(crate) fn foot(&self, from: f64, to: f64, colour: Colour, tip: &str) {
        let at = |x: f64| self.px(x.clamp(self.x.low(), self.x.high()));
        let (_, _, _, bottom) = self.sides();
        let height = 2.5 * mark_radius(self.sheet);
        let style = Style::filled(colour).tip(tip);
        // a little under the next piece, so that no seam shows
        self.sheet.rect((at(from), bottom - height), (at(to) + 0.4, bottom), &style);
    }
}
