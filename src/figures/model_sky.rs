//! A pass in time and over the sky, one row for each reading of the model: magnitudes against time with every light, and
//! the model in every direction with the pass on it.
//!
//! All rows share one axis of magnitudes, one scale of colours for magnitudes and one for altitudes.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    GREY, HPos, INK, LABEL, Legend, Mark, SMALL, Sheet, Style, VPos, WHITE, draw_mark, figure, heading, no_data,
    write_text,
};
use super::light_curve::{LIGHTS, altitude_colour};
use super::panel::{Panel, Ticks};
use super::sky_map::{Cells, Disc, Levels, SkyMark};
use crate::base::error::Result;
use crate::tables::{PhotometryRow, SkyRow};

/// Height of a row, and what is above the first one \[drawn px\].
const ROW: i32 = 740;
const ABOVE: i32 = 150;
/// Lights more than this below the faintest total are not drawn \[mag\].
const LIGHTS_BELOW_MAG: f64 = 3.0;

/// One reading of the model.
#[derive(Debug, Clone)]
pub struct ModelSky {
    /// Above its row.
    pub label: String,
    /// The pass, moment by moment.
    pub pass: Vec<PhotometryRow>,
    /// The sky at its culmination, altitude running fastest.
    pub sky: Vec<SkyRow>,
    /// Sun and Moon there.
    pub marks: Vec<SkyMark>,
}

/// Draws the readings below each other.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn model_sky(path: &Path, title: &str, readings: &[ModelSky]) -> Result<()> {
    let size = (960, (ABOVE + ROW * readings.len().max(1) as i32 + 30) as u32 / 2);
    let passes = || readings.iter().flat_map(|r| &r.pass);
    let midnight = passes().filter_map(|r| r.mjd_mid_d).fold(f64::INFINITY, f64::min).floor();
    let second = |r: &PhotometryRow| (r.mjd_mid_d.unwrap_or(f64::NAN) - midnight) * 86_400.0;
    let faintest = passes().filter_map(|r| r.model_v_mag).fold(f64::NEG_INFINITY, f64::max) + LIGHTS_BELOW_MAG;
    let lights = passes().flat_map(|r| LIGHTS.iter().filter_map(|light| light.2(r))).filter(|v| *v <= faintest);
    let y = Span::around(passes().filter_map(|r| r.model_v_mag).chain(lights), 1.0).map(Span::reversed);
    let levels = Levels::of(readings.iter().flat_map(|r| &r.sky));
    let (Some(x), Some(y), Some(levels)) = (Span::around(passes().map(second), 10.0), y, levels) else {
        return no_data(path, size, title, "no moment of the pass has any light");
    };
    let day: String = passes().next().map(|r| r.date_mid.chars().take(10).collect()).unwrap_or_default();
    figure(path, size, |sheet| {
        heading(sheet, title);
        let mut legend: Legend = vec![(Some((Mark::Line(7), GREY)), "all lights".into())];
        let mut dark = false;
        for (k, reading) in readings.iter().enumerate() {
            let top = ABOVE + ROW * k as i32;
            write_text(sheet, &reading.label, (150, top - 34), LABEL, INK, (HPos::Left, VPos::Center));
            let panel = Panel { sheet, frame: (150, top, 860, top + ROW - 150), x, y };
            panel.axes(Ticks::Clock, &format!("UTC {day}"), "V [mag]");
            let line = |of: fn(&PhotometryRow) -> Option<f64>| -> Vec<(f64, Option<f64>)> {
                reading.pass.iter().map(|r| (second(r), of(r))).collect()
            };
            panel.polyline(&line(|r| r.model_v_mag), GREY, 7);
            for (name, paint, of) in LIGHTS {
                let line = line(of);
                if line.iter().any(|(_, v)| v.is_some_and(|v| y.holds(v))) {
                    panel.polyline(&line, paint, 3);
                    if legend.iter().all(|(_, named)| named != name) {
                        legend.push((Some((Mark::Line(3), paint.colour)), name.into()));
                    }
                }
            }
            for row in reading.pass.iter().step_by((reading.pass.len() / 40).max(1)) {
                if let (Some(v), Some(alt_deg)) = (row.model_v_mag, row.alt_deg) {
                    panel.mark(Mark::Full, second(row), v, altitude_colour(alt_deg));
                }
            }
            dark |= sky(sheet, reading, &levels, top);
        }
        levels.bar(sheet, 1_660, dark);
        altitudes(sheet, (1_660, 1_110, 1_720, 1_490));
        let y = ABOVE + ROW * readings.len() as i32 - 10;
        for (i, (mark, text)) in legend.iter().enumerate() {
            let at = 170 + 330 * i as i32;
            if let Some((mark, colour)) = mark {
                draw_mark(sheet, *mark, (at, y), *colour);
            }
            write_text(sheet, text, (at + 34, y), SMALL, INK, (HPos::Left, VPos::Center));
        }
    })
}

/// The sky of one reading with the pass on it; whether a part of it has no light.
fn sky(sheet: &Sheet, reading: &ModelSky, levels: &Levels, top: i32) -> bool {
    let disc =
        Disc { centre: (1_260.0, f64::from(top) + 295.0), radius: 275.0, unit: 0.9, degrees: false, names: true };
    let cells = Cells::of(&reading.sky, levels);
    let seen = |r: &PhotometryRow| Some((disc.place(r.alt_deg?.clamp(0.0, 90.0), r.az_deg?), r.model_v_mag?));
    let way: Vec<_> = reading.pass.iter().filter_map(seen).collect();
    let places: Vec<_> = way.iter().map(|w| w.0).collect();
    disc.sky(sheet, &cells, levels, &reading.marks, &places);
    sheet.path(&places, &Style::line(WHITE, 9));
    for (at, v_mag) in way.iter().step_by((way.len() / 24).max(1)) {
        sheet.circle(*at, 9, &Style::line(WHITE, 3).fill(levels.colour(levels.number(*v_mag))));
    }
    cells.level.contains(&None)
}

/// The colour bar of altitudes.
fn altitudes(sheet: &Sheet, (left, top, right, bottom): (i32, i32, i32, i32)) {
    let left_centre = (HPos::Left, VPos::Center);
    write_text(sheet, "altitude [deg]", (left, top - 50), LABEL, INK, left_centre);
    let at = |alt_deg: i32| bottom - (bottom - top) * alt_deg / 90;
    for alt_deg in 0..90 {
        let colour = altitude_colour(f64::from(alt_deg) + 0.5);
        // a little under the one above, so that no seam shows
        sheet.rect((left, at(alt_deg)), (right, (at(alt_deg + 1) - 1).max(top)), &Style::filled(colour));
    }
    sheet.rect((left, top), (right, bottom), &Style::line(INK, 2));
    for alt_deg in [0, 30, 60, 90] {
        write_text(sheet, &alt_deg.to_string(), (right + 16, at(alt_deg)), SMALL, INK, left_centre);
    }
}
