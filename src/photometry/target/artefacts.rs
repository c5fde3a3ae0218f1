//! What looks like a target and is none: charge that spills along columns from saturated pixels; and what crosses a target.
//!
//! Cells of the cutout. A candidate of spilt charge, or one on a line from border to border, is masked, and the search goes on; the
//! flag of spilt charge stays for a frame in which nothing else is found. It does not cover cosmic rays and hot pixels
//! ([`super::cosmic_rays`]), nor reflections of bright stars that stand still; those that trail are in the level of the trails.

use ndarray::Array2;

use super::cutout::Cutout;
use super::placed::Placed;
use super::shape::{axes, covariance};
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::target::flux::TRAIL_LIGHT;
use crate::photometry::target::search::STREAK_RATIO;
use crate::photometry::trails::crossing::{Crossing, crossings, is_another_angle};
use crate::photometry::trails::direction::ONE_DIRECTION;

/// Saturated pixels this near belong to it \[px\].
const SPILL_REACH_PX: usize = 3;
/// A candidate of which this share lies on a line that crosses the cutout is a part of it.
const ON_LINE: f64 = 0.7;
/// So far to both sides of its bright cells the light of a line is masked \[FWHM\].
const LINE_MARGIN_FWHM: f64 = 1.5;
/// A line that crosses ends so near to the border \[FWHM\].
const BORDER_FWHM: f64 = 3.0;

impl Cutout {
    /// Whether a candidate of these cells is charge that has spilt along columns or rows from saturated pixels.
    pub fn is_spill(&self, frame: &Frame<Electrons>, cells: &[(usize, usize)]) -> bool {
        let (_, _, xx, xy, yy) = covariance(cells);
        let (a, b, theta) = axes(xx, xy, yy);
        let off_axis = (2.0 * theta).sin().abs();
        if a < STREAK_RATIO * b || off_axis > 2.0 * ONE_DIRECTION {
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

    /// The line from border to border on which a candidate of these cells lies, if there is one.
    pub fn line_of(&self, cells: &[(usize, usize)], snr1: &Array2<f32>) -> Option<Crossing> {
        let fwhm = self.fwhm_cells();
        let trails = self.trail_background.as_ref().map(|t| t.theta());
        let lines = crossings(snr1, fwhm, trails);
        let on = |line: &Crossing| cells.iter().filter(|(i, j)| line.holds((*i as f64, *j as f64), fwhm)).count();
        lines
            .into_iter()
            .filter(|line| line.runs_through(snr1.dim(), BORDER_FWHM * fwhm))
            .find(|line| on(line) as f64 >= ON_LINE * cells.len() as f64)
    }

    /// Masks a line, and begins again with sky and trails.
    pub fn mask_line(&mut self, line: Crossing) {
        let margin = LINE_MARGIN_FWHM * self.fwhm_cells();
        for ((j, i), v) in self.pixels.indexed_iter_mut() {
            if line.holds((self.net.in_cells(i as f64), self.net.in_cells(j as f64)), margin) {
                *v = f32::NAN;
            }
        }
        self.lines.push(line);
        self.renew();
    }

    /// [`Flags::CROSSED`] where a satellite or an aircraft runs through an object of the cutout or within one FWHM of it;
    /// `snr1` is the significance at the scale of a star.
    pub fn crossed(&self, object: &Placed, snr1: &Array2<f32>) -> Flags {
        let object = self.in_cells(object);
        let trails = self.trail_background.as_ref().map(|t| t.theta());
        let fwhm = self.fwhm_cells();
        let lines = crossings(snr1, fwhm, trails);
        let line = lines.iter().chain(&self.lines).any(|c| c.touches(&object, fwhm));
        let taken_for_trail = trails.zip(self.known).is_some_and(|(theta, known)| is_another_angle(theta, known))
            && self.brightest_trail(&object) > TRAIL_LIGHT * self.rms_e;
        if line || taken_for_trail { Flags::CROSSED } else { Flags::default() }
    }

    /// The brightest light of trails over an object \[e⁻ per pixel\].
    fn brightest_trail(&self, object: &Placed) -> f64 {
        let inside = |i: usize, j: usize| object.shape.contains(i as f64 - object.x, j as f64 - object.y);
        let light = self.light.indexed_iter().filter(|((j, i), _)| inside(*i, *j)).map(|(_, v)| f64::from(*v));
        light.fold(0.0, f64::max)
    }
}
