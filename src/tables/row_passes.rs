//! Rows of a table grouped into passes.

use super::schema::PhotometryRow;
use super::words::Status;

/// Two exposures of one target further apart than this belong to different passes \[s\]. A low-orbit pass lasts a
/// quarter of an hour at most and the next one comes an hour and a half later.
pub const PASS_GAP_S: f64 = 1_200.0;

/// The passes of a night: rows of one target without a gap longer than [`PASS_GAP_S`], in order of time.
///
/// Rows without a time and rejected ones, whose time or place is impossible, belong to no pass.
#[must_use]
pub fn passes(rows: &[PhotometryRow]) -> Vec<Vec<&PhotometryRow>> {
    let in_time = |r: &&PhotometryRow| r.mjd_mid_d.is_some_and(f64::is_finite) && r.status != Status::Rejected;
    let mut timed: Vec<&PhotometryRow> = rows.iter().filter(in_time).collect();
    timed.sort_by(|a, b| target(a).cmp(&target(b)).then(mjd(a).total_cmp(&mjd(b))));
    let mut passes: Vec<Vec<&PhotometryRow>> = Vec::new();
    for row in timed {
        match passes.last_mut() {
            Some(pass) if pass.last().is_some_and(|last| same_pass(last, row)) => pass.push(row),
            _ => passes.push(vec![row]),
        }
    }
    passes.sort_by(|a, b| a.first().map_or(0.0, |r| mjd(r)).total_cmp(&b.first().map_or(0.0, |r| mjd(r))));
    passes
}

pub(crate) fn target(row: &PhotometryRow) -> (Option<i64>, &str) {
    // The number names the target; the name counts only where there is no number.
    (row.norad_cat_id, if row.norad_cat_id.is_some() { "" } else { row.object_name.as_str() })
}

pub(crate) fn mjd(row: &PhotometryRow) -> f64 {
    row.mjd_mid_d.unwrap_or(f64::NAN)
}

pub(crate) fn same_pass(last: &PhotometryRow, row: &PhotometryRow) -> bool {
    target(last) == target(row) && (mjd(row) - mjd(last)) * 86_400.0 <= PASS_GAP_S
}
