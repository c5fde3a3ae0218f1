//! What looks like a target and is none: charge that spills along columns from saturated pixels, reflections of the pupil;
//! and what crosses a target.
//!
//! Cells of the cutout. Candidates that are one of the first two are masked, and the search goes on; the flag stays for a
//! frame in which nothing else is found. It does not cover cosmic rays and hot pixels ([`super::cosmic_rays`]).

use ndarray::Array2;

use super::cutout::Cutout;
use super::placed::Placed;
use super::shape::{axes, covariance};
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::trails::crossing::{crossings, is_another_angle};

/// Charge spills along columns or rows: at most this far from their direction \[rad\].
const SPILL_ANGLE: f64 = 0.06;
/// It is at least this many times as long as wide.
const SPILL_RATIO: f64 = 2.5;
/// Saturated pixels this near belong to it \[px\].
const SPILL_REACH_PX: usize = 3;
/// The reflection of a pupil has at least this radius \[FWHM\].
const GHOST_FWHM: f64 = 2.0;
/// It is round: ratio of its axes at most.
const GHOST_RATIO: f64 = 1.3;
/// Its dark middle and its bright ring, as shares of its radius.
const GHOST_MIDDLE: f64 = 0.3;
const GHOST_RING: (f64, f64) = (0.5, 0.85);
/// The middle is at most this bright in units of the ring ...
const GHOST_DEPTH: f64 = 0.7;
/// ... by so many errors.
const GHOST_SIGMA: f64 = 4.0;
/// Directions in each of which the ring is at least half as bright as on average.
const GHOST_SECTORS: usize = 8;
const GHOST_EVEN: f64 = 0.5;

impl Cutout {
    /// What a candidate of these cells is instead of a target, if that can be said.
    pub fn artefact(&self, frame: &Frame<Electrons>, cells: &[(usize, usize)]) -> Option<Flags> {
        let (x, y, xx, xy, yy) = covariance(cells);
        let (a, b, theta) = axes(xx, xy, yy);
        if self.is_spill(frame, cells, (a, b, theta)) {
            return Some(Flags::BLOOMING);
        }
        (a < GHOST_RATIO * b && self.is_pupil((x, y), cells)).then_some(Flags::GHOST)
    }

    /// Whether light along columns or rows begins at saturated pixels of something else than itself.
    fn is_spill(&self, frame: &Frame<Electrons>, cells: &[(usize, usize)], (a, b, theta): (f64, f64, f64)) -> bool {
        let off_axis = (2.0 * theta).sin().abs();
        if a < SPILL_RATIO * b || off_axis > 2.0 * SPILL_ANGLE {
            return false;
        }
        let bin = self.net.bin;
        let (ny, nx) = frame.mask.dim();
        cells.iter().any(|&(i, j)| {
            let (x, y) = (self.x0 + i * bin, self.y0 + j * bin);
            let columns = x.saturating_sub(SPILL_REACH_PX)..(x + bin + SPILL_REACH_PX).min(nx);
            (y.saturating_sub(SPILL_REACH_PX)..(y + bin + SPILL_REACH_PX).min(ny))
                .any(|j| columns.clone().any(|i| frame.mask[[j, i]] & mask::SATURATED != 0))
        })
    }

    /// Whether a round candidate is a ring: the image of a pupil with a central obstruction, out of focus. Nothing in the sky
    /// that is round has a dark middle.
    fn is_pupil(&self, (x, y): (f64, f64), cells: &[(usize, usize)]) -> bool {
        let radius = cells.iter().map(|&(i, j)| (i as f64 - x).hypot(j as f64 - y)).fold(0.0, f64::max);
        if radius < GHOST_FWHM * self.fwhm_cells() {
            return false;
        }
        let light = self.residual();
        let mean = |inside: &dyn Fn(f64, f64) -> bool| mean_of(&light, (x, y), radius, inside);
        let ring = |r: f64| r > GHOST_RING.0 * radius && r < GHOST_RING.1 * radius;
        let (Some(middle), Some(around)) = (mean(&|r, _| r < GHOST_MIDDLE * radius), mean(&|r, _| ring(r))) else {
            return false;
        };
        let noise = self.noise_of_cell();
        let err = noise * (GHOST_DEPTH * GHOST_DEPTH / around.1 + 1.0 / middle.1).sqrt();
        let hollow = GHOST_DEPTH * around.0 - middle.0 > GHOST_SIGMA * err;
        let sector = |k: usize| {
            let width = std::f64::consts::TAU / GHOST_SECTORS as f64;
            let of = |angle: f64| (angle / width) as usize % GHOST_SECTORS == k;
            mean(&|r, angle| ring(r) && of(angle)).is_some_and(|m| m.0 > GHOST_EVEN * around.0)
        };
        hollow && (0..GHOST_SECTORS).all(sector)
    }

    /// [`Flags::CROSSED`] where a satellite or an aircraft runs through an object of the cutout or within one FWHM of it;
    /// `snr1` is the significance at the scale of a star.
    pub fn crossed(&self, object: &Placed, snr1: &Array2<f32>) -> Flags {
        let object = self.in_cells(object);
        let trails = self.trail_background.as_ref().map(|t| t.theta());
        let fwhm = self.fwhm_cells();
        let line = crossings(snr1, fwhm, trails).iter().any(|c| c.touches(&object, fwhm));
        let taken_for_trail = trails.zip(self.known).is_some_and(|(theta, known)| is_another_angle(theta, known))
            && self.brightest_trail(&object) > CROSSED_LIGHT * self.rms_e;
        if line || taken_for_trail { Flags::CROSSED } else { Flags::default() }
    }

    /// The brightest light of trails over an object \[e⁻ per pixel\].
    fn brightest_trail(&self, object: &Placed) -> f64 {
        let inside = |i: usize, j: usize| object.shape.contains(i as f64 - object.x, j as f64 - object.y);
        let light = self.light.indexed_iter().filter(|((j, i), _)| inside(*i, *j)).map(|(_, v)| f64::from(*v));
        light.fold(0.0, f64::max)
    }
}

/// A line that was taken for a star trail counts where its light is above this \[σ of a sky pixel\].
const CROSSED_LIGHT: f64 = 0.3;

/// Mean and number of the cells about a place for which `inside(distance, angle)`; `None` of fewer than four.
fn mean_of(
    light: &Array2<f32>,
    (x, y): (f64, f64),
    radius: f64,
    inside: &dyn Fn(f64, f64) -> bool,
) -> Option<(f64, f64)> {
    let (ny, nx) = light.dim();
    let range = |c: f64, n: usize| ((c - radius).max(0.0) as usize)..((c + radius + 1.0).clamp(0.0, n as f64) as usize);
    let (mut sum, mut n) = (0.0, 0.0);
    for j in range(y, ny) {
        for i in range(x, nx) {
            let (dx, dy) = (i as f64 - x, j as f64 - y);
            let angle = dy.atan2(dx).rem_euclid(std::f64::consts::TAU);
            let v = f64::from(light[[j, i]]);
            if v.is_finite() && inside(dx.hypot(dy), angle) {
                sum += v;
                n += 1.0;
            }
        }
    }
    (n >= 4.0).then(|| (sum / n, n))
}
