//! SVG written by hand: shapes and text, in colours for a file, in classes of a style sheet for a page.
//!
//! Lengths are units of the sheet, x to the right, y down, written to a tenth. Text is escaped. Links and tips exist on
//! a page alone. It does not cover what is drawn: see [`super::canvas`] for marks and [`super::panel`] for axes.

use std::cell::RefCell;
use std::fmt::Write as _;

/// A place on the sheet: from the left, from the top.
pub(crate) type Place = (f64, f64);

/// A colour by its red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// As style sheets write it.
    pub(crate) fn hex(self) -> String {
        format!("#{:02X}{:02X}{:02X}", self.0, self.1, self.2)
    }

    /// Red, green and blue.
    pub(crate) fn rgb(self) -> (u8, u8, u8) {
        (self.0, self.1, self.2)
    }

    /// With the class that stands for it on a page.
    pub(crate) const fn class(self, class: &str) -> Paint<'_> {
        Paint { colour: self, class }
    }
}

/// What a series is drawn in: a colour in a file; on a page a class of the style sheet, if it has one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Paint<'a> {
    pub colour: Colour,
    pub class: &'a str,
}

impl From<Colour> for Paint<'static> {
    fn from(colour: Colour) -> Self {
        Paint { colour, class: "" }
    }
}

/// How a shape looks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Style {
    /// Colour and opacity inside.
    fill: Option<(Colour, f64)>,
    /// Colour, width and opacity of the outline.
    stroke: Option<(Colour, f64, f64)>,
    class: String,
    /// Further attributes of a page, as they are written.
    more: String,
    tip: String,
}

impl Style {
    pub(crate) fn filled(colour: Colour) -> Self {
        Style { fill: Some((colour, 1.0)), ..Style::default() }
    }

    pub(crate) fn line(colour: Colour, width: impl Into<f64>) -> Self {
        Style { stroke: Some((colour, width.into(), 1.0)), ..Style::default() }
    }

    /// Fill and outline of this opacity.
    pub(crate) fn opacity(mut self, opacity: f64) -> Self {
        self.fill = self.fill.map(|(colour, _)| (colour, opacity));
        self.stroke = self.stroke.map(|(colour, width, _)| (colour, width, opacity));
        self
    }

    /// With this inside.
    pub(crate) fn fill(mut self, colour: Colour) -> Self {
        self.fill = Some((colour, 1.0));
        self
    }

    /// With this outline.
    pub(crate) fn stroke(mut self, colour: Colour, width: impl Into<f64>) -> Self {
        self.stroke = Some((colour, width.into(), 1.0));
        self
    }

    /// Its class on a page, where it has one; the style sheet has the colours then.
    pub(crate) fn class(mut self, kind: &str, class: &str) -> Self {
        self.class = [kind, class].join(" ").trim().to_owned();
        self
    }

    /// What a page shows when the pointer rests on it.
    pub(crate) fn tip(mut self, tip: &str) -> Self {
        tip.clone_into(&mut self.tip);
        self
    }

    /// A property of the style sheet that is this shape's own.
    pub(crate) fn property(mut self, name: &str, value: Option<&str>) -> Self {
        if let Some(value) = value {
            self.more = format!(" style=\"{name}:{}\"", escaped(value));
        }
        self
    }
}

/// Where text is along its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum HPos {
    Left,
    Center,
    Right,
}

/// Where text is across its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum VPos {
    Top,
    Center,
    Bottom,
}

/// How text looks and where it stands about its place.
#[derive(Debug, Clone)]
pub(crate) struct Letters<'a> {
    /// Size of the font.
    pub size: f64,
    pub paint: Paint<'a>,
    pub place: (HPos, VPos),
    /// Reads upwards.
    pub upright: bool,
}

/// What a sheet is for: it decides between colours and classes, and how large letters, marks and ticks are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Medium {
    /// A file that stands alone: colours as attributes.
    File,
    /// Part of a page: classes of its style sheet, links and tips.
    Page,
}

/// A drawing in the making.
pub(crate) struct Sheet {
    pub medium: Medium,
    size: (f64, f64),
    body: RefCell<String>,
}

/// A length to a tenth, without a trailing zero; 0 for what is not a number.
pub(crate) fn number(v: f64) -> String {
    let tenths = (v * 10.0).round();
    if !tenths.is_finite() || tenths == 0.0 {
        return "0".into();
    }
    if tenths % 10.0 == 0.0 { format!("{}", tenths / 10.0) } else { format!("{:.1}", tenths / 10.0) }
}

/// Text as XML has it; characters XML forbids become blanks.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

impl Sheet {
    pub(crate) fn new(medium: Medium, size: (impl Into<f64>, impl Into<f64>)) -> Self {
        Sheet { medium, size: (size.0.into(), size.1.into()), body: RefCell::default() }
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (f64, f64) {
        self.size
    }

    pub(crate) fn width(&self) -> f64 {
        self.size.0
    }

    pub(crate) fn height(&self) -> f64 {
        self.size.1
    }

    pub(crate) fn on_page(&self) -> bool {
        self.medium == Medium::Page
    }

    /// The drawing as an element that stands in a page; `class` says which.
    pub(crate) fn into_page(self, class: &str, role: &str, name: &str) -> String {
        let (w, h) = (number(self.size.0), number(self.size.1));
        let name = escaped(name);
        format!(
            "<svg class=\"{class}\" role=\"{role}\" aria-label=\"{name}\" viewBox=\"0 0 {w} {h}\">{}</svg>",
            self.body.into_inner()
        )
    }

    /// The drawing as a sign in a line of text, as large as it is.
    pub(crate) fn into_sign(self) -> String {
        let (w, h) = (number(self.size.0), number(self.size.1));
        format!("<svg width=\"{w}\" height=\"{h}\" aria-hidden=\"true\">{}</svg>", self.body.into_inner())
    }

    /// Puts another drawing into this one, scaled to a rectangle: left, top, width, height.
    pub(crate) fn nest(&self, inner: Sheet, (x, y, w, h): (f64, f64, f64, f64)) {
        let ([x, y, w, h], size) = ([x, y, w, h].map(number), inner.size);
        let view = format!("0 0 {} {}", number(size.0), number(size.1));
        let place = format!(" class=\"chart\" x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" viewBox=\"{view}\"");
        self.element("svg", &place, &inner.body.into_inner());
    }

    /// The drawing as a file of this size on paper.
    pub(crate) fn into_file(self, (width_mm, height_mm): (f64, f64)) -> String {
        let (w, h) = (number(self.size.0), number(self.size.1));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_mm:.0}mm\" height=\"{height_mm:.1}mm\" \
             viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\">\n{}</svg>\n",
            self.body.into_inner()
        )
    }

    /// Writes an element: its name, its attributes, and what stands in it.
    fn element(&self, name: &str, attributes: &str, content: &str) {
        let mut body = self.body.borrow_mut();
        let end = if self.on_page() { "" } else { "\n" };
        // writing to a string cannot fail
        let _ = if content.is_empty() {
            write!(body, "<{name}{attributes}/>{end}")
        } else {
            write!(body, "<{name}{attributes}>{content}</{name}>{end}")
        };
    }

    /// The attributes of a style.
    fn look(&self, style: &Style) -> String {
        if self.on_page() && !style.class.is_empty() {
            return format!(" class=\"{}\"{}", escaped(&style.class), style.more);
        }
        let mut out = match style.fill {
            Some((colour, opacity)) => {
                let opacity = if opacity < 1.0 { format!(" fill-opacity=\"{opacity}\"") } else { String::new() };
                format!(" fill=\"{}\"{opacity}", colour.hex())
            }
            None => " fill=\"none\"".into(),
        };
        if let Some((colour, width, opacity)) = style.stroke {
            out += &format!(" stroke=\"{}\" stroke-width=\"{}\"", colour.hex(), number(width));
            if opacity < 1.0 {
                out += &format!(" stroke-opacity=\"{opacity}\"");
            }
        }
        out
    }

    fn shape(&self, name: &str, geometry: &str, style: &Style) {
        let tip = if self.on_page() && !style.tip.is_empty() {
            format!("<title>{}</title>", escaped(&style.tip))
        } else {
            String::new()
        };
        self.element(name, &format!("{}{geometry}", self.look(style)), &tip);
    }

    /// A line through places.
    pub(crate) fn path(&self, points: &[Place], style: &Style) {
        match points {
            [] | [_] => {}
            [a, b] => {
                let [x1, y1, x2, y2] = [a.0, a.1, b.0, b.1].map(number);
                self.shape("line", &format!(" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\""), style);
            }
            _ => self.shape("polyline", &places(points), style),
        }
    }

    /// A straight line.
    pub(crate) fn line(&self, a: (impl Into<f64>, impl Into<f64>), b: (impl Into<f64>, impl Into<f64>), style: &Style) {
        self.path(&[(a.0.into(), a.1.into()), (b.0.into(), b.1.into())], style);
    }

    /// A closed outline.
    pub(crate) fn polygon(&self, points: &[Place], style: &Style) {
        self.shape("polygon", &places(points), style);
    }

    /// A rectangle by two of its corners.
    pub(crate) fn rect(&self, a: (impl Into<f64>, impl Into<f64>), b: (impl Into<f64>, impl Into<f64>), style: &Style) {
        let (ax, ay, bx, by) = (a.0.into(), a.1.into(), b.0.into(), b.1.into());
        let [x, y, w, h] = [ax.min(bx), ay.min(by), (bx - ax).abs(), (by - ay).abs()].map(number);
        self.shape("rect", &format!(" x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\""), style);
    }

    pub(crate) fn circle(&self, at: (impl Into<f64>, impl Into<f64>), r: impl Into<f64>, style: &Style) {
        let [x, y, r] = [at.0.into(), at.1.into(), r.into()].map(number);
        self.shape("circle", &format!(" cx=\"{x}\" cy=\"{y}\" r=\"{r}\""), style);
    }

    pub(crate) fn text(&self, text: &str, (x, y): Place, letters: &Letters) {
        if text.is_empty() {
            return;
        }
        let (h, v) = letters.place;
        let down = letters.size
            * match v {
                VPos::Top => 0.8,
                VPos::Center => 0.35,
                VPos::Bottom => -0.22,
            };
        let (x, y) = if letters.upright { (x + down, y) } else { (x, y + down) };
        let (x, y) = (number(x), number(y));
        let anchor = match h {
            HPos::Left => "",
            HPos::Center => " text-anchor=\"middle\"",
            HPos::Right => " text-anchor=\"end\"",
        };
        let turn = if letters.upright { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
        let look = if self.on_page() && !letters.paint.class.is_empty() {
            format!(" class=\"{}\"", letters.paint.class)
        } else {
            format!(" font-size=\"{}\" fill=\"{}\"", number(letters.size), letters.paint.colour.hex())
        };
        self.element("text", &format!("{look} x=\"{x}\" y=\"{y}\"{anchor}{turn}"), &escaped(text));
    }

    /// A picture of bytes in base64, stretched to a rectangle.
    pub(crate) fn image(&self, png: &str, (left, top, right, bottom): (i32, i32, i32, i32)) {
        let (w, h) = (right - left, bottom - top);
        let place = format!(" x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\"");
        self.element("image", &format!("{place} href=\"data:image/png;base64,{png}\""), "");
    }

    /// On a page, what is drawn leads somewhere; `stop` says whether the tabulator key halts there.
    pub(crate) fn link(&self, href: Option<&str>, stop: bool, draw: impl FnOnce()) {
        let open = href.filter(|_| self.on_page()).map(|href| {
            let stop = if stop { "0" } else { "-1" };
            format!("<a href=\"{}\" tabindex=\"{stop}\">", escaped(href))
        });
        self.around(open.as_deref(), "</a>", draw);
    }

    /// On a page, what is drawn can be switched off by this name.
    pub(crate) fn series(&self, name: &str, draw: impl FnOnce()) {
        let open = self.on_page().then(|| format!("<g data-series=\"{}\">", escaped(name)));
        self.around(open.as_deref(), "</g>", draw);
    }

    fn around(&self, open: Option<&str>, close: &str, draw: impl FnOnce()) {
        if let Some(open) = open {
            self.body.borrow_mut().push_str(open);
        }
        draw();
        if open.is_some() {
            self.body.borrow_mut().push_str(close);
        }
    }
}

fn places(points: &[Place]) -> String {
    let mut out = String::from(" points=\"");
    for (i, (x, y)) in points.iter().enumerate() {
        let gap = if i == 0 { "" } else { " " };
        let _ = write!(out, "{gap}{},{}", number(*x), number(*y));
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_at_most_one_decimal_and_are_always_numbers() {
        for (v, text) in [
            (3.0, "3"),
            (-0.04, "0"),
            (1.25, "1.3"),
            (-7.96, "-8"),
            (f64::NAN, "0"),
            (f64::INFINITY, "0"),
            (1e6, "1000000"),
        ] {
            assert_eq!(number(v), text);
        }
    }

    #[test]
    fn text_and_tips_are_escaped_and_a_file_has_neither_links_nor_tips() {
        let draw = |medium| {
            let sheet = Sheet::new(medium, (10, 10));
            let letters =
                Letters { size: 2.0, paint: Colour(0, 0, 0).into(), place: (HPos::Left, VPos::Top), upright: false };
            sheet.text("<a & \"b\"\u{1}>", (1.0, 1.0), &letters);
            sheet.link(Some("#x\"y"), true, || {
                sheet.circle((1, 2), 3, &Style::filled(Colour(0, 114, 178)).class("point", "use").tip("<tip>"));
            });
            sheet
        };
        let page = draw(Medium::Page).into_page("chart", "group", "n");
        assert!(
            page.contains("&lt;a &amp; &quot;b&quot; &gt;") && page.contains("<title>&lt;tip&gt;</title>"),
            "{page}"
        );
        assert!(page.contains("<a href=\"#x&quot;y\" tabindex=\"0\"><circle class=\"point use\" cx=\"1\""), "{page}");
        let file = draw(Medium::File).into_file((174.0, 100.0));
        assert!(file.contains("<circle fill=\"#0072B2\" cx=\"1\" cy=\"2\" r=\"3\"/>"), "{file}");
        assert!(!file.contains("href") && !file.contains("title") && !file.contains("class"), "{file}");
    }
}
