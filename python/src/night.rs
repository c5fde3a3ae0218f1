//! A night from its raw frames to tables.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use pyo3::prelude::*;
use pyo3::types::PyList;
use satphot::Config;
use satphot::base::progress::Silent;
use satphot::pipeline::options::Options;
use satphot::pipeline::run::run;
use satphot::tables::ecsv::read_table;

use crate::errors::raise;
use crate::interrupt::interruptible;
use crate::table::of_file;
use crate::zeropoint::Zeropoint;

/// The number of the signal that Ctrl-C sends.
const SIGINT: usize = 2;

/// The configuration of a night.
#[pyclass(frozen, module = "satphot._satphot")]
pub struct Night {
    config: Config,
}

/// Folder, zeropoint, notes, problems, summary of a reduced night.
type Reduced = (PathBuf, Option<Zeropoint>, Vec<String>, Vec<String>, String);

#[pymethods]
impl Night {
    /// Reads a configuration; `settings` are KEY=VALUE over it.
    #[new]
    fn new(path: PathBuf, settings: Vec<String>) -> PyResult<Self> {
        Ok(Self { config: Config::load(&path, &settings).map_err(raise)? })
    }

    /// The configuration with everything that the file leaves to defaults, as TOML.
    #[getter]
    fn toml(&self) -> PyResult<String> {
        self.config.to_toml().map_err(raise)
    }

    /// Reduces the night into `<output>/<name>/`. A first Ctrl-C ends it after the frames in work.
    fn run(&self, py: Python<'_>, threads: usize, redo: bool, figures: bool) -> PyResult<Reduced> {
        let options = Options { jobs: threads, no_figures: !figures, redo, ..Options::default() };
        let flag = options.stop.flag();
        let summary = interruptible(py, 0, false, |stopped| {
            std::thread::scope(|scope| {
                let (done, is_done) = std::sync::mpsc::channel::<()>();
                scope.spawn(move || {
                    let period = std::time::Duration::from_millis(20);
                    while is_done.recv_timeout(period) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                        if stopped() {
                            flag.store(SIGINT, Ordering::Relaxed);
                        }
                    }
                });
                let summary = run(&self.config, &options, &Silent);
                drop(done);
                summary
            })
        })?
        .map_err(raise)?;
        let text = summary.text();
        let zeropoint = summary.zeropoint.map(Zeropoint::from);
        Ok((summary.folder, zeropoint, summary.notes, summary.poor, text))
    }

    /// The columns of a table that a run has written; nothing where it wrote none.
    #[staticmethod]
    fn table<'py>(py: Python<'py>, folder: PathBuf, name: &str) -> PyResult<Option<Bound<'py, PyList>>> {
        let path: &Path = &folder.join(format!("{name}.ecsv"));
        if !path.exists() {
            return Ok(None);
        }
        let table = py.detach(|| read_table(path)).map_err(raise)?;
        of_file(&table).into_py(py).map(Some)
    }
}
