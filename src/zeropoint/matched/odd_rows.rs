//! Repeated rows of a matched table, and numbers with a decimal comma.
//!
//! It does not cover rows without a value, which the columns themselves refuse.

use std::collections::HashSet;

use super::columns::Columns;
use crate::base::error::{Error, Result};
use crate::tables::StarRow;
use crate::tables::read::{Row, Table};

/// Rows seen so far: the same star with the same numbers in the same frame is one measurement, however often it is written.
#[derive(Debug, Default)]
pub struct Seen {
    named: HashSet<(String, String, [u64; 7])>,
    whole: HashSet<String>,
}

impl Seen {
    /// Whether this row is there already. Stars without a name are the same only where all of the row is.
    pub fn again(&mut self, row: &Row, star: &StarRow, columns: &Columns, table: &Table) -> bool {
        if columns.has_names() {
            let bits = |v: Option<f64>| v.unwrap_or(f64::NAN).to_bits();
            let numbers = [
                bits(star.mjd_mid_d),
                bits(star.inst_mag),
                bits(star.inst_mag_err),
                bits(star.catalogue_v_mag),
                bits(star.catalogue_b_v_mag),
                bits(star.airmass),
                bits(star.exptime_s),
            ];
            return !self.named.insert((star.star_id.clone(), star.object_name.clone(), numbers));
        }
        let cells: Vec<&str> = (0..table.columns.len()).map(|i| row.get(i)).collect();
        !self.whole.insert(cells.join("\u{1f}"))
    }
}

/// The note on the number of such rows; `None` if there are none.
pub fn repeated_note(n: usize) -> Option<String> {
    (n > 0)
        .then(|| format!("{n} rows are in the table twice (same frame, same star, same numbers): each is counted once"))
}

/// Refuses a decimal comma where a number is needed.
///
/// # Errors
/// [`Error::Table`] with the column, the value and what to do.
pub fn no_decimal_comma(row: &Row, columns: &Columns, table: &Table) -> Result<()> {
    let with_comma = |i: &usize| row.get(*i).contains(',') && row.get(*i).replacen(',', ".", 1).parse::<f64>().is_ok();
    match columns.numbers().into_iter().find(with_comma) {
        None => Ok(()),
        Some(i) => Err(Error::Table {
            path: table.path.clone(),
            line: Some(row.line),
            problem: format!(
                "column `{}` holds `{}`, a number with a decimal comma: write numbers with a point (in a spreadsheet \
                 export with an English locale, or sed 's/,/./g' where columns are not separated by commas)",
                table.columns[i].name,
                row.get(i)
            ),
        }),
    }
}

/// Refuses a table without rows.
///
/// # Errors
/// [`Error::Table`].
pub fn some_rows(n: usize, table: &Table) -> Result<()> {
    if n > 0 {
        return Ok(());
    }
    Err(Error::Table {
        path: table.path.clone(),
        line: None,
        problem: format!(
            "holds {} columns ({}) but no rows: was the match empty, or a selection left switched on when it was written?",
            table.columns.len(),
            table.names()
        ),
    })
}
