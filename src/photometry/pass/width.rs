//! How wide the target of a pass is, by all frames that show it: size, seeing of the moment and smear together.
//!
//! Squares of the diameter of an even disc seen through the star profile, in FWHM² of the night's stars. It does not cover widths that
//! change within the pass.

use crate::base::constants::FWHM_PER_SIGMA;

/// What is expected before any detection: the width of a star, and by how much a pass differs from it. Seeing that is a sixth
/// wider than in the star frames is a disc of 1 FWHM² \[FWHM²\].
const PRIOR_ERR: f64 = 1.0;
/// Images are not narrower than this share of the stars' width.
const LEAST_RATIO: f64 = 0.7;

/// The width of the target of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// Square of the diameter of the disc, negative where it is narrower than a star \[FWHM²\].
    pub disc2: f64,
    /// Its error \[FWHM²\].
    pub err: f64,
}

impl Default for Width {
    fn default() -> Self {
        Self { disc2: 0.0, err: PRIOR_ERR }
    }
}

impl Width {
    /// The mean of measured squares of the diameter and their errors, with the prior: D² = Σ d/σ² / (Σ 1/σ² + 1/σ_0²).
    #[must_use]
    pub fn of(measured: &[(f64, f64)]) -> Self {
        let usable = measured.iter().filter(|(d, err)| d.is_finite() && *err > 0.0);
        let (sum, weight) =
            usable.fold((0.0, PRIOR_ERR.powi(-2)), |(s, w), (d, err)| (s + d / (err * err), w + 1.0 / (err * err)));
        Self { disc2: sum / weight, err: weight.sqrt().recip() }
    }

    /// FWHM of the images over that of the night's stars: √(1 + D² 8 ln 2/16), a disc having σ² = D²/16 per axis.
    #[must_use]
    pub fn of_star(&self) -> f64 {
        (1.0 + self.growth() * self.disc2).max(LEAST_RATIO * LEAST_RATIO).sqrt()
    }

    /// Error of a flux by that of the width, as a share of it: for Gaussians F ∝ 2σ_t²/(σ_t² + σ_s²), dF/F = dσ_t²/2σ_t².
    #[must_use]
    pub fn flux_err_frac(&self) -> f64 {
        0.5 * self.growth() * self.err / self.of_star().powi(2)
    }

    fn growth(&self) -> f64 {
        FWHM_PER_SIGMA * FWHM_PER_SIGMA / 16.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_detections_give_the_width_and_none_that_of_a_star() {
        assert_eq!(Width::of(&[]), Width::default());
        assert!((Width::default().of_star() - 1.0).abs() < 1e-12);
        // images 1.3 times as wide as the stars: D² = 16 (1.3² - 1)/8 ln 2
        let disc2 = 16.0 * (1.3f64.powi(2) - 1.0) / FWHM_PER_SIGMA.powi(2);
        let width = Width::of(&vec![(disc2, 0.5); 400]);
        assert!((width.of_star() - 1.3).abs() < 2e-3, "{width:?}");
        // the stated error of the flux is what the error of the width makes of it
        let flux = |of: Width| 2.0 / (1.0 + (1.3 / of.of_star()).powi(2));
        let moved = flux(Width { disc2: width.disc2 + width.err, ..width }) / flux(width) - 1.0;
        assert!((moved / width.flux_err_frac() - 1.0).abs() < 0.1, "{moved} {width:?}");
        // narrower than a star, by noise or by better seeing
        assert!(Width::of(&[(-1.0, 0.1); 30]).of_star() < 0.85);
    }
}
