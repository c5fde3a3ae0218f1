//! The treatment of each term of the fit: fitted, pulled, held, or refused by name.

use crate::config::Pin;

/// The treatment of k, C or k''.
#[derive(Debug, Clone, PartialEq)]
pub enum Term {
    /// Fitted freely.
    Free,
    /// Fitted, pulled to a value by its error.
    Prior(f64, f64),
    /// Held.
    Fixed(f64),
    /// Not fitted, held at the value of its prior, whose error enters the covariance; and why.
    Held(Pin, String),
    /// Not fitted, taken as 0, and why.
    Refused(String),
    /// Not requested, taken as 0.
    Absent,
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
            Term::Held(prior, _) => Some(prior.value),
            Term::Refused(_) | Term::Absent => Some(0.0),
        }
    }

    /// The error of a value that is held and not exactly known; 0 otherwise.
    pub fn held_err(&self) -> f64 {
        if let Term::Held(prior, _) = self { prior.err } else { 0.0 }
    }

    /// For the report.
    pub fn note(&self) -> String {
        match self {
            Term::Free => "fitted".to_owned(),
            Term::Prior(v, e) => format!("pinned {v} +- {e} (prior)"),
            Term::Fixed(v) => format!("pinned {v}"),
            Term::Held(p, why) => format!("refused: {why}; held at {} +- {}, its prior", p.value, p.err),
            Term::Refused(why) => format!("refused: {why}"),
            Term::Absent => "not fitted".to_owned(),
        }
    }
}
