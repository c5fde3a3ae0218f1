//! Light that reaches a surface by way of the Earth: one integral over the lit ground in view, with its error.
//!
//! Per unit irradiance of the light source, in 1/sr. Iterated Gauss-Kronrod over (ζ, φ), graded about the lobe, with
//! every edge an exact break point and both errors estimated and refined; where a narrow lobe leaves the error far above the
//! tolerance, polar coordinates about the mirror direction. Parallel light or a Moon at its distance, spherical Earth.

mod arithmetic;
mod bound;
mod corners;
mod edge;
mod facet;
mod lobe;
mod outer;
mod panel;
mod piece;
mod plain;
mod polar;
mod profile;
mod rays;
mod ring;
mod table;

pub(crate) use bound::LawBound;
pub(crate) use plain::plain;
pub(crate) use plain::plain_rule;
pub use profile::PreparedBrdf;

use super::brdf::Brdf;
use super::ground::Ground;
use crate::base::vector::{Itrs, Vector};
use facet::Facet;
use profile::Law;

/// The rule of last resort is tried where the error is this many times the one that is wanted.
const FAR_OFF: f64 = 3.0;
/// Rounding of a mirror's light, relative.
const MIRROR_ROUNDING: f64 = 1e-9;

/// No tolerance below this is met in 64-bit numbers.
const TOLERANCE_MIN: f64 = 1e-13;

/// How well the integral is wanted: refinement stops at the larger of the two limits, or at `max_nodes`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Relative to the integral.
    pub tolerance: f64,
    /// Absolute \[1/sr\]: what is negligible compared with the other lights; 0 = every digit of `tolerance` matters.
    pub floor_per_sr: f64,
    /// Upper bound of the integral \[1/sr\], infinite where none is known: beside a floor it says how many digits are wanted.
    pub at_most_per_sr: f64,
    /// Nodes after which refinement stops; the error then says so. From 100 000 on the rule of last resort may be tried, which takes
    /// up to twenty times as many.
    pub max_nodes: usize,
}

impl Accuracy {
    /// A relative tolerance and nothing else.
    #[must_use]
    pub fn relative(tolerance: f64, max_nodes: usize) -> Self {
        Self { tolerance, floor_per_sr: 0.0, at_most_per_sr: f64::INFINITY, max_nodes }
    }

    /// The error that is wanted of an integral of this size \[1/sr\].
    fn wanted(&self, per_sr: f64) -> f64 {
        (self.tolerance.max(TOLERANCE_MIN) * per_sr).max(self.floor_per_sr)
    }
}

/// The value of the integral and what it took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReflectedLight {
    /// ∫ L(w) f(w, n, o) (n·w) dω over the lit ground in view \[1/sr\].
    pub per_sr: f64,
    /// Estimated error of the value \[1/sr\].
    pub err_per_sr: f64,
    /// Nodes evaluated.
    pub nodes: usize,
}

/// Light from the lit ground, reflected by a surface towards the observer, per unit irradiance of the light source.
///
/// [`PreparedBrdf::reflected`] for a law used once. Whoever has many integrals of one law prepares it once.
#[must_use]
pub fn reflected_by_earth(
    ground: &Ground,
    brdf: &Brdf,
    normal: &Vector<Itrs>,
    observer: &Vector<Itrs>,
    accuracy: &Accuracy,
) -> ReflectedLight {
    PreparedBrdf::bare(brdf).reflected(ground, normal, observer, accuracy)
}

impl PreparedBrdf {
    /// Light from the lit ground, reflected by a surface of this law towards the observer, per unit irradiance.
    ///
    /// `∫ f_E(s, p, −w) (p·s)₊ f(w, n, o) (n·w)₊ dω`, directions w from the satellite to ground points p, patch by
    /// patch. The flux at the observer is this times `A (n·o)/d²`. `normal` and `observer` are unit vectors at the
    /// satellite; an observer behind the surface, and ground that is dark or behind it, give exactly 0. A mirror needs
    /// no integral: it shows the ground in one direction, ρ L(m).
    #[must_use]
    pub fn reflected(
        &self,
        ground: &Ground,
        normal: &Vector<Itrs>,
        observer: &Vector<Itrs>,
        accuracy: &Accuracy,
    ) -> ReflectedLight {
        if !(ground.lit_in_view() && ground.seen_by(normal)) {
            return ReflectedLight::default();
        }
        let facet = Facet::new(ground, self, normal, observer);
        if !(facet.cos_out > 0.0) {
            return ReflectedLight::default();
        }
        if let Law::Mirror { reflectance } = self.law {
            let per_sr = reflectance * ground.radiance_from(&facet.mirror);
            // near the limb the ground point keeps fewer digits than the direction
            return ReflectedLight { per_sr, err_per_sr: MIRROR_ROUNDING * per_sr, nodes: 1 };
        }
        let light = panel::integrate(ground, &facet, accuracy);
        let far_off = light.err_per_sr > FAR_OFF * accuracy.wanted(light.per_sr);
        if !(far_off && facet.is_narrow() && accuracy.max_nodes >= polar::LEAST_NODES) {
            return light;
        }
        let mut polar = polar::integrate(ground, &facet, accuracy);
        if ground.lobe_ends_sharply() || ground.has_kink() {
            // there the rings are the surer of the two
            let apart = (polar.per_sr - light.per_sr).abs();
            polar.err_per_sr = polar.err_per_sr.max(apart - light.err_per_sr);
        }
        let better = if polar.err_per_sr < light.err_per_sr { polar } else { light };
        ReflectedLight { nodes: light.nodes + polar.nodes, ..better }
    }
}
