//! Pictures side by side on one logarithmic scale of colours, with a colour bar for each row and scale bars in metres.
//!
//! Values above the floor of a row run from dark violet to yellow; what is at the floor or below it is as dark as the
//! sky. North is up, east to the left.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use ndarray::Array2;

use super::canvas::{
    Colour, HPos, INK, LABEL, SMALL, Sheet, Style, VPos, WHITE, figure, heading, no_data, signed, write_text,
};
use super::raster::Raster;
use super::viridis;
use crate::base::error::{Error, Result};

/// Pictures in a row.
const ACROSS: usize = 3;
/// Side of a picture, between pictures, left and above them \[drawn px\].
const SIDE: i32 = 500;
const GAP: i32 = 24;
const LEFT: i32 = 40;
const ABOVE: i32 = 170;
/// Height of a row with the texts of its pictures \[drawn px\].
const ROW: i32 = SIDE + 170;
/// Shown width \[px\].
const WIDTH: u32 = 960;

/// One picture of a row.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Above it.
    pub label: String,
    /// Below it.
    pub note: String,
    /// Its values, first row south, first column east.
    pub values: Array2<f64>,
    /// Side of a pixel at the target \[m\].
    pub pixel_m: f64,
}

/// Pictures on one scale.
#[derive(Debug, Clone)]
pub struct PictureRow {
    /// Up to three.
    pub pictures: Vec<Picture>,
    /// What the colours mean, and in which unit.
    pub quantity: String,
    pub unit: String,
    /// Values of the darkest and of the brightest colour, above 0.
    pub ends: (f64, f64),
}

/// Draws rows of pictures, each with a colour bar.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written.
pub fn pictures(path: &Path, title: &str, rows: &[PictureRow]) -> Result<()> {
    let height = (ABOVE + ROW * rows.len() as i32) as u32 / 2;
    if rows.iter().all(|row| row.pictures.is_empty()) {
        return no_data(path, (WIDTH, 320), title, "no picture");
    }
    let mut drawn = Vec::new();
    for row in rows {
        let of_row = row.pictures.iter().take(ACROSS).map(|p| raster(&p.values, row.ends).png());
        drawn.push(of_row.collect::<std::io::Result<Vec<_>>>().map_err(|e| Error::io(path, e))?);
    }
    figure(path, (WIDTH, height), |sheet| {
        heading(sheet, title);
        for (k, (row, pngs)) in rows.iter().zip(&drawn).enumerate() {
            let top = ABOVE + ROW * k as i32;
            for (i, (picture, png)) in row.pictures.iter().zip(pngs).enumerate() {
                let left = LEFT + (SIDE + GAP) * i as i32;
                sheet.image(&STANDARD.encode(png), (left, top, left + SIDE, top + SIDE));
                sheet.rect((left, top), (left + SIDE, top + SIDE), &Style::line(INK, 2));
                let middle = left + SIDE / 2;
                write_text(sheet, &picture.label, (middle, top - 14), LABEL, INK, (HPos::Center, VPos::Bottom));
                write_text(
                    sheet,
                    &signed(&picture.note),
                    (middle, top + SIDE + 14),
                    SMALL,
                    INK,
                    (HPos::Center, VPos::Top),
                );
                scale_bar(sheet, picture, (left, top));
            }
            bar(sheet, row, top);
        }
    })
}

/// The colours of the values, top row first.
fn raster(values: &Array2<f64>, ends: (f64, f64)) -> Raster {
    let (ny, nx) = values.dim();
    Raster::of((nx, ny), |column, row| colour(values[[ny - 1 - row, column]], ends))
}

/// Logarithmic between the ends.
fn colour(value: f64, (low, high): (f64, f64)) -> (u8, u8, u8) {
    let share = if value > low { (value / low).ln() / (high / low).ln() } else { 0.0 };
    viridis(share)
}

/// A round length of at most a third of the picture.
fn scale_bar(sheet: &Sheet, picture: &Picture, (left, top): (i32, i32)) {
    let metres_per_px = picture.pixel_m * picture.values.ncols() as f64 / f64::from(SIDE);
    let room_m = metres_per_px * f64::from(SIDE) / 3.0;
    if !(room_m > 0.0 && room_m.is_finite()) {
        return;
    }
    let decade = 10f64.powf(room_m.log10().floor());
    let length_m = [5.0, 2.0, 1.0].into_iter().map(|f| f * decade).find(|l| *l <= room_m).unwrap_or(decade);
    let (x, y) = (f64::from(left) + 20.0, f64::from(top + SIDE) - 24.0);
    sheet.line((x, y), (x + length_m / metres_per_px, y), &Style::line(WHITE, 5));
    write_text(sheet, &format!("{length_m} m"), (x, y - 12.0), SMALL, WHITE, (HPos::Left, VPos::Bottom));
}

/// The colour bar of a row, labelled at powers of ten.
fn bar(sheet: &Sheet, row: &PictureRow, top: i32) {
    let left = LEFT + (SIDE + GAP) * ACROSS as i32 + 10;
    let (right, from, to) = (left + 50, top + 40, top + SIDE);
    let left_centre = (HPos::Left, VPos::Center);
    write_text(sheet, &row.quantity, (left, top - 46), LABEL, INK, left_centre);
    write_text(sheet, &row.unit, (left, top - 6), LABEL, INK, left_centre);
    for y in (from..to).step_by(5) {
        let (r, g, b) = viridis(1.0 - f64::from(y - from) / f64::from(to - from));
        sheet.rect((left, y), (right, (y + 6).min(to)), &Style::filled(Colour(r, g, b)));
    }
    sheet.rect((left, from), (right, to), &Style::line(INK, 2));
    let (low, high) = (row.ends.0.log10(), row.ends.1.log10());
    for (value, named) in ticks(row.ends) {
        let y = f64::from(to) - f64::from(to - from) * (value.log10() - low) / (high - low);
        sheet.line((f64::from(right), y), (f64::from(right) + 8.0, y), &Style::line(INK, 2));
        if named {
            let text = if (0.9..2e4).contains(&value) { format!("{value:.0}") } else { format!("{value:.0e}") };
            write_text(sheet, &signed(&text), (f64::from(right) + 16.0, y), SMALL, INK, left_centre);
        }
    }
}

/// Values at which a bar is marked, and whether they are named: powers of ten, of few decades their double and fivefold
/// too, of many every other one.
fn ticks((low, high): (f64, f64)) -> Vec<(f64, bool)> {
    let decades = (high / low).log10();
    let factors: &[f64] = if decades < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let marks = powers.flat_map(|power| {
        let named = decades <= 7.0 || power % 2 == 0;
        factors.iter().map(move |factor| (factor * 10f64.powi(power), named))
    });
    marks.filter(|(value, _)| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_run_with_the_logarithm_and_what_is_below_the_floor_is_as_dark_as_the_floor() {
        let ends = (1e-6, 1e-2);
        assert_eq!(colour(1e-4, ends), viridis(0.5));
        assert_eq!(
            (colour(0.0, ends), colour(-3.0, ends), colour(1e-7, ends)),
            (viridis(0.0), viridis(0.0), viridis(0.0))
        );
        assert_eq!(colour(1.0, ends), viridis(1.0));
    }

    #[test]
    fn a_bar_is_marked_at_round_values_inside_its_ends() {
        let values = |ends| ticks(ends).iter().map(|t| format!("{:.0e}", t.0)).collect::<Vec<_>>();
        assert_eq!(values((10.4, 640.0)), ["2e1", "5e1", "1e2", "2e2", "5e2"]);
        assert_eq!(values((1e-7, 1e-3)), ["1e-7", "1e-6", "1e-5", "1e-4", "1e-3"]);
        assert_eq!(ticks((1e-6, 1e3)).iter().filter(|t| t.1).count(), 5);
    }
}
