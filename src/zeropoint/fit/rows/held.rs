//! Which terms the stars determine: the others are held at their prior and named; k'' is refused.
//!
//! Magnitudes. Judged by the span of airmass and colour and by the error that the design promises, before any fit.

use super::{BELIEVED_SHARE, Rows};
use crate::base::error::Result;
use crate::config::{self, Pin};
use crate::zeropoint::fit::crossed::Sums;
use crate::zeropoint::fit::solve::N;
use crate::zeropoint::fit::terms::Term;

/// Narrowest span of airmass from which extinction is fitted.
const MIN_AIRMASS_SPAN: f64 = 0.05;
/// Narrowest span of B−V from which a colour term is fitted \[mag\].
const MIN_COLOUR_SPAN_MAG: f64 = 0.05;
/// Condition number above which a term is refused: airmass and colour are the same line.
const CONDITION_REFUSED: f64 = 1e6;
/// Predicted error of a term in units of that of its prior above which it is held there.
const TIMES_PRIOR: f64 = 5.0;
/// Correlation of airmass and colour that is called collinear.
const COLLINEAR: f64 = 0.9;

impl Rows {
    /// Refuses the terms the stars span too little for, or that go together.
    pub(super) fn refuse_degenerate_terms(&mut self, config: &config::Zeropoint) -> Result<()> {
        let priors = [config.k_prior, config.c_prior];
        let spans = [self.span(|s| s.airmass), self.span(|s| s.b_v_mag)];
        if self.terms[0] == Term::Free && spans[0] < MIN_AIRMASS_SPAN {
            self.hold(0, priors[0], format!("all stars within {:.2} airmass", spans[0].max(0.0)));
        }
        if self.terms[1] == Term::Free && spans[1] < MIN_COLOUR_SPAN_MAG {
            self.hold(1, priors[1], format!("all stars within {:.2} mag of B-V", spans[1].max(0.0)));
        }
        if self.terms[1] == Term::Free && self.calibration.share < BELIEVED_SHARE {
            self.hold(1, priors[1], "the colours scatter hardly more than their errors".to_owned());
        }
        if self.terms[2] == Term::Free {
            let narrow = [("airmass", spans[0] < MIN_AIRMASS_SPAN), ("B-V", spans[1] < MIN_COLOUR_SPAN_MAG)];
            if let Some((what, _)) = narrow.iter().find(|n| n.1) {
                self.refuse(2, format!("the stars span too little {what}"));
            }
        }
        self.centre_the_product();
        let ones = vec![1.0; self.len()];
        if self.terms[2] == Term::Free && self.condition(&ones).0 > CONDITION_REFUSED {
            self.refuse(2, "airmass x colour follows the other terms".to_owned());
            self.centre_the_product();
        }
        self.refuse_by_predicted_error(priors, config);
        self.centre_the_product();
        self.enough(self.len(), 0, "all of them")
    }

    fn centre_the_product(&mut self) {
        let centre = |t: usize| if self.terms[1 - t] == Term::Free { self.mean[t] } else { 0.0 };
        self.product = [centre(0), centre(1)];
    }

    /// Holds k or C at its prior where the fit would determine it worse than the prior does: predicted error above
    /// [`TIMES_PRIOR`] times that of the prior, from the stated errors and the prior of the scatter between pointings.
    fn refuse_by_predicted_error(&mut self, priors: [Pin; 2], config: &config::Zeropoint) {
        for _ in 0..2 {
            let predicted = self.predicted_errs(config.pointing_scatter_prior_mag);
            let ratio = |t: usize| {
                let free = self.terms[t] == Term::Free && priors[t].err > 0.0;
                if free { predicted[t] / (TIMES_PRIOR * priors[t].err) } else { 0.0 }
            };
            let term = usize::from(ratio(1) > ratio(0));
            if !(ratio(term) > 1.0) {
                return;
            }
            let r = self.correlation();
            let collinear = self.terms[1 - term].held().is_none() && r.abs() > COLLINEAR;
            let err = if predicted[term].is_finite() { format!("{:.2}", predicted[term]) } else { "infinite".into() };
            let why = if collinear {
                format!("colour and airmass are collinear (correlation {r:.5}, predicted error {err})")
            } else {
                format!("predicted error {err}, above {TIMES_PRIOR} times that of its prior")
            };
            self.hold(term, priors[term], why);
        }
    }

    /// Errors of k and C that the design, the stated errors and a scatter between pointings promise; infinite where the
    /// terms cannot be separated.
    fn predicted_errs(&self, pointing_mag: f64) -> [f64; 2] {
        let n = self.len();
        if self.condition(&vec![1.0; n]).0 > CONDITION_REFUSED {
            return [f64::INFINITY; 2];
        }
        let zero = [0.0; N];
        let stated: Vec<f64> = (0..n).map(|i| self.stated_var(i, &zero)).collect();
        let known = stated.iter().sum::<f64>() / n as f64;
        let mut y: Vec<f64> = (0..n).map(|i| self.y(i)).collect();
        let empirical = crate::base::stats::mad_sigma(&mut y).unwrap_or(0.0).powi(2);
        let typical = if known > 0.0 { known } else { empirical };
        let omega: Vec<f64> = stated.iter().map(|v| 1.0 / v.max(0.01 * typical).max(1e-12)).collect();
        let mut of_star = vec![0.0_f64; self.n_stars];
        (0..n).for_each(|i| of_star[self.star_of[i]] = self.star_var(i, &zero).sqrt());
        let sums = Sums::of(self, &omega, |_| 0.0);
        // one pointing is an offset of all stars
        let scatter = if self.pointings.len() > 1 { pointing_mag } else { 0.0 };
        let cov = sums.solve(&vec![scatter; self.pointings.len()], &of_star).cov;
        [cov[1][1].sqrt(), cov[2][2].sqrt()]
    }

    /// Correlation of airmass and colour over the rows.
    fn correlation(&self) -> f64 {
        let (mut xx, mut cc, mut xc) = (0.0, 0.0, 0.0);
        for i in 0..self.len() {
            let (x, c) = (self.column_of_term(0, i), self.column_of_term(1, i));
            (xx, cc, xc) = (xx + x * x, cc + c * c, xc + x * c);
        }
        let product = (xx * cc).sqrt();
        if product > 0.0 { xc / product } else { 0.0 }
    }

    /// Holds a term at its prior, by name.
    pub(crate) fn hold(&mut self, term: usize, prior: Pin, why: String) {
        let (name, unit, key) = if term == 0 { ("k", " mag/airmass", "k") } else { ("C", " mag/mag", "c") };
        self.warnings.push(format!(
            "{name} refused: {why}; held at {} +- {}{unit}, its prior (zeropoint.{key}_prior), and that error is in the \
             error of the zeropoint; a value of this night is given with zeropoint.pin_{key}",
            prior.value, prior.err
        ));
        self.terms[term] = Term::Held(prior, why);
    }

    /// Refuses k''.
    fn refuse(&mut self, term: usize, why: String) {
        self.warnings.push(format!("k'' refused: {why}; taken as 0"));
        self.terms[term] = Term::Refused(why);
    }
}
