//! Rings on which two edges meet: terminator, surface horizon, and the ends of both lobes, where they are seen.
//!
//! ζ in rad. Each edge is a place u on the ring, in closed form; a corner is where two places change order.

use std::f64::consts::PI;

use super::facet::wrapped;
use super::ring::{Rings, half_angle};
use crate::base::quadrature::smooth_step;

/// Rings looked at between two edges.
const STEPS: usize = 16;
/// Places on a ring: two for each edge.
type Places = [Option<f64>; 8];

/// The ζ of all corners between two rings with no other edge between them.
pub(super) fn corners(rings: &Rings, from: f64, to: f64, found: &mut Vec<f64>) {
    // close to the ends too, where an edge has only just come into view
    let zeta = |j: usize| from + (to - from) * smooth_step((j as f64 / STEPS as f64).clamp(1e-4, 1.0 - 1e-4)).0;
    let mut before = places(rings, zeta(0));
    for step in 1..=STEPS {
        let here = places(rings, zeta(step));
        for i in 0..8 {
            for j in i + 1..8 {
                if i / 2 == j / 2 {
                    continue;
                }
                let (Some(a), Some(b)) = (apart(&before, i, j), apart(&here, i, j)) else { continue };
                // a change of sign near π is not a meeting
                if (a > 0.0) != (b > 0.0) && a.abs() + b.abs() < PI {
                    found.extend(meeting(rings, (zeta(step - 1), zeta(step)), (i, j), a > 0.0));
                }
            }
        }
        before = here;
    }
}

/// Bisection of the order of two places.
fn meeting(rings: &Rings, (mut low, mut high): (f64, f64), (i, j): (usize, usize), first: bool) -> Option<f64> {
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if (apart(&places(rings, middle), i, j)? > 0.0) == first { low = middle } else { high = middle }
    }
    Some(low)
}

/// From one place to another, −π to π.
fn apart(places: &Places, i: usize, j: usize) -> Option<f64> {
    Some(wrapped(wrapped(places[i]? - places[j]?)))
}

/// Where the edges are on a ring.
fn places(rings: &Rings, zeta: f64) -> Places {
    let circle = rings.ground.circle(zeta);
    let mut places = [None; 8];
    let mut put = |at: usize, centre: f64, cosine: (f64, f64)| {
        if let Some(half) = half_angle(cosine).filter(|half| *half < PI) {
            (places[at], places[at + 1]) = (Some(wrapped(centre - half)), Some(wrapped(centre + half)));
        }
    };
    put(0, 0.0, circle.height);
    put(2, rings.facet.u_normal, rings.facet.front(&circle));
    if rings.ground.lobe_exponent().is_some_and(|n| n < rings.smooth_exponent) {
        put(4, 0.0, circle.glint);
    }
    if rings.facet.law.lobe_exponent().is_some_and(|n| n < rings.smooth_exponent) {
        put(6, rings.facet.u_mirror, rings.facet.lobe_side(&circle));
    }
    places
}
