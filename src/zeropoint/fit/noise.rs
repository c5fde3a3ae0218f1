//! How much the stars scatter: the intrinsic scatter by maximum likelihood, with a share of stars that are outliers.
//!
//! Magnitudes. Within ±6 σ a residual is either Gaussian, σ_i² = s² (stated_i² + τ²), or anything (uniform); both shares
//! and τ by expectation and maximisation. The uniform part keeps blends near the good stars from widening σ.

use super::rows::Rows;
use super::solve::Vector;

/// Smallest standard deviation of a row \[mag\]; keeps perfect data from dividing by zero.
pub const FLOOR_MAG: f64 = 1e-9;
/// Stated errors are assumed to be too large by a factor of ten at most.
const SMALLEST_SHARE: f64 = 0.1;
/// Rows that set the scale; more do not make it better.
const SCALE_ROWS: usize = 4_000;
/// Half-width of the window \[σ\]: a Gaussian has 2e-9 outside.
const WINDOW: f64 = 6.0;

/// The scale of the residuals.
#[derive(Debug, Clone)]
pub struct Noise {
    /// Standard deviation of each row \[mag\].
    pub sigma: Vec<f64>,
    /// Scatter beyond the stated errors τ \[mag\].
    pub intrinsic_mag: f64,
    /// Share of the stars that are outliers, those hidden among the good ones included.
    pub outlier_share: f64,
    /// Share of outliers within the window.
    background: f64,
    /// Whether the stated errors are taken as they are.
    trusted: bool,
}

impl Noise {
    /// A first guess: the stated errors and a scatter \[mag\].
    pub fn guess(rows: &Rows, theta: &Vector, scatter_mag: f64) -> Noise {
        let sigma = |i: usize| (stated(rows, i, theta) + scatter_mag * scatter_mag).sqrt().max(FLOOR_MAG);
        let sigma = (0..rows.len()).map(sigma).collect();
        Noise { sigma, intrinsic_mag: scatter_mag, outlier_share: 0.0, background: 0.1, trusted: false }
    }

    /// The stated errors and nothing else, whatever the residuals say.
    pub fn stated(rows: &Rows, theta: &Vector) -> Noise {
        Noise { trusted: true, ..Noise::guess(rows, theta, 0.0) }
    }

    /// `steps` of expectation and maximisation on the residuals; `fitted` parameters were fitted to them.
    pub fn improve(&mut self, rows: &Rows, theta: &Vector, residuals: &[f64], fitted: f64, steps: usize) {
        let n = rows.len();
        let step = n.div_ceil(SCALE_ROWS);
        let judges: Vec<usize> = (0..n).step_by(step).collect();
        // residual², stated variance, density of the uniform part; windows of the σ before
        let inside: Vec<(f64, f64, f64)> = judges
            .iter()
            .filter(|i| residuals[**i].abs() < WINDOW * self.sigma[**i])
            .map(|i| (residuals[*i].powi(2), stated(rows, *i, theta), 0.5 / (WINDOW * self.sigma[*i])))
            .collect();
        let m = inside.len() as f64;
        let share = m / judges.len() as f64;
        // the residuals are smaller than the errors by what was fitted to them
        let used = (fitted / n as f64).min(0.9);
        let (mut tau2, mut s2) = (self.intrinsic_mag.powi(2), 1.0);
        let mut good = vec![1.0; inside.len()];
        for _ in 0..steps {
            for (p, (r2, v, uniform)) in good.iter_mut().zip(&inside) {
                let var = (s2 * (v + tau2)).max(FLOOR_MAG * FLOOR_MAG);
                let gauss =
                    (1.0 - self.background) * (-0.5 * r2 / var).exp() / (2.0 * std::f64::consts::PI * var).sqrt();
                let other = self.background * uniform;
                *p = if gauss + other > 0.0 { gauss / (gauss + other) } else { 0.0 };
            }
            let kept: f64 = good.iter().sum();
            // five stars of a prior of 2 % keep a dozen good stars from being called outliers
            self.background = (m - kept + 0.1) / (m + 5.0);
            if self.trusted {
                continue;
            }
            let grow = 1.0 / (1.0 - used * (m / kept.max(1.0)).min(1.0 / used.max(1e-9) * 0.9));
            (tau2, s2) = maximise(&inside, &good, grow, tau2);
        }
        self.intrinsic_mag = if tau2.sqrt() > FLOOR_MAG { tau2.sqrt() } else { 0.0 };
        self.outlier_share = 1.0 - share * (1.0 - self.background);
        for (i, sigma) in self.sigma.iter_mut().enumerate() {
            *sigma = (s2 * (stated(rows, i, theta) + tau2)).sqrt().max(FLOOR_MAG);
        }
    }
}

fn stated(rows: &Rows, i: usize, theta: &Vector) -> f64 {
    if rows.weighted { rows.stated_var(i, theta) } else { 0.0 }
}

/// One step towards the τ² of Σ p (r² − σ²)/σ⁴ = 0, τ² = Σ p (r² − v)/σ⁴ / Σ p/σ⁴; or s² < 1 where the stated errors alone
/// are too large.
fn maximise(inside: &[(f64, f64, f64)], good: &[f64], grow: f64, tau2: f64) -> (f64, f64) {
    let least = FLOOR_MAG * FLOOR_MAG;
    let (mut excess, mut total) = (0.0, 0.0);
    for ((r2, v, _), p) in inside.iter().zip(good) {
        let weight = p / (v + tau2).max(least).powi(2);
        excess += weight * (r2 * grow - v);
        total += weight;
    }
    if excess > 0.0 {
        return ((excess / total).max(least), 1.0);
    }
    let (mut sum, mut weight) = (0.0, 0.0);
    for ((r2, v, _), p) in inside.iter().zip(good) {
        sum += p * r2 * grow / v.max(least);
        weight += p;
    }
    let s2 = if weight > 0.0 { sum / weight } else { 1.0 };
    (0.0, s2.clamp(SMALLEST_SHARE * SMALLEST_SHARE, 1.0))
}
