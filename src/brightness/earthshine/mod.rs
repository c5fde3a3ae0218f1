//! Light that reaches a surface by way of the Earth: one integral over the lit ground in view, with its error.
//!
//! Per unit irradiance of the light source, in 1/sr. Iterated Gauss-Kronrod over (ζ, φ), graded about the lobe, with
//! every edge an exact break point and both errors estimated and refined. Parallel light, spherical Earth.

mod arithmetic;
mod corners;
mod edge;
mod facet;
mod lobe;
mod outer;
mod panel;
mod piece;
mod plain;
mod profile;
mod ring;
mod table;

pub(crate) use plain::plain;
pub(crate) use plain::plain_rule;
pub use profile::PreparedBrdf;

use super::brdf::Brdf;
use super::ground::Ground;
use crate::base::vector::{Itrs, Vector};
use facet::Facet;
use profile::Law;

/// Rounding of a mirror's light, relative.
const MIRROR_ROUNDING: f64 = 1e-9;

/// How well the integral is wanted: refinement stops at the larger of the two limits, or at `max_nodes`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Relative to the integral.
    pub tolerance: f64,
    /// Absolute \[1/sr\]: what is negligible compared with the other lights; 0 = every digit of `tolerance` matters.
    pub floor_per_sr: f64,
    /// Nodes after which refinement stops; the error then says so.
    pub max_nodes: usize,
}

impl Accuracy {
    /// A relative tolerance and nothing else.
    #[must_use]
    pub fn relative(tolerance: f64, max_nodes: usize) -> Self {
        Self { tolerance, floor_per_sr: 0.0, max_nodes }
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
        panel::integrate(ground, &facet, accuracy)
    }
}
