//! A number of a row: from a column, times what makes satphot's unit of its own, or the same in all rows.

use crate::tables::guess::Given;
use crate::tables::read::{Row, Table};

/// Where a number is from, and what it is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number {
    pub(super) from: Given,
    pub(super) factor: f64,
    /// Whether the table or the user states the unit.
    pub unit_is_stated: bool,
}

impl Number {
    /// In a row; `None` where the cell is no number.
    #[must_use]
    pub fn of(&self, row: &Row) -> Option<f64> {
        match self.from {
            Given::Column(i) => row.number(i).map(|v| v * self.factor),
            Given::Constant(v) => Some(v),
        }
    }

    /// In a row, needed.
    ///
    /// # Errors
    /// The column and its cell, in words.
    pub fn needed(&self, row: &Row, table: &Table) -> std::result::Result<f64, String> {
        self.of(row).ok_or_else(|| {
            let Given::Column(i) = self.from else { return String::new() };
            let (name, cell) = (&table.columns[i].name, row.get(i));
            if cell.is_empty() { format!("{name} is empty") } else { format!("{name}: \"{cell}\" is not a number") }
        })
    }

    /// Its column.
    #[must_use]
    pub fn column(&self) -> Option<usize> {
        if let Given::Column(i) = self.from { Some(i) } else { None }
    }
}

impl Number {
    /// The same in all rows.
    #[must_use]
    pub fn of_constant(value: f64) -> Self {
        Self { from: Given::Constant(value), factor: 1.0, unit_is_stated: true }
    }
}
