//! The uncertainty of the scatters enters the error: the terms averaged over the scatter between pointings and of stars.
//!
//! Magnitudes. Each pair of scatters has its restricted likelihood, its terms and their covariance; the 68 % and 95 %
//! intervals of each term are those of the mixture, which is what Student's t is for one group. A few pointings do not
//! determine how much pointings scatter: then a half-t distribution (4 degrees of freedom; Gelman 2006, Bayesian Anal.
//! 1, 515) of the site's own scatter is used. It does not cover the correlation of the uncertainty of scatters with
//! outliers.

use std::convert::Infallible;

use crate::base::search::{Until, golden_section};
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::erf::erf;

use super::crossed::{Solved, Sums};
use super::rows::Rows;
use super::rows::has_pointings;
use super::solve::{Matrix, N, Vector};
use crate::config;

/// From so many pointings on, the prior of their scatter is not used: they determine it themselves.
pub const TOLD_BY: usize = 10;
/// Two-sided probabilities of the intervals: ±1 σ and 95 %.
pub const SHARES: [f64; 2] = [0.682_689_492_137_086, 0.95];
/// Standard deviations of these intervals of a Gaussian.
pub const SIGMAS: [f64; 2] = [1.0, 1.959_963_984_540_054];
/// Degrees of freedom of the prior of the scatter.
const PRIOR_DOF: f64 = 4.0;
/// Standard deviation of ln κ, κ the variance of a star in units of the stated one: stated errors are off by a factor of two.
const STATED_SD: f64 = 1.5;
/// Relative density below which a scatter is skipped.
const NEGLIGIBLE: f64 = 1e-4;
/// Degrees of freedom from which Student's t is a Gaussian.
const MANY: f64 = 1e5;
/// Dense rows above which fewer scatters are tried.
const LARGE: usize = 60;

/// The source of the scatter between pointings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// Half-t of this scale \[mag\].
    Site(f64),
    /// The pointings determine it.
    Flat,
    /// One scatter for stars and pointings: they cannot be separated.
    None,
}

impl Prior {
    /// Of a fit.
    pub fn of(rows: &Rows, config: &config::Zeropoint) -> Prior {
        let site = config.pointing_scatter_prior_mag;
        match rows.pointings.len() {
            1 if site > 0.0 => Prior::Site(site),
            1 => Prior::None,
            _ if !has_pointings(rows) => Prior::None,
            g if g < TOLD_BY && site > 0.0 => Prior::Site(site),
            _ => Prior::Flat,
        }
    }

    fn log_density(self, tau: f64) -> f64 {
        match self {
            Prior::Site(scale) => -0.5 * (PRIOR_DOF + 1.0) * (tau * tau / (scale * scale * PRIOR_DOF)).ln_1p(),
            Prior::Flat | Prior::None => 0.0,
        }
    }
}

/// The scatter of stars: stated variance of each and the weight the fit gives it.
#[derive(Debug, Clone, Default)]
pub struct Stars {
    /// Stated variance of each star \[mag²\]; the same for all where none is stated.
    pub stated: Vec<f64>,
    /// Their mean \[mag²\].
    pub mean: f64,
    /// Whether errors are stated at all.
    pub known: bool,
    /// Weight of each star, 0 to 1.
    pub weight: Vec<f64>,
}

impl Stars {
    /// Variance of star `q` when the stars scatter by κ times what is stated: scaled below it, added to above it.
    pub fn var(&self, kappa: f64, q: usize) -> f64 {
        if kappa < 1.0 { kappa * self.stated[q] } else { self.stated[q] + (kappa - 1.0) * self.mean }
    }

    /// Standard deviations for the solver; a star without weight is free.
    pub fn sds(&self, kappa: f64) -> Vec<f64> {
        (0..self.stated.len()).map(|q| (self.var(kappa, q) / self.weight[q].max(1e-4)).sqrt()).collect()
    }
}

/// Terms and covariance for one pair of scatters.
#[derive(Debug, Clone)]
struct Node {
    weight: f64,
    tau: f64,
    log_kappa: f64,
    theta: Vector,
    cov: Matrix,
}

/// The average over scatters.
#[derive(Debug, Clone)]
pub struct Marginal {
    nodes: Vec<Node>,
    /// Mean scatter between pointings \[mag\].
    pub tau_mag: f64,
    /// Its root mean square \[mag\].
    pub tau_rms_mag: f64,
    /// κ of the stars.
    pub kappa: f64,
}

/// The grid over which the scatters are averaged.
pub struct Problem<'a> {
    /// The rows.
    pub sums: &'a Sums,
    /// Values of the scatter between pointings.
    pub prior: Prior,
    /// Typical scatter of the pointings' offsets and their error from the stars alone \[mag\].
    pub offsets_mag: [f64; 2],
    /// The stars, if they are measured repeatedly.
    pub stars: &'a Stars,
    /// Precision of each pointing's own offset in units of 1/τ², for clouds; 1 as a rule.
    pub pointing_weight: &'a [f64],
    /// κ to begin from.
    pub kappa: f64,
    /// τ to begin from \[mag\].
    pub tau_mag: f64,
}

impl Problem<'_> {
    /// The solution for two scatters.
    pub fn at(&self, tau: f64, kappa: f64) -> Solved {
        let sds: Vec<f64> = self.pointing_weight.iter().map(|w| tau / w.max(1e-4).sqrt()).collect();
        self.sums.solve(&sds, &self.stars.sds(kappa))
    }

    fn log_posterior(&self, tau: f64, log_kappa: f64, solved: &Solved) -> f64 {
        // flat in the standard deviation of the stars, and not far from what is stated
        let stated = if self.stars.known { -0.5 * (log_kappa / STATED_SD).powi(2) } else { 0.0 } + 0.5 * log_kappa;
        solved.log_likelihood + self.prior.log_density(tau) + stated
    }

    /// Averages over the scatters; with `quick`, few values of them, for the rounds of the fit.
    pub fn integrate(&self, quick: bool) -> Marginal {
        let dense = self.stars.stated.len().min(self.pointing_weight.len());
        let few = quick || dense > LARGE;
        let kappas = self.kappas(few);
        let middle = kappas[kappas.len() / 2];
        let value = |tau: f64, log_kappa: f64| {
            let solved = self.at(tau, log_kappa.exp());
            (self.log_posterior(tau, log_kappa, &solved), solved)
        };
        // widths of the steps belong to the density
        let taus = self.taus(if self.stars.stated.is_empty() {
            24
        } else if few {
            7
        } else {
            14
        });
        let along: Vec<(f64, f64, f64, Solved)> = taus
            .iter()
            .map(|(tau, width)| {
                let (l, solved) = value(*tau, middle);
                (*tau, *width, l + width.ln(), solved)
            })
            .collect();
        let top = along.iter().map(|a| a.2).fold(f64::NEG_INFINITY, f64::max);
        let mut nodes: Vec<Node> = Vec::new();
        for (tau, width, l, solved) in along.into_iter().filter(|a| a.2 > top + NEGLIGIBLE.ln()) {
            for log_kappa in &kappas {
                let (l, solved) = if *log_kappa == middle {
                    (l, solved.clone())
                } else {
                    let (l, solved) = value(tau, *log_kappa);
                    (l + width.ln(), solved)
                };
                nodes.push(Node { weight: l, tau, log_kappa: *log_kappa, theta: solved.theta, cov: solved.cov });
            }
        }
        let top = nodes.iter().map(|n| n.weight).fold(f64::NEG_INFINITY, f64::max);
        nodes.iter_mut().for_each(|n| n.weight = (n.weight - top).exp());
        nodes.retain(|n| n.weight > NEGLIGIBLE);
        let total: f64 = nodes.iter().map(|n| n.weight).sum();
        nodes.iter_mut().for_each(|n| n.weight /= total);
        let mean = |f: &dyn Fn(&Node) -> f64| nodes.iter().map(|n| n.weight * f(n)).sum::<f64>();
        let tau_mag = mean(&|n| n.tau);
        let tau_rms_mag = mean(&|n| n.tau * n.tau).sqrt();
        let kappa = mean(&|n| n.log_kappa).exp();
        Marginal { nodes, tau_mag, tau_rms_mag, kappa }
    }

    /// ln κ to try: about the most likely one, as far as the likelihood reaches.
    fn kappas(&self, few: bool) -> Vec<f64> {
        if self.stars.stated.is_empty() {
            return vec![0.0];
        }
        let l = |log_kappa: f64| self.log_posterior(self.tau_mag, log_kappa, &self.at(self.tau_mag, log_kappa.exp()));
        let start = self.kappa.ln();
        let steps = Until::Steps(if few { 6 } else { 9 });
        let Ok((mode, top)) = golden_section(start - 4.0, start + 4.0, steps, |k| Ok::<f64, Infallible>(l(k)));
        let step = 0.3;
        let curvature = -(l(mode + step) + l(mode - step) - 2.0 * top) / (step * step);
        let sd = if curvature > 0.0 { curvature.sqrt().recip().clamp(0.02, 1.5) } else { 1.5 };
        let steps: i32 = if few { 1 } else { 3 };
        let width = if few { 1.4 } else { 0.85 };
        (-steps..=steps).map(|n| mode + f64::from(n) * width * sd).collect()
    }

    /// τ to try, with the width each stands for \[mag\].
    fn taus(&self, n: usize) -> Vec<(f64, f64)> {
        let [scatter, own] = self.offsets_mag;
        let (lo, hi) = match self.prior {
            Prior::None => return vec![(0.0, 1.0)],
            Prior::Site(scale) => (0.1 * own.min(scale), 5.0 * scatter.max(scale).max(own)),
            Prior::Flat => (0.1 * own, 4.0 * scatter.max(own)),
        };
        let lo = lo.clamp(1e-9, 1e-2 * hi.max(1e-7));
        let ratio = (hi / lo).powf(1.0 / (n - 1) as f64);
        let edge = |k: usize| lo * ratio.powi(k as i32);
        // the first stands for all below it
        let first = std::iter::once((0.5 * lo, lo));
        first.chain((0..n - 1).map(|k| (edge(k) * ratio.sqrt(), edge(k + 1) - edge(k)))).collect()
    }
}

/// Covariances whose ±√(gᵀ Cov g) hold the truth in 68 % and in 95 % of nights.
#[derive(Debug, Clone, Copy)]
pub struct Quoted {
    /// 68 %.
    pub cov: Matrix,
    /// 95 %.
    pub cov_95: Matrix,
}

impl Quoted {
    /// Of a covariance known from `dof` degrees of freedom, as it is for 68 %.
    pub fn of(cov: Matrix, dof: f64) -> Quoted {
        let t = quantile(SHARES[1], dof);
        Quoted { cov, cov_95: cov.map(|row| row.map(|c| t * t * c)) }
    }

    /// Adds the error `err` of a value that is held, to which the terms answer by `slope`.
    pub fn add(&mut self, slope: &Vector, err: f64) {
        for (cov, sigmas) in [(&mut self.cov, SIGMAS[0]), (&mut self.cov_95, SIGMAS[1])] {
            for i in 0..N {
                (0..N).for_each(|j| cov[i][j] += (sigmas * err).powi(2) * slope[i] * slope[j]);
            }
        }
    }
}

/// Student's t: the two-sided interval of probability `share`.
pub fn quantile(share: f64, dof: f64) -> f64 {
    let gauss = if share > 0.9 { SIGMAS[1] } else { SIGMAS[0] };
    if !(dof < MANY) {
        return gauss;
    }
    let t = StudentsT::new(0.0, 1.0, dof.max(1.0)).map(|d| d.inverse_cdf(0.5 + 0.5 * share));
    t.ok().filter(|t| t.is_finite()).map_or(gauss, |t| t.max(gauss))
}

impl Marginal {
    /// The intervals of the terms about `theta`. The scatter of the rows themselves, which gives `rows_cov`, is known from
    /// `dof` degrees of freedom.
    pub fn quoted(&self, theta: &Vector, rows_cov: &Matrix, dof: f64) -> Quoted {
        let grown = |n: usize| {
            let factor = (quantile(SHARES[n], dof) / SIGMAS[n]).powi(2) - 1.0;
            move |c: usize| factor * rows_cov[c][c]
        };
        let mut total = [[0.0; N]; N];
        for node in &self.nodes {
            let d: Vector = std::array::from_fn(|c| node.theta[c] - theta[c]);
            for i in 0..N {
                (0..N).for_each(|j| total[i][j] += node.weight * (node.cov[i][j] + d[i] * d[j]));
            }
        }
        let widths = |n: usize| -> Vector {
            let more = grown(n);
            std::array::from_fn(|c| self.width(c, theta[c], SHARES[n], more(c), total[c][c]))
        };
        let scaled = |w: Vector| -> Matrix {
            std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let norm = (total[i][i] * total[j][j]).sqrt();
                    if norm > 0.0 { total[i][j] / norm * w[i] * w[j] } else { 0.0 }
                })
            })
        };
        Quoted { cov: scaled(widths(0)), cov_95: scaled(widths(1)) }
    }

    /// Half-width about `theta` that holds `share` of the mixture for term `c`; `more` is added to each variance.
    fn width(&self, c: usize, theta: f64, share: f64, more: f64, total: f64) -> f64 {
        if !(total > 0.0) {
            return 0.0;
        }
        let parts: Vec<(f64, f64, f64)> = self
            .nodes
            .iter()
            .map(|n| (n.weight, n.theta[c] - theta, (2.0 * (n.cov[c][c] + more)).max(f64::MIN_POSITIVE).sqrt()))
            .collect();
        let inside =
            |q: f64| -> f64 { parts.iter().map(|(w, d, s)| 0.5 * w * (erf((q - d) / s) + erf((q + d) / s))).sum() };
        let scale = (total + more).sqrt();
        let (mut lo, mut hi) = (0.0, 4.0 * scale);
        let (mut below, mut above) = (0.0, inside(hi));
        for _ in 0..10 {
            let middle = 0.5 * (lo + hi);
            let value = inside(middle);
            if value < share { (lo, below) = (middle, value) } else { (hi, above) = (middle, value) }
        }
        if above > below { lo + (hi - lo) * (share - below) / (above - below) } else { hi }
    }
}
