//! The errors of the library as exceptions of Python, with the same sentence.

use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    satphot,
    SatphotError,
    PyValueError,
    "What satphot cannot do: the sentence names the value, what is accepted and what to do."
);

/// The exception of an error of the library.
pub fn raise(error: satphot::Error) -> PyErr {
    match error {
        satphot::Error::Interrupted { problem, .. } => PyKeyboardInterrupt::new_err(problem),
        other => SatphotError::new_err(other.to_string()),
    }
}

/// The exception of an argument that is wrong.
pub fn bad(name: &str, problem: String) -> PyErr {
    raise(satphot::Error::Argument { name: name.into(), problem })
}
