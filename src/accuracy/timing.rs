//! CPU time with its own error: repeated, the median, and an interval that holds it whatever the noise is distributed like.
//!
//! µs. Between the k-th smallest and the k-th largest of n independent repeats lies the median of their distribution with
//! the probability `1 − 2 Σ_{j<k} C(n,j) / 2ⁿ` (David & Nagaraja 2003, Order Statistics, section 7.1). What is the same for
//! all repeats of one run and another in the next is not in it: [`RESOLUTION`] stands for that.

use std::ops::{Div, Mul};

use super::effort::Stopwatch;
use crate::base::error::Result;

/// Two runs of one program time the same work a few per cent apart, for where code and data lie and what else runs: times that
/// differ by less than this share are not told apart.
const RESOLUTION: f64 = 0.05;
/// The interval holds the median with at least this probability, where there are repeats enough for that.
const COVERAGE: f64 = 0.95;
/// Repeats that are aimed at, the least that are made, seconds of one at least, and after which no more are begun.
const QUICK: (usize, usize, f64, f64) = (7, 3, 0.003, 0.2);
const FULL: (usize, usize, f64, f64) = (15, 5, 0.02, 2.0);
/// Most calls of one repeat.
const MOST_CALLS: u32 = 1 << 24;

/// CPU time of one piece of work \[µs\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CpuTime {
    /// Median of the repeats.
    pub median_us: f64,
    /// Lower end of the interval that holds the median.
    pub low_us: f64,
    /// Upper end.
    pub high_us: f64,
    /// How often it was measured.
    pub repeats: usize,
}

impl CpuTime {
    /// Of repeated measurements \[µs\]; `None` without any. Fewer than six have the smallest and the largest as their interval,
    /// which holds the median in `1 − 2^(1−n)` of cases.
    #[must_use]
    pub fn of(repeats_us: &[f64]) -> Option<Self> {
        let mut sorted = repeats_us.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let median_us = 0.5 * (sorted.get(n.checked_sub(1)? / 2)? + sorted.get(n / 2)?);
        // ranks from both ends, as far in as the coverage allows
        let (mut rank, mut outside, mut term) = (0, 0.0, 0.5f64.powi(n as i32));
        while rank < n / 2 && 1.0 - 2.0 * (outside + term) >= COVERAGE {
            outside += term;
            rank += 1;
            term *= (n - rank + 1) as f64 / rank as f64;
        }
        let rank = rank.max(1);
        Some(Self { median_us, low_us: *sorted.get(rank - 1)?, high_us: *sorted.get(n - rank)?, repeats: n })
    }

    /// One measurement that came without its error.
    #[must_use]
    pub fn once(us: f64) -> Self {
        Self { median_us: us, low_us: us, high_us: us, repeats: 1 }
    }

    /// Whether it is less than another beyond the errors of both.
    #[must_use]
    pub fn is_below(&self, other: &Self) -> bool {
        (1.0 + RESOLUTION) * self.high_us < other.low_us
    }

    fn scaled(self, by: f64) -> Self {
        let (median_us, low_us, high_us) = (by * self.median_us, by * self.low_us, by * self.high_us);
        Self { median_us, low_us, high_us, ..self }
    }
}

impl Div<f64> for CpuTime {
    type Output = Self;
    fn div(self, pieces: f64) -> Self {
        self.scaled(1.0 / pieces)
    }
}

impl Mul<f64> for CpuTime {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.scaled(factor)
    }
}

/// CPU time of one call: each repeat has as many calls as make the clock's steps not matter.
pub(super) fn cpu_us(stopwatch: &Stopwatch, mut work: impl FnMut()) -> CpuTime {
    let (wanted, fewest, least_s, enough_s) = stopwatch.effort.of(QUICK, FULL);
    let mut timed = |calls: u32| {
        let start = (stopwatch.cpu_s)();
        for _ in 0..calls {
            work();
        }
        (stopwatch.cpu_s)() - start
    };
    let (mut calls, mut used_s) = (1, timed(1));
    while used_s < least_s && calls < MOST_CALLS {
        calls *= 2;
        used_s = timed(calls);
    }
    let mut repeats = vec![1e6 * used_s / f64::from(calls)];
    let mut total_s = used_s;
    while repeats.len() < fewest || (repeats.len() < wanted && total_s < enough_s) {
        let used_s = timed(calls);
        total_s += used_s;
        repeats.push(1e6 * used_s / f64::from(calls));
    }
    CpuTime::of(&repeats).unwrap_or_else(|| CpuTime::once(f64::NAN))
}

/// What a slow piece of work gives, and its CPU time from the fewest repeats.
///
/// # Errors
/// Those of the work.
pub(super) fn timed<T>(stopwatch: &Stopwatch, mut work: impl FnMut() -> Result<T>) -> Result<(T, CpuTime)> {
    let mut once = || {
        let start = (stopwatch.cpu_s)();
        work().map(|given| (given, 1e6 * ((stopwatch.cpu_s)() - start)))
    };
    let (mut given, first_us) = once()?;
    let mut repeats = vec![first_us];
    while repeats.len() < QUICK.1 {
        let (again, us) = once()?;
        given = again;
        repeats.push(us);
    }
    Ok((given, CpuTime::of(&repeats).unwrap_or_else(|| CpuTime::once(f64::NAN))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::progress::Silent;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    #[test]
    fn the_interval_holds_the_median_as_often_as_its_law_says() {
        // an exponential distribution: its median is ln 2, its noise is far from Gaussian
        let mut rng = ChaCha12Rng::seed_from_u64(4);
        for (n, at_least) in [(3, 0.75), (5, 0.9375), (7, 0.95), (15, 0.95)] {
            let trials = 20_000;
            let held = (0..trials).filter(|_| {
                let repeats: Vec<f64> = (0..n).map(|_| -rng.random_range(1e-12..1.0f64).ln()).collect();
                let time = CpuTime::of(&repeats).unwrap();
                (time.low_us..=time.high_us).contains(&std::f64::consts::LN_2)
            });
            let share = held.count() as f64 / f64::from(trials);
            let scatter = (at_least * (1.0 - at_least) / f64::from(trials)).sqrt();
            assert!(share > at_least - 4.0 * scatter, "{n} repeats: {share}");
        }
    }

    #[test]
    fn ranks_median_and_units_are_those_of_the_sorted_repeats() {
        let time = CpuTime::of(&[5.0, 1.0, 2.0, 4.0, 3.0, 7.0, 6.0]).unwrap();
        assert_eq!((time.low_us, time.median_us, time.high_us, time.repeats), (1.0, 4.0, 7.0, 7));
        let fifteen: Vec<f64> = (1..=15).map(f64::from).collect();
        // C(15, 0..3) = 1 + 15 + 105 + 455: the fourth from both ends holds the median in 96.5 % of cases
        let time = CpuTime::of(&fifteen).unwrap();
        assert_eq!((time.low_us, time.median_us, time.high_us), (4.0, 8.0, 12.0));
        let half = time / 2.0;
        assert_eq!((half.low_us, half.median_us, half.high_us, half.repeats), (2.0, 4.0, 6.0, 15));
        assert_eq!(CpuTime::of(&[1.0, 2.0]).unwrap().median_us, 1.5);
        assert_eq!(CpuTime::of(&[]), None);
    }

    #[test]
    fn the_clock_is_read_around_every_repeat() {
        let now = std::cell::Cell::new(0.0);
        let cpu_s = || now.get();
        let stopwatch = Stopwatch { cpu_s: &cpu_s, effort: crate::accuracy::Effort::Quick, seed: 0, progress: &Silent };
        let time = cpu_us(&stopwatch, || now.set(now.get() + 1e-3));
        assert!((time.median_us - 1e3).abs() < 1e-6 && time.repeats == 7, "{time:?}");
        let (given, time) = timed(&stopwatch, || {
            now.set(now.get() + 2.0);
            Ok(3)
        })
        .unwrap();
        assert!(given == 3 && (time.median_us - 2e6).abs() < 1e-3 && time.repeats == 3, "{time:?}");
    }
}
