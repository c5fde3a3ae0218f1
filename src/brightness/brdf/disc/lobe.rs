//! The average over a light source's disc of a lobe about the mirror direction: a power of the cosine, or a Gaussian.
//!
//! In polar coordinates (γ, ψ) about the observer's mirror direction m the lobe depends on γ alone, and the cosine over
//! an arc of the disc at one γ has a closed form: one integral is left, over t = 1 − cos γ.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{View, solid_angle};
use crate::base::quadrature::{gauss, half_cosine};

/// Relative error aimed at.
const TOLERANCE: f64 = 1e-9;
/// Largest first term of the series over the disc.
const SERIES_MAX: f64 = 0.05;
/// A lobe that is nowhere on the disc above this is taken at its point value \[1/sr\]: 40 mag below a white surface.
const NIL_PER_SR: f64 = 1e-17;
/// The lobe is followed until it has fallen by e to this power.
const FALL: f64 = 40.0;
/// Nodes of a panel.
const ORDER: usize = 16;
/// Smallest share of the integrated range that gets a panel of its own.
const FINEST_SHARE: f64 = 1e-13;

/// f(γ) = peak · shape(1 − cos γ).
pub(super) struct Lobe {
    peak_per_sr: f64,
    shape: Shape,
}

enum Shape {
    /// max(0, c)ⁿ.
    CosinePower(f64),
    /// exp((c − 1)/σ).
    Gaussian(f64),
}

impl Lobe {
    pub(super) fn cosine_power(peak_per_sr: f64, n: f64) -> Self {
        Self { peak_per_sr, shape: Shape::CosinePower(n) }
    }

    pub(super) fn gaussian(peak_per_sr: f64, sigma: f64) -> Self {
        Self { peak_per_sr, shape: Shape::Gaussian(sigma) }
    }

    /// f at t = 1 − cos γ \[1/sr\].
    fn at(&self, t: f64) -> f64 {
        self.peak_per_sr
            * match self.shape {
                Shape::CosinePower(n) if t < 1.0 => (n * (-t).ln_1p()).exp(),
                Shape::CosinePower(_) => 0.0,
                Shape::Gaussian(sigma) => (-t / sigma).exp(),
            }
    }

    /// The t at which f has fallen by exp(−[`FALL`]) from its value at `t`, or has ended.
    fn fallen(&self, t: f64) -> f64 {
        match self.shape {
            Shape::CosinePower(n) => t - (1.0 - t) * (-FALL / n).exp_m1(),
            Shape::Gaussian(sigma) => (t + FALL * sigma).min(2.0),
        }
    }

    /// `d ln f/dγ` squared plus twice its curvature \[rad⁻²\]: how fast f changes.
    fn unrest(&self, t: f64) -> f64 {
        let (c, sin2) = (1.0 - t, t * (2.0 - t));
        match self.shape {
            Shape::CosinePower(n) => (n * n * sin2 + 2.0 * n) / (c * c),
            Shape::Gaussian(sigma) => sin2 / (sigma * sigma) + 2.0 / sigma,
        }
    }

    /// ∇²(f μ) and ∇⁴(f μ) over f, on the sphere of light source directions: μ = n·s, k = n·m, ∇μ·∇c = k − c μ.
    fn laplacians(&self, t: f64, mu: f64, k: f64) -> (f64, f64) {
        let c = 1.0 - t;
        match self.shape {
            Shape::CosinePower(n) => {
                let q = 1.0 / (c * c);
                // ∇²(c^j μ) = j(j−1) c^(j−2) μ − (j+1)(j+2) c^j μ + 2 j k c^(j−1); ∇² c^j = j(j−1) c^(j−2) − j(j+1) c^j
                let once = n * (n - 1.0) * q - (n + 1.0) * (n + 2.0);
                let twice =
                    n * (n - 1.0) * ((n - 2.0) * (n - 3.0) * q - n * (n - 1.0)) * q - (n + 1.0) * (n + 2.0) * once;
                let side = n * (n - 1.0) * (n - 2.0) * q - n * (n + 1.0) * (n + 2.0) + n * (n - 1.0) * (n - 2.0) * q
                    - n * n * (n - 1.0);
                (mu * once + 2.0 * k * n / c, mu * twice + 2.0 * k * side / c)
            }
            Shape::Gaussian(sigma) => {
                let (s, sin2) = (1.0 / sigma, t * (2.0 - t));
                // f' = s f: ∇²(A f μ) = [sin²γ (A'' + 2sA' + s²A) − 4c (A' + sA) − 2A] f μ + 2k (A' + sA) f
                let (once, slope, curve) = (sin2 * s * s - 4.0 * c * s - 2.0, -2.0 * c * s * s - 4.0 * s, -2.0 * s * s);
                let twice = sin2 * (curve + 2.0 * s * slope + s * s * once) - 4.0 * c * (slope + s * once) - 2.0 * once;
                let side = 2.0 * k * s;
                let side_twice = 2.0 * k * (slope + s * once) + (sin2 * s * s - 2.0 * c * s) * side;
                (mu * once + side, mu * twice + side_twice)
            }
        }
    }
}

/// Mean over the disc of f max(0, n·s') \[1/sr\], next to a diffuse part `diffuse` that sets what is negligible.
pub(super) fn mean(view: &View, lobe: &Lobe, diffuse: f64) -> f64 {
    let [.., mu] = view.light_source;
    let t = view.versine_apart();
    let at_centre = lobe.at(t);
    // mean = [1 + x/4 ∇² + x²/48 ∇²(∇² + 2) + …] f μ, x = 1 − cos α; the terms fall like ε, ε²/2, …
    let x = versine(view.disc_rad);
    let epsilon = 0.25 * x * lobe.unrest(t);
    let lit_to_the_edge = match lobe.shape {
        Shape::CosinePower(_) => 1.0 - t > 2.0 * view.sin_disc,
        Shape::Gaussian(_) => true,
    };
    if view.cut == 0.0 && lit_to_the_edge && epsilon < SERIES_MAX {
        let neglected = at_centre * (mu + view.sin_disc) * epsilon * epsilon * epsilon;
        if neglected <= TOLERANCE * (at_centre * mu + diffuse) {
            let (once, twice) = lobe.laplacians(t, mu, view.mirror[2]);
            return at_centre * (mu + 0.25 * x * once + x * x / 48.0 * (twice + 2.0 * once));
        }
    }
    let nearest = (view.apart_rad() - view.disc_rad).max(0.0);
    let most = lobe.at(versine(nearest)) * (mu.max(0.0) + view.sin_disc);
    if most <= NIL_PER_SR.max(1e-12 * diffuse) {
        return at_centre * mu.max(0.0);
    }
    integral(view, lobe) / solid_angle(view.disc_rad)
}

/// ∫ f max(0, n·s') dω' over the disc.
fn integral(view: &View, lobe: &Lobe) -> f64 {
    let arcs = Arcs::new(view);
    let (apart, disc) = (view.apart_rad(), view.disc_rad);
    let tangent = versine(disc - apart);
    let from = if apart > disc { tangent } else { 0.0 };
    let to = lobe.fallen(from).min(versine((apart + disc).min(PI)));
    let range = to - from;
    if !(range > 0.0) {
        return 0.0;
    }
    let mut breaks = vec![from, from + range / 16.0, from + range / 4.0, to, tangent];
    // the arc is a function of tangent/t: panels that grow with t
    breaks.extend(
        std::iter::successors(Some(tangent.max(FINEST_SHARE * range)), |t| Some(4.0 * t)).take_while(|t| *t < to),
    );
    // where the horizon of the surface comes into view, and where it meets the disc's edge
    let tilt = arcs.sin_tilt.atan2(arcs.cos_tilt);
    breaks.extend([versine(FRAC_PI_2 - tilt), versine(FRAC_PI_2 + tilt)]);
    if view.cut > 0.0 {
        for phi in [view.cut, -view.cut] {
            let off: f64 = view.edge(phi).iter().zip(view.mirror).map(|(e, m)| (e - m) * (e - m)).sum();
            breaks.push(0.5 * off);
        }
    }
    breaks.retain(|t| (from..=to).contains(t));
    breaks.sort_by(f64::total_cmp);
    let (nodes, weights) = gauss(ORDER);
    let mut sum = 0.0;
    for panel in breaks.windows(2) {
        let length = panel[1] - panel[0];
        if !(length > 0.0) {
            continue;
        }
        for (x, weight) in nodes.iter().zip(weights) {
            let (share, slope) = half_cosine(*x);
            let t = panel[0] + length * share;
            sum += weight * slope * length * lobe.at(t) * arcs.cosine(t);
        }
    }
    sum
}

/// The arcs of the disc about the mirror direction.
struct Arcs {
    apart_rad: f64,
    disc_rad: f64,
    /// Of the angle between m and the normal.
    sin_tilt: f64,
    cos_tilt: f64,
    /// Azimuth of the light source about m, from the normal \[rad\].
    azimuth: f64,
}

impl Arcs {
    fn new(view: &View) -> Self {
        let [mx, my, mz] = view.mirror;
        // n and s about m: both minus their parts along m; s − m has no cancellation
        let sin_tilt = mx.hypot(my);
        let normal = [-mz * mx, -mz * my, sin_tilt * sin_tilt];
        let apart = view.apart.map(|x| -x);
        let along = apart[0] * mx + apart[1] * my + apart[2] * mz;
        let light_source = [apart[0] - along * mx, apart[1] - along * my, apart[2] - along * mz];
        let dot = normal[0] * light_source[0] + normal[1] * light_source[1] + normal[2] * light_source[2];
        let cross = [
            normal[1] * light_source[2] - normal[2] * light_source[1],
            normal[2] * light_source[0] - normal[0] * light_source[2],
            normal[0] * light_source[1] - normal[1] * light_source[0],
        ];
        let azimuth = (cross[0] * mx + cross[1] * my + cross[2] * mz).abs().atan2(dot);
        Self { apart_rad: view.apart_rad(), disc_rad: view.disc_rad, sin_tilt, cos_tilt: mz, azimuth }
    }

    /// ∫ max(0, n·s') dψ over the part of the ring at t = 1 − cos γ that lies on the disc.
    fn cosine(&self, t: f64) -> f64 {
        let gamma = 2.0 * (0.5 * t).sqrt().min(1.0).asin();
        let (c, s) = ((1.0 - t) * self.cos_tilt, gamma.sin() * self.sin_tilt);
        // sin²(w/2) = sin((α + γ − δ)/2) sin((α − γ + δ)/2) / (sinγ sinδ)
        let inside = (0.5 * (self.disc_rad + gamma - self.apart_rad)).sin()
            * (0.5 * (self.disc_rad - gamma + self.apart_rad)).sin();
        let scale = gamma.sin() * self.apart_rad.sin();
        let half = if inside >= scale { PI } else { 2.0 * (inside / scale).max(0.0).sqrt().asin() };
        let lit = if c >= s {
            PI
        } else if c <= -s {
            return 0.0;
        } else {
            (-c / s).acos()
        };
        // ∫ (c + s cosψ) dψ over the common part of azimuth ± half and 0 ± lit, or that a turn further
        let common = |from: f64, to: f64| {
            let (from, to) = (from.max(self.azimuth - half), to.min(self.azimuth + half));
            if to > from { c * (to - from) + s * (to.sin() - from.sin()) } else { 0.0 }
        };
        common(-lit, lit) + common(TAU - lit, TAU + lit)
    }
}

/// 1 − cos γ without cancellation.
fn versine(gamma_rad: f64) -> f64 {
    let half = (0.5 * gamma_rad).sin();
    2.0 * half * half
}
