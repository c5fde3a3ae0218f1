//! Extremes of the pixels: skies from a thousandth of an electron to 10¹², ranges of 10¹⁰, frames of nothing.

use ndarray::Array2;

use super::super::simulated::frame_of;
use super::{Extreme, absolute, holds, or_wrong, refused, relative};
use crate::base::error::Result;
use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::aperture::{Shape, circle_sum};
use crate::photometry::background::background;
use crate::photometry::flux::{Flux, measure};

const AREA: &str = "pixels";
const SIDE: usize = 192;
/// Middle of the frame, off the lattice of pixels \[px\].
const MIDDLE: (f64, f64) = (95.3, 96.1);

fn frame(value: impl Fn(usize, usize) -> f64) -> Frame<Electrons> {
    let pixels = Array2::from_shape_fn((SIDE, SIDE), |(y, x)| value(x, y) as f32);
    frame_of(pixels)
}

/// Something like noise of unit scatter and no mean: the same for every pixel of the lattice of 7 × 5.
fn ripple(x: usize, y: usize) -> f64 {
    ((x % 7) as f64 - 3.0) / 2.0 * if (x / 7 + y).is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// A Gaussian star of `flux_e` and 4 px FWHM in the middle, at the centres of pixels.
fn star(flux_e: f64, x: usize, y: usize) -> f64 {
    let variance = (4.0f64 / 2.354_820_045).powi(2);
    let r2 = (x as f64 - MIDDLE.0).powi(2) + (y as f64 - MIDDLE.1).powi(2);
    flux_e / (std::f64::consts::TAU * variance) * (-0.5 * r2 / variance).exp()
}

fn flux(frame: &Frame<Electrons>) -> Result<Flux> {
    let sky = background(frame, 64, 3.0)?;
    Ok(measure(frame, &sky, MIDDLE.0, MIDDLE.1, Shape::Circle { r_px: 12.0 }, 20.0, 40.0, 3.0))
}

pub(super) fn cases() -> Vec<Extreme> {
    let mut all = Vec::new();
    for sky_e in [1e-3, 1.0, 1e5, 1e9, 1e12] {
        let case = format!("level of a sky of {sky_e:e} e-");
        // f32 pixels hold 1e12 to 6e4: the ripple is of that size there
        let scatter_e = 1e-3 * sky_e;
        let level = background(&frame(|x, y| sky_e + scatter_e * ripple(x, y)), 64, 3.0).map(|b| b.global_level());
        all.push(or_wrong(AREA, &case, level.map(|level| relative(AREA, &case, sky_e, level, 1e-5))));
    }
    for flux_e in [1e12, 1.0, 0.0, -1e4] {
        let case = format!("a star of {flux_e:e} e- on a sky of 100 e-");
        let got = flux(&frame(|x, y| 100.0 + star(flux_e, x, y)));
        all.push(or_wrong(
            AREA,
            &case,
            got.map(|f| {
                if flux_e > 0.0 {
                    relative(AREA, &case, flux_e, f.flux_e, 1e-5)
                } else {
                    absolute(AREA, &case, flux_e, f.flux_e, 1e-2)
                }
            }),
        ));
    }
    let negative = flux(&frame(|x, y| 100.0 + star(-1e4, x, y)));
    all.push(or_wrong(
        AREA,
        "a negative flux",
        negative.map(|f| {
            let flagged = f.flags.has(Flags::NEGATIVE) && f.flux_err_e.is_finite();
            holds(
                AREA,
                "a negative flux",
                "kept, with an error and its flag",
                flagged,
                format!("{:.1} +- {:.1} e-", f.flux_e, f.flux_err_e),
            )
        }),
    ));
    // a star of 1e5 e⁻ on a sky of 1e9: an f32 pixel holds such a level to 64 e⁻, and the flux is below its noise
    let lost = flux(&frame(|x, y| 1e9 + star(1e5, x, y)));
    all.push(or_wrong(
        AREA,
        "a faint star on a sky of 1e9 e-",
        lost.map(|f| {
            let noise_e = (1e9 * std::f64::consts::PI * 144.0f64).sqrt();
            let fine = (f.flux_e - 1e5).abs() < 3.0 * f.flux_err_e && f.flux_err_e > 0.9 * noise_e;
            let got = format!("{:.3e} +- {:.3e} e-", f.flux_e, f.flux_err_e);
            holds(AREA, "a star of 1e5 e- on a sky of 1e9 e-", "within its error, which is the sky's", fine, got)
        }),
    ));
    // single against double precision: the same field with every pixel rounded to f32
    let (x0, y0, r_px) = (95.3, 96.1, 12.0);
    let wide = Array2::from_shape_fn((SIDE, SIDE), |(y, x)| 100.0 + ripple(x, y) + star(1e6, x, y));
    let narrow = wide.mapv(|v| f64::from(v as f32));
    all.push(relative(
        AREA,
        "aperture sum of f32 pixels against f64",
        circle_sum(&wide, x0, y0, r_px),
        circle_sum(&narrow, x0, y0, r_px),
        1e-8,
    ));
    all.push(refused(AREA, "a frame of NaN", "good", background(&frame(|_, _| f64::NAN), 64, 3.0)));
    let one_level = background(&frame(|_, _| 7.0), 64, 3.0).map(|b| b.global_level());
    all.push(or_wrong(
        AREA,
        "a frame of one value",
        one_level.map(|l| absolute(AREA, "a frame of one value [e-]", 7.0, l, 0.0)),
    ));
    // one NaN in the annulus changes nothing else
    let holed = flux(&frame(|x, y| if (x, y) == (125, 96) { f64::NAN } else { 100.0 + star(1e5, x, y) }));
    all.push(or_wrong(
        AREA,
        "a NaN in the annulus",
        holed.map(|f| relative(AREA, "a NaN in the annulus [e-]", 1e5, f.flux_e, 1e-5)),
    ));
    // sums in f64: a field of 1 next to a pixel of 1e10, and the smallest numbers there are
    let mut field = Array2::from_elem((64, 64), 1.0);
    field[[32, 32]] = 1e10;
    let area = std::f64::consts::PI * 400.0;
    all.push(absolute(
        AREA,
        "aperture sum of 1 next to 1e10, less the 1e10",
        area - 1.0,
        circle_sum(&field, 32.0, 32.0, 20.0) - 1e10,
        1e-4,
    ));
    let tiny = Array2::from_elem((64, 64), 1e-310);
    all.push(relative(
        AREA,
        "aperture sum of subnormal numbers",
        area * 1e-310,
        circle_sum(&tiny, 31.7, 32.2, 20.0),
        1e-10,
    ));
    all.push(relative(
        AREA,
        "aperture of a millionth of a pixel",
        1e-12 * std::f64::consts::PI,
        circle_sum(&Array2::from_elem((8, 8), 1.0), 4.0, 4.0, 1e-6),
        1e-9,
    ));
    all
}
