//! The stiff and extreme cases, each run: what is expected, what comes out, and whether that is right.
//!
//! Expected are closed forms, independent computations, and refusals that say why. A case that is off by a known amount
//! is a known limit and says so.

mod cut_passes;
mod fits;
mod geometry;
mod light;
mod orbits;
mod pixels;
mod reach;
mod sources;
mod zeropoints;

use crate::base::error::Result;

/// What became of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As expected, within the limit.
    Ok,
    /// Off by a known amount that is reported.
    KnownLimit,
    /// Not as expected.
    Wrong,
}

impl Verdict {
    /// As it is written in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Ok => "ok",
            Verdict::KnownLimit => "known limit",
            Verdict::Wrong => "WRONG",
        }
    }
}

/// One case.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// Part of the program.
    pub area: &'static str,
    /// The case.
    pub case: String,
    /// What is expected.
    pub expected: String,
    /// What came out.
    pub got: String,
    /// How far off it is; `None` for refusals.
    pub error: Option<f64>,
    /// How far off it may be.
    pub limit: Option<f64>,
    /// What became of it.
    pub verdict: Verdict,
}

/// Runs every case.
#[must_use]
pub fn extremes() -> Vec<Extreme> {
    [
        light::cases(),
        geometry::cases(),
        reach::cases(),
        orbits::cases(),
        cut_passes::cases(),
        pixels::cases(),
        sources::cases(),
        zeropoints::cases(),
        fits::cases(),
    ]
    .concat()
}

/// A number that should be `expected`, within `limit` of it relative to its size.
fn relative(area: &'static str, case: impl Into<String>, expected: f64, got: f64, limit: f64) -> Extreme {
    let error = if got == expected { 0.0 } else { (got / expected - 1.0).abs() };
    number(area, case.into(), (expected, got), error, limit)
}

/// A number known to be off: by up to `known` relative to its size; further off is wrong, and within `limit` is a limit
/// that is none any more.
fn known_limit(case: (&'static str, String), expected: f64, got: f64, limit: f64, known: f64) -> Extreme {
    let mut one = relative(case.0, case.1, expected, got, limit);
    if one.verdict == Verdict::Wrong && one.error.is_some_and(|e| e <= known) {
        one.verdict = Verdict::KnownLimit;
    }
    one
}

/// A number that should be `expected`, within `limit` of it.
fn absolute(area: &'static str, case: impl Into<String>, expected: f64, got: f64, limit: f64) -> Extreme {
    number(area, case.into(), (expected, got), (got - expected).abs(), limit)
}

fn number(area: &'static str, case: String, (expected, got): (f64, f64), error: f64, limit: f64) -> Extreme {
    // written so that NaN is wrong
    let verdict = if error <= limit { Verdict::Ok } else { Verdict::Wrong };
    let (expected, got) = (text(expected), text(got));
    Extreme { area, case, expected, got, error: error.is_finite().then_some(error), limit: Some(limit), verdict }
}

/// Short, and every digit where they matter.
fn text(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e6).contains(&size) => format!("{value:.6}"),
        _ => format!("{value:.6e}"),
    }
}

/// Something that must be so.
fn holds(area: &'static str, case: impl Into<String>, expected: &str, is_so: bool, got: impl Into<String>) -> Extreme {
    let verdict = if is_so { Verdict::Ok } else { Verdict::Wrong };
    Extreme { area, case: case.into(), expected: expected.into(), got: got.into(), error: None, limit: None, verdict }
}

/// Something that must be refused, with `word` in the reason.
fn refused<T>(area: &'static str, case: impl Into<String>, word: &str, result: Result<T>) -> Extreme {
    let (is_so, got) = match result {
        Ok(_) => (false, "accepted".into()),
        Err(error) => (error.to_string().contains(word), error.to_string()),
    };
    holds(area, case, &format!("refused: ... {word} ..."), is_so, got)
}

/// A case that could not be set up is wrong, with the reason.
fn or_wrong(area: &'static str, case: &str, result: Result<Extreme>) -> Extreme {
    result.unwrap_or_else(|error| holds(area, case, "an answer", false, error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_extreme_case_is_as_expected_or_a_known_limit() {
        let all = extremes();
        let wrong: Vec<&Extreme> = all.iter().filter(|e| e.verdict == Verdict::Wrong).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        assert!(all.len() > 40, "{}", all.len());
    }

    #[test]
    fn a_number_that_is_none_is_wrong_and_not_within_any_limit() {
        assert_eq!(relative("x", "y", 1.0, f64::NAN, 1.0).verdict, Verdict::Wrong);
        assert_eq!(absolute("x", "y", 0.0, f64::INFINITY, 1e300).verdict, Verdict::Wrong);
        let known = |got| known_limit(("x", "y".into()), 1.0, got, 1e-3, 1e-2).verdict;
        assert_eq!([known(1.0), known(1.005), known(1.02)], [Verdict::Ok, Verdict::KnownLimit, Verdict::Wrong]);
        assert_eq!(known(f64::NAN), Verdict::Wrong);
    }
}
