//! A picture in colours: RGB pixels, top row first, as PNG.

use png::{BitDepth, ColorType, Compression, Encoder};

/// RGB pixels, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Three bytes a pixel.
    pub rgb: Vec<u8>,
}

impl Raster {
    /// A picture whose pixel (column, row from the top) has the colour given.
    pub fn of((width, height): (usize, usize), colour: impl Fn(usize, usize) -> (u8, u8, u8)) -> Self {
        let mut rgb = Vec::with_capacity(3 * width * height);
        for row in 0..height {
            for column in 0..width {
                let (r, g, b) = colour(column, row);
                rgb.extend([r, g, b]);
            }
        }
        Self { width, height, rgb }
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// Only for a picture without pixels.
    pub fn png(&self) -> std::io::Result<Vec<u8>> {
        let side = |n: usize| u32::try_from(n).unwrap_or(0);
        let mut file = Vec::new();
        let mut encoder = Encoder::new(&mut file, side(self.width), side(self.height));
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::High);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(file)
    }
}
