//! satphot for Python: arrays in, arrays out.
//!
//! The module `_satphot` takes arrays of floats and integers of nanoseconds; the package `satphot` around it takes lists,
//! texts and what astropy makes, and names the columns. Nothing here computes: all of that is in the library. The
//! interpreter's lock is released while the library works, and Ctrl-C is answered.

mod apertures;
mod background;
mod elements;
mod errors;
mod interrupt;
mod limits;
mod model;
mod night;
mod passes;
mod sky;
mod table;
mod times;
mod zeropoint;

use pyo3::prelude::*;

/// The compiled part of satphot.
#[pymodule]
mod _satphot {
    #[pymodule_export]
    use crate::apertures::sum_apertures;
    #[pymodule_export]
    use crate::background::Background;
    #[pymodule_export]
    use crate::errors::SatphotError;
    #[pymodule_export]
    use crate::limits::limit_defaults;
    #[pymodule_export]
    use crate::limits::limits;
    #[pymodule_export]
    use crate::model::Model;
    #[pymodule_export]
    use crate::model::satellite_names;
    #[pymodule_export]
    use crate::night::Night;
    #[pymodule_export]
    use crate::passes::passes;
    #[pymodule_export]
    use crate::sky::sky;
    #[pymodule_export]
    use crate::times::parse_times;
    #[pymodule_export]
    use crate::zeropoint::Zeropoint;
    #[pymodule_export]
    use crate::zeropoint::fit_zeropoint;
    #[pymodule_export]
    use crate::zeropoint::fit_zeropoint_of_columns;
}
