//! The magnitudes of a table of observations: apparent, of the band of the model, and what they differ from it.
//!
//! Magnitudes; residual = observed − modelled. A magnitude that is reduced to a range is made apparent where the range is stated,
//! and refused otherwise.

use super::columns::Columns;
use super::request::{Request, wrong};
use crate::bands::{Meaning, filter_meaning};
use crate::base::error::Result;
use crate::brightness::columns::fill_normalised;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::read::{Row, Table};
use crate::tables::words::{Status, Verdict};

/// Magnitudes beyond this stand for a missing one (99, -99, 99.999).
const MISSING_FROM_MAG: f64 = 90.0;
/// Apparent magnitudes of satellites.
const PLAUSIBLE_MAG: std::ops::RangeInclusive<f64> = -15.0..=30.0;

/// Refuses a table without apparent magnitudes where they are to be compared.
pub fn check_columns(request: &Request, columns: &Columns, table: &Table) -> Result<()> {
    let Some(asked) = request.magnitudes else { return Ok(()) };
    if columns.v_mag.is_some() {
        return Ok(());
    }
    let name = |i: usize| table.columns[i].name.as_str();
    Err(wrong(
        table,
        match columns.reduced_mag {
            Some(i) => format!(
                "its magnitudes are in column `{}`, which are not apparent but reduced to a distance; if to the range alone, argument \
                 `column v_mag={}` and argument `reduced_to_km 1000` undo it; a reduction to a phase cannot be undone",
                name(i),
                name(i)
            ),
            None => format!(
                "has no column of apparent magnitudes of band {}; present: {}; argument `column v_mag=NAME` names it",
                asked.band,
                table.names()
            ),
        },
    ))
}

/// Puts magnitude and residual into a row.
pub fn compare(request: &Request, columns: &Columns, row: &Row, made: &mut PhotometryRow) {
    let (Some(asked), Some(v_mag)) = (request.magnitudes, columns.v_mag) else { return };
    let cell = v_mag.column().map_or("", |i| row.get(i));
    let mut add = |status: Status, verdict: Verdict, reason: String| {
        if made.status != Status::Failed {
            made.status = status.into();
        }
        made.verdict = verdict.into();
        made.reason = if made.reason.is_empty() { reason } else { format!("{}; {reason}", made.reason) };
    };
    let limit_v_mag = columns.limit_v_mag.and_then(|limit| limit.of(row)).filter(|mag| PLAUSIBLE_MAG.contains(mag));
    let Some(mag) = v_mag.of(row) else {
        made.limit_v_mag = limit_v_mag.filter(|_| cell.is_empty());
        let reason =
            if cell.is_empty() { "no magnitude".to_owned() } else { format!("magnitude \"{cell}\" is not a number") };
        let status = if cell.is_empty() { Status::Nondetection } else { Status::Failed };
        return add(status, Verdict::Reject, reason);
    };
    if mag.abs() >= MISSING_FROM_MAG {
        return add(Status::Nondetection, Verdict::Reject, format!("magnitude {cell} stands for a missing one"));
    }
    if !PLAUSIBLE_MAG.contains(&mag) {
        let reason = format!("magnitude {mag} is outside {} to {}", PLAUSIBLE_MAG.start(), PLAUSIBLE_MAG.end());
        return add(Status::Failed, Verdict::Reject, reason);
    }
    let filter = columns.filter.map_or("", |i| row.get(i));
    if !filter.is_empty() && !filter_meaning(filter).may_be(asked.band) {
        let reason = format!("magnitude of filter {filter}, the model is of {}", asked.band);
        return add(Status::Rejected, Verdict::Reject, reason);
    }
    let own_word = |i: Option<usize>, bad: &[&str]| i.is_some_and(|i| bad.contains(&row.get(i)));
    if own_word(columns.verdict, &["reject"]) || own_word(columns.status, &["rejected", "failed", "nondetection"]) {
        add(Status::Rejected, Verdict::Reject, "rejected in the table".into());
    }
    if made.status == Status::Failed {
        return;
    }
    // m = m_reduced + 5 lg(d / d₀)
    let reduction = match (asked.reduced_to_km, made.range_km) {
        (Some(to_km), Some(range_km)) => 5.0 * (range_km / to_km).log10(),
        _ => 0.0,
    };
    made.v_mag = Some(mag + reduction);
    made.v_mag_err = columns.v_mag_err.and_then(|e| e.of(row)).filter(|e| *e >= 0.0);
    fill_normalised(made);
    made.residual_mag = made.v_mag.zip(made.model_v_mag).map(|(observed, modelled)| observed - modelled);
    if made.residual_mag.is_none() && made.verdict != Verdict::Reject {
        made.verdict = Verdict::Reject.into();
        let reason = "the model has no light here".to_owned();
        made.reason = if made.reason.is_empty() { reason } else { format!("{}; {reason}", made.reason) };
    }
    if Flags(made.flags).has(Flags::OLD_ELEMENTS) && made.verdict == Verdict::Use {
        made.verdict = Verdict::Caution.into();
    }
}

/// A word on magnitudes without a filter, which are taken as those of the model.
pub fn unfiltered_note<T>(columns: &Columns, rows: &[(Row, T)]) -> Option<String> {
    let Some(i) = columns.filter else {
        return Some(
            "the table has no column of filters: its magnitudes are taken as those of the model's band".into(),
        );
    };
    let unfiltered = |row: &Row| matches!(filter_meaning(row.get(i)), Meaning::Unfiltered | Meaning::Unknown);
    let n = rows.iter().filter(|(row, _)| unfiltered(row)).count();
    (n > 0).then(|| {
        format!(
            "{n} magnitudes are without a filter (or of one that is not known) and taken as those of the model's band"
        )
    })
}
