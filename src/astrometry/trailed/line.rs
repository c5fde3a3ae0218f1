//! The profile of a star trail: Moffat's line-spread function across, error functions at its ends.
//!
//! Pixels. The line-spread function of a Moffat profile is one itself, with exponent β − ½. It does not cover elongated images.

use statrs::function::erf::erf;
use statrs::function::gamma::ln_gamma;

use crate::base::constants::FWHM_PER_SIGMA;

/// Beyond this many σ an end is none any more.
const END_SIGMA: f64 = 4.5;

/// The light of a trail across, per pixel of its length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSpread {
    /// FWHM of the star \[px\].
    pub fwhm_px: f64,
    /// Moffat's exponent; infinite for a Gaussian.
    pub beta: f64,
    norm: f64,
    /// α² of Moffat, σ² of a Gaussian.
    width2: f64,
}

impl LineSpread {
    /// Of stars with this FWHM and exponent: L(v) = Γ(β−½)/(√π Γ(β−1) α) (1 + v²/α²)^(½−β), Σ L = 1.
    #[must_use]
    pub fn new(fwhm_px: f64, beta: f64) -> Self {
        let pi = std::f64::consts::PI;
        if beta > 50.0 {
            let sigma = fwhm_px / FWHM_PER_SIGMA;
            return Self {
                fwhm_px,
                beta: f64::INFINITY,
                norm: 1.0 / (sigma * (2.0 * pi).sqrt()),
                width2: sigma * sigma,
            };
        }
        let alpha = fwhm_px / (2.0 * (2f64.powf(1.0 / beta) - 1.0).sqrt());
        let norm = (ln_gamma(beta - 0.5) - ln_gamma(beta - 1.0)).exp() / (pi.sqrt() * alpha);
        Self { fwhm_px, beta, norm, width2: alpha * alpha }
    }

    /// L(v) and dL/dv.
    #[must_use]
    pub fn at(&self, v_px: f64) -> (f64, f64) {
        if self.beta.is_infinite() {
            let l = self.norm * (-0.5 * v_px * v_px / self.width2).exp();
            return (l, -v_px / self.width2 * l);
        }
        let p = self.beta - 0.5;
        let l = self.norm * (1.0 + v_px * v_px / self.width2).powf(-p);
        (l, -2.0 * p * v_px / (self.width2 + v_px * v_px) * l)
    }

    /// How far from the middle of a trail its light counts \[px\].
    #[must_use]
    pub fn reach_px(&self) -> f64 {
        if self.beta.is_infinite() { 2.0 * self.fwhm_px } else { 4.0 * self.fwhm_px }
    }

    /// Share of the light at u of a trail from `start` to `end`, and its derivatives by `start` and by `end`.
    #[must_use]
    pub fn along(&self, u_px: f64, start_px: f64, end_px: f64) -> (f64, f64, f64) {
        let sigma = self.fwhm_px / FWHM_PER_SIGMA;
        let one = |x: f64| {
            if x > END_SIGMA {
                (1.0, 0.0)
            } else if x < -END_SIGMA {
                (0.0, 0.0)
            } else {
                let density = (-0.5 * x * x).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
                (0.5 * (1.0 + erf(x / std::f64::consts::SQRT_2)), density)
            }
        };
        let (s, ds) = one((u_px - start_px) / sigma);
        let (e, de) = one((u_px - end_px) / sigma);
        (s - e, -ds, de)
    }
}
