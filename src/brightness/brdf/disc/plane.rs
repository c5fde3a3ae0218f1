//! The average over a light source's disc of a law of D (and V): in the plane of the surface, where (n·s') dω' =
//! d²s'_t.
//!
//! The disc projects to an ellipse, cut by the unit circle where the surface's horizon cuts the disc, and f depends on
//! the distance D from m_t. Far from m_t seven points do; near it the integral goes along the ellipse's edge, exactly.

use std::f64::consts::TAU;

use super::boundary::{CurvePoint, circulation, nearest};
use super::primitive::Primitive;
use super::{View, solid_angle};
use crate::base::quadrature::gauss;
use crate::brightness::brdf::Binomial;
use crate::brightness::brdf::law::Brdf;

/// Largest ratio of the disc to its distance from the peak for which seven points are tried.
const FAR: f64 = 0.05;
/// Largest relative change of f over the disc with which they are good to 1e-8.
const GENTLE: f64 = 0.2;
/// Nodes of a panel of D along a ray, for laws that depend on V.
const RAY_ORDER: usize = 12;

/// Mean over the disc of f max(0, n·s') \[1/sr\].
pub(super) fn mean(view: &View, brdf: &Brdf) -> f64 {
    if view.cut == 0.0
        && let Some(mean) = seven_points(view, brdf)
    {
        return mean * view.mean_cosine();
    }
    let [sin_source, _, cos_source] = view.light_source;
    let [mx, my, _] = view.mirror;
    let half = (0.5 * view.disc_rad).sin();
    // relative to m_t, without the cancellation of s_t − m_t
    let centre = [-view.apart[0] - 2.0 * half * half * sin_source, -view.apart[1]];
    let (p, q) = (view.sin_disc * cos_source, view.sin_disc);
    let edge = |phi: f64| {
        let (sin, cos) = phi.sin_cos();
        CurvePoint {
            at: [centre[0] + p * cos, centre[1] + q * sin],
            velocity: [-p * sin, q * cos],
            acceleration: [-p * cos, -q * sin],
        }
    };
    let horizon = |azimuth: f64| {
        let (sin, cos) = azimuth.sin_cos();
        CurvePoint { at: [cos - mx, sin - my], velocity: [-sin, cos], acceleration: [-cos, -sin] }
    };
    let (from, to) = (view.cut, TAU - view.cut);
    let meets = if view.cut > 0.0 { view.cut_azimuth() } else { 0.0 };
    let least = nearest(&edge, from, to).into_iter().map(|phi| edge(phi).distance());
    let least = least.chain(nearest(&horizon, -meets, meets).into_iter().map(|a| horizon(a).distance()));
    let least = least.fold(f64::INFINITY, f64::min);
    // an upper bound for every D on the boundary
    let most = centre[0].hypot(centre[1]) + p.abs().max(q) + if view.cut > 0.0 { 2.0 * meets.abs() } else { 0.0 };
    // with m_t outside, and not just outside, P is counted from the nearest point, so that nothing cancels
    let outside = view.apart_rad() > view.disc_rad && least > 0.3 * q;
    let start = if outside { least * (1.0 - 1e-12) } else { 0.0 };
    let most = most.min(2.0).max(start);
    let total = |p_over_d2: &dyn Fn([f64; 2], f64) -> f64| {
        let p_over_d2 = |at, d| p_over_d2(at, d);
        let along_edge = circulation(&edge, from, to, &p_over_d2);
        if view.cut > 0.0 { along_edge + circulation(&horizon, -meets, meets, &p_over_d2) } else { along_edge }
    };
    let first = first_panel(brdf, most);
    let sum = match brdf {
        Brdf::Binomial(law) if law.rows() > 1 => {
            let m2 = mx * mx + my * my;
            total(&|at: [f64; 2], d: f64| {
                // V = m_t·q, q = m_t + D e
                let rise = if d > 0.0 { (at[0] * mx + at[1] * my) / d } else { 0.0 };
                along_ray(law, start, d, first, |d| m2 + d * rise) / (d * d).max(f64::MIN_POSITIVE)
            })
        }
        _ => {
            let f = |d: f64| of_d(brdf, d);
            let table = Primitive::new(start, most, first, f);
            let peak = 0.5 * f(0.0);
            total(&|_, d: f64| if d > 1e-12 { table.at(d) / (d * d) } else { peak })
        }
    };
    (sum / solid_angle(view.disc_rad)).max(0.0)
}

/// f of a law of D alone \[1/sr\].
fn of_d(brdf: &Brdf, d: f64) -> f64 {
    match brdf {
        Brdf::Abg { a, b, g } => a / (b + d.powf(*g)),
        Brdf::Binomial(law) => law.value(d, 0.0),
        _ => f64::NAN,
    }
}

/// End of the first panel of D: there f is nearly constant, or analytic.
fn first_panel(brdf: &Brdf, most: f64) -> f64 {
    match brdf {
        // D^g has a cusp at 0
        Brdf::Abg { b, g, .. } => 1e-3 * b.powf(1.0 / g.max(0.1)).max(1e-30).min(most),
        Brdf::Binomial(law) => law.finest() / 8.0,
        _ => most,
    }
}

/// Mean of f over the ellipse by the rule of seven points (degree 5), where that is good to 1e-8.
fn seven_points(view: &View, brdf: &Brdf) -> Option<f64> {
    let [sin_source, _, cos_source] = view.light_source;
    let [mx, my, _] = view.mirror;
    let half = (0.5 * view.disc_rad).sin();
    let centre = [-view.apart[0] - 2.0 * half * half * sin_source, -view.apart[1]];
    if view.sin_disc > FAR * centre[0].hypot(centre[1]) {
        return None;
    }
    let f = |x: f64, y: f64| match brdf {
        Brdf::Binomial(law) => law.value(x.hypot(y), (x + mx) * mx + (y + my) * my),
        _ => of_d(brdf, x.hypot(y)),
    };
    let middle = f(centre[0], centre[1]);
    // weight 1/4 in the middle, 1/8 at each of six points at r² = 2/3
    let r = view.sin_disc * (2.0_f64 / 3.0).sqrt();
    let mut sum = 0.25 * middle;
    let h = 0.75_f64.sqrt();
    for (cos, sin) in [(1.0, 0.0), (0.5, h), (-0.5, h), (-1.0, 0.0), (-0.5, -h), (0.5, -h)] {
        let value = f(centre[0] + r * cos * cos_source, centre[1] + r * sin);
        if (value - middle).abs() > GENTLE * middle {
            return None;
        }
        sum += 0.125 * value;
    }
    Some(sum)
}

/// ∫ f(D, V(D)) D dD from `start` to `d` along a ray from m_t.
fn along_ray(law: &Binomial, start: f64, d: f64, first: f64, v: impl Fn(f64) -> f64) -> f64 {
    let (nodes, weights) = gauss(RAY_ORDER);
    let mut sum = 0.0;
    let (mut low, mut high) = (start, first.max(2.0 * start));
    while low < d {
        let end = if d < 1.2 * high { d } else { high };
        for (x, weight) in nodes.iter().zip(weights) {
            let at = low + (end - low) * x;
            sum += weight * (end - low) * at * law.value(at, v(at));
        }
        (low, high) = (end, 2.0 * end);
    }
    sum
}
