//! pipeline.toml -> [`Config`]: one file, one struct per room, units in the keys.
//!
//! An unknown key is an error that names the nearest known one; ranges are checked once, in [`Config::load`].
//! Paths in the file are relative to the file. Nothing here reads frames or knows physics.

mod check;
pub(crate) mod digest;
mod effects;
mod empirical;
mod fetch;
mod file;
mod layers;
mod load;
mod model;
mod photometry;
mod range;
mod reporter;
mod surface;
mod vetting;

pub use file::{
    Config, DateObsMeans, Detector, Frames, HeaderRules, Input, Instrument, Night, QUANTITIES, SatelliteEntry, Site,
    Telescope, Time,
};

pub(crate) use check::check_surface;
pub use effects::{
    Arrays, Backs, Distances, EarthRadius, Effects, EffectsTable, GroundMoonlight, LunarEclipse, Mode, MoonLaw,
    MoonPastLimit, MuArea, PlatformSize, Sampling, Shadow, Source, SourceDisc,
};
pub use empirical::{Empirical, PhaseLaw};
pub use fetch::Fetch;
pub use layers::PRESETS;
pub use layers::preset_text;
pub(crate) use layers::{deserialize, merge, read_layers};
pub use load::ELEMENTS;
pub use model::{Model, Orbit};
pub use photometry::{
    ApertureShape, Combine, Estimator, Flat, FlatScale, Photometry, Pin, Solve, Stars, Target, Zeropoint,
};
pub(crate) use range::range;
pub use reporter::Reporter;
pub use surface::{Attitude, Brdf, Surface};
pub use vetting::Vetting;
