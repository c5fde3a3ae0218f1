//! Which rows become observations, and why the others do not.
//!
//! Usable by default are rows whose verdict is `use`. What failed, was rejected, or only says "at least so bright" is
//! never a magnitude. Everything excluded is counted with its reason.

use crate::base::error::{Error, Result};
use crate::tables::PhotometryRow;
use crate::tables::selection::is_lower_limit;
use crate::tables::words::{Status, Verdict};

/// Verdicts that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Choice {
    /// Rows of verdict `caution` too.
    pub caution: bool,
    /// Rows of verdict `reject` that have a magnitude all the same.
    pub reject: bool,
}

impl Choice {
    /// `use`, `use,caution` or `use,caution,reject`, in any order.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn named(text: &str) -> Result<Self> {
        let mut choice = Self::default();
        let mut used = false;
        for word in text.split(',').map(str::trim) {
            match Verdict::from_cell(word) {
                Some(Verdict::Use) => used = true,
                Some(Verdict::Caution) => choice.caution = true,
                Some(Verdict::Reject) => choice.reject = true,
                None => {
                    let problem =
                        format!("`{word}` is not a verdict; accepted: use, caution, reject (comma-separated)");
                    return Err(Error::Argument { name: "verdicts".into(), problem });
                }
            }
        }
        if used {
            return Ok(choice);
        }
        Err(Error::Argument { name: "verdicts".into(), problem: format!("`{text}` does not contain `use`; add it") })
    }
}

/// A row that is written.
#[derive(Debug, Clone, Copy)]
pub enum ExportedRow<'a> {
    /// With its magnitude.
    Magnitude(&'a PhotometryRow),
    /// As a limit: nothing was seen.
    Limit(&'a PhotometryRow),
}

impl<'a> ExportedRow<'a> {
    /// The row.
    #[must_use]
    pub fn row(self) -> &'a PhotometryRow {
        match self {
            ExportedRow::Magnitude(row) | ExportedRow::Limit(row) => row,
        }
    }
}

/// What is written and what is not.
#[derive(Debug, Default)]
pub struct Selected<'a> {
    /// In the order of the table.
    pub kept: Vec<ExportedRow<'a>>,
    /// Reason and number, in the order in which they came up.
    pub omitted: Vec<(String, usize)>,
}

impl Selected<'_> {
    /// The line for the user: how many are written, how many not and why.
    #[must_use]
    pub fn text(&self) -> String {
        let limits = self.kept.iter().filter(|k| matches!(k, ExportedRow::Limit(_))).count();
        let mut text = format!("{} observations", self.kept.len());
        if limits > 0 {
            text += &format!(" ({limits} of them non-detections)");
        }
        for (i, (why, n)) in self.omitted.iter().enumerate() {
            text += &format!("{}{n} {why}", if i == 0 { "; skipped: " } else { ", " });
        }
        text
    }
}

/// Sorts the rows of a table; `limits` says whether the format has a place for non-detections.
#[must_use]
pub fn select(rows: &[PhotometryRow], choice: Choice, limits: bool) -> Selected<'_> {
    let mut selected = Selected::default();
    for row in rows {
        match judge(row, choice, limits) {
            Ok(kept) => selected.kept.push(kept),
            Err(why) => match selected.omitted.iter_mut().find(|(known, _)| known == why) {
                Some((_, n)) => *n += 1,
                None => selected.omitted.push((why.to_owned(), 1)),
            },
        }
    }
    selected
}

fn judge(row: &PhotometryRow, choice: Choice, limits: bool) -> std::result::Result<ExportedRow<'_>, &'static str> {
    match Status::from_cell(&row.status) {
        Some(Status::Ok | Status::Nondetection) => {}
        Some(Status::Rejected) => return Err("rejected frames"),
        _ => return Err("failed frames"),
    }
    match Verdict::from_cell(&row.verdict) {
        Some(Verdict::Caution) if !choice.caution => {
            return Err("of verdict caution (argument `verdicts use,caution` writes them)");
        }
        Some(Verdict::Reject) if !choice.reject => {
            return Err("of verdict reject (argument `verdicts use,caution,reject` writes them)");
        }
        _ => {}
    }
    if row.mjd_mid_d.is_none() {
        return Err("without a time");
    }
    if row.status == Status::Nondetection {
        return match row.limit_v_mag {
            Some(_) if limits => Ok(ExportedRow::Limit(row)),
            Some(_) => Err("non-detections (the format has no place for limits)"),
            None => Err("non-detections without a limiting magnitude"),
        };
    }
    if is_lower_limit(row.flags) {
        return Err("lower limits on the brightness (something may have stood in the beam)");
    }
    match (row.v_mag, row.v_mag_err) {
        (Some(_), Some(_)) => Ok(ExportedRow::Magnitude(row)),
        (Some(_), None) => Err("without an uncertainty of the magnitude"),
        _ => Err("without a calibrated magnitude"),
    }
}

/// Total 1-sigma error of a magnitude \[mag\]: random and systematic in quadrature; the random one where the systematic
/// one is not known, which formats with room for a comment say.
pub(super) fn total_err_mag(row: &PhotometryRow) -> Option<f64> {
    row.v_mag_err.map(|random| random.hypot(row.v_mag_err_sys.unwrap_or(0.0)))
}

/// A number with `decimals` at most, without closing zeros.
pub(super) fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    let rounded = (value * scale).round() / scale;
    if rounded == 0.0 { 0.0 } else { rounded } // never -0
}
