//! The star trails of a cutout: whether there are any, along which direction, and their light.
//!
//! Cells. It does not cover how a trail is modelled ([`crate::photometry::trails`]).

use ndarray::Array2;

use super::cutout::Cutout;
use super::placed::Placed;
use crate::photometry::aperture::Shape;
use crate::photometry::smooth::{Kernel, smooth_image};
use crate::photometry::trails::bend_fit::bend_of;
use crate::photometry::trails::direction::{SHORTEST_FWHM, Turned, trail_direction};
use crate::photometry::trails::exclusion::ExclusionMask;
use crate::photometry::trails::known::KnownDirection;
use crate::photometry::trails::model::TrailBackground;
use crate::photometry::trails::segments::Segments;

/// Threshold of the pixels that make trails \[σ of the smoothed frame\].
const TRAIL_SIGMA: f64 = 4.0;
/// The same for faint trails, which must be longer to count \[σ\].
const FAINT_TRAIL_SIGMA: f64 = 2.5;
/// An outline this long in lengths of a trail holds one: what is found of one in parts is longer.
const OUTLINE_OF_A_TRAIL: f64 = 0.5;
/// Share of the light of a trail of known length that is not the same all along it, where nothing else shows that.
const SEGMENT_ERR: f64 = 0.02;

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
            &self.without_segments(),
            theta,
            self.fwhm_cells(),
            self.noise_of_cell(),
            (self.net.bin * self.net.bin) as f64,
        )
    }

    /// Direction and length of the trails \[cells\], where both are known and the target is shorter.
    fn trails_known(&self) -> Option<(KnownDirection, f64)> {
        self.known.zip(self.length_of_trails()).filter(|(_, length)| self.largest.is_none_or(|most| most < *length))
    }

    /// Whether an outline \[px\] reaches as far along the trails as a large part of one, where the target is not known to.
    pub(super) fn may_hold_a_trail(&self, outline: Shape) -> bool {
        let Some((known, length)) = self.trails_known() else { return false };
        let (a, b, theta) = outline.axes();
        let (sin, cos) = (theta - known.theta_rad).sin_cos();
        let extent = 2.0 * (a * cos).hypot(b * sin) / self.net.bin as f64;
        let least = self.largest.map_or(0.0, |most| most + self.fwhm_cells());
        extent > (OUTLINE_OF_A_TRAIL * length).max(least)
    }

    /// The cells above the sky without the trails of known length.
    pub(super) fn without_segments(&self) -> Array2<f32> {
        match &self.segments {
            Some(segments) => &self.net.mean - &segments.light,
            None => self.net.mean.clone(),
        }
    }

    /// Finds the trails whose length is known, and the direction of those that are left; a known object \[cells\] is excluded.
    pub(super) fn find_trails(&mut self, object: Option<&Placed>) {
        let fwhm = self.fwhm_cells();
        let known = self.trails_known();
        self.segments = known.and_then(|(known, length)| {
            let hidden =
                |turned: &Turned| object.iter().map(|e| ExclusionMask::of(turned, (e.x, e.y), e.shape)).collect();
            let area_px = (self.net.bin * self.net.bin) as f64;
            Segments::find(&self.net.mean, (known.theta_rad, length), fwhm, (self.noise_of_cell(), area_px), hidden)
        });
        let kernel = Kernel::gaussian(fwhm);
        let smooth = smooth_image(&self.without_segments().mapv(|v| if v.is_finite() { v } else { 0.0 }), &kernel);
        let above = |sigma: f64| {
            let threshold = (sigma * self.noise_of_cell() * kernel.noise_factor()) as f32;
            smooth.mapv(|v| v > threshold)
        };
        let theta = trail_direction(&above(TRAIL_SIGMA), &above(FAINT_TRAIL_SIGMA), fwhm);
        self.trail_background = theta.map(|theta| self.trail_background_along(theta));
    }

    /// Models the light of the trails; a known object \[cells\] is excluded.
    pub(super) fn model_trails(&mut self, object: Option<&Placed>) {
        let dim = self.net.mean.dim();
        if let Some(trail_background) = &self.trail_background {
            let exclusions: Vec<_> = object.iter().map(|e| trail_background.exclusion((e.x, e.y), e.shape)).collect();
            let (mut light, unsure, scintillation) = trail_background.everywhere(dim, &exclusions);
            light.mapv_inplace(|v| if v.is_finite() { v } else { 0.0 });
            (self.light, self.unsure, self.scintillation) = (light, unsure, scintillation);
        } else if self.segments.is_some() {
            (self.light, self.unsure, self.scintillation) = (Array2::zeros(dim), Array2::zeros(dim), SEGMENT_ERR);
        }
        if let Some(segments) = &self.segments {
            self.light += &segments.light;
            self.unsure += &segments.unsure;
        }
    }
}
