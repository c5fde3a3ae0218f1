//! The median of a slice.

use crate::base::stats;

/// The median of values, which are reordered; 0 if there are none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    stats::median(values).unwrap_or(0.0)
}
