//! One row: a number as printed, how it is computed here, and what is to be thought of it.
//!
//! Values in the unit of the row. A row without a computation is literature.

use super::context::Context;
use crate::error::Result;

/// What is to be thought of a published number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The stated inputs give it.
    Reproduced,
    /// An assumption the paper does not state gives it, or comes near.
    WithAssumption,
    /// The stated inputs do not give it, or it is wrong in print.
    NotReproduced,
    /// A measurement or another's number: listed with its source, not derivable.
    Literature,
    /// Not in the paper: a number its reader will want beside it.
    Beside,
}

impl Verdict {
    /// As tables spell it.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::WithAssumption => "with an assumption",
            Self::NotReproduced => "not reproduced",
            Self::Literature => "literature",
            Self::Beside => "beside the paper",
        }
    }
}

/// What a computation answers, in the unit of its row.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Numbers {
    /// By the formula and the inputs of the paper.
    pub as_published: Option<f64>,
    /// As the physics asks.
    pub corrected: Option<f64>,
}

impl Numbers {
    /// The paper's way and the right one.
    #[must_use]
    pub fn pair(as_published: f64, corrected: f64) -> Self {
        Self { as_published: Some(as_published), corrected: Some(corrected) }
    }

    /// One number: paper and physics agree.
    #[must_use]
    pub fn both(value: f64) -> Self {
        Self::pair(value, value)
    }

    /// The paper gives no way to it.
    #[must_use]
    pub fn corrected(value: f64) -> Self {
        Self { as_published: None, corrected: Some(value) }
    }

    fn finite(self) -> Self {
        let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
        Self { as_published: finite(self.as_published), corrected: finite(self.corrected) }
    }
}

/// How a row is computed.
type Compute = fn(&Context) -> Result<Numbers>;

/// One row before it is computed.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Its name, lower case with hyphens.
    pub id: &'static str,
    /// Where in the paper.
    pub place: &'static str,
    /// What it is.
    pub quantity: &'static str,
    /// Its unit; empty for a pure number.
    pub unit: &'static str,
    /// Decimals shown; scientific from four significant digits below zero.
    pub decimals: i8,
    /// As printed; empty where the paper prints no number.
    pub printed: &'static str,
    /// The same as a number.
    pub value: Option<f64>,
    /// How near a computed value must be to be called the same: the rounding in print, or the spread of the reference.
    pub within: f64,
    /// What is to be thought of it.
    pub verdict: Verdict,
    /// Why they differ, or what was assumed, or the source.
    pub why: &'static str,
    /// Takes longer than a second.
    pub slow: bool,
    compute: Option<Compute>,
}

/// A computed row.
#[derive(Debug, Clone, Copy)]
pub struct Published {
    /// What was asked.
    pub entry: Entry,
    /// The answer.
    pub numbers: Numbers,
    /// It was left out as too slow.
    pub left_out: bool,
}

/// Starts a row; a literature row until [`Entry::by`] says how it is computed.
pub(super) const fn row(
    id: &'static str,
    place: &'static str,
    quantity: &'static str,
    unit: &'static str,
    decimals: i8,
) -> Entry {
    Entry {
        id,
        place,
        quantity,
        unit,
        decimals,
        printed: "",
        value: None,
        within: 0.0,
        verdict: Verdict::Beside,
        why: "",
        slow: false,
        compute: None,
    }
}

impl Entry {
    /// As printed, as a number, and how near is the same.
    pub(super) const fn printed(self, printed: &'static str, value: f64, within: f64) -> Self {
        Self { printed, value: Some(value), within, ..self }
    }

    /// Verdict and reason.
    pub(super) const fn is(self, verdict: Verdict, why: &'static str) -> Self {
        Self { verdict, why, ..self }
    }

    /// How it is computed.
    pub(super) const fn by(self, compute: Compute) -> Self {
        Self { compute: Some(compute), ..self }
    }

    /// Takes longer than a second.
    pub(super) const fn slow(self) -> Self {
        Self { slow: true, ..self }
    }

    /// Whether the program computes it.
    #[must_use]
    pub fn is_computed(&self) -> bool {
        self.compute.is_some()
    }

    /// Computes the row; a slow one only if `full`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn computed(&self, context: &Context, full: bool) -> Result<Published> {
        let left_out = self.slow && !full;
        let numbers = match self.compute.filter(|_| !left_out) {
            Some(compute) => compute(context)?.finite(),
            None => Numbers::default(),
        };
        Ok(Published { entry: *self, numbers, left_out })
    }
}
