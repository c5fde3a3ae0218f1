//! A small picture of the target, for the gallery: grey levels, and a colour for every pixel that is not a measurement.
//!
//! Frame pixels, 0-based. One byte per pixel: few levels, so that the noise of the sky packs well. It does not cover
//! how the picture is cut and stretched, which needs the frame.

use png::{BitDepth, ColorType, Compression, Encoder, Filter};

/// Grey levels of a picture: black is 0, white `GREYS − 1`; more than the eye distinguishes.
pub const GREYS: u8 = 64;
/// A pixel that is NaN or masked by the flat.
pub const MASKED: u8 = GREYS;
/// A saturated pixel.
pub const SATURATED: u8 = GREYS + 1;
/// Outside the frame or the clip circle.
pub const OUTSIDE: u8 = GREYS + 2;
/// Colours of [`MASKED`], [`SATURATED`] and [`OUTSIDE`] (Wong 2011, Nat. Methods 8, 441, and a dark blue).
pub const MARKS_RGB: [[u8; 3]; 3] = [[204, 121, 167], [213, 94, 0], [24, 36, 58]];

/// A picture of part of a frame; rows from the bottom (y = `y0`) upwards.
#[derive(Debug, Clone, PartialEq)]
pub struct Thumb {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Frame pixels along a side of one of these pixels.
    pub bin: usize,
    /// Column of the frame at the left edge of the first pixel; negative where the picture reaches over the edge.
    pub x0: i64,
    /// Row of the frame at the lower edge of the first pixel.
    pub y0: i64,
    /// Where the target was looked for and not found: x, y and radius \[px\].
    pub search_px: Option<[f64; 3]>,
    /// Grey levels below [`GREYS`], or one of [`MASKED`], [`SATURATED`], [`OUTSIDE`]; row by row.
    pub levels: Vec<u8>,
}

impl Thumb {
    /// Side lengths in frame pixels.
    #[must_use]
    pub fn size_px(&self) -> (f64, f64) {
        ((self.width * self.bin) as f64, (self.height * self.bin) as f64)
    }

    /// The picture as a PNG file, top row first, with a palette: a pixel of the file is a pixel of the picture.
    ///
    /// # Errors
    /// Only for a picture without pixels.
    pub fn png(&self) -> std::io::Result<Vec<u8>> {
        let side = |n: usize| u32::try_from(n).unwrap_or(0);
        let mut file = Vec::new();
        let mut encoder = Encoder::new(&mut file, side(self.width), side(self.height));
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_palette(palette());
        encoder.set_compression(Compression::High);
        encoder.set_filter(Filter::NoFilter);
        let rows: Vec<u8> = self.levels.chunks(self.width.max(1)).rev().flatten().copied().collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&rows)?;
        writer.finish()?;
        Ok(file)
    }
}

/// Greys from black to white, then the three marks.
fn palette() -> Vec<u8> {
    let grey = |level: u8| (u16::from(level) * 255 / u16::from(GREYS - 1)) as u8;
    (0..GREYS).flat_map(|level| [grey(level); 3]).chain(MARKS_RGB.into_iter().flatten()).collect()
}
