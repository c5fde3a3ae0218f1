//! The sky of one annulus: a clipped, smoothed median, corrected for the skewness of Poisson counts.
//!
//! Electrons per pixel, full-frame pixels. It does not cover the aperture.

use super::clip::level_and_error;
use crate::base::stats;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::aperture::{Bounds, cells, for_each_ring_run};
use crate::photometry::background::Background;
use crate::photometry::clip::{Scratch, clipped_location};

/// Fewest annulus pixels of a sky; below, the background mesh is used.
const MIN_SKY_PX: usize = 16;
/// Share of clipped annulus pixels beyond what noise explains, from which the annulus is called crowded.
const CROWDED_FRAC: f64 = 0.02;
/// Where the light of neighbours covers more than this share of an annulus, all of it is the sky, which is then flagged as crowded.
const MOST_COVERED: f64 = 0.7;
/// Pixels copied at once.
const BLOCK: usize = 8;
/// Bytes that memory hands over at once.
const LINE_BYTES: usize = 64;

/// The sky of one annulus.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sky {
    pub level_e: f64,
    pub err_e: f64,
    pub rms_e: f64,
    /// Pixels kept.
    pub n: usize,
    pub flags: Flags,
}

/// A star whose light is kept out of the annuli of others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Column \[px\].
    pub x_px: f64,
    /// Row \[px\].
    pub y_px: f64,
    /// Its light reaches this far \[px\].
    pub r_px: f64,
}

impl Neighbour {
    fn covers(&self, i: usize, j: usize) -> bool {
        let (dx, dy) = (i as f64 - self.x_px, j as f64 - self.y_px);
        dx * dx + dy * dy < self.r_px * self.r_px
    }
}

/// The sky from the unmasked annulus pixels for which `exclude(i, j)` is false.
pub(crate) fn annulus_sky(
    frame: &Frame<Electrons>,
    background: &Background,
    at: (f64, f64),
    radii: (f64, f64),
    clip_sigma: f64,
    exclude: impl Fn(usize, usize) -> bool,
) -> Sky {
    let scratch = &mut Scratch::default();
    let (mut flags, mut excluded) = (Flags::default(), 0);
    let bounds = Bounds::of(frame);
    for_each_ring_run(at, radii, bounds, |columns, j| {
        for i in columns {
            let place = [j - bounds.y0, i - bounds.x0];
            let (v, m) = (frame.pixels[place], frame.mask[place]);
            if let Some(v) = sky_pixel(v, m, &mut flags) {
                if exclude(i, j) {
                    excluded += 1;
                } else {
                    scratch.values.push(v);
                }
            }
        }
    });
    sky_of(scratch, excluded, flags, background, at, clip_sigma)
}

/// The sky from all unmasked annulus pixels that no neighbour covers, taken as slices of rows; `scratch` is used again for the next
/// star.
pub(crate) fn annulus_sky_between(
    frame: &Frame<Electrons>,
    background: &Background,
    at: (f64, f64),
    radii: (f64, f64),
    clip_sigma: f64,
    neighbours: &[Neighbour],
    scratch: &mut Scratch,
) -> Sky {
    let values = &mut scratch.values;
    let mut flags = Flags::default();
    let bounds = Bounds::of(frame);
    touch(frame, at, radii.1);
    let (mut n, mut n_covered) = (0, 0);
    for_each_ring_run(at, radii, bounds, |columns, j| {
        let is_touched = neighbours.iter().any(|o| (j as f64 - o.y_px).abs() < o.r_px);
        let first = columns.start;
        let (row, columns) = (j - bounds.y0, columns.start - bounds.x0..columns.end - bounds.x0);
        let (pixels, bits) = (frame.pixels.row(row), frame.mask.row(row));
        let most = columns.len().next_multiple_of(BLOCK);
        if values.len() < n + most {
            values.resize((n + most).next_power_of_two(), 0.0);
        }
        if let (false, Some(pixels), Some(bits)) = (is_touched, pixels.to_slice(), bits.to_slice())
            && no_bits(&bits[columns.clone()])
        {
            copy_run(&pixels[columns.start..], columns.len(), &mut values[n..n + most]);
            n += columns.len();
            return;
        }
        for (i, column) in columns.zip(first..) {
            if is_touched && neighbours.iter().any(|o| o.covers(column, j)) {
                n_covered += 1;
            } else if let Some(value) = sky_pixel(pixels[i], bits[i], &mut flags) {
                values[n] = value;
                n += 1;
            }
        }
    });
    if n_covered as f64 > MOST_COVERED * (n + n_covered) as f64 {
        return annulus_sky_between(frame, background, at, radii, clip_sigma, &[], scratch);
    }
    values.truncate(n);
    // once for all rows, without a branch per pixel
    if !values.iter().fold(true, |finite, v| finite & v.is_finite()) {
        values.retain(|v| v.is_finite());
    }
    sky_of(scratch, 0, flags, background, at, clip_sigma)
}

/// Reads one pixel of every cache line within `reach` of a star.
///
/// Its rows lie far apart in memory: requested one after another as they are used, each is waited for; requested at
/// once, they are waited for together. That is a fifth of the time of a star.
fn touch(frame: &Frame<Electrons>, (x, y): (f64, f64), reach: f64) {
    let bounds = Bounds::of(frame);
    let columns = cells(x - reach, x + reach, bounds.x0, bounds.x1);
    let columns = columns.start - bounds.x0..columns.end - bounds.x0;
    let rows = cells(y - reach, y + reach, bounds.y0, bounds.y1);
    let (Some(pixels), Some(bits)) = (frame.pixels.as_slice(), frame.mask.as_slice()) else { return };
    let last = columns.end.saturating_sub(1);
    let mut any = 0;
    for row in rows.map(|j| (j - bounds.y0) * (bounds.x1 - bounds.x0)) {
        for i in columns.clone().step_by(LINE_BYTES / size_of::<f32>()).chain([last]) {
            any |= pixels[row + i].to_bits();
        }
        for i in columns.clone().step_by(LINE_BYTES).chain([last]) {
            any |= u32::from(bits[row + i]);
        }
    }
    std::hint::black_box(any);
}

/// Copies the first `n` values of `from`, in whole blocks where there are as many: what is copied too much is
/// overwritten by the next run.
fn copy_run(from: &[f32], n: usize, to: &mut [f32]) {
    if from.len() < to.len() {
        to[..n].copy_from_slice(&from[..n]);
        return;
    }
    let ((to, _), (from, _)) = (to.as_chunks_mut::<BLOCK>(), from.as_chunks::<BLOCK>());
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}

/// Whether no pixel of a run has a bit set: eight at a time, the last eight overlapping those before.
#[inline]
pub(crate) fn no_bits(bits: &[u8]) -> bool {
    let Some(last) = bits.last_chunk::<8>() else { return bits.iter().fold(0, |all, m| all | m) == 0 };
    let words = bits.as_chunks::<8>().0.iter();
    words.fold(u64::from_ne_bytes(*last), |all, word| all | u64::from_ne_bytes(*word)) == 0
}

/// The value of a pixel that may be sky.
fn sky_pixel(value: f32, bits: u8, flags: &mut Flags) -> Option<f32> {
    if bits & mask::CLIPPED != 0 {
        flags.set(Flags::CLIP_EDGE);
    }
    (bits == 0 && value.is_finite()).then_some(value)
}

fn sky_of(
    scratch: &mut Scratch,
    excluded: usize,
    mut flags: Flags,
    background: &Background,
    (x, y): (f64, f64),
    clip_sigma: f64,
) -> Sky {
    let n = scratch.values.len();
    let clipped = if n >= MIN_SKY_PX { clipped_location(scratch, clip_sigma) } else { None };
    let Some(clipped) = clipped else {
        flags.set(Flags::NO_ANNULUS);
        let rms_e = background.rms(x, y);
        return Sky { level_e: background.level(x, y), err_e: background.level_err(x, y), rms_e, n: 0, flags };
    };
    let by_noise = 1.0 - stats::gauss_within(clip_sigma);
    let sampled = (n + excluded) as f64;
    let tolerated = sampled * (by_noise + CROWDED_FRAC) + 5.0 * (sampled * by_noise).sqrt();
    if (n - clipped.n + excluded) as f64 > tolerated {
        flags.set(Flags::CROWDED_ANNULUS);
    }
    let (level_e, err_e) = level_and_error(clipped.location, 0.0, clipped.sigma, clipped.n, clip_sigma);
    Sky { level_e, err_e, rms_e: clipped.sigma, n: clipped.n, flags }
}
