//! Columns with their units and descriptions, handed to Python as arrays.

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use satphot::tables::{Definition, PHOTOMETRY, Table, formats::Cell};

/// What a column holds.
pub enum Data {
    /// Numbers; a missing one is NaN.
    Float(Vec<f64>),
    /// Whole numbers.
    Int(Vec<i64>),
    /// Moments, nanoseconds of UTC since 1970.
    Time(Vec<i64>),
    /// Texts; a missing one is empty.
    Text(Vec<String>),
    /// Texts of a short list: the place in the list.
    Code(Vec<u8>, Vec<String>),
}

/// A column with its unit, as astropy spells it, and a line about it.
pub struct Column {
    name: String,
    unit: String,
    description: String,
    data: Data,
}

/// A table as its columns.
#[derive(Default)]
pub struct Columns(Vec<Column>);

impl Columns {
    /// Adds a column that a table of the library has, with the library's unit and description.
    pub fn of(&mut self, definition: &Definition, name: &str, data: Data) {
        let known = definition.columns.iter().chain(PHOTOMETRY.columns).find(|c| c.name == name);
        let (unit, description) = known.map_or(("", ""), |c| (c.unit, c.description));
        self.own(name, unit, description, data);
    }

    /// Adds a column that no table of the library has.
    pub fn own(&mut self, name: &str, unit: &str, description: &str, data: Data) {
        self.0.push(Column { name: name.into(), unit: unit.into(), description: description.into(), data });
    }

    /// The columns as a list of (name, kind, unit, description, array or list).
    pub fn into_py<'py>(self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let columns = self.0.into_iter().map(|column| {
            let (kind, values) = match column.data {
                Data::Float(values) => ("float", values.into_pyarray(py).into_any()),
                Data::Int(values) => ("int", values.into_pyarray(py).into_any()),
                Data::Time(values) => ("time", values.into_pyarray(py).into_any()),
                Data::Text(values) => ("text", PyList::new(py, values)?.into_any()),
                Data::Code(codes, names) => {
                    let codes = codes.into_pyarray(py).into_any();
                    ("code", PyTuple::new(py, [codes, PyList::new(py, names)?.into_any()])?.into_any())
                }
            };
            (column.name, kind, column.unit, column.description, values).into_pyobject(py)
        });
        PyList::new(py, columns.collect::<PyResult<Vec<_>>>()?)
    }
}

/// A table that was read from a file. A column of whole numbers of which one is missing becomes one of floats.
pub fn of_file(table: &Table) -> Columns {
    let mut cells: Vec<Vec<Cell>> = table.columns.iter().map(|_| Vec::with_capacity(table.records.len())).collect();
    for record in &table.records {
        for (column, cell) in cells.iter_mut().zip(table.cells(record)) {
            column.push(cell);
        }
    }
    let mut columns = Columns::default();
    for (column, cells) in table.columns.iter().zip(cells) {
        columns.own(column.name, column.unit, column.description, data(&cells));
    }
    columns
}

fn data(cells: &[Cell]) -> Data {
    if cells.iter().any(|cell| matches!(cell, Cell::Text(_))) {
        let text = |cell: &Cell| if let Cell::Text(text) = cell { (*text).to_owned() } else { String::new() };
        return Data::Text(cells.iter().map(text).collect());
    }
    let whole = |cell: &Cell| match cell {
        Cell::Int64(value) => *value,
        Cell::Int32(value) => value.map(i64::from),
        Cell::Text(_) | Cell::Float64(_) => None,
    };
    let all: Option<Vec<i64>> = cells.iter().map(whole).collect();
    if let Some(values) = all.filter(|_| !cells.is_empty()) {
        return Data::Int(values);
    }
    let number = |cell: &Cell| match cell {
        Cell::Float64(value) => value.unwrap_or(f64::NAN),
        other => whole(other).map_or(f64::NAN, |v| v as f64),
    };
    Data::Float(cells.iter().map(number).collect())
}
