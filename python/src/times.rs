//! Moments as 64-bit nanoseconds since 1970-01-01, of UTC (every day 86 400 s) or of TAI.

use hifitime::{Duration, Epoch};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use rayon::prelude::*;
use satphot::base::time::parse_utc;

use crate::errors::{bad, raise};
use crate::interrupt::{Stopped, interrupted};

/// MJD of 1970-01-01.
const MJD_1970: f64 = 40_587.0;
/// What numpy calls "not a time".
pub const NOT_A_TIME: i64 = i64::MIN;

/// The moment of a number of nanoseconds.
pub fn epoch(ns: i64, is_tai: bool) -> PyResult<Epoch> {
    if ns == NOT_A_TIME {
        return Err(bad("times", "a moment is missing (NaT); every row needs one".into()));
    }
    let since = Duration::from_total_nanoseconds(i128::from(ns));
    Ok(if is_tai { Epoch::from_mjd_tai(MJD_1970) + since } else { Epoch::from_unix_duration(since) })
}

/// All of them, unless that is stopped.
pub fn epochs(ns: &[i64], is_tai: bool, stopped: Stopped) -> PyResult<Vec<Epoch>> {
    let one = |ns: &i64| if stopped() { Err(raise(interrupted())) } else { epoch(*ns, is_tai) };
    ns.par_iter().map(one).collect()
}

/// Nanoseconds of UTC since 1970 of a moment.
pub fn unix_ns(epoch: Epoch) -> i64 {
    i64::try_from(epoch.to_unix_duration().total_nanoseconds()).unwrap_or(NOT_A_TIME)
}

/// Texts such as 2025-06-09T10:33:12 (UTC, or with a zone) to nanoseconds since 1970.
#[pyfunction]
pub fn parse_times<'py>(py: Python<'py>, texts: Vec<String>) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let parsed: PyResult<Vec<i64>> =
        texts.iter().map(|text| parse_utc("times", text).map(unix_ns).map_err(raise)).collect();
    Ok(parsed?.into_pyarray(py))
}
