//! Which rows of a table count: used, lower limits.

use super::flags::Flags;
use super::schema::PhotometryRow;
use super::schema::ResidualRow;
use super::words::Status;
use super::words::Verdict;

/// Whether a measurement counts in medians: status `ok` (or unsaid) and not rejected by its verdict.
#[must_use]
pub fn is_used(status: &str, verdict: &str) -> bool {
    let measured = status.is_empty() || *status == Status::Ok;
    measured && *verdict != Verdict::Reject
}

/// Whether a row only says "at least so bright": something may have stood in the beam.
#[must_use]
pub fn is_lower_limit(flags: i32) -> bool {
    Flags(flags).has(Flags::LOWER_LIMIT)
}

/// Whether a row's magnitude counts in medians: there is one, it is used, and it is no lower limit on the brightness.
#[must_use]
pub fn counts(row: &PhotometryRow) -> bool {
    row.v_mag.is_some_and(f64::is_finite) && is_used(&row.status, &row.verdict) && !is_lower_limit(row.flags)
}

/// Residuals that count in medians: a lower limit on the brightness is no measurement of it.
#[must_use]
pub fn used_residuals(rows: &[ResidualRow]) -> Vec<f64> {
    let counts = |r: &&ResidualRow| is_used("", &r.verdict) && !is_lower_limit(r.flags);
    rows.iter().filter(counts).filter_map(|r| r.residual_mag).collect()
}
