//! Skies of one satellite through a day as small discs side by side, one scale of magnitudes for all, Sun and Moon marked.
//!
//! Zenith in the middle, North up and East left in every one; a row of discs per day.

use std::path::Path;

use super::canvas::{
    HPos, INK, LABEL, Mark, ORANGE, SMALL, VPos, figure, heading, legend, no_data, signed, write_text,
};
use super::sky_map::{Cells, Disc, Levels, SkyMark};
use crate::base::error::Result;
use crate::tables::SkyRow;

/// Side of the square of one disc, and the room above the first row \[drawn px\].
const SQUARE: i32 = 560;
const ABOVE: i32 = 140;
/// Two lines of text over a disc \[drawn px\].
const TEXT: i32 = 90;
/// Most discs in a row: more, and their texts cannot be read in print.
const ACROSS: usize = 3;
/// Room for the colour bar \[drawn px\].
const BAR: i32 = 300;

/// One sky of a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyPanel {
    /// What is written over it.
    pub label: String,
    /// Its rows, altitude running fastest.
    pub rows: Vec<SkyRow>,
    /// Sun and Moon.
    pub marks: Vec<SkyMark>,
}

/// Draws skies, `across` in a row, three at most.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn sky_sequence(path: &Path, panels: &[SkyPanel], across: usize, title: &str) -> Result<()> {
    sky_sequence_on(path, panels, panels, across, title)
}

/// As [`sky_sequence`], in the colours that suit all skies of `scale`, so that several sheets can be compared.
///
/// # Errors
/// As [`sky_sequence`].
pub fn sky_sequence_on(path: &Path, panels: &[SkyPanel], scale: &[SkyPanel], across: usize, title: &str) -> Result<()> {
    let across = across.clamp(1, ACROSS.min(panels.len().max(1)));
    let down = panels.len().div_ceil(across).max(1) as i32;
    let width = (40 + SQUARE * across as i32 + BAR).max(1240);
    let size = (width as u32 / 2, ((ABOVE + (SQUARE + TEXT) * down).max(1400)) as u32 / 2);
    let Some(levels) = Levels::of(scale.iter().flat_map(|p| &p.rows)) else {
        return no_data(path, size, title, "no direction at any moment in which the satellite has any light");
    };
    figure(path, size, |sheet| {
        heading(sheet, title);
        let mut dark = false;
        for (i, panel) in panels.iter().enumerate() {
            let (column, row) = ((i % across) as i32, (i / across) as i32);
            let (left, top) = (30 + SQUARE * column, ABOVE + (SQUARE + TEXT) * row);
            let disc = Disc {
                centre: (f64::from(left + SQUARE / 2), f64::from(top + TEXT + SQUARE / 2 - 20)),
                radius: f64::from(SQUARE) * 0.40,
                unit: 1.0,
                degrees: false,
                names: false,
            };
            let middle = left + SQUARE / 2;
            write_text(sheet, &panel.label, (middle, top), LABEL, INK, (HPos::Center, VPos::Center));
            let light_sources: Vec<String> =
                panel.marks.iter().map(|m| format!("{} {:.0}°", m.name, m.alt_deg)).collect();
            let light_sources = signed(&light_sources.join(", "));
            write_text(sheet, &light_sources, (middle, top + 42), SMALL, INK, (HPos::Center, VPos::Center));
            let cells = Cells::of(&panel.rows, &levels);
            disc.sky(sheet, &cells, &levels, &panel.marks, &[]);
            dark |= cells.level.contains(&None);
        }
        let aside = 60 + SQUARE * across as i32;
        levels.bar(sheet, aside, dark);
        let entries = [
            (Some((Mark::Full, ORANGE)), "Sun".to_string()),
            (Some((Mark::Open, INK)), "Moon".to_string()),
            (None, "outside the edge:".to_string()),
            (None, "below the horizon".to_string()),
            (None, "N up, E left".to_string()),
        ];
        legend(sheet, (aside, 1140), &entries)
    })
}
