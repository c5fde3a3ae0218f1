//! Light that reaches a surface by way of the Earth: one integral over the lit ground in view, with its error.
//!
//! Per unit irradiance of the lamp, in 1/sr. Product Gauss in (ζ, φ) with every edge an exact break point; two orders
//! are compared on each panel, and panels are refined until the tolerance is met. Parallel light, spherical Earth.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::brdf::Brdf;
use super::ground::{Circle, Cone, Ground, SMOOTH_EXPONENT, Vertical};
use super::quadrature::{end_clustered, gauss, half_cosine};
use crate::vector::{Itrs, Vector};

/// Orders in ζ and φ of each level; past the last a panel is halved, and so are its arcs.
const LEVELS: [(usize, usize); 6] = [(6, 8), (9, 12), (13, 18), (20, 27), (30, 40), (45, 60)];
/// Lobes of exponent below this keep their branch point at r·o = 0 as an edge; above, they are rings about the mirror
/// direction instead.
const LOBE_EXPONENT: f64 = 16.0;
/// Radii of the rings in units of the lobe's width n^(−1/2); outside the last the lobe is below 1e-10.
const RINGS: [f64; 3] = [1.4, 3.2, 7.0];

/// Estimated error of a panel in units of the difference of its two orders.
const SAFETY: f64 = 3.0;
/// Longest arc of φ one rule covers \[rad\].
const ARC_RAD: f64 = 2.1;

/// How well the integral is wanted: refinement stops at the larger of the two limits, or at `max_nodes`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Relative to the integral.
    pub tolerance: f64,
    /// Absolute \[1/sr\]: what does not matter beside the other lights; 0 = every digit of `tolerance` matters.
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReflectedLight {
    /// ∫ L(w) f(w, n, o) (n·w) dω over the lit ground in view \[1/sr\].
    pub per_sr: f64,
    /// Estimated error of the value \[1/sr\].
    pub err_per_sr: f64,
    /// Nodes evaluated.
    pub nodes: usize,
}

/// A surface in the frame of the vertical.
struct Facet {
    brdf: Brdf,
    normal: Vector<Vertical>,
    observer: Vector<Vertical>,
    cones: Vec<Cone>,
}

/// One interval of ζ with the values of two orders.
struct Panel {
    from: f64,
    to: f64,
    level: usize,
    /// Times this panel was halved.
    depth: u32,
    value: f64,
    err: f64,
}

/// Light from the lit ground, reflected by a surface towards the observer, per unit irradiance of the lamp.
///
/// `∫ f_E(s, p, −w) (p·s)₊ f(w, n, o) (n·w)₊ dω`, directions w from the satellite to ground points p, patch by patch.
/// The flux at the observer is this times `A (n·o)/d²`. `normal` and `observer` are unit vectors at the satellite.
#[must_use]
pub fn reflected_by_earth(
    ground: &Ground,
    brdf: &Brdf,
    normal: &Vector<Itrs>,
    observer: &Vector<Itrs>,
    accuracy: &Accuracy,
) -> ReflectedLight {
    let facet = Facet::new(brdf.clone(), ground.local(normal), ground.local(observer));
    let mut nodes = 0;
    let edges = facet.zeta_edges(ground);
    let mut panels: Vec<Panel> =
        edges.windows(2).map(|e| Panel::new(ground, &facet, (e[0], e[1]), 2, 0, &mut nodes)).collect();
    loop {
        let per_sr: f64 = panels.iter().map(|p| p.value).sum();
        let err: f64 = panels.iter().map(|p| p.err).sum();
        let enough = (accuracy.tolerance.max(1e-14) * per_sr).max(accuracy.floor_per_sr);
        let worst = panels.iter().enumerate().max_by(|a, b| a.1.err.total_cmp(&b.1.err)).map(|(i, _)| i);
        let Some(worst) = worst.filter(|_| err > enough && nodes < accuracy.max_nodes) else {
            return ReflectedLight { per_sr, err_per_sr: err, nodes };
        };
        let Panel { from, to, level, depth, value, .. } = panels[worst];
        if level + 1 < LEVELS.len() {
            let finer = facet.panel(ground, (from, to), level + 1, depth, &mut nodes);
            panels[worst] =
                Panel { level: level + 1, value: finer, err: SAFETY * (finer - value).abs(), ..panels[worst] };
        } else {
            let middle = 0.5 * (from + to);
            panels[worst] = Panel::new(ground, &facet, (from, middle), 3, depth + 1, &mut nodes);
            panels.push(Panel::new(ground, &facet, (middle, to), 3, depth + 1, &mut nodes));
        }
    }
}

impl Panel {
    /// A panel at `level`, its error from the level below.
    fn new(ground: &Ground, facet: &Facet, ends: (f64, f64), level: usize, depth: u32, nodes: &mut usize) -> Self {
        let coarse = facet.panel(ground, ends, level - 1, depth, nodes);
        let value = facet.panel(ground, ends, level, depth, nodes);
        Self { from: ends.0, to: ends.1, level, depth, value, err: SAFETY * (value - coarse).abs() }
    }
}

impl Facet {
    fn new(brdf: Brdf, normal: Vector<Vertical>, observer: Vector<Vertical>) -> Self {
        let mut cones = vec![Cone::new(normal, FRAC_PI_2, false)];
        if let Some(n) = brdf.lobe_exponent() {
            // m = 2 (n·o) n − o: ground there is seen as in a mirror
            let mirror = normal * (2.0 * normal.dot(&observer)) - observer;
            if n < LOBE_EXPONENT {
                // (r·o)ⁿ ends like xⁿ: a branch point unless n is whole, and smooth enough for Gauss from 4
                cones.push(Cone::new(mirror, FRAC_PI_2, n < SMOOTH_EXPONENT && n.fract() != 0.0));
            } else {
                let width_rad = n.powf(-0.5);
                cones.extend(
                    RINGS
                        .map(|r| r * width_rad)
                        .iter()
                        .filter(|r| **r < FRAC_PI_2)
                        .map(|r| Cone::new(mirror, *r, false)),
                );
            }
        }
        Self { brdf, normal, observer, cones }
    }

    /// Ends of the panels in ζ: the sub-satellite point, the limb, and wherever an edge touches a circle.
    fn zeta_edges(&self, ground: &Ground) -> Vec<f64> {
        let mut edges = vec![0.0, FRAC_PI_2];
        let terminator = ground.terminator_zeta();
        let tangencies = self.cones.iter().flat_map(Cone::tangent_nadir_angles);
        edges.extend(tangencies.filter_map(|eta| ground.zeta_of_nadir_angle(eta)));
        edges.extend((terminator > 0.0 && terminator < FRAC_PI_2).then_some(terminator));
        edges.extend(ground.lobe_edge_zetas());
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|b, a| *b - *a < 1e-12);
        edges
    }

    /// One panel in ζ at one level.
    fn panel(&self, ground: &Ground, (from, to): (f64, f64), level: usize, depth: u32, nodes: &mut usize) -> f64 {
        let (order_zeta, order_phi) = LEVELS[level];
        let (ts, weights) = gauss(order_zeta);
        let mut sum = 0.0;
        for (t, weight) in ts.iter().zip(weights) {
            let (x, dx) = half_cosine(*t);
            let circle = ground.circle(from + (to - from) * x);
            sum += weight * dx * circle.solid_angle * self.ring(ground, &circle, order_phi, depth, nodes);
        }
        sum * (to - from)
    }

    /// ∫ L f (n·w) dφ on one circle, over the arcs that are lit and in front of the surface.
    fn ring(&self, ground: &Ground, circle: &Circle, order: usize, depth: u32, nodes: &mut usize) -> f64 {
        let mut ends: Vec<(f64, bool)> = Vec::with_capacity(2 + 2 * self.cones.len());
        let mut cut = |crossing: Option<(f64, f64)>, kink: bool| {
            if let Some((centre, half)) = crossing {
                ends.extend([((centre - half).rem_euclid(TAU), kink), ((centre + half).rem_euclid(TAU), kink)]);
            }
        };
        cut(ground.terminator(circle), false);
        cut(ground.lobe_edge(circle), true);
        self.cones.iter().for_each(|cone| cut(cone.crossing(circle), cone.kink));
        if ends.is_empty() {
            // nothing changes on this circle: equal weights converge fastest
            if !self.matters(ground, circle, 0.0) {
                return 0.0;
            }
            let n = (2 * order) << depth.min(3);
            *nodes += n;
            let step = TAU / n as f64;
            return step * (0..n).map(|j| self.at(ground, circle, (j as f64 + 0.5) * step)).sum::<f64>();
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (ts, weights) = gauss(order);
        let mut sum = 0.0;
        for (j, (from, kink_from)) in ends.iter().enumerate() {
            let (to, kink_to) = if j + 1 < ends.len() { ends[j + 1] } else { (ends[0].0 + TAU, ends[0].1) };
            let width = to - from;
            if width <= 0.0 || !self.matters(ground, circle, from + 0.5 * width) {
                continue;
            }
            // halving in ζ cannot cure what a wide arc misses
            let clustered = *kink_from || kink_to;
            let pieces = ((width / ARC_RAD).ceil() as usize) << depth.min(3);
            let piece = width / pieces as f64;
            *nodes += pieces * ts.len();
            for start in (0..pieces).map(|p| from + piece * p as f64) {
                for (t, weight) in ts.iter().zip(weights) {
                    let (x, dx) = if clustered { end_clustered(*t) } else { (*t, 1.0) };
                    sum += weight * dx * piece * self.at(ground, circle, start + piece * x);
                }
            }
        }
        sum
    }

    /// The ground in this direction is lit and in front of the surface, whatever the lobes are there.
    fn matters(&self, ground: &Ground, circle: &Circle, phi_rad: f64) -> bool {
        let phi = phi_rad.sin_cos();
        self.normal.dot(&circle.direction(phi)) > 0.0 && ground.lamp_height(circle, phi) > 0.0
    }

    /// The integrand L f (n·w) in the direction (circle, φ).
    fn at(&self, ground: &Ground, circle: &Circle, phi_rad: f64) -> f64 {
        let phi = phi_rad.sin_cos();
        let w = circle.direction(phi);
        let cos_in = self.normal.dot(&w);
        if cos_in <= 0.0 {
            return 0.0;
        }
        ground.radiance(circle, phi, &w) * self.brdf.value(&w, &self.normal, &self.observer) * cos_in
    }
}
