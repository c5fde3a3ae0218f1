//! One panel as a drawing of its own: what a page shows as a chart, and a sheet of several lays side by side.
//!
//! On a page lengths are CSS pixels; in a file everything is twice as large, as files are.

use super::axis::Span;
use super::canvas::{Medium, Sheet};
use super::panel::{Panel, Ticks};

/// Room for labels: left, right, top, bottom.
const ON_PAGE: [i32; 4] = [66, 12, 8, 44];
const IN_FILE: [i32; 4] = [150, 24, 16, 104];

/// One panel with two axes.
pub(crate) struct Chart<'a> {
    /// Width and height \[CSS px\].
    pub size: (i32, i32),
    pub x: Span,
    pub y: Span,
    pub x_label: &'a str,
    pub y_label: &'a str,
    pub ticks: Ticks<'a>,
}

impl Chart<'_> {
    /// The chart: `shades` lie below the grid, `body` over it.
    pub(crate) fn draw(&self, medium: Medium, shades: impl FnOnce(&Panel), body: impl FnOnce(&Panel)) -> Sheet {
        let (scale, [left, right, top, bottom]) = match medium {
            Medium::Page => (1, ON_PAGE),
            Medium::File => (2, IN_FILE),
        };
        let (width, height) = (scale * self.size.0, scale * self.size.1);
        let sheet = Sheet::new(medium, (width, height));
        let frame = (left, top, width - right, height - bottom);
        let panel = Panel { sheet: &sheet, frame, x: self.x, y: self.y };
        shades(&panel);
        panel.axes(self.ticks, self.x_label, self.y_label);
        body(&panel);
        sheet
    }
}
