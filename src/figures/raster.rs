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

    /// The colour of a pixel (column, row from the top); black beyond the picture.
    pub fn at(&self, column: usize, row: usize) -> (u8, u8, u8) {
        let start = 3 * (row * self.width + column);
        match self.rgb.get(start..start + 3) {
            Some([r, g, b]) if column < self.width => (*r, *g, *b),
            _ => (0, 0, 0),
        }
    }

    /// A straight line between two places (from the left, from the top) \[px\], `width` pixels thick; what lies beyond
    /// the picture is excluded.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), (r, g, b): (u8, u8, u8), width: usize) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().clamp(1.0, 1e5) as usize;
        let half = 0.5 * (width as f64 - 1.0);
        for k in 0..=steps {
            let t = k as f64 / steps as f64;
            let corner = |a: f64, b: f64| (a + t * (b - a) - half).floor() as i64;
            let (x0, y0) = (corner(from.0, to.0), corner(from.1, to.1));
            for (x, y) in (0..width as i64).flat_map(|i| (0..width as i64).map(move |j| (x0 + i, y0 + j))) {
                if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                    && x < self.width
                    && y < self.height
                {
                    let start = 3 * (y * self.width + x);
                    self.rgb[start..start + 3].copy_from_slice(&[r, g, b]);
                }
            }
        }
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
