//! Searches along a line: where a condition ceases to hold, and where a function is largest.

/// When a search has come close enough.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Until {
    /// The interval is no longer than this.
    Length(f64),
    /// After so many steps.
    Steps(u32),
}

impl Until {
    fn reached(self, length: f64, steps: u32) -> bool {
        match self {
            Until::Length(least) => length.abs() <= least,
            Until::Steps(most) => steps >= most,
        }
    }
}

/// Bisection between a place where a condition holds and one where it does not, in either direction: `[holds, fails]`.
///
/// # Errors
/// Those of the condition.
pub(crate) fn bisect<E>(
    mut holds_at: f64,
    mut fails_at: f64,
    until: Until,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<[f64; 2], E> {
    let mut steps = 0;
    while !until.reached(fails_at - holds_at, steps) {
        let middle = 0.5 * (holds_at + fails_at);
        if holds(middle)? {
            holds_at = middle
        } else {
            fails_at = middle
        }
        steps += 1;
    }
    Ok([holds_at, fails_at])
}

/// Golden-section search of the largest value of a function between two places: `(place, value)`.
///
/// The function must have one maximum in between; of more, one is found.
///
/// # Errors
/// Those of the function.
pub(crate) fn golden_section<E>(
    mut low: f64,
    mut high: f64,
    until: Until,
    mut value: impl FnMut(f64) -> Result<f64, E>,
) -> Result<(f64, f64), E> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let mut at = |x: f64| Ok((x, value(x)?));
    let (mut a, mut b) = (at(high - GOLDEN * (high - low))?, at(low + GOLDEN * (high - low))?);
    let mut steps = 0;
    while !until.reached(high - low, steps) {
        if a.1 > b.1 {
            (high, b) = (b.0, a);
            a = at(high - GOLDEN * (high - low))?;
        } else {
            (low, a) = (a.0, b);
            b = at(low + GOLDEN * (high - low))?;
        }
        steps += 1;
    }
    Ok(if a.1 > b.1 { a } else { b })
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn a_root_and_a_maximum_are_found_to_the_length_that_was_set() {
        let Ok([below, above]) = bisect(1.0, 2.0, Until::Length(1e-9), |x| Ok::<_, Infallible>(x * x < 2.0));
        assert!(below * below < 2.0 && above * above >= 2.0 && above - below <= 1e-9);
        let Ok([above, below]) = bisect(2.0, 1.0, Until::Steps(50), |x| Ok::<_, Infallible>(x * x >= 2.0));
        assert!((above - 2f64.sqrt()).abs() < 1e-15 && (below - 2f64.sqrt()).abs() < 1e-15);
        let Ok((place, value)) =
            golden_section(0.0, 3.0, Until::Length(1e-6), |x| Ok::<_, Infallible>(5.0 - (x - 1.2).powi(2)));
        assert!((place - 1.2).abs() < 1e-6 && (value - 5.0).abs() < 1e-12, "{place} {value}");
    }

    #[test]
    fn an_error_of_the_function_is_handed_on() {
        assert_eq!(bisect(0.0, 1.0, Until::Steps(3), |_| Err("no")), Err("no"));
        assert_eq!(golden_section(0.0, 1.0, Until::Steps(3), |_| Err("no")), Err("no"));
    }
}
