//! Radiance images to look at: PNG with a scale bar and a north arrow, alone, light by light, or as a strip of a pass.
//!
//! Grey levels by an inverse hyperbolic sine over the brightest pixel, so that a thousandth of it can still be seen;
//! bars in metres and arcseconds; captions that are too long go on in the next line. Not included: colour, and anything
//! to be measured from a picture.

use std::path::Path;

use ndarray::Array2;
use png::{BitDepth, ColorType, Compression, Encoder};

use super::font;
use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;

/// The brightest pixel over the radiance at which the stretch turns from linear to logarithmic.
const DEPTH: f64 = 300.0;
/// Grey of the background, of marks, of text.
const BACKGROUND: u8 = 12;
const INK: u8 = 225;
/// Dots between tiles.
const GAP: usize = 6;
/// Room of the compass next to the captions: lines, and dots for letters of single size.
const COMPASS_LINES: usize = 3;
const COMPASS_DOTS: usize = 32;
/// Smallest side of a picture that stands alone \[dots\].
const ALONE: usize = 512;
/// Letters a line of captions has room for at least: a smaller picture gets a wider place.
const LEAST_LETTERS: usize = 26;
/// Size of the letters of a title.
const TITLE: usize = 2;

/// One picture of a sheet.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Radiance \[W m⁻² sr⁻¹\], first row south, first column east.
    pub radiance: Array2<f64>,
    /// Lines under the picture.
    pub captions: Vec<String>,
    /// Side of a pixel at the satellite \[m\].
    pub pixel_m: f64,
    /// Side of a pixel \[arcsec\].
    pub pixel_arcsec: f64,
    /// Radiance shown white \[W m⁻² sr⁻¹\]; `None` = the brightest pixel.
    pub white: Option<f64>,
}

/// Grey levels, row by row from the top.
struct Sheet {
    width: usize,
    height: usize,
    levels: Vec<u8>,
}

/// Writes one picture alone, magnified to at least 512 dots.
///
/// # Errors
/// [`Error::Io`].
pub fn write_preview(path: &Path, tile: &Tile) -> Result<()> {
    write_sheet(path, "", std::slice::from_ref(tile), 1)
}

/// Writes pictures side by side, `columns` in a row, under a title.
///
/// # Errors
/// [`Error::Io`]; [`Error::Model`] for no picture at all.
pub fn write_sheet(path: &Path, title: &str, tiles: &[Tile], columns: usize) -> Result<()> {
    let Some(first) = tiles.first() else {
        return Err(Error::Model { problem: "no picture to draw".into() });
    };
    let columns = columns.clamp(1, tiles.len());
    let rows = tiles.len().div_ceil(columns);
    let (ny, nx) = first.radiance.dim();
    let zoom = if tiles.len() == 1 { ALONE.div_ceil(nx.max(1)) } else { 1 };
    let letter = if nx * zoom >= 380 { 2 } else { 1 };
    let line = (font::HEIGHT + 3) * letter;
    // under each picture its scale bar, then its captions, and next to them the compass
    let step = (font::WIDTH + 1) * letter;
    let wide = (nx * zoom).max(LEAST_LETTERS * step + COMPASS_DOTS * letter);
    let room = (wide - COMPASS_DOTS * letter) / step;
    let captions: Vec<Vec<String>> =
        tiles.iter().map(|t| t.captions.iter().flat_map(|c| wrapped(c, room)).collect()).collect();
    let lines = (1 + captions.iter().map(Vec::len).max().unwrap_or(0)).max(COMPASS_LINES);
    let (cell_w, cell_h) = (wide + GAP, ny * zoom + lines * line + GAP);
    let head = if title.is_empty() { GAP } else { TITLE * (font::HEIGHT + 3) + GAP };
    let width = (columns * cell_w + GAP).max(2 * GAP + title.chars().count() * TITLE * (font::WIDTH + 1));
    let mut sheet = Sheet::new(width, rows * cell_h + head);
    sheet.text(GAP, GAP, title, TITLE);
    for (k, (tile, captions)) in tiles.iter().zip(&captions).enumerate() {
        let (x0, y0) = (GAP + (k % columns) * cell_w, head + (k / columns) * cell_h);
        sheet.tile(x0, y0, tile, zoom, letter, wide);
        for (row, caption) in captions.iter().enumerate() {
            sheet.text(x0, y0 + ny * zoom + 3 + (1 + row) * line, caption, letter);
        }
    }
    let bytes = sheet.png().map_err(|e| Error::io(path, e))?;
    write_atomic(path, &bytes)
}

impl Sheet {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, levels: vec![BACKGROUND; width * height] }
    }

    fn dot(&mut self, x: usize, y: usize, level: u8) {
        if x < self.width && y < self.height {
            self.levels[y * self.width + x] = level;
        }
    }

    fn fill(&mut self, (x, y): (usize, usize), (w, h): (usize, usize), level: u8) {
        (y..y + h).for_each(|y| (x..x + w).for_each(|x| self.dot(x, y, level)));
    }

    fn text(&mut self, x: usize, y: usize, text: &str, size: usize) {
        for (k, c) in text.chars().enumerate() {
            for (column, bits) in font::columns(c).into_iter().enumerate() {
                for row in (0..font::HEIGHT).filter(|row| bits >> row & 1 == 1) {
                    let at = (x + (k * (font::WIDTH + 1) + column) * size, y + row * size);
                    self.fill(at, (size, size), INK);
                }
            }
        }
    }

    /// A picture, its first row at the bottom, with scale bar and compass below, where they cover nothing.
    fn tile(&mut self, x0: usize, y0: usize, tile: &Tile, zoom: usize, letter: usize, wide: usize) {
        let (ny, nx) = tile.radiance.dim();
        let brightest = tile.radiance.iter().copied().fold(0.0, f64::max);
        let white = tile.white.unwrap_or(brightest);
        for ((y, x), radiance) in tile.radiance.indexed_iter() {
            let level = if white > 0.0 { stretch(radiance / white) } else { 0 };
            self.fill((x0 + x * zoom, y0 + (ny - 1 - y) * zoom), (zoom, zoom), level);
        }
        let height = ny * zoom;
        let thick = letter;
        // a bar of about a fifth of the width, 1, 2 or 5 times a power of ten
        let length_m = round_down(0.25 * nx as f64 * tile.pixel_m);
        let dots = (length_m / tile.pixel_m * zoom as f64).round() as usize;
        let label = format!("{length_m} m = {}\"", three_digits(length_m / tile.pixel_m * tile.pixel_arcsec));
        let base = y0 + height + 3 + 3 * letter;
        self.fill((x0, base), (dots.max(1), thick), INK);
        self.fill((x0, base - 2 * letter), (thick, 5 * letter), INK);
        self.fill((x0 + dots, base - 2 * letter), (thick, 5 * letter), INK);
        self.text(x0 + dots + 6 * letter, base - 3 * letter, &label, letter);
        // north up, east left
        let arm = 14 * letter;
        let (cx, cy) = (x0 + wide.saturating_sub(4 * letter), y0 + height + 3 + arm + (font::HEIGHT + 2) * letter);
        self.fill((cx, cy - arm), (thick, arm), INK);
        self.fill((cx - arm, cy), (arm + thick, thick), INK);
        for k in 0..3 * letter {
            self.fill((cx.saturating_sub(k / 2), cy - arm + k), (2 * (k / 2) + thick, 1), INK);
            self.fill((cx - arm + k, cy.saturating_sub(k / 2)), (1, 2 * (k / 2) + thick), INK);
        }
        self.text(cx.saturating_sub(2 * letter), (cy - arm).saturating_sub((font::HEIGHT + 2) * letter), "N", letter);
        self.text((cx - arm).saturating_sub(8 * letter), cy.saturating_sub(3 * letter), "E", letter);
    }

    fn png(&self) -> std::io::Result<Vec<u8>> {
        let side = |n: usize| u32::try_from(n).unwrap_or(0);
        let mut file = Vec::new();
        let mut encoder = Encoder::new(&mut file, side(self.width), side(self.height));
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Balanced);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.levels)?;
        writer.finish()?;
        Ok(file)
    }
}

/// Grey of a radiance relative to white: `asinh(DEPTH x)/asinh(DEPTH)`; black for nothing, white for a NaN.
fn stretch(x: f64) -> u8 {
    if x.is_nan() {
        return 255;
    }
    (255.0 * (DEPTH * x.max(0.0)).asinh() / DEPTH.asinh()).min(255.0).round() as u8
}

/// A line on as many as it takes, broken between words; a word longer than a line is broken anywhere.
fn wrapped(text: &str, room: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let letters: Vec<char> = word.chars().collect();
        match lines.last_mut().filter(|line| line.chars().count() + 1 + letters.len() <= room) {
            Some(line) => *line = format!("{line} {word}"),
            None => lines.extend(letters.chunks(room.max(1)).map(|piece| piece.iter().collect::<String>())),
        }
    }
    lines
}

/// The largest of 1, 2, 5 times a power of ten that is not above a length.
fn round_down(length: f64) -> f64 {
    if !(length > 0.0 && length.is_finite()) {
        return 1.0;
    }
    let decade = 10_f64.powf(length.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|f| f * decade).find(|l| *l <= length * (1.0 + 1e-12)).unwrap_or(decade)
}

fn three_digits(x: f64) -> String {
    let decimals = (2.0 - x.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{x:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_round_and_not_longer_than_the_room() {
        for (room, bar) in [(27.3, 20.0), (50.0, 50.0), (9.99, 5.0), (0.13, 0.1), (1.0, 1.0)] {
            assert!((round_down(room) / bar - 1.0).abs() < 1e-12, "{room}");
        }
        assert_eq!(three_digits(5.507), "5.51");
        assert_eq!(three_digits(123.4), "123");
    }

    #[test]
    fn captions_lose_no_letter_in_a_small_picture() {
        let text = "V 4.21  650 km, altitude 32.1 deg averyveryverylongwordthatfitsnowhere";
        for room in [1, 7, 12, 26, 200] {
            let lines = wrapped(text, room);
            assert!(lines.iter().all(|l| l.chars().count() <= room), "{room}: {lines:?}");
            let all = |t: &str| t.chars().filter(|c| !c.is_whitespace()).collect::<String>();
            assert_eq!(all(&lines.concat()), all(text));
        }
        assert_eq!(wrapped("lit  by two", 7), ["lit by", "two"]);
        assert!(wrapped("", 7).is_empty());
    }

    #[test]
    fn the_stretch_rises_from_black_to_white_and_shows_a_thousandth() {
        assert_eq!((stretch(0.0), stretch(1.0), stretch(7.0), stretch(f64::NAN)), (0, 255, 255, 255));
        assert!(stretch(1e-3) > 8);
    }

    #[test]
    fn north_is_up_and_east_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let mut radiance = Array2::zeros((64, 64));
        radiance[[63, 0]] = 1.0; // north east
        let tile = Tile { radiance, captions: vec!["a".into()], pixel_m: 0.5, pixel_arcsec: 0.1, white: None };
        write_preview(&path, &tile).unwrap();
        let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!(bytes[GAP * info.width as usize + GAP], 255);
    }
}
