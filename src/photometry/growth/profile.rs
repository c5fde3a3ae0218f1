//! The profile of one star: the share of its light inside each radius.

use super::annulus::level_of_wings;
use super::collect::collected;
use super::fit;
use super::radial::Radial;
use crate::photometry::aperture::Shape;
use serde::Deserialize;
use serde::Serialize;

/// An aperture that holds less than this share of the light is not corrected.
pub(super) const LEAST_SHARE: f64 = 0.02;

/// The profile of the night's stars.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StarProfile {
    /// Moffat's exponent β; infinite for a Gaussian.
    pub beta: f64,
    /// Error of 1/β, which is what is measured: it stays finite for a Gaussian.
    pub inverse_beta_err: f64,
    /// FWHM of the profile over the FWHM measured under a Gaussian window; 1 for a Gaussian.
    pub fwhm_ratio: f64,
    /// Stars it rests on.
    pub n_stars: usize,
}

impl StarProfile {
    /// A known profile: Moffat's with exponent `beta`, a Gaussian if infinite.
    #[must_use]
    pub fn moffat(beta: f64) -> Self {
        Self { beta, inverse_beta_err: 0.0, fwhm_ratio: 1.0, n_stars: 0 }
    }

    /// Error of β; infinite for a Gaussian whose 1/β is not known exactly.
    #[must_use]
    pub fn beta_err(&self) -> f64 {
        if self.inverse_beta_err == 0.0 { 0.0 } else { self.beta * self.beta * self.inverse_beta_err }
    }

    pub(crate) fn radial(&self, fwhm_px: f64) -> Radial {
        Radial::new(self.beta.recip(), self.fwhm_ratio * fwhm_px)
    }

    /// The profile with 1/β one error further from a Gaussian.
    pub(super) fn one_sigma_wider(&self) -> Self {
        Self { beta: (self.beta.recip() + self.inverse_beta_err).min(fit::Q_RANGE[1]).recip(), ..*self }
    }

    /// Share of a star's light inside a circle of radius `r_px` about it.
    ///
    /// 1 − (1 + (r/α)²)^(1−β), α = FWHM / (2 √(2^(1/β) − 1)); 1 − exp(−4 ln 2 (r/FWHM)²) for a Gaussian.
    /// `fwhm_px` is the FWHM measured under a Gaussian window, as everywhere in this crate.
    #[must_use]
    pub fn enclosed(&self, fwhm_px: f64, r_px: f64) -> f64 {
        self.radial(fwhm_px).enclosed(r_px)
    }

    /// Magnitude to add to a flux measured in `aperture` over the annulus `sky` (inner, outer radius \[px\]), to correct
    /// it to the whole light of its source: 2.5 log₁₀(C − A·S), not positive unless the annulus is nearly empty of it.
    ///
    /// C is the share of the light in the aperture, A its area, S the mean light per px² in the annulus, which was taken
    /// for sky. The source is a uniform ellipse with the axes of `source` (a point if `None`) blurred by the star
    /// profile, centred on the aperture; pixels are integrated in the mean over subpixel places. `sky` with outer ≤ inner
    /// or an outer radius that is not finite leaves the annulus out. NaN if the FWHM or the aperture has no size, and where
    /// less than 2 % of the light is left: a correction of more than 4 mag is not used.
    ///
    /// Accuracy: points exact to the pixel series (1e-4 for FWHM ≥ 2 px); with corners or an extended source the
    /// quadrature is right to 1e-3 mag. Takes less than a millisecond.
    #[must_use]
    pub fn correction_mag(&self, fwhm_px: f64, aperture: Shape, sky: (f64, f64), source: Option<Shape>) -> f64 {
        if !(fwhm_px > 0.0 && fwhm_px.is_finite() && aperture.area_px() > 0.0) {
            return f64::NAN;
        }
        let profile = self.radial(fwhm_px);
        let (inner, outer) = sky;
        let mut share = collected(&profile, &aperture, source);
        if outer > inner && inner >= 0.0 && outer.is_finite() {
            let within = |r_px: f64| collected(&profile, &Shape::Circle { r_px }, source);
            let ring = Shape::Circle { r_px: outer }.area_px() - Shape::Circle { r_px: inner }.area_px();
            share -= aperture.area_px() * (within(outer) - within(inner)) / ring;
        }
        if share >= LEAST_SHARE { 2.5 * share.log10() } else { f64::NAN }
    }

    /// Error of [`StarProfile::correction_mag`] from the error of 1/β \[mag\].
    #[must_use]
    pub fn correction_err_mag(&self, fwhm_px: f64, aperture: Shape, sky: (f64, f64), source: Option<Shape>) -> f64 {
        let here = self.correction_mag(fwhm_px, aperture, sky, source);
        (self.one_sigma_wider().correction_mag(fwhm_px, aperture, sky, source) - here).abs()
    }

    /// [`StarProfile::correction_mag`] of a star in a circle, with the sky it really had.
    ///
    /// The sky is a clipped median: over wings fainter than the noise it sees their mean, over bright ones their
    /// median. `flux_e` is the measured flux \[e⁻\], `sky_rms_e` the scatter of the annulus \[e⁻\].
    #[must_use]
    pub fn star_correction_mag(
        &self,
        fwhm_px: f64,
        r_px: f64,
        (inner_px, outer_px): (f64, f64),
        flux_e: f64,
        sky_rms_e: f64,
    ) -> f64 {
        let profile = self.radial(fwhm_px);
        let area = std::f64::consts::PI * r_px * r_px;
        let collected = profile.enclosed_on_pixels(r_px);
        let share = |level: f64| (collected - area * level).clamp(LEAST_SHARE, 1.0);
        // how bright the star is decides how the clipped median sees its wings: first as their mean
        let whole_e = flux_e / share(level_of_wings(&profile, (inner_px, outer_px), f64::INFINITY));
        2.5 * share(level_of_wings(&profile, (inner_px, outer_px), sky_rms_e / whole_e)).log10()
    }
}
