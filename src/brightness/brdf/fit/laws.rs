//! The laws that can be fitted: their parameters, bounds, and where to start.
//!
//! Parameters that span decades are fitted as logarithms, so that a step is a ratio.

use std::sync::Arc;

use super::table::Geometry;
use crate::base::error::Result;
use crate::brightness::brdf::Binomial;
use crate::brightness::brdf::law::Brdf;
use crate::brightness::brdf::law::PHONG_N_MAX;
use crate::brightness::scene::impossible;

/// Largest coefficient of a binomial fit, either way.
const COEFFICIENT_MAX: f64 = 1000.0;
/// Most coefficients of a binomial fit.
const TERMS_MAX: usize = 60;

/// A law to fit.
#[derive(Debug, Clone, PartialEq)]
pub enum FitLaw {
    /// Albedo.
    Lambert,
    /// k_d, k_s, n.
    Phong,
    /// A, B, g.
    Abg,
    /// Peak and σ.
    Gaussian,
    /// B (n × m), C (n × (l2 − l1)) and, if free, d.
    Binomial {
        /// Rows n: powers of V, from 0.
        rows: usize,
        /// Columns m of B: powers of D, from 0.
        terms: usize,
        /// First power of d.
        l1: i32,
        /// First power of d that is excluded; above l1.
        l2: i32,
        /// d, fixed; `None` = fitted.
        d: Option<f64>,
    },
}

/// How a parameter is stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scale {
    Linear,
    /// ln p.
    Log,
    /// ln(1 + p).
    LogOnePlus,
}

impl Scale {
    pub(super) fn inner(self, p: f64) -> f64 {
        match self {
            Scale::Linear => p,
            Scale::Log => p.max(1e-300).ln(),
            Scale::LogOnePlus => p.ln_1p(),
        }
    }

    pub(super) fn outer(self, u: f64) -> f64 {
        match self {
            Scale::Linear => u,
            Scale::Log => u.exp(),
            Scale::LogOnePlus => u.exp_m1(),
        }
    }

    /// dp/du.
    pub(super) fn slope(self, u: f64) -> f64 {
        if self == Scale::Linear { 1.0 } else { u.exp() }
    }
}

/// A parameter to fit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Free {
    pub name: String,
    pub low: f64,
    pub high: f64,
    pub scale: Scale,
}

fn free(name: impl Into<String>, low: f64, high: f64, scale: Scale) -> Free {
    Free { name: name.into(), low, high, scale }
}

impl FitLaw {
    /// The kind in a configuration.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            FitLaw::Lambert => "lambert",
            FitLaw::Phong => "phong",
            FitLaw::Abg => "abg",
            FitLaw::Gaussian => "gaussian",
            FitLaw::Binomial { .. } => "binomial",
        }
    }

    /// Refuses a binomial shape that cannot be fitted.
    ///
    /// # Errors
    /// [`crate::Error::Model`] naming what is wrong.
    pub fn check(&self) -> Result<()> {
        if let FitLaw::Binomial { rows, terms, l1, l2, d } = *self {
            let columns = i64::from(l2) - i64::from(l1);
            if rows == 0 || terms == 0 || columns < 0 {
                return Err(impossible(format!(
                    "binomial: rows = {rows}, terms = {terms}, l1 = {l1}, l2 = {l2}; accepted are rows and terms from \
                     1 and l2 from l1"
                )));
            }
            let count = (rows as u128) * (terms as u128 + columns as u128);
            if count > TERMS_MAX as u128 || l1.abs() > 100 {
                return Err(impossible(format!(
                    "binomial: {count} coefficients from l1 = {l1}; accepted are up to {TERMS_MAX}, |l1| up to 100"
                )));
            }
            if d.is_some_and(|d| !(d > 0.0 && d <= 100.0)) {
                return Err(impossible("binomial: d; accepted is above 0 up to 100".into()));
            }
        }
        Ok(())
    }

    /// The parameters, in the order of their vector.
    pub(super) fn parameters(&self) -> Vec<Free> {
        match *self {
            FitLaw::Lambert => vec![free("albedo", 0.0, 1.0, Scale::Linear)],
            FitLaw::Phong => vec![
                free("kd", 0.0, 1.0, Scale::Linear),
                free("ks", 0.0, 1.0, Scale::Linear),
                free("n", 0.0, PHONG_N_MAX, Scale::LogOnePlus),
            ],
            FitLaw::Abg => vec![
                free("a", 1e-12, 1e6, Scale::Log),
                free("b", 1e-15, 1e6, Scale::Log),
                free("g", 0.0, 20.0, Scale::Linear),
            ],
            FitLaw::Gaussian => vec![free("peak_per_sr", 1e-9, 1e9, Scale::Log), free("sigma", 1e-9, 1e3, Scale::Log)],
            FitLaw::Binomial { rows, terms, l1, l2, d } => {
                let grid = |name: &'static str, columns: usize| {
                    (0..rows).flat_map(move |k| {
                        (0..columns).map(move |i| {
                            free(format!("{name}[{k}][{i}]"), -COEFFICIENT_MAX, COEFFICIENT_MAX, Scale::Linear)
                        })
                    })
                };
                let mut all: Vec<Free> = grid("b", terms).chain(grid("c", (l2 - l1).max(0) as usize)).collect();
                if d.is_none() {
                    all.push(free("d", 1.05, 20.0, Scale::Log));
                }
                all
            }
        }
    }

    /// The law with these parameters.
    pub(super) fn with(&self, p: &[f64]) -> Brdf {
        match *self {
            FitLaw::Lambert => Brdf::Lambert { albedo: p[0] },
            FitLaw::Phong => Brdf::Phong { kd: p[0], ks: p[1], n: p[2] },
            FitLaw::Abg => Brdf::Abg { a: p[0], b: p[1], g: p[2] },
            FitLaw::Gaussian => Brdf::Gaussian { peak_per_sr: p[0], sigma: p[1] },
            FitLaw::Binomial { rows, terms, l1, l2, d } => {
                let columns = (l2 - l1).max(0) as usize;
                let (b, c) = p.split_at(rows * terms);
                let c = &c[..rows * columns];
                Brdf::Binomial(Arc::new(Binomial {
                    b: b.chunks(terms).map(<[f64]>::to_vec).collect(),
                    c: if columns == 0 { Vec::new() } else { c.chunks(columns).map(<[f64]>::to_vec).collect() },
                    d: d.unwrap_or_else(|| p[p.len() - 1]),
                    l1,
                }))
            }
        }
    }

    /// Where to start, from the data: several places, always the same ones.
    pub(super) fn starts(&self, data: &[(Geometry, f64)]) -> Vec<Vec<f64>> {
        let mut values: Vec<f64> = data.iter().map(|(_, f)| *f).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((share * (values.len().max(1) - 1) as f64) as usize).copied().unwrap_or(1.0);
        let (low, middle, top) = (at(0.1).max(1e-9), at(0.5).max(1e-9), at(1.0).max(1e-9));
        let pi = std::f64::consts::PI;
        match *self {
            FitLaw::Lambert => vec![vec![(pi * middle).min(0.9)]],
            FitLaw::Phong => [0.3, 3.0, 30.0, 300.0, 3e3, 3e4]
                .into_iter()
                .map(|n| {
                    let ks = (top - low).max(0.1 * top) * 2.0 * pi / (n + 2.0);
                    vec![(pi * low).min(0.6), ks.clamp(1e-4, 0.6), n]
                })
                .collect(),
            FitLaw::Abg => [(1e-3_f64, 2.0_f64), (1e-2, 2.0), (1e-1, 2.0), (1.0, 2.0), (1e-2, 3.0), (1e-1, 1.2)]
                .into_iter()
                .map(|(width, g)| vec![top * width.powf(g), width.powf(g), g])
                .collect(),
            FitLaw::Gaussian => [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0].into_iter().map(|s| vec![top, s]).collect(),
            FitLaw::Binomial { d, .. } => {
                let count = self.parameters().len();
                let flat = |d_start: Option<f64>| {
                    let mut p = vec![0.0; count];
                    p[0] = middle.log10();
                    if let Some(d) = d_start {
                        p[count - 1] = d;
                    }
                    p
                };
                if d.is_some() {
                    vec![flat(None)]
                } else {
                    [1.5, 3.0, 8.0].into_iter().map(|d| flat(Some(d))).collect()
                }
            }
        }
    }
}
