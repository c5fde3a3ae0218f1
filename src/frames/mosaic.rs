//! Whether the pixels of a colour sensor agree with the pattern that the header states.
//!
//! ADU. A Bayer pattern has two green pixels in each square of 2 × 2, on one diagonal, red and blue on the other. It does not
//! cover how superpixels are made of them ([`super::read`]).

use std::borrow::Cow;

use super::exposure::Exposure;
use super::read::Pixels;
use super::role::Role;
use crate::base::error::{Error, Result};
use crate::base::stats;
use crate::fits::Green;
use crate::fits::raw::guarded;

/// Side of the square in the middle of the frame that is looked at \[superpixels\].
const SIDE_PX: usize = 256;
/// Levels that differ by more than this are different \[σ\].
const SIGMA: f64 = 5.0;
/// Red, green and blue of a flat that agree within this share of it are no colours.
const NO_COLOUR_FRAC: f64 = 0.003;
/// √n times the relative error of a median: √(π/2).
const MEDIAN_ERR: f64 = 1.2533;

/// The frame with the pixels of the sensor instead of superpixels, and how many of them a superpixel is wide; any other frame as it is.
#[must_use]
pub fn sensor_pixels(exposure: &Exposure) -> (Cow<'_, Exposure>, usize) {
    if exposure.header.green().is_none() {
        return (Cow::Borrowed(exposure), 1);
    }
    let (nx, ny) = exposure.size_px;
    let header = exposure.header.with_green(None);
    (Cow::Owned(Exposure { header, size_px: (2 * nx, 2 * ny), ..exposure.clone() }), 2)
}

/// Checks that the pixels called green have one level, and that those of a flat are not all alike.
///
/// # Errors
/// [`Error::Config`] naming `detector.bayer_pattern`, where the pixels say otherwise; [`Error::Fits`] for a damaged file.
pub fn check_pattern(exposure: &Exposure, pedestal_adu: f64) -> Result<()> {
    let Some(green) = exposure.header.green() else { return Ok(()) };
    let (nx, ny) = (exposure.size_px.0.min(SIDE_PX), exposure.size_px.1.min(SIDE_PX));
    if nx * ny < 64 {
        return Ok(());
    }
    let (x0, y0) = ((exposure.size_px.0 - nx) / 2, (exposure.size_px.1 - ny) / 2);
    let mut raw = vec![0f32; 4 * nx * ny];
    guarded(&exposure.path, || {
        let header = exposure.header.with_green(None);
        Pixels::open(&exposure.path, &header)?.read((2 * x0, 2 * y0), (2 * nx, 2 * ny), &mut raw)
    })?;
    let lattice = |dx: usize, dy: usize| level(raw.chunks_exact(2 * nx).skip(dy).step_by(2), dx);
    let (same, mixed) = ([lattice(0, 0), lattice(1, 1)], [lattice(1, 0), lattice(0, 1)]);
    let (greens, others, another) = match green {
        Green::Same => (same, mixed, "RGGB"),
        Green::Mixed => (mixed, same, "GRBG"),
    };
    let apart = |[a, b]: [(f64, f64); 2]| ((a.0 - b.0).abs(), a.1.hypot(b.1));
    let ((greens_adu, err_adu), (others_adu, _)) = (apart(greens), apart(others));
    let refuse = |problem: String| Err(Error::Config { key: "detector.bayer_pattern".into(), problem });
    if greens_adu > SIGMA * err_adu && greens_adu > 2.0 * others_adu {
        return refuse(format!(
            "the pixels of {} that the header calls green differ by {greens_adu:.1} +- {err_adu:.1} ADU, the others by \
             {others_adu:.1}: the pattern starts at another pixel of the file; set detector.bayer_pattern = \"{another}\"",
            exposure.name
        ));
    }
    let light_adu = 0.5 * (greens[0].0 + greens[1].0) - pedestal_adu;
    let colour_adu = others.iter().map(|o| (o.0 - greens[0].0).abs()).fold(greens_adu, f64::max);
    if exposure.role == Role::Flat && colour_adu < (NO_COLOUR_FRAC * light_adu).max(SIGMA * err_adu) {
        return refuse(format!(
            "all pixels of the flat {} are alike ({colour_adu:.1} ADU apart at {light_adu:.0} ADU), so they have no colours, though the \
             header states a pattern; set detector.bayer_pattern = \"none\"",
            exposure.name
        ));
    }
    Ok(())
}

/// Median of every second pixel of some rows, from `dx` on, and its error \[ADU\].
fn level<'a>(rows: impl Iterator<Item = &'a [f32]>, dx: usize) -> (f64, f64) {
    let mut values: Vec<f64> = rows.flat_map(|row| row.iter().skip(dx).step_by(2)).map(|v| f64::from(*v)).collect();
    let n = values.len().max(1) as f64;
    let Some(median) = stats::median(&mut values) else { return (f64::NAN, f64::NAN) };
    let sigma = stats::mad_sigma(&mut values).unwrap_or(f64::NAN);
    // counts are whole numbers: half a step stays unknown however many pixels there are
    (median, (MEDIAN_ERR * sigma / n.sqrt()).max(0.5))
}
