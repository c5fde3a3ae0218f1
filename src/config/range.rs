//! Whether a value lies in its range.

use crate::base::error::Error;
use crate::base::error::Result;

/// `lo <= value <= hi`, or an error with the unit.
pub(crate) fn range(key: &str, value: f64, lo: f64, hi: f64, unit: &str) -> Result<()> {
    if value >= lo && value <= hi {
        return Ok(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Err(bad(key, format!("{value} is outside {lo} to {hi}{unit}")))
}

pub(crate) fn bad(key: &str, problem: String) -> Error {
    Error::Config { key: key.into(), problem }
}
