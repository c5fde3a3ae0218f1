//! A small picture of the target cut out of its frame: what the gallery shows and the eye judges.
//!
//! Frame pixels and electrons in, grey levels out. The picture holds aperture, annulus and a margin about the place that
//! was measured, binned by whole pixels to at most [`SIDE`]; nothing is interpolated. It does not cover what is drawn
//! over it.

use std::ops::Range;

use crate::base::stats::{mad_sigma, median};
use crate::figures::Thumb;
use crate::figures::thumb::{GREYS, MASKED, OUTSIDE, SATURATED};
use crate::frames::{Electrons, Frame, mask};
use crate::tables::PhotometryRow;
use crate::tables::words::Status;

/// Largest side of a picture in its own pixels.
pub const SIDE: usize = 160;
/// Margin around the annulus, as a share of its radius.
const MARGIN: f64 = 0.08;
/// Black is this far below the sky \[σ of the picture\].
const BLACK_SIGMA: f64 = 3.0;
/// White is at least this far above the sky, so that an empty sky stays dark \[σ\].
const WHITE_SIGMA: f64 = 12.0;
/// Below this the stretch is linear, above it logarithmic \[σ\].
const SOFT_SIGMA: f64 = 3.0;

/// The part of a frame that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// First column and row \[px\]; may lie outside the frame.
    x0: i64,
    y0: i64,
    /// Pixels of the frame to one of the picture.
    bin: usize,
    /// Side of the picture.
    side: usize,
    /// Search circle (x, y, radius \[px\]) of a frame without a detection.
    search_px: Option<[f64; 3]>,
}

impl Extent {
    /// Columns and rows of the frame it covers, as far as they are not negative.
    #[must_use]
    pub fn px(&self) -> (Range<usize>, Range<usize>) {
        let along = |from: i64| {
            let px = |at: i64| usize::try_from(at).unwrap_or(0);
            px(from)..px(from + (self.side * self.bin) as i64)
        };
        (along(self.x0), along(self.y0))
    }
}

/// The window around the place measured, or of the search circle (x, y, radius \[px\]) of a frame without a detection,
/// on a frame of `full_size_px`; `None` without a place.
#[must_use]
pub fn extent(row: &PhotometryRow, full_size_px: (usize, usize), search_px: [f64; 3]) -> Option<Extent> {
    let (mut x, mut y) = (row.x_px?, row.y_px?);
    let axes = [row.aper_r_px, row.aper_a_px.map(|a| a.hypot(row.aper_b_px.unwrap_or(0.0))), row.sky_out_px];
    let mut reach = axes.into_iter().flatten().filter(|r| r.is_finite()).fold(4.0, f64::max);
    let missed = row.status == Status::Nondetection;
    if missed {
        reach = reach.max((x - search_px[0]).hypot(y - search_px[1]) + reach).max(search_px[2]);
        (x, y) = (search_px[0], search_px[1]);
    }
    // a search as large as the frame needs no more than the frame
    let (nx, ny) = full_size_px;
    let half = (reach * (1.0 + MARGIN) + 2.0).min(nx.max(ny) as f64);
    if !(x.abs() < 1e9 && y.abs() < 1e9 && half.is_finite()) {
        return None;
    }
    let bin = ((2.0 * half + 1.0) / SIDE as f64).ceil().max(1.0) as usize;
    let side = (((2.0 * half + 1.0) / bin as f64).ceil() as usize).clamp(1, SIDE);
    let corner = |centre: f64| (centre - (side * bin - 1) as f64 / 2.0).round() as i64;
    Some(Extent { x0: corner(x), y0: corner(y), bin, side, search_px: missed.then_some(search_px) })
}

/// The picture of that part of a frame, which holds it as far as there are pixels.
#[must_use]
pub fn cut(frame: &Frame<Electrons>, extent: &Extent) -> Thumb {
    let Extent { x0, y0, bin, side, search_px } = *extent;
    let cells: Vec<Cell> = (0..side * side)
        .map(|k| {
            let at = |first: i64, step: usize| first + (step * bin) as i64;
            Cell::of(frame, at(x0, k % side), at(y0, k / side), bin)
        })
        .collect();
    Thumb { width: side, height: side, bin, x0, y0, search_px, levels: stretched(&cells) }
}

/// What a pixel of the picture holds.
#[derive(Clone, Copy)]
enum Cell {
    /// Mean of the good pixels \[e⁻\].
    Light(f64),
    /// A mark.
    Mark(u8),
}

impl Cell {
    /// `bin` × `bin` pixels from (x, y). One saturated or bad pixel marks the whole cell: it must be seen.
    fn of(frame: &Frame<Electrons>, x: i64, y: i64, bin: usize) -> Self {
        let (ny, nx) = frame.pixels.dim();
        let inside = |at: i64, origin: usize, n: usize| {
            usize::try_from(at).ok().and_then(|at| at.checked_sub(origin)).filter(|at| *at < n)
        };
        let (mut sum, mut n, mut seen) = (0.0, 0usize, 0u8);
        for v in 0..bin as i64 {
            let Some(j) = inside(y + v, frame.origin_px.1, ny) else { continue };
            for u in 0..bin as i64 {
                let Some(i) = inside(x + u, frame.origin_px.0, nx) else { continue };
                let value = f64::from(frame.pixels[[j, i]]);
                let bits = frame.mask[[j, i]];
                seen |= bits;
                if bits == 0 && value.is_finite() {
                    sum += value;
                    n += 1;
                } else if bits == 0 {
                    seen |= mask::BAD;
                }
            }
        }
        if seen & mask::SATURATED != 0 {
            Cell::Mark(SATURATED)
        } else if n == 0 && (seen == 0 || seen & mask::CLIPPED != 0) {
            Cell::Mark(OUTSIDE)
        } else if seen & mask::BAD != 0 {
            Cell::Mark(MASKED)
        } else {
            Cell::Light(sum / n.max(1) as f64)
        }
    }
}

/// Grey levels: asinh of the height above the median in units of the robust scatter, from 3 σ below it to the brightest.
fn stretched(cells: &[Cell]) -> Vec<u8> {
    let light = |c: &Cell| if let Cell::Light(v) = c { Some(*v) } else { None };
    let mut values: Vec<f64> = cells.iter().filter_map(light).collect();
    let sky = median(&mut values).unwrap_or(0.0);
    let sigma = mad_sigma(&mut values).filter(|s| *s > 0.0).unwrap_or(1.0);
    let brightest = values.iter().map(|v| (v - sky) / sigma).fold(WHITE_SIGMA, f64::max);
    let bent = |z: f64| (z / SOFT_SIGMA).asinh();
    let (black, white) = (bent(-BLACK_SIGMA), bent(brightest));
    let grey = |v: f64| {
        let share = (bent((v - sky) / sigma) - black) / (white - black);
        (share * f64::from(GREYS - 1)).round().clamp(0.0, f64::from(GREYS - 1)) as u8
    };
    cells
        .iter()
        .map(|cell| match *cell {
            Cell::Light(v) => grey(v),
            Cell::Mark(mark) => mark,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use ndarray::Array2;

    use super::*;
    use crate::frames::{ElectronsPerAdu, Gain};

    fn frame(pixels: Array2<f32>) -> Frame<Electrons> {
        let gain = Gain {
            setting: None,
            e_per_adu: ElectronsPerAdu(1.0),
            source: String::new(),
            read_noise_e: 1.0,
            pedestal_adu: 0.0,
            saturation_adu: 65_535.0,
        };
        Frame::from_electrons(PathBuf::from("x.fits"), pixels, gain)
    }

    fn cutout(frame: &Frame<Electrons>, row: &PhotometryRow, search_px: [f64; 3]) -> Option<Thumb> {
        Some(cut(frame, &extent(row, frame.full_size_px, search_px)?))
    }

    fn row(x: f64, y: f64, r: f64) -> PhotometryRow {
        PhotometryRow {
            x_px: Some(x),
            y_px: Some(y),
            aper_r_px: Some(r),
            sky_out_px: Some(2.0 * r),
            status: "ok".into(),
            ..PhotometryRow::default()
        }
    }

    #[test]
    fn a_picture_is_centred_on_the_target_holds_its_annulus_and_marks_what_is_no_measurement() {
        let mut f = frame(Array2::from_shape_fn((100, 120), |(j, i)| ((7 * i + 13 * j) % 11) as f32));
        f.pixels[[40, 60]] = 500.0;
        f.pixels[[41, 60]] = f32::NAN;
        f.mask[[42, 60]] = mask::SATURATED;
        let t = cutout(&f, &row(60.0, 40.0, 10.0), [0.0; 3]).unwrap();
        assert_eq!((t.bin, t.width, t.height, t.search_px), (1, 49, 49, None));
        assert_eq!((t.x0, t.y0), (60 - 24, 40 - 24));
        let at = |x: i64, y: i64| t.levels[((y - t.y0) * t.width as i64 + x - t.x0) as usize];
        assert_eq!((at(60, 40), at(60, 41), at(60, 42)), (GREYS - 1, MASKED, SATURATED));
        // over the corner of the frame
        let t = cutout(&f, &row(0.0, 0.0, 10.0), [0.0; 3]).unwrap();
        assert_eq!((t.x0, t.levels[0], t.levels.len()), (-24, OUTSIDE, 49 * 49));
    }

    #[test]
    fn a_large_target_is_binned_and_one_bad_pixel_of_a_cell_is_still_seen() {
        let mut f = frame(Array2::from_elem((900, 900), 5.0));
        f.pixels[[451, 451]] = f32::NAN;
        let t = cutout(&f, &row(450.0, 450.0, 140.0), [0.0; 3]).unwrap();
        assert!(t.bin == 4 && t.width <= SIDE && (t.width * t.bin) as f64 >= 560.0 * 1.08, "{t:?}");
        assert_eq!(t.levels.iter().filter(|l| **l == MASKED).count(), 1);
    }

    #[test]
    fn a_frame_without_detection_shows_its_search_circle_but_never_more_than_the_frame() {
        let f = frame(Array2::from_elem((100, 100), 5.0));
        let missed = PhotometryRow { status: "nondetection".into(), ..row(50.0, 50.0, 4.0) };
        let t = cutout(&f, &missed, [50.0, 50.0, 30.0]).unwrap();
        assert_eq!(t.search_px, Some([50.0, 50.0, 30.0]));
        assert!(t.width >= 64 && t.width < 80);
        assert!(cutout(&f, &missed, [50.0, 50.0, 1e9]).unwrap().levels.len() <= SIDE * SIDE);
        assert!(cutout(&f, &PhotometryRow::default(), [50.0, 50.0, 30.0]).is_none());
        assert!(cutout(&f, &row(f64::NAN, 0.0, 5.0), [0.0; 3]).is_none());
    }
}
