//! The fluxes of a pass as means: of all of its frames, and of bins of equal signal-to-noise.
//!
//! Any unit of flux, seconds. Frames are weighted by their errors without the photons of the target, so that a frame in which
//! it is bright counts no less. It does not cover magnitudes.

use nalgebra::{SMatrix, SVector};

use crate::photometry::target::measure::LIMIT_MARGIN_SIGMA;

/// Terms of the flux by time that decides where bins end: a parabola.
const TERMS: usize = 3;
/// The flux there is at least this share of the mean of the pass.
const LEAST_SHARE: f64 = 0.2;
/// A last bin with less than this share of the wanted weight joins the one before.
const LEAST_LAST: f64 = 0.5;
/// The flux of a frame may be that of the pass up to so many of its errors from it \[σ\], or up to this factor.
const LIKE_SIGMA: f64 = 5.0;
const LIKE_FACTOR: f64 = 2.0;
/// Fewer pulls of empty places than this do not check the errors.
const FEWEST_PULLS: f64 = 8.0;

/// The flux in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FramePoint {
    /// Time \[s\].
    pub t_s: f64,
    /// The flux, negative or not.
    pub flux: f64,
    /// Its variance without the photons of the target.
    pub variance: f64,
    /// What a target of unit flux adds to it.
    pub variance_per_flux: f64,
    /// By how much of itself the flux scatters because the target does not stand still.
    pub moved_frac: f64,
}

impl FramePoint {
    /// The variance of its flux where the target is `expected` to be this bright: σ² + g F + (m F)².
    fn variance_of(&self, expected: f64) -> f64 {
        self.variance + expected * self.variance_per_flux + (expected * self.moved_frac).powi(2)
    }

    /// Its flux over its error, with the photons of the target.
    #[must_use]
    pub fn snr(&self) -> f64 {
        self.flux / (self.variance + self.flux.max(0.0) * self.variance_per_flux).sqrt()
    }
}

/// The mean of some frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Weighted mean flux.
    pub flux: f64,
    /// Its error.
    pub err: f64,
    /// Its error without the photons of the target.
    pub empty_err: f64,
    /// What a target of unit flux adds to its variance.
    pub variance_per_flux: f64,
    /// By how much of itself it scatters because the target does not stand still.
    pub moved_frac: f64,
    /// Weighted mean time \[s\].
    pub t_s: f64,
    /// χ² per degree of freedom of the frames about the mean; `None` for one frame.
    pub chi2_dof: Option<f64>,
}

/// F = Σ w f / Σ w, Var F = Σ w² (σ² + g F + m² F²) / (Σ w)²: σ² the variance without the target, g F that of its photons, m F
/// that of its jitter. w = 1/(σ² + m² F₀²), F₀ the mean with w = 1/σ²: not the flux of the frame, which would favour those whose
/// flux is too small.
///
/// `scale` multiplies every error. `None` without frames.
#[must_use]
pub fn mean(frames: &[FramePoint], scale: f64) -> Option<Mean> {
    let of = |expected: f64| {
        let weight = move |f: &FramePoint| 1.0 / (f.variance + (expected * f.moved_frac).powi(2));
        let total: f64 = frames.iter().map(weight).sum();
        let sum = frames.iter().map(|f| weight(f) * f.flux).sum::<f64>();
        (total > 0.0 && total.is_finite()).then_some((weight, total, sum / total))
    };
    let (weight, total, flux) = of(of(0.0)?.2.max(0.0))?;
    let t_s = frames.iter().map(|f| weight(f) * f.t_s).sum::<f64>() / total;
    let own = flux.max(0.0);
    let empty2 = (scale / total).powi(2) * frames.iter().map(|f| f.variance * weight(f).powi(2)).sum::<f64>();
    let per_flux =
        frames.iter().map(|f| f.variance_per_flux * weight(f).powi(2)).sum::<f64>() * (scale / total).powi(2);
    let moved2 = frames.iter().map(|f| (f.moved_frac * weight(f)).powi(2)).sum::<f64>() / total.powi(2);
    let err = (empty2 + own * per_flux + own * own * moved2).sqrt();
    let chi2: f64 = frames.iter().map(|f| (f.flux - flux).powi(2) / f.variance_of(own)).sum::<f64>() / (scale * scale);
    let chi2_dof = (frames.len() > 1).then(|| chi2 / (frames.len() - 1) as f64);
    Some(Mean {
        flux,
        err,
        empty_err: empty2.sqrt(),
        variance_per_flux: per_flux,
        moved_frac: moved2.sqrt(),
        t_s,
        chi2_dof,
    })
}

impl Mean {
    /// Whether a frame may show a target of this flux: within the error that it has of it, or a factor of two, since targets vary.
    #[must_use]
    pub fn may_be(&self, frame: &FramePoint) -> bool {
        let own = self.flux.max(0.0);
        let is_near = (frame.flux - self.flux).powi(2) < LIKE_SIGMA * LIKE_SIGMA * frame.variance_of(own);
        is_near || (own / LIKE_FACTOR..own * LIKE_FACTOR).contains(&frame.flux)
    }

    /// Its error where the target is `expected` to be this bright: one that was next to its place is too faint, and so would be what
    /// its jitter makes of it.
    #[must_use]
    pub fn err_of_expected(&self, expected: f64) -> f64 {
        let (expected, own) = (expected.max(0.0), self.flux.max(0.0));
        (self.err * self.err + (expected * expected - own * own).max(0.0) * self.moved_frac.powi(2)).sqrt()
    }

    /// The flux t of which 95 % would reach a signal-to-noise of T: t = n √(σ² + g t), n = T + 1.645, σ² + g t its variance.
    #[must_use]
    pub fn limit(&self, threshold: f64) -> f64 {
        let n2 = (threshold + LIMIT_MARGIN_SIGMA).powi(2);
        let ng = n2 * self.variance_per_flux;
        0.5 * (ng + (ng * ng + 4.0 * n2 * self.empty_err * self.empty_err).sqrt())
    }
}

/// The frames of a pass, in order of time, as bins of about the signal-to-noise `snr`: first and one past the last frame of each.
///
/// A bin ends where its error has become the `snr`th part of the flux that a parabola through the fluxes of all frames expects
/// there, never where its own flux is large enough: that would make every bin too bright. One bin where the whole pass does
/// not reach `snr`.
#[must_use]
pub fn bins(frames: &[FramePoint], snr: f64, scale: f64) -> Vec<std::ops::Range<usize>> {
    let n = frames.len();
    if n == 0 {
        return Vec::new();
    }
    let expected = smooth_flux(frames);
    let mut bins: Vec<std::ops::Range<usize>> = Vec::new();
    let (mut first, mut wanted, mut reached) = (0, 0.0, 0.0);
    for (k, (frame, flux)) in frames.iter().zip(&expected).enumerate() {
        // with the photons of the expected flux
        let weight = 1.0 / (scale * scale * (frame.variance + flux.max(0.0) * frame.variance_per_flux));
        reached += weight;
        wanted += weight * flux;
        // S/N = F √W, F the expected mean of the bin
        if flux > &0.0 && wanted / reached * f64::sqrt(reached) >= snr {
            bins.push(first..k + 1);
            (first, wanted, reached) = (k + 1, 0.0, 0.0);
        }
    }
    if first < n {
        let last_snr = if reached > 0.0 { wanted / f64::sqrt(reached) } else { 0.0 };
        match bins.last_mut() {
            Some(last) if last_snr * last_snr < LEAST_LAST * snr * snr => last.end = n,
            _ => bins.push(first..n),
        }
    }
    bins
}

/// The parabola in time that fits the fluxes best, at least a share of their mean; 0 where the mean is not positive.
fn smooth_flux(frames: &[FramePoint]) -> Vec<f64> {
    let Some(all) = mean(frames, 1.0) else { return vec![0.0; frames.len()] };
    let (first, last) = (frames[0].t_s, frames[frames.len() - 1].t_s);
    let u = |f: &FramePoint| if last > first { 2.0 * (f.t_s - first) / (last - first) - 1.0 } else { 0.0 };
    let terms = |f: &FramePoint| SVector::<f64, TERMS>::from([1.0, u(f), u(f) * u(f)]);
    let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut right = SVector::<f64, TERMS>::zeros();
    for f in frames {
        let (t, w) = (terms(f), 1.0 / f.variance);
        right += t * (w * f.flux);
        normal += t * t.transpose() * w;
    }
    let fitted = (frames.len() > 2 * TERMS).then(|| normal.cholesky().map(|c| c.solve(&right))).flatten();
    let least = LEAST_SHARE * all.flux.max(0.0);
    let at = |f: &FramePoint| match fitted {
        Some(c) => terms(f).dot(&c).max(least),
        None => all.flux.max(0.0),
    };
    frames.iter().map(at).collect()
}

/// The fluxes of a pass at places without a target, which say whether its errors hold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EmptyPlaces {
    /// Σ f/σ² and Σ 1/σ² of each place.
    sums: Vec<[f64; 2]>,
    /// Σ (f/σ)² of all places and frames, and their number.
    pulls: [f64; 2],
}

impl EmptyPlaces {
    /// Adds the flux and variance at each place of one frame, `None` where it is masked.
    pub fn add(&mut self, places: &[Option<(f64, f64)>]) {
        self.sums.resize(self.sums.len().max(places.len()), [0.0; 2]);
        for (sum, (flux, variance)) in self.sums.iter_mut().zip(places).filter_map(|(s, p)| Some((s, (*p)?))) {
            sum[0] += flux / variance;
            sum[1] += 1.0 / variance;
            self.pulls[0] += flux * flux / variance;
            self.pulls[1] += 1.0;
        }
    }

    /// By how much the errors must be multiplied so that empty places scatter by them, in frames and in their mean: 1 where they
    /// do within the noise.
    ///
    /// √(Σ pull²/n), if Σ pull² of n independent pulls exceeds n + 3 √(2n).
    #[must_use]
    pub fn error_scale(&self) -> f64 {
        let scale = |sum: f64, n: f64| {
            if n < FEWEST_PULLS || sum <= n + 3.0 * (2.0 * n).sqrt() { 1.0 } else { (sum / n).sqrt() }
        };
        let seen: Vec<f64> = self.sums.iter().filter(|s| s[1] > 0.0).map(|s| s[0] * s[0] / s[1]).collect();
        scale(seen.iter().sum(), seen.len() as f64).max(scale(self.pulls[0], self.pulls[1]))
    }
}
