//! Surfaces fitted to magnitudes: V = −2.5 lg Σ a_s F_s(p), F_s the light of surface s, a_s its strength, p numbers of laws and angles.
//!
//! Flux relative to a star of magnitude 0. Strengths enter exactly, the light of a surface is evaluated again where a number of its law or
//! its attitude changes, with central differences. It does not cover surfaces that hide one another.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use super::mixed::{Fit, MixedFit, fit};
use super::observations::Observation;
use super::parameters::{Free, shape_at};
use super::problem::{Problem, left_out, of_offsets, offsets, refused, rows_of};
use crate::base::constants::MAG_PER_LN;
use crate::base::error::{Error, Result};
use crate::config::Surface;

/// Errors beyond which the data do not tell a parameter: a factor of e, and 45 degrees, in the units of the fit.
const LARGEST_LN_ERR: f64 = 1.0;
const LARGEST_ANGLE_ERR: f64 = 4.5;
/// To either side of the stated attitude a fit begins again: 20 degrees, in the units of the fit.
const START_ANGLE: f64 = 2.0;

/// What the surface of this number sends in each observation if it is such, its area as stated.
pub type FluxOf<'a> = dyn Fn(usize, &Surface) -> Result<Vec<f64>> + 'a;

type Light = Rc<Vec<f64>>;
type Row = Option<(f64, Vec<f64>)>;

/// The light of surfaces as they were evaluated last.
struct Lights<'a> {
    surfaces: &'a [Surface],
    free: &'a [Free],
    flux_of: &'a FluxOf<'a>,
    observations: &'a [Observation],
    tables: &'a [String],
    known: RefCell<HashMap<String, Light>>,
    /// Parameters and the rows at them.
    last: RefCell<(Vec<f64>, Vec<Row>)>,
    /// Why an evaluation failed.
    problem: RefCell<Option<Error>>,
}

impl Lights<'_> {
    /// The light of a surface, as it is known or anew; `used` are those of this evaluation.
    fn of(&self, surface: usize, theta: &[f64], used: &mut HashMap<String, Light>) -> Result<Light> {
        let shape = shape_at(surface, self.surfaces, self.free, theta).map_err(|problem| Error::Model { problem })?;
        let key = format!("{surface} {shape:?}");
        let known = used.get(&key).or(self.known.borrow().get(&key)).cloned();
        let light = match known {
            Some(light) => light,
            None => Rc::new((self.flux_of)(surface, &shape)?),
        };
        used.insert(key, Rc::clone(&light));
        Ok(light)
    }

    /// Magnitude and derivatives of every row.
    fn rows(&self, theta: &[f64]) -> Result<Vec<Row>> {
        let mut used = HashMap::new();
        let scale = |s: usize| -> f64 {
            let of = self.free.iter().zip(theta).filter(|(free, _)| free.is_scale() && free.is_of(s));
            of.map(|(_, t)| t.exp()).product()
        };
        let scales: Vec<f64> = (0..self.surfaces.len()).map(scale).collect();
        let all = |theta: &[f64], used: &mut HashMap<String, Light>| -> Result<Vec<Light>> {
            (0..self.surfaces.len()).map(|s| self.of(s, theta, used)).collect()
        };
        let here = all(theta, &mut used)?;
        let mut beside = Vec::new();
        for (k, free) in self.free.iter().enumerate().filter(|(_, free)| !free.is_scale()) {
            let at = |sign: f64| {
                let mut moved = theta.to_vec();
                moved[k] += sign * free.step();
                moved
            };
            beside.push((k, all(&at(1.0), &mut used)?, all(&at(-1.0), &mut used)?));
        }
        let sum = |lights: &[Light], i: usize| lights.iter().zip(&scales).map(|(light, a)| a * light[i]).sum::<f64>();
        let row = |i: usize| {
            let total = sum(&here, i);
            if total <= 0.0 {
                return None;
            }
            let sent = |s: usize| scales[s] * here[s][i];
            let mut gradient: Vec<f64> = self
                .free
                .iter()
                .map(|free| match free.is_scale() {
                    true => (0..self.surfaces.len()).filter(|s| free.is_of(*s)).map(sent).sum::<f64>(),
                    false => 0.0,
                })
                .collect();
            for (k, after, before) in &beside {
                gradient[*k] = (sum(after, i) - sum(before, i)) / (2.0 * self.free[*k].step());
            }
            gradient.iter_mut().for_each(|g| *g *= -MAG_PER_LN / total);
            let of_tables: Vec<f64> = of_offsets(&self.observations[i], self.tables).collect();
            let offset: f64 = of_tables.iter().zip(&theta[self.free.len()..]).map(|(is, offset)| is * offset).sum();
            gradient.extend(of_tables);
            Some((offset - 2.5 * total.log10(), gradient))
        };
        let rows = (0..self.observations.len()).map(row).collect();
        *self.known.borrow_mut() = used;
        Ok(rows)
    }

    fn row(&self, theta: &[f64], i: usize) -> Row {
        if self.last.borrow().0 != theta || self.last.borrow().1.is_empty() {
            match self.rows(theta) {
                Ok(rows) => *self.last.borrow_mut() = (theta.to_vec(), rows),
                Err(error) => {
                    *self.problem.borrow_mut() = Some(error);
                    return None;
                }
            }
        }
        self.last.borrow().1[i].clone()
    }
}

/// Where a fit begins: as stated, and with each free angle to either side.
fn starts(stated: &[f64], free: &[Free]) -> Vec<Vec<f64>> {
    let mut starts = vec![stated.to_vec()];
    for k in (0..free.len()).filter(|k| free[*k].is_angle()) {
        for side in [-START_ANGLE, START_ANGLE] {
            let mut start = stated.to_vec();
            start[k] += side;
            starts.push(start);
        }
    }
    starts
}

/// Fits the free parameters of surfaces, and an offset of each of `tables` but the first.
///
/// # Errors
/// [`Error::Model`]: too few rows, parameters that the data do not tell (named), values that make no law, or no convergence; those of
/// `flux_of`.
pub fn fit_surfaces(
    observations: &[Observation],
    surfaces: &[Surface],
    free: &[Free],
    flux_of: &FluxOf,
    tables: &[String],
) -> Result<Problem> {
    let names: Vec<String> = free.iter().map(|f| f.name.clone()).chain(offsets(tables)).collect();
    if let Some(k) = (1..free.len()).find(|k| names[..*k].contains(&names[*k])) {
        return Err(refused(format!("{} is free twice", names[k])));
    }
    let rows = rows_of(observations, |o| o.v_mag);
    let lights = Lights {
        surfaces,
        free,
        flux_of,
        observations,
        tables,
        known: RefCell::default(),
        last: RefCell::default(),
        problem: RefCell::default(),
    };
    let mut start: Vec<f64> = free.iter().map(|f| f.start).collect();
    start.resize(names.len(), 0.0);
    let model = |theta: &[f64], i: usize| lights.row(theta, i);
    // a lobe may be found on the wrong side: angles begin at 0 and on either side, and the fit of the smallest scatter stands
    let mut best: Option<Fit> = None;
    let mut first_error = None;
    for start in starts(&start, free) {
        let fitted = fit(&MixedFit { rows: &rows, names: &names, start, model });
        match (fitted, lights.problem.take()) {
            (Ok(fit), _) if best.as_ref().is_none_or(|best| fit.scatter_mag() < best.scatter_mag()) => best = Some(fit),
            (Ok(_), _) => {}
            (Err(why), error) => {
                first_error.get_or_insert(error.unwrap_or_else(|| refused(why)));
            }
        }
    }
    let mut fit = match (best, first_error) {
        (Some(fit), _) => fit,
        (None, error) => return Err(error.unwrap_or_else(|| refused("nothing is free".into()))),
    };
    let residuals_mag =
        (0..rows.len()).map(|i| rows[i].mag - model(&fit.theta, i).map_or(f64::NAN, |(mu, _)| mu)).collect();
    let problem = MixedFit { rows: &rows, names: &names, start: fit.theta.clone(), model };
    let left_out_mag = left_out(observations, &problem, &fit.theta);
    for (k, free) in free.iter().enumerate() {
        let (err, unit) = (fit.errs()[k], free.unit());
        if !free.is_angle() && err > LARGEST_LN_ERR {
            let why = format!("its error is {err:.1}, and 1 is a factor of e; hold it");
            return Err(refused(format!("the data do not tell {}: {why}", free.name)));
        }
        if free.is_angle() && err > LARGEST_ANGLE_ERR {
            return Err(refused(format!(
                "the data do not tell {}: its error is {:.0} deg; hold it",
                free.name,
                err * unit
            )));
        }
    }
    let unit = |k: usize| free.get(k).map_or(1.0, Free::unit);
    fit.theta.iter_mut().enumerate().for_each(|(k, t)| *t *= unit(k));
    for (a, row) in fit.cov.iter_mut().enumerate() {
        row.iter_mut().enumerate().for_each(|(b, c)| *c *= unit(a) * unit(b));
    }
    Ok(Problem { names, fit, residuals_mag, left_out_mag })
}
