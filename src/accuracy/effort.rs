//! How much work a sweep may do, and the clock it is timed with.

use crate::base::progress::Progress;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Few cases: seconds for most sweeps.
    Quick,
    /// Enough cases for a worst error that means something.
    Full,
}

impl Effort {
    /// `quick` or `full`, as the effort is.
    pub(super) fn of<T>(self, quick: T, full: T) -> T {
        match self {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }
}

/// What a sweep needs from outside.
#[derive(Clone, Copy)]
pub struct Stopwatch<'a> {
    /// CPU seconds this process has used so far.
    pub cpu_s: &'a dyn Fn() -> f64,
    /// How much is measured.
    pub effort: Effort,
    /// Chooses the cases that are drawn: 0 as published, any other number draws others.
    pub seed: u64,
    /// Hears of the steps of a long sweep.
    pub progress: &'a dyn Progress,
}

impl Stopwatch<'_> {
    /// The seed of one sweep's own stream of random numbers.
    pub(super) fn seed(&self, own: u64) -> u64 {
        self.seed.wrapping_mul(1_000_003).wrapping_add(own)
    }
}
