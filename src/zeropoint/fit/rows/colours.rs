//! Errors in variables: the true colour that is expected of each star, given its measured colour and its error.
//!
//! Magnitudes. Regression calibration (Carroll et al. 2006, Measurement Error in Nonlinear Models, ch. 4) takes E(b | B) for the
//! measured colour B, so that a cut on B does not bias the colour term. The distribution of the true colours b is estimated
//! from all stars before the cut, by maximum likelihood on a grid (Kiefer & Wolfowitz 1956, Ann. Math. Stat. 27, 887) with a
//! Gaussian of the same mean and variance as a weak prior. A cut that was made before the stars reached the program cannot be
//! allowed for.

use super::{BELIEVED_SHARE, Calibration, Rows};
use crate::config::{self, Estimator};

/// Number of stars that the Gaussian prior of the distribution counts as.
const PRIOR_STARS: f64 = 3.0;
/// Spacing of the grid in units of the root mean square error of the colours.
const STEP: f64 = 0.5;
/// Most points of the grid; smaller errors than it resolves are corrected as if the distribution were a Gaussian.
const MOST_POINTS: f64 = 300.0;
/// Stars from which the distribution is estimated; more do not make it better.
const MOST_STARS: usize = 2_000;
/// Rounds of expectation and maximisation.
const ROUNDS: usize = 100;
/// Half-width of the grid in standard deviations of the measured colours.
const WIDTH: f64 = 5.0;

/// The distribution of the true colours.
struct Distribution {
    mean_mag: f64,
    /// Variance of the true colours \[mag²\].
    variance: f64,
    /// Points of the grid \[mag\] and their probabilities; empty where the Gaussian is used.
    points: Vec<(f64, f64)>,
    /// Smallest variance of a measured colour that the grid resolves \[mag²\].
    resolved: f64,
}

impl Distribution {
    /// From measured colours with the variances of their errors, sorted.
    fn of(measured: &[(f64, f64)], mean_mag: f64, observed: f64, variance: f64, error_variance: f64) -> Distribution {
        let mut out = Distribution { mean_mag, variance, points: Vec::new(), resolved: 0.0 };
        let step = STEP * error_variance.sqrt();
        let half = WIDTH * observed.sqrt();
        let inside: Vec<(f64, f64)> = measured.iter().copied().filter(|m| (m.0 - mean_mag).abs() <= half).collect();
        let (Some(first), Some(last)) = (inside.first(), inside.last()) else { return out };
        let intervals = ((last.0 - first.0) / step).ceil().max(2.0);
        if !(intervals <= MOST_POINTS && variance > 0.0) {
            return out;
        }
        out.resolved = step * step;
        let width = (last.0 - first.0) / intervals;
        let grid = (0..=intervals as usize).map(|k| first.0 + k as f64 * width);
        out.points = grid.map(|x| (x, (-0.5 * (x - mean_mag).powi(2) / variance).exp())).collect();
        let total: f64 = out.points.iter().map(|p| p.1).sum();
        out.points.iter_mut().for_each(|p| p.1 /= total);
        let prior: Vec<f64> = out.points.iter().map(|p| p.1).collect();
        let densities: Vec<Vec<f64>> = inside
            .iter()
            .step_by(inside.len().div_ceil(MOST_STARS))
            .map(|(b_v, v)| {
                let v = v.max(out.resolved);
                out.points.iter().map(|(x, _)| (-0.5 * (b_v - x).powi(2) / v).exp()).collect()
            })
            .collect();
        let number = densities.len() as f64 + PRIOR_STARS;
        let mut expected = vec![0.0; prior.len()];
        for _ in 0..ROUNDS {
            expected.iter_mut().zip(&prior).for_each(|(e, p)| *e = PRIOR_STARS * p);
            for density in &densities {
                let sum: f64 = density.iter().zip(&out.points).map(|(d, (_, p))| d * p).sum();
                for ((e, d), (_, p)) in expected.iter_mut().zip(density).zip(&out.points) {
                    *e += d * p / sum.max(f64::MIN_POSITIVE);
                }
            }
            out.points.iter_mut().zip(&expected).for_each(|((_, p), e)| *p = e / number);
        }
        out
    }

    /// Expected true colour \[mag\] and its variance \[mag²\] for a measured one with the variance of its error.
    fn given(&self, b_v: f64, v: f64) -> (f64, f64) {
        let share = self.variance / (self.variance + v);
        let gaussian = (self.mean_mag + share * (b_v - self.mean_mag), share * v);
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return gaussian };
        if !(v >= self.resolved && (first.0..=last.0).contains(&b_v)) {
            return gaussian;
        }
        let (mut sum, mut mean) = (0.0, 0.0);
        for (x, p) in &self.points {
            let weight = p * (-0.5 * (b_v - x).powi(2) / v).exp();
            sum += weight;
            mean += weight * (x - b_v);
        }
        // the estimated distribution is lumpier than the true one, and its variances are too small
        if sum > 0.0 { (b_v + mean / sum, gaussian.1) } else { gaussian }
    }
}

impl Rows {
    /// Replaces each colour by the true colour that is expected of the star: the error of the colours would else make C too
    /// small. The distribution of the colours is that of `population`, B−V and its error \[mag\] before any cut, or of the
    /// stars themselves where `population` is not larger.
    pub(super) fn correct_colours(&mut self, population: &[[f64; 2]], config: &config::Zeropoint) {
        self.colour = self.stars.iter().map(|(_, s)| s.b_v_mag).collect();
        if config.estimator == Estimator::Ols || self.var_colour.iter().all(|v| *v == 0.0) {
            return;
        }
        let mut seen = vec![false; self.n_stars];
        let mut measured: Vec<(f64, f64)> = (0..self.len())
            .filter(|i| !std::mem::replace(&mut seen[self.star_of[*i]], true) && self.colour[*i].is_finite())
            .map(|i| (self.colour[i], self.var_colour[i]))
            .collect();
        if population.len() > measured.len() {
            measured = population.iter().map(|[b_v, err]| (*b_v, err * err)).collect();
        }
        measured.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let n = measured.len() as f64;
        if n < 3.0 {
            return;
        }
        let mean = measured.iter().map(|m| m.0).sum::<f64>() / n;
        let observed = measured.iter().map(|m| (m.0 - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let errors = measured.iter().map(|m| m.1).sum::<f64>() / n;
        let own = (observed - errors).max(0.0);
        let share = if observed > 0.0 { own / observed } else { 1.0 };
        // λ = 1 − σ²/S²; S² of n stars is known to √(2/(n − 1))
        let rel_err = if share > 0.0 { (1.0 - share) / share * (2.0 / (n - 1.0)).sqrt() } else { 0.0 };
        self.calibration = Calibration { share, rel_err, err_mag: errors.sqrt() };
        if share < BELIEVED_SHARE {
            return;
        }
        let distribution = Distribution::of(&measured, mean, observed, own, errors);
        for (b_v, v) in self.colour.iter_mut().zip(&mut self.var_colour) {
            if b_v.is_finite() {
                (*b_v, *v) = distribution.given(*b_v, *v);
            }
        }
    }
}
