//! The scattering laws by name and parameters.

use super::binomial::Binomial;
use std::sync::Arc;

/// Largest Phong exponent: half width 0.07°, narrower than the disc of the Sun, so that a mirror is meant.
pub const PHONG_N_MAX: f64 = 1e6;

/// A bidirectional reflectance distribution function.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Brdf {
    /// f = ρ/π.
    Lambert {
        /// Albedo ρ, 0 to 1.
        albedo: f64,
    },
    /// f = k_d/π + k_s (n+2)/2π max(0, r·o)ⁿ, r = 2(i·n)n − i.
    Phong {
        /// Diffuse share k_d.
        kd: f64,
        /// Specular share k_s.
        ks: f64,
        /// Exponent n; at n = 0 the lobe is the half-space r·o > 0, the limit n → 0.
        n: f64,
    },
    /// lg f = Σ_k Vᵏ [Σ_i B_ki Dⁱ + ½ Σ_i C_ki lg(1 + d^(i+l1) D²)] (Greynolds), see [`Binomial`].
    Binomial(Arc<Binomial>),
    /// f = A/(B + D^g).
    Abg {
        /// A.
        a: f64,
        /// B.
        b: f64,
        /// g.
        g: f64,
    },
    /// f = A exp((r·o − 1)/σ).
    Gaussian {
        /// Peak A \[1/sr\].
        peak_per_sr: f64,
        /// Width σ: half the square of the angle at which f has fallen to 1/e.
        sigma: f64,
    },
    /// A mirror: radiance is conserved, so that the source's disc is seen in it. Its f is infinite in one direction.
    Mirror {
        /// Reflectance, 0 to 1.
        reflectance: f64,
    },
}
