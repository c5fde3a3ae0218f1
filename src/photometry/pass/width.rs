//! How wide the images of a pass are, by all frames that show the target: size, seeing and smear together.
//!
//! Widths are relative to that of the night's stars at the airmass of the frame
//! ([`StarWidth`](crate::photometry::growth::StarWidth)). How that goes with the airmass may be wrong, so an exponent of the rest is
//! fitted. It does not cover other changes within the pass.

use nalgebra::{Matrix2, Vector2};

use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::growth::PRIOR_EXPONENT;

/// Expected before any detection: the square of the width is that of the stars within this share of it (seeing that is a sixth wider) ...
const PRIOR_LEVEL_ERR: f64 = 0.35;
/// ... and goes with the airmass as theirs, within the error of that exponent where stars at one airmass left it open.
const EXPONENT_ERR: f64 = PRIOR_EXPONENT.1;
/// Images are not narrower than this share of the stars' width.
const LEAST_RATIO: f64 = 0.7;

/// One detection: the square of the diameter of the disc that fits, its error \[FWHM²\], and the airmass.
pub type MeasuredWidth = (f64, f64, f64);

/// The square of the width of the images over that of the stars: r(X) = a (X/X₀)^(c/a), fitted as
/// a + c ln(X/X₀).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// X₀, the mean airmass of the detections; `None` without any.
    airmass: Option<f64>,
    /// a and c.
    terms: Vector2<f64>,
    covariance: Matrix2<f64>,
}

impl Default for Width {
    fn default() -> Self {
        Self::of(&[])
    }
}

impl Width {
    /// Least squares of r = 1 + D² 8 ln 2/16 (a disc has σ² = D²/16 per axis), with a = 1 ± 0.35 and c/2 = 0 ± 0.3 beforehand.
    #[must_use]
    pub fn of(measured: &[MeasuredWidth]) -> Self {
        let growth = FWHM_PER_SIGMA * FWHM_PER_SIGMA / 16.0;
        let usable = |m: &&MeasuredWidth| m.0.is_finite() && m.1 > 0.0 && m.2 >= 1.0 && m.2.is_finite();
        let usable: Vec<&MeasuredWidth> = measured.iter().filter(usable).collect();
        let sums =
            usable.iter().fold((0.0, 0.0), |(s, w), (_, err, x)| (s + x.ln() / (err * err), w + 1.0 / (err * err)));
        let airmass = (sums.1 > 0.0).then(|| (sums.0 / sums.1).exp());
        let prior = Vector2::new(PRIOR_LEVEL_ERR.powi(-2), (2.0 * EXPONENT_ERR).powi(-2));
        let mut normal = Matrix2::from_diagonal(&prior);
        let mut right = Vector2::new(prior[0], 0.0);
        for (disc2, err, x) in usable {
            let t = Vector2::new(1.0, (x / airmass.unwrap_or(1.0)).ln());
            let weight = (growth * err).powi(-2);
            normal += t * t.transpose() * weight;
            right += t * (weight * (1.0 + growth * disc2));
        }
        // the prior alone makes it positive definite
        let covariance = normal.try_inverse().unwrap_or_else(Matrix2::zeros);
        Self { airmass, terms: covariance * right, covariance }
    }

    /// r at an airmass, and its derivatives by a and c.
    fn at(&self, airmass: Option<f64>) -> (f64, Vector2<f64>) {
        let log = airmass.zip(self.airmass).map_or(0.0, |(x, x0)| (x / x0).ln());
        let a = self.terms[0].max(LEAST_RATIO * LEAST_RATIO);
        let power = self.terms[1] / a * log;
        (a * power.exp(), Vector2::new(1.0 - power, log) * power.exp())
    }

    /// FWHM of the images at an airmass over that of the night's stars there.
    #[must_use]
    pub fn fwhm_ratio(&self, airmass: Option<f64>) -> f64 {
        self.at(airmass).0.max(LEAST_RATIO * LEAST_RATIO).sqrt()
    }

    /// Error of a flux by that of the width, as a share of it: for Gaussians F ∝ 2σ_t²/(σ_t² + σ_s²), dF/F = dσ_t²/2σ_t².
    #[must_use]
    pub fn flux_err_frac(&self, airmass: Option<f64>) -> f64 {
        let (_, by_terms) = self.at(airmass);
        0.5 * (self.covariance * by_terms).dot(&by_terms).sqrt() / self.fwhm_ratio(airmass).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// D² of images `ratio` times as wide as the stars.
    fn disc2(ratio: f64) -> f64 {
        16.0 * (ratio * ratio - 1.0) / FWHM_PER_SIGMA.powi(2)
    }

    #[test]
    fn many_detections_give_the_width_and_none_that_of_a_star() {
        let none = Width::default();
        assert!((none.fwhm_ratio(Some(2.0)) - 1.0).abs() < 1e-12 && (none.flux_err_frac(None) - 0.175).abs() < 1e-12);
        let width = Width::of(&vec![(disc2(1.3), 0.5, 1.5); 400]);
        assert!((width.fwhm_ratio(Some(1.5)) - 1.3).abs() < 5e-3, "{width:?}");
        // the stated error of the flux is what the error of the width makes of it
        let r = width.fwhm_ratio(Some(1.5)).powi(2);
        let flux = |r: f64| 2.0 / (1.0 + 1.3 * 1.3 / r);
        let moved = flux(r + width.covariance[(0, 0)].sqrt()) / flux(r) - 1.0;
        assert!((moved / width.flux_err_frac(Some(1.5)) - 1.0).abs() < 0.1, "{moved} {width:?}");
        // narrower than a star, by noise or by better seeing
        assert!(Width::of(&[(-1.0, 0.1, 1.2); 30]).fwhm_ratio(Some(1.2)) < 0.85);
    }

    #[test]
    fn detections_over_a_range_of_airmass_determine_how_the_width_goes_with_it_and_others_leave_it_within_the_error() {
        let pass = |exponent: f64, airmasses: &[f64]| -> Width {
            let of = |x: &f64| (disc2(1.1 * (x / 1.2f64).powf(exponent)), 0.3, *x);
            Width::of(&airmasses.iter().map(of).collect::<Vec<_>>())
        };
        for exponent in [-0.3, 0.0, 0.3] {
            let wide: Vec<f64> = (0..200).map(|k| 1.2 + 0.005 * f64::from(k)).collect();
            let want = 1.1 * (2.0f64 / 1.2).powf(exponent);
            let got = pass(exponent, &wide).fwhm_ratio(Some(2.0));
            assert!((got / want - 1.0).abs() < 0.03, "{exponent}: {got} {want}");
            // nothing but the prior determines the width elsewhere
            let narrow = pass(exponent, &[1.2; 200]);
            let (r, want2) = (narrow.fwhm_ratio(Some(2.0)).powi(2), want * want);
            let err = 2.0 * narrow.flux_err_frac(Some(2.0)) * r;
            assert!((r - want2).abs() < 1.5 * err && err < 0.6, "{exponent}: {r} {want2} {err}");
        }
    }
}
