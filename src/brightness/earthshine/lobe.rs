//! Where on the view a lobe makes the rings change quickly: the ring it is nearest to, and those on which it is cut.
//!
//! ζ in rad, distances in the law's own metric. A lobe on lit ground is found in closed form, one next to it by search.

use std::f64::consts::{FRAC_PI_2, PI};

use super::edge::Edge;
use super::profile::Metric;
use super::ring::Rings;

/// The ring nearest to the middle of the surface's lobe, and the ends of its reach; the reach in nadir angle \[rad\].
pub(super) fn lobe(rings: &mut Rings, low: f64, drop: f64, edges: &mut Vec<Edge>) -> f64 {
    let (ground, facet) = (rings.ground, rings.facet);
    let falls_off = facet.law.falls_off();
    let lit = ground.radiance_from(&facet.mirror) > 0.0;
    let mut x2 = 0.0;
    if lit {
        let sine = (facet.eta_mirror.0 / ground.k).min(1.0);
        let zeta = sine.asin();
        let scale = scale_in_zeta(rings, zeta, middle_along_meridian(rings));
        edges.push(Edge { root: !falls_off && rings.middle < 0.1, before: scale, behind: scale, ..Edge::plain(zeta) });
    } else if let Some((zeta, least2)) = nearest_ring(rings, low, falls_off) {
        x2 = least2;
        if falls_off {
            let (before, behind) = (fall(rings, zeta, least2, -1.0, low), fall(rings, zeta, least2, 1.0, low));
            edges.push(Edge { before, behind, ..Edge::plain(zeta) });
        } else {
            let away = 0.7 * (least2 + (rings.middle * facet.width).powi(2)).sqrt();
            if away < 0.1 {
                let scale = scale_in_zeta(rings, zeta, away);
                edges.push(Edge { before: scale, behind: scale, ..Edge::plain(zeta) });
            }
        }
    }
    rings.window2 = facet.law.window2(x2, drop);
    for zeta in passing(rings).into_iter().flatten().filter(|zeta| *zeta > low && *zeta < FRAC_PI_2) {
        let near2 = facet.distance2(&ground.circle(zeta), facet.u_mirror);
        let scale = if falls_off { facet.width } else { 0.7 * near2.sqrt() + rings.middle * facet.width };
        if near2 < rings.window2 && scale < 0.1 {
            let scale = scale_in_zeta(rings, zeta, scale);
            edges.push(Edge { before: scale, behind: scale, ..Edge::plain(zeta) });
        }
    }
    if !rings.window2.is_finite() || rings.window2 >= 4.0 {
        return f64::INFINITY;
    }
    let reach = 2.0 * (0.5 * rings.window2.max(0.0).sqrt()).asin();
    let eta = facet.nadir_angle_of_mirror();
    let ends = [eta - reach, eta + reach, reach - eta];
    edges.extend(ends.into_iter().filter_map(|eta| ground.zeta_of_nadir_angle(eta)).map(Edge::plain));
    reach
}

/// The rings on which terminator and horizon pass the azimuth of the mirror direction: the lobe is cut differently on
/// either side.
fn passing(rings: &Rings) -> [Option<f64>; 2] {
    let (ground, facet) = (rings.ground, rings.facet);
    let theta = ground.terminator_theta(facet.u_mirror.cos());
    let (sin_t, cos_t) = theta.sin_cos();
    let terminator = (theta > 0.0 && cos_t > ground.k).then(|| sin_t.atan2(cos_t - ground.k));
    // sin η n_t cos(u − u_n) = cos η n_z
    let n = &facet.normal;
    let side = n.x().hypot(n.y()) * (facet.u_mirror - facet.u_normal).cos();
    let horizon = ground.zeta_of_nadir_angle((n.z() * side.signum()).atan2(side.abs()));
    [terminator, horizon]
}

/// The nadir angle over which the middle of the lobe changes along the meridian through the mirror direction.
fn middle_along_meridian(rings: &Rings) -> f64 {
    let facet = rings.facet;
    if facet.metric != Metric::Plane {
        return facet.width;
    }
    // D grows along the meridian, each ring at its nearest place, like |n·m|/sqrt(1 − n_φ²)
    let (m, n) = (&facet.mirror, &facet.normal);
    let across = m.x().hypot(m.y());
    let n_phi = if across > 0.0 { (n.y() * m.x() - n.x() * m.y()) / across } else { 0.0 };
    let growth = facet.cos_out / (1.0 - n_phi * n_phi).max(1e-30).sqrt();
    0.7 * rings.middle * facet.width / growth.clamp(1e-6, 1.0)
}

/// A small nadir angle as a length in ζ; near the limb ζ goes like its root.
fn scale_in_zeta(rings: &Rings, zeta: f64, eta: f64) -> f64 {
    let k = rings.ground.k;
    let sin_eta = k * zeta.sin();
    let slope = k * zeta.cos() / (1.0 - sin_eta * sin_eta).sqrt();
    let limb = 0.5 * k / (1.0 - k * k).sqrt();
    // there the distance goes like the square, and twice as much happens in a doubling of it
    eta / (slope + 2.0 * (eta * limb).sqrt())
}

/// The ring with the lit place nearest to the middle of the lobe, and the squared distance of that; finely where requested.
fn nearest_ring(rings: &Rings, low: f64, finely: bool) -> Option<(f64, f64)> {
    let steps = if finely { 48 } else { 10 };
    let distance2 = |zeta: f64| rings.nearest_lit2(&rings.ground.circle(zeta)).unwrap_or(f64::INFINITY);
    let zeta = |j: usize| low + (FRAC_PI_2 - low) * (j as f64 + 0.5) / steps as f64;
    let mut best = (0, f64::INFINITY);
    for j in 0..steps {
        let x2 = distance2(zeta(j));
        if x2 < best.1 {
            best = (j, x2);
        }
    }
    if !best.1.is_finite() {
        return None;
    }
    // where the lobe is far away its nearest place need not be known well
    let rounds = match finely {
        true => 60,
        false if best.1 < 0.05 => 14,
        false => return Some((zeta(best.0), best.1)),
    };
    let width = (FRAC_PI_2 - low) / steps as f64;
    let (mut a, mut b) = ((zeta(best.0) - width).max(low), (zeta(best.0) + width).min(FRAC_PI_2));
    // golden section
    const SHARE: f64 = 0.381_966_011_250_105_2;
    let (mut p, mut q) = (a + SHARE * (b - a), b - SHARE * (b - a));
    let (mut at_p, mut at_q) = (distance2(p), distance2(q));
    for _ in 0..rounds {
        if at_p <= at_q {
            (b, q, at_q) = (q, p, at_p);
            p = a + SHARE * (b - a);
            at_p = distance2(p);
        } else {
            (a, p, at_p) = (p, q, at_q);
            q = b - SHARE * (b - a);
            at_q = distance2(q);
        }
    }
    // the least may be at an end, where the last digits do not matter
    let ends = [low, FRAC_PI_2, 0.5 * (a + b)].map(|zeta| (zeta, distance2(zeta)));
    ends.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(zeta, x2)| (zeta, x2.min(best.1)))
}

/// The length in ζ, before (−1) or behind (+1) a ring, over which a lobe falls by a factor e.
fn fall(rings: &Rings, zeta: f64, least2: f64, side: f64, low: f64) -> f64 {
    let steepness = rings.facet.law.steepness(least2);
    let mut length = 1e-9;
    while length < PI {
        let there = zeta + side * length;
        if there < low || there > FRAC_PI_2 {
            break;
        }
        let x2 = rings.nearest_lit2(&rings.ground.circle(there));
        if x2.is_some_and(|x2| steepness * (x2 - least2) > 1.0) {
            return length;
        }
        length *= 2.0;
    }
    f64::INFINITY
}
