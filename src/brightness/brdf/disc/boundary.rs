//! `∫ P(D) dψ` along a closed curve about the point D = 0: Green's theorem for f(D) over the area inside.
//!
//! Panels grow away from each place where the curve comes near the point, so that a lobe on the very edge costs a few
//! panels more, not accuracy.

use crate::base::quadrature::gauss;
use crate::base::search::{Until, bisect};
use std::convert::Infallible;

/// Nodes of a panel.
const ORDER: usize = 16;
/// Growth of panels.
const GROWTH: f64 = 3.0;
/// Places looked at for the nearest ones.
const SAMPLES: usize = 24;
/// Smallest first panel, of the parameter of the curve.
const FINEST: f64 = 1e-8;

/// A point of a curve relative to D = 0: position, first and second derivative by its parameter.
pub(super) struct CurvePoint {
    pub at: [f64; 2],
    pub velocity: [f64; 2],
    pub acceleration: [f64; 2],
}

impl CurvePoint {
    pub(super) fn distance(&self) -> f64 {
        self.at[0].hypot(self.at[1])
    }

    /// Half the derivative of the squared distance.
    fn receding(&self) -> f64 {
        self.at[0] * self.velocity[0] + self.at[1] * self.velocity[1]
    }
}

/// ∫ P dψ over the parameter `from` to `to`; `p_over_d2(at, D)` = P/D², finite at D = 0.
pub(super) fn circulation(
    curve: &impl Fn(f64) -> CurvePoint,
    from: f64,
    to: f64,
    p_over_d2: &impl Fn([f64; 2], f64) -> f64,
) -> f64 {
    let near = nearest(curve, from, to);
    let (nodes, weights) = gauss(ORDER);
    let panel = |low: f64, high: f64| {
        let mut sum = 0.0;
        for (x, weight) in nodes.iter().zip(weights) {
            let point = curve(low + (high - low) * x);
            // D² dψ = x dy − y dx
            let swept = point.at[0] * point.velocity[1] - point.at[1] * point.velocity[0];
            sum += weight * swept * p_over_d2(point.at, point.distance());
        }
        sum * (high - low)
    };
    let mut sum = 0.0;
    for (i, centre) in near.iter().enumerate() {
        let low = if i == 0 { from } else { 0.5 * (near[i - 1] + centre) };
        let high = near.get(i + 1).map_or(to, |next| 0.5 * (next + centre));
        let point = curve(*centre);
        let [speed, bend] = [point.velocity, point.acceleration].map(|v| v[0].hypot(v[1]).max(f64::MIN_POSITIVE));
        let scale = (point.distance() / speed).min((2.0 * point.distance() / bend).sqrt()).max(FINEST);
        for (end, sign) in [(low, -1.0), (high, 1.0)] {
            let length = (end - centre) * sign;
            let mut reached = 0.0;
            let mut next = scale;
            while reached < length {
                let stop = if next > 0.7 * length { length } else { next };
                let (a, b) = (centre + sign * reached, centre + sign * stop);
                sum += if sign > 0.0 { panel(a, b) } else { panel(b, a) };
                reached = stop;
                next *= GROWTH;
            }
        }
    }
    sum
}

/// The parameters at which the curve comes nearest to D = 0, each a minimum of its own, in rising order.
pub(super) fn nearest(curve: &impl Fn(f64) -> CurvePoint, from: f64, to: f64) -> Vec<f64> {
    let at = |k: usize| from + (to - from) * k as f64 / SAMPLES as f64;
    let samples: Vec<CurvePoint> = (0..=SAMPLES).map(|k| curve(at(k))).collect();
    let mut found = Vec::new();
    if samples[0].receding() >= 0.0 {
        found.push(from);
    }
    for k in 0..SAMPLES {
        if samples[k].receding() < 0.0 && samples[k + 1].receding() >= 0.0 {
            let approaches = |u: f64| Ok::<bool, Infallible>(curve(u).receding() < 0.0);
            let Ok([_, high]) = bisect(at(k), at(k + 1), Until::Steps(45), approaches);
            found.push(high);
        }
    }
    if samples[SAMPLES].receding() < 0.0 {
        found.push(to);
    }
    if found.is_empty() {
        found.push(from);
    }
    found
}
