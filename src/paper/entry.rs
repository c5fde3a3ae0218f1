//! One row: a number as printed, how it is computed here, and by which rule the two are judged.
//!
//! Values in the unit of the row. No verdict is written down: each follows from the row's rule and the numbers.

use super::context::Context;
use super::rule::Rule;
use crate::base::error::Result;

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
    /// Not in the paper: a number its reader will want next to it.
    Additional,
    /// Excluded of this table as slow.
    NotComputed,
}

/// What a number rests on; with the rule it makes the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Inputs and formula are stated.
    Stated,
    /// An assumption the paper does not state is needed.
    Assumed,
    /// A measurement or another's number: not derivable.
    Literature,
    /// Not in the paper.
    Additional,
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
            Self::Additional => "not in the paper",
            Self::NotComputed => "not computed",
        }
    }
}

/// What a computation answers, in the unit of its row.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Numbers {
    /// By the formula and the inputs of the paper.
    pub as_published: Option<f64>,
    /// By the corrected physics.
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
/// What is judged where it is none of the numbers shown.
type Judge = fn(&Context) -> Result<f64>;

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
    /// What it is held against where that is not the number printed.
    pub against: Option<f64>,
    /// How near a computed value must be to be called the same.
    pub rule: Option<Rule>,
    /// What it rests on.
    pub basis: Basis,
    /// Why they differ, or what was assumed, or the source.
    pub why: &'static str,
    /// Takes longer than a second.
    pub slow: bool,
    compute: Option<Compute>,
    judge: Option<Judge>,
}

/// A computed row.
#[derive(Debug, Clone, Copy)]
pub struct Published {
    /// The quantity.
    pub entry: Entry,
    /// The answer.
    pub numbers: Numbers,
    /// What the rule is put to: by the paper's way where there is one.
    pub judged: Option<f64>,
    /// It was excluded as too slow.
    pub is_skipped: bool,
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
        against: None,
        rule: None,
        basis: Basis::Additional,
        why: "",
        slow: false,
        compute: None,
        judge: None,
    }
}

impl Entry {
    /// As printed, as a number, and the rule of its kind.
    pub(super) const fn printed(self, printed: &'static str, value: f64, rule: Rule) -> Self {
        Self { printed, value: Some(value), rule: Some(rule), ..self }
    }

    /// What it is held against though the paper does not print it as a number, and the rule.
    pub(super) const fn against(self, value: f64, rule: Rule) -> Self {
        Self { against: Some(value), rule: Some(rule), ..self }
    }

    /// By the formula as printed, held against what the physics gives.
    pub(super) const fn formula(self) -> Self {
        Self { rule: Some(Rule::Formula), ..self }
    }

    /// What is judged where it is none of the numbers shown.
    pub(super) const fn judged_by(self, judge: Judge) -> Self {
        Self { judge: Some(judge), ..self }
    }

    /// What it rests on, and why the numbers differ, what was assumed, or the source.
    pub(super) const fn is(self, basis: Basis, why: &'static str) -> Self {
        Self { basis, why, ..self }
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
        let is_skipped = self.slow && !full;
        let numbers = match self.compute.filter(|_| !is_skipped) {
            Some(compute) => compute(context)?.finite(),
            None => Numbers::default(),
        };
        let judged = match self.judge.filter(|_| !is_skipped) {
            Some(judge) => Some(judge(context)?),
            None => numbers.as_published.or(numbers.corrected),
        };
        Ok(Published { entry: *self, numbers, judged, is_skipped })
    }
}

impl Published {
    /// What the number is held against: by a formula what the physics gives, else what is printed.
    #[must_use]
    pub fn held_against(&self) -> Option<f64> {
        match self.entry.rule {
            Some(Rule::Formula) => self.numbers.corrected,
            _ => self.entry.against.or(self.entry.value),
        }
    }

    /// How far it may be from that \[unit of the row\]; `None` for a row that is not judged.
    #[must_use]
    pub fn tolerance(&self) -> Option<f64> {
        let (rule, value) = self.entry.rule.filter(|_| self.is_judged()).zip(self.held_against())?;
        Some(rule.tolerance(self.entry.printed, value, self.entry.is_mag()))
    }

    /// A rule is put to it.
    #[must_use]
    pub fn is_judged(&self) -> bool {
        matches!(self.entry.basis, Basis::Stated | Basis::Assumed)
    }

    /// The verdict, by the rule and the numbers; what cannot be computed at all is not reproduced.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        match self.entry.basis {
            Basis::Literature => return Verdict::Literature,
            Basis::Additional => return Verdict::Additional,
            _ if self.is_skipped => return Verdict::NotComputed,
            Basis::Stated | Basis::Assumed => {}
        }
        let agrees = match (self.entry.rule, self.judged, self.held_against()) {
            (Some(rule), Some(judged), Some(value)) => {
                rule.agrees(judged, self.entry.printed, value, self.entry.is_mag())
            }
            _ => false,
        };
        match self.entry.basis {
            _ if !agrees => Verdict::NotReproduced,
            Basis::Assumed => Verdict::WithAssumption,
            _ => Verdict::Reproduced,
        }
    }
}

impl Entry {
    /// Its unit is a magnitude.
    fn is_mag(&self) -> bool {
        self.unit.starts_with("mag")
    }
}
