//! The integral by a plain rule that knows no edge: what is excluded elsewhere, computed all the same.
//!
//! In 1/sr. Gauss in ζ, equal steps in φ over all ground in view, dark or lit, before or behind the surface. Good to a
//! few per cent where there is light; exactly 0 where there is none, which is what it is requested.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::base::quadrature::gauss;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::brdf::Brdf;
use crate::brightness::ground::{Ground, Vertical};

/// Rings, and places on each, for what is excluded: as many nodes as a usual integral takes at the default tolerance.
const NODES: (usize, usize) = (18, 32);

/// [`plain_rule`] of 576 nodes.
pub(crate) fn plain(ground: &Ground, brdf: &Brdf, normal: &Vector<Itrs>, observer: &Vector<Itrs>) -> f64 {
    plain_rule(ground, brdf, normal, observer, NODES)
}

/// ∫ L(w) f(w, n, o) (n·w)₊ dω over all ground in view by `rings` × `places` nodes \[1/sr\]; a mirror shows the ground
/// in one direction, ρ L(m).
pub(crate) fn plain_rule(
    ground: &Ground,
    brdf: &Brdf,
    normal: &Vector<Itrs>,
    observer: &Vector<Itrs>,
    (rings, places): (usize, usize),
) -> f64 {
    let (normal, observer): (Vector<Vertical>, Vector<Vertical>) = (ground.local(normal), ground.local(observer));
    if let Brdf::Mirror { reflectance } = brdf {
        let mirror = normal * (2.0 * normal.dot(&observer)) - observer;
        return reflectance * ground.radiance_from(&mirror) * f64::from(u8::from(normal.dot(&mirror) > 0.0));
    }
    let (nodes, weights) = gauss(rings);
    let mut sum = 0.0;
    for (t, weight) in nodes.iter().zip(weights) {
        let circle = ground.circle(FRAC_PI_2 * t);
        for place in 0..places {
            let phi = (TAU * (place as f64 + 0.5) / places as f64).sin_cos();
            let w = circle.direction(phi);
            let f_cos = brdf.value(&w, &normal, &observer) * normal.dot(&w).max(0.0);
            sum += weight * circle.solid_angle * ground.radiance(&circle, phi) * f_cos;
        }
    }
    sum * FRAC_PI_2 * TAU / places as f64
}
