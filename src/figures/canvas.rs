//! What every figure is drawn with: colours, marks, texts, legends, and the way to the file.
//!
//! A file is drawn at twice the shown size; lengths of a file here are drawn pixels.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::figures::raster::Raster;
pub(crate) use crate::figures::svg::{Colour, HPos, Letters, Medium, Paint, Place, Sheet, Style, VPos};

/// Drawn pixels per shown pixel.
const SCALE: u32 = 2;

/// Width of a figure: the text of an A4 page, two columns of a journal \[mm\].
const PAPER_MM: f64 = 174.0;

// Okabe & Ito (2008), https://jfly.uni-koeln.de/color/: distinct for every common colour vision.
pub(crate) const INK: Colour = Colour(34, 34, 34);
pub(crate) const GREY: Colour = Colour(120, 120, 120);
pub(crate) const PALE: Colour = Colour(222, 222, 222);
pub(crate) const WHITE: Colour = Colour(255, 255, 255);
pub(crate) const ORANGE: Colour = Colour(230, 159, 0);
pub(crate) const SKY_BLUE: Colour = Colour(86, 180, 233);
pub(crate) const GREEN: Colour = Colour(0, 158, 115);
pub(crate) const BLUE: Colour = Colour(0, 114, 178);
pub(crate) const VERMILLION: Colour = Colour(213, 94, 0);
pub(crate) const PURPLE: Colour = Colour(204, 121, 167);

/// Sizes of text in a file.
const TITLE: f64 = 36.0;
pub(crate) const LABEL: f64 = 27.0;
pub(crate) const SMALL: f64 = 25.0;

/// Draws a figure of `shown` (width, height) and writes it in one step.
pub(crate) fn figure(path: &Path, shown: (u32, u32), draw: impl FnOnce(&Sheet)) -> Result<()> {
    let size = (shown.0 * SCALE, shown.1 * SCALE);
    let sheet = Sheet::new(Medium::File, size);
    sheet.rect((0, 0), size, &Style::filled(WHITE));
    draw(&sheet);
    let height_mm = PAPER_MM * f64::from(shown.1) / f64::from(shown.0);
    write_atomic(path, sheet.into_file((PAPER_MM, height_mm)).as_bytes())
}

/// As [`figure`], over a picture that fills a rectangle: left, top, right, bottom \[drawn px\].
pub(super) fn figure_over(
    path: &Path,
    shown: (u32, u32),
    (picture, frame): (&Raster, (i32, i32, i32, i32)),
    draw: impl FnOnce(&Sheet),
) -> Result<()> {
    let png = STANDARD.encode(picture.png().map_err(|e| Error::io(path, e))?);
    figure(path, shown, |sheet| {
        sheet.image(&png, frame);
        draw(sheet);
    })
}

/// A figure that says why it is empty.
pub(crate) fn no_data(path: &Path, shown: (u32, u32), title: &str, reason: &str) -> Result<()> {
    figure(path, shown, |sheet| {
        heading(sheet, title);
        let middle = (0.5 * sheet.width(), 0.5 * sheet.height());
        write_text(sheet, &format!("no data: {reason}"), middle, LABEL + 5.0, GREY, (HPos::Center, VPos::Center));
    })
}

/// The title of a figure, smaller where it is too long for the sheet.
pub(crate) fn heading(sheet: &Sheet, text: &str) {
    let longest = (sheet.width() - 80.0) / (0.56 * text.chars().count() as f64);
    write_text(sheet, text, (40, 26), TITLE.min(longest), INK, (HPos::Left, VPos::Top));
}

/// Text at a place.
pub(crate) fn write_text<'a>(
    sheet: &Sheet,
    text: &str,
    at: (impl Into<f64>, impl Into<f64>),
    size: f64,
    paint: impl Into<Paint<'a>>,
    place: (HPos, VPos),
) {
    sheet.text(text, (at.0.into(), at.1.into()), &Letters { size, paint: paint.into(), place, upright: false });
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

/// Text that can be read on any background: in `colour`, with an outline of ink.
pub(super) fn write_over(sheet: &Sheet, text: &str, (x, y): Place, colour: Colour, place: (HPos, VPos)) {
    for (dx, dy) in
        [(-3.0, 0.0), (3.0, 0.0), (0.0, -3.0), (0.0, 3.0), (-2.0, -2.0), (2.0, -2.0), (-2.0, 2.0), (2.0, 2.0)]
    {
        write_text(sheet, text, (x + dx, y + dy), LABEL, INK, place);
    }
    write_text(sheet, text, (x, y), LABEL, colour, place);
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

/// Radius of a mark.
pub(super) fn mark_radius(sheet: &Sheet) -> f64 {
    if sheet.on_page() { 3.6 } else { 7.0 }
}

/// Draws one mark.
pub(crate) fn draw_mark<'a>(
    sheet: &Sheet,
    mark: Mark,
    at: (impl Into<f64>, impl Into<f64>),
    paint: impl Into<Paint<'a>>,
) {
    tipped_mark(sheet, mark, (at.0.into(), at.1.into()), paint.into(), &Style::default());
}

/// Draws one mark; on a page with the tip and the property of `extra`.
pub(super) fn tipped_mark(sheet: &Sheet, mark: Mark, (x, y): Place, paint: Paint, extra: &Style) {
    let r = mark_radius(sheet);
    let k = r / 7.0;
    let at = |dx: f64, dy: f64| (x + k * dx, y + k * dy);
    let full = || extra.clone().fill(paint.colour).class("point", paint.class);
    let stroke = |width: f64| extra.clone().stroke(paint.colour, width).class("point", paint.class);
    let arrow = || Style::line(paint.colour, 3).class("limit", paint.class);
    let polygon = |corners: &[Place]| sheet.polygon(&corners.iter().map(|c| at(c.0, c.1)).collect::<Vec<_>>(), &full());
    match mark {
        Mark::Full => sheet.circle((x, y), r, &full()),
        Mark::Dot => sheet.circle((x, y), 5.0 * k, &full().opacity(0.7)),
        // white inside, so that its error bar does not cross it out
        Mark::Open => sheet.circle((x, y), r, &stroke(3.0).fill(WHITE)),
        Mark::Swatch => sheet.rect(at(-20.0, -14.0), at(20.0, 14.0), &full()),
        // on a page the whole of a mark answers to the pointer, and its class says that it is crossed out
        Mark::Cross if sheet.on_page() => sheet.circle((x, y), r, &full()),
        Mark::Cross => {
            sheet.path(&[at(-7.0, -7.0), at(7.0, 7.0)], &stroke(3.0));
            sheet.path(&[at(-7.0, 7.0), at(7.0, -7.0)], &stroke(3.0));
        }
        Mark::Square => polygon(&[(-7.0, -7.0), (7.0, -7.0), (7.0, 7.0), (-7.0, 7.0)]),
        Mark::Diamond => polygon(&[(0.0, -10.0), (10.0, 0.0), (0.0, 10.0), (-10.0, 0.0)]),
        Mark::Up => polygon(&[(0.0, -9.0), (8.0, 7.0), (-8.0, 7.0)]),
        Mark::Down => polygon(&[(0.0, 9.0), (8.0, -7.0), (-8.0, -7.0)]),
        Mark::Limit => {
            let extra = extra.clone().stroke(paint.colour, 3.0).class("limit", paint.class);
            let head = [at(-7.0, 22.0), at(0.0, 33.0), at(7.0, 22.0)];
            sheet.path(&[at(-7.0, 0.0), at(7.0, 0.0), at(0.0, 0.0), at(0.0, 33.0), head[0], head[1], head[2]], &extra);
        }
        Mark::AtLeast => {
            sheet.path(&[at(0.0, -7.0), at(0.0, -35.0), at(-7.0, -24.0), at(0.0, -35.0), at(7.0, -24.0)], &arrow());
            tipped_mark(sheet, Mark::Open, (x, y), paint, extra);
        }
        Mark::Line(width) => {
            let style = Style::line(paint.colour, width).class("line", paint.class);
            sheet.path(&[at(-20.0, 0.0), at(20.0, 0.0)], &style);
        }
        Mark::Band => {
            let style = Style::filled(paint.colour).opacity(0.2).class("band", paint.class);
            sheet.rect(at(-20.0, -9.0), at(20.0, 9.0), &style);
        }
    }
}

/// Lines of a legend, each with its mark; one without a mark is a plain line of text.
pub(crate) type Legend = Vec<(Option<(Mark, Colour)>, String)>;

/// Writes legend lines downwards from `at`.
pub(crate) fn legend(sheet: &Sheet, at: (i32, i32), entries: &[(Option<(Mark, Colour)>, String)]) {
    for (i, (mark, text)) in entries.iter().enumerate() {
        let y = at.1 + 42 * i as i32;
        if let Some((mark, colour)) = mark {
            // An arrow leaves its point; shift it so that it stands in its line.
            let lift = match mark {
                Mark::Limit => 16,
                Mark::AtLeast => -10,
                _ => 0,
            };
            draw_mark(sheet, *mark, (at.0 + 20, y - lift), *colour);
        }
        let indent = if mark.is_some() { 54 } else { 0 };
        write_text(sheet, text, (at.0 + indent, y), SMALL, INK, (HPos::Left, VPos::Center));
    }
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
