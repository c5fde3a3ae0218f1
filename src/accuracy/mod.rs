//! Error against run time: methods with a knob, the knob turned, against a converged reference.
//!
//! Errors in the unit a sweep names, CPU time in microseconds for one piece of work. The caller brings the clock: the
//! library never reads it. One thread, so that CPU time is run time. It does not cover what has no knob.

mod apertures;
mod background_mesh;
mod compliance;
mod constellation;
mod earth_frames;
mod earth_reflected;
mod effort;
mod ephemeris;
mod extremes;
pub mod figure;
mod fit_rounds;
mod light_curve;
mod median;
mod model_fit;
mod night;
mod night_plan;
pub mod output;
mod paths;
mod penumbra;
mod platform;
mod resolved;
mod sensor;
mod simulated;
mod sky_map;
mod sky_points;
mod source_disc;
mod star_trails;
mod sweep;
mod target;
mod time_grid;
mod timing;
mod trail_length;
mod zeropoint_fit;

pub use effort::{Effort, Stopwatch};

pub use extremes::{Extreme, Verdict, extremes};
pub use paths::paths;
pub use sweep::{Errors, Place, Series, Sweep, SweepPoint};
pub use timing::CpuTime;

use crate::base::error::Result;

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
    /// If what is built into the program cannot be read; [`crate::Error::Io`] of the folder of a simulated night.
    pub fn sweep(&self, stopwatch: &Stopwatch) -> Result<Sweep> {
        (self.sweep)(stopwatch)
    }
}

/// Every method that has a sweep.
pub const METHODS: &[Method] = &[
    Method {
        name: "night",
        about: "the magnitude of a satellite from raw frames, end to end: every key that moves it",
        sweep: night::sweep,
    },
    Method {
        name: "night-zeropoint",
        about: "the zeropoint from raw frames, end to end: every key that moves it",
        sweep: night::zeropoint_sweep,
    },
    Method {
        name: "light-curve",
        about: "V along the passes of a day: step between rows, tolerance of the model",
        sweep: light_curve::sweep,
    },
    Method {
        name: "constellation",
        about: "how many satellites are bright over a night: share of them, step, tolerance",
        sweep: constellation::sweep,
    },
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
    Method {
        name: "penumbra",
        about: "the edge of the Earth's shadow: points in the air, or rings of the Sun's disc",
        sweep: penumbra::sweep,
    },
    Method { name: "platform", about: "a platform of kilometres: how it is divided", sweep: platform::sweep },
    Method {
        name: "renderer",
        about: "resolved pictures of satellites: pixels, samples, rays, the Earth's integral, sides of round shapes",
        sweep: resolved::sweep,
    },
    Method {
        name: "sensor",
        about: "a picture blurred by a telescope: steps of the grid, reach of a star's image",
        sweep: sensor::sweep,
    },
    Method {
        name: "plan-night",
        about: "the plan of a night: step along a pass, tolerance of the model",
        sweep: night_plan::sweep,
    },
    Method {
        name: "compliance",
        about: "the share of sky and time brighter than a limit: directions, moments",
        sweep: compliance::sweep,
    },
    Method {
        name: "model-fit",
        about: "a law of the phase angle fitted to passes: its degree, their number",
        sweep: model_fit::sweep,
    },
    Method { name: "sky-map", about: "an all-sky map: spacing of its grid", sweep: sky_map::sweep },
    Method {
        name: "sky-points",
        about: "the median over a sky: how many directions, even or random",
        sweep: sky_points::sweep,
    },
    Method {
        name: "time-grid",
        about: "Sun and Moon along a pass or a day: recomputed, or interpolated",
        sweep: time_grid::sweep,
    },
    Method {
        name: "ephemeris",
        about: "Sun and Moon: what an ephemeris does to the magnitude",
        sweep: ephemeris::sweep,
    },
    Method {
        name: "earth-frames",
        about: "celestial to Earth-fixed axes: neglected terms",
        sweep: earth_frames::sweep,
    },
    Method {
        name: "background-mesh",
        about: "the sky under a frame: size of the boxes of its mesh",
        sweep: background_mesh::sweep,
    },
    Method {
        name: "target",
        about: "the flux of a target: apertures, and the weights of a point and of a free size",
        sweep: target::sweep,
    },
    Method {
        name: "star-trails",
        about: "the zeropoint of a tracked frame by its star trails: how many trails are fitted",
        sweep: star_trails::sweep,
    },
    Method {
        name: "trail-length",
        about: "a target beside star trails that end in the frame: what is known of their length",
        sweep: trail_length::sweep,
    },
    Method { name: "apertures", about: "share of a pixel in an aperture: subpixels or exact", sweep: apertures::sweep },
    Method {
        name: "zeropoint-fit",
        about: "zeropoint, extinction and colour: the estimator of the fit",
        sweep: zeropoint_fit::sweep,
    },
    Method { name: "fit-rounds", about: "the robust zeropoint fit: its rounds", sweep: fit_rounds::sweep },
    Method { name: "median", about: "the median of flats: network, selection or sort", sweep: median::sweep },
];
