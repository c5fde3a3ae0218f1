//! The night's growth curve: the profile behind it, and why the aperture has the radius it has.
//!
//! Radii in FWHM as measured under a Gaussian window; light as shares of the whole.

use super::fit::{Fitted, fit};
use super::profile::StarProfile;
use super::radial::Radial;
use super::stack::{CORE, EDGES_FWHM, FrameGrowth, N, stack};
use crate::photometry::aperture::Shape;

/// 1/β must exceed this many of its errors, or the profile counts as a Gaussian.
const SIGNIFICANT_SIGMA: f64 = 2.0;
/// A frame's own width is used if it is known better than this share; else the night's ratio.
const WIDTH_ERR_FRAC: f64 = 0.01;
/// Fewest stars that determine the width of a frame.
const MIN_STARS_FRAME: usize = 3;
/// Fewest stars that determine the exponent of the night.
const MIN_STARS_NIGHT: usize = 5;
/// A fit further than this from the curve anywhere beyond 1.5 FWHM is reported.
const MISFIT: f64 = 0.003;
/// Frames differ by this share of each ring.
const FRAME_SCATTER_FRAC: f64 = 0.01;

/// The growth curve of the night's stars.
#[derive(Debug, Clone, PartialEq)]
pub struct GrowthCurve {
    /// Radii \[FWHM\].
    pub r_fwhm: Vec<f64>,
    /// Share of a star's light within each.
    pub enclosed: Vec<f64>,
    /// Its error.
    pub err: Vec<f64>,
    /// Share by the fitted profile.
    pub fitted: Vec<f64>,
    /// Signal-to-noise of a faint star in each, the best being 1.
    pub snr_rel: Vec<f64>,
    /// The profile.
    pub profile: StarProfile,
    /// Mean FWHM of the frames \[px\].
    pub fwhm_px: f64,
    /// Chosen radius of the aperture \[FWHM\].
    pub chosen_r_fwhm: f64,
    /// Annulus of the sky \[FWHM\].
    pub sky_fwhm: (f64, f64),
    /// Radius of the best signal-to-noise of a faint star \[FWHM\].
    pub best_snr_r_fwhm: f64,
}

impl GrowthCurve {
    /// The curve of a night of frames; `None` with fewer than 5 stars in all of them, or if no profile fits.
    ///
    /// The stack of the frames' rings is fitted by a Moffat profile with its own sky. Its exponent counts only if 1/β is
    /// two errors from 0: the noise of the curve must not reach the magnitudes of a night that a Gaussian describes.
    #[must_use]
    pub fn of_night(frames: &[&FrameGrowth], chosen_r_fwhm: f64, sky_fwhm: (f64, f64)) -> Option<Self> {
        let frames: Vec<FrameGrowth> = frames.iter().map(|f| (*f).clone()).collect();
        let night = stack(&frames, FRAME_SCATTER_FRAC).filter(|n| n.n_stars >= MIN_STARS_NIGHT)?;
        let free = fit(&night, None)?;
        let found = if free.q > SIGNIFICANT_SIGMA * free.q_err { free } else { fit(&night, Some(0.0))? };
        let profile = StarProfile {
            beta: found.q.recip(),
            inverse_beta_err: free.q_err,
            fwhm_ratio: found.ratio,
            n_stars: night.n_stars,
        };
        Some(Self::drawn(&night, &found, profile, chosen_r_fwhm, sky_fwhm))
    }

    fn drawn(
        night: &FrameGrowth,
        found: &Fitted,
        profile: StarProfile,
        chosen_r_fwhm: f64,
        sky_fwhm: (f64, f64),
    ) -> Self {
        let radial = Radial::new(found.q, found.ratio * night.fwhm_px);
        let light = |r_fwhm: f64| radial.enclosed_on_pixels(r_fwhm * night.fwhm_px);
        // the curve is in units of the core; the sky it lost is given back by the profile
        let (mut enclosed, mut err) = (Vec::with_capacity(N), Vec::with_capacity(N));
        let (mut sum, mut variance) = (0.0, 0.0);
        let lost = light(EDGES_FWHM[CORE - 1]) - found.core;
        for k in 0..N {
            sum += night.rings[k];
            variance += night.err[k].powi(2);
            let area = (EDGES_FWHM[k] / EDGES_FWHM[CORE - 1]).powi(2);
            enclosed.push(sum * found.core + lost * area);
            let sky = night.sky_err * std::f64::consts::PI * EDGES_FWHM[k].powi(2);
            err.push(variance.sqrt().hypot(sky) * found.core);
        }
        // the noise of a faint star is its sky's: S/N ∝ E(r)/r
        let (mut best, mut best_snr) = (EDGES_FWHM[0], 0.0);
        for step in 10..=300 {
            let r = 0.01 * f64::from(step);
            let snr = light(r) / r;
            if snr > best_snr {
                (best, best_snr) = (r, snr);
            }
        }
        Self {
            r_fwhm: EDGES_FWHM.to_vec(),
            enclosed,
            err,
            fitted: EDGES_FWHM.map(light).to_vec(),
            snr_rel: EDGES_FWHM.map(|r| light(r) / r / best_snr).to_vec(),
            profile,
            fwhm_px: night.fwhm_px,
            chosen_r_fwhm,
            sky_fwhm,
            best_snr_r_fwhm: best,
        }
    }

    /// Share of a star's light within `r_fwhm` by the fitted profile, on pixels.
    #[must_use]
    pub fn light_within(&self, r_fwhm: f64) -> f64 {
        self.profile.radial(self.fwhm_px).enclosed_on_pixels(r_fwhm * self.fwhm_px)
    }

    /// Largest departure of the curve from the fitted profile at and beyond 1.5 FWHM, in shares of the light.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        let departure = |k: usize| (self.enclosed[k] - self.fitted[k]).abs();
        (CORE - 1..self.enclosed.len()).map(departure).fold(0.0, f64::max)
    }

    /// The meaning of the chosen radius, in one sentence.
    #[must_use]
    pub fn explanation(&self) -> String {
        let r_px = self.chosen_r_fwhm * self.fwhm_px;
        let aperture = Shape::Circle { r_px };
        let sky = (self.sky_fwhm.0 * self.fwhm_px, self.sky_fwhm.1 * self.fwhm_px);
        let at = |fwhm_px: f64| self.profile.correction_mag(fwhm_px, aperture, sky, None);
        let err = self.profile.correction_err_mag(self.fwhm_px, aperture, sky, None);
        let form = if self.profile.beta.is_finite() {
            format!("Moffat beta {:.2} +- {:.2}", self.profile.beta, self.profile.beta_err())
        } else {
            "Gaussian".to_string()
        };
        let misfit = self.misfit();
        let systematic = if misfit > MISFIT {
            format!(", systematic {misfit:.3} of the flux by which the stars depart from this profile")
        } else {
            String::new()
        };
        format!(
            "the aperture of {:.1} FWHM ({r_px:.1} px) holds {:.4} of a star's flux ({form} from {} stars); the aperture \
             correction, annulus included, is {:+.4} +- {err:.4} mag{systematic}; the S/N of a faint star is best at {:.2} \
             FWHM; seeing that changes by 20 % at the same radius moves the correction by {:.4} mag",
            self.chosen_r_fwhm,
            self.light_within(self.chosen_r_fwhm),
            self.profile.n_stars,
            at(self.fwhm_px),
            self.best_snr_r_fwhm,
            (at(1.2 * self.fwhm_px) - at(self.fwhm_px)).abs(),
        )
    }
}

impl FrameGrowth {
    /// The night's profile as wide as in this frame, if 3 of its own stars determine the width to 1 %; `fwhm_px` is the
    /// width the frame's apertures are in units of.
    #[must_use]
    pub fn profile(&self, night: &StarProfile, fwhm_px: f64) -> Option<StarProfile> {
        let own = fit(self, Some(night.beta.recip()))?;
        let fwhm_ratio = own.ratio * self.fwhm_px / fwhm_px;
        let is_determined = self.n_stars >= MIN_STARS_FRAME && own.ratio_err < WIDTH_ERR_FRAC * own.ratio;
        is_determined.then_some(StarProfile { fwhm_ratio, ..*night })
    }
}
