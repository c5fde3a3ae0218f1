//! What goes into the fit: usable measurements in a fixed order, the terms that are fitted, held or refused.
//!
//! Magnitudes. y = V_inst − V against columns (1, X − X̄, (B−V) − mean). A held term is subtracted from y; a term pulled to a
//! value by an error adds one row; a term the stars cannot tell is refused by name.

use super::StarMeasurement;
use super::solve::Triangle;
use crate::config::{self, Estimator, Pin};
use crate::error::{Error, Result};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Narrowest span of airmass from which extinction is fitted.
const MIN_AIRMASS_SPAN: f64 = 0.05;
/// Narrowest span of B−V from which a colour term is fitted \[mag\].
const MIN_COLOUR_SPAN_MAG: f64 = 0.05;
/// Condition number above which a term is refused: airmass and colour are the same line.
const CONDITION_REFUSED: f64 = 1e6;
/// Kasten & Young give 0.9997 at the zenith; anything lower is no airmass.
const MIN_AIRMASS: f64 = 0.99;

/// What is done with k or C.
#[derive(Debug, Clone, PartialEq)]
pub enum Term {
    /// Fitted freely.
    Free,
    /// Fitted, pulled to a value by its error.
    Prior(f64, f64),
    /// Held.
    Fixed(f64),
    /// Not fitted, taken as 0, and why.
    Refused(String),
}

impl Term {
    /// From the configuration.
    pub fn of(pin: Option<Pin>) -> Term {
        match pin {
            None => Term::Free,
            Some(p) if p.err > 0.0 => Term::Prior(p.value, p.err),
            Some(p) => Term::Fixed(p.value),
        }
    }

    /// The value, if it is not fitted.
    pub fn held(&self) -> Option<f64> {
        match self {
            Term::Free | Term::Prior(..) => None,
            Term::Fixed(v) => Some(*v),
            Term::Refused(_) => Some(0.0),
        }
    }

    /// For the report.
    pub fn note(&self) -> String {
        match self {
            Term::Free => "fitted".to_owned(),
            Term::Prior(v, e) => format!("pinned {v} +- {e} (prior)"),
            Term::Fixed(v) => format!("pinned {v}"),
            Term::Refused(why) => format!("refused: {why}"),
        }
    }
}

/// The usable measurements, sorted so that the order of the input does not matter.
#[derive(Debug, Clone)]
pub struct Rows {
    stars: Vec<(usize, StarMeasurement)>,
    /// Terms of k and C.
    pub terms: [Term; 2],
    /// Mean airmass and mean colour, subtracted from the columns.
    pub mean: [f64; 2],
    /// Median of V_inst − V, subtracted from y so that sums stay small.
    offset: f64,
    /// σ_inst² + σ_cat² of each row \[mag²\], unknown parts filled by the median of the known; 0 if nothing is known.
    var: Vec<f64>,
    /// σ_BV² of each row \[mag²\].
    var_colour: Vec<f64>,
    /// Whether errors are known and wanted.
    pub weighted: bool,
    /// For the report.
    pub warnings: Vec<String>,
}

impl Rows {
    /// Keeps the finite rows, in a total order, with errors filled in.
    ///
    /// # Errors
    /// [`Error::Zeropoint`] if fewer than the configured number are left.
    pub fn select(all: &[StarMeasurement], terms: [Term; 2], config: &config::Zeropoint) -> Result<Rows> {
        let colourless = terms[1] == Term::Fixed(0.0);
        let usable = |s: &StarMeasurement| {
            let finite = [s.inst_mag, s.v_mag, s.airmass].iter().all(|v| v.is_finite());
            finite && (s.b_v_mag.is_finite() || colourless) && s.airmass >= MIN_AIRMASS
        };
        let mut stars: Vec<(usize, StarMeasurement)> =
            all.iter().copied().enumerate().filter(|(_, s)| usable(s)).collect();
        stars.sort_by(|(_, a), (_, b)| {
            let key = |s: &StarMeasurement| {
                [s.airmass, s.b_v_mag, s.v_mag, s.inst_mag, s.inst_err_mag, s.v_err_mag, s.b_v_err_mag]
            };
            let order = key(a).iter().zip(key(b)).map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne());
            order.unwrap_or_else(|| a.pointing.cmp(&b.pointing))
        });
        let mut rows = Rows {
            stars,
            terms,
            mean: [0.0; 2],
            offset: 0.0,
            var: Vec::new(),
            var_colour: Vec::new(),
            weighted: false,
            warnings: Vec::new(),
        };
        let lost = all.len() - rows.len();
        if lost > 0 {
            let what = "NaN or infinite magnitude, colour or airmass, or airmass below 0.99";
            rows.warnings.push(format!("{lost} of {} measurements left out: {what}", all.len()));
        }
        rows.enough(rows.len(), config.min_stars, &format!("{lost} of {} unusable (NaN)", all.len()))?;
        rows.mean = [rows.mean_of(|s| s.airmass), rows.mean_of(|s| s.b_v_mag)];
        rows.offset = super::median(&mut rows.stars.iter().map(|(_, s)| s.inst_mag - s.v_mag).collect::<Vec<_>>());
        rows.errors(config);
        Ok(rows)
    }

    /// Number of usable rows.
    pub fn len(&self) -> usize {
        self.stars.len()
    }

    /// Row `i` in the fit's own order.
    pub fn star(&self, i: usize) -> &StarMeasurement {
        &self.stars[i].1
    }

    /// Index of row `i` in the caller's order.
    pub fn input(&self, i: usize) -> usize {
        self.stars[i].0
    }

    /// Free parameters: ZP and the terms that are fitted.
    pub fn n_free(&self) -> usize {
        1 + self.terms.iter().filter(|t| matches!(t, Term::Free)).count()
    }

    /// Fails if `n` stars cannot carry the fit.
    pub fn enough(&self, n: usize, min_stars: usize, lost: &str) -> Result<()> {
        let need = min_stars.max(self.n_free()).max(2);
        if n >= need {
            return Ok(());
        }
        Err(Error::Zeropoint {
            problem: format!(
                "{n} usable stars ({lost}), {need} needed for {} free terms and zeropoint.min_stars = {min_stars}; \
                 take more star pointings, widen the cuts of [stars], or pin k and C",
                self.n_free()
            ),
        })
    }

    /// The columns of row `i`; 0 for a term that is not fitted.
    pub fn columns(&self, i: usize) -> [f64; 3] {
        let s = self.star(i);
        let column = |t: usize, v: f64| if self.terms[t].held().is_some() { 0.0 } else { v - self.mean[t] };
        [1.0, column(0, s.airmass), column(1, s.b_v_mag)]
    }

    /// y of row `i` about the median, held terms subtracted \[mag\].
    pub fn y(&self, i: usize) -> f64 {
        let s = self.star(i);
        let held = |t: usize, v: f64| match self.terms[t].held() {
            Some(h) if h != 0.0 => h * (v - self.mean[t]),
            _ => 0.0,
        };
        s.inst_mag - s.v_mag - self.offset - held(0, s.airmass) - held(1, s.b_v_mag)
    }

    /// y − θ·columns \[mag\].
    pub fn residual(&self, i: usize, theta: &[f64; 3]) -> f64 {
        let a = self.columns(i);
        self.y(i) - a[0] * theta[0] - a[1] * theta[1] - a[2] * theta[2]
    }

    /// Stated variance of row `i` at the colour term of `theta`: σ_inst² + σ_cat² + (C σ_BV)² \[mag²\].
    pub fn stated_var(&self, i: usize, theta: &[f64; 3]) -> f64 {
        let c = self.terms[1].held().unwrap_or(theta[2]);
        self.var[i] + c * c * self.var_colour[i]
    }

    /// Adds the rows of pulled terms to a fit of rows whitened by their true standard deviation.
    pub fn add_priors(&self, triangle: &mut Triangle) {
        for (t, term) in self.terms.iter().enumerate() {
            if let Term::Prior(value, err) = term {
                let mut a = [0.0; 3];
                a[t + 1] = 1.0 / err;
                triangle.add(a, value / err);
            }
        }
    }

    /// Whether any term is pulled.
    pub fn has_prior(&self) -> bool {
        self.terms.iter().any(|t| matches!(t, Term::Prior(..)))
    }

    /// Refuses k or C where the stars span too little, or where airmass and colour go together.
    pub fn refuse_what_cannot_be_told_apart(&mut self) -> Result<()> {
        let spans = [self.span(|s| s.airmass), self.span(|s| s.b_v_mag)];
        if self.terms[0] == Term::Free && spans[0] < MIN_AIRMASS_SPAN {
            self.refuse(0, format!("all stars within {:.2} airmass", spans[0].max(0.0)));
        }
        if self.terms[1] == Term::Free && spans[1] < MIN_COLOUR_SPAN_MAG {
            self.refuse(1, format!("all stars within {:.2} mag of B-V", spans[1].max(0.0)));
        }
        if self.terms == [Term::Free, Term::Free] {
            let condition = self.condition(&vec![1.0; self.len()]);
            if condition > CONDITION_REFUSED {
                self.refuse(1, "colour and airmass are collinear".to_owned());
            }
        }
        self.enough(self.len(), 0, "all of them")
    }

    fn refuse(&mut self, term: usize, why: String) {
        let (name, mean, key) = if term == 0 {
            ("k", format!("airmass {:.3}", self.mean[0]), "zeropoint.pin_k")
        } else {
            ("C", format!("B-V {:.3}", self.mean[1]), "zeropoint.pin_c")
        };
        self.warnings.push(format!(
            "{name} refused: {why}; taken as 0, so the zeropoint holds near {mean} only and its error does not cover \
             other values; pin it with {key}"
        ));
        self.terms[term] = Term::Refused(why);
    }

    /// Condition number of the fitted columns under weights.
    pub fn condition(&self, weights: &[f64]) -> f64 {
        let total: f64 = weights.iter().sum();
        let mean = [1, 2].map(|c| (0..self.len()).map(|i| weights[i] * self.columns(i)[c]).sum::<f64>() / total);
        let mut triangle = Triangle::default();
        for (i, w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let a = self.columns(i);
            let centred = |t: usize| if self.terms[t].held().is_some() { 0.0 } else { a[t + 1] - mean[t] };
            let sqrt = w.sqrt();
            triangle.add([sqrt, sqrt * centred(0), sqrt * centred(1)], 0.0);
        }
        triangle.solve().condition
    }

    /// ZP and the covariance of (ZP, k, C) from the centred fit: ZP = a − k X̄ − C mean(B−V).
    pub fn uncentred(&self, theta: &[f64; 3], cov: &[[f64; 3]; 3]) -> (f64, [[f64; 3]; 3]) {
        let k = self.terms[0].held().unwrap_or(theta[1]);
        let c = self.terms[1].held().unwrap_or(theta[2]);
        let colour = if c == 0.0 { 0.0 } else { c * self.mean[1] };
        let zp = self.offset + theta[0] - k * self.mean[0] - colour;
        // J = [[1, −X̄, −mean], [0, 1, 0], [0, 0, 1]];  Cov' = J Cov Jᵀ
        let j = [[1.0, -self.mean[0], -self.mean[1]], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut out = [[0.0; 3]; 3];
        for (a, row) in out.iter_mut().enumerate() {
            for (b, v) in row.iter_mut().enumerate() {
                for m in 0..3 {
                    for n in 0..3 {
                        *v += j[a][m] * cov[m][n] * j[b][n];
                    }
                }
            }
        }
        // symmetric to the bit
        out[1][0] = out[0][1];
        out[2][0] = out[0][2];
        out[2][1] = out[1][2];
        (zp, out)
    }

    /// χ²/dof and its probability with the stated errors alone.
    pub fn chi2(&self, used: &[usize], theta: &[f64; 3]) -> (Option<f64>, Option<f64>) {
        let known = used.iter().all(|i| self.stated_var(*i, theta) > 0.0);
        let dof = used.len().saturating_sub(self.n_free());
        if !known || dof == 0 {
            return (None, None);
        }
        let chi2: f64 = used.iter().map(|i| self.residual(*i, theta).powi(2) / self.stated_var(*i, theta)).sum();
        let p = ChiSquared::new(dof as f64).ok().map(|d| d.sf(chi2));
        (Some(chi2 / dof as f64), p)
    }

    /// Different pointings among `used`.
    pub fn n_pointings(&self, used: &[usize]) -> usize {
        used.iter().map(|i| self.star(*i).pointing).collect::<std::collections::BTreeSet<_>>().len()
    }

    fn mean_of(&self, value: impl Fn(&StarMeasurement) -> f64) -> f64 {
        let values: Vec<f64> = self.stars.iter().map(|(_, s)| value(s)).filter(|v| v.is_finite()).collect();
        if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
    }

    fn span(&self, value: impl Fn(&StarMeasurement) -> f64) -> f64 {
        let values = self.stars.iter().map(|(_, s)| value(s)).filter(|v| v.is_finite());
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        hi - lo
    }

    /// Variances with unknown parts (NaN, zero, negative) filled by the median of the known ones.
    fn errors(&mut self, config: &config::Zeropoint) {
        let fill = |value: &dyn Fn(&StarMeasurement) -> f64| {
            let known = |e: &f64| e.is_finite() && *e > 0.0;
            let mut have: Vec<f64> = self.stars.iter().map(|(_, s)| value(s)).filter(known).collect();
            let missing = self.len() - have.len();
            let typical = super::median(&mut have);
            let of = |s: &StarMeasurement| Some(value(s)).filter(known).unwrap_or(typical);
            (self.stars.iter().map(|(_, s)| of(s).powi(2)).collect::<Vec<f64>>(), missing)
        };
        let (inst, no_inst) = fill(&|s| s.inst_err_mag);
        let (cat, no_cat) = fill(&|s| s.v_err_mag);
        let (colour, _) = fill(&|s| s.b_v_err_mag);
        self.var = inst.iter().zip(&cat).map(|(a, b)| a + b).collect();
        self.var_colour = colour;
        self.weighted = config.estimator == Estimator::Robust && config.weighted && self.var.iter().any(|v| *v > 0.0);
        if self.weighted {
            for (missing, what) in [(no_inst, "instrumental"), (no_cat, "catalogue")] {
                if missing > 0 {
                    let how = if missing == self.len() { "taken as 0" } else { "filled by the median of the known" };
                    self.warnings.push(format!("{missing} of {} {what} errors unknown: {how}", self.len()));
                }
            }
        }
    }
}
