//! Fits a scattering law to a table of measurements: parameters, their errors, and how well the law does.
//!
//! In lg f by default, so that a peak and its wings weigh alike; residuals then are dex. Errors come from the scatter
//! about the fit: tables carry none of their own.

mod laws;
mod levenberg;
mod table;

pub use laws::FitLaw;
pub use table::{MeasuredTable, Measurement};

use nalgebra::{DMatrix, DVector};

use self::laws::Free;
use self::levenberg::{Problem, RANK_TOLERANCE, column_norms, scaled};
use self::table::Geometry;
use super::law::Brdf;
use crate::base::error::Result;
use crate::brightness::scene::impossible;

/// f below this counts as this in lg f \[1/sr\].
const FLOOR_PER_SR: f64 = 1e-12;

/// How to fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// Fit lg f (default) or f.
    pub log_space: bool,
    /// Rows with f at or below this are excluded \[1/sr\].
    pub clip_per_sr: f64,
    /// Error of a measurement, 1σ: dex, or 1/sr in linear space. `None` = the scatter about the fit.
    pub sigma: Option<f64>,
    /// Start values by name, instead of those from the data.
    pub starts: Vec<(String, f64)>,
    /// Bounds by name, instead of the law's own.
    pub bounds: Vec<(String, f64, f64)>,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { log_space: true, clip_per_sr: 0.0, sigma: None, starts: Vec::new(), bounds: Vec::new() }
    }
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, as in a configuration.
    pub name: String,
    /// Value.
    pub value: f64,
    /// 1σ; `None` where the data do not determine it, or it sits on a bound.
    pub err: Option<f64>,
    /// The bound it sits on.
    pub at_bound: Option<f64>,
}

/// A fitted law.
#[derive(Debug, Clone, PartialEq)]
pub struct BrdfFit {
    /// What was fitted.
    pub law: FitLaw,
    /// The law.
    pub brdf: Brdf,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Correlation of parameters k and l; `None` where either has no error.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Rows fitted.
    pub used: usize,
    /// Rows at or below the clip.
    pub clipped: usize,
    /// Rows with light or observer not above the surface.
    pub below_surface: usize,
    /// Root mean square of lg(model/measured) over the fitted rows with a positive f \[dex\].
    pub rms_dex: f64,
    /// Sum of squared residuals over σ²; σ = 1 where none is given.
    pub chi2: f64,
    /// Akaike's criterion, N ln(SSR/N) + 2(p + 1): of two laws fitted alike to the same rows the lower one is better.
    /// Infinite for as many parameters as rows, which proves nothing.
    pub aic: f64,
    /// Whether it settled.
    pub converged: bool,
    /// What to know before using it.
    pub warnings: Vec<String>,
}

/// Fits a law to a table.
///
/// Multi-start Levenberg-Marquardt, the starts fixed: the same table gives the same numbers.
///
/// # Errors
/// [`crate::Error::Model`] for a shape, start or bound that makes no sense, or when fewer rows than parameters are
/// left.
pub fn fit_brdf(table: &MeasuredTable, law: &FitLaw, options: &FitOptions) -> Result<BrdfFit> {
    law.check()?;
    let parameters = parameters(law, options)?;
    let mut below_surface = 0;
    let mut clipped = 0;
    let mut data: Vec<(Geometry, f64)> = Vec::new();
    let clip = if options.log_space { options.clip_per_sr.max(0.0) } else { options.clip_per_sr };
    for row in &table.rows {
        match row.geometry() {
            None => below_surface += 1,
            Some(_) if row.brdf_per_sr <= clip => clipped += 1,
            Some(geometry) => data.push((geometry, row.brdf_per_sr)),
        }
    }
    if data.len() < parameters.len() {
        return Err(impossible(format!(
            "{}: {} rows left for the {} parameters of {} ({clipped} at or below the clip {clip}, {below_surface} below \
             the surface)",
            table.path.display(),
            data.len(),
            parameters.len(),
            law.kind()
        )));
    }
    let scales: Vec<_> = parameters.iter().map(|p| p.scale).collect();
    let outer = |u: &[f64]| -> Vec<f64> { u.iter().zip(&scales).map(|(u, scale)| scale.outer(*u)).collect() };
    let residuals = |u: &[f64]| residuals(&law.with(&outer(u)), &data, options.log_space);
    let low: Vec<f64> = parameters.iter().map(|p| p.scale.inner(p.low)).collect();
    let high: Vec<f64> = parameters.iter().map(|p| p.scale.inner(p.high)).collect();
    let problem = Problem { residuals: &residuals, low: &low, high: &high };
    let mut best: Option<levenberg::Minimum> = None;
    for mut start in law.starts(&data) {
        for (value, parameter) in start.iter_mut().zip(&parameters) {
            let given = options.starts.iter().find(|(name, _)| *name == parameter.name);
            *value = given.map_or(*value, |(_, v)| *v).clamp(parameter.low, parameter.high);
        }
        let inner: Vec<f64> = start.iter().zip(&scales).map(|(p, scale)| scale.inner(*p)).collect();
        let found = problem.minimum(&inner);
        if best.as_ref().is_none_or(|b| found.squares < b.squares * (1.0 - 1e-9)) {
            best = Some(found);
        }
    }
    let Some(minimum) = best else { return Err(impossible(format!("{}: nothing to start from", law.kind()))) };
    let mut fit = BrdfFit {
        brdf: law.with(&outer(&minimum.u)),
        law: law.clone(),
        parameters: Vec::new(),
        correlation: Vec::new(),
        used: data.len(),
        clipped,
        below_surface,
        rms_dex: 0.0,
        chi2: minimum.squares / options.sigma.map_or(1.0, |s| s * s),
        aic: if data.len() <= parameters.len() {
            f64::INFINITY
        } else {
            let n = data.len() as f64;
            n * (minimum.squares / n).max(f64::MIN_POSITIVE).ln() + 2.0 * (parameters.len() + 1) as f64
        },
        converged: minimum.converged,
        warnings: Vec::new(),
    };
    fit.rms_dex = rms_dex(&fit.brdf, &data);
    fit.add_errors(&parameters, &problem, &minimum, options.sigma);
    fit.warn(&data, options.log_space);
    Ok(fit)
}

/// The law's parameters with the bounds requested; refuses names the law does not have.
fn parameters(law: &FitLaw, options: &FitOptions) -> Result<Vec<Free>> {
    let mut parameters = law.parameters();
    let known = |name: &str, all: &[Free]| {
        if all.iter().any(|p| p.name == name) {
            return Ok(());
        }
        let names: Vec<&str> = all.iter().map(|p| p.name.as_str()).collect();
        Err(impossible(format!("{} has no parameter \"{name}\"; it has {}", law.kind(), names.join(", "))))
    };
    for (name, value) in &options.starts {
        known(name, &parameters)?;
        if !value.is_finite() {
            return Err(impossible(format!("start of {name} = {value}; accepted is a number")));
        }
    }
    for (name, low, high) in &options.bounds {
        known(name, &parameters)?;
        for p in parameters.iter_mut().filter(|p| p.name == *name) {
            if !(low <= high && *low >= p.low && *high <= p.high) {
                return Err(impossible(format!(
                    "bounds of {name} = {low} to {high}; accepted lie within {} to {}",
                    p.low, p.high
                )));
            }
            (p.low, p.high) = (*low, *high);
        }
    }
    Ok(parameters)
}

fn lg(f: f64) -> f64 {
    f.max(FLOOR_PER_SR).log10()
}

/// Model minus measured, in dex or 1/sr.
fn residuals(brdf: &Brdf, data: &[(Geometry, f64)], log_space: bool) -> DVector<f64> {
    DVector::from_iterator(
        data.len(),
        data.iter().map(|(geometry, measured)| {
            let model = geometry.value(brdf);
            if log_space { lg(model) - lg(*measured) } else { model - measured }
        }),
    )
}

fn rms_dex(brdf: &Brdf, data: &[(Geometry, f64)]) -> f64 {
    let squares: Vec<f64> =
        data.iter().filter(|(_, f)| *f > 0.0).map(|(g, f)| (lg(g.value(brdf)) - lg(*f)).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

impl BrdfFit {
    /// Errors and correlations from the Jacobian: cov = s² (JᵀJ)⁻¹ of the parameters that are free and determined.
    fn add_errors(&mut self, all: &[Free], problem: &Problem, minimum: &levenberg::Minimum, sigma: Option<f64>) {
        let bound = |k: usize| {
            let (u, room) = (minimum.u[k], 1e-9 * (problem.high[k] - problem.low[k]).abs().min(1.0));
            let at = |edge: f64, value: f64| ((u - edge).abs() <= room).then_some(value);
            at(problem.low[k], all[k].low).or(at(problem.high[k], all[k].high))
        };
        let bounds: Vec<Option<f64>> = (0..all.len()).map(bound).collect();
        let inside: Vec<usize> = (0..all.len()).filter(|k| bounds[*k].is_none()).collect();
        let jacobian = problem.jacobian(&minimum.u, &inside, self.used);
        let freedom = self.used as f64 - inside.len() as f64;
        let variance = match sigma {
            Some(sigma) => Some(sigma * sigma),
            None => (freedom > 0.0).then(|| minimum.squares / freedom),
        };
        let covariance = covariance(&jacobian);
        let mut err = vec![None; all.len()];
        for (j, k) in inside.iter().enumerate() {
            let slope = all[*k].scale.slope(minimum.u[*k]);
            let own = covariance.as_ref().and_then(|c| c[(j, j)].is_finite().then_some(c[(j, j)]));
            err[*k] = own.zip(variance).map(|(own, variance)| (own * variance).max(0.0).sqrt() * slope);
        }
        let place = |k: usize| inside.iter().position(|i| *i == k).filter(|_| err[k].is_some());
        let correlation = |k: usize, l: usize| {
            let (c, i, j) = (covariance.as_ref()?, place(k)?, place(l)?);
            Some(c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()).filter(|r| r.is_finite())
        };
        self.correlation = (0..all.len()).map(|k| (0..all.len()).map(|l| correlation(k, l)).collect()).collect();
        self.parameters = all
            .iter()
            .enumerate()
            .map(|(k, p)| Parameter {
                name: p.name.clone(),
                value: p.scale.outer(minimum.u[k]),
                err: err[k],
                at_bound: bounds[k],
            })
            .collect();
        let undetermined: Vec<&str> =
            inside.iter().filter(|k| err[**k].is_none()).map(|k| all[*k].name.as_str()).collect();
        if !undetermined.is_empty() {
            let why = if variance.is_none() { "as many parameters as rows" } else { "the problem is rank deficient" };
            self.warnings.push(format!("no error for {}: {why}", undetermined.join(", ")));
        }
    }

    fn warn(&mut self, data: &[(Geometry, f64)], log_space: bool) {
        for p in &self.parameters {
            if let Some(bound) = p.at_bound {
                self.warnings.push(format!("{} sits on its bound {bound}: no error", p.name));
            }
        }
        let floored = data.iter().filter(|(g, _)| !(g.value(&self.brdf) >= FLOOR_PER_SR)).count();
        if log_space && floored > 0 {
            self.warnings.push(format!("{floored} rows where the law is 0; counted as {FLOOR_PER_SR:e} 1/sr"));
        }
        if !self.converged {
            self.warnings.push("did not settle; give start values or fewer parameters".into());
        }
        let (largest, incidence_rad) = self.brdf.largest_reflectance();
        if self.brdf.creates_light() {
            self.warnings.push(format!(
                "creates light: returns {largest:.3} of what falls in at {:.0} deg; a satellite with this law is refused",
                incidence_rad.to_degrees()
            ));
        }
    }

    /// The law as a line of a configuration: `brdf = { kind = "phong", kd = 0.53, ks = 0.28, n = 7.31 }`.
    #[must_use]
    pub fn toml(&self) -> String {
        let number = |x: f64| format!("{x:?}");
        let grid = |rows: &[Vec<f64>]| {
            let rows: Vec<String> = rows
                .iter()
                .map(|row| format!("[{}]", row.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", ")))
                .collect();
            format!("[{}]", rows.join(", "))
        };
        let rest = match &self.brdf {
            Brdf::Binomial(law) => {
                format!("b = {}, c = {}, d = {}, l1 = {}", grid(&law.b), grid(&law.c), number(law.d), law.l1)
            }
            _ => {
                let pairs: Vec<String> =
                    self.parameters.iter().map(|p| format!("{} = {}", p.name, number(p.value))).collect();
                pairs.join(", ")
            }
        };
        format!("brdf = {{ kind = \"{}\", {rest} }}", self.law.kind())
    }
}

/// (JᵀJ)⁻¹; infinite for a parameter that has a share in a direction the data do not determine.
fn covariance(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let damaged = jacobian.iter().any(|x| !x.is_finite());
    if damaged || jacobian.ncols() == 0 || jacobian.nrows() < jacobian.ncols() {
        return None;
    }
    let norms: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    let scale = column_norms(jacobian);
    let svd = scaled(jacobian, &scale).qr().r().svd(false, true);
    let right = svd.v_t?;
    let least = RANK_TOLERANCE * svd.singular_values.max();
    Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        let mut sum = 0.0;
        for (k, s) in svd.singular_values.iter().enumerate() {
            let share = right[(k, i)] * right[(k, j)];
            if *s > least {
                sum += share / (s * s);
            } else if right[(k, i)].abs() > 1e-3 || right[(k, j)].abs() > 1e-3 {
                return f64::INFINITY;
            }
        }
        if norms[i] == 0.0 || norms[j] == 0.0 { f64::INFINITY } else { sum / (scale[i] * scale[j]) }
    }))
}
