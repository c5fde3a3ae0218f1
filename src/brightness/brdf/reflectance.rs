//! The directional-hemispherical reflectance: which share of the light falling in leaves again.
//!
//! One quadrature for each symmetry: laws of the angle to the mirror direction in polar coordinates about it, laws of
//! D in the plane of the surface, where (n·o) dω = d²o_t.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::binomial::{Binomial, power_of_ten};
use super::law::Brdf;
use crate::base::quadrature::{end_clustered, gauss, half_cosine};

/// Nodes of a panel about the mirror direction.
const LOBE_ORDER: usize = 40;
/// Nodes of a panel of D, a factor of two wide.
const D_ORDER: usize = 16;
/// Nodes of an arc at one D, for laws that depend on V too.
const ARC_ORDER: usize = 24;

impl Brdf {
    /// Share of the light falling in at `incidence_rad` (0 to π/2) that leaves again: `∫ f (n·o) dω` over the
    /// hemisphere.
    ///
    /// Good to 1e-6, for the laws known by name to 1e-9; a binomial law steeper than some D^±50 is less well known.
    #[must_use]
    pub fn hemispherical_reflectance(&self, incidence_rad: f64) -> f64 {
        let incidence_rad = incidence_rad.abs().min(FRAC_PI_2);
        let (sin_i, cos_i) = incidence_rad.sin_cos();
        match self {
            Brdf::Lambert { albedo } => *albedo,
            Brdf::Mirror { reflectance } => *reflectance,
            Brdf::Phong { kd, ks, n } => {
                // u = cⁿ⁺¹, c = cos γ: ∫ cⁿ ring dc = 1/(n+1) ∫₀¹ ring du
                let horizon = sin_i.powf(n + 1.0);
                let lobe = about_mirror(&[0.0, horizon, 1.0], sin_i, cos_i, |u| -(u.ln() / (n + 1.0)).exp_m1());
                kd + ks * (n + 2.0) / (TAU * (n + 1.0)) * lobe
            }
            Brdf::Gaussian { peak_per_sr, sigma } => {
                // u = exp((c − 1)/σ): ∫ exp((c − 1)/σ) ring dc = σ ∫ ring du
                let horizon = (-cos_i * cos_i / (1.0 + sin_i) / sigma).exp();
                let end = (-(1.0 + sin_i) / sigma).exp();
                peak_per_sr * sigma * about_mirror(&[end, horizon, 1.0], sin_i, cos_i, |u| -sigma * u.ln())
            }
            Brdf::Abg { a, b, g } => {
                let finest = b.powf(1.0 / g.max(0.1)).clamp(1e-30, 1.0);
                in_plane(sin_i, cos_i, finest, |d, half| 2.0 * half * a / (b + d.powf(*g)))
            }
            Brdf::Binomial(law) => in_plane(sin_i, cos_i, law.finest(), |d, half| binomial_arc(law, sin_i, d, half)),
        }
    }

    /// The largest [`Brdf::hemispherical_reflectance`] over all incidences.
    #[must_use]
    pub fn max_reflectance(&self) -> f64 {
        self.largest_reflectance().0
    }

    /// The largest reflectance and the incidence \[rad\] it belongs to: a grid, then golden sections about its best.
    pub(super) fn largest_reflectance(&self) -> (f64, f64) {
        const GRID_DEG: [f64; 10] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 78.0, 84.0, 88.0, 90.0];
        if let Brdf::Lambert { albedo: same } | Brdf::Mirror { reflectance: same } = *self {
            return (same, 0.0);
        }
        let at = |rad: f64| (self.hemispherical_reflectance(rad), rad);
        let larger = |a: (f64, f64), b: (f64, f64)| if b.0 > a.0 || b.0.is_nan() { b } else { a };
        let grid: Vec<(f64, f64)> = GRID_DEG.iter().map(|deg| at(deg.to_radians())).collect();
        let mut best = 0;
        for k in 1..grid.len() {
            // a rounding error is not a maximum: flat laws stay at normal incidence
            if grid[k].0 > grid[best].0 * (1.0 + 1e-12) {
                best = k;
            }
        }
        let (mut low, mut high) = (grid[best.saturating_sub(1)].1, grid[(best + 1).min(grid.len() - 1)].1);
        let mut found = grid[best];
        if best == 0 {
            // falls from normal incidence, as nearly every law does: one look next to it is enough
            let off_normal = at(0.3 * high);
            if off_normal.0 <= found.0 * (1.0 + 1e-12) {
                return found;
            }
        }
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut left, mut right) = (at(high - golden * (high - low)), at(low + golden * (high - low)));
        for _ in 0..12 {
            found = larger(found, larger(left, right));
            if left.0 > right.0 {
                (high, right) = (right.1, left);
                left = at(high - golden * (high - low));
            } else {
                (low, left) = (left.1, right);
                right = at(low + golden * (high - low));
            }
        }
        larger(found, larger(left, right))
    }
}

/// `∫ ring(t(u)) du` over the panels between `breaks`, t = 1 − cos γ.
fn about_mirror(breaks: &[f64], sin_i: f64, cos_i: f64, t_of_u: impl Fn(f64) -> f64) -> f64 {
    let (nodes, weights) = gauss(LOBE_ORDER);
    let mut sum = 0.0;
    for panel in breaks.windows(2) {
        let length = panel[1] - panel[0];
        if !(length > 0.0) {
            continue;
        }
        for (x, weight) in nodes.iter().zip(weights) {
            let (share, slope) = end_clustered(*x);
            let t = t_of_u(panel[0] + length * share);
            sum += weight * slope * length * ring(t, sin_i, cos_i);
        }
    }
    sum
}

/// `∫ max(0, c cosθ + sqrt(1−c²) sinθ cosψ) dψ`, c = 1 − t: the cosine over a ring about the mirror direction.
fn ring(t: f64, sin_i: f64, cos_i: f64) -> f64 {
    let (a, b) = ((1.0 - t) * cos_i, (t * (2.0 - t)).max(0.0).sqrt() * sin_i);
    if a >= b {
        TAU * a
    } else if a <= -b {
        0.0
    } else {
        let edge = (-a / b).acos();
        2.0 * (a * edge + b * edge.sin())
    }
}

/// `∫ D dD ∫ f dψ` over the unit disc about the point m_t at `sin_i` from its centre.
///
/// The arc of the circle of radius D inside the disc reaches `half` \[rad\] to either side of the direction to the
/// centre; `on_arc(D, half)` = ∫ f dψ over it.
fn in_plane(sin_i: f64, cos_i: f64, finest: f64, on_arc: impl Fn(f64, f64) -> f64) -> f64 {
    let tangent = cos_i * cos_i / (1.0 + sin_i); // 1 − sinθ; beyond it the arc opens with a square root
    let end = 1.0 + sin_i;
    let ladder = std::iter::successors(Some(finest / 8.0), |d| Some(2.0 * d)).take_while(|d| *d < end);
    let mut breaks: Vec<f64> = ladder.chain([0.0, tangent, end]).collect();
    breaks.sort_by(f64::total_cmp);
    let (nodes, weights) = gauss(D_ORDER);
    let mut sum = 0.0;
    for panel in breaks.windows(2) {
        let length = panel[1] - panel[0];
        for (x, weight) in nodes.iter().zip(weights) {
            let (share, slope) = half_cosine(*x);
            let d = panel[0] + length * share;
            let half = if panel[1] <= tangent {
                PI
            } else {
                // tan²(half/2) = (1 + s − D)(1 + D − s) / ((D − (1 − s))(1 + D + s)), differences from the nearer end
                let above = (end - panel[1]) + length * (1.0 - share);
                let below = (panel[0] - tangent) + length * share;
                2.0 * (above * (1.0 + d - sin_i)).max(0.0).sqrt().atan2((below * (1.0 + d + sin_i)).max(0.0).sqrt())
            };
            sum += weight * slope * length * d * on_arc(d, half);
        }
    }
    sum
}

/// ∫ f dψ over an arc for the binomial law; V = s² − s D cosψ, ψ from the direction to the centre.
fn binomial_arc(law: &Binomial, sin_i: f64, d: f64, half: f64) -> f64 {
    if law.rows() <= 1 {
        return 2.0 * half * law.value(d, 0.0);
    }
    let rows: Vec<f64> = (0..law.rows()).map(|k| law.row(k, d)).collect();
    let (nodes, weights) = gauss(ARC_ORDER);
    let mut sum = 0.0;
    for (x, weight) in nodes.iter().zip(weights) {
        let v = sin_i * (sin_i - d * (half * x).cos());
        let lg_f = rows.iter().rev().fold(0.0, |sum, row| sum * v + row);
        sum += weight * power_of_ten(lg_f);
    }
    2.0 * half * sum
}
