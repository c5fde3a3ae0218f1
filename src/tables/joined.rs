//! A foreign table with satphot's columns behind its own, as a table that every writer takes.
//!
//! Cells of the foreign columns stay as they are; what they hold is what the header says, else what every cell is. Missing is an
//! empty cell. Leaves out cells beyond the columns of a damaged row.

use csv::StringRecord;

use super::ecsv::photometry_cells;
use super::formats::Table;
use super::meta::Meta;
use super::read;
use super::schema::{Column, Datatype, PhotometryRow};
use crate::base::error::{Error, Result};

/// What is put behind the name of a column that the foreign table has, too.
const OWN: &str = "_satphot";

/// The columns and cells of a foreign table `file`, and behind them those of `added`, row for row.
///
/// # Errors
/// [`Error::Table`] where the table has a column of the name of one of satphot's and of that name with `_satphot`, too.
pub fn appended(
    name: &'static str,
    file: &str,
    (input, records): (&[read::Column], &[StringRecord]),
    (added, rows): (&[Column], &[PhotometryRow]),
    meta: Meta,
) -> Result<Table> {
    let bad = |problem: String| Error::Table { path: file.into(), line: None, problem };
    let known = |name: &str| input.iter().any(|c| c.name.eq_ignore_ascii_case(name));
    let datatypes: Vec<Datatype> = input.iter().enumerate().map(|(i, c)| datatype(c, i, records)).collect();
    let described = format!("column of {file}");
    let foreign = |(column, datatype): (&read::Column, &Datatype)| {
        Column::foreign(&column.name, &column.unit, &column.ucd, *datatype, &described)
    };
    let mut columns: Vec<Column> = input.iter().zip(&datatypes).map(foreign).collect();
    for column in added {
        if !known(column.name) {
            columns.push(*column);
            continue;
        }
        let renamed = format!("{}{OWN}", column.name);
        if known(&renamed) {
            let problem =
                format!("has the columns `{}` and `{renamed}` of an earlier result; remove them", column.name);
            return Err(bad(problem));
        }
        columns.push(column.renamed(&renamed));
    }
    let own = photometry_cells(added, rows).map_err(|e| bad(e.to_string()))?;
    let records = records.iter().zip(own).map(|(record, own)| {
        let cells = (0..input.len()).map(|i| clean(record.get(i).unwrap_or_default(), datatypes[i]));
        cells.chain(own.iter()).collect()
    });
    Ok(Table { name, columns, records: records.collect(), meta, ignored: Vec::new() })
}

/// What a cell holds where a number that is none stands for a missing one.
fn clean(cell: &str, datatype: Datatype) -> &str {
    match datatype {
        Datatype::Float64 if read::number(cell).is_none() => "",
        _ => cell,
    }
}

/// What every cell of a column is: as the header says, if they are that.
fn datatype(column: &read::Column, i: usize, records: &[StringRecord]) -> Datatype {
    let cells = || records.iter().map(|r| r.get(i).unwrap_or_default()).filter(|c| !c.is_empty());
    // a number with leading zeros is a name
    let is_whole = |c: &str| c.parse::<i64>().is_ok_and(|v| v.to_string() == c);
    let is_missing =
        |c: &str| matches!(c.to_ascii_lowercase().as_str(), "nan" | "inf" | "-inf" | "+inf" | "--" | "null");
    let is_real = |c: &str| c.parse::<f64>().is_ok_and(f64::is_finite) || is_missing(c);
    let none = cells().next().is_none();
    match column.datatype {
        Some(Datatype::Text) => Datatype::Text,
        Some(stated) if none => stated,
        _ if none => Datatype::Text,
        Some(Datatype::Float64) if cells().all(is_real) => Datatype::Float64,
        _ if cells().all(is_whole) => Datatype::Int64,
        _ if cells().all(is_real)
            && cells().any(|c| !is_missing(c))
            && !cells().any(|c| c.len() > 1 && c.starts_with('0') && c.bytes().all(|b| b.is_ascii_digit())) =>
        {
            Datatype::Float64
        }
        _ => Datatype::Text,
    }
}
