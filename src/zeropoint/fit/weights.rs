//! Weights of the robust fit, and what a fit ends with.

use super::crossed::Sums;
use super::marginal::Stars;
use super::mixed::Means;
use super::noise::FLOOR_MAG;
use super::rows::Rows;
use super::solve::Vector;
use crate::config::Estimator;

/// Tukey's constant: 95 % efficiency for Gaussian errors.
pub(super) const TUKEY_C: f64 = 4.685;

/// Huber's constant: 95 % efficiency.
pub(super) const HUBER_C: f64 = 1.345;

/// Most rounds in which the scatter follows the fit.
pub const SCALE_ROUNDS: usize = 25;

/// Change of the terms below which the fit has converged \[mag\].
pub const CONVERGED_MAG: f64 = 1e-12;

/// A converged fit in the centred system.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Offset, k, C, k''.
    pub theta: Vector,
    /// Robust weight per row, 0 to 1.
    pub weights: Vec<f64>,
    /// Standard deviation of each row \[mag\].
    pub sigma: Vec<f64>,
    /// Precision each row has in the result \[1/mag²\]: its weight, its σ and the efficiency of the estimator.
    pub omega: Vec<f64>,
    /// Slope of the influence function over the weight: by how much a row pushes back when the fit moves.
    pub slope: f64,
    /// Offset of each pointing \[mag\].
    pub offsets: Vec<f64>,
    /// Variance of the pointings' own offsets \[mag²\].
    pub tau2: f64,
    /// Scatter beyond the stated errors \[mag\].
    pub intrinsic_mag: f64,
    /// Share of outliers, those hidden among the good stars included.
    pub outlier_share: f64,
    /// Offset of the star of each row \[mag\]; 0 where stars are measured once.
    pub star_offset: Vec<f64>,
    /// Stated variances and weights of the stars, where they are measured repeatedly.
    pub stars: Stars,
    /// Variance of the stars in units of the stated one.
    pub kappa: f64,
    /// Parameters fitted, the shrunk offsets counted by what they take up.
    pub fitted: f64,
}

impl Fit {
    /// A fit of `n` rows in `g` pointings before the first round.
    pub fn start(theta: Vector, n: usize, g: usize) -> Fit {
        Fit {
            theta,
            weights: vec![1.0; n],
            sigma: Vec::new(),
            omega: vec![0.0; n],
            slope: 1.0,
            offsets: vec![0.0; g],
            tau2: 0.0,
            intrinsic_mag: 0.0,
            outlier_share: 0.0,
            star_offset: vec![0.0; n],
            stars: Stars::default(),
            kappa: 1.0,
            fitted: 0.0,
        }
    }

    /// Values whose weighted least squares are this fit: ψ answers a shift by its slope only.
    pub fn pseudo_value(&self, rows: &Rows, i: usize) -> f64 {
        let r = self.pull(rows, i) * self.sigma[i];
        rows.y(i) - r * (1.0 - 1.0 / self.slope)
    }

    /// The same fit of rows that have the offsets of their stars taken out.
    pub fn without_star_offsets(&self) -> Fit {
        Fit { star_offset: vec![0.0; self.star_offset.len()], ..self.clone() }
    }

    /// Offset of each star; none where stars are measured once.
    pub fn offsets_of_stars(&self, rows: &Rows) -> Vec<f64> {
        if !rows.repeated {
            return Vec::new();
        }
        let mut out = vec![0.0; rows.n_stars];
        (0..rows.len()).for_each(|i| out[rows.star_of[i]] = self.star_offset[i]);
        out
    }

    /// The sums of the rows as the fit weighs them.
    pub fn sums(&self, rows: &Rows) -> Sums {
        Sums::of(rows, &self.omega, |i| self.pseudo_value(rows, i))
    }

    /// Robust mean residual of each pointing \[mag\]. The weighted mean has gone only part of the way from the shrunk offset
    /// that the weights are centred on: (d − û)/slope goes all of it.
    pub fn deviations(&self, means: &Means) -> Vec<f64> {
        let one = |(j, u): (usize, &f64)| u + (means.residual(j, &self.theta) - u) / self.slope;
        self.offsets.iter().enumerate().map(one).collect()
    }

    /// Logarithm of the likelihood of good stars about their pointings' offsets and outliers anywhere within `range` \[mag\].
    pub(super) fn log_likelihood(&self, rows: &Rows, range: f64) -> f64 {
        let bad = self.outlier_share.clamp(1e-3, 0.999);
        let star = |i: usize| {
            let u = self.pull(rows, i);
            let gauss = (-0.5 * u * u).exp() / (self.sigma[i] * (2.0 * std::f64::consts::PI).sqrt());
            ((1.0 - bad) * gauss + bad / range.max(FLOOR_MAG)).ln()
        };
        let means = Means::of(rows, &self.omega);
        let pointing = |j: usize| {
            let deviation = if self.tau2 > 0.0 { self.offsets[j].powi(2) / self.tau2 } else { 0.0 };
            0.5 * (deviation + (self.tau2 * means.weight[j]).ln_1p())
        };
        (0..rows.len()).map(star).sum::<f64>() - (0..rows.pointings.len()).map(pointing).sum::<f64>()
    }

    /// Residual of row `i` about its pointing's offset, in σ.
    pub fn pull(&self, rows: &Rows, i: usize) -> f64 {
        let offsets = self.offsets[rows.group[i]] + self.star_offset[i];
        (rows.residual(i, &self.theta) - offsets) / self.sigma[i]
    }
}

/// w(u) = ψ(u)/u of an estimator.
pub fn weight(estimator: Estimator, u: f64) -> f64 {
    match estimator {
        Estimator::Robust => {
            let t = (u / TUKEY_C).powi(2);
            if t < 1.0 { (1.0 - t).powi(2) } else { 0.0 }
        }
        Estimator::Huber => (HUBER_C / u.abs().max(1e-300)).min(1.0),
        Estimator::Clip => f64::from(u8::from(u.abs() < CLIP)),
        Estimator::Ols => 1.0,
    }
}

/// ψ′(u).
pub(super) fn psi_slope(estimator: Estimator, u: f64) -> f64 {
    match estimator {
        Estimator::Robust => {
            let t = (u / TUKEY_C).powi(2);
            if t < 1.0 { (1.0 - t) * (1.0 - 5.0 * t) } else { 0.0 }
        }
        Estimator::Huber => f64::from(u8::from(u.abs() < HUBER_C)),
        Estimator::Clip | Estimator::Ols => weight(estimator, u),
    }
}

/// With few degrees of freedom the stated errors bound the precision of the rows from above.
pub fn limit_precision(rows: &Rows, fit: &mut Fit, fitted: f64) {
    if !rows.weighted || rows.len() as f64 - fitted >= FEW_DOF {
        return;
    }
    for i in 0..rows.len() {
        let stated = rows.stated_var(i, &fit.theta).max(FLOOR_MAG * FLOOR_MAG);
        fit.omega[i] = fit.omega[i].min(fit.weights[i] / stated);
    }
}

/// Precision of a row per weight and σ⁻², and mean slope over mean weight (Huber 1981, eq. 7.6.8):
/// (Σψ′)² (1 − p/n) / (K² Σψ² Σw), K = 1 + (p/n) var ψ′ / (mean ψ′)².
pub fn efficiency(estimator: Estimator, weights: &[f64], pull: impl Fn(usize) -> f64, fitted: f64) -> (f64, f64) {
    let n = weights.len() as f64;
    let (mut psi2, mut slope, mut slope2, mut weight) = (0.0, 0.0, 0.0, 0.0);
    for (i, w) in weights.iter().enumerate() {
        let u = pull(i);
        let d = psi_slope(estimator, u);
        psi2 += (w * u).powi(2);
        slope += d;
        slope2 += d * d;
        weight += w;
    }
    let mean = (slope / n).max(0.1);
    let k = 1.0 + fitted / n * (slope2 / n - mean * mean).max(0.0) / (mean * mean);
    let left = ((n - fitted) / n).max(1.0 / n);
    // perfect data: at most a thousand times the stated precision
    let gain = n * mean * mean * left / (k * k * (psi2 / n).max(1e-3) * weight.max(1e-300));
    (gain, n * mean / weight.max(1e-300))
}

/// The clip \[σ\].
pub(crate) const CLIP: f64 = 3.0;

/// With fewer degrees of freedom than this the stated errors bound the covariance from below.
pub(crate) const FEW_DOF: f64 = 10.0;
