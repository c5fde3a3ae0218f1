//! Error against run time: methods with a knob, the knob turned, against a converged reference.
//!
//! Errors in the unit a sweep names, CPU time in microseconds for one piece of work. The caller brings the clock: the
//! library never reads it. One thread, so that CPU time is run time. Leaves out what has no knob, and so
//! far penumbra, platforms, ephemerides, time grids and the median.

mod apertures;
mod background_mesh;
mod earth_reflected;
mod extremes;
mod sky_map;
mod source_disc;
mod sweep;
mod zeropoint_fit;

pub use extremes::{Extreme, Verdict, extremes};
pub use sweep::{Errors, Point, Series, Sweep};

use crate::error::Result;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Few cases, under a minute for all sweeps together.
    Quick,
    /// Enough cases for a worst error that means something.
    Full,
}

impl Effort {
    /// `quick` or `full`, as the effort is.
    fn of<T>(self, quick: T, full: T) -> T {
        match self {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }
}

/// What a sweep needs from outside.
#[derive(Clone, Copy)]
pub struct Stopwatch<'a> {
    /// CPU seconds this process has used so far.
    pub cpu_s: &'a dyn Fn() -> f64,
    /// How much is measured.
    pub effort: Effort,
}

/// One method: its name, one line about it, and its sweep.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// Name on the command line and in file names.
    pub name: &'static str,
    /// What is swept.
    pub about: &'static str,
    sweep: fn(&Stopwatch) -> Result<Sweep>,
}

impl Method {
    /// Turns the knob.
    ///
    /// # Errors
    /// Only if what is built into the program cannot be read.
    pub fn sweep(&self, stopwatch: &Stopwatch) -> Result<Sweep> {
        (self.sweep)(stopwatch)
    }
}

/// Every method that has a sweep.
pub const METHODS: &[Method] = &[
    Method {
        name: "earth-reflected",
        about: "light by way of the Earth: tolerance of the integral, by scattering law",
        sweep: earth_reflected::sweep,
    },
    Method {
        name: "source-disc",
        about: "the Sun's disc in a direct reflection: a point, or averaged",
        sweep: source_disc::sweep,
    },
    Method { name: "sky-map", about: "an all-sky map: spacing of its grid", sweep: sky_map::sweep },
    Method {
        name: "background-mesh",
        about: "the sky under a frame: size of the boxes of its mesh",
        sweep: background_mesh::sweep,
    },
    Method { name: "apertures", about: "share of a pixel in an aperture: subpixels or exact", sweep: apertures::sweep },
    Method {
        name: "zeropoint-fit",
        about: "zeropoint, extinction and colour: the estimator of the fit",
        sweep: zeropoint_fit::sweep,
    },
];
