//! A table as a file of the format that its ending names.

use std::path::Path;

use super::ecsv::write_cells;
use super::formats::{Table, provenance, write_csv, write_fits_table, write_votable};
use crate::base::error::{Error, Result};
use crate::base::file::write_streamed;

/// Endings of files that [`write`] writes.
pub const ENDINGS: &str = ".ecsv, .csv, .fits, .vot, .votable, .xml, .parquet";

/// Refuses a file whose ending is of no format.
///
/// # Errors
/// [`Error::Argument`] with the endings; for `.parquet` where satphot was built without it.
pub fn check_ending(path: &Path) -> Result<()> {
    let problem = match ending(path).as_str() {
        "ecsv" | "csv" | "fits" | "fit" | "vot" | "votable" | "xml" => return Ok(()),
        "parquet" if cfg!(feature = "parquet") => return Ok(()),
        "parquet" => format!("{}: this satphot was built without the feature parquet", path.display()),
        _ => format!("{} ends in none of {ENDINGS}", path.display()),
    };
    Err(Error::Argument { name: "out".into(), problem })
}

fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Writes a table in the format that the ending of the file names.
///
/// # Errors
/// As [`check_ending`]; those of the writers.
pub fn write(path: &Path, table: &Table) -> Result<()> {
    check_ending(path)?;
    match ending(path).as_str() {
        "ecsv" => write_cells(path, &table.records, &table.columns, &table.meta),
        "csv" => write_streamed(path, |file| write_csv(file, table)),
        "fits" | "fit" => write_fits_table(path, table, &provenance(&table.meta, None, None)?),
        #[cfg(feature = "parquet")]
        "parquet" => write_streamed(path, |file| super::formats::write_parquet(file, table)),
        _ => write_streamed(path, |file| write_votable(file, table)),
    }
}
