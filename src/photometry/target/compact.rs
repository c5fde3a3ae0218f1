//! Whether a target is a point, a compact source of unknown size or extended, by its own pixels; and its flux.
//!
//! Electrons; sizes in FWHM of the stars. A point is measured with the least error there is, a compact source without a
//! bias by its size, an extended one in its outline (`measure`). What its pass shows of its size counts as well, where it is known.

use ndarray::Array2;

use super::point::PointFlux;
use super::psf::WIDE_FWHM;
use super::settings::TargetSettings;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::stats;
use crate::frames::{Electrons, Frame};
use crate::photometry::background::Background;
use crate::photometry::clip::CLIP_SIGMA;
use crate::photometry::flux::Flux;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::flux::circle_at;
use crate::photometry::target::placed::Placed;

/// Largest square of the diameter at which the light of a compact source is right to 1 % \[FWHM²\].
const MOST_DISC2: f64 = 1.25;
/// From this signal-to-noise on an outline replaces the weights of a point-spread function: there 1 % of the flux, which a star of another
/// width makes of it, is as much as what an outline adds to the error.
const BRIGHT_SNR: f64 = 150.0;
/// Share of the error of the width of the stars that a flux has in which size and light are fitted: a twentieth of the width makes 0.1 to 1.6 % of
/// it for discs up to one FWHM, Gaussians and Moffat's profiles from β = 2.5.
const FREE_SHARE: f64 = 0.2;
/// Diameters are equally likely up to this \[FWHM\] where nothing tells of them.
const LARGEST_FWHM: f64 = 3.0;
/// A satellite that its model makes longer than this is wider than three FWHM: its length is taken as three diameters of a disc of its
/// area \[FWHM\].
const LONGEST_FWHM: f64 = 3.0 * LARGEST_FWHM;
/// Below this diameter the weights of a point are right to 1 % \[FWHM\].
const POINT_FWHM: f64 = 0.2;
/// A satellite that its model makes a point is one with no more certainty than this.
const MOST_CERTAIN: f64 = 0.999;
/// Steps of the integrals over sizes and over their scatter.
const SIZES: usize = 60;
/// Odds from which a source counts as a point, and below whose reciprocal it counts as extended.
const DECISIVE_ODDS: f64 = 10.0;
/// A source is wider than a disc of one FWHM if D² exceeds [`MOST_DISC2`] by so many of its errors: more, and faint sources of 1.5 to 3 FWHM
/// come out too faint; less, and points have a larger error.
const WIDER_SIGMA: f64 = 0.25;
/// A source whose outline holds so much more light is larger than three FWHM \[σ of the outline's\].
const MORE_OUTSIDE_SIGMA: f64 = 2.0;
/// Peaks of noise above the threshold in the search region of a frame.
const FALSE_PEAKS: f64 = 1e-4;
/// Noise more skew than this is not that of photons: a frame without noise.
const MOST_SKEWNESS: f64 = 1.0;

/// What a target is, by its own pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceKind {
    /// A point by odds of 10 to 1; its flux is that of a point, to the width of the stars.
    Point,
    /// As narrow as a point or up to three FWHM wide: its flux is that of a disc of any such size, or of those that its pass shows.
    Compact,
    /// Wider than that: its flux is that of its outline.
    Extended,
}

impl SourceKind {
    /// The word in a table.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            SourceKind::Point => "point",
            SourceKind::Compact => "compact",
            SourceKind::Extended => "extended",
        }
    }
}

/// What the pixels of a target say of its size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// What it is taken for.
    pub kind: SourceKind,
    /// Decimal logarithm of the odds of a point against a wider disc.
    pub log10_odds: f64,
    /// Square of the diameter of the disc that fits \[FWHM²\], negative where noise makes it narrower than a star.
    pub disc2: f64,
    /// Its error \[FWHM²\].
    pub disc2_err: f64,
}

/// A compact target, measured.
pub(crate) struct Compact {
    /// What its pixels say.
    pub size: Size,
    /// Its flux, on the whole light of the source; `snr` is the significance of a point.
    pub point: PointFlux,
    /// The flux of a point and its error \[e⁻\].
    pub as_point_e: (f64, f64),
    /// The circle whose pixels carry weight.
    pub place: Placed,
}

/// Measures a source near `start` as a compact one; `None` where a point does not fit there, where hits have taken pixels
/// of it, and where it is so bright that an outline is as good.
///
/// The best place of a point adds noise to its flux: E(F) = F + σ²/F, which is subtracted. The flux of a free size is not
/// moved by it: its weights have no gradient along that of the point. As the light of a point is that less cov(F, q)/V_q of the
/// disc's share q, the best place takes σ²/F V_q/cov(F, q) from q, which is added. What is wider than a disc of one FWHM is measured as
/// one of up to three ([`Cutout::wide_flux`]), and is extended if that finds it wider, its outline holds more light or its model is
/// larger.
pub(crate) fn measure_compact(
    cutout: &Cutout,
    frame: &Frame<Electrons>,
    background: &Background,
    (start, of_outline): ((f64, f64), &Flux),
    objects: &Array2<bool>,
    s: &TargetSettings,
) -> Option<Compact> {
    let best = cutout.best_place(&cutout.psf, start)?;
    let mut place = circle_at(best.x, best.y, cutout.psf.reach_px());
    if cutout.hits_in(&place).is_some() {
        return None;
    }
    let mut point = cutout.forced_flux(frame, background, (best.x, best.y), objects, s)?;
    let raw = point.flux.flux_e / point.empty_err_e;
    if !(raw > 0.0) || !point.free_e.0.is_finite() || point.flux.snr > BRIGHT_SNR {
        return None;
    }
    let too_much_e = point.empty_err_e / raw;
    let as_point_e = (point.flux.flux_e - too_much_e, point.flux.flux_err_e);
    let (of_disc_e, disc_err_e, covariance) = point.of_disc_e;
    let of_disc_e = of_disc_e + too_much_e * disc_err_e * disc_err_e / covariance;
    if !(as_point_e.0 > 0.0) || !of_disc_e.is_finite() {
        return None;
    }
    let disc2 = (of_disc_e / as_point_e.0, disc_err_e / as_point_e.0);
    let of_pass = s.known_disc2.filter(|(_, err)| *err > 0.0);
    let mut size = size_of(disc2, of_pass, (s.largest_fwhm, s.fwhm_err_frac));
    point.flux.snr = as_point_e.0 / as_point_e.1;
    let of_both = (of_disc_e, disc_err_e, covariance);
    let known = known_size(&size, disc2.1, of_pass, s.fwhm_err_frac);
    let of_size = known.map_or(point.free_e, |known| of_known_size(point.free_e, of_both, as_point_e.0, known));
    (point.flux.flux_e, point.flux.flux_err_e) = with_doubt(of_size, FREE_SHARE * s.fwhm_err_frac);
    if size.kind == SourceKind::Extended
        && s.largest_fwhm.is_none_or(|largest| largest <= LONGEST_FWHM)
        // a point fits best on a peak of the noise of a wide source; the middle one of the discs fits that
        && let Some(best) = cutout.best_place(&cutout.psf.of_disc(WIDE_FWHM[1]), (best.x, best.y))
        && let Some(wide) = cutout.wide_flux(frame, background, (best.x, best.y), objects, s)
        && wide.flux_e.0 > 0.0
        && wide.disc2.0 - wide.disc2.1 < LARGEST_FWHM * LARGEST_FWHM
        && of_outline.flux_e - wide.flux_e.0 < MORE_OUTSIDE_SIGMA * of_outline.flux_err_e
        && cutout.hits_in(&wide.place).is_none()
    {
        let disc2_err = wide.disc2.1.hypot(width_err(s.fwhm_err_frac));
        size = Size { kind: SourceKind::Compact, disc2: wide.disc2.0, disc2_err, ..size };
        let (flux_e, flux_err_e) = with_doubt(wide.flux_e, FREE_SHARE * s.fwhm_err_frac);
        point.flux = Flux { flux_e, flux_err_e, snr: point.flux.snr, ..wide.measured.flux.clone() };
        (point.measured, place) = (wide.measured, wide.place);
    }
    Some(Compact { size, point, as_point_e, place })
}

/// What is known of the size of a source besides its pixels, D² and its error \[FWHM²\]: what other frames of its pass show, or that of a
/// point if that is known better, unless the pixels contradict them.
fn known_size(size: &Size, err: f64, of_pass: Option<(f64, f64)>, fwhm_err_frac: f64) -> Option<(f64, f64)> {
    let of_point = (size.kind == SourceKind::Point).then(|| (0.0, width_err(fwhm_err_frac)));
    let known = of_point.into_iter().chain(of_pass).min_by(|a, b| a.1.total_cmp(&b.1));
    known.filter(|(disc2, known_err)| (size.disc2 - disc2).abs() < CLIP_SIGMA * err.hypot(*known_err))
}

/// The light of a disc whose size (D² and its error σ \[FWHM²\]) is known beforehand, and its error \[e⁻\].
///
/// The fit has the whole light F and what of it is the disc of one FWHM, q = D² F. The residual g = q − D² F is 0 to σ F:
/// F̂ = F − cov(F, g)/(V_g + σ² F²) g, V = V_F − cov²(F, g)/(V_g + σ² F²), with the light of a point for F² and cov(F, g) = cov(F, q) − D² V_F,
/// V_g = V_q − 2 D² cov(F, q) + D⁴ V_F. With σ = 0 it is the light of that disc alone, and with a large one that of a disc of unknown size.
fn of_known_size(
    (flux_e, err_e): (f64, f64),
    (of_disc_e, disc_err_e, covariance): (f64, f64, f64),
    as_point_e: f64,
    (disc2, sigma): (f64, f64),
) -> (f64, f64) {
    let variance = err_e * err_e;
    let with_residual = covariance - disc2 * variance;
    let of_residual = disc_err_e * disc_err_e - disc2 * (covariance + with_residual);
    let gain = with_residual / (of_residual + (sigma * as_point_e).powi(2));
    (flux_e - gain * (of_disc_e - disc2 * flux_e), (variance - gain * with_residual).max(0.0).sqrt())
}

/// The flux of a point with its error, that of the width of the stars in it \[e⁻\]: F ∝ 2σ_t²/(σ_t² + σ_s²), so both have the same share.
#[must_use]
pub fn of_a_point(as_point_e: (f64, f64), fwhm_err_frac: f64) -> (f64, f64) {
    with_doubt(as_point_e, fwhm_err_frac)
}

/// A flux with its error, a share of it that is uncertain as well in it \[e⁻\].
fn with_doubt((flux_e, err_e): (f64, f64), share: f64) -> (f64, f64) {
    (flux_e, err_e.hypot(share * flux_e))
}

/// The decision on a measured size: D² of the even disc that fits, and its error \[FWHM²\].
///
/// Odds = p/(1 − p) · N(D² | 0, σ) / mean of N(D² | q², σ) over diameters q of 0.2 to 3 FWHM. p is the share of the
/// diameters below 0.2 FWHM, for which a point is right, of all those up to `largest_fwhm`: that of the model at its range,
/// else 3. σ² = σ_D² + (2 · 16/(8 ln 2) · e)², e being the share by which the width of the star is not that of the night's stars in every
/// frame.
///
/// Where other frames of the pass show the size, D² and σ_D are the mean of both, weighted by their variances.
fn size_of(
    (disc2, err): (f64, f64),
    known: Option<(f64, f64)>,
    (largest_fwhm, fwhm_err_frac): (Option<f64>, f64),
) -> Size {
    let (of_both, err_of_both) = known.map_or((disc2, err), |(of_pass, pass_err)| {
        let (own, pass) = (err.powi(-2), pass_err.powi(-2));
        ((own * disc2 + pass * of_pass) / (own + pass), (own + pass).sqrt().recip())
    });
    let sigma = err_of_both.hypot(width_err(fwhm_err_frac));
    let log_likelihood = |of: f64| -0.5 * ((of_both - of) / sigma).powi(2);
    let sizes: Vec<f64> = (0..SIZES)
        .map(|k| POINT_FWHM + (LARGEST_FWHM - POINT_FWHM) * (k as f64 + 0.5) / SIZES as f64)
        .map(|diameter| log_likelihood(diameter * diameter))
        .collect();
    let prior = (POINT_FWHM / largest_fwhm.unwrap_or(LARGEST_FWHM)).min(MOST_CERTAIN);
    let most = sizes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = most + (sizes.iter().map(|l| (l - most).exp()).sum::<f64>() / SIZES as f64).ln();
    let log10_odds = (prior / (1.0 - prior)).log10() + (log_likelihood(0.0) - mean) * std::f64::consts::LOG10_E;
    let kind = if log10_odds > DECISIVE_ODDS.log10() {
        SourceKind::Point
    } else if of_both > MOST_DISC2 + WIDER_SIGMA * sigma {
        SourceKind::Extended
    } else {
        SourceKind::Compact
    };
    Size { kind, log10_odds, disc2, disc2_err: err.hypot(width_err(fwhm_err_frac)) }
}

/// What a star wider by this share than the night's makes of the size of a point \[FWHM²\]: σ² changes by twice as much of it, a disc adds
/// D²/16.
fn width_err(fwhm_err_frac: f64) -> f64 {
    2.0 * fwhm_err_frac * 16.0 / FWHM_PER_SIGMA.powi(2)
}

/// What sizes of a pass (D² and the errors of their pixels \[FWHM²\]) say of the size in another frame of it, and its error. `None` without any.
///
/// Frames differ by τ: their stars are not equally wide, the target turns, the telescope shakes. τ is w tan θ with any θ as likely, w what
/// the error of the width of the stars makes of a size (Gelman 2006: half-Cauchy). For each τ, with W = Σ 1/(σ_k² + τ²) and the mean of weights
/// 1/(σ_k² + τ²), p(τ) ∝ W^{−1/2} Π (σ_k² + τ²)^{−1/2} e^{−χ²/2}; D̄² is the mean over p, and its variance that of the means and of τ² + 1/W.
#[must_use]
pub fn mean_disc2(sizes: impl Iterator<Item = (f64, f64)>, fwhm_err_frac: f64) -> Option<(f64, f64)> {
    let usable: Vec<(f64, f64)> = sizes.filter(|(disc2, err)| disc2.is_finite() && *err > 0.0).collect();
    if usable.is_empty() {
        return None;
    }
    let of_scatter = |k: usize| {
        let tau = width_err(fwhm_err_frac) * (std::f64::consts::FRAC_PI_2 * (k as f64 + 0.5) / SIZES as f64).tan();
        let variance = |err: f64| err * err + tau * tau;
        let weight: f64 = usable.iter().map(|(_, err)| variance(*err).recip()).sum();
        let mean = usable.iter().map(|(disc2, err)| disc2 / variance(*err)).sum::<f64>() / weight;
        let of_one = |(disc2, err): &(f64, f64)| (disc2 - mean).powi(2) / variance(*err) + variance(*err).ln();
        let log_p = -0.5 * (usable.iter().map(of_one).sum::<f64>() + weight.ln());
        (log_p, mean, tau * tau + weight.recip())
    };
    let all: Vec<(f64, f64, f64)> = (0..SIZES).map(of_scatter).collect();
    let most = all.iter().map(|(log_p, ..)| *log_p).fold(f64::NEG_INFINITY, f64::max);
    let p = |log_p: f64| (log_p - most).exp();
    let total: f64 = all.iter().map(|(log_p, ..)| p(*log_p)).sum();
    let mean = all.iter().map(|(log_p, mean, _)| p(*log_p) * mean).sum::<f64>() / total;
    let of_one = |(log_p, mean_k, variance): &(f64, f64, f64)| p(*log_p) * (variance + (mean_k - mean).powi(2));
    let variance = all.iter().map(of_one).sum::<f64>() / total;
    Some((mean, variance.sqrt()))
}

/// The error of a size ([`Size::disc2_err`]) by its pixels alone, without that of the width of the stars \[FWHM²\]; 0 where that is all.
#[must_use]
pub fn err_of_pixels(disc2_err: f64, fwhm_err_frac: f64) -> f64 {
    (disc2_err * disc2_err - width_err(fwhm_err_frac).powi(2)).max(0.0).sqrt()
}

/// The significance that a point must have: `detect_sigma`, or what noise reaches in the search region where that is more; `skewness`
/// is that of the noise ([`Cutout::skewness`]).
pub(crate) fn least_significance(s: &TargetSettings, skewness: f64) -> f64 {
    s.detect_sigma.max(noise_reaches(s.search_radius_px, s.fwhm_px, skewness))
}

/// The significance that noise exceeds within a radius in one frame of 10 000: that of a Gaussian field
/// ([`stats::peak_significance`]); photons of a faint sky exceed T = t + γ (t² − 1)/6 as often (Cornish & Fisher 1938, the first
/// term).
fn noise_reaches(radius_px: f64, fwhm_px: f64, skewness: f64) -> f64 {
    let area = std::f64::consts::PI * radius_px.powi(2);
    let t = stats::peak_significance(area / filter_variance(fwhm_px), FALSE_PEAKS);
    t + skewness * (t * t - 1.0) / 6.0
}

/// Variance of a Gaussian star as pixels see it \[px²\].
fn filter_variance(fwhm_px: f64) -> f64 {
    (fwhm_px / FWHM_PER_SIGMA).powi(2) + 1.0 / 12.0
}

impl Cutout {
    /// The skewness of a sum of sky under the weights p of a point: γ = (B/σ³) Σp³/(Σp²)^{3/2} = 2B/(3σ³√(πV)) for a Gaussian of the
    /// variance V, B being the photons of the sky in a pixel and σ its scatter.
    pub fn skewness(&self) -> f64 {
        let (ny, nx) = self.pixels.dim();
        let photons = self.sky.level(0.5 * nx as f64, 0.5 * ny as f64).clamp(0.0, self.rms_e.powi(2));
        let skewness =
            2.0 * photons / (3.0 * self.rms_e.powi(3) * (std::f64::consts::PI * filter_variance(self.fwhm_px)).sqrt());
        skewness.min(MOST_SKEWNESS)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use statrs::distribution::{ContinuousCDF, DiscreteCDF};

    use super::*;

    #[test]
    fn a_point_is_one_whose_model_is_small_and_a_large_disc_is_extended_whatever_its_model() {
        let kind = |disc2, err, largest| size_of((disc2, err), None, (largest, 0.05)).kind;
        assert_eq!(kind(0.0, 1.0, None), SourceKind::Compact);
        assert_eq!(kind(0.0, 1.0, Some(0.1)), SourceKind::Point);
        assert_eq!(kind(0.0, 1.0, Some(1.0)), SourceKind::Compact);
        for largest in [None, Some(0.1), Some(2.0)] {
            assert_eq!(kind(6.0, 0.4, largest), SourceKind::Extended);
        }
        // the width of the star is not known to better than 5 %, so no pixels alone make a point
        assert_eq!(kind(0.0, 0.0, None), SourceKind::Compact);
        let odds = |disc2| size_of((disc2, 1.0), None, (None, 0.05)).log10_odds;
        assert!(odds(-40.0).is_finite() && odds(1e4) < -100.0);
    }

    #[test]
    fn the_pass_decides_where_a_frame_cannot() {
        let kind = |disc2, err, known| size_of((disc2, err), Some(known), (None, 0.05)).kind;
        // of two FWHM, in a frame that shows a point, or three
        for own in [0.0, 3.0, 9.0] {
            assert_eq!(kind(own, 4.0, (4.0, 0.4)), SourceKind::Extended, "{own}");
            assert_eq!(kind(own, 4.0, (0.0, 0.4)), SourceKind::Compact, "{own}");
        }
        // what a frame shows clearly is not overruled by a pass that says little
        assert_eq!(kind(0.2, 0.3, (4.0, 5.0)), SourceKind::Compact);
    }

    #[test]
    fn sizes_of_a_pass_say_what_the_next_one_is_to_their_error() {
        let mut rng = rand_chacha::ChaCha12Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        for (n, err) in [(3, 0.1), (5, 0.3), (10, 0.1), (10, 0.8)] {
            // the frames of a pass have one size, are in the wind, or show a target that turns
            for scatter in [0.0, 0.05, 0.2, 0.6, 2.0] {
                let mut within = 0;
                for _ in 0..1000 {
                    let sizes: Vec<_> = (0..n).map(|_| (1.0 + scatter * normal() + err * normal(), err)).collect();
                    let (mean, err) = mean_disc2(sizes.into_iter(), 0.05).unwrap();
                    within += usize::from((mean - 1.0 - scatter * normal()).abs() < err);
                }
                // two in three, or more where a scatter is not excluded
                assert!(within > 560 && (scatter < 2.0 || within < 780), "{n} {err} {scatter}: {within}");
            }
        }
        // of one size, ten frames know it better than one
        let (mean, err) = mean_disc2([0.7, 1.3].repeat(5).into_iter().map(|disc2| (disc2, 0.3)), 0.05).unwrap();
        assert!((mean - 1.0).abs() < 1e-12 && (0.095..0.25).contains(&err), "{err}");
        let (mean, err) = mean_disc2([(4.0, 1.0), (f64::NAN, 1.0), (2.0, 1.0)].into_iter(), 0.05).unwrap();
        assert!((mean - 3.0).abs() < 1e-12 && err > 1.0, "{err}");
        assert!(mean_disc2(std::iter::empty(), 0.05).is_none());
        assert!(
            (err_of_pixels(0.4f64.hypot(width_err(0.05)), 0.05) - 0.4).abs() < 1e-12 && err_of_pixels(0.1, 0.05) == 0.0
        );
    }

    #[test]
    fn the_light_of_a_known_size_is_that_of_the_disc_or_of_any_by_how_well_it_is_known() {
        // two profiles p and q fitted to pixels of unit variance: F = p + q
        let fit = nalgebra::Matrix2::<f64>::new(1.0, 0.8, 0.8, 0.7);
        let inverse = fit.try_inverse().unwrap();
        let both = nalgebra::Vector2::new(1.0, 1.0);
        let light = nalgebra::Vector2::new(30.0, 12.0);
        let free_e = (both.dot(&light), both.dot(&(inverse * both)).sqrt());
        let of_disc_e = (light[1], inverse[(1, 1)].sqrt(), inverse.row(1).sum());
        for disc2 in [0.0, 0.3, 1.0] {
            // the weights of that disc alone
            let own = nalgebra::Vector2::new(1.0 - disc2, disc2);
            let alone = own.dot(&(fit * light)) / own.dot(&(fit * own));
            let (flux_e, err_e) = of_known_size(free_e, of_disc_e, 40.0, (disc2, 1e-9));
            assert!((flux_e - alone).abs() < 1e-6 * alone, "{disc2}: {flux_e} {alone}");
            assert!((err_e - own.dot(&(fit * own)).sqrt().recip()).abs() < 1e-6, "{disc2}: {err_e}");
            let (flux_e, err_e) = of_known_size(free_e, of_disc_e, 40.0, (disc2, 1e9));
            assert!((flux_e - 42.0).abs() < 1e-6 && (err_e - free_e.1).abs() < 1e-6, "{disc2}: {flux_e}");
        }
    }

    #[test]
    fn photons_of_a_faint_sky_exceed_the_threshold_no_more_often_than_gaussian_noise() {
        let normal = statrs::distribution::Normal::standard();
        // sums of pixels with this many photons: the skewness of a Poisson distribution is 1/√m
        for m in [30.0, 100.0, 400.0, 5000.0f64] {
            let (t, of_photons) = (noise_reaches(60.0, 1.5, 0.0), noise_reaches(60.0, 1.5, m.sqrt().recip()));
            let photons = statrs::distribution::Poisson::new(m).unwrap();
            let chance = |t: f64| photons.sf((m + t * m.sqrt()).floor() as u64);
            let ratio = chance(of_photons) / normal.sf(t);
            assert!((0.5..1.5).contains(&ratio), "{m}: {ratio}");
            assert!(m > 400.0 || chance(t) > 2.5 * normal.sf(t), "{m}");
        }
    }

    #[test]
    fn the_significance_of_noise_is_the_one_that_peaks_exceed_once_in_10000_frames() {
        for (radius, fwhm) in [(30.0, 1.5), (120.0, 4.0), (1000.0, 2.0f64)] {
            let t = noise_reaches(radius, fwhm, 0.0);
            let peaks = radius * radius / (4.0 * std::f64::consts::TAU.sqrt() * filter_variance(fwhm))
                * t
                * (-0.5 * t * t).exp();
            assert!((peaks / FALSE_PEAKS - 1.0).abs() < 0.01, "{radius}: {peaks}");
        }
        // where the place is known nothing is added to the significance that is wanted
        assert!(noise_reaches(1.0, 3.0, 0.1) < 5.0);
        for radius in [0.0, 1e-9, 1.0] {
            let t = noise_reaches(radius, 3.0, 0.0);
            assert!(statrs::distribution::Normal::standard().sf(t) < 1.001 * FALSE_PEAKS && t < 5.0, "{radius}: {t}");
        }
    }
}
