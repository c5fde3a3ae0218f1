//! The sheet a figure is drawn on: size, colours, marks, legend, and the way to the file.
//!
//! Drawn at twice the shown size, because the SVG writer knows whole pixels only. Lengths here are drawn pixels.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Polygon, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, IntoTextStyle, RGBColor, ShapeStyle};

use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::figures::raster::Raster;

/// Drawn pixels per shown pixel.
const SCALE: u32 = 2;

/// Width of a figure: the text of an A4 page, two columns of a journal \[mm\].
pub(crate) const PAPER_MM: f64 = 174.0;

pub(super) type Sheet<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type DrawError = DrawingAreaErrorKind<std::io::Error>;
pub(super) type Drawn = std::result::Result<(), DrawError>;

// Okabe & Ito (2008), https://jfly.uni-koeln.de/color/: distinct for every common colour vision.
pub(crate) const INK: RGBColor = RGBColor(34, 34, 34);
pub(crate) const GREY: RGBColor = RGBColor(120, 120, 120);
pub(super) const PALE: RGBColor = RGBColor(222, 222, 222);
pub(crate) const ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(crate) const SKY_BLUE: RGBColor = RGBColor(86, 180, 233);
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
pub(crate) const PURPLE: RGBColor = RGBColor(204, 121, 167);

/// Heights of text.
pub(crate) const TITLE: i32 = 44;
pub(super) const LABEL: i32 = 34;
pub(crate) const SMALL: i32 = 31;
/// Radius of a mark.
pub(super) const MARK: i32 = 7;

/// Draws a figure of `shown` (width, height) and writes it in one step.
pub(crate) fn figure(path: &Path, shown: (u32, u32), draw: impl FnOnce(&Sheet) -> Drawn) -> Result<()> {
    figure_over(path, shown, None, draw)
}

/// As [`figure`], over a picture that fills a rectangle: left, top, right, bottom \[drawn px\].
pub(super) fn figure_over(
    path: &Path,
    shown: (u32, u32),
    under: Option<(&Raster, (i32, i32, i32, i32))>,
    draw: impl FnOnce(&Sheet) -> Drawn,
) -> Result<()> {
    let size = (shown.0 * SCALE, shown.1 * SCALE);
    let mut svg = String::new();
    {
        let sheet = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        sheet
            .fill(&RGBColor(255, 255, 255))
            .and_then(|()| draw(&sheet))
            .and_then(|()| sheet.present())
            .map_err(|e| Error::io(path, std::io::Error::other(e.to_string())))?;
    }
    if let Some((picture, (left, top, right, bottom))) = under {
        let png = STANDARD.encode(picture.png().map_err(|e| Error::io(path, e))?);
        let image = format!(
            "\n<image x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" \
             href=\"data:image/png;base64,{png}\"/>",
            right - left,
            bottom - top
        );
        // after the white ground, which is the first element
        if let Some(end) = svg.find("/>") {
            svg.insert_str(end + 2, &image);
        }
    }
    let drawn = format!("width=\"{}\" height=\"{}\" viewBox", size.0, size.1);
    let height_mm = PAPER_MM * f64::from(shown.1) / f64::from(shown.0);
    let scaled = format!("width=\"{PAPER_MM:.0}mm\" height=\"{height_mm:.1}mm\" viewBox");
    write_atomic(path, svg.replacen(&drawn, &scaled, 1).as_bytes())
}

/// A figure that says why it is empty.
pub(crate) fn no_data(path: &Path, shown: (u32, u32), title: &str, reason: &str) -> Result<()> {
    figure(path, shown, |sheet| {
        let (w, h) = sheet.dim_in_pixel();
        write_text(sheet, title, (30, 24), TITLE, INK, (HPos::Left, VPos::Top))?;
        let middle = (w as i32 / 2, h as i32 / 2);
        write_text(sheet, &format!("no data: {reason}"), middle, LABEL + 6, GREY, (HPos::Center, VPos::Center))
    })
}

/// Text at a place; characters XML forbids become blanks.
pub(crate) fn write_text(
    sheet: &Sheet,
    text: &str,
    at: (i32, i32),
    height: i32,
    colour: RGBColor,
    (h_pos, v_pos): (HPos, VPos),
) -> Drawn {
    let style = ("sans-serif", height).into_font().into_text_style(sheet).color(&colour).pos(Pos::new(h_pos, v_pos));
    sheet.draw(&Text::new(printable(text), at, style))
}

/// Numbers with a proper minus sign: a hyphen before a digit where a number may begin, or in an exponent. Those of dates,
/// ranges and words stay what they are.
pub(crate) fn signed(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: Option<usize>| i.and_then(|i| chars.get(i)).copied();
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let minus = |i: usize| {
        let (one, two) = (i.checked_sub(1), i.checked_sub(2));
        let exponent = matches!(at(one), Some('e' | 'E')) && digit(at(two));
        let begins = at(one).is_none_or(|c| !c.is_alphanumeric() && !matches!(c, '-' | '.' | ')'));
        let number = digit(at(Some(i + 1))) || (at(Some(i + 1)) == Some('.') && digit(at(Some(i + 2))));
        number && (begins || exponent)
    };
    chars.iter().enumerate().map(|(i, c)| if *c == '-' && minus(i) { '−' } else { *c }).collect()
}

/// Text that can be read on any ground: in `colour`, with a rim of ink.
pub(super) fn write_over(
    sheet: &Sheet,
    text: &str,
    (x, y): (i32, i32),
    colour: RGBColor,
    place: (HPos, VPos),
) -> Drawn {
    for (dx, dy) in [(-3, 0), (3, 0), (0, -3), (0, 3), (-2, -2), (2, -2), (-2, 2), (2, 2)] {
        write_text(sheet, text, (x + dx, y + dy), LABEL, INK, place)?;
    }
    write_text(sheet, text, (x, y), LABEL, colour, place)
}

/// XML 1.0 has no control characters.
pub(super) fn printable(text: &str) -> String {
    text.replace(|c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'), " ")
}

/// What stands for one point or line, in the figure and in its legend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Mark {
    /// Filled circle.
    Full,
    /// Small circle, one of very many.
    Dot,
    /// A piece of background.
    Swatch,
    /// Open circle.
    Open,
    /// Diagonal cross.
    Cross,
    /// Filled square.
    Square,
    /// Filled diamond.
    Diamond,
    /// Filled triangle, tip up.
    Up,
    /// Filled triangle, tip down.
    Down,
    /// Arrow towards fainter.
    Limit,
    /// Open circle with an arrow towards brighter.
    AtLeast,
    /// A line of this width.
    Line(u32),
    /// A filled band.
    Band,
}

/// Draws one mark.
pub(super) fn draw_mark(sheet: &Sheet, mark: Mark, (x, y): (i32, i32), colour: RGBColor) -> Drawn {
    let r = MARK;
    let stroke = |width| ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: width };
    let polygon = |points: Vec<(i32, i32)>| sheet.draw(&Polygon::new(points, colour.filled()));
    match mark {
        Mark::Full => sheet.draw(&Circle::new((x, y), r, colour.filled())),
        Mark::Dot => sheet.draw(&Circle::new((x, y), 5, colour.mix(0.7).filled())),
        Mark::Open => {
            // White inside, so that its error bar does not cross it out.
            sheet.draw(&Circle::new((x, y), r, RGBColor(255, 255, 255).filled()))?;
            sheet.draw(&Circle::new((x, y), r, stroke(3)))
        }
        Mark::Swatch => {
            let corners = vec![(x - 20, y - 14), (x + 20, y - 14), (x + 20, y + 14), (x - 20, y + 14)];
            sheet.draw(&Polygon::new(corners, colour.filled()))
        }
        Mark::Cross => {
            sheet.draw(&PathElement::new(vec![(x - r, y - r), (x + r, y + r)], stroke(3)))?;
            sheet.draw(&PathElement::new(vec![(x - r, y + r), (x + r, y - r)], stroke(3)))
        }
        Mark::Square => polygon(vec![(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r)]),
        Mark::Diamond => polygon(vec![(x, y - r - 3), (x + r + 3, y), (x, y + r + 3), (x - r - 3, y)]),
        Mark::Up => polygon(vec![(x, y - r - 2), (x + r + 1, y + r), (x - r - 1, y + r)]),
        Mark::Down => polygon(vec![(x, y + r + 2), (x + r + 1, y - r), (x - r - 1, y - r)]),
        Mark::Limit => {
            sheet.draw(&PathElement::new(vec![(x - r, y), (x + r, y)], stroke(3)))?;
            sheet.draw(&PathElement::new(vec![(x, y), (x, y + 26)], stroke(3)))?;
            polygon(vec![(x, y + 34), (x + 7, y + 22), (x - 7, y + 22)])
        }
        Mark::AtLeast => {
            sheet.draw(&PathElement::new(vec![(x, y - r), (x, y - 26)], stroke(3)))?;
            polygon(vec![(x, y - 36), (x + 7, y - 24), (x - 7, y - 24)])?;
            draw_mark(sheet, Mark::Open, (x, y), colour)
        }
        Mark::Line(width) => sheet.draw(&PathElement::new(vec![(x - 20, y), (x + 20, y)], stroke(width))),
        Mark::Band => {
            let corners = vec![(x - 20, y - 9), (x + 20, y - 9), (x + 20, y + 9), (x - 20, y + 9)];
            sheet.draw(&Polygon::new(corners, colour.mix(0.2).filled()))
        }
    }
}

/// Writes legend lines downwards from `at`, each with its mark; an entry without a mark is a plain line of text.
pub(crate) fn legend(sheet: &Sheet, at: (i32, i32), entries: &[(Option<(Mark, RGBColor)>, String)]) -> Drawn {
    for (i, (mark, text)) in entries.iter().enumerate() {
        let y = at.1 + 42 * i as i32;
        if let Some((mark, colour)) = mark {
            // An arrow leaves its point; shift it so that it stands in its line.
            let lift = match mark {
                Mark::Limit => 16,
                Mark::AtLeast => -10,
                _ => 0,
            };
            draw_mark(sheet, *mark, (at.0 + 20, y - lift), *colour)?;
        }
        let indent = if mark.is_some() { 54 } else { 0 };
        write_text(sheet, text, (at.0 + indent, y), SMALL, INK, (HPos::Left, VPos::Center))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::signed;

    #[test]
    fn numbers_have_a_minus_sign_and_dates_ranges_and_words_a_hyphen() {
        for (plain, shown) in [
            ("-0.5", "−0.5"),
            ("residual -0.12, σ 0.3", "residual −0.12, σ 0.3"),
            ("7.58e-4", "7.58e−4"),
            ("2025-06-09T10:33:00Z", "2025-06-09T10:33:00Z"),
            ("band 0.3-1.05 um", "band 0.3-1.05 um"),
            ("STARLINK-1008, Lunar-Earthshine", "STARLINK-1008, Lunar-Earthshine"),
            ("(-.5)", "(−.5)"),
        ] {
            assert_eq!(signed(plain), shown);
        }
    }
}
