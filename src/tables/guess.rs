//! Which column of a foreign table holds a quantity: by the names, else by the descriptors (UCD) that the quantity has.
//!
//! Each reader keeps its own list of quantities. What the user states about columns comes before any guess, and how he
//! states it is the reader's affair.

use std::collections::BTreeMap;

use super::read::{Table, number};
use super::unit::{Measure, unit_in_name};
use crate::base::error::{Error, Result};

/// One quantity that a reader looks for.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// The key under which the user may name its column.
    pub key: &'static str,
    /// The names of its column, separated by blanks, best first; `{}` is the band, `{l}` the band in small letters.
    pub names: &'static str,
    /// The descriptors of its column, of VOTables old and new, best first.
    pub ucds: &'static [&'static str],
}

impl Quantity {
    /// A quantity that is known by the names of its column alone.
    #[must_use]
    pub const fn named(key: &'static str, names: &'static str) -> Self {
        Self { key, names, ucds: &[] }
    }
}

/// The keys of all quantities, for messages.
#[must_use]
pub fn keys(quantities: &[Quantity]) -> String {
    quantities.iter().map(|q| q.key).collect::<Vec<_>>().join(", ")
}

/// The first key of `columns` that is none of the quantities.
#[must_use]
pub fn unknown_key<'a>(quantities: &[Quantity], columns: &'a BTreeMap<String, String>) -> Option<&'a str> {
    columns.keys().map(String::as_str).find(|key| quantities.iter().all(|q| q.key != *key))
}

/// Where a quantity is from, as the user names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Given {
    /// A column.
    Column(usize),
    /// The same number for all rows.
    Constant(f64),
}

/// What the user names for `key`, a column or a number for all rows; `None` if he names nothing.
///
/// # Errors
/// [`Error::Argument`] if it is neither, with the columns present.
pub fn given(table: &Table, columns: &BTreeMap<String, String>, key: &str) -> Result<Option<Given>> {
    let Some(name) = columns.get(key) else { return Ok(None) };
    let found = table.column(name).map(Given::Column);
    found.or_else(|| number(name).map(Given::Constant)).map(Some).ok_or_else(|| Error::Argument {
        name: format!("column {key}={name}"),
        problem: format!("no such column in {}; present: {}", table.path.display(), table.names()),
    })
}

/// What the numbers of column `i` are multiplied by to be in the unit that ends `key`: 1 where the column states no unit.
///
/// # Errors
/// [`Error::Table`] with the column, its unit, and those that are read.
pub fn factor_of(table: &Table, key: &str, i: usize) -> Result<f64> {
    let (Some(measure), Some(column)) = (Measure::of_key(key), table.columns.get(i)) else { return Ok(1.0) };
    let (stated, named) = (column.unit.trim(), unit_in_name(&column.name));
    let wrong = |problem: String| Error::Table { path: table.path.clone(), line: None, problem };
    let unit = if stated.is_empty() { named } else { stated };
    if unit.is_empty() {
        return Ok(1.0);
    }
    let factor = measure.factor(unit);
    if !named.is_empty() && factor != measure.factor(named).or(factor) {
        return Err(wrong(format!(
            "column `{}` is in `{unit}` by its unit and in `{named}` by its name: correct one of them",
            column.name
        )));
    }
    factor.ok_or_else(|| Error::Table {
        path: table.path.clone(),
        line: None,
        problem: format!(
            "column `{}` is in `{}`, but {key} is needed ({}): is it another quantity? argument `column {key}=NAME` names the \
             column",
            column.name,
            unit,
            measure.accepted()
        ),
    })
}

/// Guesses the columns of one table.
#[derive(Debug, Clone, Copy)]
pub struct ColumnGuesser<'a> {
    /// The table.
    pub table: &'a Table,
    /// What is looked for in it.
    pub quantities: &'static [Quantity],
    /// The band of its magnitudes.
    pub band: &'a str,
}

impl ColumnGuesser<'_> {
    fn quantity(&self, key: &str) -> Option<&'static Quantity> {
        self.quantities.iter().find(|q| q.key == key)
    }

    /// The names of the column of a quantity.
    pub fn names(&self, key: &str) -> impl Iterator<Item = &'static str> {
        self.quantity(key).map_or("", |q| q.names).split_whitespace()
    }

    /// The column of a quantity: by name, else by descriptor.
    #[must_use]
    pub fn column_of(&self, key: &str) -> Option<usize> {
        self.by_name(key).or_else(|| self.by_ucd(key))
    }

    /// The column of a quantity by name alone.
    #[must_use]
    pub fn by_name(&self, key: &str) -> Option<usize> {
        self.first_of(self.names(key))
    }

    /// The column of a quantity by descriptor alone.
    #[must_use]
    pub fn by_ucd(&self, key: &str) -> Option<usize> {
        let ucds = self.quantity(key).map_or(&[] as &[&str], |q| q.ucds);
        ucds.iter().find_map(|ucd| self.table.columns.iter().position(|c| c.ucd.eq_ignore_ascii_case(ucd)))
    }

    /// The column that has the first of these names that is there.
    pub fn first_of<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Option<usize> {
        names.into_iter().find_map(|name| self.column(name))
    }

    /// The column of this name, with the band put in. `{l}` alone means a column only where the band is a capital, so that
    /// `V` and `v` differ.
    fn column(&self, name: &str) -> Option<usize> {
        let small = self.band.to_lowercase();
        if name == "{l}" && small == self.band {
            return None;
        }
        self.table.column(&name.replace("{}", self.band).replace("{l}", &small))
    }

    /// The column of the errors of column `i`, by the name of that: `e_Vmag` of `Vmag`, `flux_err` of `flux`,
    /// `MAGERR_AUTO` of `MAG_AUTO`.
    #[must_use]
    pub fn errors_of(&self, i: usize) -> Option<usize> {
        let name = &self.table.columns[i].name;
        let of_errors = [
            name.replace("MAG_", "MAGERR_"),
            name.replace("FLUX_", "FLUXERR_"),
            format!("e_{name}"),
            format!("{name}_err"),
            format!("{name}err"),
            format!("{name}_error"),
            format!("err_{name}"),
            format!("sigma_{name}"),
            name.replace("_mag", "_magerr"),
            name.replace("mag_", "magerr_"),
        ];
        of_errors.iter().find_map(|n| self.table.column(n).filter(|j| *j != i))
    }
}
