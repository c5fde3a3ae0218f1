//! Zeropoint, extinction and colour term of a table of matched stars.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyList;
use satphot::Config;
use satphot::ndarray::Array2;
use satphot::tables::{STARS, StarRow};
use satphot::zeropoint::matched::{Matched, Request, fit_matched, without_config};

use crate::errors::{SatphotError, bad, raise};
use crate::interrupt::interruptible;
use crate::table::{Columns, Data};

/// A zeropoint with its terms and their covariance.
#[pyclass(frozen, module = "satphot._satphot")]
pub struct Zeropoint {
    of: satphot::Zeropoint,
    notes: Vec<String>,
    rows: Vec<StarRow>,
}

impl From<satphot::Zeropoint> for Zeropoint {
    fn from(of: satphot::Zeropoint) -> Self {
        Self { of, notes: Vec::new(), rows: Vec::new() }
    }
}

#[pymethods]
impl Zeropoint {
    /// A number of the zeropoint by its name.
    fn number(&self, name: &str) -> PyResult<f64> {
        let z = &self.of;
        let value = match name {
            "zp_mag" => z.zp_mag,
            "k_mag_airmass" => z.k_mag_airmass,
            "c_mag_mag" => z.c_mag_mag,
            "k2_mag" => z.k2_mag,
            "rms_mag" => z.rms_mag,
            "robust_sigma_mag" => z.robust_sigma_mag,
            "intrinsic_mag" => z.intrinsic_mag,
            "line_of_sight_mag" => z.line_of_sight_mag,
            "chi2_dof" => z.chi2_dof.unwrap_or(f64::NAN),
            "p_value" => z.p_value.unwrap_or(f64::NAN),
            "airmass_mean" => z.airmass_mean,
            "b_v_mean_mag" => z.b_v_mean_mag,
            other => return Err(bad("name", format!("\"{other}\" is not a number of a zeropoint"))),
        };
        Ok(value)
    }

    /// Measurements with weight, different stars among them, measurements without weight, pointings.
    #[getter]
    fn counts(&self) -> (usize, usize, usize, usize) {
        (self.of.n_used, self.of.n_stars, self.of.n_rejected, self.of.n_pointings)
    }

    /// Covariance of (ZP, k, C, k''), for 68 % or for 95 % of nights.
    fn covariance<'py>(&self, py: Python<'py>, of_95: bool) -> Bound<'py, PyArray2<f64>> {
        let cov = if of_95 { &self.of.cov_95 } else { &self.of.cov };
        Array2::from_shape_fn((4, 4), |(i, j)| cov[i][j]).into_pyarray(py)
    }

    /// How k, C, k'' and the covariance were determined.
    #[getter]
    fn determined(&self) -> (String, String, String, String) {
        let z = &self.of;
        (z.k_note.clone(), z.c_note.clone(), z.k2_note.clone(), z.cov_note.clone())
    }

    /// The equation, with the name of its band and its colour.
    #[getter]
    fn equation(&self) -> String {
        self.of.equation()
    }

    /// What the observer should know.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.iter().chain(&self.of.warnings).cloned().collect()
    }

    /// Calibrated magnitudes, their errors of calibration and half-widths of 95 % [mag].
    fn calibrate<'py>(
        &self,
        py: Python<'py>,
        inst_mag: PyReadonlyArray1<'py, f64>,
        airmass: PyReadonlyArray1<'py, f64>,
        b_v_mag: PyReadonlyArray1<'py, f64>,
        b_v_err_mag: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 3]> {
        let (m, x) = (inst_mag.as_slice()?, airmass.as_slice()?);
        let (c, dc) = (b_v_mag.as_slice()?, b_v_err_mag.as_slice()?);
        if [x.len(), c.len(), dc.len()] != [m.len(); 3] {
            return Err(bad("inst_mag", format!("{} magnitudes, {} airmasses, {} colours", m.len(), x.len(), c.len())));
        }
        let column = |value: &dyn Fn(usize) -> f64| (0..m.len()).map(value).collect::<Vec<f64>>().into_pyarray(py);
        Ok([
            column(&|i| self.of.v_mag(m[i], x[i], c[i])),
            column(&|i| self.of.err_mag(x[i], c[i], dc[i])),
            column(&|i| self.of.err_95_mag(x[i], c[i], dc[i])),
        ])
    }

    /// The columns of the rows of the table, with weight and residual or why they were excluded.
    fn stars<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let rows = &self.rows;
        let mut columns = Columns::default();
        let numbers: [(&str, fn(&StarRow) -> Option<f64>); 10] = [
            ("inst_mag", |r| r.inst_mag),
            ("inst_mag_err", |r| r.inst_mag_err),
            ("airmass", |r| r.airmass),
            ("catalogue_v_mag", |r| r.catalogue_v_mag),
            ("catalogue_v_mag_err", |r| r.catalogue_v_mag_err),
            ("catalogue_b_v_mag", |r| r.catalogue_b_v_mag),
            ("catalogue_b_v_mag_err", |r| r.catalogue_b_v_mag_err),
            ("fit_weight", |r| r.fit_weight),
            ("fit_residual_mag", |r| r.fit_residual_mag),
            ("fit_leverage", |r| r.fit_leverage),
        ];
        columns.of(&STARS, "star_id", Data::Text(rows.iter().map(|r| r.star_id.clone()).collect()));
        for (name, value) in numbers {
            columns.of(&STARS, name, Data::Float(rows.iter().map(|r| value(r).unwrap_or(f64::NAN)).collect()));
        }
        columns.of(&STARS, "status", Data::Text(rows.iter().map(|r| r.status.to_string()).collect()));
        columns.of(&STARS, "reason", Data::Text(rows.iter().map(|r| r.reason.clone()).collect()));
        columns.into_py(py)
    }
}

/// How a table is to be read.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Reading {
    columns: BTreeMap<String, String>,
    band: String,
    inst_constant_mag: f64,
    config: Option<PathBuf>,
    settings: Vec<String>,
}

/// The zeropoint of a file.
#[pyfunction]
pub fn fit_zeropoint(py: Python<'_>, table: PathBuf, reading: Reading) -> PyResult<Zeropoint> {
    let shown = table.display().to_string();
    fitted(py, &table, &shown, &reading)
}

/// Cells of a column.
#[derive(FromPyObject)]
pub enum Cells<'py> {
    /// Numbers; one that is not finite is missing.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// Texts.
    Texts(Vec<String>),
}

/// The zeropoint of columns.
#[pyfunction]
pub fn fit_zeropoint_of_columns(
    py: Python<'_>,
    names: Vec<String>,
    columns: Vec<Cells<'_>>,
    reading: Reading,
) -> PyResult<Zeropoint> {
    let mut texts = Vec::new();
    for cells in &columns {
        texts.push(match cells {
            Cells::Numbers(values) => {
                let text = |v: &f64| if v.is_finite() { v.to_string() } else { String::new() };
                values.as_slice()?.iter().map(text).collect()
            }
            Cells::Texts(values) => values.iter().map(|text| quoted(text)).collect::<Vec<String>>(),
        });
    }
    let n = texts.first().map_or(0, Vec::len);
    for (name, column) in names.iter().zip(&texts) {
        if column.len() != n {
            return Err(bad("table", format!("column {name} has {} rows, the first has {n}", column.len())));
        }
    }
    let mut csv = names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(",") + "\n";
    for row in 0..n {
        csv += &texts.iter().map(|column| column[row].as_str()).collect::<Vec<_>>().join(",");
        csv.push('\n');
    }
    let io = |error: std::io::Error| SatphotError::new_err(format!("the table cannot be kept for the fit: {error}"));
    let folder = tempfile::tempdir().map_err(io)?;
    let table = folder.path().join("table.csv");
    std::fs::write(&table, csv).map_err(io)?;
    fitted(py, &table, "table", &reading)
}

/// A cell of comma-separated values.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\"").replace(['\n', '\r'], " "))
}

/// The fit to a file, which messages call `shown`.
fn fitted(py: Python<'_>, table: &Path, shown: &str, reading: &Reading) -> PyResult<Zeropoint> {
    let config = match &reading.config {
        Some(path) => Config::load(path, &reading.settings),
        None => without_config(&reading.settings),
    };
    let config = config.map_err(raise)?;
    let request = Request {
        table,
        columns: reading.columns.clone(),
        band: &reading.band,
        inst_constant_mag: reading.inst_constant_mag,
    };
    let place = table.display().to_string();
    let matched = interruptible(py, 0, false, |_| fit_matched(&config, &request))?;
    let matched = matched.map_err(|error| SatphotError::new_err(error.to_string().replace(&place, shown)))?;
    let Matched { rows, zeropoint, notes, .. } = matched;
    let notes = notes.into_iter().map(|note| note.replace(&place, shown)).collect();
    match zeropoint {
        Ok(of) => Ok(Zeropoint { of, notes, rows }),
        Err(problem) => Err(SatphotError::new_err(problem.replace(&place, shown))),
    }
}
