//! The star trails of a cutout: whether there are any, along which direction, and their light.
//!
//! Cells. It does not cover how a trail is modelled ([`crate::photometry::trails`]).

use super::cutout::Cutout;
use super::placed::Placed;
use crate::photometry::smooth::{Kernel, smooth_image};
use crate::photometry::trails::bend_fit::bend_of;
use crate::photometry::trails::crossing::is_another_angle;
use crate::photometry::trails::direction::{SHORTEST_FWHM, trail_direction};
use crate::photometry::trails::model::TrailBackground;

/// Threshold of the pixels that make trails \[σ of the smoothed frame\].
const TRAIL_SIGMA: f64 = 4.0;
/// The same for faint trails, which must be longer to count \[σ\].
const FAINT_TRAIL_SIGMA: f64 = 2.5;

impl Cutout {
    /// Subtracts the error of the sky's surface along the trails; a known object \[cells\] is excluded.
    pub(super) fn straighten(&mut self, object: Option<&Placed>) {
        let Some(trail_background) = &mut self.trail_background else { return };
        let exclusions: Vec<_> = object.iter().map(|e| trail_background.exclusion((e.x, e.y), e.shape)).collect();
        let Some(bend) = bend_of(trail_background, &exclusions) else { return };
        trail_background.straighten(&bend);
        bend.subtract_from(&mut self.net.mean);
        let net = &self.net;
        self.sky.add_quadratic(|x, y| bend.at(net.in_cells(x), net.in_cells(y)));
    }

    /// Length of the star trails \[cells\], if it is known and they are long enough to be found as such.
    fn length_of_trails(&self) -> Option<f64> {
        let length = self.trail_length_px? / self.net.bin as f64;
        (length >= SHORTEST_FWHM * self.fwhm_cells()).then_some(length)
    }

    pub(super) fn trail_background_along(&self, theta: f64) -> TrailBackground {
        TrailBackground::new(
            &self.net.mean,
            (theta, self.length_of_trails()),
            self.fwhm_cells(),
            self.noise_of_cell(),
            (self.net.bin * self.net.bin) as f64,
        )
    }

    /// Finds the direction of the trails.
    pub(super) fn find_trails(&mut self) {
        let fwhm = self.fwhm_cells();
        let kernel = Kernel::gaussian(fwhm);
        let smooth = smooth_image(&self.net.mean.mapv(|v| if v.is_finite() { v } else { 0.0 }), &kernel);
        let above = |sigma: f64| {
            let threshold = (sigma * self.noise_of_cell() * kernel.noise_factor()) as f32;
            smooth.mapv(|v| v > threshold)
        };
        // a run as long as a trail, along the known direction, is one
        let known = self
            .known
            .zip(self.length_of_trails())
            .filter(|(_, length)| self.largest.is_none_or(|most| most < *length));
        let length_along =
            |theta: f64| known.filter(|(known, _)| !is_another_angle(theta, *known)).map(|(_, length)| length);
        let theta = trail_direction(&above(TRAIL_SIGMA), &above(FAINT_TRAIL_SIGMA), fwhm, length_along);
        self.trail_background = theta.map(|theta| self.trail_background_along(theta));
    }

    /// Models the light of the trails; a known object \[cells\] is excluded.
    pub(super) fn model_trails(&mut self, object: Option<&Placed>) {
        let Some(trail_background) = &self.trail_background else { return };
        let exclusions: Vec<_> = object.iter().map(|e| trail_background.exclusion((e.x, e.y), e.shape)).collect();
        let (mut light, unsure, scintillation) = trail_background.everywhere(self.net.mean.dim(), &exclusions);
        light.mapv_inplace(|v| if v.is_finite() { v } else { 0.0 });
        (self.light, self.unsure, self.scintillation) = (light, unsure, scintillation);
    }
}
